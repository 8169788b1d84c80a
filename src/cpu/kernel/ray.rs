//! A moved box against sixteen: the slab test. A ray is a moved box of no extent.

use super::nearest_first::Measure;
use super::node::{LANES, Node};
use super::sixteen::Sixteen;
use crate::aabb::Aabb;

/// A box on its way; see [`Tree::cast_box`](crate::cpu::tree::Tree::cast_box).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cast {
    low: [f32; 3],
    high: [f32; 3],
    /// One over the motion. Infinite if the box does not move on this axis: then the slab test is the test for overlap.
    /// Only for bounds that touch it computes 0 × ∞, which counts as no limit.
    inverse: [f32; 3],
}

impl Cast {
    pub(crate) fn new(b: &Aabb, motion: [f32; 3]) -> Self {
        Self { low: b.min, high: b.max, inverse: motion.map(f32::recip) }
    }
}

impl Measure for Cast {
    #[inline(always)]
    unsafe fn measure<V: Sixteen>(&self, node: &Node, most: f32, to: &mut [f32; LANES]) -> u32 {
        // SAFETY: the caller has the instructions of `V` enabled.
        unsafe {
            let (mut enter, mut leave) = (V::splat(0.0), V::splat(most));
            for a in 0..3 {
                let (low, high) = ((&node.low[a], self.high[a]), (&node.high[a], self.low[a]));
                let (near, far) = if self.inverse[a] < 0.0 { (high, low) } else { (low, high) };
                let inverse = V::splat(self.inverse[a]);
                let time = |(bounds, of_cast)| V::load(bounds).minus(V::splat(of_cast)).times(inverse);
                // In this order NaN is no limit.
                enter = time(near).or_more(enter);
                leave = time(far).or_less(leave);
            }
            enter.store(to);
            let low = V::load(&node.low[0]);
            // The second comparison leaves out lanes without a box.
            enter.at_most(leave) & low.at_most(low)
        }
    }
}
