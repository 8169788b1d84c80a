//! Boxes and rays from types of glam 0.34, and back.

use crate::{Aabb, Ray};
use glam_034::Vec3;

/// Lowest and highest point. As [`Aabb::new`], without a check.
impl From<(Vec3, Vec3)> for Aabb {
    fn from((min, max): (Vec3, Vec3)) -> Self {
        Self::new(min.into(), max.into())
    }
}

/// Lowest and highest point.
impl From<Aabb> for (Vec3, Vec3) {
    fn from(aabb: Aabb) -> Self {
        (aabb.min.into(), aabb.max.into())
    }
}

/// Origin and direction. As [`Ray::new`], without an end.
impl From<(Vec3, Vec3)> for Ray {
    fn from((origin, direction): (Vec3, Vec3)) -> Self {
        Self::new(origin.into(), direction.into())
    }
}

/// Origin and direction, without [`Ray::max`].
impl From<Ray> for (Vec3, Vec3) {
    fn from(ray: Ray) -> Self {
        (ray.origin.into(), ray.direction.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_and_rays_come_back() {
        let aabb = Aabb::new([1.0, 2.0, 3.0], [4.0, 5.0, 6.0]);
        let (min, max): (Vec3, Vec3) = aabb.into();
        assert_eq!((min.y, max.z, Aabb::from((min, max))), (2.0, 6.0, aabb));
        let ray = Ray::new([1.0, 2.0, 3.0], [4.0, 5.0, 6.0]);
        let (origin, direction): (Vec3, Vec3) = ray.into();
        assert_eq!((origin.x, direction.x, Ray::from((origin, direction))), (1.0, 4.0, ray));
    }
}
