//! The pairs between two lists of boxes.

use crate::cpu::{Columns, Group, Input, LANES, Members, Outputs, Simd, Tree, Workers, brute_rows, part};
use crate::{Aabb, Error, Pairs, Registry, SceneStats, check_count};

/// Most boxes of the shorter list without a tree: they are compared with each box of the longer list that overlaps
/// their bounds. With more, it pays to sort.
const FEW: usize = 256;

/// Boxes that are compared with one box in the time that `grid-sap` takes for a box, in round numbers.
const COMPARED: usize = 16;

/// Boxes of the longer list that are turned into columns at a time: they stay in the first-level cache.
const COLUMNS: usize = 512;

/// Finds the overlapping pairs between two lists, such as tools and parts. Boxes of one list never pair with each
/// other.
///
/// ```
/// use sapwise::{Aabb, Between, Pairs, Registry};
///
/// let tools = [Aabb::cube([0.0; 3], 1.0)];
/// let parts = [9.0, 1.5].map(|x| Aabb::cube([x, 0.0, 0.0], 1.0));
///
/// let mut between = Between::new(&Registry::new());
/// let mut pairs = Pairs::new();
/// between.find_pairs(&tools, &parts, &mut pairs)?;
/// // Positions run through the first list, then continue through the second.
/// assert_eq!(pairs.as_slice(), [(0, 2)]);
/// # Ok::<(), sapwise::Error>(())
/// ```
#[derive(Debug)]
pub struct Between {
    workers: Workers,
    simd: Simd,
    /// One for each task.
    columns: Vec<Columns>,
    tree: Tree,
    outputs: Outputs,
}

impl Between {
    /// Makes a search on as many threads as algorithms of this registry may have. One with
    /// [`Registry::with_cores(1)`](Registry::with_cores) runs on the calling thread alone.
    pub fn new(registry: &Registry) -> Self {
        let simd = Simd::at_most(registry.simd());
        Self {
            workers: registry.most_workers("between"),
            simd,
            columns: Vec::new(),
            tree: Tree::new(simd),
            outputs: Outputs::default(),
        }
    }

    /// Replaces the content of `pairs` with the overlapping pairs of a box of `a` and a box of `b`.
    ///
    /// Positions in pairs, in the filter of `pairs` and in errors run through `a`, then continue through `b`: `b[0]`
    /// has position `a.len()`.
    ///
    /// # Errors
    /// Those of [`BroadPhase::find_pairs`](crate::BroadPhase::find_pairs).
    pub fn find_pairs(&mut self, a: &[Aabb], b: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        pairs.clear();
        check_count(a.len() + b.len())?;
        let second = a.len() as u32;
        let ((few, of_few), (many, of_many)) =
            if a.len() <= b.len() { ((a, 0), (b, second)) } else { ((b, second), (a, 0)) };
        let compares = few.len() <= FEW;
        let work = if compares { few.len().saturating_mul(many.len()) / COMPARED } else { a.len() + b.len() };
        let Self { workers, simd, columns, tree, outputs } = self;
        let workers = &workers.fit(work);
        let _frame = workers.frame()?;
        let of_b = |error| match error {
            Error::InvalidBox { index, defect } => Error::InvalidBox { index: a.len() + index, defect },
            other => other,
        };
        if compares {
            workers.check(a)?;
            workers.check(b).map_err(of_b)?;
            columns.resize_with(columns.len().max(workers.tasks()), Columns::default);
            outputs.collect(workers, pairs, |lists| {
                let parts = lists.len();
                workers.try_each_of(lists.iter_mut().zip(columns).enumerate(), |(k, (list, columns))| {
                    let ids = part(many.len(), k, parts);
                    let many = (&many[ids.clone()], of_many + ids.start as u32);
                    compare(*simd, (few, of_few), many, columns, list)
                })
            })?;
        } else {
            let input = Input { workers, boxes: a, screen: pairs.screen() };
            tree.build(input, Members::From(0), &SceneStats::of(a))?;
            tree.sort_others(workers, b).map_err(of_b)?;
            let sorted = tree.others();
            outputs.find(workers, pairs, |k, parts, list| {
                for keys in sorted[part(sorted.len(), k, parts)].chunks(LANES) {
                    let group = Group::of(keys.iter().map(|&key| (b[key as u32 as usize], second + key as u32)));
                    group.into_iter().for_each(|group| tree.pairs_with(&group, list));
                }
            });
        }
        pairs.finish_on(workers)
    }
}

/// Compares each of a few boxes with each of many that overlaps the bounds of the few. Each list comes with the
/// position of its first box.
fn compare(
    simd: Simd,
    (few, of_few): (&[Aabb], u32),
    (many, of_many): (&[Aabb], u32),
    columns: &mut Columns,
    pairs: &mut Pairs,
) -> Result<(), Error> {
    let Some(around) = few.iter().copied().reduce(|around, b| around.union(&b)) else { return Ok(()) };
    columns.resize(few.len() + COLUMNS)?;
    let mut rows = columns.as_mut();
    few.iter().zip(of_few..).enumerate().for_each(|(at, (b, id))| rows.set(at, b, 0, id));
    for (many, of_many) in many.chunks(COLUMNS).zip((of_many..).step_by(COLUMNS)) {
        columns.resize(few.len() + many.len())?;
        let mut rows = columns.as_mut();
        let mut len = few.len();
        for (b, id) in many.iter().zip(of_many..).filter(|(b, _)| b.overlaps(&around)) {
            rows.set(len, b, 0, id);
            len += 1;
        }
        columns.resize(len)?;
        brute_rows(simd, columns, 0..few.len(), |_| few.len(), pairs);
    }
    Ok(())
}
