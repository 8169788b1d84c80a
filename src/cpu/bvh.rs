//! A bounding volume hierarchy, refitted or rebuilt in each frame. Each leaf is compared with the leaves behind it.
//!
//! The cost of a frame follows the numbers of boxes and pairs, wherever the boxes lie and whatever their sizes: see
//! [`tree`](super::tree).

use crate::aabb::Aabb;
use crate::broad_phase::{BroadPhase, check_count};
use crate::clock::Instant;
use crate::cpu::Threads;
use crate::cpu::level::Simd;
use crate::cpu::outputs::Outputs;
use crate::cpu::tree::{Tree, Upkeep};
use crate::cpu::workers::Workers;
use crate::error::Error;
use crate::load::FramePlan;
use crate::pairs::Pairs;

/// The method; see the module.
#[derive(Debug)]
struct Bvh {
    workers: Workers,
    tree: Tree,
    upkeep: Upkeep,
    outputs: Outputs,
}

pub(super) fn create(threads: u32, pools: &Threads, simd: Simd) -> Result<Box<dyn BroadPhase>, Error> {
    let workers = Workers::new("bvh", threads, pools)?;
    Ok(Box::new(Bvh {
        workers,
        tree: Tree::new(simd),
        upkeep: Upkeep::new(pools.timed()),
        outputs: Outputs::default(),
    }))
}

impl BroadPhase for Bvh {
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        self.find_pairs_with(&FramePlan::default(), boxes, pairs)
    }

    fn find_pairs_with(&mut self, plan: &FramePlan, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        pairs.clear();
        check_count(boxes.len())?;
        let Self { workers, tree, upkeep, outputs } = self;
        let workers = &workers.fit(boxes.len());
        let _frame = workers.frame();
        upkeep.update(tree, workers, boxes, || plan.stats(boxes), pairs.screen())?;
        let started = Instant::now();
        outputs.find(workers, pairs, |k, parts, list| tree.self_pairs(k, parts, list));
        upkeep.searched(started, boxes.len());
        pairs.finish_on(workers)
    }

    fn prepare(&mut self, objects: usize) {
        // The frame that needs the memory reports a refused allocation.
        let _ = self.tree.reserve(objects);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::brute::double_loop;
    use crate::scene::{Scenario, Scene};
    use crate::splitmix::mix;
    use crate::{Filter, Membership};

    /// Boxes walk, jump, come, go, become infinite or invalid, and become fixed or cease to be.
    #[test]
    fn pairs_are_right_in_every_frame_of_churn() {
        let threads = if cfg!(feature = "parallel") { 3 } else { 1 };
        let mut methods: Vec<_> =
            Simd::every().map(|simd| create(threads, &Threads::default(), simd).unwrap()).collect();
        let mut random = 0;
        let mut below = |n: u64| {
            random += 1;
            (mix(random) >> 20) % n
        };
        let cube = |place: [u64; 3], half: f32| Aabb::cube(place.map(|v| v as f32 * 0.01), half);
        let mut boxes: Vec<Aabb> = (0..3000).map(|_| cube([0; 3].map(|_| below(3000)), 0.5)).collect();
        let mut fixed = vec![false; 5000];
        let mut pairs = Pairs::new();
        for frame in 0..120 {
            match below(8) {
                0 => boxes.truncate(boxes.len() - below(300) as usize),
                1 => boxes.extend((0..below(400)).map(|_| cube([0; 3].map(|_| below(3000)), 0.5))),
                2 => (0..40).for_each(|_| {
                    let k = below(boxes.len() as u64) as usize;
                    boxes[k] = cube([0; 3].map(|_| below(3000)), 0.2);
                }),
                3 => boxes[7].max[1] = if frame % 2 == 0 { f32::INFINITY } else { boxes[7].min[1] + 1.0 },
                4 => (0..9).for_each(|_| fixed[below(2000) as usize] ^= true),
                5 => boxes.iter_mut().for_each(|b| b.max[0] += 0.01),
                _ => boxes.iter_mut().for_each(|b| {
                    let by = below(100) as f32 * 0.002 - 0.1;
                    (0..3).for_each(|a| (b.min[a], b.max[a]) = (b.min[a] + by, b.max[a] + by));
                }),
            }
            // Beside nothing, fixed boxes, owners, or groups.
            let of = |(k, &fixed): (usize, &bool)| match frame / 40 {
                0 => Membership { fixed, ..Membership::ALL },
                1 => Membership { fixed, owner: (k % 5) as u32, ..Membership::ALL },
                _ => Membership { groups: 1 << (k % 2), mask: 1 << u32::from(fixed), ..Membership::ALL },
            };
            let filter = (frame % 40 > 12).then(|| Filter::new(fixed.iter().enumerate().map(of).collect()));
            let mut invalid = boxes.clone();
            invalid[2].min[2] = f32::NAN;
            let expected = double_loop(&boxes, |pair| filter.as_ref().is_none_or(|f| f.wants(pair)));
            pairs.set_filter(filter);
            for method in &mut methods {
                if frame % 9 == 5 {
                    assert!(matches!(method.find_pairs(&invalid, &mut pairs), Err(Error::InvalidBox { index: 2, .. })));
                }
                method.find_pairs(&boxes, &mut pairs).unwrap();
                assert_eq!((pairs.len(), pairs.fingerprint()), (expected.len(), expected.fingerprint()), "{frame}");
            }
        }
    }

    /// Without a clock, so that the test does not depend on the machine.
    #[test]
    fn tree_is_kept_while_boxes_move_little_and_rebuilt_when_they_jump() {
        let builds = |scenario: Scenario| {
            let workers = Workers::new("bvh", 1, &Threads::default()).unwrap();
            let (mut tree, mut upkeep) = (Tree::new(Simd::Portable), Upkeep::new(false));
            let mut scene = Scene::start(scenario, 2000, 1);
            (0..100).for_each(|_| {
                let boxes = scene.boxes();
                upkeep.update(&mut tree, &workers, boxes, || FramePlan::default().stats(boxes), None).unwrap();
                scene.advance();
            });
            upkeep.builds()
        };
        let counts = [Scenario::StaticWorld, Scenario::Uniform, Scenario::Teleport, Scenario::Fast].map(builds);
        assert!(counts.is_sorted() && counts[0] < 10 && counts[1] < 40 && counts[3] > 20, "{counts:?}");
    }
}
