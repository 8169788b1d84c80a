//! Radix sort of 32-bit keys with their positions; see `shaders/sort.wgsl`.

use super::device::Gpu;
use super::kernel::{Bound, Kernel, source};
use super::storage::Storage;
use crate::error::GpuError;
use wgpu::util::DeviceExt;

/// Bits of a digit, and values that it has.
const DIGIT_BITS: u32 = 4;
const DIGITS: u32 = 1 << DIGIT_BITS;
/// Keys of one workgroup.
const BLOCK: u32 = 1024;

/// The kernels and buffers of the sort.
#[derive(Debug)]
pub(super) struct Sort {
    histogram: Kernel,
    scan_digits: Kernel,
    scatter: Kernel,
    /// Passes read from one and write to the other, in turn.
    keys: [Storage; 2],
    values: [Storage; 2],
    counts: Storage,
    totals: Storage,
    /// For each pass its digit.
    digits: Vec<wgpu::Buffer>,
    passes: Vec<[Bound; 3]>,
}

impl Sort {
    pub(super) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let digit = |pass: u32| {
            let contents = [pass * DIGIT_BITS, u32::from(pass == 0), 0, 0];
            gpu.try_make(|device| {
                device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                    label: Some("digit of a sort pass"),
                    contents: bytemuck::cast_slice(&contents),
                    usage: wgpu::BufferUsages::UNIFORM,
                })
            })
        };
        let mut totals = Storage::new(gpu, "digits")?;
        totals.ensure(gpu, u64::from(DIGITS) * 4)?;
        Ok(Self {
            histogram: Kernel::new(gpu, source::SORT, "histogram")?,
            scan_digits: Kernel::new(gpu, source::SORT, "scan_digits")?,
            scatter: Kernel::new(gpu, source::SORT, "scatter")?,
            keys: [Storage::new(gpu, "sort keys")?, Storage::new(gpu, "sort keys")?],
            values: [Storage::new(gpu, "sorted positions")?, Storage::new(gpu, "sorted positions")?],
            counts: Storage::new(gpu, "digits of blocks")?,
            totals,
            digits: (0..u32::BITS / DIGIT_BITS).map(digit).collect::<Result<_, _>>()?,
            passes: Vec::new(),
        })
    }

    /// Makes room for that many keys. Whether a buffer is another one now.
    pub(super) fn ensure(&mut self, gpu: &Gpu, objects: u32) -> Result<bool, GpuError> {
        let mut grown = false;
        for list in self.keys.iter_mut().chain(&mut self.values) {
            grown |= list.ensure(gpu, u64::from(objects) * 4)?;
        }
        let counts = u64::from(objects.div_ceil(BLOCK) * DIGITS) * 4;
        Ok(self.counts.ensure(gpu, counts)? | grown)
    }

    pub(super) fn bind(&mut self, gpu: &Gpu, params: &wgpu::Buffer) -> Result<(), GpuError> {
        self.passes.clear();
        for (pass, digit) in self.digits.iter().enumerate() {
            let (from, to) = (pass % 2, (pass + 1) % 2);
            let (keys, counts, totals) = (self.keys[from].buffer(), self.counts.buffer(), self.totals.buffer());
            self.passes.push([
                self.histogram.bind(gpu, &[(0, params), (1, digit), (2, keys), (6, counts)])?,
                self.scan_digits.bind(gpu, &[(0, params), (6, counts), (7, totals)])?,
                self.scatter.bind(
                    gpu,
                    &[
                        (0, params),
                        (1, digit),
                        (2, keys),
                        (3, self.values[from].buffer()),
                        (4, self.keys[to].buffer()),
                        (5, self.values[to].buffer()),
                        (6, counts),
                        (7, totals),
                    ],
                )?,
            ]);
        }
        Ok(())
    }

    /// Where the keys go before the sort.
    pub(super) fn unsorted(&self) -> &wgpu::Buffer {
        self.keys[0].buffer()
    }

    /// The keys in order and their positions before the sort, by the side on which the last pass ended.
    pub(super) fn sorted(&self, side: usize) -> (&wgpu::Buffer, &wgpu::Buffer) {
        (self.keys[side].buffer(), self.values[side].buffer())
    }

    /// On which side a sort of keys of that many bits ends.
    pub(super) fn side(bits: u32) -> usize {
        passes(bits) % 2
    }

    /// Adds the sort of `objects` keys of which the lower `bits` differ.
    pub(super) fn record(&self, pass: &mut wgpu::ComputePass<'_>, objects: u32, bits: u32) {
        for [histogram, scan_digits, scatter] in &self.passes[..passes(bits)] {
            histogram.dispatch(pass, objects.div_ceil(BLOCK));
            scan_digits.dispatch(pass, DIGITS);
            scatter.dispatch(pass, objects.div_ceil(BLOCK));
        }
    }
}

/// Passes over keys of that many bits: one at least, because the first makes the positions.
fn passes(bits: u32) -> usize {
    bits.div_ceil(DIGIT_BITS).clamp(1, u32::BITS / DIGIT_BITS) as usize
}
