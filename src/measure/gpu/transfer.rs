//! Uploads and downloads: the paper's two transfers, and their line over sizes.
//!
//! Staging buffers are kept and stay mapped between uses. `Queue::write_buffer` allocates on every call and was five times
//! slower. On a machine whose CPU sees all of the GPU's memory, the staging buffer of uploads may lie there: then the bus
//! is crossed by the part of the CPU and not by that of the GPU, and the sum is still right.

use std::time::{Duration, Instant};

use super::bench::{Bench, or_missing, per_ns, words};
use super::fits;
use crate::hardware::{GpuParameterId, Parameter};
use crate::measure::foreign_load::Figure;
use crate::splitmix;

/// The size that totals are given for.
pub(super) const TOTAL_BYTES: u64 = 33_554_432;

/// Sizes of the line: four to an order of magnitude and a half, from 4 KiB to 64 MiB.
const SIZES: [u64; 8] = [1 << 12, 1 << 14, 1 << 16, 1 << 18, 1 << 20, 1 << 23, TOTAL_BYTES, 1 << 26];

/// Sizes of a brief run.
const BRIEF_SIZES: [u64; 4] = [1 << 12, 1 << 16, 1 << 20, TOTAL_BYTES];

const NAMES: [GpuParameterId; 10] = [
    GpuParameterId::UploadGbPerS,
    GpuParameterId::UploadHostCopyGbPerS,
    GpuParameterId::UploadDeviceCopyGbPerS,
    GpuParameterId::UploadLatencyNs,
    GpuParameterId::UploadRateGbPerS,
    GpuParameterId::DownloadGbPerS,
    GpuParameterId::DownloadHostCopyGbPerS,
    GpuParameterId::DownloadDeviceCopyGbPerS,
    GpuParameterId::DownloadLatencyNs,
    GpuParameterId::DownloadRateGbPerS,
];

pub(super) fn measure(bench: &Bench<'_>) -> Vec<Parameter> {
    or_missing(&NAMES, transfers(bench))
}

fn transfers(bench: &Bench<'_>) -> Result<Vec<Parameter>, String> {
    let largest = bench.gpu.limits().max_buffer_size;
    if largest < TOTAL_BYTES {
        return Err(format!("its buffers hold {largest} bytes at most, and the transfer is of {TOTAL_BYTES}"));
    }
    let sizes = if bench.options.brief { BRIEF_SIZES.to_vec() } else { SIZES.to_vec() };
    let sizes: Vec<u64> = sizes.into_iter().filter(|&bytes| bytes <= largest).collect();
    let mut transfer = Transfer::new(bench, sizes.iter().copied().max().unwrap_or(TOTAL_BYTES))?;
    // First use of the pages and of the driver's copy path; and a proof that the bytes arrive.
    transfer.upload(TOTAL_BYTES)?;
    transfer.download(TOTAL_BYTES)?;
    transfer.verify(TOTAL_BYTES)?;
    let plan = bench.plan(9, bench.pick(500, 1000));
    let figures = bench.collect(plan, || {
        let mut row = Row::default();
        for &bytes in &sizes {
            // A small transfer is over in microseconds: three of them, and the middle one counts.
            let times = if bytes <= 1 << 18 { 3 } else { 1 };
            let up = middle(times, || transfer.upload(bytes))?;
            let down = middle(times, || transfer.download(bytes))?;
            row.add(bytes, up, down);
        }
        Ok(row.figures())
    })?;
    Ok(parameters(figures, &sizes))
}

fn parameters(figures: Vec<Figure>, sizes: &[u64]) -> Vec<Parameter> {
    let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
    let line = format!(
        "line of least relative deviation through {} sizes from {} to {} MiB, total times",
        sizes.len(),
        mib(sizes.iter().copied().min().unwrap_or(0)),
        mib(sizes.iter().copied().max().unwrap_or(0))
    );
    let methods = [
        format!(
            "{TOTAL_BYTES} random bytes: copy into a kept staging buffer, recording, copy command, wait, mapping again"
        ),
        "the CPU's copy into mapped memory, of that upload".to_owned(),
        "recording, copy command, wait and mapping again, of that upload".to_owned(),
        line.clone(),
        line.clone(),
        format!(
            "{TOTAL_BYTES} random bytes: recording, copy command into a kept staging buffer, wait, mapping, copy out of it"
        ),
        "the CPU's copy out of mapped memory, of that download".to_owned(),
        "recording, copy command, wait and mapping, of that download".to_owned(),
        line.clone(),
        line,
    ];
    let figures = figures.into_iter().zip(NAMES).zip(methods);
    figures.map(|((figure, name), method)| figure.into_parameter(name, &method)).collect()
}

/// Times of one transfer: what the CPU copies, and all the rest.
#[derive(Debug, Clone, Copy, Default)]
struct Times {
    host: Duration,
    device: Duration,
}

impl Times {
    fn total(self) -> Duration {
        self.host + self.device
    }
}

/// The one of `times` transfers that took the middle time.
fn middle(times: usize, mut transfer: impl FnMut() -> Result<Times, String>) -> Result<Times, String> {
    let mut all = (0..times).map(|_| transfer()).collect::<Result<Vec<_>, _>>()?;
    all.sort_by_key(|t| t.total());
    Ok(all.get(times / 2).copied().unwrap_or_default())
}

/// One sample of every figure.
#[derive(Default)]
struct Row {
    totals: [Times; 2],
    points: [Vec<(f64, f64)>; 2],
}

impl Row {
    fn add(&mut self, bytes: u64, up: Times, down: Times) {
        for (k, times) in [up, down].into_iter().enumerate() {
            self.points[k].push((bytes as f64, times.total().as_nanos() as f64));
            if bytes == TOTAL_BYTES {
                self.totals[k] = times;
            }
        }
    }

    /// In the order of [`NAMES`]. What can't be told is no number.
    fn figures(&self) -> Vec<f64> {
        let both = self.totals.iter().zip(&self.points).flat_map(|(times, points)| {
            let rate = |time| per_ns(TOTAL_BYTES as f64, time);
            // Bytes a nanosecond are gigabytes a second.
            let line = fits::line(points).unwrap_or(fits::Line { latency: f64::NAN, rate: f64::NAN });
            [rate(times.total()), rate(times.host), rate(times.device), line.latency, line.rate]
        });
        both.collect()
    }
}

/// Buffers for transfers in both directions.
pub(super) struct Transfer<'a> {
    bench: &'a Bench<'a>,
    sent: Vec<u8>,
    received: Vec<u8>,
    up: wgpu::Buffer,
    device: wgpu::Buffer,
    down: wgpu::Buffer,
}

impl<'a> Transfer<'a> {
    /// Buffers for up to `bytes`, a multiple of 8.
    pub(super) fn new(bench: &'a Bench<'a>, bytes: u64) -> Result<Self, String> {
        use wgpu::BufferUsages as U;
        let sent = random(bytes).ok_or("no memory for what is to be sent")?;
        // Filled, so that the first copy does not wait for pages.
        let mut received = Vec::new();
        received.try_reserve_exact(sent.len()).map_err(|_| "no memory for what is to be received")?;
        received.resize(sent.len(), 1);
        Ok(Self {
            bench,
            sent,
            received,
            up: bench.buffer(bytes, U::MAP_WRITE | U::COPY_SRC)?,
            device: bench.storage(bytes)?,
            down: bench.buffer(bytes, U::MAP_READ | U::COPY_DST)?,
        })
    }

    /// Sends the first bytes.
    fn upload(&mut self, bytes: u64) -> Result<Times, String> {
        let start = Instant::now();
        let source = self.sent.get(..bytes as usize).ok_or("more bytes than there are")?;
        let mut view = self.up.slice(..bytes).get_mapped_range_mut().map_err(|e| e.to_string())?;
        view.copy_from_slice(source);
        drop(view);
        let host = start.elapsed();
        let submission = self.bench.submit(|encoder| {
            self.up.unmap();
            encoder.copy_buffer_to_buffer(&self.up, 0, &self.device, 0, bytes);
        })?;
        // Mapped as a whole: the next transfer may be larger.
        self.bench.gpu.map(self.up.slice(..), wgpu::MapMode::Write, |_| {});
        self.bench.gpu.wait(submission).map_err(words)?;
        Ok(Times { host, device: start.elapsed().saturating_sub(host) })
    }

    /// Fetches the first bytes.
    fn download(&mut self, bytes: u64) -> Result<Times, String> {
        let start = Instant::now();
        let submission =
            self.bench.submit(|encoder| encoder.copy_buffer_to_buffer(&self.device, 0, &self.down, 0, bytes))?;
        self.bench.gpu.map(self.down.slice(..bytes), wgpu::MapMode::Read, |_| {});
        self.bench.gpu.wait(submission).map_err(words)?;
        let view = self.down.slice(..bytes).get_mapped_range().map_err(|e| e.to_string())?;
        let device = start.elapsed();
        self.received.get_mut(..bytes as usize).ok_or("more bytes than there are")?.copy_from_slice(&view);
        let host = start.elapsed().saturating_sub(device);
        drop(view);
        self.bench.gpu.unmap(&self.down);
        Ok(Times { host, device })
    }

    /// Bytes a nanosecond of uploads of `bytes`, one after another for `time`.
    pub(super) fn upload_rate(&mut self, bytes: u64, time: Duration) -> Result<f64, String> {
        let start = Instant::now();
        let mut sent = 0.0;
        while start.elapsed() < time {
            self.upload(bytes)?;
            sent += bytes as f64;
        }
        Ok(per_ns(sent, start.elapsed()))
    }

    /// Whether what came back is what was sent.
    fn verify(&self, bytes: u64) -> Result<(), String> {
        let same = self.sent.get(..bytes as usize) == self.received.get(..bytes as usize);
        if same { Ok(()) } else { Err("bytes that were sent came back changed: the driver is broken".to_owned()) }
    }
}

/// Bytes that no bus compresses. `None` without the memory.
fn random(bytes: u64) -> Option<Vec<u8>> {
    let mut random = Vec::new();
    random.try_reserve_exact(usize::try_from(bytes).ok()?).ok()?;
    let mut state = 0;
    for _ in 0..bytes / 8 {
        random.extend_from_slice(&splitmix::next(&mut state).to_le_bytes());
    }
    Some(random)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_the_report() {
        assert_eq!(GpuParameterId::OF_ONE[..NAMES.len()], NAMES);
    }

    #[test]
    fn a_row_in_the_order_of_the_names() {
        let times = |bytes: u64, part: u64| Times {
            host: Duration::from_nanos(bytes / 16 * part),
            device: Duration::from_nanos(1000 + bytes / 16 * part),
        };
        let mut row = Row::default();
        for bytes in SIZES {
            row.add(bytes, times(bytes, 1), times(bytes, 2));
        }
        let [up, host, _, latency, rate, down, .., slow] = row.figures()[..] else { panic!() };
        assert!((up - 8.0).abs() < 0.01 && (host - 16.0).abs() < 1e-9, "{up} {host}");
        assert!((latency - 1000.0).abs() < 1.0 && (rate - 8.0).abs() < 1e-6, "{latency} {rate}");
        assert!((down - 4.0).abs() < 0.01 && (slow - 4.0).abs() < 1e-6, "{down} {slow}");
    }

    #[test]
    fn random_bytes_are_all_there() {
        let bytes = random(4096).unwrap();
        assert_eq!(bytes.len(), 4096);
        assert!((0..=255).all(|b| bytes.contains(&b)));
    }
}
