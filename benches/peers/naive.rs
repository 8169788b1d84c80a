//! The double loop over all boxes.

use sapwise::{Aabb, BroadPhase, Error, Pairs};

/// Every box against every later one, by [`Aabb::overlaps`].
pub(crate) struct Naive;

impl BroadPhase for Naive {
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        pairs.clear();
        for (i, a) in boxes.iter().enumerate() {
            for (j, b) in boxes.iter().enumerate().skip(i + 1) {
                if a.overlaps(b) {
                    pairs.push(i as u32, j as u32);
                }
            }
        }
        pairs.finish()
    }
}
