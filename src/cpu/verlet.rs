//! A Verlet list: the pairs of boxes grown by a margin, kept from frame to frame.
//!
//! While every box stays within its grown box, every overlapping pair is among the pairs of grown boxes, so a frame costs
//! one look at each box and one test of each kept pair. A box that leaves its grown box gets a new one, and one pass over
//! all grown boxes finds its new neighbours. After many of those the list is made anew by the strips. Where the boxes
//! move too far for that to pay, the strips find the pairs directly and a few boxes are watched for it to end.
//!
//! Verlet (Phys. Rev. 159, 1967) kept such lists of neighbours for molecules; physics engines know the grown boxes as fat
//! boxes.

mod grown;
mod motion;
mod tree;

use crate::broad_phase::check_count;
use crate::cpu::kernel::prefetch;
use crate::cpu::strips::Finder;
use crate::cpu::workers::{Outputs, Workers};
use crate::cpu::{SimdLevel, Threads};
use crate::{Aabb, BroadPhase, Error, Pairs};
use grown::{Grown, Share};
use motion::{Advice, Motion};
use tree::{FAR, Tree};

/// The method; see the module.
#[derive(Debug)]
struct Verlet {
    workers: Workers,
    finder: Finder,
    outputs: Outputs,
    motion: Motion,
    grown: Grown,
    tree: Tree,
    /// One for each task: its share of the boxes.
    shares: Vec<Share>,
    /// One for each task: its share of the kept pairs.
    kept: Vec<Pairs>,
}

/// Kept pairs for each box, at most: beyond them, and in any case beyond memory, keeping them doesn't pay.
const MOST_KEPT: usize = 32;

pub(super) fn create(threads: u32, pools: &Threads, level: SimdLevel) -> Result<Box<dyn BroadPhase>, Error> {
    let workers = Workers::new("verlet", threads, pools)?;
    let tasks = workers.tasks();
    Ok(Box::new(Verlet {
        finder: Finder::new(&workers, level),
        outputs: Outputs::default(),
        motion: Motion::default(),
        grown: Grown::new(level),
        tree: Tree::new(level),
        shares: (0..tasks).map(|_| Share::default()).collect(),
        kept: (0..tasks).map(|_| Pairs::new()).collect(),
        workers,
    }))
}

impl BroadPhase for Verlet {
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        pairs.clear();
        check_count(boxes.len())?;
        let kept = match self.motion.advise(boxes) {
            Advice::Scratch => false,
            Advice::Keep(margin) => {
                self.grown.set_margin(margin);
                let kept = self.keep(boxes, pairs);
                if kept != Ok(true) {
                    // What is known of the grown boxes may be half of this frame and half of the one before.
                    self.grown.forget();
                    self.motion.stop();
                }
                kept?
            }
        };
        if !kept {
            pairs.clear();
            let Self { workers, finder, outputs, .. } = self;
            outputs.collect(workers, pairs, |lists| finder.find(workers, boxes, lists))?;
        }
        self.motion.found(boxes.len(), pairs.len());
        pairs.finish()
    }

    fn prepare(&mut self, objects: usize) {
        // A refused allocation is reported by the frame that needs it.
        self.finder.prepare(objects);
        let _ = self.grown.reserve(objects);
    }

    fn keeps_work(&self) -> bool {
        true
    }
}

impl Verlet {
    /// Finds the pairs among the kept ones; `false` when that does not pay or they are too many.
    fn keep(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<bool, Error> {
        let Self { workers, finder, outputs, motion, grown, tree, shares, kept } = self;
        let changes = grown.check(workers, boxes, shares)?;
        let left = changes.left + changes.gone.len();
        let anew = motion.wants_anew(boxes.len(), left);
        if anew {
            grown.grow_all(workers, boxes, shares);
            tree.build(workers, grown.as_slice())?;
            let most = MOST_KEPT * boxes.len() / kept.len() + 1024;
            for list in kept.iter_mut() {
                list.clear();
                list.set_limit(Some(most));
            }
            finder.find(workers, grown.as_slice(), kept)?;
            kept.iter_mut().try_for_each(Pairs::reserve_some_more)?;
        } else {
            changes.gone.for_each(|id| tree.remove(id as u32));
            changes.new.into_iter().try_for_each(|id| tree.insert(id as u32))?;
            tree.follow(workers, grown.as_slice(), shares.iter().flat_map(|s| s.left.iter().copied()))?;
        }
        let (grown, tree, tasks) = (&*grown, &*tree, kept.len());
        let far = boxes.len() > FAR;
        outputs.collect(workers, pairs, |lists| {
            workers.each_with(kept, lists, |k, kept, list| {
                let overlap = |(i, j): (u32, u32)| overlap(&boxes[i as usize], &boxes[j as usize]);
                let fetch = |(i, j): (u32, u32)| {
                    if far {
                        // Among those that will be dropped are pairs of boxes that are gone.
                        [i, j].iter().filter_map(|&id| boxes.get(id as usize)).for_each(|b| prefetch(&b.min));
                    }
                };
                if left == 0 || anew {
                    list.extend_where(kept.as_slice(), fetch, overlap);
                    return;
                }
                kept.sift(list, |pair| grown.is_dirty(pair), fetch, overlap);
                for i in tree.moved(k, tasks) {
                    grown.meet(tree, i, |j| {
                        kept.push(i, j);
                        if overlap((i, j)) {
                            list.push(i, j);
                        }
                    });
                }
            });
            Ok(())
        })?;
        let total = kept.iter().map(Pairs::len).sum();
        // A list that found more than it may hold has lost some.
        Ok(motion.learn(boxes.len(), left, total, anew) && kept.iter_mut().all(|list| list.finish().is_ok()))
    }
}

/// Whether two boxes overlap, without the branches of [`Aabb::overlaps`]: among kept pairs no branch can be guessed.
#[inline(always)]
fn overlap(a: &Aabb, b: &Aabb) -> bool {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::*;
        // SAFETY: SSE is part of x86-64; floats 0 to 3 and 2 to 5 of an `Aabb`, which is `repr(C)`.
        unsafe {
            let halves = |b: &Aabb| {
                let at = std::ptr::from_ref(b).cast::<f32>();
                (_mm_loadu_ps(at), _mm_loadu_ps(at.add(2)))
            };
            let ((low_a, high_a), (low_b, high_b)) = (halves(a), halves(b));
            // Lower bounds stand in lanes 0 to 2 of the first half, upper ones in lanes 1 to 3 of the second.
            let upper = |high: __m128| _mm_castsi128_ps(_mm_srli_si128::<4>(_mm_castps_si128(high)));
            let meet = _mm_and_ps(_mm_cmple_ps(low_a, upper(high_b)), _mm_cmple_ps(low_b, upper(high_a)));
            _mm_movemask_ps(meet) & 7 == 7
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    {
        let axis = |k: usize| (a.min[k] <= b.max[k]) & (b.min[k] <= a.max[k]);
        axis(0) & axis(1) & axis(2)
    }
}
