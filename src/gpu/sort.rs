//! Radix sort of 32-bit keys with their positions; see `shaders/sort.wgsl`.

use super::device::Gpu;
use super::kernel::{Bound, Kernel, source};
use super::storage::Storage;
use crate::error::GpuError;
use wgpu::util::DeviceExt;

/// Passes, of eight bits each, and values of a digit.
const PASSES: u32 = 4;
const DIGITS: u32 = 256;
/// Keys of one workgroup, and counts of one that adds them up.
const BLOCK: u32 = 2048;
const COUNTS: u32 = 4096;

/// The kernels and buffers of the sort.
#[derive(Debug)]
pub(super) struct Sort {
    add_counts: Kernel,
    scatter: Kernel,
    /// Passes read from one and write to the other, in turn.
    keys: [Storage; 2],
    values: [Storage; 2],
    /// For each pass the counts of each digit and block.
    counts: Storage,
    starts: Storage,
    /// What each pass is told.
    tasks: Vec<wgpu::Buffer>,
    passes: Vec<[Bound; 2]>,
}

impl Sort {
    pub(super) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        Ok(Self {
            add_counts: Kernel::new(gpu, source::SORT, "add_counts")?,
            scatter: Kernel::new(gpu, source::SORT, "scatter")?,
            keys: [Storage::new(gpu, "sort keys")?, Storage::new(gpu, "sort keys")?],
            values: [Storage::new(gpu, "sorted positions")?, Storage::new(gpu, "sorted positions")?],
            counts: Storage::new(gpu, "digits of blocks")?,
            starts: Storage::new(gpu, "where digits begin")?,
            tasks: (0..PASSES)
                .map(|pass| constant(gpu, "a sort pass", [pass, u32::from(pass + 1 == PASSES), 0, 0]))
                .collect::<Result<_, _>>()?,
            passes: Vec::new(),
        })
    }

    /// Makes room for that many keys. Whether a buffer is another one now.
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
        for (pass, task) in self.tasks.iter().enumerate() {
            let (from, to) = (pass % 2, (pass + 1) % 2);
            let (keys, counts, starts) = (self.keys[from].buffer(), self.counts.buffer(), self.starts.buffer());
            self.passes.push([
                self.add_counts.bind(gpu, &[(0, params), (1, task), (6, counts), (7, starts)])?,
                self.scatter.bind(
                    gpu,
                    &[
                        (0, params),
                        (1, task),
                        (2, keys),
                        (3, self.values[from].buffer()),
                        (4, self.keys[to].buffer()),
                        (5, self.values[to].buffer()),
                        (6, counts),
                        (7, starts),
                    ],
                )?,
            ]);
        }
        Ok(())
    }

    /// Where the keys go before the sort, and the counts of their first digits, which are added to what is there.
    pub(super) fn unsorted(&self) -> [&wgpu::Buffer; 2] {
        [self.keys[0].buffer(), self.counts.buffer()]
    }

    /// After the sort: which key stood where. There is an even number of passes.
    pub(super) fn order(&self) -> &wgpu::Buffer {
        self.values[0].buffer()
    }

    /// Clears the counts, before the keys are written.
    pub(super) fn clear(&self, encoder: &mut wgpu::CommandEncoder, objects: u32) {
        encoder.clear_buffer(self.counts.buffer(), 0, Some(bytes_of_counts(objects)));
    }

    /// Adds the sort of `objects` keys.
    pub(super) fn record(&self, pass: &mut wgpu::ComputePass<'_>, objects: u32) {
        for [add_counts, scatter] in &self.passes {
            add_counts.dispatch(pass, counts(objects).div_ceil(COUNTS));
            scatter.dispatch(pass, objects.div_ceil(BLOCK));
        }
    }
}

/// Counts of one pass.
fn counts(objects: u32) -> u32 {
    objects.div_ceil(BLOCK) * DIGITS
}

fn bytes_of_counts(objects: u32) -> u64 {
    u64::from(counts(objects) * PASSES) * 4
}

/// Four words that a kernel reads and that never change.
pub(super) fn constant(gpu: &Gpu, label: &str, words: [u32; 4]) -> Result<wgpu::Buffer, GpuError> {
    gpu.try_make(|device| {
        device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some(label),
            contents: bytemuck::cast_slice(&words),
            usage: wgpu::BufferUsages::UNIFORM,
        })
    })
}
