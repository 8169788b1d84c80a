//! The methods that sort first: sap and grid-sap; see `shaders/rows.wgsl`, `sap.wgsl` and `grid_sap.wgsl`.

use super::device::Gpu;
use super::inputs::Inputs;
use super::kernel::{Bound, Kernel, source};
use super::output::Output;
use super::params::Params;
use super::sort::Sort;
use super::storage::Storage;
use crate::error::GpuError;

/// Rows of one block, and boxes of one workgroup of the other kernels.
const ROWS: u32 = 64;
const BOXES: u32 = 256;
/// Candidates that a row is tested with in one submission; see `shaders/rows.wgsl`.
pub(super) const CANDIDATES: u32 = 32_768;
/// Bytes of a sorted box.
pub(super) const SORTED_BOX: u64 = 32;
/// Pairs of a row that are kept from the counting to the writing.
const KEPT: u64 = 4;

/// A method that sorts, on one GPU.
#[derive(Debug)]
pub(super) struct Sorted {
    strips: bool,
    sort: Sort,
    make_keys: Kernel,
    gather: Kernel,
    /// grid-sap only.
    build_table: Option<Kernel>,
    count: Kernel,
    write: Kernel,
    boxes: Storage,
    counts: Storage,
    kept: Storage,
    /// grid-sap only: how far each box reaches, and where slots begin.
    reach: Storage,
    table: Storage,
    bound: Option<Bindings>,
}

#[derive(Debug)]
struct Bindings {
    make_keys: Bound,
    /// By the side on which the sort ends.
    sides: [Side; 2],
}

#[derive(Debug)]
struct Side {
    gather: Bound,
    build_table: Option<Bound>,
    count: Bound,
    write: Bound,
}

impl Sorted {
    /// The pairs of a block of rows are counted in 32 bits.
    pub(super) const MOST_OBJECTS: usize = 1 << 26;

    pub(super) fn new(gpu: &Gpu, strips: bool) -> Result<Self, GpuError> {
        let (rows, keys, gather) = if strips {
            (source::GRID_SAP, "strip_keys", "strip_gather")
        } else {
            (source::SAP, "sweep_keys", "sweep_gather")
        };
        Ok(Self {
            strips,
            sort: Sort::new(gpu)?,
            make_keys: Kernel::new(gpu, source::KEYS, keys)?,
            gather: Kernel::new(gpu, source::KEYS, gather)?,
            build_table: strips.then(|| Kernel::new(gpu, source::TABLE, "build")).transpose()?,
            count: Kernel::new(gpu, rows, "count")?,
            write: Kernel::new(gpu, rows, "write")?,
            boxes: Storage::new(gpu, "sorted boxes")?,
            counts: Storage::new(gpu, "counts of rows")?,
            kept: Storage::new(gpu, "kept pairs")?,
            reach: Storage::new(gpu, "reaches of boxes")?,
            table: Storage::new(gpu, "slots")?,
            bound: None,
        })
    }

    pub(super) fn is_grid_sap(&self) -> bool {
        self.strips
    }

    pub(super) fn blocks(objects: u32) -> u32 {
        objects.div_ceil(ROWS)
    }

    /// Makes room for that many boxes. Whether a buffer is another one now.
    pub(super) fn ensure(&mut self, gpu: &Gpu, params: &Params) -> Result<bool, GpuError> {
        let n = u64::from(params.objects);
        let mut grown = self.sort.ensure(gpu, params.objects)?;
        grown |= self.boxes.ensure(gpu, n * SORTED_BOX)?;
        grown |= self.counts.ensure(gpu, n * 4)?;
        grown |= self.kept.ensure(gpu, n * KEPT * 4)?;
        if self.strips {
            grown |= self.reach.ensure(gpu, n * 4)?;
            // There are about as many slots as boxes. How many exactly changes with the scene, and must not cost a buffer each time.
            grown |= self.table.ensure(gpu, (u64::from(params.large_key).max(n + n / 8) + 1) * 4)?;
        }
        Ok(grown)
    }

    pub(super) fn bind(&mut self, gpu: &Gpu, inputs: &Inputs<'_>, output: &Output) -> Result<(), GpuError> {
        let Inputs { params, boxes, ids, header } = *inputs;
        self.sort.bind(gpu, params)?;
        let mut make_keys = vec![(0, params), (1, boxes), (3, header), (4, self.sort.unsorted()), (2, ids)];
        if self.strips {
            make_keys.push((7, self.reach.buffer()));
        }
        let side = |side: usize| -> Result<Side, GpuError> {
            let (keys, order) = self.sort.sorted(side);
            let mut gather = vec![(0, params), (1, boxes), (2, ids), (5, order), (6, self.boxes.buffer())];
            let mut rows = vec![
                (0, params),
                (2, self.boxes.buffer()),
                (4, output.sums()),
                (5, output.pairs()),
                (6, self.counts.buffer()),
                (7, self.kept.buffer()),
            ];
            if self.strips {
                gather.push((7, self.reach.buffer()));
                rows.extend([(1, keys), (8, self.table.buffer())]);
            }
            let table = |kernel: &Kernel| kernel.bind(gpu, &[(0, params), (1, keys), (2, self.table.buffer())]);
            Ok(Side {
                gather: self.gather.bind(gpu, &gather)?,
                build_table: self.build_table.as_ref().map(table).transpose()?,
                write: self.write.bind(gpu, &rows)?,
                count: self.count.bind(gpu, &[rows.as_slice(), &[(3, header)]].concat())?,
            })
        };
        let sides = [side(0)?, side(1)?];
        self.bound = Some(Bindings { make_keys: self.make_keys.bind(gpu, &make_keys)?, sides });
        Ok(())
    }

    fn key_bits(&self, params: &Params) -> u32 {
        if self.strips { params.key_bits() } else { u32::BITS }
    }

    /// Sorts and gathers.
    pub(super) fn record_sort(&self, pass: &mut wgpu::ComputePass<'_>, params: &Params) {
        let Some(bound) = &self.bound else { return };
        let (objects, bits) = (params.objects, self.key_bits(params));
        let side = &bound.sides[Sort::side(bits)];
        bound.make_keys.dispatch(pass, objects.div_ceil(BOXES));
        self.sort.record(pass, objects, bits);
        side.gather.dispatch(pass, objects.div_ceil(BOXES));
        if let Some(build) = &side.build_table {
            build.dispatch(pass, (params.large_key + 1).div_ceil(BOXES));
        }
    }

    pub(super) fn record_count(&self, pass: &mut wgpu::ComputePass<'_>, params: &Params) {
        let Some(bound) = &self.bound else { return };
        bound.sides[Sort::side(self.key_bits(params))].count.dispatch(pass, Self::blocks(params.objects));
    }

    pub(super) fn record_write(&self, pass: &mut wgpu::ComputePass<'_>, params: &Params) {
        let Some(bound) = &self.bound else { return };
        bound.sides[Sort::side(self.key_bits(params))].write.dispatch(pass, Self::blocks(params.objects));
    }
}
