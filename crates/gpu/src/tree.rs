//! The levels of a tree over sorted boxes; see `shaders/tree.wgsl`.

use super::kernel::source;
use super::{Bound, Gpu, Kernel, constant};
use sapwise::error::GpuError;

/// Most nodes of the highest level, which a walk tests one after the other.
const MOST_ROOTS: u32 = 64;

/// Most dispatches that a tree takes, of 2^26 boxes.
const MOST_RAISES: u32 = 3;

/// The kernel that makes three levels, with the level below them for each dispatch.
#[derive(Debug)]
pub(super) struct Tree {
    kernel: Kernel,
    tasks: Vec<wgpu::Buffer>,
    bound: Vec<Bound>,
}

/// Returns how many dispatches make the levels over `objects` boxes; each makes three.
pub(super) fn raises(objects: u32) -> u32 {
    let mut count = 1;
    while nodes(objects, 3 * count) > MOST_ROOTS {
        count += 1;
    }
    count
}

/// Returns the nodes of a level, each of which has eight children. Boxes are level 0.
fn nodes(objects: u32, level: u32) -> u32 {
    u64::from(objects).div_ceil(1 << (3 * level)) as u32
}

impl Tree {
    /// A tree over all boxes or, if `of_large`, over the oversized boxes at the end, whose begin is in a table.
    pub(super) fn new(gpu: &Gpu, of_large: bool) -> Result<Self, GpuError> {
        let tasks = (0..MOST_RAISES).map(|k| constant(gpu, "a level", [3 * k, 0, 0, 0])).collect::<Result<_, _>>()?;
        let entry = if of_large { "raise_large" } else { "raise_all" };
        Ok(Self { kernel: Kernel::new(gpu, source::TREE, entry)?, tasks, bound: Vec::new() })
    }

    /// Returns the boxes and nodes of a tree over `objects` boxes, and the seven that a walk may read behind them.
    pub(super) fn elements(objects: u32) -> u64 {
        (0..=3 * raises(objects)).map(|level| u64::from(nodes(objects, level))).sum::<u64>() + 7
    }

    pub(super) fn bind(
        &mut self,
        gpu: &Gpu,
        params: &wgpu::Buffer,
        boxes: &wgpu::Buffer,
        table: Option<&wgpu::Buffer>,
    ) -> Result<(), GpuError> {
        self.bound.clear();
        for task in &self.tasks {
            let mut buffers = vec![(0, params), (1, task), (2, boxes)];
            buffers.extend(table.map(|table| (3, table)));
            self.bound.push(self.kernel.bind(gpu, &buffers)?);
        }
        Ok(())
    }

    pub(super) fn record(&self, pass: &mut wgpu::ComputePass<'_>, objects: u32) {
        for (k, bound) in (1..=raises(objects)).zip(&self.bound) {
            bound.dispatch(pass, nodes(objects, 3 * k));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tree_has_room_for_its_levels_and_few_roots() {
        assert_eq!(Tree::elements(1), 4 + 7);
        assert_eq!(Tree::elements(512), 512 + 64 + 8 + 1 + 7);
        assert_eq!(Tree::elements(513), 513 + 65 + 9 + 2 + 7);
        assert_eq!((raises(32_768), raises(32_769)), (1, 2));
        assert_eq!(raises(1 << 26), MOST_RAISES);
    }
}
