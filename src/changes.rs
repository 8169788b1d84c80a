//! What began and what ended between two frames.

use crate::error::Error;
use crate::pairs::{Alone, Pairs, Sorter};

/// Follows pairs from frame to frame by ids of the caller's: which began, which ended, and all there are.
///
/// Every list is sorted, and each pair has its lower id first. So they are the same bit for bit whatever algorithm found the
/// pairs and in whatever order, with [`PairOrder::Any`](crate::PairOrder::Any) too.
///
/// Positions may change from frame to frame, as with `swap_remove`: a pair lasts while both ids do. Boxes with the same id
/// count as one: a pair between two of them is left out, and two ids are one pair however many of their boxes overlap.
///
/// An update sorts the pairs as numbers of 64 bits and runs along those of the update before. On one core of an AMD EPYC that
/// takes 10 to 20 ns a pair with 1000 to 100 000 pairs: about as long as `grid-sap@cpu1` takes to find the pairs of a crowded scene,
/// and a third of it where they come in canonical order and ids ascend with the positions. When ids have changed it sorts them
/// too. Memory for each pair: 12 bytes and two pairs of ids, and another for each that began or ended; for each box 8 bytes and
/// two ids.
// A hash table of the pairs took two thirds of that time with 1000 pairs, at least as long with 100 000, more than twice as long with 3
// million, and leaves them in no order.
#[derive(Debug, Clone)]
pub struct Changes<Id = u32> {
    /// Those of the last update.
    ids: Vec<Id>,
    /// The same, ascending, each with its position.
    sorted: Vec<(Id, u32)>,
    /// For each position where its id stands first in `sorted`.
    ranks: Vec<u32>,
    /// The new pairs: the rank of the lower id, and below it that of the other. Numbers sort faster than pairs of ids.
    keys: Vec<u64>,
    sorter: Sorter,
    pairs: Vec<(Id, Id)>,
    /// Memory for the pairs of the next update.
    next: Vec<(Id, Id)>,
    begun: Vec<(Id, Id)>,
    ended: Vec<(Id, Id)>,
}

impl<Id: Copy + Ord> Changes<Id> {
    /// No pairs yet: all those of the first update begin.
    #[must_use]
    pub fn new() -> Self {
        Self {
            ids: Vec::new(),
            sorted: Vec::new(),
            ranks: Vec::new(),
            keys: Vec::new(),
            sorter: Sorter::default(),
            pairs: Vec::new(),
            next: Vec::new(),
            begun: Vec::new(),
            ended: Vec::new(),
        }
    }

    /// Takes in the pairs of a frame, in which the box at position `k` was `ids[k]`.
    ///
    /// # Errors
    /// [`Error::MissingId`] names a position in `pairs` at which `ids` has none; [`Error::OutOfMemory`]. Nothing has begun or ended
    /// then, and the next update is held against the last one that succeeded.
    pub fn update(&mut self, pairs: &Pairs, ids: &[Id]) -> Result<(), Error> {
        self.begun.clear();
        self.ended.clear();
        // No member of a pair lies beyond.
        let ids = &ids[..ids.len().min(u32::MAX as usize)];
        if self.ids != ids {
            self.rank(ids)?;
        }
        let missing = |position: u32| Error::MissingId { position, ids: ids.len() };
        let ranks = &self.ranks;
        fill_keys(&mut self.keys, &mut self.sorter, pairs, |at| {
            ranks.get(at as usize).copied().ok_or_else(|| missing(at))
        })?;
        let sorted = &self.sorted;
        fill(&mut self.next, &self.keys, |rank| sorted[rank as usize].0)?;
        self.compare()
    }

    /// The pairs of the last update that were not among those before.
    #[must_use]
    pub fn begun(&self) -> &[(Id, Id)] {
        &self.begun
    }

    /// The pairs that are not among those of the last update, but were before.
    #[must_use]
    pub fn ended(&self) -> &[(Id, Id)] {
        &self.ended
    }

    /// How many pairs of the last update were among those before.
    #[must_use]
    pub fn lasting(&self) -> usize {
        self.pairs.len() - self.begun.len()
    }

    /// All pairs of the last update.
    #[must_use]
    pub fn pairs(&self) -> &[(Id, Id)] {
        &self.pairs
    }

    /// Finds the rank of each id.
    fn rank(&mut self, ids: &[Id]) -> Result<(), Error> {
        let Self { ids: known, sorted, ranks, .. } = self;
        // Emptied first: after a refused allocation none is known.
        known.clear();
        sorted.clear();
        ranks.clear();
        reserve(sorted, ids.len())?;
        reserve(ranks, ids.len())?;
        reserve(known, ids.len())?;
        sorted.extend(ids.iter().copied().zip(0..));
        sorted.sort_unstable_by_key(|&(id, _)| id);
        ranks.resize(ids.len(), 0);
        let mut first = 0;
        for (rank, &(id, at)) in sorted.iter().enumerate() {
            if id != sorted[first].0 {
                first = rank;
            }
            ranks[at as usize] = first as u32;
        }
        known.extend_from_slice(ids);
        Ok(())
    }

    /// Holds the next pairs against the present ones and takes their place.
    fn compare(&mut self) -> Result<(), Error> {
        let found = differences(&self.next, &self.pairs, &mut self.begun, &mut self.ended);
        if found.is_ok() {
            std::mem::swap(&mut self.pairs, &mut self.next);
        } else {
            self.begun.clear();
            self.ended.clear();
        }
        found
    }
}

impl Changes<u32> {
    /// Takes in the pairs of a frame in which positions name the boxes: no box has changed its position.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`], as in [`update`](Self::update).
    pub fn update_positions(&mut self, pairs: &Pairs) -> Result<(), Error> {
        self.begun.clear();
        self.ended.clear();
        fill_keys(&mut self.keys, &mut self.sorter, pairs, Ok)?;
        fill(&mut self.next, &self.keys, |position| position)?;
        self.compare()
    }
}

impl<Id: Copy + Ord> Default for Changes<Id> {
    fn default() -> Self {
        Self::new()
    }
}

/// Fills `keys` with the pairs in terms of ranks, ascending, each once, those of a rank with itself left out.
fn fill_keys(
    keys: &mut Vec<u64>,
    sorter: &mut Sorter,
    pairs: &Pairs,
    rank: impl Fn(u32) -> Result<u32, Error>,
) -> Result<(), Error> {
    keys.clear();
    reserve(keys, pairs.len())?;
    for &(i, j) in pairs {
        let (a, b) = (rank(i)?, rank(j)?);
        if a != b {
            keys.push(u64::from(a.min(b)) << 32 | u64::from(a.max(b)));
        }
    }
    sorter.sort(&Alone, keys);
    keys.dedup();
    Ok(())
}

/// Fills `pairs` with what the keys stand for.
fn fill<Id: Copy>(pairs: &mut Vec<(Id, Id)>, keys: &[u64], id: impl Fn(u32) -> Id) -> Result<(), Error> {
    pairs.clear();
    reserve(pairs, keys.len())?;
    pairs.extend(keys.iter().map(|&key| (id((key >> 32) as u32), id(key as u32))));
    Ok(())
}

/// Adds what only `now` has to `begun` and what only `before` has to `ended`. Both ascend.
fn differences<T: Copy + Ord>(now: &[T], before: &[T], begun: &mut Vec<T>, ended: &mut Vec<T>) -> Result<(), Error> {
    let (mut now, mut before) = (now.iter().peekable(), before.iter().peekable());
    loop {
        match (now.peek(), before.peek()) {
            // Most last: they are asked for first.
            (Some(a), Some(b)) if a == b => {
                now.next();
                before.next();
            }
            (Some(&&a), b) if b.is_none_or(|&&b| a < b) => {
                reserve(begun, 1)?;
                begun.push(a);
                now.next();
            }
            (_, Some(&&b)) => {
                reserve(ended, 1)?;
                ended.push(b);
                before.next();
            }
            _ => return Ok(()),
        }
    }
}

fn reserve<T>(list: &mut Vec<T>, more: usize) -> Result<(), Error> {
    list.try_reserve(more).map_err(|_| Error::OutOfMemory { what: "changes of pairs", elements: list.len() + more })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pair::Pair;

    fn pairs(of: &[Pair]) -> Pairs {
        let mut pairs = Pairs::new();
        of.iter().for_each(|&(a, b)| pairs.push(a, b));
        pairs
    }

    #[test]
    fn pairs_are_followed_by_their_ids_wherever_these_stand() {
        let mut changes = Changes::new();
        changes.update(&pairs(&[(0, 3), (1, 2)]), &["d", "a", "c", "b"]).unwrap();
        assert_eq!(changes.begun(), [("a", "c"), ("b", "d")]);
        // "a" went, and "b" took its position.
        changes.update(&pairs(&[(0, 1), (1, 2)]), &["d", "b", "c"]).unwrap();
        assert_eq!(changes.begun(), [("b", "c")]);
        assert_eq!(changes.ended(), [("a", "c")]);
        assert_eq!(changes.lasting(), 1);
        assert_eq!(changes.pairs(), [("b", "c"), ("b", "d")]);
    }

    #[test]
    fn boxes_of_one_id_are_one() {
        let mut changes = Changes::new();
        changes.update(&pairs(&[(0, 1), (0, 2), (1, 3), (2, 3)]), &[7, 7, 4, 4]).unwrap();
        assert_eq!(changes.pairs(), [(4, 7)]);
        changes.update(&pairs(&[(1, 2)]), &[7, 7, 4, 4]).unwrap();
        assert_eq!((changes.begun(), changes.ended(), changes.lasting()), (&[][..], &[][..], 1));
    }

    #[test]
    fn a_missing_id_is_named_and_nothing_is_lost() {
        let mut changes = Changes::new();
        changes.update(&pairs(&[(0, 1)]), &[10, 20]).unwrap();
        let error = changes.update(&pairs(&[(0, 1), (1, 2)]), &[10, 20]).unwrap_err();
        assert_eq!(error, Error::MissingId { position: 2, ids: 2 });
        assert_eq!((changes.begun(), changes.ended(), changes.pairs()), (&[][..], &[][..], &[(10, 20)][..]));
        changes.update(&pairs(&[(1, 2)]), &[10, 20, 30]).unwrap();
        assert_eq!((changes.begun(), changes.ended()), (&[(20, 30)][..], &[(10, 20)][..]));
    }

    #[test]
    fn positions_may_stand_for_ids() {
        let mut changes = Changes::new();
        changes.update_positions(&pairs(&[(8, 3), (1, 2)])).unwrap();
        assert_eq!(changes.begun(), [(1, 2), (3, 8)]);
        changes.update_positions(&pairs(&[(1, 2)])).unwrap();
        assert_eq!((changes.begun(), changes.ended(), changes.lasting()), (&[][..], &[(3, 8)][..], 1));
    }
}
