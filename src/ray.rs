//! The ray, a query of a scene.

/// A ray, or the segment of one: the points `origin + t × direction` with `0 <= t <= max`.
///
/// ```
/// use sapwise::Ray;
///
/// let segment = Ray { max: 10.0, ..Ray::new([0.0; 3], [0.0, 0.0, 1.0]) };
/// assert_eq!(segment.defect(), None);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// The point at `t = 0`.
    pub origin: [f32; 3],
    /// The direction; its length is the unit of `t`. The reciprocal of a component below 2.9e-39 is beyond `f32`, and
    /// the component counts as zero.
    pub direction: [f32; 3],
    /// The highest `t`, infinite if the ray has no end.
    pub max: f32,
}

crate::described! {
    /// A defect that makes a ray invalid.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    #[non_exhaustive]
    pub enum RayDefect {
        /// The origin or the direction has a component that is NaN or infinite, or the maximum is NaN.
        NotFinite = "has an origin or direction that is not finite, or a maximum that is not a number (NaN)",
        /// The direction is zero.
        NoDirection = "has the direction zero",
    }
}

impl Ray {
    /// Makes a ray without an end.
    pub const fn new(origin: [f32; 3], direction: [f32; 3]) -> Self {
        Self { origin, direction, max: f32::INFINITY }
    }

    /// Returns why this ray is invalid, or `None` if it is valid.
    pub fn defect(&self) -> Option<RayDefect> {
        if self.max.is_nan() || self.origin.iter().chain(&self.direction).any(|v| !v.is_finite()) {
            Some(RayDefect::NotFinite)
        } else {
            (self.direction == [0.0; 3]).then_some(RayDefect::NoDirection)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn infinite_nan_and_zero_are_defects() {
        let valid = Ray::new([1.0, 2.0, -3.0], [0.0, -0.0, 1.0e-44]);
        assert_eq!((valid.defect(), valid.max), (None, f32::INFINITY));
        assert_eq!(Ray { max: -1.0, ..valid }.defect(), None);
        assert_eq!(Ray { max: f32::NAN, ..valid }.defect(), Some(RayDefect::NotFinite));
        for wrong in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            assert_eq!(Ray { origin: [0.0, wrong, 0.0], ..valid }.defect(), Some(RayDefect::NotFinite));
            assert_eq!(Ray { direction: [0.0, 1.0, wrong], ..valid }.defect(), Some(RayDefect::NotFinite));
        }
        assert_eq!(Ray::new([0.0; 3], [0.0, -0.0, 0.0]).defect(), Some(RayDefect::NoDirection));
    }
}
