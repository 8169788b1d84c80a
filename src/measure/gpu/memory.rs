//! Bandwidth within the GPU's memory: reading, writing, copying, and reading over growing working sets.

use std::time::Duration;

use super::bench::{Bench, Bound, Kernel, calibrate, or_missing, per_ns};
use crate::hardware::{GpuParameterId, Parameter};
use crate::measure::UNDER_LIMIT;

const SOURCE: &str = include_str!("shaders/memory.wgsl");

/// Bytes that a workgroup of the kernels reads or writes.
const GROUP_BYTES: u64 = 65_536;

/// The working set beyond caches: last-level caches of GPUs reach 256 MiB. Programs on the CPU are slow, and 128 MiB are
/// beyond the caches of most CPUs.
const LARGEST: u64 = 512 << 20;
const LARGEST_SOFTWARE: u64 = 128 << 20;

/// The largest set of a brief run.
const BRIEF: u64 = 1 << 20;

/// Dispatches in one submission, at most.
const MOST_DISPATCHES: u32 = 4096;

pub(super) fn measure(bench: &Bench<'_>, free_bytes: Option<u64>) -> Vec<Parameter> {
    let mut ids = vec![GpuParameterId::ReadGbPerS, GpuParameterId::WriteGbPerS, GpuParameterId::CopyGbPerS];
    ids.extend(GpuParameterId::READS.map(|r| r.1));
    or_missing(&ids, bandwidths(bench, free_bytes))
}

/// The largest power of two that the limits of the device and its free memory leave for one of two buffers, up to `wanted`.
fn set_bytes(wanted: u64, limits: &wgpu::Limits, free_bytes: Option<u64>) -> u64 {
    let limit = wanted
        .min(limits.max_buffer_size)
        .min(limits.max_storage_buffer_binding_size)
        .min(free_bytes.map_or(wanted, |free| free / 8));
    // At least one workgroup: every device binds 128 MiB.
    1 << limit.max(GROUP_BYTES).ilog2()
}

fn bandwidths(bench: &Bench<'_>, free_bytes: Option<u64>) -> Result<Vec<Parameter>, String> {
    let wanted = if bench.options.brief { BRIEF } else { bench.pick(LARGEST, LARGEST_SOFTWARE) };
    let bytes = set_bytes(wanted, bench.gpu.limits(), free_bytes);
    let buffers = Buffers { data: bench.storage(bytes)?, other: bench.storage(bytes)?, sink: bench.storage(16)? };
    let (read, write) = (bench.kernel(SOURCE, "read_set", &[])?, bench.kernel(SOURCE, "write_set", &[])?);
    // Both buffers are written before anything is timed: memory that never was may be one page of zeros for all.
    for buffer in [&buffers.other, &buffers.data] {
        bench.time_dispatches(&writing(bench, &write, buffer, bytes)?, groups(bytes), 1)?;
    }
    // Long against a round trip, which is part of the time.
    let target = Duration::from_millis(bench.pick(4, 12));
    let mut jobs = vec![
        Job::of(bench, target, bytes, reading(bench, &read, &buffers, bytes)?)?,
        Job::of(bench, target, bytes, writing(bench, &write, &buffers.data, bytes)?)?,
    ];
    let copies = calibrate(target, MOST_DISPATCHES, |count| buffers.copy(bench, bytes, count))?;
    let sets: Vec<Result<u64, String>> =
        GpuParameterId::READS.map(|(kib, _)| set(u64::from(kib) << 10, bytes, bench)).into();
    // Each pass over a small set reads it again and again, so that a dispatch fills the GPU.
    let pass = bench.pick(64 << 20, 4 << 20).min(bytes);
    // The largest set may be the one that is read already.
    for &set in sets.iter().flatten().filter(|&&set| set < bytes) {
        jobs.push(Job::of(bench, target, pass.max(set), reading(bench, &read, &buffers, set)?)?);
    }
    let figures = bench.collect(bench.plan(9, bench.pick(450, 900)), || {
        let mut row = jobs.iter().map(|job| job.rate(bench)).collect::<Result<Vec<_>, _>>()?;
        let time = buffers.copy(bench, bytes, copies)?;
        // Read and written.
        row.insert(2, per_ns(2.0 * bytes as f64 * f64::from(copies), time));
        Ok(row)
    })?;
    let mib = bytes >> 20;
    let wall = "vectors of 16 bytes, many dispatches in one submission, by the wall clock";
    let whole = figures.first().cloned().unwrap_or_default();
    let mut figures = figures.into_iter();
    let mut next = |id: GpuParameterId, method: &str| figures.next().unwrap_or_default().into_parameter(id, method);
    let mut parameters = vec![
        next(GpuParameterId::ReadGbPerS, &format!("kernel that reads {mib} MiB of random data, {wall}")),
        next(GpuParameterId::WriteGbPerS, &format!("kernel that writes {mib} MiB, {wall}")),
        next(
            GpuParameterId::CopyGbPerS,
            &format!("copy command from one buffer of {mib} MiB to another, read and written bytes counted"),
        ),
    ];
    for ((kib, id), set) in GpuParameterId::READS.into_iter().zip(sets) {
        let method = format!("kernel that reads {kib} KiB of random data again and again, {wall}");
        parameters.push(match set {
            Ok(set) if set == bytes => whole.clone().into_parameter(id, &method),
            Ok(_) => next(id, &method),
            Err(why) => Parameter::missing(id, &why),
        });
    }
    Ok(parameters)
}

/// A working set, or why it is left out.
fn set(bytes: u64, largest: u64, bench: &Bench<'_>) -> Result<u64, String> {
    if bench.options.limit.is_some() {
        Err(UNDER_LIMIT.to_owned())
    } else if bytes <= largest {
        Ok(bytes)
    } else if bench.options.brief {
        Err("left out of a brief run".to_owned())
    } else {
        Err(format!("the working set exceeds the {largest} bytes that one buffer and the free memory allow"))
    }
}

fn groups(bytes: u64) -> u32 {
    u32::try_from(bytes / GROUP_BYTES).unwrap_or(u32::MAX).max(1)
}

struct Buffers {
    data: wgpu::Buffer,
    other: wgpu::Buffer,
    sink: wgpu::Buffer,
}

impl Buffers {
    fn copy(&self, bench: &Bench<'_>, bytes: u64, count: u32) -> Result<Duration, String> {
        bench.time(|encoder| {
            (0..count).for_each(|_| encoder.copy_buffer_to_buffer(&self.data, 0, &self.other, 0, bytes))
        })
    }
}

fn shape(bench: &Bench<'_>, bytes: u64) -> Result<wgpu::Buffer, String> {
    bench.uniform(&[u32::try_from(bytes / 16 - 1).unwrap_or(u32::MAX), 0x5bd1_e995])
}

fn reading(bench: &Bench<'_>, kernel: &Kernel, buffers: &Buffers, bytes: u64) -> Result<Bound, String> {
    bench.bind(kernel, &[(0, &shape(bench, bytes)?), (1, &buffers.data), (2, &buffers.sink)])
}

fn writing(bench: &Bench<'_>, kernel: &Kernel, buffer: &wgpu::Buffer, bytes: u64) -> Result<Bound, String> {
    bench.bind(kernel, &[(0, &shape(bench, bytes)?), (3, buffer)])
}

/// A kernel over a set, and how many dispatches make up a sample.
struct Job {
    bound: Bound,
    /// Bytes of one dispatch.
    bytes: u64,
    count: u32,
}

impl Job {
    fn of(bench: &Bench<'_>, target: Duration, bytes: u64, bound: Bound) -> Result<Self, String> {
        let count = calibrate(target, MOST_DISPATCHES, |count| bench.time_dispatches(&bound, groups(bytes), count))?;
        Ok(Self { bound, bytes, count })
    }

    /// Bytes a nanosecond.
    fn rate(&self, bench: &Bench<'_>) -> Result<f64, String> {
        let time = bench.time_dispatches(&self.bound, groups(self.bytes), self.count)?;
        Ok(per_ns(self.bytes as f64 * f64::from(self.count), time))
    }
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
        assert_eq!(set_bytes(LARGEST, &limits, None), 64 << 20);
        assert_eq!(set_bytes(LARGEST, &limits, Some(256 << 20)), 32 << 20);
        assert_eq!(set_bytes(BRIEF, &limits, None), BRIEF);
        assert_eq!(set_bytes(LARGEST, &limits, Some(0)), GROUP_BYTES);
        let limits = wgpu::Limits { max_storage_buffer_binding_size: u64::MAX, ..limits };
        assert_eq!(set_bytes(LARGEST, &limits, None), LARGEST);
    }

    #[test]
    fn a_dispatch_covers_the_largest_set() {
        // 65535 workgroups are what every device allows.
        assert!(groups(LARGEST) <= 65_535);
        assert_eq!(groups(GROUP_BYTES), 1);
    }
}
