//! Queries of a space.

use super::handle::Handle;
use super::{Body, Space};
use crate::cpu::{Near, Tree};
use crate::{Aabb, Error, Membership, Ray};

/// The bodies of a [`Space`] that one body may meet, for queries.
///
/// Queries see boxes as they were at the last [`update`](Space::update), and bodies as they were set last. Those that
/// were removed since are left out. The first query after an update builds a tree of the active bodies; any number of
/// threads may query at once.
///
/// ```
/// use sapwise::{Aabb, Body, Space};
///
/// let mut space = Space::new();
/// let near = space.insert(Aabb::cube([1.0, 0.0, 0.0], 0.5), Body::default())?;
/// space.insert(Aabb::cube([9.0, 0.0, 0.0], 0.5), Body::default())?;
/// space.update()?;
/// let mut found = Vec::new();
/// space.all().query_box(&Aabb::cube([0.0; 3], 2.0), |handle| found.push(handle))?;
/// assert_eq!(found, [near]);
/// # Ok::<(), sapwise::Error>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    space: &'a Space,
    /// `None`: all bodies.
    by: Option<Membership>,
}

impl Space {
    /// Returns a view of the bodies that `body` may meet.
    pub fn view(&self, body: &Body) -> View<'_> {
        View { space: self, by: Some(body.membership) }
    }

    /// Returns a view of all bodies.
    pub fn all(&self) -> View<'_> {
        View { space: self, by: None }
    }

    /// Returns the trees of all bodies, each with the slot of each id; `None` if ids are slots.
    fn trees(&self) -> Result<impl Iterator<Item = (&Tree, Option<&[u32]>)>, Error> {
        let active = match self.tree.get() {
            Some(tree) => tree,
            None => {
                let tree = Tree::of(&self.active.boxes)?;
                self.tree.get_or_init(|| tree)
            }
        };
        let resting = self.resting.tree().map(|tree| (tree, None));
        // The last update, or the clone, found no memory for their tree.
        if resting.is_none() && self.resting.len() > 0 {
            return Err(Error::OutOfMemory { what: "resting bodies", elements: self.resting.len() });
        }
        Ok(std::iter::once((active, Some(&self.active.slots[..]))).chain(resting))
    }
}

fn check(ray: &Ray) -> Result<(), Error> {
    ray.defect().map_or(Ok(()), |defect| Err(Error::InvalidRay { defect }))
}

impl View<'_> {
    /// Returns the handle of a body that is wanted and still there.
    #[inline]
    fn wanted(&self, slots_of_ids: Option<&[u32]>, id: u32) -> Option<Handle> {
        let slots = &self.space.slots;
        let slot = slots_of_ids.map_or(id, |slots| slots[id as usize]);
        let wanted = slots.is_taken(slot) && self.by.is_none_or(|by| by.wants(slots.body(slot).membership()));
        wanted.then(|| slots.handle(slot))
    }

    /// Calls `found` for each body whose box overlaps these bounds.
    ///
    /// # Errors
    /// [`Error::InvalidBox`] with index 0, and [`Error::OutOfMemory`].
    pub fn query_box(&self, bounds: &Aabb, mut found: impl FnMut(Handle)) -> Result<(), Error> {
        self.query_boxes(std::slice::from_ref(bounds), |_, handle| found(handle))
    }

    /// Calls `found` with the position of each of these bounds, and each body whose box overlaps it.
    ///
    /// # Errors
    /// [`Error::InvalidBox`] for the first invalid bounds; then there was no call. [`Error::OutOfMemory`].
    pub fn query_boxes(&self, bounds: &[Aabb], mut found: impl FnMut(usize, Handle)) -> Result<(), Error> {
        Aabb::check(bounds, 0)?;
        for (tree, ids) in self.space.trees()? {
            for (k, bounds) in bounds.iter().enumerate() {
                tree.overlapping(bounds, |id| self.wanted(ids, id).into_iter().for_each(|handle| found(k, handle)));
            }
        }
        Ok(())
    }

    /// Calls `found` for each body whose box contains a point. Boxes are closed.
    ///
    /// # Errors
    /// As [`query_box`](Self::query_box).
    pub fn query_point(&self, point: [f32; 3], found: impl FnMut(Handle)) -> Result<(), Error> {
        self.query_box(&Aabb::new(point, point), found)
    }

    /// Calls `found` with each body whose box a ray meets, and the `t` at which it enters the box: 0 if it begins
    /// there.
    ///
    /// `found` returns the highest `t` that still matters: the given `t` to find the first hit, infinity to find all,
    /// a negative number to stop. Hits do not come in the order of `t`.
    ///
    /// # Errors
    /// [`Error::InvalidRay`] and [`Error::OutOfMemory`].
    pub fn cast_ray(&self, ray: &Ray, found: impl FnMut(Handle, f32) -> f32) -> Result<(), Error> {
        check(ray)?;
        self.cast(&Aabb::new(ray.origin, ray.origin), ray.direction, ray.max, found)
    }

    /// Returns the body that a ray meets first, and the `t` at which it enters the box; of several at the same `t` the
    /// one with the lowest handle.
    ///
    /// # Errors
    /// As [`cast_ray`](Self::cast_ray).
    pub fn first_hit(&self, ray: &Ray) -> Result<Option<(Handle, f32)>, Error> {
        let mut first: Option<(Handle, f32)> = None;
        self.cast_ray(ray, |handle, t| {
            if first.is_none_or(|(other, least)| t < least || t == least && handle < other) {
                first = Some((handle, t));
            }
            first.map_or(t, |(_, t)| t)
        })?;
        Ok(first)
    }

    /// Calls `found` with each body whose box is met by a box that moves by `motion`, and the share of the motion
    /// after which they touch: 0 if they overlap at the start. `found` returns what it does for
    /// [`cast_ray`](Self::cast_ray).
    ///
    /// # Errors
    /// [`Error::InvalidBox`] with index 0, [`Error::InvalidRay`] if the motion is not finite, [`Error::OutOfMemory`].
    pub fn cast_box(&self, aabb: &Aabb, motion: [f32; 3], found: impl FnMut(Handle, f32) -> f32) -> Result<(), Error> {
        Aabb::check(std::slice::from_ref(aabb), 0)?;
        if motion != [0.0; 3] {
            check(&Ray::new([0.0; 3], motion))?;
        }
        self.cast(aabb, motion, 1.0, found)
    }

    fn cast(
        &self,
        aabb: &Aabb,
        motion: [f32; 3],
        max: f32,
        mut found: impl FnMut(Handle, f32) -> f32,
    ) -> Result<(), Error> {
        let mut most = max;
        for (tree, ids) in self.space.trees()? {
            if most >= 0.0 {
                tree.cast_box(aabb, motion, most, |id, t| {
                    if let Some(handle) = self.wanted(ids, id) {
                        // NaN changes nothing.
                        most = most.min(found(handle, t));
                    }
                    most
                });
            }
        }
        Ok(())
    }

    /// Returns the `k` bodies whose boxes are nearest to a point, with their distances, the nearest first: 0 if the
    /// point is inside. Of several at the same distance, those with the lowest handles come first.
    ///
    /// A distance is the root of a sum of squares in `f32`: above 1.8e19 it is infinite, below 2e-23 it is 0.
    ///
    /// # Errors
    /// [`Error::InvalidRay`] if the point is not finite, and [`Error::OutOfMemory`].
    pub fn nearest(&self, point: [f32; 3], k: usize) -> Result<Vec<(Handle, f32)>, Error> {
        check(&Ray::new(point, [1.0; 3]))?;
        let mut all: Vec<(Handle, f32)> = Vec::new();
        let mut near: Vec<Near> = Vec::new();
        for (tree, ids) in self.space.trees()? {
            tree.nearest(point, k, f32::INFINITY, |id| self.wanted(ids, id).map(Handle::slot), &mut near);
            all.extend(near.iter().map(|near| (self.space.slots.handle(near.id), near.distance())));
        }
        all.sort_unstable_by(|(a, one), (b, other)| one.total_cmp(other).then(a.cmp(b)));
        all.truncate(k);
        Ok(all)
    }
}
