//! Bandwidth within the GPU's memory: reading by a kernel, and the copy command.

use std::time::Duration;

use super::bench::{Bench, Result, calibrate, per_ns};
use crate::hardware::{GpuParameterId, Parameter};

const SOURCE: &str = include_str!("shaders/memory.wgsl");

/// Bytes that a workgroup of the kernels reads or writes.
const GROUP_BYTES: u64 = 65_536;

/// Working set beyond the caches of a GPU, which reach 256 MiB, and of the CPU behind a software adapter, which is
/// slow.
const LARGEST: u64 = 512 << 20;
const LARGEST_SOFTWARE: u64 = 128 << 20;

/// Working set of a brief run.
const BRIEF: u64 = 1 << 20;

/// Most dispatches or copies in one submission.
const MOST_COMMANDS: u32 = 4096;

pub(super) const NAMES: [GpuParameterId; 2] = [GpuParameterId::ReadGbPerS, GpuParameterId::CopyGbPerS];

/// The largest power of two up to `wanted` that the limits of the device and an eighth of its memory allow for one of
/// two buffers.
fn set_bytes(wanted: u64, limits: &wgpu::Limits, heaps: &[u64]) -> u64 {
    let memory = heaps.iter().max().map_or(wanted, |bytes| bytes / 8);
    let limit = wanted.min(limits.max_buffer_size).min(limits.max_storage_buffer_binding_size).min(memory);
    // At least one workgroup: every device binds 128 MiB.
    1 << limit.max(GROUP_BYTES).ilog2()
}

pub(super) fn measure(bench: &Bench<'_>, heaps: &[u64]) -> Result<Vec<Parameter>> {
    let wanted = if bench.options.brief { BRIEF } else { bench.pick(LARGEST, LARGEST_SOFTWARE) };
    let bytes = set_bytes(wanted, bench.gpu.limits(), heaps);
    let groups = u32::try_from(bytes / GROUP_BYTES).unwrap_or(u32::MAX);
    let (data, other, sink) = (bench.storage(bytes)?, bench.storage(bytes)?, bench.storage(16)?);
    // Memory that was never written may be one page of zeros for all.
    for buffer in [&other, &data] {
        bench.time_dispatches(&bench.bind(SOURCE, "fill", &[(3, buffer)])?, groups, 1)?;
    }
    let read = bench.bind(SOURCE, "read_set", &[(1, &data), (2, &sink)])?;
    let reads = |count| bench.time_dispatches(&read, groups, count);
    let copies = |count| {
        bench.time(|encoder| (0..count).for_each(|_| encoder.copy_buffer_to_buffer(&data, 0, &other, 0, bytes)))
    };
    // Long against a round trip, which is part of the time.
    let target = Duration::from_millis(bench.pick(4, 12));
    let read_count = calibrate(target, MOST_COMMANDS, reads)?;
    let copy_count = calibrate(target, MOST_COMMANDS, copies)?;
    let mib = bytes >> 20;
    let read_method = format!(
        "kernel that reads {mib} MiB of random data, vectors of 16 bytes, many dispatches in one submission, by the \
         wall clock"
    );
    let copy_method = format!("copy command from one buffer of {mib} MiB to another, read and written bytes counted");
    bench.options.plan(9, bench.pick(250, 500)).measure([(NAMES[0], read_method), (NAMES[1], copy_method)], || {
        let rate = |count: u32, time| per_ns(bytes as f64 * f64::from(count), time);
        Ok([rate(read_count, reads(read_count)?), 2.0 * rate(copy_count, copies(copy_count)?)])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_are_powers_of_two_within_the_limits() {
        let limits = wgpu::Limits {
            max_buffer_size: u64::MAX,
            max_storage_buffer_binding_size: 134_217_727,
            ..Default::default()
        };
        assert_eq!(set_bytes(LARGEST, &limits, &[]), 64 << 20);
        assert_eq!(set_bytes(LARGEST, &limits, &[256 << 20, 1 << 20]), 32 << 20);
        assert_eq!(set_bytes(LARGEST, &limits, &[0]), GROUP_BYTES);
        let limits = wgpu::Limits { max_storage_buffer_binding_size: u64::MAX, ..limits };
        assert_eq!(set_bytes(LARGEST, &limits, &[]), LARGEST);
        // A dispatch covers it: every device allows 65 535 workgroups.
        const { assert!(LARGEST / GROUP_BYTES <= 65_535) };
    }
}
