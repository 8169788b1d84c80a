//! parry3d's `Bvh`, which rapier builds on.

use crate::ground::Ground;
use parry3d::bounding_volume::{Aabb as Bounds, BoundingVolume};
use parry3d::partitioning::{Bvh, BvhBuildStrategy, BvhLeafUpdateStatus, BvhWorkspace};
use rayon::ThreadPool;
use rayon::prelude::*;
use sapwise::{Aabb, BroadPhase, Error, Pairs};
use std::sync::Arc;

/// How the tree is updated before its pairs are found.
#[derive(Clone, Copy)]
pub(crate) enum Upkeep {
    /// Refit alone.
    Refit,
    /// One step of `optimize_incremental`, then refit: what rapier does in each frame.
    Optimise,
    /// Rebuild by binned splits, in the memory of the old tree.
    Rebuild,
}

/// Updates the leaves, then the tree, and traverses it against itself. With a pool the leaf updates, the refit and the
/// traversal run in parallel; `optimize_incremental` and `rebuild` have no parallel form.
pub(crate) struct Parry {
    upkeep: Upkeep,
    pool: Option<Arc<ThreadPool>>,
    tree: Bvh,
    workspace: BvhWorkspace,
    updates: Vec<(Bounds, u32, f32)>,
    statuses: Vec<BvhLeafUpdateStatus>,
}

fn bounds(b: &Aabb) -> Bounds {
    Bounds::new(b.min.into(), b.max.into())
}

impl Ground for Bvh {
    fn build(boxes: &[Aabb]) -> Self {
        Self::from_iter(BvhBuildStrategy::Binned, boxes.iter().map(bounds).enumerate())
    }

    fn query(&self, b: &Aabb, found: impl FnMut(u32)) {
        self.intersect_aabb(&bounds(b)).for_each(found);
    }
}

/// Adapts the number of leaves to the number of boxes. If more than `few` boxes come or go, rebuilds the tree, which
/// is faster than changing it box by box. Otherwise removes surplus leaves; missing ones are inserted by their update.
fn resize(tree: &mut Bvh, boxes: &[Aabb], few: usize) {
    let (before, now) = (tree.leaf_count() as usize, boxes.len());
    if before.abs_diff(now) > few {
        *tree = Bvh::build(boxes);
    } else {
        (now..before).for_each(|k| tree.remove(k as u32));
    }
}

impl Upkeep {
    /// Returns the most boxes that may come or go without a rebuild.
    fn few(self, boxes: usize) -> usize {
        match self {
            Self::Refit | Self::Optimise => boxes / 4,
            Self::Rebuild => 0,
        }
    }
}

impl Parry {
    pub(crate) fn new(upkeep: Upkeep, pool: Option<&Arc<ThreadPool>>) -> Self {
        let (tree, workspace) = (Bvh::new(), BvhWorkspace::default());
        Self { upkeep, pool: pool.cloned(), tree, workspace, updates: Vec::new(), statuses: Vec::new() }
    }

    fn update(&mut self, boxes: &[Aabb]) {
        resize(&mut self.tree, boxes, self.upkeep.few(boxes.len()));
        let parallel = self.pool.is_some();
        if parallel {
            let updates = boxes.par_iter().enumerate().map(|(k, b)| (bounds(b), k as u32, 0.0));
            updates.collect_into_vec(&mut self.updates);
            self.tree.insert_or_update_batch_partially_parallel(&self.updates, &mut self.statuses);
        } else {
            for (k, b) in (0..).zip(boxes) {
                self.tree.insert_or_update_partially(bounds(b), k, 0.0);
            }
        }
        if let Upkeep::Optimise = self.upkeep {
            self.tree.optimize_incremental(&mut self.workspace);
        }
        match self.upkeep {
            Upkeep::Rebuild => self.tree.rebuild(&mut self.workspace, BvhBuildStrategy::Binned),
            _ if parallel => self.tree.refit_parallel(&mut self.workspace),
            // The order of the nodes does not change, so sorting them again gains nothing.
            Upkeep::Refit => self.tree.refit_without_opt(),
            Upkeep::Optimise => self.tree.refit(&mut self.workspace),
        }
    }
}

impl BroadPhase for Parry {
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        pairs.clear();
        if let Some(pool) = self.pool.clone() {
            let found = pool.install(|| {
                self.update(boxes);
                self.tree.traverse_bvtt_single_tree_parallel::<false>()
            });
            found.into_iter().for_each(|(a, b)| pairs.push(a, b));
        } else {
            self.update(boxes);
            self.tree.traverse_bvtt_single_tree::<false>(&mut self.workspace, &mut |a, b| pairs.push(a, b));
        }
        pairs.finish()
    }
}

/// Margin of a leaf on each side, as a share of the box's shortest edge. In `uniform` and `resting` half of it is
/// slower or as fast.
const MARGIN: f32 = 0.2;

/// Returns the margin around a box. It follows the shortest edge, because the leaf of a sheet or a rod would otherwise
/// touch many others. It is above zero, because without a margin parry3d detects no change.
pub(crate) fn margin(b: &Aabb) -> f32 {
    let edge = (0..3).map(|a| b.max[a] - b.min[a]).fold(f32::INFINITY, f32::min);
    (edge * MARGIN).max(f32::MIN_POSITIVE)
}

/// Frames from one step of `optimize_incremental` to the next: parry's documentation asks for 5 to 10; in each frame
/// is slower in `uniform` and `resting`.
const OPTIMISE_EVERY: u32 = 5;

/// All nodes are refitted if more than one box in `PARTIAL` left its leaf: a partial refit walks up from each.
const PARTIAL: usize = 8;

/// How a leaf is updated that its box has left.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Leaving {
    /// It grows in place, and the tree is optimised every few frames.
    Stays,
    /// It is removed and inserted again. If there are few such leaves, only the paths from them are refitted.
    Reinserted,
}

/// The scheme of rapier's broad phase: leaves have a margin, and only those that their boxes left are searched. A list
/// of near pairs is kept from frame to frame; the near pairs that overlap are the pairs.
pub(crate) struct Margin {
    leaving: Leaving,
    tree: Bvh,
    workspace: BvhWorkspace,
    changed: Vec<bool>,
    /// The leaves that changed in this frame and in the one before it.
    changes: [Vec<u32>; 2],
    near: Vec<(u32, u32)>,
    frame: u32,
}

impl Margin {
    pub(crate) fn new(leaving: Leaving) -> Self {
        let (tree, workspace, changes) = (Bvh::new(), BvhWorkspace::default(), [Vec::new(), Vec::new()]);
        Self { leaving, tree, workspace, changed: Vec::new(), changes, near: Vec::new(), frame: 0 }
    }

    /// Makes every leaf hold its box, and notes which leaves changed.
    fn update(&mut self, boxes: &[Aabb]) {
        let [now, before] = &mut self.changes;
        std::mem::swap(now, before);
        now.clear();
        for ((k, b), changed) in (0..).zip(boxes).zip(&mut self.changed) {
            let status = match self.leaving {
                Leaving::Stays => self.tree.insert_or_update_partially(bounds(b), k, margin(b)),
                Leaving::Reinserted => self.tree.reinsert_or_update_with_change_detection(bounds(b), k, margin(b)),
            };
            *changed = status != BvhLeafUpdateStatus::Unchanged;
            now.extend(changed.then_some(k));
        }
        self.frame = self.frame.wrapping_add(1);
        if self.leaving == Leaving::Reinserted && now.len().max(before.len()) < boxes.len() / PARTIAL {
            return self.tree.refit_partial(before, now);
        }
        if self.leaving == Leaving::Stays && self.frame.is_multiple_of(OPTIMISE_EVERY) {
            self.tree.optimize_incremental(&mut self.workspace);
        }
        self.tree.refit(&mut self.workspace);
    }
}

impl BroadPhase for Margin {
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        pairs.clear();
        if self.changed.len() != boxes.len() {
            let leaves = boxes.iter().map(|b| bounds(b).loosened(margin(b))).enumerate();
            self.tree = Bvh::from_iter(BvhBuildStrategy::Binned, leaves);
            self.changed.resize(boxes.len(), true);
            // All leaves count as changed, so that the next refit is a full one.
            self.changes[0] = (0..boxes.len() as u32).collect();
            self.near.clear();
            self.tree.traverse_bvtt_single_tree::<false>(&mut self.workspace, &mut |a, b| self.near.push((a, b)));
        } else {
            self.update(boxes);
            let changed = &self.changed;
            self.near.retain(|&(a, b)| !changed[a as usize] && !changed[b as usize]);
            self.tree.traverse_bvtt_single_tree::<true>(&mut self.workspace, &mut |a, b| self.near.push((a, b)));
        }
        for &(a, b) in &self.near {
            if boxes[a as usize].overlaps(&boxes[b as usize]) {
                pairs.push(a, b);
            }
        }
        pairs.finish()
    }
}
