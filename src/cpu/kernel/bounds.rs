//! The bounds of boxes that are added one by one.

#[cfg(target_arch = "x86_64")]
use super::corners;
use crate::aabb::Aabb;
#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::*;

/// The bounds of the boxes that were added, and whether all of these are valid.
#[cfg(target_arch = "x86_64")]
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bounds {
    /// Lower and upper bounds, and all bits while all boxes are valid, in lanes 0 to 2.
    low: __m128,
    high: __m128,
    valid: __m128,
}

/// The bounds of the boxes that were added, and whether all of these are valid.
#[cfg(not(target_arch = "x86_64"))]
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bounds {
    all: Option<Aabb>,
    valid: bool,
}

#[cfg(target_arch = "x86_64")]
impl Bounds {
    /// Returns the bounds of no box.
    #[inline(always)]
    pub(crate) fn none() -> Self {
        // SAFETY: SSE2 is part of x86-64.
        unsafe {
            Self {
                low: _mm_set1_ps(f32::INFINITY),
                high: _mm_set1_ps(f32::NEG_INFINITY),
                valid: _mm_castsi128_ps(_mm_set1_epi32(-1)),
            }
        }
    }

    /// Adds a box.
    #[inline(always)]
    pub(crate) fn add(&mut self, b: &Aabb) {
        let [low, high] = corners(b);
        // SAFETY: SSE2 is part of x86-64.
        unsafe {
            self.valid = _mm_and_ps(self.valid, _mm_cmple_ps(low, high));
            self.low = _mm_min_ps(self.low, low);
            self.high = _mm_max_ps(self.high, high);
        }
    }

    /// Returns whether all boxes are valid.
    #[inline(always)]
    pub(crate) fn is_valid(&self) -> bool {
        // SAFETY: SSE2 is part of x86-64.
        unsafe { _mm_movemask_ps(self.valid) & 7 == 7 }
    }

    /// Returns the bounds, `None` without a valid box. Unspecified if a box is invalid.
    #[inline(always)]
    pub(crate) fn get(&self) -> Option<Aabb> {
        let (mut low, mut high) = ([0.0; 4], [0.0; 4]);
        // SAFETY: SSE2 is part of x86-64. The stores write arrays of four floats.
        unsafe {
            _mm_storeu_ps(low.as_mut_ptr(), self.low);
            _mm_storeu_ps(high.as_mut_ptr(), self.high);
        }
        let all = Aabb::new([low[0], low[1], low[2]], [high[0], high[1], high[2]]);
        all.defect().is_none().then_some(all)
    }
}

#[cfg(not(target_arch = "x86_64"))]
impl Bounds {
    /// Returns the bounds of no box.
    #[inline(always)]
    pub(crate) fn none() -> Self {
        Self { all: None, valid: true }
    }

    /// Adds a box.
    #[inline(always)]
    pub(crate) fn add(&mut self, b: &Aabb) {
        self.valid &= b.defect().is_none();
        self.all = Some(self.all.map_or(*b, |all| all.union(b)));
    }

    /// Returns whether all boxes are valid.
    #[inline(always)]
    pub(crate) fn is_valid(&self) -> bool {
        self.valid
    }

    /// Returns the bounds, `None` without a valid box. Unspecified if a box is invalid.
    #[inline(always)]
    pub(crate) fn get(&self) -> Option<Aabb> {
        self.all
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
