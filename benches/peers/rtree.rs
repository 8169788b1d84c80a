//! rstar's R*-tree, packed anew in each frame. It runs on one thread.

use crate::ground::Ground;
use rstar::{AABB, RTree, RTreeObject};
use sapwise::{Aabb, BroadPhase, Error, Pairs};
use std::ops::ControlFlow;

/// A box in the tree.
pub(crate) struct Leaf {
    envelope: AABB<[f32; 3]>,
    id: u32,
}

impl RTreeObject for Leaf {
    type Envelope = AABB<[f32; 3]>;

    fn envelope(&self) -> Self::Envelope {
        self.envelope
    }
}

/// A packed tree.
pub(crate) type Rtree = RTree<Leaf>;

impl Ground for Rtree {
    fn build(boxes: &[Aabb]) -> Self {
        let leaf = |(id, b): (u32, &Aabb)| Leaf { envelope: AABB::from_bounds(b.min, b.max), id };
        Self::bulk_load((0..).zip(boxes).map(leaf).collect())
    }

    fn query(&self, b: &Aabb, mut found: impl FnMut(u32)) {
        let _ = self.locate_in_envelope_intersecting_int(AABB::from_bounds(b.min, b.max), |leaf| {
            found(leaf.id);
            ControlFlow::<()>::Continue(())
        });
    }
}

/// Loads the tree in bulk, then queries it for each box in the order of the leaves. Joining the tree with itself takes
/// as long.
pub(crate) struct Packed;

impl BroadPhase for Packed {
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        pairs.clear();
        let tree = Rtree::build(boxes);
        for a in &tree {
            let _ = tree.locate_in_envelope_intersecting_int(a.envelope, |b| {
                if a.id < b.id {
                    pairs.push(a.id, b.id);
                }
                ControlFlow::<()>::Continue(())
            });
        }
        pairs.finish()
    }
}
