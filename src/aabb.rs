//! The box, the input of every algorithm.

#[cfg(feature = "serde")]
mod bounds;
#[cfg(any(feature = "glam-034", feature = "mint"))]
mod conversions;

use crate::{BoxDefect, Error};

/// An axis-aligned bounding box, closed on every side: boxes that touch overlap.
///
/// 24 bytes, minimum then maximum, so that a `&[f32]` of shape `n x 6` has the same layout. Bounds may be infinite. A
/// box is valid if no bound is NaN and no minimum lies above its maximum.
///
/// With the feature `serde`, infinite bounds are the strings `inf` and `-inf` in formats for humans, such as JSON.
///
/// ```
/// use sapwise::Aabb;
///
/// let unit = Aabb::new([0.0; 3], [1.0; 3]);
/// assert_eq!(unit, Aabb::cube([0.5; 3], 0.5)); // centre and half the edge
/// assert!(unit.overlaps(&Aabb::new([1.0; 3], [2.0; 3])));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "bytemuck", derive(bytemuck::Pod, bytemuck::Zeroable))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct Aabb {
    /// Lowest x, y and z.
    #[cfg_attr(feature = "serde", serde(with = "bounds"))]
    pub min: [f32; 3],
    /// Highest x, y and z.
    #[cfg_attr(feature = "serde", serde(with = "bounds"))]
    pub max: [f32; 3],
}

impl Aabb {
    /// Makes a box from its corners without a check: every [`BroadPhase`](crate::BroadPhase) checks its input.
    pub const fn new(min: [f32; 3], max: [f32; 3]) -> Self {
        Self { min, max }
    }

    /// Makes the cube of half edge `half` around `centre`.
    pub fn cube(centre: [f32; 3], half: f32) -> Self {
        Self { min: centre.map(|c| c - half), max: centre.map(|c| c + half) }
    }

    /// Makes a box in two dimensions: from 0 to 0 on z.
    pub const fn flat(min: [f32; 2], max: [f32; 2]) -> Self {
        Self { min: [min[0], min[1], 0.0], max: [max[0], max[1], 0.0] }
    }

    /// Makes a box from corners in double precision, rounded outward: it contains every point between them.
    ///
    /// A bound beyond the range of `f32` becomes infinite, or the largest finite value if that lies further out. NaN
    /// stays NaN. Far from the origin `f32` is coarse, 0.06 at a million: subtract an origin near the boxes first.
    ///
    /// ```
    /// # use sapwise::Aabb;
    /// let b = Aabb::from_f64([0.1, -1.0e300, 0.0], [0.1, 0.5, 0.0]);
    /// assert!(f64::from(b.min[0]) < 0.1 && f64::from(b.max[0]) > 0.1);
    /// assert_eq!((b.min[1], b.max[1]), (f32::NEG_INFINITY, 0.5));
    /// ```
    pub fn from_f64(min: [f64; 3], max: [f64; 3]) -> Self {
        // A comparison with NaN is false.
        let down = |v: f64| if f64::from(v as f32) > v { (v as f32).next_down() } else { v as f32 };
        let up = |v: f64| if f64::from(v as f32) < v { (v as f32).next_up() } else { v as f32 };
        Self { min: min.map(down), max: max.map(up) }
    }

    /// Returns the box grown by a margin on every side. It contains this box, because rounding is monotonic.
    ///
    /// A negative margin shrinks the box; one beyond half of an edge inverts it, which every search reports.
    #[inline]
    #[must_use]
    pub fn grown(self, margin: f32) -> Self {
        Self { min: self.min.map(|v| v - margin), max: self.max.map(|v| v + margin) }
    }

    /// Returns a box that contains this box at the start and at the end of a motion, and everywhere between. Rounded
    /// outward. NaN in the motion makes the box invalid.
    #[must_use]
    pub fn swept(self, motion: [f32; 3]) -> Self {
        // The sum and its rounding error, which is exact (Knuth's two-sum), or NaN if the sum is infinite.
        let sum = |a: f32, b: f32| {
            let sum = a + b;
            let of_b = sum - a;
            (sum, (a - (sum - of_b)) + (b - of_b))
        };
        let [mut min, mut max] = [self.min, self.max];
        for (a, by) in motion.into_iter().enumerate() {
            let ((low, error_low), (high, error_high)) = (sum(min[a], by), sum(max[a], by));
            if by < 0.0 || by.is_nan() {
                min[a] = if error_low < 0.0 { low.next_down() } else { low };
            }
            if by > 0.0 || by.is_nan() {
                max[a] = if error_high > 0.0 { high.next_up() } else { high };
            }
        }
        Self { min, max }
    }

    /// Returns whether two boxes share a point, boundaries included.
    #[inline]
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
        let invalid = boxes.iter().position(|b| b.defect().is_some());
        let error = |at: usize| Some(Error::InvalidBox { index: first + at, defect: boxes[at].defect()? });
        invalid.and_then(error).map_or(Ok(()), Err)
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
    fn boxes_of_doubles_lose_no_point() {
        let mut random = 0;
        let mut double = || {
            random += 1;
            // A random exponent, so that some lie beyond the range of `f32` on either side.
            let bits = crate::splitmix::mix(random);
            (1.0 + (bits >> 12) as f64 / (1_u64 << 52) as f64)
                * (bits % 340) as f64
                * if bits & 1 == 0 { 1.0 } else { -1.0 }
                * 2.0_f64.powi((bits >> 3) as i32 % 340 - 170)
        };
        for _ in 0..10_000 {
            let point = [0; 3].map(|_| double());
            let b = Aabb::from_f64(point, point);
            for a in 0..3 {
                let (low, high) = (f64::from(b.min[a]), f64::from(b.max[a]));
                assert!(low <= point[a] && point[a] <= high, "{point:?} in {b:?}");
                let tight = b.min[a] == b.max[a] || b.min[a].next_up() == b.max[a];
                assert!(tight && (b.min[a] == b.max[a]) == (f64::from(point[a] as f32) == point[a]), "{b:?}");
            }
            assert_eq!(b.defect(), None);
        }
        let inf = f64::INFINITY;
        assert_eq!(Aabb::from_f64([-inf; 3], [inf; 3]), Aabb::new([f32::NEG_INFINITY; 3], [f32::INFINITY; 3]));
        assert_eq!(Aabb::from_f64([1.0e39; 3], [1.0e39; 3]), Aabb::new([f32::MAX; 3], [f32::INFINITY; 3]));
        assert_eq!(Aabb::from_f64([f64::NAN; 3], [1.0; 3]).defect(), Some(BoxDefect::NotANumber));
        assert_eq!(Aabb::from_f64([0.0; 3], [-1.0e-60; 3]), Aabb::new([0.0; 3], [-0.0; 3]));
    }

    #[test]
    fn swept_box_contains_both_ends() {
        let unit = Aabb::new([0.0; 3], [1.0; 3]);
        assert_eq!(unit.swept([2.0, -3.0, 0.0]), Aabb::new([0.0, -3.0, 0.0], [3.0, 1.0, 1.0]));
        assert_eq!(unit.swept([-1.0e-30; 3]).max, [1.0; 3]);
        // The sum is less than the nearest float.
        assert_eq!(Aabb::new([1.0; 3], [2.0; 3]).swept([-1.0e-30; 3]).min, [1.0_f32.next_down(); 3]);
        assert_eq!(Aabb::new([1.0; 3], [2.0; 3]).swept([1.0e-30; 3]).max, [2.0_f32.next_up(); 3]);
        assert_eq!(Aabb::new([f32::MAX; 3], [f32::MAX; 3]).swept([f32::MAX; 3]).max, [f32::INFINITY; 3]);
        let all = Aabb::new([f32::NEG_INFINITY; 3], [f32::INFINITY; 3]);
        assert_eq!(all.swept([5.0, -5.0, 0.0]), all);
        assert_eq!(unit.swept([0.0, f32::NAN, 0.0]).defect(), Some(BoxDefect::NotANumber));
        // Sums of such floats are exact in `f64`.
        let float = |k: u64| (crate::splitmix::mix(k) >> 40) as f32 / (1 << 10) as f32 - 8192.0;
        for k in 0..10_000 {
            let (low, by) = (float(2 * k), float(2 * k + 1));
            let swept = Aabb::new([low; 3], [low + 1.0; 3]).swept([by, by / 1024.0, -by]);
            for (a, by) in [by, by / 1024.0, -by].into_iter().enumerate() {
                let [start, end] = [f64::from(low), f64::from(low) + f64::from(by)];
                assert!(f64::from(swept.min[a]) <= start.min(end) && swept.min[a] <= low);
                let [start, end] = [f64::from(low + 1.0), f64::from(low + 1.0) + f64::from(by)];
                assert!(f64::from(swept.max[a]) >= start.max(end));
            }
        }
    }

    #[test]
    fn grown_box_contains_the_box() {
        let grown = Aabb::flat([-1.0, 0.0], [1.0, 2.0]).grown(0.5);
        assert_eq!(grown, Aabb::new([-1.5, -0.5, -0.5], [1.5, 2.5, 0.5]));
        assert_eq!(grown.grown(-0.5), Aabb::flat([-1.0, 0.0], [1.0, 2.0]));
        assert_eq!(grown.grown(-1.0).defect(), Some(BoxDefect::Inverted));
        for bound in [1.0e-40, 1.0, 3.0e7, f32::MAX, f32::INFINITY] {
            let grown = Aabb::new([-bound; 3], [bound; 3]).grown(0.1);
            assert!(grown.min[0] <= -bound && grown.max[0] >= bound);
        }
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
