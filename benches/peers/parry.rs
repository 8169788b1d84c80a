//! parry3d's `Bvh`, which rapier builds on.

use crate::ground::Ground;
use parry3d::bounding_volume::{Aabb as Bounds, BoundingVolume};
use parry3d::partitioning::{Bvh, BvhBuildStrategy, BvhLeafUpdateStatus, BvhWorkspace};
use rayon::ThreadPool;
use rayon::prelude::*;
use sapwise::{Aabb, BroadPhase, Error, Pairs};
use std::sync::Arc;

/// What is done to the tree before its pairs are found.
#[derive(Clone, Copy)]
pub(crate) enum Upkeep {
    /// Refit alone.
    Refit,
    /// One step of `optimize_incremental`, then refit: what rapier does in each frame.
    Optimise,
    /// A new tree by binned splits, in the memory of the old one.
    Rebuild,
}

/// The leaves updated, the tree kept up, then traversed against itself. On a pool the updates, the refit and the
/// traversal run in their parallel form; `optimize_incremental` and `rebuild` have none.
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

/// Makes the leaves as many as the boxes: a new tree where more than `few` come or go, since one by one they take
/// longer; else those beyond the last box are removed, and new ones are inserted when they are updated.
fn resize(tree: &mut Bvh, boxes: &[Aabb], few: usize) {
    let (before, now) = (tree.leaf_count() as usize, boxes.len());
    if before.abs_diff(now) > few {
        *tree = Bvh::build(boxes);
    } else {
        (now..before).for_each(|k| tree.remove(k as u32));
    }
}

impl Upkeep {
    /// How many leaves of so many boxes may come or go one by one.
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
            // The nodes stay where they are, so that there is nothing to gain from sorting them again.
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

/// Leaves larger than their boxes by this share of the box's shortest edge on each side. In `uniform` and `resting`
/// half of it is slower or as fast.
const MARGIN: f32 = 0.2;

/// The margin about a box: no wider for a sheet or a rod, whose leaf would touch many others. Above zero, where
/// parry3d detects no change.
pub(crate) fn margin(b: &Aabb) -> f32 {
    let edge = (0..3).map(|a| b.max[a] - b.min[a]).fold(f32::INFINITY, f32::min);
    (edge * MARGIN).max(f32::MIN_POSITIVE)
}

/// Frames from one step of `optimize_incremental` to the next: parry's documentation asks for 5 to 10; in each frame
/// is slower in `uniform` and `resting`.
const OPTIMISE_EVERY: u32 = 5;

/// If more than one box in this many left its leaf, all nodes are refitted: a partial refit walks up from each.
const PARTIAL: usize = 8;

/// What is done with a leaf that its box has left.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Leaving {
    /// It grows where it is, and the tree is optimised now and then.
    Stays,
    /// It is removed and inserted again, and only the paths from such leaves are refitted if they are few.
    Reinserted,
}

/// The scheme of rapier's broad phase: leaves with a margin, a traversal only where a box left its leaf, and a list
/// of near pairs that is kept from frame to frame; those of them that overlap are the pairs.
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

    /// Puts every box into a leaf that holds it, and notes which leaves changed.
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
