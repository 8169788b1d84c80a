//! Sorts on the axis on which the fewest pairs overlap, then sweeps along it. From scratch every frame.
//!
//! The paper sweeps along the axis of greatest variance, which a few boxes far away decide.

use crate::cpu::{Columns, Made, Outputs, Simd, Threads, Workers, ensure, order_key, part, sort, sweep_rows};
use crate::{Aabb, BroadPhase, Error, FramePlan, Pairs, check_count};

/// The method; see the module.
#[derive(Debug)]
struct Sap {
    workers: Workers,
    /// Lower bound on the sweep axis in the upper half, position in the input in the lower.
    keys: Vec<u64>,
    scratch: Vec<u64>,
    columns: Columns,
    outputs: Outputs,
    simd: Simd,
}

pub(super) fn create(threads: u32, pools: &Threads, simd: Simd) -> Made {
    let workers = Workers::new("sap", threads, pools);
    let (columns, outputs) = (Columns::default(), Outputs::default());
    Ok(Box::new(Sap { workers, keys: Vec::new(), scratch: Vec::new(), columns, outputs, simd }))
}

impl Sap {
    fn resize(&mut self, objects: usize) -> Result<(), Error> {
        ensure(&mut self.keys, objects, "sort keys")?;
        self.columns.resize(objects)
    }
}

impl BroadPhase for Sap {
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        self.find_pairs_with(&FramePlan::default(), boxes, pairs)
    }

    fn find_pairs_with(&mut self, plan: &FramePlan, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        pairs.clear();
        check_count(boxes.len())?;
        self.resize(boxes.len())?;
        let axis = plan.stats(boxes).sweep_axis();
        let Self { workers, keys, scratch, columns, outputs, simd } = self;
        let workers = &workers.fit(boxes.len());
        let _frame = workers.frame()?;
        workers.check(boxes)?;
        let keys = &mut keys[..boxes.len()];
        workers.map(boxes, keys, |id, b| u64::from(order_key(b.min[axis])) << 32 | id as u64);
        sort(workers, keys, scratch)?;
        workers.fill(columns, |first, mut rows| {
            for at in 0..rows.len() {
                let id = keys[first + at] as u32;
                rows.set(at, &boxes[id as usize], axis, id);
            }
        });
        outputs.find(workers, pairs, |k, parts, list| {
            sweep_rows::<false>(*simd, columns, part(boxes.len(), k, parts), list);
        });
        pairs.finish_on(workers)
    }

    fn prepare(&mut self, objects: usize) {
        // The frame that needs the memory reports a refused allocation.
        let _ = self.resize(objects);
    }
}
