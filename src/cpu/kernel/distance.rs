//! The distances of a point to sixteen boxes.

use super::nearest_first::Measure;
use super::node::{LANES, Node};
use super::sixteen::Sixteen;

/// The Euclidean distance of a box to this point, 0 inside.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Distance(pub(crate) [f32; 3]);

impl Measure for Distance {
    #[inline(always)]
    unsafe fn measure<V: Sixteen>(&self, node: &Node, most: f32, to: &mut [f32; LANES]) -> u32 {
        // SAFETY: the caller has the instructions of `V` enabled.
        unsafe {
            let square = |a: usize| {
                let at = V::splat(self.0[a]);
                let (below, above) = (V::load(&node.low[a]).minus(at), at.minus(V::load(&node.high[a])));
                // In this order NaN of lanes without a box stays NaN.
                let outside = V::splat(0.0).or_more(below.or_more(above));
                outside.times(outside)
            };
            let distance = square(0).plus(square(1)).plus(square(2)).root();
            distance.store(to);
            distance.at_most(V::splat(most))
        }
    }
}
