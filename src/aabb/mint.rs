//! Boxes and rays from types of mint 0.5, and back.

use crate::{Aabb, Ray};
use mint::{Point3, Vector3};

/// Lowest and highest point. As [`Aabb::new`], without a check.
impl From<(Point3<f32>, Point3<f32>)> for Aabb {
    fn from((min, max): (Point3<f32>, Point3<f32>)) -> Self {
        Self::new(min.into(), max.into())
    }
}

/// Lowest and highest point.
impl From<Aabb> for (Point3<f32>, Point3<f32>) {
    fn from(aabb: Aabb) -> Self {
        (aabb.min.into(), aabb.max.into())
    }
}

/// Origin and direction. As [`Ray::new`], without an end.
impl From<(Point3<f32>, Vector3<f32>)> for Ray {
    fn from((origin, direction): (Point3<f32>, Vector3<f32>)) -> Self {
        Self::new(origin.into(), direction.into())
    }
}

/// Origin and direction, without [`Ray::max`].
impl From<Ray> for (Point3<f32>, Vector3<f32>) {
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
        let (min, max): (Point3<f32>, Point3<f32>) = aabb.into();
        assert_eq!((min.y, max.z, Aabb::from((min, max))), (2.0, 6.0, aabb));
        let ray = Ray::new([1.0, 2.0, 3.0], [4.0, 5.0, 6.0]);
        let (origin, direction): (Point3<f32>, Vector3<f32>) = ray.into();
        assert_eq!((origin.x, direction.x, Ray::from((origin, direction))), (1.0, 4.0, ray));
    }
}
