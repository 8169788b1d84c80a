//! The methods that sort the boxes: sap, grid-sap and bvh. See `shaders/rows.wgsl` and the shader of each.

use super::cells::Cells;
use super::kernel::source;
use super::sort::Sort;
use super::tree::Tree;
use super::{Bound, Gpu, Inputs, Kernel, Look, Output, Pairing, Params, Search, Storage};
use sapwise::error::GpuError;

/// Rows of one block, and boxes of one workgroup of the other kernels.
const ROWS: u32 = 64;
const BOXES: u32 = 256;
/// Bytes of a sorted box.
const SORTED_BOX: u64 = 32;
/// Bytes of a sorted box and its share of the nodes of a tree: an eighth of a node a level.
pub(super) const MOST_OF_BOX: u64 = 40;
/// Words of a row: its number of pairs, and its states before and after a submission.
const ROW_WORDS: u64 = 3;
/// Words for the pairs that a row keeps from counting to writing.
const KEPT_WORDS: u64 = 8;

/// The method, which decides how boxes are sorted and how rows are searched.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Sap,
    GridSap,
    Bvh,
}

impl Kind {
    /// Returns the kind of a method.
    pub(super) fn named(method: &str) -> Option<Self> {
        match method {
            "sap" => Some(Self::Sap),
            "grid-sap" => Some(Self::GridSap),
            "bvh" => Some(Self::Bvh),
            _ => None,
        }
    }
}

/// A method that sorts, on one GPU. Its blocks are 64 rows, one for each box.
#[derive(Debug)]
pub(super) struct Sorted {
    kind: Kind,
    order: Order,
    make_keys: Kernel,
    gather: Kernel,
    tree: Option<Tree>,
    pairing: Pairing,
    /// The sorted boxes, then the levels of the tree.
    boxes: Storage,
    rows: Storage,
    kept: Storage,
    bound: Option<Bound>,
    /// `gather` bound to each buffer that may have the order.
    gathers: Vec<Bound>,
}

/// What sorts the boxes.
#[derive(Debug)]
enum Order {
    Radix(Sort),
    Cells(Cells),
}

impl Sorted {
    pub(super) fn new(gpu: &Gpu, kind: Kind) -> Result<Self, GpuError> {
        let radix = || Sort::new(gpu).map(Order::Radix);
        let tree = |of_large| Tree::new(gpu, of_large).map(Some);
        let (rows, keys, gather, order, tree) = match kind {
            Kind::Sap => (source::SAP, "sweep_keys", "gather", radix()?, None),
            Kind::GridSap => {
                (source::GRID_SAP, "cell_keys", "gather_cells", Order::Cells(Cells::new(gpu)?), tree(true)?)
            }
            Kind::Bvh => (source::BVH, "curve_keys", "gather", radix()?, tree(false)?),
        };
        Ok(Self {
            kind,
            order,
            make_keys: Kernel::new(gpu, source::KEYS, keys)?,
            gather: Kernel::new(gpu, source::GATHER, gather)?,
            tree,
            pairing: Pairing::new(gpu, rows)?,
            boxes: Storage::new(gpu, "sorted boxes")?,
            rows: Storage::new(gpu, "rows")?,
            kept: Storage::new(gpu, "kept pairs")?,
            bound: None,
            gathers: Vec::new(),
        })
    }
}

impl Search for Sorted {
    fn most_objects(&self) -> usize {
        // The pairs of a block are counted in 32 bits.
        1 << 26
    }

    fn growth(&self) -> f64 {
        if self.kind == Kind::Sap { 5.0 / 3.0 } else { 1.0 }
    }

    fn plan(&self, objects: u32, look: &dyn Fn() -> Look) -> Params {
        match self.kind {
            Kind::Sap => Params::sap(&look(), objects),
            Kind::GridSap => Params::grid_sap(&look(), objects),
            Kind::Bvh => Params::bvh(&look(), objects),
        }
    }

    fn blocks(&self, objects: u32) -> u64 {
        u64::from(objects.div_ceil(ROWS))
    }

    fn ensure(&mut self, gpu: &Gpu, params: &Params) -> Result<bool, GpuError> {
        let n = u64::from(params.objects);
        let mut grown = match &mut self.order {
            Order::Radix(sort) => sort.ensure(gpu, params.objects)?,
            Order::Cells(cells) => cells.ensure(gpu, params)?,
        };
        let elements = if self.tree.is_some() { Tree::elements(params.objects) } else { n };
        grown |= self.boxes.ensure(gpu, elements * SORTED_BOX)?;
        grown |= self.rows.ensure(gpu, n * ROW_WORDS * 4)?;
        Ok(self.kept.ensure(gpu, n * KEPT_WORDS * 4)? | grown)
    }

    fn bind(&mut self, gpu: &Gpu, inputs: &Inputs<'_>, output: &Output) -> Result<(), GpuError> {
        let Inputs { params, boxes, ids, header, .. } = *inputs;
        let sorted = self.boxes.buffer();
        let mut make_keys = vec![(0, params), (1, boxes), (2, ids), (3, header)];
        let mut gather = vec![(0, params), (1, boxes), (2, ids), (5, sorted)];
        let orders: Vec<&wgpu::Buffer>;
        let mut rows = vec![(2, sorted), (6, self.rows.buffer()), (7, self.kept.buffer())];
        let mut table = None;
        match &mut self.order {
            Order::Radix(sort) => {
                sort.bind(gpu, params)?;
                make_keys.extend([(4, sort.keys[0].buffer()), (5, sort.counts.buffer())]);
                orders = sort.values.iter().map(Storage::buffer).collect();
            }
            Order::Cells(cells) => {
                cells.bind(gpu, params)?;
                let [keys, counts, sorted_keys] = [&cells.keys, &cells.table, &cells.sorted_keys].map(Storage::buffer);
                make_keys.extend([(4, keys), (5, counts), (6, cells.ranks.buffer())]);
                orders = vec![cells.order.buffer()];
                gather.extend([(6, keys), (7, counts), (8, sorted_keys)]);
                rows.extend([(1, sorted_keys), (8, counts)]);
                table = Some(counts);
            }
        }
        if let Some(tree) = &mut self.tree {
            tree.bind(gpu, params, sorted, table)?;
        }
        self.pairing.bind(gpu, inputs, output, &rows)?;
        let gather_from = |order| self.gather.bind(gpu, &[gather.as_slice(), &[(4, order)]].concat());
        self.gathers = orders.into_iter().map(gather_from).collect::<Result<_, _>>()?;
        self.bound = Some(self.make_keys.bind(gpu, &make_keys)?);
        Ok(())
    }

    fn clear(&self, encoder: &mut wgpu::CommandEncoder, params: &Params) {
        match &self.order {
            Order::Radix(sort) => sort.clear(encoder, params),
            Order::Cells(cells) => cells.clear(encoder, params),
        }
    }

    fn record_sort(&self, pass: &mut wgpu::ComputePass<'_>, params: &Params) {
        let Some(make_keys) = &self.bound else { return };
        let groups = params.objects.div_ceil(BOXES);
        make_keys.dispatch(pass, groups);
        match &self.order {
            Order::Radix(sort) => sort.record(pass, params),
            Order::Cells(cells) => cells.record(pass, params),
        }
        // Each pass of the radix sort reads one buffer and writes the other.
        self.gathers[params.passes as usize % self.gathers.len()].dispatch(pass, groups);
        if let Some(tree) = &self.tree {
            tree.record(pass, params.objects);
        }
    }

    fn pairing(&self) -> &Pairing {
        &self.pairing
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Header, first_for_tests};
    use bytemuck::{bytes_of, cast_slice};
    use sapwise::Aabb;
    use sapwise::internals::SampledBoxes;

    /// The kernels search before the host hears of an invalid box, and index without checks.
    #[test]
    fn no_box_reaches_beyond_its_strip() {
        let Some(gpu) = first_for_tests() else { return };
        let place = |k: usize| [k % 12, k / 12 % 12, k / 144].map(|v| v as f32);
        let mut boxes: Vec<Aabb> = (0..1728).map(|k| Aabb::cube(place(k), 0.4)).collect();
        let (nan, minus_nan) = (f32::NAN, f32::from_bits(f32::NAN.to_bits() | 1 << 31));
        for (k, (min, max)) in [(11.0, 0.0), (nan, 0.0), (11.0, minus_nan), (nan, minus_nan)].into_iter().enumerate() {
            for axis in 0..3 {
                (boxes[100 * k + axis].min[axis], boxes[100 * k + axis].max[axis]) = (min, max);
            }
        }
        let sane: Vec<Aabb> = boxes[900..].to_vec();
        let params = Params::grid_sap(&Look::at(&SampledBoxes::from(&sane[..])), boxes.len() as u32);
        let mut sorted = Sorted::new(&gpu, Kind::GridSap).unwrap();
        let mut output = Output::new(&gpu).unwrap();
        output.ensure_blocks(&gpu, sorted.blocks(params.objects) as u32).unwrap();
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let buffer = |bytes: &[u8]| {
            let mut storage = Storage::with_usage(&gpu, "input", usage).unwrap();
            storage.ensure(&gpu, bytes.len() as u64).unwrap();
            gpu.queue().write_buffer(storage.buffer(), 0, bytes);
            storage
        };
        let ids = Storage::new(&gpu, "numbers of boxes").unwrap();
        let [of_params, of_boxes, header] =
            [bytes_of(&params), cast_slice(&boxes), bytes_of(&Header::START)].map(buffer);
        let inputs = Inputs {
            params: of_params.buffer(),
            boxes: of_boxes.buffer(),
            ids: ids.buffer(),
            header: header.buffer(),
            memberships: None,
        };
        sorted.ensure(&gpu, &params).unwrap();
        sorted.bind(&gpu, &inputs, &output).unwrap();
        let mut encoder = gpu.record();
        sorted.clear(&mut encoder, &params);
        sorted.record_sort(&mut encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default()), &params);
        gpu.submit(encoder).unwrap();
        let Order::Cells(cells) = &sorted.order else { panic!("grid-sap sorts by cells") };
        let keys = gpu.read_words(cells.keys.buffer(), 2 * u64::from(params.objects)).unwrap();
        for (k, key) in keys.chunks(2).enumerate() {
            let (cell, reach) = (key[0], key[1] & 0x3fff_ffff);
            let last = if cell < params.large_key { cell % params.slots + reach } else { reach };
            assert!(last < params.slots, "box {k} in cell {cell} of {} reaches {reach} further", params.slots);
        }
    }
}
