//! The pairs of a frame: the output of every algorithm.

mod fill;
mod order;

use crate::cpu::Workers;
use crate::{Error, Filter, Screen, mix};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Weak};

pub(crate) use fill::each_bit;
pub(crate) use order::Sorter;

/// A pair of boxes: two positions in the input, the lower one first.
pub type Pair = (u32, u32);

/// The order in which a caller wants the pairs.
///
/// ```
/// use sapwise::{PairOrder, Pairs};
///
/// let pairs = Pairs::with_order(PairOrder::Canonical);
/// assert!(pairs.as_slice().is_empty()); // until the first frame
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PairOrder {
    /// The order in which the algorithm finds them: the least work.
    #[default]
    Any,
    /// Ascending by first, then second member: the same list, bit for bit, from every algorithm, as lockstep games
    /// need.
    Canonical,
}

/// The overlapping pairs of one frame: each pair once, the lower position first.
///
/// The caller owns the list and reuses it for every frame. Its memory grows to the largest frame and stays.
///
/// With a [`Filter`], the list writes, counts and limits only the wanted pairs, whatever algorithm finds them.
///
/// ```
/// use sapwise::{PairOrder, Pairs};
///
/// let mut pairs = Pairs::with_order(PairOrder::Canonical);
/// pairs.push(1, 2);
/// pairs.push(0, 3);
/// pairs.finish()?;
/// assert_eq!(pairs.as_slice(), [(0, 3), (1, 2)]);
/// # Ok::<(), sapwise::Error>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct Pairs {
    /// Initialised up to the largest frame, so that growth within it writes each pair once.
    buffer: Vec<Pair>,
    len: usize,
    /// There are more wanted pairs than could be stored.
    over: bool,
    /// If this list is a part of a frame: whether any of the parts is over.
    any_over: Option<Arc<AtomicBool>>,
    /// Pairs that were found and dropped by the filter.
    unwanted: u64,
    /// Shared with the lists of tasks while they work.
    filter: Option<Arc<Screen>>,
    order: PairOrder,
    limit: Option<usize>,
    /// Elements of the refused allocation, if one was refused.
    refused: Option<usize>,
    sorter: Sorter,
}

impl Pairs {
    /// Makes an empty list in any order and without a limit.
    pub fn new() -> Self {
        Self::default()
    }

    /// Makes an empty list that wants its pairs in `order`.
    pub fn with_order(order: PairOrder) -> Self {
        Self { order, ..Self::default() }
    }

    /// Sets the most pairs that may be stored, 8 bytes each, or lifts that limit.
    ///
    /// A frame with more wanted pairs is [`Error::TooManyPairs`]. The built-in algorithms stop soon after the limit,
    /// so the number of pairs is unknown then. On `k` threads, `k` above 1, an algorithm may hold up to `8 k + 1`
    /// times the limit while it works, because each task has its own list. `pair-cache` also keeps up to 32 pairs for
    /// each box, and memory for at most five times as many, whatever the limit.
    pub fn set_limit(&mut self, limit: Option<usize>) {
        self.limit = limit;
    }

    /// Returns the limit set by [`set_limit`](Self::set_limit).
    pub fn limit(&self) -> Option<usize> {
        self.limit
    }

    /// Sets the filter that pairs must pass from the next frame on, or lifts it.
    pub fn set_filter(&mut self, filter: Option<Filter>) {
        self.filter = filter.map(|filter| Arc::new(Screen::new(filter)));
    }

    /// Returns the filter set by [`set_filter`](Self::set_filter).
    pub fn filter(&self) -> Option<&Filter> {
        self.filter.as_deref().map(|screen| &screen.filter)
    }

    /// Returns the filter for changes between frames: in place, without a copy unless this list was cloned.
    pub fn filter_mut(&mut self) -> Option<&mut Filter> {
        self.filter.as_mut().map(|screen| Arc::make_mut(screen).filter_mut())
    }

    /// Returns the state of the filter, to compare with that of a later frame.
    #[doc(hidden)]
    pub fn filter_state(&self) -> FilterState {
        FilterState(self.filter.as_ref().map_or_else(Weak::new, Arc::downgrade))
    }

    /// Returns the filter and what methods derive from it.
    pub(crate) fn screen(&self) -> Option<&Screen> {
        self.filter.as_deref()
    }

    /// Returns the order that the caller wants.
    pub fn order(&self) -> PairOrder {
        self.order
    }

    /// Returns the pairs of the last frame.
    pub fn as_slice(&self) -> &[Pair] {
        &self.buffer[..self.len]
    }

    /// Returns the number of pairs of the last frame.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Returns whether the last frame has no pair.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Iterates over the pairs of the last frame.
    pub fn iter(&self) -> std::slice::Iter<'_, Pair> {
        self.as_slice().iter()
    }

    /// Returns the number of pairs that the search of the last frame found: the wanted ones, and those that only the
    /// filter dropped.
    ///
    /// Without a filter this is [`len`](Self::len). With one it depends on the algorithm: `brute`, `sap` and
    /// `grid-sap` find unwanted pairs that `bvh` and `pair-cache` rule out earlier. GPUs do not count them, unless the
    /// filter does not fit into a buffer and the host tests the pairs.
    pub fn overlapping(&self) -> u64 {
        self.len as u64 + self.unwanted
    }

    /// Returns a 64-bit hash of the set of pairs, which does not depend on their order.
    pub fn fingerprint(&self) -> u64 {
        self.iter().fold(self.len as u64, |sum, &(i, j)| sum.wrapping_add(mix(u64::from(i) << 32 | u64::from(j))))
    }

    /// Empties the list and keeps its memory. Every [`BroadPhase`](crate::BroadPhase) begins with this.
    pub fn clear(&mut self) {
        self.len = 0;
        self.over = false;
        self.unwanted = 0;
        self.refused = None;
        if let Some(screen) = self.filter.as_mut().filter(|screen| screen.is_stale) {
            Arc::make_mut(screen).derive();
        }
    }

    /// Adds one pair, in either order of its members, if the filter wants it. A pair beyond the limit is not stored.
    #[inline]
    pub fn push(&mut self, a: u32, b: u32) {
        if self.filter.as_ref().is_some_and(|screen| !screen.filter.wants((a, b))) {
            self.unwanted += 1;
            return;
        }
        if self.is_full() || self.len == self.buffer.len() && !self.grow(1) {
            self.exceed();
            return;
        }
        self.buffer[self.len] = (a.min(b), a.max(b));
        self.len += 1;
    }

    /// Returns the number of pairs that the list has memory for.
    pub(crate) fn capacity(&self) -> usize {
        self.buffer.capacity()
    }

    /// Returns whether every wanted pair is stored.
    pub(crate) fn is_complete(&self) -> bool {
        !self.over && self.refused.is_none()
    }

    /// Sorts the pairs if the caller wants that, and reports pairs that did not fit. Every
    /// [`BroadPhase`](crate::BroadPhase) ends with this.
    ///
    /// Sorting takes 4 bytes for each pair, or 8 if pairs are few or boxes many millions. Without that memory it takes
    /// longer.
    ///
    /// # Errors
    /// [`Error::TooManyPairs`] and [`Error::OutOfMemory`].
    pub fn finish(&mut self) -> Result<(), Error> {
        self.finish_on(&Workers::one())
    }

    /// Does the same as [`finish`](Self::finish), on several threads if that pays.
    #[doc(hidden)]
    pub fn finish_on(&mut self, threads: &Workers) -> Result<(), Error> {
        if let Some(elements) = self.refused {
            return Err(Error::OutOfMemory { what: "pairs", elements });
        }
        if let Some(limit) = self.limit.filter(|_| self.over) {
            return Err(Error::TooManyPairs { limit });
        }
        if self.order == PairOrder::Canonical {
            self.sorter.sort(threads, &mut self.buffer[..self.len]);
        }
        Ok(())
    }

    /// Makes room for `pairs` pairs in all, so that frames up to that size allocate nothing.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn reserve(&mut self, pairs: usize) -> Result<(), Error> {
        let wanted = self.limit.map_or(pairs, |l| pairs.min(l));
        if let Some(more) = wanted.checked_sub(self.buffer.len()) {
            let refused = |_| Error::OutOfMemory { what: "pairs", elements: wanted };
            self.buffer.try_reserve_exact(more).map_err(refused)?;
            self.buffer.resize(wanted, (0, 0));
        }
        Ok(())
    }
}

/// A filter, or none, at one time. Equal ones had the same memberships: a change of a filter that has a state moves it
/// to another place in memory.
#[derive(Debug, Clone, Default)]
pub struct FilterState(Weak<Screen>);

impl PartialEq for FilterState {
    fn eq(&self, other: &Self) -> bool {
        self.0.ptr_eq(&other.0)
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
    fn fingerprint_ignores_the_order() {
        let any = filled(PairOrder::Any, &[(7, 3), (1, 2), (0, 9)]);
        let canonical = filled(PairOrder::Canonical, &[(0, 9), (3, 7), (2, 1)]);
        assert_eq!(canonical.as_slice(), [(0, 9), (1, 2), (3, 7)]);
        assert_eq!(any.fingerprint(), canonical.fingerprint());
        assert_ne!(any.fingerprint(), filled(PairOrder::Any, &[(7, 3), (1, 2), (0, 8)]).fingerprint());
    }

    #[test]
    fn each_change_of_a_filter_is_a_new_state() {
        let mut list = Pairs::new();
        assert_eq!(list.filter_state(), FilterState::default());
        list.set_filter(Some(Filter::default()));
        for _ in 0..3 {
            let state = list.filter_state();
            assert!(state != FilterState::default() && list.clone().filter_state() == state);
            list.clear();
            assert_eq!(list.filter_state(), state);
            list.filter_mut().unwrap().memberships.clear();
            list.clear();
            assert_ne!(list.filter_state(), state);
        }
    }

    #[test]
    fn limit_bounds_memory() {
        let mut list = Pairs::new();
        list.set_limit(Some(10));
        (0..1000).for_each(|j| list.push(0, j + 1));
        assert_eq!(list.finish(), Err(Error::TooManyPairs { limit: 10 }));
        assert!(list.buffer.capacity() <= 16);
        list.clear();
        (0..10).for_each(|j| list.push(0, j + 1));
        assert_eq!(list.finish(), Ok(()));
    }
}
