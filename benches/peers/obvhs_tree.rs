//! obvhs's `Bvh2`, whose pairs are found by one query for each leaf: it has no traversal of a tree against itself.
//!
//! Its feature `parallel` spreads the build over rayon's threads and changes the sort on one thread too, so that one
//! program can't have both forms; it is off. On two threads the queries are spread here, and the build stays on one.

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
    /// One that builds a new tree in each frame, with its queries spread over the pool where there is one.
    pub(crate) fn rebuilding(pool: Option<&Arc<ThreadPool>>) -> Self {
        let (builder, tree) = (PlocBuilder::new(), Bvh2::default());
        Self { refits: false, pool: pool.cloned(), builder, tree, bounds: Vec::new(), found: Vec::new() }
    }

    /// One that keeps the tree while the number of boxes stays the same.
    pub(crate) fn refitting() -> Self {
        Self { refits: true, ..Self::rebuilding(None) }
    }

    fn update(&mut self, boxes: &[Aabb]) {
        let bounds = boxes.iter().map(|b| Bounds::new(b.min.into(), b.max.into()));
        if self.refits && self.tree.primitives_to_nodes.len() == boxes.len() {
            for (b, &node) in bounds.zip(&self.tree.primitives_to_nodes) {
                self.tree.nodes[node as usize].set_aabb(b);
            }
            return self.tree.refit_all();
        }
        self.bounds.clear();
        self.bounds.extend(bounds);
        let mut indices = std::mem::take(&mut self.tree.primitive_indices);
        indices.clear();
        indices.extend(0..boxes.len() as u32);
        let (distance, precision) = (PlocSearchDistance::Minimum, SortPrecision::U64);
        self.builder.build_with_bvh(&mut self.tree, distance, &self.bounds, indices, precision, 0);
        if self.refits {
            self.tree.init_primitives_to_nodes_if_uninit();
        }
    }
}

/// The pairs of the leaves among some nodes with leaves of higher primitives. Each leaf holds one primitive.
fn query(tree: &Bvh2, nodes: std::ops::Range<usize>, mut pair: impl FnMut(u32, u32)) {
    for node in tree.nodes[nodes].iter().filter(|n| n.is_leaf()) {
        let id = tree.primitive_indices[node.first_index as usize];
        tree.aabb_traverse(*node.aabb(), |tree, at| {
            let other = tree.primitive_indices[tree.nodes[at as usize].first_index as usize];
            if id < other {
                pair(id, other);
            }
            true
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
