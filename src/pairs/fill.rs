//! How the built-in algorithms write pairs: in blocks, through the filter, from the lists of their tasks.

use super::Pairs;
use crate::cpu::Workers;
use crate::{Error, Pair};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// Pairs prefetched together, then tested together: few enough for the first-level cache, and enough to hide the
/// latency of memory.
const SIFTED_TOGETHER: usize = 64;

/// Pairs that a thread copies at once: 64 KiB.
const COPIED_TOGETHER: usize = 8192;

/// Calls `f` for each set bit of a mask, ascending.
#[inline(always)]
pub(crate) fn each_bit(mut mask: u32, mut f: impl FnMut(usize)) {
    while mask != 0 {
        f(mask.trailing_zeros() as usize);
        mask &= mask - 1;
    }
}

impl Pairs {
    /// Adds the pairs of `id` with each of `others` whose bit is set in `mask`.
    #[inline]
    pub(crate) fn push_mask(&mut self, id: u32, others: &[u32], mask: u32) {
        each_bit(mask, |bit| self.push(id, others[bit]));
    }

    /// Adds those of `pairs`, which stand lower member first, for which `wanted` holds. Calls `fetch` for each pair
    /// some time before `wanted`, so that it can prefetch.
    #[inline]
    pub(crate) fn extend_where(&mut self, pairs: &[Pair], fetch: impl Fn(Pair), wanted: impl Fn(Pair) -> bool) {
        let mut ahead = pairs.iter();
        ahead.by_ref().take(SIFTED_TOGETHER).for_each(|&pair| fetch(pair));
        for pairs in pairs.chunks(SIFTED_TOGETHER) {
            ahead.by_ref().take(SIFTED_TOGETHER).for_each(|&pair| fetch(pair));
            self.add_where(pairs, &wanted);
        }
    }

    /// Drops the pairs for which `dropped` holds, and adds to `out` those of the rest for which `wanted` holds. `fetch`
    /// is as in [`extend_where`](Self::extend_where).
    #[inline]
    pub(crate) fn sift(
        &mut self,
        out: &mut Pairs,
        dropped: impl Fn(Pair) -> bool,
        fetch: impl Fn(Pair),
        wanted: impl Fn(Pair) -> bool,
    ) {
        let (mut kept, mut tested) = (0, 0);
        for from in (0..self.len).step_by(SIFTED_TOGETHER) {
            let first = kept;
            for at in from..(from + SIFTED_TOGETHER).min(self.len) {
                let pair = self.buffer[at];
                fetch(pair);
                self.buffer[kept] = pair;
                kept += usize::from(!dropped(pair));
            }
            // The pairs fetched a round earlier.
            out.add_where(&self.buffer[tested..first], &wanted);
            tested = first;
        }
        out.add_where(&self.buffer[tested..kept], &wanted);
        // `over` and `refused` stay: pairs that could not be stored earlier are still missing.
        self.len = kept;
    }

    #[inline]
    fn add_where(&mut self, pairs: &[Pair], wanted: impl Fn(Pair) -> bool) {
        if let Some(room) = self.room(pairs.len()) {
            let mut added = 0;
            for &pair in pairs {
                // Written in any case and kept if wanted: no branch, which would often be predicted wrong.
                room[added] = pair;
                added += usize::from(wanted(pair));
            }
            self.extend_by(added);
        } else {
            pairs.iter().filter(|&&pair| wanted(pair)).for_each(|&(i, j)| self.push(i, j));
        }
    }

    /// Makes room for an eighth more pairs if there is room for less than a sixteenth: then a list that grows and
    /// shrinks around a size allocates once.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub(crate) fn reserve_some_more(&mut self) -> Result<(), Error> {
        if self.buffer.len() < self.len + self.len / 16 { self.reserve(self.len + self.len / 8) } else { Ok(()) }
    }

    /// Adds the wanted ones of the `added` pairs that were written to the head of [`Pairs::room`], lower member first.
    #[inline]
    pub(crate) fn extend_by(&mut self, added: usize) {
        if self.filter.is_none() {
            self.len += added;
        } else {
            self.extend_by_wanted(added);
        }
    }

    /// Adds the `added` pairs that were written to the head of [`Pairs::room`], lower member first. All are wanted.
    #[inline]
    pub(crate) fn extend_by_tested(&mut self, added: usize) {
        self.len += added;
    }

    /// Filters the pairs now: few are written at a time, so they are still in the first-level cache.
    #[cold]
    fn extend_by_wanted(&mut self, added: usize) {
        let Self { buffer, len, filter, unwanted, .. } = self;
        let written = &mut buffer[*len..*len + added];
        let wanted = filter.as_ref().map_or(added, |screen| screen.filter.keep_wanted(written));
        *unwanted += (added - wanted) as u64;
        *len += wanted;
    }

    /// Returns room for `more` pairs behind the present ones; `None` near the limit, or if memory is refused.
    #[inline]
    pub(crate) fn room(&mut self, more: usize) -> Option<&mut [Pair]> {
        if self.buffer.len() - self.len < more && !self.grow(more) || self.limit.is_some_and(|l| l - self.len < more) {
            return None;
        }
        Some(&mut self.buffer[self.len..self.len + more])
    }

    /// Returns whether nothing more can be stored.
    #[inline]
    pub(super) fn is_full(&self) -> bool {
        self.refused.is_some() || self.limit.is_some_and(|limit| self.len >= limit)
    }

    /// Appends the wanted ones of pairs that stand lower member first. `tested`: all are wanted.
    #[doc(hidden)]
    pub fn extend(&mut self, pairs: &[[u32; 2]], threads: &Workers, tested: bool) -> Result<(), Error> {
        if tested || self.filter.is_none() {
            self.reserve(self.len + pairs.len())?;
            if let Some(room) = self.room(pairs.len()) {
                threads.each_of(room.chunks_mut(COPIED_TOGETHER).zip(pairs.chunks(COPIED_TOGETHER)), |(to, pairs)| {
                    to.iter_mut().zip(pairs).for_each(|(to, &[a, b])| *to = (a, b));
                });
                self.len += pairs.len();
                return Ok(());
            }
        }
        for pairs in pairs.chunks(SIFTED_TOGETHER) {
            if let Some(room) = self.room(pairs.len()) {
                room.iter_mut().zip(pairs).for_each(|(to, &[a, b])| *to = (a, b));
                self.extend_by(pairs.len());
            } else {
                pairs.iter().for_each(|&[a, b]| self.push(a, b));
            }
        }
        Ok(())
    }

    /// Returns whether a wanted pair could not be stored in this list. Then the frame has no answer, and the search may
    /// stop.
    #[inline]
    #[doc(hidden)]
    pub fn is_over(&self) -> bool {
        self.over
    }

    /// Returns whether any part of the frame [is over](Self::is_over). More expensive: call it once for each task.
    #[inline]
    pub(crate) fn is_any_over(&self) -> bool {
        self.over || self.any_over.as_ref().is_some_and(|over| over.load(Relaxed))
    }

    /// Notes that there are more wanted pairs than can be stored.
    #[cold]
    #[doc(hidden)]
    pub fn exceed(&mut self) {
        self.over = true;
        if let Some(over) = &self.any_over {
            over.store(true, Relaxed);
        }
    }

    /// Returns whether `more` pairs are surely too many. Pairs that were not `tested` may be dropped by a filter.
    #[doc(hidden)]
    pub fn is_too_small_for(&self, more: u64, tested: bool) -> bool {
        (tested || self.filter.is_none()) && self.limit.is_some_and(|limit| self.len as u64 + more > limit as u64)
    }

    /// Begins a list that takes a part of the pairs of `whole`, under the same limit and filter. All parts share
    /// `any_over`, which is `false`.
    #[doc(hidden)]
    pub fn begin_part(&mut self, whole: &Pairs, any_over: &Arc<AtomicBool>) {
        self.clear();
        self.any_over = Some(Arc::clone(any_over));
        self.limit = whole.limit;
        self.filter.clone_from(&whole.filter);
    }

    /// Releases the filter: while it is shared, a change by the caller would copy it.
    #[doc(hidden)]
    pub fn end_part(&mut self) {
        self.set_filter(None);
    }

    /// Adds complete parts, whose pairs were written behind each other to the head of [`Pairs::room`].
    pub(crate) fn extend_by_parts(&mut self, parts: &[Pairs]) {
        for part in parts {
            self.len += part.len;
            self.unwanted += part.unwanted;
        }
    }

    /// Appends a part: its pairs, its counts and its errors.
    #[doc(hidden)]
    pub fn append(&mut self, part: &Pairs) {
        self.refused = self.refused.or(part.refused);
        let fits = self.limit.map_or(part.len, |l| part.len.min(l.saturating_sub(self.len)));
        self.unwanted += part.unwanted;
        if self.len + fits > self.buffer.len() && self.reserve(self.len + fits).is_err() {
            self.refused = Some(self.len + fits);
        } else {
            self.buffer[self.len..self.len + fits].copy_from_slice(&part.buffer[..fits]);
            self.len += fits;
            self.over |= part.over || fits < part.len;
        }
    }

    /// Makes room for `more` pairs behind the present ones; `false` at the limit, or if memory is refused.
    #[cold]
    pub(super) fn grow(&mut self, more: usize) -> bool {
        let limit = self.limit.unwrap_or(usize::MAX);
        if self.refused.is_some() || self.len + more > limit {
            return false;
        }
        // By a quarter: the memory matters more than the copies of the first frames.
        let wanted = (self.buffer.len() + self.buffer.len() / 4).max(self.len + more).max(64).min(limit);
        self.refused = self.reserve(wanted).err().map(|_| wanted);
        self.refused.is_none()
    }
}
