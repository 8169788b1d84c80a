//! The resting bodies near each active one that it may meet, kept while it stays within its fat AABB.

use super::resting::Resting;
use crate::Aabb;

/// Margin of a fat AABB, in mean edges of the body.
const MARGIN: f32 = 0.25;

/// If more bodies come to rest in an update, each active body searches for its neighbours anew. To compare it with this
/// many takes as long as a search.
const FEW: usize = 64;

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

    /// Searches for the neighbours of the active body at this position anew: what it may meet has changed.
    pub(super) fn forget(&mut self, at: usize) {
        self.near.get_mut(at).into_iter().for_each(|near| near.epoch = 0);
    }

    /// Calls `found` with the position of each active body and the slot of each resting one that overlaps it and that
    /// it `wants`. `boxes_at` are by slot.
    pub(super) fn each(
        &mut self,
        resting: &mut Resting,
        boxes_at: &[Aabb],
        (actives, boxes): (&[u32], &[Aabb]),
        wants: impl Fn(usize, u32) -> bool,
        mut found: impl FnMut(usize, u32),
    ) {
        self.compact(actives);
        let Self { near, neighbours, waste } = self;
        let epoch = resting.epoch;
        let neighbour = |slot| Neighbour { aabb: boxes_at[slot as usize], slot };
        let arrived: Vec<Neighbour> = resting.arrived.iter().take(FEW + 1).copied().map(neighbour).collect();
        // Most slots are ruled out by a bit for each modulo 64.
        let bits = arrived.iter().fold(0_u64, |bits, one| bits | 1 << (one.slot % 64));
        let came =
            |slot: u32| bits & 1 << (slot % 64) != 0 && arrived.binary_search_by_key(&slot, |one| one.slot).is_ok();
        for (at, (near, b)) in near.iter_mut().zip(boxes).enumerate() {
            let stays = (0..3).all(|a| near.fat.min[a] <= b.min[a] && b.max[a] <= near.fat.max[a]);
            if !stays || near.epoch != epoch {
                let (known, first) = (near.first..near.first + near.len as usize, neighbours.len());
                *waste += known.len();
                if stays && near.epoch + 1 == epoch && arrived.len() <= FEW {
                    // One that arrived may have been here before it woke.
                    for k in known {
                        neighbours.extend(Some(neighbours[k]).filter(|one| !came(one.slot)));
                    }
                    let near = arrived.iter().filter(|one| one.aabb.overlaps(&near.fat) && wants(at, one.slot));
                    neighbours.extend(near);
                } else {
                    near.fat = fat(b);
                    resting.overlapping(&near.fat, |slot| {
                        if wants(at, slot) {
                            neighbours.push(neighbour(slot));
                        }
                    });
                }
                (near.first, near.len, near.epoch) = (first, (neighbours.len() - first) as u32, epoch);
            }
            let near = neighbours[near.first..][..near.len as usize].iter();
            near.filter(|one| one.aabb.overlaps(b) && resting.has(one.slot)).for_each(|one| found(at, one.slot));
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
