//! Every one of the n (n - 1) / 2 pairs tested on three axes, as in the paper.

use crate::aabb::Aabb;
use crate::broad_phase::{BroadPhase, check_count};
use crate::cpu::Threads;
use crate::cpu::columns::Columns;
use crate::cpu::kernel::brute_rows;
use crate::cpu::level::Simd;
use crate::cpu::workers::{Outputs, Workers};
use crate::error::Error;
use crate::pairs::Pairs;

/// The method; see the module.
#[derive(Debug)]
struct Brute {
    workers: Workers,
    columns: Columns,
    outputs: Outputs,
    simd: Simd,
}

pub(super) fn create(threads: u32, pools: &Threads, simd: Simd) -> Result<Box<dyn BroadPhase>, Error> {
    let workers = Workers::new("brute", threads, pools)?;
    Ok(Box::new(Brute { workers, columns: Columns::default(), outputs: Outputs::default(), simd }))
}

impl BroadPhase for Brute {
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        pairs.clear();
        check_count(boxes.len())?;
        self.columns.resize(boxes.len())?;
        let Self { workers, columns, outputs, simd } = self;
        workers.check(boxes)?;
        workers.fill(columns.as_mut(), |first, mut part| {
            for at in 0..part.len() {
                part.set(at, &boxes[first + at], 0, (first + at) as u32);
            }
        });
        outputs.find(workers, pairs, |k, parts, list| {
            brute_rows(*simd, columns, row(columns.len(), k, parts)..row(columns.len(), k + 1, parts), list);
        });
        pairs.finish_on(workers)
    }

    fn prepare(&mut self, objects: usize) {
        // A refused allocation is reported by the frame that needs it.
        let _ = self.columns.resize(objects);
    }
}

/// The first row of part `k` when the triangle of pairs is cut into `parts` parts of equal area.
fn row(rows: usize, k: usize, parts: usize) -> usize {
    let left = 1.0 - k as f64 / parts as f64;
    if k == parts { rows } else { ((1.0 - left.sqrt()) * rows as f64) as usize }
}

#[cfg(test)]
mod tests {
    use super::row;

    #[test]
    fn parts_of_the_triangle_cover_all_rows_with_equal_areas() {
        let (rows, parts) = (10_000, 16);
        let area = |from: usize, to: usize| (from..to).map(|i| rows - 1 - i).sum::<usize>();
        assert_eq!((row(rows, 0, parts), row(rows, parts, parts)), (0, rows));
        for k in 0..parts {
            let share = area(row(rows, k, parts), row(rows, k + 1, parts)) as f64 / area(0, rows) as f64;
            assert!((share * parts as f64 - 1.0).abs() < 0.02, "part {k} has {share}");
        }
    }
}
