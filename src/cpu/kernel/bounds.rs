//! The bounds of boxes that are added one by one.

use super::{Floats, Four, corners};
use crate::Aabb;

/// The bounds of the boxes that were added, and whether all of these are valid.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bounds {
    /// Lower and upper bounds, and whether all boxes are valid, in lanes 0 to 2.
    low: Four,
    high: Four,
    valid: <Four as Floats>::Mask,
}

impl Bounds {
    /// Returns the bounds of no box.
    #[inline(always)]
    pub(crate) fn none() -> Self {
        // SAFETY: every CPU has the instructions of `Four`, here and below.
        unsafe {
            let (low, high) = (Four::splat(f32::INFINITY), Four::splat(f32::NEG_INFINITY));
            Self { low, high, valid: high.at_most(low) }
        }
    }

    /// Adds a box.
    #[inline(always)]
    pub(crate) fn add(&mut self, b: &Aabb) {
        let [low, high] = corners(b);
        // SAFETY: as above.
        unsafe {
            self.valid = Four::and(self.valid, low.at_most(high));
            self.low = self.low.or_less(low);
            self.high = self.high.or_more(high);
        }
    }

    /// Returns whether all boxes are valid.
    #[inline(always)]
    pub(crate) fn is_valid(&self) -> bool {
        // SAFETY: as above.
        unsafe { Four::bits(self.valid) & 7 == 7 }
    }

    /// Returns the bounds, `None` without a valid box. Unspecified if a box is invalid.
    #[inline(always)]
    pub(crate) fn get(&self) -> Option<Aabb> {
        let (mut low, mut high) = ([0.0; 4], [0.0; 4]);
        // SAFETY: as above. The stores write arrays of four floats.
        unsafe {
            self.low.store(low.as_mut_ptr());
            self.high.store(high.as_mut_ptr());
        }
        let all = Aabb::new([low[0], low[1], low[2]], [high[0], high[1], high[2]]);
        all.defect().is_none().then_some(all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_those_of_all_boxes_and_show_an_invalid_one() {
        let inf = f32::INFINITY;
        let valid = [
            Aabb::new([0.0, -1.0, 2.0], [1.0, -1.0, 5.0]),
            Aabb::new([-3.0, 0.0, 4.0], [-2.0, 9.0, 4.0]),
            Aabb::new([-inf; 3], [inf, 0.0, inf]),
            Aabb::new([inf; 3], [inf; 3]),
        ];
        let invalid = [Aabb::new([1.0, 0.0, 0.0], [0.0, 1.0, 1.0]), Aabb::new([0.0; 3], [1.0, f32::NAN, 1.0])];
        assert_eq!(Bounds::none().get(), None);
        let mut bounds = Bounds::none();
        for k in 0..valid.len() {
            bounds.add(&valid[k]);
            assert_eq!(bounds.get(), valid[..=k].iter().copied().reduce(|a, b| a.union(&b)));
            assert!(bounds.is_valid());
        }
        for b in &invalid {
            let mut bounds = bounds;
            bounds.add(b);
            bounds.add(&valid[0]);
            assert!(!bounds.is_valid());
        }
    }
}
