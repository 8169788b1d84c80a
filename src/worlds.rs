//! Many small worlds, searched in one call.

use crate::cpu::{Outputs, Simd, Workers, WorldSearch, part, reserve, split};
use crate::{Aabb, Error, Pair, Pairs, Registry, check_count};

/// Boxes that are searched in the time that `grid-sap` takes for one, in round numbers.
const BOXES_PER_BOX: usize = 4;

/// Finds the pairs of many small worlds in one call, such as the environments of a learning agent. Boxes of different
/// worlds are no pair.
///
/// ```
/// use sapwise::{Aabb, Pairs, Registry, Worlds};
///
/// let [near, far] = [0.0, 5.0].map(|x| Aabb::cube([x, 0.0, 0.0], 0.5));
/// let boxes = [near, near, far, far, near, near];
/// let starts = [0, 3, 3, 6]; // three worlds: boxes 0 to 2, none, and 3 to 5
///
/// let mut worlds = Worlds::new(&Registry::new());
/// let mut pairs = Pairs::new();
/// worlds.find_pairs(&boxes, &starts, &mut pairs)?;
/// assert_eq!(pairs.as_slice(), [(0, 1), (4, 5)]);
/// assert_eq!(worlds.pairs_of(2, &pairs), [(4, 5)]);
/// assert_eq!(worlds.offsets(), [0, 1, 1, 2]);
/// # Ok::<(), sapwise::Error>(())
/// ```
///
/// A world costs less than a call of an algorithm: the fewer its boxes, the less. Each world is searched by one thread:
/// search a large one with [`Adaptive`](crate::Adaptive).
#[derive(Debug)]
pub struct Worlds {
    workers: Workers,
    simd: Simd,
    /// One for each task.
    searches: Vec<WorldSearch>,
    outputs: Outputs,
    offsets: Vec<usize>,
}

impl Worlds {
    /// Makes a search on as many threads as algorithms of this registry may have. One with
    /// [`Registry::with_cores(1)`](Registry::with_cores) runs on the calling thread alone.
    pub fn new(registry: &Registry) -> Self {
        Self {
            workers: registry.most_workers("worlds"),
            simd: Simd::at_most(registry.simd()),
            searches: Vec::new(),
            outputs: Outputs::default(),
            offsets: Vec::new(),
        }
    }

    /// Replaces the content of `pairs` with the overlapping pairs of each world, world after world.
    ///
    /// World k has the boxes from `starts[k]` to before `starts[k + 1]`; the last start is the number of boxes. Pairs
    /// and the filter of `pairs` count positions in `boxes`.
    ///
    /// # Errors
    /// [`Error::InvalidStarts`], and those of [`BroadPhase::find_pairs`](crate::BroadPhase::find_pairs).
    pub fn find_pairs(&mut self, boxes: &[Aabb], starts: &[usize], pairs: &mut Pairs) -> Result<(), Error> {
        let Self { workers, simd, searches, outputs, offsets } = self;
        pairs.clear();
        offsets.clear();
        check_count(boxes.len())?;
        check_starts(starts, boxes.len())?;
        let workers = &workers.fit(boxes.len() / BOXES_PER_BOX);
        let _frame = workers.frame()?;
        workers.check(boxes)?;
        reserve(offsets, starts.len(), "offsets of worlds")?;
        offsets.resize(starts.len(), 0);
        searches.resize_with(searches.len().max(workers.tasks()), || WorldSearch::new(*simd));
        let found = outputs.collect(workers, pairs, |lists| find(workers, boxes, starts, searches, offsets, lists));
        let found = found.and_then(|()| pairs.finish_on(workers));
        if found.is_err() {
            offsets.clear();
        }
        found
    }

    /// Returns where the pairs of each world begin, then the number of pairs: one element for each of the starts of the
    /// last call. Empty if that failed.
    pub fn offsets(&self) -> &[usize] {
        &self.offsets
    }

    /// Returns the pairs of a world. `pairs` is the list of the last call.
    ///
    /// # Panics
    /// If that call failed or had no such world.
    pub fn pairs_of<'a>(&self, world: usize, pairs: &'a Pairs) -> &'a [Pair] {
        &pairs.as_slice()[self.offsets[world]..self.offsets[world + 1]]
    }
}

/// Returns an error for the first start that is not as [`Worlds::find_pairs`] wants it.
fn check_starts(starts: &[usize], boxes: usize) -> Result<(), Error> {
    let start = |index: usize| starts.get(index).copied().unwrap_or_default();
    let last = starts.len().saturating_sub(1);
    let is_wrong =
        |&k: &usize| start(k) < start(k.saturating_sub(1)) || k == 0 && start(k) != 0 || k == last && start(k) != boxes;
    (0..=last).find(is_wrong).map_or(Ok(()), |index| Err(Error::InvalidStarts { index, start: start(index), boxes }))
}

/// Runs one phase: fills each list with the pairs of a part of the worlds, all with about as many boxes, and writes the
/// offsets of the worlds.
fn find(
    workers: &Workers,
    boxes: &[Aabb],
    starts: &[usize],
    searches: &mut [WorldSearch],
    offsets: &mut [usize],
    lists: &mut [Pairs],
) -> Result<(), Error> {
    let Some((end, begins)) = offsets.split_last_mut() else { return Ok(()) };
    let (worlds, parts) = (begins.len(), lists.len());
    // The last part has the empty worlds at the end too.
    let before = |first: usize| starts.partition_point(|&start| start < first);
    let cut = |k: usize| if k == parts { worlds } else { before(part(boxes.len(), k, parts).start) };
    let parts_of_begins = split(begins, (0..parts).map(|k| cut(k + 1) - cut(k)));
    let tasks = lists.iter_mut().zip(searches).zip(parts_of_begins).enumerate();
    workers.try_each_of(tasks, |(k, ((list, search), begins))| {
        begins.iter_mut().zip(starts[cut(k)..].windows(2)).try_for_each(|(begin, world)| {
            *begin = list.len();
            search.find(boxes, world[0]..world[1], list)
        })
    })?;
    *end = 0;
    for (k, list) in lists.iter().enumerate() {
        begins[cut(k)..cut(k + 1)].iter_mut().for_each(|begin| *begin += *end);
        *end += list.len();
    }
    Ok(())
}
