//! Tests each of the n (n - 1) / 2 pairs on three axes, as in the paper.

use crate::cpu::{Columns, Made, Outputs, Simd, Threads, Workers, brute_rows, ensure};
use crate::{Aabb, BroadPhase, Error, Pairs, Screen, check_count};

/// Pairs that are tested in the time that `grid-sap` takes for a box, in round numbers.
const PAIRS_PER_BOX: usize = 512;

/// What an error calls the memory of [`Brute::order`].
const POSITIONS: &str = "positions of boxes";

/// The method; see the module.
#[derive(Debug)]
struct Brute {
    workers: Workers,
    /// Positions in the input: active boxes, then passive ones.
    order: Vec<u32>,
    columns: Columns,
    outputs: Outputs,
    simd: Simd,
}

pub(super) fn create(threads: u32, pools: &Threads, simd: Simd) -> Made {
    let workers = Workers::new("brute", threads, pools);
    let (columns, outputs) = (Columns::default(), Outputs::default());
    Ok(Box::new(Brute { workers, order: Vec::new(), columns, outputs, simd }))
}

impl BroadPhase for Brute {
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        pairs.clear();
        check_count(boxes.len())?;
        self.columns.resize(boxes.len())?;
        let Self { workers, order, columns, outputs, simd } = self;
        let workers = &workers.fit(boxes.len().saturating_mul(boxes.len()) / (2 * PAIRS_PER_BOX));
        let _frame = workers.frame()?;
        workers.check(boxes)?;
        let active = active_first(order, pairs.screen(), boxes.len())?;
        workers.fill(columns, |first, mut part| {
            for at in 0..part.len() {
                let id = if active.is_some() { order[first + at] } else { (first + at) as u32 };
                part.set(at, &boxes[id as usize], 0, id);
            }
        });
        // A passive box is compared only with the active ones before it.
        let active = active.unwrap_or(boxes.len());
        outputs.find(workers, pairs, |k, parts, list| {
            let row = |k: usize| row(active, boxes.len(), k, parts);
            brute_rows(*simd, columns, row(k)..row(k + 1), |row| row + 1, list);
        });
        pairs.finish_on(workers)
    }

    fn prepare(&mut self, objects: usize) {
        // The frame that needs the memory reports a refused allocation.
        let _ = self.columns.resize(objects).and_then(|()| ensure(&mut self.order, objects, POSITIONS));
    }
}

/// Writes the positions of `count` boxes to `order`: first the active ones, then the [passive](Screen) ones. Returns
/// the number of active ones, or `None`, and leaves `order` alone, if all are.
fn active_first(order: &mut Vec<u32>, screen: Option<&Screen>, count: usize) -> Result<Option<usize>, Error> {
    let is_passive = |id: usize| screen.is_some_and(|s| s.is_passive(id));
    let passive = screen.map_or(0, |_| (0..count).filter(|&id| is_passive(id)).count());
    if passive == 0 {
        return Ok(None);
    }
    ensure(order, count, POSITIONS)?;
    let mut next = [0, count - passive];
    for id in 0..count {
        let next = &mut next[usize::from(is_passive(id))];
        order[*next] = id as u32;
        *next += 1;
    }
    Ok(Some(count - passive))
}

/// Returns the first row of part `k` when the first `rows` rows of the triangle of the pairs of `boxes` are cut into
/// `parts` parts of equal area.
fn row(rows: usize, boxes: usize, k: usize, parts: usize) -> usize {
    let (rows_f, n) = (rows as f64, boxes as f64);
    let area = rows_f * (n - rows_f / 2.0) * k as f64 / parts as f64;
    if k == parts { rows } else { (n - (n * n - 2.0 * area).max(0.0).sqrt()) as usize }
}

/// Returns the overlapping pairs, by two plain loops: what tests compare methods with.
#[cfg(test)]
pub(super) fn double_loop(boxes: &[Aabb]) -> Pairs {
    let mut pairs = Pairs::new();
    for j in 0..boxes.len() as u32 {
        let meets = |i: &u32| boxes[*i as usize].overlaps(&boxes[j as usize]);
        (0..j).filter(meets).for_each(|i| pairs.push(i, j));
    }
    pairs
}

#[cfg(test)]
mod tests {
    use super::row;

    #[test]
    fn parts_of_the_triangle_have_equal_areas() {
        let (boxes, parts) = (10_000, 16);
        let area = |from: usize, to: usize| (from..to).map(|i| boxes - 1 - i).sum::<usize>();
        for rows in [boxes, 5000, 300] {
            assert_eq!((row(rows, boxes, 0, parts), row(rows, boxes, parts, parts)), (0, rows));
            for k in 0..parts {
                let share =
                    area(row(rows, boxes, k, parts), row(rows, boxes, k + 1, parts)) as f64 / area(0, rows) as f64;
                assert!((share * parts as f64 - 1.0).abs() < 0.06, "part {k} of {rows} rows has {share}");
            }
        }
        assert_eq!(row(0, 0, 0, 1), 0);
    }
}
