//! rstar's R*-tree: packed anew in each frame. It has no threads.

use rstar::{AABB, RTree, RTreeObject};
use sapwise::{Aabb, BroadPhase, Error, Pairs};
use std::ops::ControlFlow;

struct Leaf {
    envelope: AABB<[f32; 3]>,
    id: u32,
}

impl RTreeObject for Leaf {
    type Envelope = AABB<[f32; 3]>;

    fn envelope(&self) -> Self::Envelope {
        self.envelope
    }
}

/// How pairs are found in the tree.
#[derive(Clone, Copy)]
pub(crate) enum Search {
    /// One query for each box, in the order of the leaves.
    Query,
    /// The tree joined with itself, which finds each pair twice and each box with itself.
    Join,
}

/// Bulk load, then a search.
pub(crate) struct Packed(pub(crate) Search);

impl BroadPhase for Packed {
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        pairs.clear();
        let leaf = |(id, b): (u32, &Aabb)| Leaf { envelope: AABB::from_bounds(b.min, b.max), id };
        let tree = RTree::bulk_load((0..).zip(boxes).map(leaf).collect());
        match self.0 {
            Search::Query => {
                for a in &tree {
                    let _ = tree.locate_in_envelope_intersecting_int(a.envelope, |b| {
                        if a.id < b.id {
                            pairs.push(a.id, b.id);
                        }
                        ControlFlow::<()>::Continue(())
                    });
                }
            }
            Search::Join => {
                let both = tree.intersection_candidates_with_other_tree(&tree);
                both.filter(|(a, b)| a.id < b.id).for_each(|(a, b)| pairs.push(a.id, b.id));
            }
        }
        pairs.finish()
    }
}
