//! The pairs that began and ended between two frames.

use crate::cpu::{self, Workers};
use crate::pairs::Sorter;
use crate::{Error, Pairs};

/// Follows pairs from frame to frame by the caller's ids: the pairs that began, those that ended, and all of them.
///
/// Every list is sorted, and each pair has its lower id first. So the lists are the same, bit for bit, whatever
/// algorithm found the pairs and in whatever order, also with [`PairOrder::Any`](crate::PairOrder::Any).
///
/// Positions may change from frame to frame, as with `swap_remove`: a pair lasts while both ids do. Boxes with the
/// same id count as one: a pair of two of them is left out, and two ids are one pair however many of their boxes
/// overlap.
///
/// An update sorts the pairs as 64-bit numbers and compares them with those of the previous update. On one core of an
/// AMD EPYC this takes 10 to 20 ns a pair with 1000 to 100 000 pairs, or a third of that if the pairs have canonical
/// order and ids ascend with positions. When ids have changed, the update sorts them too. Memory for each pair: 12
/// bytes and two pairs of ids, and another pair if it began or ended. Memory for each box: 8 bytes and two ids.
///
/// ```
/// use sapwise::{Changes, Pairs};
///
/// let mut pairs = Pairs::new();
/// pairs.push(0, 1);
/// pairs.finish()?;
/// let mut changes = Changes::new();
/// changes.update(&pairs, &["wall", "player"])?;
/// assert_eq!(changes.begun(), [("player", "wall")]);
/// # Ok::<(), sapwise::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Changes<Id = u32> {
    /// The ids of the last update.
    ids: Vec<Id>,
    /// The ids of the last update, ascending, each with its position.
    sorted: Vec<(Id, u32)>,
    /// For each position, the first place of its id in `sorted`.
    ranks: Vec<u32>,
    /// The new pairs: the rank of the lower id in the upper half, that of the other in the lower. Numbers sort faster
    /// than pairs of ids.
    keys: Vec<u64>,
    sorter: Sorter,
    pairs: Vec<(Id, Id)>,
    /// Memory for the pairs of the next update.
    next: Vec<(Id, Id)>,
    begun: Vec<(Id, Id)>,
    ended: Vec<(Id, Id)>,
}

impl<Id: Copy + Ord> Changes<Id> {
    /// Makes a list without pairs: all pairs of the first update begin.
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

    /// Updates to the pairs of a frame, in which the box at position `k` has the id `ids[k]`.
    ///
    /// # Errors
    /// [`Error::MissingId`] names a position in `pairs` that has no id. [`Error::OutOfMemory`]. After an error nothing
    /// has begun or ended, and the next update compares with the last one that succeeded.
    pub fn update(&mut self, pairs: &Pairs, ids: &[Id]) -> Result<(), Error> {
        self.begun.clear();
        self.ended.clear();
        // No pair has a member beyond 32 bits.
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

    /// Returns the pairs of the last update that the previous one did not have.
    pub fn begun(&self) -> &[(Id, Id)] {
        &self.begun
    }

    /// Returns the pairs of the previous update that the last one does not have.
    pub fn ended(&self) -> &[(Id, Id)] {
        &self.ended
    }

    /// Returns the number of pairs that the last two updates share.
    pub fn lasting(&self) -> usize {
        self.pairs.len() - self.begun.len()
    }

    /// Returns all pairs of the last update.
    pub fn pairs(&self) -> &[(Id, Id)] {
        &self.pairs
    }

    /// Finds the rank of each id.
    fn rank(&mut self, ids: &[Id]) -> Result<(), Error> {
        let Self { ids: known, sorted, ranks, .. } = self;
        // Emptied first: after a refused allocation no id is known.
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

    /// Compares the next pairs with the present ones, then replaces them.
    fn compare(&mut self) -> Result<(), Error> {
        differences(&self.next, &self.pairs, |pair| pair, &mut self.begun, &mut self.ended)?;
        std::mem::swap(&mut self.pairs, &mut self.next);
        Ok(())
    }
}

impl Changes<u32> {
    /// Updates to the pairs of a frame in which positions are ids: no box has changed its position.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`], as for [`update`](Self::update).
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

/// Fills `keys` with the pairs of ranks, ascending, each once, without pairs of a rank with itself.
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
    sorter.sort(&Workers::one(), keys);
    keys.dedup();
    Ok(())
}

/// Fills `pairs` with the pairs of ids of the keys.
fn fill<Id: Copy>(pairs: &mut Vec<(Id, Id)>, keys: &[u64], id: impl Fn(u32) -> Id) -> Result<(), Error> {
    pairs.clear();
    reserve(pairs, keys.len())?;
    pairs.extend(keys.iter().map(|&key| (id((key >> 32) as u32), id(key as u32))));
    Ok(())
}

/// Adds what `name` returns for the elements that only `now` has to `begun`, and for those that only `before` has to
/// `ended`. Both lists ascend. Clears `begun` and `ended` after an error.
pub(crate) fn differences<T: Copy + Ord, N>(
    now: &[T],
    before: &[T],
    name: impl Fn(T) -> N,
    begun: &mut Vec<N>,
    ended: &mut Vec<N>,
) -> Result<(), Error> {
    let (mut now, mut before) = (now.iter().peekable(), before.iter().peekable());
    let mut compare = || loop {
        match (now.peek(), before.peek()) {
            // First, because most pairs last.
            (Some(a), Some(b)) if a == b => {
                now.next();
                before.next();
            }
            (Some(&&a), b) if b.is_none_or(|&&b| a < b) => {
                reserve(begun, 1)?;
                begun.push(name(a));
                now.next();
            }
            (_, Some(&&b)) => {
                reserve(ended, 1)?;
                ended.push(name(b));
                before.next();
            }
            _ => return Ok(()),
        }
    };
    compare().inspect_err(|_| {
        begun.clear();
        ended.clear();
    })
}

fn reserve<T>(list: &mut Vec<T>, more: usize) -> Result<(), Error> {
    cpu::reserve(list, more, "changes of pairs")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Pair;

    fn pairs(of: &[Pair]) -> Pairs {
        let mut pairs = Pairs::new();
        of.iter().for_each(|&(a, b)| pairs.push(a, b));
        pairs
    }

    #[test]
    fn positions_may_be_ids() {
        let mut changes = Changes::new();
        changes.update_positions(&pairs(&[(8, 3), (1, 2)])).unwrap();
        assert_eq!(changes.begun(), [(1, 2), (3, 8)]);
        changes.update_positions(&pairs(&[(1, 2)])).unwrap();
        assert_eq!((changes.begun(), changes.ended(), changes.lasting()), (&[][..], &[(3, 8)][..], 1));
    }
}
