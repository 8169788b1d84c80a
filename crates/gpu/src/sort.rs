//! Radix sort of 32-bit keys with their positions; see `shaders/sort.wgsl`.

use super::kernel::source;
use super::params::MOST_PASSES;
use super::{Bound, Gpu, Kernel, Params, Storage, constant};
use sapwise::error::GpuError;

/// Values of a digit.
const DIGITS: u32 = 256;
/// Keys of one workgroup of `scatter`.
const BLOCK: u32 = 2048;
/// Workgroups of `add_counts`.
const ADDERS: u32 = 32;

/// The kernels and buffers of the sort.
#[derive(Debug)]
pub(super) struct Sort {
    add_counts: Kernel,
    scatter: Kernel,
    /// Each pass reads one of the two and writes the other. The caller fills the first one.
    pub(super) keys: [Storage; 2],
    /// Old position of each sorted key: in the first one after an even number of passes, in the second one after an odd
    /// number.
    pub(super) values: [Storage; 2],
    /// For each pass the counts of each digit and block. The caller fills those of the first pass.
    pub(super) counts: Storage,
    starts: Storage,
    /// The number of each pass.
    tasks: Vec<wgpu::Buffer>,
    passes: Vec<[Bound; 2]>,
}

impl Sort {
    pub(super) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let task = |pass| constant(gpu, "a sort pass", [pass, 0, 0, 0]);
        Ok(Self {
            add_counts: Kernel::new(gpu, source::SORT, "add_counts")?,
            scatter: Kernel::new(gpu, source::SORT, "scatter")?,
            keys: [Storage::new(gpu, "sort keys")?, Storage::new(gpu, "sort keys")?],
            values: [Storage::new(gpu, "sorted positions")?, Storage::new(gpu, "sorted positions")?],
            counts: Storage::new(gpu, "digits of blocks")?,
            starts: Storage::new(gpu, "where digits begin")?,
            tasks: (0..MOST_PASSES).map(task).collect::<Result<_, _>>()?,
            passes: Vec::new(),
        })
    }

    /// Makes room for `objects` keys. Returns whether a buffer was replaced.
    pub(super) fn ensure(&mut self, gpu: &Gpu, objects: u32) -> Result<bool, GpuError> {
        let mut grown = false;
        for list in self.keys.iter_mut().chain(&mut self.values) {
            grown |= list.ensure(gpu, u64::from(objects) * 4)?;
        }
        grown |= self.starts.ensure(gpu, u64::from(counts(objects) + ADDERS) * 4)?;
        Ok(self.counts.ensure(gpu, bytes_of_counts(objects, MOST_PASSES))? | grown)
    }

    pub(super) fn bind(&mut self, gpu: &Gpu, params: &wgpu::Buffer) -> Result<(), GpuError> {
        self.passes.clear();
        let (counts, starts) = (self.counts.buffer(), self.starts.buffer());
        for (pass, task) in self.tasks.iter().enumerate() {
            let (from, to) = (pass % 2, (pass + 1) % 2);
            let common = [(0, params), (1, task), (6, counts), (7, starts)];
            let lists = [
                (2, self.keys[from].buffer()),
                (3, self.values[from].buffer()),
                (4, self.keys[to].buffer()),
                (5, self.values[to].buffer()),
            ];
            let scatter = self.scatter.bind(gpu, &[common, lists].concat())?;
            self.passes.push([self.add_counts.bind(gpu, &common)?, scatter]);
        }
        Ok(())
    }

    /// Clears the counts, before the keys are written.
    pub(super) fn clear(&self, encoder: &mut wgpu::CommandEncoder, params: &Params) {
        encoder.clear_buffer(self.counts.buffer(), 0, Some(bytes_of_counts(params.objects, params.passes)));
    }

    pub(super) fn record(&self, pass: &mut wgpu::ComputePass<'_>, params: &Params) {
        for [add_counts, scatter] in self.passes.iter().take(params.passes as usize) {
            if params.objects > BLOCK {
                add_counts.dispatch(pass, ADDERS);
            }
            scatter.dispatch(pass, params.objects.div_ceil(BLOCK));
        }
    }
}

/// Returns the counts of one pass.
fn counts(objects: u32) -> u32 {
    objects.div_ceil(BLOCK) * DIGITS
}

fn bytes_of_counts(objects: u32, passes: u32) -> u64 {
    u64::from(counts(objects) * passes) * 4
}
