//! The resting bodies near each active one, kept while that stays within its fat AABB.

use super::resting::Resting;
use crate::aabb::Aabb;

/// Margin of a fat AABB, in mean edges of the body.
const MARGIN: f32 = 0.25;

/// A resting body.
#[derive(Debug, Clone, Copy)]
struct Neighbour {
    /// Its box, beside the slot, so that most frames look nowhere else.
    aabb: Aabb,
    slot: u32,
}

/// The neighbours of one body.
#[derive(Debug, Clone, Copy)]
struct Near {
    /// The body they are of.
    slot: u32,
    /// [`Resting::epoch`] when they were found; 0: never.
    epoch: u64,
    fat: Aabb,
    first: usize,
    len: u32,
}

/// See the module. Element `k` is of the active body at position `k`.
#[derive(Debug, Clone, Default)]
pub(super) struct Neighbours {
    near: Vec<Near>,
    neighbours: Vec<Neighbour>,
    /// Elements of `neighbours` that belong to no body any more.
    waste: usize,
}

impl Neighbours {
    pub(super) fn clear(&mut self) {
        self.near.clear();
        self.neighbours.clear();
        self.waste = 0;
    }

    /// Calls `found` with the position of each active body and the slot of each resting one that overlaps it.
    /// `boxes_at` are by slot. `found` may be called for bodies that have woken since, too.
    pub(super) fn each(
        &mut self,
        resting: &mut Resting,
        boxes_at: &[Aabb],
        (actives, boxes): (&[u32], &[Aabb]),
        mut found: impl FnMut(usize, u32),
    ) {
        self.compact(actives);
        let Self { near, neighbours, waste } = self;
        for (at, (near, b)) in near.iter_mut().zip(boxes).enumerate() {
            let stays = near.epoch == resting.epoch()
                && (0..3).all(|a| near.fat.min[a] <= b.min[a] && b.max[a] <= near.fat.max[a]);
            if !stays {
                *waste += near.len as usize;
                near.fat = fat(b);
                near.first = neighbours.len();
                let add = |slot| neighbours.push(Neighbour { aabb: boxes_at[slot as usize], slot });
                resting.overlapping(&near.fat, add);
                near.len = (neighbours.len() - near.first) as u32;
                near.epoch = resting.epoch();
            }
            let near = neighbours[near.first..][..near.len as usize].iter();
            near.filter(|near| near.aabb.overlaps(b)).for_each(|near| found(at, near.slot));
        }
    }

    /// Brings the lists into the order of these bodies. What is kept of others goes.
    fn compact(&mut self, actives: &[u32]) {
        let Self { near, neighbours, waste } = self;
        let nothing = |slot| Near { slot, epoch: 0, fat: Aabb::default(), first: 0, len: 0 };
        *waste += near.drain(near.len().min(actives.len())..).map(|near| near.len as usize).sum::<usize>();
        let known = near.len();
        near.extend(actives[known..].iter().map(|&slot| nothing(slot)));
        for (near, &slot) in near.iter_mut().zip(actives) {
            if near.slot != slot {
                *waste += near.len as usize;
                *near = nothing(slot);
            }
        }
        if *waste > neighbours.len() / 2 + 1024 {
            let mut kept = Vec::with_capacity(neighbours.len() - *waste);
            for near in near {
                let first = kept.len();
                kept.extend_from_slice(&neighbours[near.first..][..near.len as usize]);
                near.first = first;
            }
            (*neighbours, *waste) = (kept, 0);
        }
    }
}

/// Returns the fat AABB of a box.
fn fat(b: &Aabb) -> Aabb {
    let mean = (0..3).map(|a| b.max[a] - b.min[a]).sum::<f32>() / 3.0;
    // An infinite box is its own fat box.
    b.grown(if mean.is_finite() { MARGIN * mean } else { 0.0 })
}
