//! Sorts all boxes of a tree anew, in steps of which none takes long.

use super::curve::Curve;
use super::{Input, Members, Tree};
use crate::cpu::part;
use crate::{Error, SceneStats};

/// Steps of a renewal in which codes are made, each for one part of the boxes.
const RENEWAL_PARTS: usize = 4;

/// A new order of all boxes, made in steps: codes of one part of the boxes after the other, then sorting, then a new
/// arrangement of the leaves.
#[derive(Debug)]
pub(super) struct Renewal {
    curve: Curve,
    boxes: usize,
    step: usize,
    /// Active boxes, once all are sorted.
    active: usize,
}

impl Tree {
    /// Sorts all boxes anew, in several calls of which none takes long. Returns whether they stand in the new order
    /// now, but for those that are `out` of the tree: the ones that have `jumped` since the last call, and new ones.
    /// If the number of boxes has changed since the last call, this begins again.
    pub(crate) fn renew(
        &mut self,
        input: Input<'_>,
        (jumped, out): (impl Iterator<Item = u32>, impl Fn(u32) -> bool + Sync),
        stats: impl FnOnce() -> SceneStats,
    ) -> Result<bool, Error> {
        let Input { boxes, screen, .. } = input;
        let len = boxes.len();
        let begin = || Renewal { curve: Curve::over(&stats(), len), boxes: len, step: 0, active: 0 };
        let mut renewal = self.renewal.take().filter(|renewal| renewal.boxes == len).unwrap_or_else(begin);
        if renewal.step <= RENEWAL_PARTS {
            // Only boxes whose codes were made before they jumped.
            let known = part(len, renewal.step, RENEWAL_PARTS).start;
            let jumped = jumped.filter(|&id| (id as usize) < known);
            jumped.for_each(|id| self.order.code_again(id, boxes, &renewal.curve, screen));
        }
        match renewal.step {
            step @ 0..RENEWAL_PARTS => {
                if step == 0 {
                    self.order.begin(len)?;
                }
                self.order.code(input, Members::From(0), part(len, step, RENEWAL_PARTS), &renewal.curve)?;
            }
            RENEWAL_PARTS => renewal.active = self.order.finish(input)?,
            _ => {
                let Renewal { curve, active, .. } = renewal;
                return self.arrange(input, curve, active, out).map(|()| true);
            }
        }
        renewal.step += 1;
        self.renewal = Some(renewal);
        Ok(false)
    }

    /// Returns whether [`renew`](Self::renew) has begun and not ended.
    pub(crate) fn is_being_renewed(&self) -> bool {
        self.renewal.is_some()
    }
}
