//! Queries of a tree: by a region, along a ray or the way of a moved box, and of what is nearest to a point.
//!
//! Any number of threads may query a tree at once. A box of the tree is found once.

use super::Tree;
use crate::cpu::kernel::distance::Distance;
use crate::cpu::kernel::nearest_first::nearest_first;
use crate::cpu::kernel::ray::Cast;
use crate::cpu::kernel::walk::each_overlapping;
use crate::{Aabb, Membership};
use std::collections::BinaryHeap;

/// A box near a point. The nearest is the least; of two at the same distance it is the one with the lower id.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Near {
    /// The bits of the distance. It is not negative, so bits have the order of distances.
    bits: u32,
    /// The name of the box.
    pub(crate) id: u32,
}

impl Near {
    fn new(distance: f32, id: u32) -> Self {
        Self { bits: distance.to_bits(), id }
    }

    /// Returns the distance from the point to the box, 0 inside.
    pub(crate) fn distance(&self) -> f32 {
        f32::from_bits(self.bits)
    }
}

impl Tree {
    /// Calls `found` for every box that overlaps these bounds. Returns the number of visited nodes.
    #[inline]
    pub fn overlapping(&self, bounds: &Aabb, found: impl FnMut(u32)) -> u32 {
        self.overlapping_wanted(bounds, || Membership::ALL, found)
    }

    /// Does the same, but leaves out boxes that are unwanted `by` the box with the bounds, if the tree was built with
    /// a filter.
    #[inline]
    pub(crate) fn overlapping_wanted(
        &self,
        bounds: &Aabb,
        by: impl FnOnce() -> Membership,
        mut found: impl FnMut(u32),
    ) -> u32 {
        each_overlapping(self.simd, &self.walk(), bounds, by, |place| found(self.ids[place]))
    }

    /// Calls `found` with the id of every box that a valid box meets when it moves by `t × motion`, and the least such
    /// `t` from 0 to `max`: 0 for boxes that it [overlaps](Aabb::overlaps) at the start. A ray is a box without extent.
    /// Boxes are closed: a ray meets a box that it touches, and one in whose face it lies. Components of `motion` must
    /// be finite, and may all be zero.
    ///
    /// `found` returns how far the search goes on: never beyond `max` or a value that it returned before. If it returns
    /// the given `t`, no farther box follows, and the last one is the first hit. If it returns infinity, all boxes
    /// follow; if a negative number, none. Nearer nodes come first, but not every nearer box.
    ///
    /// On each axis, the times of entry and exit are `(min - b.max) × (1 / motion)` and `(max - b.min) × (1 / motion)`
    /// in `f32`, with the bounds of the met box; it is met if no entry is later than an exit. Boxes that are only
    /// reached beyond [`f32::MAX`] are not met.
    #[inline]
    pub fn cast_box(&self, b: &Aabb, motion: [f32; 3], max: f32, mut found: impl FnMut(u32, f32) -> f32) {
        let found = |place: usize, t| found(self.ids[place], t);
        nearest_first(self.simd, &self.walk(), Cast::new(b, motion), max.min(f32::MAX), found);
    }

    /// Writes the `k` boxes nearest to a point to `nearest`, ascending: of those at a distance of at most
    /// `max_distance` for whose position in the input `name` returns a name. Coordinates of the point must be finite.
    /// Fewer boxes are written if there are fewer.
    ///
    /// Distances are rounded: the root of the sum of squares in `f32`. Allocates only if `nearest` has no capacity for
    /// `k` boxes.
    #[inline]
    pub(crate) fn nearest(
        &self,
        point: [f32; 3],
        k: usize,
        max_distance: f32,
        name: impl Fn(u32) -> Option<u32>,
        nearest: &mut Vec<Near>,
    ) {
        nearest.clear();
        if k == 0 {
            return;
        }
        // The farthest is on top.
        let mut heap = BinaryHeap::from(std::mem::take(nearest));
        nearest_first(self.simd, &self.walk(), Distance(point), max_distance, |place, distance| {
            if heap.len() < k {
                heap.extend(name(self.ids[place]).map(|id| Near::new(distance, id)));
            } else if let Some(mut farthest) = heap.peek_mut()
                && distance <= farthest.distance()
                && let Some(near) = name(self.ids[place]).map(|id| Near::new(distance, id))
                && near < *farthest
            {
                *farthest = near;
            }
            if heap.len() < k { max_distance } else { heap.peek().map_or(max_distance, Near::distance) }
        });
        *nearest = heap.into_sorted_vec();
    }
}

#[cfg(test)]
mod tests;
