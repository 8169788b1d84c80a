//! Sort on the axis on which the fewest pairs overlap, then sweep along it. From scratch every frame, as in the paper, which takes the axis of
//! greatest variance: a few boxes far away decide that one.

use crate::aabb::Aabb;
use crate::broad_phase::{BroadPhase, check_count};
use crate::cpu::Threads;
use crate::cpu::columns::{Columns, PADDING, ensure, order_key, part};
use crate::cpu::kernel::{All, Ties, sweep_across, sweep_rows};
use crate::cpu::level::Simd;
use crate::cpu::moving_first::MovingFirst;
use crate::cpu::sort::sort;
use crate::cpu::workers::{Outputs, Workers};
use crate::error::Error;
use crate::load::FramePlan;
use crate::pairs::Pairs;

/// The method; see the module.
#[derive(Debug)]
struct Sap {
    workers: Workers,
    order: MovingFirst,
    /// Lower bound on the sweep axis in the upper half, position in the input in the lower.
    keys: Vec<u64>,
    scratch: Vec<u64>,
    columns: Columns,
    outputs: Outputs,
    simd: Simd,
}

pub(super) fn create(threads: u32, pools: &Threads, simd: Simd) -> Result<Box<dyn BroadPhase>, Error> {
    let workers = Workers::new("sap", threads, pools)?;
    Ok(Box::new(Sap {
        workers,
        order: MovingFirst::default(),
        keys: Vec::new(),
        scratch: Vec::new(),
        columns: Columns::default(),
        outputs: Outputs::default(),
        simd,
    }))
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
        let axis = plan.sample(boxes).sweep_axis();
        let Self { workers, order, keys, scratch, columns, outputs, simd } = self;
        let workers = &workers.fit(boxes.len());
        workers.check(boxes)?;
        let keys = &mut keys[..boxes.len()];
        let key = |id: usize, b: &Aabb| u64::from(order_key(b.min[axis])) << 32 | id as u64;
        let moving = match order.order(pairs.filter(), boxes.len())? {
            None => {
                workers.map(boxes, keys, key);
                boxes.len()
            }
            Some((ids, moving)) => {
                workers.map(ids, keys, |_, &id| key(id as usize, &boxes[id as usize]));
                moving
            }
        };
        let (moving_keys, fixed_keys) = keys.split_at_mut(moving);
        sort(workers, moving_keys, scratch)?;
        sort(workers, fixed_keys, scratch)?;
        // A sweep along the boxes that may move ends in the gap before the fixed ones.
        let gap = if fixed_keys.is_empty() { 0 } else { PADDING };
        let fixed = moving + gap..boxes.len() + gap;
        columns.resize(fixed.end)?;
        workers.fill(columns.as_mut(), |first, mut rows| {
            for at in 0..rows.len() {
                let row = first + at;
                if (moving..fixed.start).contains(&row) {
                    rows.low[0][at] = f32::NAN;
                } else {
                    let id = keys[if row < moving { row } else { row - gap }] as u32;
                    rows.set(at, &boxes[id as usize], axis, id);
                }
            }
        });
        outputs.find(workers, pairs, |k, parts, list| {
            let rows = part(moving, k, parts);
            sweep_rows::<All>(*simd, columns, rows.clone(), list);
            sweep_across(*simd, columns, rows, fixed.clone(), Ties::Count, list);
            let rows = part(fixed.len(), k, parts);
            sweep_across(*simd, columns, fixed.start + rows.start..fixed.start + rows.end, 0..moving, Ties::Skip, list);
        });
        pairs.finish_on(workers)
    }

    fn prepare(&mut self, objects: usize) {
        // A refused allocation is reported by the frame that needs it.
        let _ = self.resize(objects);
    }
}
