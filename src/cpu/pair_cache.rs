//! The pairs of fat AABBs, kept from frame to frame. A fat AABB is a box grown by a margin; here it is called a grown
//! box.
//!
//! While every box stays within its grown box, every overlapping pair is among the pairs of grown boxes. So a frame
//! costs one test of each box and one of each kept pair. A box that leaves its grown box gets a new one, and a tree of
//! the grown boxes finds its new neighbours. When these queries have become expensive, the tree is sorted anew, over
//! several frames. If all this takes longer than finding all pairs with a tree of the boxes themselves, such a tree
//! finds them until the boxes slow down.
//!
//! Verlet (Phys. Rev. 159, 1967) kept such lists of neighbours for molecules.

mod budget;
mod grown;
mod motion;
mod prices;
mod sift;
mod tree;
mod width;

use crate::broad_phase::{FrameKind, FrameWork};
use crate::clock::{Instant, measured_ns};
use crate::cpu::mean_time::is_as_many;
use crate::cpu::tree::FAR;
use crate::cpu::{Input, Made, Members, Outputs, Simd, Threads, Upkeep, Workers};
use crate::registry::thread_counts;
use crate::{Aabb, BroadPhase, Error, FramePlan, Pairs, SceneStats, check_count};
use budget::Budget;
use grown::{Grown, Margin, Share};
use motion::{Motion, Work};
use sift::Sift;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
pub(crate) use tree::GrownTree;

/// Boxes for each list of kept pairs. With a cache line each they take 256 KB, which most second-level caches hold.
const BOXES_PER_LIST: usize = 4096;

/// Fewest boxes for each list if there are several. With 3000 boxes, five lists took 1.05 times as long as two.
const SMALLEST_LIST: usize = 1024;

/// The method; see the module.
#[derive(Debug)]
struct PairCache {
    /// All workers, and the numbers of threads on which some of them run: 1, 2, 4, ... and all.
    all: Workers,
    widths: Vec<usize>,
    /// Those of the last frame.
    workers: Workers,
    /// The number of boxes for which costs were learned.
    fitted_for: usize,
    outputs: Outputs,
    motion: Motion,
    grown: Grown,
    /// Of the grown boxes while pairs are kept, of the boxes themselves otherwise.
    tree: GrownTree,
    /// Of the tree while pairs are not kept.
    upkeep: Upkeep,
    /// The share of the boxes of each task.
    shares: Vec<Share>,
    /// The kept pairs, in a list for each part of the tree. A pair is in the list of the part in which it was found,
    /// so the boxes of a list are near in space, and in the cache together.
    kept: Vec<Pairs>,
    last_frame: FrameKind,
}

/// The result of keeping pairs in a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kept {
    /// The pairs are complete, and keeping pays.
    Pays,
    /// The pairs are complete, but finding them from scratch would be cheaper.
    CostsMore,
    /// The pairs are incomplete: nothing is kept, or there were too many pairs to keep.
    Incomplete,
}

pub(super) fn create(threads: u32, pools: &Threads, simd: Simd) -> Made {
    Ok(Box::new(pair_cache(threads, pools, simd, pools.timed())))
}

/// `timed`: it decides by the clock.
fn pair_cache(threads: u32, pools: &Threads, simd: Simd, timed: bool) -> PairCache {
    let all = Workers::new("pair-cache", threads, pools);
    let tasks = all.tasks();
    PairCache {
        outputs: Outputs::default(),
        motion: Motion::new(timed),
        grown: Grown::new(simd),
        tree: GrownTree::new(simd),
        upkeep: Upkeep::new(timed),
        shares: (0..tasks).map(|_| Share::default()).collect(),
        kept: vec![Pairs::new()],
        last_frame: FrameKind::FromScratch,
        workers: all.fit(0),
        fitted_for: 0,
        widths: thread_counts(threads).map(|k| k as usize).collect(),
        all,
    }
}

impl BroadPhase for PairCache {
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        self.find_pairs_with(&FramePlan::default(), boxes, pairs)
    }

    fn find_pairs_with(&mut self, plan: &FramePlan, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        pairs.clear();
        check_count(boxes.len())?;
        self.fit(boxes.len());
        let started = Instant::now();
        let margin = self.motion.advise(plan, boxes);
        self.workers = self.workers_for(boxes.len(), margin.is_some());
        let _frame = self.workers.frame()?;
        let kept = match margin {
            None => Kept::Incomplete,
            Some(margin) => {
                self.upkeep.forget();
                let kept = self.keep(plan, boxes, (margin, started), pairs);
                if kept != Ok(Kept::Pays) {
                    // The grown boxes may be half of this frame and half of the previous one.
                    self.grown.forget();
                    if let Ok(kept) = kept {
                        self.motion.stop(kept == Kept::Incomplete);
                    } else {
                        self.motion.interrupt();
                    }
                }
                kept?
            }
        };
        if kept == Kept::Incomplete {
            pairs.clear();
            let Self { workers, tree, upkeep, outputs, .. } = self;
            upkeep.find(&mut tree.tree, workers, (plan, boxes), outputs, pairs)?;
            // A frame that first tried to keep pairs is no measure of one from scratch.
            let took =
                measured_ns(started).filter(|_| margin.is_none()).map(|ns| ns as f32 / boxes.len().max(1) as f32);
            self.motion.found_from_scratch(boxes.len(), pairs.overlapping(), took);
            self.last_frame = FrameKind::FromScratch;
        } else {
            self.motion.found(boxes.len(), pairs.overlapping());
        }
        pairs.finish_on(&self.workers)
    }

    fn prepare(&mut self, objects: usize) {
        // The frame that needs the memory reports a refused allocation.
        let _ = self.tree.reserve(objects).and_then(|()| self.grown.reserve(objects));
    }

    fn is_incremental(&self) -> bool {
        true
    }

    fn last_frame(&self) -> FrameWork {
        let keeps = self.last_frame != FrameKind::FromScratch;
        FrameWork::new(self.last_frame, if keeps { f64::from(self.motion.work_over_mean()) } else { 1.0 })
    }

    fn missed_frames(&mut self, frames: u64) {
        self.motion.missed(frames);
    }
}

impl PairCache {
    /// Forgets kept pairs and costs when the number of boxes has changed by a factor of two.
    fn fit(&mut self, boxes: usize) {
        if is_as_many(self.fitted_for, boxes) {
            return;
        }
        self.fitted_for = boxes;
        self.grown.forget();
        // Keeping takes about half the time of finding from scratch. The number may double before the next call that
        // acts.
        self.motion.resize([boxes / 2, 2 * boxes].map(|boxes| self.position(&self.all.fit(boxes))));
        // Lists for all tasks of any width: another number of threads deals nothing out anew.
        let tasks = self.all.fit(boxes).tasks().min((boxes / SMALLEST_LIST).max(1));
        self.kept.resize_with(tasks * boxes.div_ceil(tasks * BOXES_PER_LIST).max(1), Pairs::new);
    }

    /// Returns the position of the number of these threads.
    fn position(&self, workers: &Workers) -> usize {
        self.widths.partition_point(|&width| width < workers.threads())
    }

    /// Returns the threads of the next frame.
    fn workers_for(&mut self, boxes: usize, keeps: bool) -> Workers {
        let busy = self.all.fit(boxes);
        let most = self.position(&busy);
        let prices = &mut self.motion.prices;
        let width = if keeps { prices.keepers.next(most) } else { prices.searchers.next(most) };
        busy.at_most(self.widths[width])
    }

    /// Finds the pairs among the kept ones.
    fn keep(
        &mut self,
        plan: &FramePlan,
        boxes: &[Aabb],
        (margin, started): (Margin, Instant),
        pairs: &mut Pairs,
    ) -> Result<Kept, Error> {
        let Self { workers, outputs, motion, grown, tree, shares, kept, last_frame, .. } = self;
        let workers = &*workers;
        let shares = &mut shares[..workers.tasks()];
        let parts = kept.len();
        let again = motion.next_to_shrink(boxes.len());
        let changes = grown.check(workers, boxes, margin, again.clone(), pairs.filter(), shares)?;
        // Sorting anew takes several frames. If the tree has eight places for three boxes before that ends, it is
        // rebuilt.
        let rebuilt = changes.new.start == 0
            || motion.wants_rebuild(boxes.len(), &changes)
            || tree.tree.is_sparse(2 * boxes.len());
        *last_frame = if rebuilt { FrameKind::Rebuilt } else { FrameKind::Updated };
        if rebuilt {
            grown.grow_all(workers, boxes, motion.renew(plan, boxes, &changes), shares);
            let stats = SceneStats::of(grown.as_slice());
            let input = Input { workers, boxes: grown.as_slice(), screen: pairs.screen() };
            tree.build(input, Members::From(0), &stats)?;
            let most = motion.most_kept(boxes.len());
            // Dense places move from list to list, and each list has grown to its largest.
            if kept.iter().map(Pairs::capacity).sum::<usize>() > most + most / 4 {
                kept.fill_with(Pairs::new);
            }
            kept.iter_mut().for_each(Pairs::clear);
            let budget = Budget::new(most, workers.tasks(), 0);
            workers.each(kept, |k, list| budget.fill(list, |list| tree.tree.self_pairs(k, parts, list)));
            if !kept.iter_mut().all(|list| list.is_complete() && list.reserve_some_more().is_ok()) {
                return Ok(Kept::Incomplete);
            }
        } else {
            changes.gone.clone().for_each(|id| tree.remove(id as u32));
            let far = shares.iter().flat_map(|s| s.far.iter().copied());
            let far = (far, changes.new.start);
            let wanted = motion.wants_renewal(boxes.len()) || tree.tree.is_sparse(boxes.len());
            let input = Input { workers, boxes: grown.as_slice(), screen: pairs.screen() };
            if tree.update(input, far, wanted)? {
                motion.renewed();
            }
            tree.refit(workers, grown.as_slice(), shares.iter().map(|s| &s.left[..]))?;
        }
        let (grown, tree) = (&*grown, &*tree);
        let sift =
            Sift { boxes, grown, tree, parts, far: boxes.len() > FAR, nobody_left: changes.left == 0 || rebuilt };
        let looked = AtomicU64::new(0);
        let budget = Budget::new(motion.most_kept(boxes.len()), workers.tasks(), kept.iter().map(Pairs::len).sum());
        let lists_of_task = parts.div_ceil(workers.tasks());
        outputs.collect(workers, pairs, |found| {
            let tasks = kept.chunks_mut(lists_of_task).zip((0..).step_by(lists_of_task)).zip(found);
            workers.each_of(tasks, |((lists, first), found)| {
                let sift = |(list, k)| budget.fill(list, |list| sift.list(k, list, found));
                looked.fetch_add(lists.iter_mut().zip(first..).map(sift).sum(), Relaxed);
            });
            Ok(())
        })?;
        let kept_pairs: usize = kept.iter().map(Pairs::len).sum();
        let most_kept = motion.most_kept(boxes.len());
        let did = Work { kept_pairs, grown_again: again.len(), nodes: looked.into_inner(), rebuilt };
        let took = measured_ns(started).map(|ns| ns as f32 / boxes.len().max(1) as f32);
        let pays = motion.learn(boxes.len(), &changes, &did, took);
        Ok(match (kept_pairs <= most_kept && kept.iter().all(Pairs::is_complete), pays) {
            (false, _) => Kept::Incomplete,
            (true, false) => Kept::CostsMore,
            (true, true) => Kept::Pays,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::brute::double_loop;
    use crate::scene::{Scenario, Scene};
    use FrameKind::{FromScratch, Rebuilt, Updated};
    use std::ops::Range;

    fn frames(scenario: Scenario, count: usize, plan: &FramePlan) -> Vec<FrameWork> {
        let mut method = pair_cache(1, &Threads::default(), Simd::Portable, false);
        let mut scene = Scene::start(scenario, 1000, 1);
        let mut pairs = Pairs::new();
        let frame = |_| {
            method.find_pairs_with(plan, scene.boxes(), &mut pairs).unwrap();
            scene.advance();
            method.last_frame()
        };
        (0..count).map(frame).collect()
    }

    #[test]
    fn last_frame_reports_the_kind() {
        let kinds = |scenario, plan| frames(scenario, 4, plan).iter().map(|work| work.kind).collect::<Vec<_>>();
        let known = FramePlan::default().with_moved(Some(0.03)).with_pairs(Some(500.0));
        let unknown = FramePlan::default();
        assert_eq!(kinds(Scenario::Uniform, &unknown), [FromScratch, Rebuilt, Updated, Updated]);
        assert_eq!(kinds(Scenario::Uniform, &known), [Rebuilt, Updated, Updated, Updated]);
        assert_eq!(kinds(Scenario::Fast, &unknown), [FromScratch; 4]);
    }

    #[test]
    fn frame_without_a_box_keeps_no_pair_of_an_earlier_one() {
        let mut method = pair_cache(1, &Threads::default(), Simd::Portable, false);
        let mut pairs = Pairs::new();
        for boxes in [20, 0, 20].map(|count| vec![Aabb::cube([0.0; 3], 1.0); count]) {
            let overlapping = boxes.len() * boxes.len().saturating_sub(1) / 2;
            let plan = FramePlan::default().with_moved(Some(0.0)).with_pairs(Some(0.0));
            method.find_pairs_with(&plan, &boxes, &mut pairs).unwrap();
            assert_eq!(pairs.len(), overlapping);
        }
    }

    /// Returns a row of boxes that do not overlap, except those at the positions `together`, which are all alike.
    fn row(objects: usize, at: f32, together: Range<usize>) -> Vec<Aabb> {
        let mut boxes: Vec<Aabb> = (0..objects).map(|k| Aabb::cube([at + k as f32 * 3.0, 0.0, 0.0], 1.0)).collect();
        let place = boxes.get(together.start).copied();
        boxes[together].fill(place.unwrap_or(Aabb::cube([0.0; 3], 1.0)));
        boxes
    }

    #[test]
    fn memory_of_kept_pairs_is_bounded_when_boxes_come_together() {
        // On one thread they have 25 lists.
        let objects = 100_000;
        let still = |pairs| FramePlan::default().with_moved(Some(0.0)).with_pairs(Some(pairs));
        let held = |method: &PairCache| method.kept.iter().map(Pairs::capacity).sum::<usize>() / objects;
        for threads in if cfg!(feature = "parallel") { 1..=2 } else { 1..=1 } {
            let method = || pair_cache(threads, &Threads::default(), Simd::Portable, false);
            let mut pairs = Pairs::new();
            pairs.set_limit(Some(1000));
            // If fewer than half leave their grown boxes, the tree is not built again.
            for together in [0..objects, 0..objects / 3, objects / 2..objects] {
                let mut method = method();
                method.find_pairs_with(&still(0.0), &row(objects, 0.0, 0..0), &mut pairs).unwrap();
                let found = method.find_pairs(&row(objects, 0.0, together.clone()), &mut pairs);
                assert_eq!(found, Err(Error::TooManyPairs { limit: 1000 }), "{threads} threads, {together:?}");
                assert!(held(&method) < 16, "{threads} threads, {together:?}: {} for each box", held(&method));
            }
            // A dense place with two pairs for each box, in one list after the other.
            let mut method = method();
            pairs.set_limit(None);
            for k in 0..25 {
                let dense = k * objects / 25..k * objects / 25 + 633;
                let boxes = row(objects, (k % 2) as f32 * 1.5, dense);
                for _ in 0..12 {
                    method.find_pairs_with(&still(2e5), &boxes, &mut pairs).unwrap();
                }
                assert_eq!((pairs.len(), method.last_frame().kind), (633 * 632 / 2, Updated));
                assert!(held(&method) < 25, "{threads} threads, place {k}: {} for each box", held(&method));
            }
        }
    }

    #[test]
    fn nothing_is_kept_at_first_when_the_number_of_boxes_has_doubled() {
        let mut method = pair_cache(1, &Threads::default(), Simd::Portable, true);
        let mut pairs = Pairs::new();
        for (objects, frames) in [(400, 100), (1000, 3), (400, 3)] {
            let scene = Scene::start(Scenario::Resting, objects, 1);
            (0..frames).for_each(|_| method.find_pairs(scene.boxes(), &mut pairs).unwrap());
            assert!(frames == 100 || method.last_frame().kind == FromScratch, "{objects}");
        }
    }

    /// Returns the shift, in edges, of boxes that go one way for eight frames and then back.
    fn to_and_fro(frame: usize) -> f32 {
        if (frame / 8).is_multiple_of(2) { 0.04 } else { -0.04 }
    }

    /// Returns the kept pairs after each frame, in which boxes move by that shift. `known`: the plan has the motion.
    fn kept(method: &mut PairCache, shifts: impl Iterator<Item = f32>, known: bool) -> Vec<usize> {
        let mut boxes = Scene::start(Scenario::Resting, 1000, 1).boxes().to_vec();
        let mut pairs = Pairs::new();
        let frame = |shift: f32| {
            for (k, b) in boxes.iter_mut().enumerate() {
                // Neighbours move apart and together again.
                let shift = if k % 2 == 0 { shift } else { -shift } * (b.max[0] - b.min[0]);
                (b.min[0], b.max[0]) = (b.min[0] + shift, b.max[0] + shift);
            }
            let plan = FramePlan::default().with_moved(known.then_some(f64::from(shift.abs())));
            method.find_pairs_with(&plan, &boxes, &mut pairs).unwrap();
            method.kept.iter().map(Pairs::len).sum()
        };
        shifts.map(frame).collect()
    }

    #[test]
    fn boxes_that_come_to_rest_keep_few_pairs() {
        let method = || pair_cache(1, &Threads::default(), Simd::Portable, false);
        let rested = *kept(&mut method(), (0..100).map(|_| 0.0), false).last().unwrap();
        let kept = kept(&mut method(), (0..160).map(to_and_fro).chain((0..500).map(|_| 0.0)), false);
        let (moved, late) = (kept[150], kept[659]);
        assert!(rested > 0 && moved > 2 * rested, "{rested} at rest, {moved} moving");
        assert!(late < rested * 3 / 2, "{late} are kept long after, {rested} at rest");
    }

    /// Boxes that walk within a tenth of an edge of their place.
    #[test]
    fn boxes_that_shake_in_place_rarely_leave_their_grown_boxes() {
        let mut method = pair_cache(1, &Threads::default(), Simd::Portable, false);
        let mut scene = Scene::start(Scenario::Tower, 1000, 1);
        let (mut pairs, mut left) = (Pairs::new(), 0);
        for _ in 0..1000 {
            method.find_pairs(scene.boxes(), &mut pairs).unwrap();
            left += method.shares.iter().map(|share| share.left.len()).sum::<usize>();
            scene.advance();
        }
        assert!(left < 5 * 1000, "{left} of a million");
    }

    #[test]
    fn margin_after_frames_of_others_follows_the_new_motion() {
        let mut method = pair_cache(1, &Threads::default(), Simd::Portable, false);
        let moving = *kept(&mut method, (0..160).map(to_and_fro), true).last().unwrap();
        // As after a hundred frames of another method, in which all boxes went elsewhere.
        let mut pairs = Pairs::new();
        let boxes = Scene::start(Scenario::Resting, 1000, 2).boxes().to_vec();
        let plan = FramePlan::default().with_moved(Some(0.0)).with_pairs(Some(500.0));
        method.find_pairs_with(&plan, &boxes, &mut pairs).unwrap();
        let kept: usize = method.kept.iter().map(Pairs::len).sum();
        assert!(kept > 0 && 2 * kept < moving, "{kept} where {moving} were kept before");
    }

    /// Boxes wander, jump, come and go; the tree is sorted anew in between.
    #[test]
    fn pairs_are_right_while_the_tree_is_renewed() {
        let threads = if cfg!(feature = "parallel") { 2 } else { 1 };
        let mut random = 0;
        let mut unit = || {
            random += 1;
            (crate::splitmix::mix(random) >> 40) as f32 / (1 << 24) as f32
        };
        for simd in Simd::every() {
            let mut method = pair_cache(threads, &Threads::default(), simd, false);
            let mut boxes: Vec<Aabb> = (0..2100).map(|_| Aabb::cube([0; 3].map(|_| unit() * 25.0), 0.5)).collect();
            let (mut pairs, mut places, mut renewals, mut kept) = (Pairs::new(), 0, 0, 0);
            for frame in 0..160 {
                for b in &mut boxes {
                    let by = [0; 3].map(|_| unit() * 0.06 - 0.03);
                    (0..3).for_each(|a| (b.min[a], b.max[a]) = (b.min[a] + by[a], b.max[a] + by[a]));
                }
                (0..15).for_each(|_| {
                    let k = (unit() * boxes.len() as f32) as usize;
                    boxes[k] = Aabb::cube([0; 3].map(|_| unit() * 25.0), 0.5);
                });
                match frame {
                    60..80 => drop(boxes.pop()),
                    100..120 => boxes.push(Aabb::cube([unit() * 25.0; 3], 0.5)),
                    _ => {}
                }
                method.motion.prices.keepers = width::Width::new(frame / 40 % 2);
                method.find_pairs(&boxes, &mut pairs).unwrap();
                let expected = double_loop(&boxes);
                assert_eq!(pairs.fingerprint(), expected.fingerprint(), "{simd:?}, frame {frame}");
                kept += u32::from(method.last_frame().kind == Updated);
                renewals += u32::from(method.last_frame().kind == Updated && method.tree.tree.places < places);
                places = method.tree.tree.places;
            }
            assert!(renewals > 1 && kept > 130, "{renewals} renewals, {kept} frames with kept pairs");
        }
    }

    #[test]
    fn work_over_mean_has_the_mean_1() {
        for scenario in [Scenario::Uniform, Scenario::Clustered, Scenario::Slab] {
            let works = frames(scenario, 400, &FramePlan::default());
            let mean = works[100..].iter().map(|work| work.over_mean).sum::<f64>() / 300.0;
            assert!((mean - 1.0).abs() < 0.1, "{scenario}: {mean}");
            let dearer = works[1..].iter().filter(|work| work.kind == Rebuilt).all(|work| work.over_mean > 1.2);
            assert!(dearer, "{scenario}");
        }
    }
}
