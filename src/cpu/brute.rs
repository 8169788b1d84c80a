//! Every one of the n (n - 1) / 2 pairs tested on three axes, as in the paper.

use crate::aabb::Aabb;
use crate::broad_phase::{BroadPhase, check_count};
use crate::cpu::Threads;
use crate::cpu::columns::Columns;
use crate::cpu::kernel::brute_rows;
use crate::cpu::level::Simd;
use crate::cpu::moving_first::MovingFirst;
use crate::cpu::workers::{Outputs, Workers};
use crate::error::Error;
use crate::pairs::Pairs;

/// Pairs that are tested in the time that a box takes in a grid, in round numbers.
const PAIRS_PER_BOX: usize = 512;

/// The method; see the module.
#[derive(Debug)]
struct Brute {
    workers: Workers,
    order: MovingFirst,
    columns: Columns,
    outputs: Outputs,
    simd: Simd,
}

pub(super) fn create(threads: u32, pools: &Threads, simd: Simd) -> Result<Box<dyn BroadPhase>, Error> {
    let workers = Workers::new("brute", threads, pools)?;
    Ok(Box::new(Brute {
        workers,
        order: MovingFirst::default(),
        columns: Columns::default(),
        outputs: Outputs::default(),
        simd,
    }))
}

impl BroadPhase for Brute {
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        pairs.clear();
        check_count(boxes.len())?;
        self.columns.resize(boxes.len())?;
        let Self { workers, order, columns, outputs, simd } = self;
        let workers = &workers.fit(boxes.len().saturating_mul(boxes.len()) / (2 * PAIRS_PER_BOX));
        workers.check(boxes)?;
        let order = order.order(pairs.filter(), boxes.len())?;
        workers.fill(columns.as_mut(), |first, mut part| {
            for at in 0..part.len() {
                let id = order.map_or((first + at) as u32, |(ids, _)| ids[first + at]);
                part.set(at, &boxes[id as usize], 0, id);
            }
        });
        // A fixed box is compared with those before it alone, which may move.
        let moving = order.map_or(boxes.len(), |(_, moving)| moving);
        outputs.find(workers, pairs, |k, parts, list| {
            let row = |k: usize| row(moving, boxes.len(), k, parts);
            brute_rows(*simd, columns, row(k)..row(k + 1), list);
        });
        pairs.finish_on(workers)
    }

    fn prepare(&mut self, objects: usize) {
        // A refused allocation is reported by the frame that needs it.
        let _ = self.columns.resize(objects);
    }
}

/// The first row of part `k` when the first `rows` rows of the triangle of the pairs of `boxes` are cut into `parts` parts of equal area.
fn row(rows: usize, boxes: usize, k: usize, parts: usize) -> usize {
    let (rows_f, n) = (rows as f64, boxes as f64);
    let area = rows_f * (n - rows_f / 2.0) * k as f64 / parts as f64;
    if k == parts { rows } else { (n - (n * n - 2.0 * area).max(0.0).sqrt()) as usize }
}

#[cfg(test)]
mod tests {
    use super::row;

    #[test]
    fn parts_of_the_triangle_cover_all_rows_with_equal_areas() {
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
