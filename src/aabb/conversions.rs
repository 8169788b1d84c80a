//! Boxes and rays from types of other crates, and back.

use crate::{Aabb, Ray};

macro_rules! conversions {
    ($feature:literal, $point:ty, $vector:ty) => {
        /// Lowest and highest point. As [`Aabb::new`], without a check.
        #[cfg(feature = $feature)]
        impl From<($point, $point)> for Aabb {
            fn from((min, max): ($point, $point)) -> Self {
                Self::new(min.into(), max.into())
            }
        }

        /// Lowest and highest point.
        #[cfg(feature = $feature)]
        impl From<Aabb> for ($point, $point) {
            fn from(aabb: Aabb) -> Self {
                (aabb.min.into(), aabb.max.into())
            }
        }

        /// Origin and direction. As [`Ray::new`], without an end.
        #[cfg(feature = $feature)]
        impl From<($point, $vector)> for Ray {
            fn from((origin, direction): ($point, $vector)) -> Self {
                Self::new(origin.into(), direction.into())
            }
        }

        /// Origin and direction, without [`Ray::max`].
        #[cfg(feature = $feature)]
        impl From<Ray> for ($point, $vector) {
            fn from(ray: Ray) -> Self {
                (ray.origin.into(), ray.direction.into())
            }
        }
    };
}

conversions!("glam-034", glam_034::Vec3, glam_034::Vec3);
conversions!("mint", mint::Point3<f32>, mint::Vector3<f32>);

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_boxes_and_rays_come_back<P: Into<[f32; 3]> + Copy, V: Into<[f32; 3]> + Copy>()
    where
        Aabb: From<(P, P)> + Into<(P, P)>,
        Ray: From<(P, V)> + Into<(P, V)>,
    {
        let aabb = Aabb::new([1.0, 2.0, 3.0], [4.0, 5.0, 6.0]);
        let (min, max): (P, P) = aabb.into();
        assert_eq!((min.into(), max.into(), Aabb::from((min, max))), (aabb.min, aabb.max, aabb));
        let ray = Ray::new([1.0, 2.0, 3.0], [4.0, 5.0, 6.0]);
        let (origin, direction): (P, V) = ray.into();
        let back = (origin.into(), direction.into(), Ray::from((origin, direction)));
        assert_eq!(back, (ray.origin, ray.direction, ray));
    }

    #[test]
    fn boxes_and_rays_come_back() {
        #[cfg(feature = "glam-034")]
        assert_boxes_and_rays_come_back::<glam_034::Vec3, glam_034::Vec3>();
        #[cfg(feature = "mint")]
        assert_boxes_and_rays_come_back::<mint::Point3<f32>, mint::Vector3<f32>>();
    }
}
