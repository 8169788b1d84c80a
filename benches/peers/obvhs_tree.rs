//! obvhs's `Bvh2`, whose pairs are found by one query for each leaf: it has no traversal of a tree against itself.
//!
//! Its feature `parallel` spreads the build over rayon's threads and changes the sort on one thread too, so that one
//! program can't have both forms; it is off. On two threads the queries are spread here, and the build stays on one.

use crate::ground::Ground;
use crate::parry::margin;
use obvhs::aabb::Aabb as Bounds;
use obvhs::bvh2::Bvh2;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use rayon::ThreadPool;
use rayon::prelude::*;
use sapwise::{Aabb, BroadPhase, Error, Pairs};
use std::sync::Arc;

/// Nodes that one task goes through, with a list of its own.
const TASK: usize = 2048;

/// A tree built by PLOC with the settings of its example `physics`.
pub(crate) struct Obvhs {
    /// Whether the tree is kept from frame to frame and refitted.
    refits: bool,
    pool: Option<Arc<ThreadPool>>,
    builder: PlocBuilder,
    tree: Bvh2,
    bounds: Vec<Bounds>,
    found: Vec<Vec<(u32, u32)>>,
}

impl Obvhs {
    /// Makes one that builds a new tree in each frame, and spreads its queries over the pool, if there is one.
    pub(crate) fn rebuilding(pool: Option<&Arc<ThreadPool>>) -> Self {
        let (builder, tree) = (PlocBuilder::new(), Bvh2::default());
        Self { refits: false, pool: pool.cloned(), builder, tree, bounds: Vec::new(), found: Vec::new() }
    }

    /// Makes one that keeps the tree while the number of boxes stays the same, and refits it.
    pub(crate) fn refitting() -> Self {
        Self { refits: true, ..Self::rebuilding(None) }
    }

    fn update(&mut self, boxes: &[Aabb]) {
        let bounds = boxes.iter().map(|b| bounds(b, 0.0));
        if self.refits && self.tree.primitives_to_nodes.len() == boxes.len() {
            for (b, &node) in bounds.zip(&self.tree.primitives_to_nodes) {
                self.tree.nodes[node as usize].set_aabb(b);
            }
            return self.tree.refit_all();
        }
        self.bounds.clear();
        self.bounds.extend(bounds);
        build(&mut self.builder, &mut self.tree, &self.bounds);
        if self.refits {
            self.tree.init_primitives_to_nodes_if_uninit();
        }
    }
}

/// A box with a margin on each side.
fn bounds(b: &Aabb, margin: f32) -> Bounds {
    Bounds::new(b.min.map(|v| v - margin).into(), b.max.map(|v| v + margin).into())
}

/// Builds the tree anew in its own memory.
fn build(builder: &mut PlocBuilder, tree: &mut Bvh2, bounds: &[Bounds]) {
    let mut indices = std::mem::take(&mut tree.primitive_indices);
    indices.clear();
    indices.extend(0..bounds.len() as u32);
    builder.build_with_bvh(tree, PlocSearchDistance::Minimum, bounds, indices, SortPrecision::U64, 0);
}

/// Calls `found` with each primitive whose leaf touches these bounds. Each leaf holds one primitive.
fn touching(tree: &Bvh2, bounds: Bounds, mut found: impl FnMut(u32)) {
    tree.aabb_traverse(bounds, |tree, at| {
        found(tree.primitive_indices[tree.nodes[at as usize].first_index as usize]);
        true
    });
}

impl Ground for Bvh2 {
    fn build(boxes: &[Aabb]) -> Self {
        let (mut tree, bounds) = (Self::default(), boxes.iter().map(|b| bounds(b, 0.0)).collect::<Vec<_>>());
        build(&mut PlocBuilder::new(), &mut tree, &bounds);
        tree
    }

    fn query(&self, b: &Aabb, found: impl FnMut(u32)) {
        touching(self, bounds(b, 0.0), found);
    }
}

/// Calls `pair` with each leaf among these nodes and each touching leaf of a higher primitive.
fn query(tree: &Bvh2, nodes: std::ops::Range<usize>, mut pair: impl FnMut(u32, u32)) {
    for node in tree.nodes[nodes].iter().filter(|n| n.is_leaf()) {
        let id = tree.primitive_indices[node.first_index as usize];
        touching(tree, *node.aabb(), |other| {
            if id < other {
                pair(id, other);
            }
        });
    }
}

impl BroadPhase for Obvhs {
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        pairs.clear();
        self.update(boxes);
        let (tree, all) = (&self.tree, self.tree.nodes.len());
        let Some(pool) = &self.pool else {
            query(tree, 0..all, |a, b| pairs.push(a, b));
            return pairs.finish();
        };
        self.found.resize_with(all.div_ceil(TASK), Vec::new);
        pool.install(|| {
            self.found.par_iter_mut().enumerate().for_each(|(k, found)| {
                found.clear();
                query(tree, k * TASK..((k + 1) * TASK).min(all), |a, b| found.push((a, b)));
            });
        });
        self.found.iter().flatten().for_each(|&(a, b)| pairs.push(a, b));
        pairs.finish()
    }
}

/// The scheme of obvhs's example `physics` with `Bvh2::move_primitive`: leaves have a margin, and a leaf is moved in
/// the tree when its box leaves it. As in parry3d's scheme, near pairs are kept, and only leaves that moved are
/// queried.
pub(crate) struct Moving {
    builder: PlocBuilder,
    tree: Bvh2,
    leaves: Vec<Bounds>,
    moved: Vec<bool>,
    near: Vec<(u32, u32)>,
}

impl Moving {
    pub(crate) fn new() -> Self {
        let (builder, tree) = (PlocBuilder::new(), Bvh2::default());
        Self { builder, tree, leaves: Vec::new(), moved: Vec::new(), near: Vec::new() }
    }

    /// Puts every box into a leaf that holds it, and notes which leaves are new.
    fn update(&mut self, boxes: &[Aabb]) {
        let (before, now) = (self.leaves.len(), boxes.len());
        self.moved.clear();
        if before.abs_diff(now) > now / 4 {
            self.leaves.clear();
            self.leaves.extend(boxes.iter().map(|b| bounds(b, margin(b))));
            self.moved.resize(now, true);
            build(&mut self.builder, &mut self.tree, &self.leaves);
            return;
        }
        (now..before).for_each(|k| self.tree.remove_primitive(k as u32));
        self.leaves.truncate(now);
        self.moved.resize(now, false);
        for (k, b) in boxes.iter().enumerate() {
            let tight = bounds(b, 0.0);
            let held = |leaf: &Bounds| leaf.min.min(tight.min) == leaf.min && leaf.max.max(tight.max) == leaf.max;
            if self.leaves.get(k).is_some_and(held) {
                continue;
            }
            let leaf = bounds(b, margin(b));
            self.moved[k] = true;
            if k < self.leaves.len() {
                self.tree.move_primitive(leaf, k as u32);
                self.leaves[k] = leaf;
            } else {
                self.tree.insert_primitive(leaf, k as u32);
                self.leaves.push(leaf);
            }
        }
    }
}

impl BroadPhase for Moving {
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        pairs.clear();
        self.update(boxes);
        let (moved, near) = (&self.moved, &mut self.near);
        // A box that is gone counts as moved.
        let stays = |k: u32| moved.get(k as usize) == Some(&false);
        near.retain(|&(a, b)| stays(a) && stays(b));
        for (k, leaf) in (0..).zip(&self.leaves).filter(|&(k, _)| !stays(k)) {
            touching(&self.tree, *leaf, |other| {
                if k < other || k > other && stays(other) {
                    near.push((k, other));
                }
            });
        }
        for &(a, b) in near.iter() {
            if boxes[a as usize].overlaps(&boxes[b as usize]) {
                pairs.push(a, b);
            }
        }
        pairs.finish()
    }
}
