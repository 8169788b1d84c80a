//! The box, the input of every algorithm.

use crate::error::{BoxDefect, Error};

/// An axis-aligned bounding box, closed on every side: boxes that touch overlap.
///
/// 24 bytes, minimum then maximum, so that a `&[f32]` of shape `n x 6` has the same layout. Bounds may be infinite. A
/// box is valid if no bound is NaN and no minimum lies above its maximum.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "bytemuck", derive(bytemuck::Pod, bytemuck::Zeroable))]
#[repr(C)]
pub struct Aabb {
    /// Lowest x, y and z.
    pub min: [f32; 3],
    /// Highest x, y and z.
    pub max: [f32; 3],
}

impl Aabb {
    /// Makes a box from its corners without a check: every [`BroadPhase`](crate::BroadPhase) checks its input.
    #[must_use]
    pub const fn new(min: [f32; 3], max: [f32; 3]) -> Self {
        Self { min, max }
    }

    /// Makes the cube of half edge `half` around `centre`.
    #[must_use]
    pub fn cube(centre: [f32; 3], half: f32) -> Self {
        Self { min: centre.map(|c| c - half), max: centre.map(|c| c + half) }
    }

    /// Returns whether two boxes share a point, boundaries included.
    #[inline]
    #[must_use]
    pub fn overlaps(&self, other: &Self) -> bool {
        (0..3).all(|a| self.min[a] <= other.max[a] && other.min[a] <= self.max[a])
    }

    /// Returns the smallest box that contains both.
    #[inline]
    pub(crate) fn union(&self, other: &Self) -> Self {
        let of = |a: [f32; 3], b: [f32; 3], pick: fn(f32, f32) -> f32| [0, 1, 2].map(|k| pick(a[k], b[k]));
        Self { min: of(self.min, other.min, f32::min), max: of(self.max, other.max, f32::max) }
    }

    /// Returns why this box is invalid, or `None` if it is valid.
    #[inline]
    #[must_use]
    pub fn defect(&self) -> Option<BoxDefect> {
        // One comparison for each axis is false for NaN and for inverted bounds.
        if (0..3).all(|a| self.min[a] <= self.max[a]) {
            None
        } else if self.min.iter().chain(&self.max).any(|v| v.is_nan()) {
            Some(BoxDefect::NotANumber)
        } else {
            Some(BoxDefect::Inverted)
        }
    }

    /// Returns an error for the first invalid box. `first` is the position of the first of `boxes`.
    #[doc(hidden)]
    pub fn check(boxes: &[Self], first: usize) -> Result<(), Error> {
        match boxes.iter().position(|b| b.defect().is_some()) {
            None => Ok(()),
            Some(at) => {
                let defect = boxes[at].defect().unwrap_or(BoxDefect::NotANumber);
                Err(Error::InvalidBox { index: first + at, defect })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn touching_boxes_overlap() {
        let a = Aabb::new([0.0; 3], [1.0; 3]);
        assert!(a.overlaps(&Aabb::new([1.0; 3], [2.0; 3])));
        assert!(!a.overlaps(&Aabb::new([1.0, 0.0, 1.000_001], [2.0; 3])));
    }

    #[test]
    fn nan_and_inverted_bounds_are_defects() {
        let inf = f32::INFINITY;
        assert_eq!(Aabb::new([-inf; 3], [inf; 3]).defect(), None);
        assert_eq!(Aabb::new([inf; 3], [inf; 3]).defect(), None);
        assert_eq!(Aabb::new([0.0, f32::NAN, 0.0], [1.0; 3]).defect(), Some(BoxDefect::NotANumber));
        assert_eq!(Aabb::new([0.0, 2.0, 0.0], [1.0; 3]).defect(), Some(BoxDefect::Inverted));
        assert_eq!(size_of::<Aabb>(), 24);
    }
}
