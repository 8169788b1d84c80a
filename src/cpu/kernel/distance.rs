//! The distances of a point to sixteen boxes.

use super::{Floats, LANES, Level, Measure, Node};

/// The Euclidean distance of a box to this point, 0 inside.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Distance(pub(crate) [f32; 3]);

impl Measure for Distance {
    #[inline(always)]
    fn measure<L: Level>(&self, node: &Node, most: f32, to: &mut [f32; LANES], _: L) -> u32 {
        // SAFETY: the level proves that this CPU has its instructions.
        unsafe {
            let [x, y, z]: [L::Lanes; 3] = [self.square(node, 0), self.square(node, 1), self.square(node, 2)];
            let distance = x.plus(y).plus(z).root();
            distance.store(to.as_mut_ptr());
            L::Lanes::bits(distance.at_most(L::Lanes::splat(most)))
        }
    }
}

impl Distance {
    /// Returns the squares of the distances on an axis.
    ///
    /// # Safety
    /// As for all [`Floats`].
    #[inline(always)]
    unsafe fn square<F: Floats>(&self, node: &Node, a: usize) -> F {
        // SAFETY: as above; each column has 16 floats.
        unsafe {
            let (low, high) = (F::load(node.low[a].as_ptr()), F::load(node.high[a].as_ptr()));
            let at = F::splat(self.0[a]);
            // In this order NaN of lanes without a box stays NaN.
            let outside = F::splat(0.0).or_more(low.minus(at).or_more(at.minus(high)));
            outside.times(outside)
        }
    }
}
