//! A moved box against sixteen: the slab test. A ray is a moved box of no extent.

use super::{Floats, LANES, Level, Measure, Node};
use crate::Aabb;

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
    fn measure<L: Level>(&self, node: &Node, most: f32, to: &mut [f32; LANES], _: L) -> u32 {
        // SAFETY: the level proves that this CPU has its instructions; each column has 16 floats.
        unsafe {
            let (mut enter, mut leave) = (L::Lanes::splat(0.0), L::Lanes::splat(most));
            for a in 0..3 {
                let (low, high) = ((&node.low[a], self.high[a]), (&node.high[a], self.low[a]));
                let (near, far) = if self.inverse[a] < 0.0 { (high, low) } else { (low, high) };
                // In this order NaN is no limit.
                enter = times::<L::Lanes>(near, self.inverse[a]).or_more(enter);
                leave = times::<L::Lanes>(far, self.inverse[a]).or_less(leave);
            }
            enter.store(to.as_mut_ptr());
            let low = L::Lanes::load(node.low[0].as_ptr());
            // The second comparison leaves out lanes without a box.
            L::Lanes::bits(enter.at_most(leave)) & L::Lanes::bits(low.at_most(low))
        }
    }
}

/// Returns when a bound of the moved box meets each of these bounds.
///
/// # Safety
/// As for all [`Floats`].
#[inline(always)]
unsafe fn times<F: Floats>((bounds, of_cast): (&[f32; LANES], f32), inverse: f32) -> F {
    // SAFETY: as above; there are 16 floats.
    unsafe { F::load(bounds.as_ptr()).minus(F::splat(of_cast)).times(F::splat(inverse)) }
}
