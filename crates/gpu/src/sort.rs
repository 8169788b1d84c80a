//! Radix sort of 32-bit keys with their positions; see `shaders/sort.wgsl`.

use super::device::Gpu;
use super::kernel::{Bound, Kernel, source};
use super::storage::{Storage, constant};
use sapwise::error::GpuError;

/// Passes of eight bits each, and values of a digit.
const PASSES: u32 = 4;
const DIGITS: u32 = 256;
/// Keys of one workgroup of `scatter`, and counts of one of `add_counts`.
const BLOCK: u32 = 2048;
const COUNTS: u32 = 4096;

/// The kernels and buffers of the sort.
#[derive(Debug)]
pub(super) struct Sort {
    add_counts: Kernel,
    scatter: Kernel,
    /// Each pass reads one of the two and writes the other.
    keys: [Storage; 2],
    values: [Storage; 2],
    /// For each pass the counts of each digit and block.
    counts: Storage,
    starts: Storage,
    /// The number of each pass, and whether it is the last.
    tasks: Vec<wgpu::Buffer>,
    passes: Vec<[Bound; 2]>,
}

impl Sort {
    pub(super) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let task = |pass| constant(gpu, "a sort pass", [pass, u32::from(pass + 1 == PASSES), 0, 0]);
        Ok(Self {
            add_counts: Kernel::new(gpu, source::SORT, "add_counts")?,
            scatter: Kernel::new(gpu, source::SORT, "scatter")?,
            keys: [Storage::new(gpu, "sort keys")?, Storage::new(gpu, "sort keys")?],
            values: [Storage::new(gpu, "sorted positions")?, Storage::new(gpu, "sorted positions")?],
            counts: Storage::new(gpu, "digits of blocks")?,
            starts: Storage::new(gpu, "where digits begin")?,
            tasks: (0..PASSES).map(task).collect::<Result<_, _>>()?,
            passes: Vec::new(),
        })
    }

    /// Makes room for `objects` keys. Returns whether a buffer was replaced.
    pub(super) fn ensure(&mut self, gpu: &Gpu, objects: u32) -> Result<bool, GpuError> {
        let mut grown = false;
        for list in self.keys.iter_mut().chain(&mut self.values) {
            grown |= list.ensure(gpu, u64::from(objects) * 4)?;
        }
        grown |= self.starts.ensure(gpu, u64::from(counts(objects)) * 4)?;
        Ok(self.counts.ensure(gpu, bytes_of_counts(objects))? | grown)
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

    /// Returns the buffers of the keys and of the counts of their first digits, which the caller fills.
    pub(super) fn unsorted(&self) -> [&wgpu::Buffer; 2] {
        [self.keys[0].buffer(), self.counts.buffer()]
    }

    /// Returns the buffer that has the old position of each sorted key.
    pub(super) fn order(&self) -> &wgpu::Buffer {
        // The number of passes is even.
        self.values[0].buffer()
    }

    /// Clears the counts, before the keys are written.
    pub(super) fn clear(&self, encoder: &mut wgpu::CommandEncoder, objects: u32) {
        encoder.clear_buffer(self.counts.buffer(), 0, Some(bytes_of_counts(objects)));
    }

    pub(super) fn record(&self, pass: &mut wgpu::ComputePass<'_>, objects: u32) {
        for [add_counts, scatter] in &self.passes {
            add_counts.dispatch(pass, counts(objects).div_ceil(COUNTS));
            scatter.dispatch(pass, objects.div_ceil(BLOCK));
        }
    }
}

/// Returns the counts of one pass.
fn counts(objects: u32) -> u32 {
    objects.div_ceil(BLOCK) * DIGITS
}

fn bytes_of_counts(objects: u32) -> u64 {
    u64::from(counts(objects) * PASSES) * 4
}
