//! The grown boxes: which boxes have left theirs, and new ones for these.

use super::tree::GrownTree;
use crate::aabb::Aabb;
use crate::cpu::columns::ensure;
use crate::cpu::kernel::contain::{each_doubtful_block, within};
use crate::cpu::level::Simd;
use crate::cpu::workers::Workers;
use crate::error::Error;
use crate::filter::Filter;
use std::ops::Range;

/// Contains no box, not even an infinite one: whatever has no grown box yet is seen to have left it.
const NOTHING: Aabb = Aabb::new([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);

/// Every box grown by a margin, in the order of the input.
#[derive(Debug)]
pub(super) struct Grown {
    boxes: Vec<Aabb>,
    len: usize,
    /// Of 64 boxes each.
    flags: Vec<Flags>,
    simd: Simd,
}

/// One bit for each of 64 boxes.
#[derive(Debug, Clone, Copy, Default)]
struct Flags {
    /// The box got a new grown box in this frame, or is gone.
    dirty: u64,
    /// The box is fixed: its pairs with other fixed boxes are not kept.
    fixed: u64,
}

/// How much a box is grown on each side: a share of its mean edge.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Margin {
    pub(super) share: f32,
    /// Mean edges count as no longer than this, so that a world-sized box is not grown by the size of the world.
    pub(super) longest_edge: f32,
}

/// What one task finds in its share of the boxes.
#[derive(Debug, Default)]
pub(super) struct Share {
    /// Boxes that left their grown box.
    pub(super) left: Vec<u32>,
    /// Those of them whose new grown box does not meet the old one, new boxes included.
    far_away: usize,
    error: Option<Error>,
}

/// How a frame differs from the one before.
#[derive(Debug)]
pub(super) struct Changes {
    /// Boxes that left their grown box, the new ones and those that are gone included.
    pub(super) left: usize,
    /// Those of them that went far away or are new.
    pub(super) far_away: usize,
    /// Boxes that the frame before did not have.
    pub(super) new: Range<usize>,
    /// Boxes that this frame does not have.
    pub(super) gone: Range<usize>,
}

impl Grown {
    pub(super) fn new(simd: Simd) -> Self {
        Self { boxes: Vec::new(), len: 0, flags: Vec::new(), simd }
    }

    pub(super) fn as_slice(&self) -> &[Aabb] {
        &self.boxes[..self.len]
    }

    /// Forgets all grown boxes: the next frame makes every one again.
    pub(super) fn forget(&mut self) {
        self.len = 0;
    }

    /// Makes room for `objects` boxes.
    pub(super) fn reserve(&mut self, objects: usize) -> Result<(), Error> {
        ensure(&mut self.boxes, objects, "grown boxes")?;
        ensure(&mut self.flags, objects.div_ceil(64) + 1, "grown boxes")
    }

    /// Boxes in the share of one task; a multiple of 64, so that no two tasks write to the flags of one box.
    fn share_len(&self, tasks: usize) -> usize {
        self.len.div_ceil(tasks).next_multiple_of(64).max(64)
    }

    /// One phase: makes a new grown box for every box that is not within its own, and for those that are no longer fixed.
    ///
    /// # Errors
    /// [`Error::InvalidBox`]; what is known of the grown boxes is then of no use.
    pub(super) fn check(
        &mut self,
        workers: &Workers,
        boxes: &[Aabb],
        margin: Margin,
        filter: Option<&Filter>,
        shares: &mut [Share],
    ) -> Result<Changes, Error> {
        self.reserve(boxes.len().max(self.len))?;
        let (new, gone) = (self.len..boxes.len(), boxes.len()..self.len);
        if !new.is_empty() {
            self.boxes[new.clone()].fill(NOTHING);
        }
        self.len = boxes.len();
        let size = self.share_len(shares.len());
        for share in shares.iter_mut() {
            // A task without a part in this frame must not tell of the one before.
            (share.far_away, share.error) = (0, None);
            share.left.clear();
        }
        let simd = self.simd;
        let grown = (&mut self.boxes[..self.len], size);
        let flags = (&mut self.flags[..self.len.div_ceil(64)], size / 64);
        workers.each_share(shares, grown, flags, |k, share, grown, flags| {
            let first = k * size;
            free(flags, grown, first, filter);
            share.error = share.check(&boxes[first..first + grown.len()], grown, flags, first, margin, simd).err();
        });
        shares.iter_mut().find_map(|s| s.error.take()).map_or(Ok(()), Err)?;
        // Kept pairs of boxes that are gone go with the pairs of those that left.
        for id in gone.clone() {
            self.flags[id / 64].dirty |= 1 << (id % 64);
        }
        let left = shares.iter().map(|s| s.left.len()).sum::<usize>() + gone.len();
        Ok(Changes { left, far_away: shares.iter().map(|s| s.far_away).sum(), new, gone })
    }

    /// One phase: a new grown box for every box. They must be valid.
    pub(super) fn grow_all(&mut self, workers: &Workers, boxes: &[Aabb], margin: Margin, shares: &mut [Share]) {
        let size = self.share_len(shares.len());
        shares.iter_mut().for_each(|share| share.left.clear());
        let (grown, flags) =
            ((&mut self.boxes[..self.len], size), (&mut self.flags[..self.len.div_ceil(64)], size / 64));
        workers.each_share(shares, grown, flags, |k, _, grown, flags| {
            flags.iter_mut().for_each(|flags| flags.dirty = 0);
            for (grown, b) in grown.iter_mut().zip(&boxes[k * size..]) {
                *grown = margin.grow(b);
            }
        });
    }

    /// Calls `found` for every box whose grown box overlaps the new one of box `i`, but for two fixed ones. Of two boxes with new ones, the
    /// lower is told of the higher. Returns how many nodes of the tree were looked at.
    #[inline]
    pub(super) fn meet(&self, tree: &GrownTree, i: u32, mut found: impl FnMut(u32)) -> u32 {
        let (bounds, fixed) = (&self.boxes[i as usize], self.is_fixed(i));
        tree.overlapping(bounds, |j| {
            if (j > i || !self.is_new(j)) && !(fixed && self.is_fixed(j)) {
                found(j);
            }
        })
    }

    fn is_fixed(&self, id: u32) -> bool {
        self.flags[id as usize / 64].fixed >> (id % 64) & 1 == 1
    }

    /// Whether a kept pair has a box that got a new grown box, or is gone.
    #[inline(always)]
    pub(super) fn is_dirty(&self, (i, j): (u32, u32)) -> bool {
        // No short cut: a branch would cost more than the second look.
        self.is_new(i) | self.is_new(j)
    }

    /// Whether a box got a new grown box, or is gone.
    #[inline(always)]
    pub(super) fn is_new(&self, id: u32) -> bool {
        self.flags[id as usize / 64].dirty >> (id % 64) & 1 == 1
    }
}

/// Takes in which boxes are fixed now. One that is no longer has pairs that are not kept: it is given a grown box that it has left.
fn free(flags: &mut [Flags], grown: &mut [Aabb], first: usize, filter: Option<&Filter>) {
    for ((flags, grown), first) in flags.iter_mut().zip(grown.chunks_mut(64)).zip((first..).step_by(64)) {
        let fixed =
            filter.map_or(0, |f| (0..grown.len()).fold(0, |bits, k| bits | u64::from(f.is_fixed(first + k)) << k));
        let freed = flags.fixed & !fixed;
        flags.fixed = fixed;
        if freed != 0 {
            grown.iter_mut().enumerate().filter(|(k, _)| freed >> k & 1 == 1).for_each(|(_, grown)| *grown = NOTHING);
        }
    }
}

impl Share {
    fn check(
        &mut self,
        boxes: &[Aabb],
        grown: &mut [Aabb],
        flags: &mut [Flags],
        first: usize,
        margin: Margin,
        simd: Simd,
    ) -> Result<(), Error> {
        flags.iter_mut().for_each(|flags| flags.dirty = 0);
        let mut invalid = None;
        each_doubtful_block(simd, boxes, grown, |at, block| {
            for (k, grown) in block.iter_mut().enumerate() {
                let b = &boxes[at + k];
                if within(b, grown) {
                    continue;
                }
                if let Some(defect) = b.defect() {
                    invalid.get_or_insert(Error::InvalidBox { index: first + at + k, defect });
                    return;
                }
                let before = std::mem::replace(grown, margin.grow(b));
                self.far_away += usize::from(!before.overlaps(grown));
                flags[(at + k) / 64].dirty |= 1 << ((at + k) % 64);
                self.left.push((first + at + k) as u32);
            }
        });
        invalid.map_or(Ok(()), Err)
    }
}

impl Margin {
    /// The mean edge of a box, as far as it counts.
    #[inline]
    fn edge(&self, b: &Aabb) -> f32 {
        let mean = (0..3).map(|a| b.max[a] - b.min[a]).sum::<f32>() / 3.0;
        // False for NaN too: an infinite box has such an edge.
        if mean < self.longest_edge { mean } else { self.longest_edge }
    }

    /// A valid box grown on every side. It contains the box, because rounding never reverses an order.
    #[inline]
    fn grow(&self, b: &Aabb) -> Aabb {
        let by = self.share * self.edge(b);
        Aabb { min: b.min.map(|v| v - by), max: b.max.map(|v| v + by) }
    }
}
