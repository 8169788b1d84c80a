//! The one output of every algorithm.

use crate::cpu::each_bit;
use crate::error::Error;
use crate::splitmix::mix;

/// Two positions in the input, the lower one first.
pub type Pair = (u32, u32);

/// The order in which a caller wants the pairs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PairOrder {
    /// Whatever order the algorithm produces: the same set, the least work.
    #[default]
    Any,
    /// Ascending by first, then second member: the same list bit for bit from every algorithm, as lockstep games need.
    Canonical,
}

/// Pairs that are fetched together, then tested together: few enough for the first-level cache, enough for memory to answer.
const SIFTED_TOGETHER: usize = 64;

/// The overlapping pairs of one frame: each pair once, the lower position first.
///
/// Owned by the caller and reused from frame to frame: its memory grows to the largest frame seen and stays.
#[derive(Debug, Clone, Default)]
pub struct Pairs {
    /// Initialised up to the largest frame seen, so that growth within it writes each pair just once.
    buffer: Vec<Pair>,
    len: usize,
    /// Pairs found, those beyond the limit included.
    found: u64,
    order: PairOrder,
    limit: Option<usize>,
    /// Elements of the allocation that was refused, if one was.
    refused: Option<usize>,
}

impl Pairs {
    /// An empty list in any order and without a limit.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// An empty list that wants its pairs in `order`.
    #[must_use]
    pub fn with_order(order: PairOrder) -> Self {
        Self { order, ..Self::default() }
    }

    /// Sets the most pairs that may be stored, 8 bytes each, or lifts that limit.
    ///
    /// A frame with more pairs is [`Error::TooManyPairs`], which tells how many there are. An algorithm on `k` threads, `k` above 1,
    /// may hold up to `8 k + 1` times the limit while it works: each of its tasks has a list of its own. `verlet` keeps up to 32 pairs
    /// for each box beside that, whatever the limit.
    pub fn set_limit(&mut self, limit: Option<usize>) {
        self.limit = limit;
    }

    /// The limit set by [`set_limit`](Self::set_limit).
    #[must_use]
    pub fn limit(&self) -> Option<usize> {
        self.limit
    }

    /// The order that the caller wants.
    #[must_use]
    pub fn order(&self) -> PairOrder {
        self.order
    }

    /// The pairs of the last frame.
    #[must_use]
    pub fn as_slice(&self) -> &[Pair] {
        &self.buffer[..self.len]
    }

    /// How many pairs the last frame has.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether the last frame has no pair.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The pairs of the last frame, one by one.
    pub fn iter(&self) -> std::slice::Iter<'_, Pair> {
        self.as_slice().iter()
    }

    /// A 64-bit hash of the set of pairs that does not depend on their order.
    #[must_use]
    pub fn fingerprint(&self) -> u64 {
        self.iter().fold(self.len as u64, |sum, &(i, j)| sum.wrapping_add(mix(u64::from(i) << 32 | u64::from(j))))
    }

    /// Empties the list and keeps its memory. Every [`BroadPhase`](crate::BroadPhase) begins with this.
    pub fn clear(&mut self) {
        self.len = 0;
        self.found = 0;
        self.refused = None;
    }

    /// Adds one pair, in either order of its members. Beyond the limit it is counted and not stored.
    #[inline]
    pub fn push(&mut self, a: u32, b: u32) {
        if self.is_full() || self.len == self.buffer.len() && !self.grow(1) {
            self.found += 1;
            return;
        }
        self.buffer[self.len] = (a.min(b), a.max(b));
        self.len += 1;
        self.found += 1;
    }

    /// Adds `id` paired with each of `others` whose bit is set in `mask`.
    #[inline]
    pub(crate) fn push_mask(&mut self, id: u32, others: &[u32], mask: u32) {
        if self.is_full() {
            self.found += u64::from(mask.count_ones());
        } else {
            each_bit(mask, |bit| self.push(id, others[bit]));
        }
    }

    /// Adds those of `pairs` for which `wanted` holds. They stand lower member first. `fetch` is told of each some time before
    /// `wanted` is asked, so that memory can be on its way.
    #[inline]
    pub(crate) fn extend_where(&mut self, pairs: &[Pair], fetch: impl Fn(Pair), wanted: impl Fn(Pair) -> bool) {
        let mut ahead = pairs.iter();
        ahead.by_ref().take(SIFTED_TOGETHER).for_each(|&pair| fetch(pair));
        for pairs in pairs.chunks(SIFTED_TOGETHER) {
            ahead.by_ref().take(SIFTED_TOGETHER).for_each(|&pair| fetch(pair));
            self.add_where(pairs, &wanted);
        }
    }

    /// Drops those for which `dropped` holds, and adds to `out` those of the rest for which `wanted` holds. `fetch` as above.
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
            // Those that were fetched a round before.
            out.add_where(&self.buffer[tested..first], &wanted);
            tested = first;
        }
        out.add_where(&self.buffer[tested..kept], &wanted);
        self.len = kept;
        self.found = kept as u64;
    }

    #[inline]
    fn add_where(&mut self, pairs: &[Pair], wanted: impl Fn(Pair) -> bool) {
        if let Some(room) = self.room(pairs.len()) {
            let mut added = 0;
            for &pair in pairs {
                // Written in any case and kept if wanted: no branch, which would often be guessed wrong.
                room[added] = pair;
                added += usize::from(wanted(pair));
            }
            self.extend_by(added);
        } else {
            pairs.iter().filter(|&&pair| wanted(pair)).for_each(|&(i, j)| self.push(i, j));
        }
    }

    /// Makes room for half as many pairs again where there is room for less than an eighth more: a list that grows and
    /// shrinks around a size then allocates once.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub(crate) fn reserve_some_more(&mut self) -> Result<(), Error> {
        if self.buffer.len() < self.len + self.len / 8 { self.reserve(self.len + self.len / 2) } else { Ok(()) }
    }

    /// Takes in pairs that were written at the head of [`Pairs::room`], lower member first.
    #[inline]
    pub(crate) fn extend_by(&mut self, added: usize) {
        self.len += added;
        self.found += added as u64;
    }

    /// Room for `more` pairs behind the present ones; `None` near the limit or when memory is refused.
    #[inline]
    pub(crate) fn room(&mut self, more: usize) -> Option<&mut [Pair]> {
        if self.buffer.len() - self.len < more && !self.grow(more) || self.limit.is_some_and(|l| l - self.len < more) {
            return None;
        }
        Some(&mut self.buffer[self.len..self.len + more])
    }

    /// Pairs found, those that could not be stored included.
    pub(crate) fn found(&self) -> u64 {
        self.found
    }

    /// Whether every pair found is stored.
    pub(crate) fn is_complete(&self) -> bool {
        self.found == self.len as u64 && self.refused.is_none()
    }

    /// Whether nothing more can be stored. From there on pairs are only counted, sixteen at a time: 2^20 boxes in one
    /// point have 5 * 10^11.
    #[inline]
    pub(crate) fn is_full(&self) -> bool {
        self.refused.is_some() || self.limit.is_some_and(|limit| self.len >= limit)
    }

    /// Sorts if the caller wants it, and reports what did not fit. Every [`BroadPhase`](crate::BroadPhase) ends with this.
    ///
    /// # Errors
    /// [`Error::TooManyPairs`] and [`Error::OutOfMemory`].
    pub fn finish(&mut self) -> Result<(), Error> {
        if let Some(elements) = self.refused {
            return Err(Error::OutOfMemory { what: "pairs", elements });
        }
        if let Some(limit) = self.limit
            && self.found > limit as u64
        {
            return Err(Error::TooManyPairs { limit, pairs: self.found });
        }
        if self.order == PairOrder::Canonical {
            self.buffer[..self.len].sort_unstable();
        }
        Ok(())
    }

    /// Makes room for `pairs` in all, so that frames up to that size allocate nothing.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn reserve(&mut self, pairs: usize) -> Result<(), Error> {
        let wanted = self.limit.map_or(pairs, |l| pairs.min(l));
        if wanted > self.buffer.len() {
            let more = wanted - self.buffer.len();
            if self.buffer.try_reserve(more).is_err() {
                return Err(Error::OutOfMemory { what: "pairs", elements: wanted });
            }
            self.buffer.resize(wanted, (0, 0));
        }
        Ok(())
    }

    /// Appends pairs that stand lower member first and are known to fit under the limit.
    #[cfg(feature = "gpu")]
    pub(crate) fn extend(&mut self, pairs: &[[u32; 2]]) -> Result<(), Error> {
        self.reserve(self.len + pairs.len())?;
        for (to, &[a, b]) in self.buffer[self.len..].iter_mut().zip(pairs) {
            *to = (a, b);
        }
        self.len += pairs.len();
        self.found += pairs.len() as u64;
        Ok(())
    }

    /// Counts pairs that are not stored.
    #[cfg(feature = "gpu")]
    pub(crate) fn skip(&mut self, pairs: u64) {
        self.found += pairs;
    }

    /// Appends another list: its pairs, its count beyond the limit and its refused allocation.
    pub(crate) fn append(&mut self, part: &Pairs) {
        self.refused = self.refused.or(part.refused);
        let fits = self.limit.map_or(part.len, |l| part.len.min(l.saturating_sub(self.len)));
        if self.len + fits > self.buffer.len() && self.reserve(self.len + fits).is_err() {
            self.refused = Some(self.len + fits);
        } else {
            self.buffer[self.len..self.len + fits].copy_from_slice(&part.buffer[..fits]);
            self.len += fits;
        }
        self.found += part.found;
    }

    /// Room for `more` pairs beyond the present ones; `false` at the limit or when memory is refused.
    #[cold]
    fn grow(&mut self, more: usize) -> bool {
        let limit = self.limit.unwrap_or(usize::MAX);
        if self.refused.is_some() || self.len + more > limit {
            return false;
        }
        let wanted = (self.buffer.len() * 2).max(self.len + more).max(64).min(limit);
        if self.buffer.try_reserve_exact(wanted - self.buffer.len()).is_err() {
            self.refused = Some(wanted);
            return false;
        }
        self.buffer.resize(wanted, (0, 0));
        true
    }
}

impl<'a> IntoIterator for &'a Pairs {
    type Item = &'a Pair;
    type IntoIter = std::slice::Iter<'a, Pair>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled(order: PairOrder, pairs: &[Pair]) -> Pairs {
        let mut list = Pairs::with_order(order);
        pairs.iter().for_each(|&(a, b)| list.push(a, b));
        list.finish().unwrap();
        list
    }

    #[test]
    fn canonical_order_sorts_and_fingerprints_ignore_order() {
        let any = filled(PairOrder::Any, &[(7, 3), (1, 2), (0, 9)]);
        let canonical = filled(PairOrder::Canonical, &[(0, 9), (3, 7), (2, 1)]);
        assert_eq!(canonical.as_slice(), [(0, 9), (1, 2), (3, 7)]);
        assert_eq!(any.fingerprint(), canonical.fingerprint());
        assert_ne!(any.fingerprint(), filled(PairOrder::Any, &[(7, 3), (1, 2), (0, 8)]).fingerprint());
    }

    #[test]
    fn a_limit_bounds_memory_and_the_error_counts_every_pair() {
        let mut list = Pairs::new();
        list.set_limit(Some(10));
        (0..1000).for_each(|j| list.push(0, j + 1));
        assert_eq!(list.finish(), Err(Error::TooManyPairs { limit: 10, pairs: 1000 }));
        assert!(list.buffer.capacity() <= 16);
        list.clear();
        (0..10).for_each(|j| list.push(0, j + 1));
        assert_eq!(list.finish(), Ok(()));
    }
}
