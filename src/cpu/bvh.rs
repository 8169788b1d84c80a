//! A bounding volume hierarchy, built from scratch every frame. Each leaf is compared with the leaves behind it.
//!
//! The cost of a frame follows the numbers of boxes and pairs, wherever the boxes lie and whatever their sizes: see
//! [`tree`](super::tree).

use crate::aabb::Aabb;
use crate::broad_phase::{BroadPhase, check_count};
use crate::cpu::Threads;
use crate::cpu::level::Simd;
use crate::cpu::tree::{Members, Tree};
use crate::cpu::workers::{Outputs, Workers};
use crate::error::Error;
use crate::load::FramePlan;
use crate::pairs::Pairs;

/// The method; see the module.
#[derive(Debug)]
struct Bvh {
    workers: Workers,
    tree: Tree,
    outputs: Outputs,
}

pub(super) fn create(threads: u32, pools: &Threads, simd: Simd) -> Result<Box<dyn BroadPhase>, Error> {
    let workers = Workers::new("bvh", threads, pools)?;
    Ok(Box::new(Bvh { workers, tree: Tree::new(simd), outputs: Outputs::default() }))
}

impl BroadPhase for Bvh {
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        self.find_pairs_with(&FramePlan::default(), boxes, pairs)
    }

    fn find_pairs_with(&mut self, plan: &FramePlan, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        pairs.clear();
        check_count(boxes.len())?;
        let Self { workers, tree, outputs } = self;
        let workers = &workers.fit(boxes.len());
        tree.build(workers, boxes, Members::All, &plan.stats(boxes), pairs.filter())?;
        outputs.find(workers, pairs, |k, parts, list| tree.self_pairs(tree.part(k, parts), list));
        pairs.finish_on(workers)
    }

    fn prepare(&mut self, objects: usize) {
        // The frame that needs the memory reports a refused allocation.
        let _ = self.tree.reserve(objects);
    }
}
