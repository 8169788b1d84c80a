//! Every pair tested.

use crate::cpu::Threads;
use crate::{Aabb, BroadPhase, Error, Pairs};

pub(crate) fn create(_: u32, _: &Threads) -> Result<Box<dyn BroadPhase>, Error> {
    Ok(Box::new(Brute))
}

struct Brute;

impl BroadPhase for Brute {
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        pairs.clear();
        crate::broad_phase::check_count(boxes.len())?;
        Aabb::check(boxes, 0)?;
        for (j, b) in boxes.iter().enumerate() {
            for (i, a) in boxes[..j].iter().enumerate() {
                if a.overlaps(b) {
                    pairs.push(i as u32, j as u32);
                }
            }
        }
        pairs.finish()
    }
}
