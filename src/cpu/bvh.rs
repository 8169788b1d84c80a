//! A bounding volume hierarchy, refitted or rebuilt in each frame. Each leaf is compared with the leaves behind it.
//!
//! The cost of a frame follows the numbers of boxes and pairs, wherever the boxes lie and whatever their sizes: see
//! [`tree`](super::tree).

use crate::cpu::{Made, Outputs, Simd, Threads, Tree, Upkeep, Workers};
use crate::{Aabb, BroadPhase, Error, FramePlan, Pairs, check_count};

/// The method; see the module.
#[derive(Debug)]
struct Bvh {
    workers: Workers,
    tree: Tree,
    upkeep: Upkeep,
    outputs: Outputs,
}

pub(super) fn create(threads: u32, pools: &Threads, simd: Simd) -> Made {
    let workers = Workers::new("bvh", threads, pools);
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
        let _frame = workers.frame()?;
        upkeep.find(tree, workers, (plan, boxes), outputs, pairs)?;
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
    use crate::cpu::Input;
    use crate::scene::{Scenario, Scene};

    /// Without a clock, so that the test does not depend on the machine.
    #[test]
    fn tree_is_kept_while_boxes_move_little_and_rebuilt_when_they_jump() {
        let builds = |scenario: Scenario| {
            let (mut tree, mut upkeep) = (Tree::new(Simd::Portable), Upkeep::new(false));
            let mut scene = Scene::start(scenario, 2000, 1);
            (0..100).for_each(|_| {
                let input = Input { workers: &Workers::one(), boxes: scene.boxes(), screen: None };
                upkeep.update(&mut tree, input, &FramePlan::default()).unwrap();
                scene.advance();
            });
            upkeep.builds
        };
        let counts = [Scenario::StaticWorld, Scenario::Uniform, Scenario::Teleport, Scenario::Fast].map(builds);
        assert!(counts.is_sorted() && counts[0] < 10 && counts[1] < 40 && counts[3] > 20, "{counts:?}");
    }
}
