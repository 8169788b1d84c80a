//! Uploads and downloads: the paper's two transfers, and the slope of a line over sizes.
//!
//! Staging buffers are kept and stay mapped between uses: `Queue::write_buffer` allocates on every call and was five
//! times slower. If the CPU reaches all of the GPU's memory, the staging buffer of uploads may lie there; the total
//! is the same.

use std::time::{Duration, Instant};

use super::bench::{Bench, Result, broken, not_mapped, per_ns};
use crate::hardware::{GpuParameterId, Parameter};
use crate::measure::filled;
use sapwise::internals::splitmix;
use sapwise_gpu::{GpuError, GpuErrorKind};

/// The size of the paper's transfers.
const TOTAL_BYTES: u64 = 33_554_432;

/// Sizes of the line, from 4 KiB to 64 MiB.
const SIZES: [u64; 8] = [1 << 12, 1 << 14, 1 << 16, 1 << 18, 1 << 20, 1 << 23, TOTAL_BYTES, 1 << 26];

pub(super) const NAMES: [GpuParameterId; 4] = [
    GpuParameterId::UploadGbPerS,
    GpuParameterId::UploadRateGbPerS,
    GpuParameterId::DownloadGbPerS,
    GpuParameterId::DownloadRateGbPerS,
];

pub(super) fn measure(bench: &Bench<'_>) -> Result<Vec<Parameter>> {
    let largest = *SIZES.iter().max().unwrap_or(&TOTAL_BYTES);
    let mut transfer = Transfer::new(bench, largest)?;
    // First use of the pages and of the driver's copy path, and a proof that the bytes arrive.
    transfer.upload(largest)?;
    transfer.download(largest)?;
    if transfer.sent != transfer.received {
        return Err(broken("bytes that were sent came back changed".to_owned()));
    }
    let line = "line of least relative deviation through 8 sizes from 4 KiB to 64 MiB, total times".to_owned();
    let upload = "copy into a kept staging buffer, recording, copy command, wait, mapping again";
    let download = "recording, copy command into a kept staging buffer, wait, mapping, copy out of it";
    let total = |what: &str| format!("{TOTAL_BYTES} random bytes: {what}");
    let [id_up, id_up_rate, id_down, id_down_rate] = NAMES;
    let named = [(id_up, total(upload)), (id_up_rate, line.clone()), (id_down, total(download)), (id_down_rate, line)];
    bench.options.plan(9, bench.pick(500, 1000)).measure(named, || {
        let (mut up, mut down) = (Times::default(), Times::default());
        for bytes in SIZES {
            up.0.push((bytes as f64, transfer.upload(bytes)?.as_nanos() as f64));
            down.0.push((bytes as f64, transfer.download(bytes)?.as_nanos() as f64));
        }
        Ok([up.total_rate(), up.slope_rate(), down.total_rate(), down.slope_rate()])
    })
}

/// Bytes and nanoseconds of transfers in one direction.
#[derive(Default)]
struct Times(Vec<(f64, f64)>);

impl Times {
    /// Bytes a nanosecond at [`TOTAL_BYTES`].
    fn total_rate(&self) -> f64 {
        let total = self.0.iter().find(|(bytes, _)| *bytes == TOTAL_BYTES as f64);
        total.map_or(f64::NAN, |(bytes, ns)| bytes / ns)
    }

    /// Bytes a nanosecond by the line `t = latency + bytes / rate` with the least sum of relative deviations.
    ///
    /// Relative, because sizes span four orders of magnitude and the largest would decide otherwise. Deviations and
    /// not squares, so that one spoiled time does not bend the line. Such a line goes through two of the points, or
    /// through one of them and the origin, so all of these are tried. NaN if no line rises.
    fn slope_rate(&self) -> f64 {
        let points = &self.0;
        let deviation = |latency: f64, slope: f64| -> f64 {
            points.iter().map(|(v, t)| (1.0 - (latency + slope * v) / t).abs()).sum()
        };
        let pairs = points.iter().enumerate().flat_map(|(i, &(v, t))| {
            let origin = (0.0, t / v);
            let through = points[..i].iter().map(move |&(w, u)| (t - u) / (v - w)).map(move |s| (t - s * v, s));
            std::iter::once(origin).chain(through)
        });
        let rising = pairs.filter(|&(latency, slope)| slope > 0.0 && slope.is_finite() && latency >= 0.0);
        let best = rising.min_by(|a, b| deviation(a.0, a.1).total_cmp(&deviation(b.0, b.1)));
        best.map_or(f64::NAN, |(_, slope)| 1.0 / slope)
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
    /// Makes buffers for up to `bytes`, a multiple of 8.
    pub(super) fn new(bench: &'a Bench<'a>, bytes: u64) -> Result<Self> {
        use wgpu::BufferUsages as U;
        let host = |value| {
            let full = || GpuError::new(GpuErrorKind::Refused, "the host has no memory for the transfers");
            filled(bytes as usize, value).ok_or_else(full)
        };
        // Random, so that no bus compresses it.
        let (mut sent, mut state) = (host(0_u8)?, 0);
        for chunk in sent.chunks_exact_mut(8) {
            chunk.copy_from_slice(&splitmix::next(&mut state).to_le_bytes());
        }
        Ok(Self {
            bench,
            sent,
            // Not zero, so that the first copy does not wait for pages.
            received: host(1)?,
            up: bench.buffer(bytes, U::MAP_WRITE | U::COPY_SRC)?,
            device: bench.storage(bytes)?,
            down: bench.buffer(bytes, U::MAP_READ | U::COPY_DST)?,
        })
    }

    /// Sends the first bytes.
    fn upload(&mut self, bytes: u64) -> Result<Duration> {
        let start = Instant::now();
        let mut view = self.up.slice(..bytes).get_mapped_range_mut().map_err(not_mapped)?;
        view.copy_from_slice(&self.sent[..bytes as usize]);
        drop(view);
        let submission = self.bench.submit(|encoder| {
            self.up.unmap();
            encoder.copy_buffer_to_buffer(&self.up, 0, &self.device, 0, bytes);
        })?;
        // Mapped as a whole: the next transfer may be larger.
        self.bench.gpu.map(self.up.slice(..), wgpu::MapMode::Write, |_| {});
        self.bench.gpu.wait(submission)?;
        Ok(start.elapsed())
    }

    /// Fetches the first bytes.
    fn download(&mut self, bytes: u64) -> Result<Duration> {
        let start = Instant::now();
        let submission =
            self.bench.submit(|encoder| encoder.copy_buffer_to_buffer(&self.device, 0, &self.down, 0, bytes))?;
        self.bench.gpu.map(self.down.slice(..bytes), wgpu::MapMode::Read, |_| {});
        self.bench.gpu.wait(submission)?;
        let view = self.down.slice(..bytes).get_mapped_range().map_err(not_mapped)?;
        self.received[..bytes as usize].copy_from_slice(&view);
        let time = start.elapsed();
        drop(view);
        self.bench.gpu.unmap(&self.down);
        Ok(time)
    }

    /// Bytes a nanosecond of uploads of `bytes`, one after another for `time`.
    pub(super) fn upload_rate(&mut self, bytes: u64, time: Duration) -> Result<f64> {
        let start = Instant::now();
        let mut sent = 0.0;
        while start.elapsed() < time {
            self.upload(bytes)?;
            sent += bytes as f64;
        }
        Ok(per_ns(sent, start.elapsed()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(latency: f64, rate: f64) -> Times {
        Times(SIZES.map(|bytes| bytes as f64).map(|v| (v, latency + v / rate)).to_vec())
    }

    #[test]
    fn a_line_is_found_again() {
        for (latency, rate) in [(80_000.0, 2.7), (5_000.0, 25.0), (0.0, 12.0)] {
            assert!((times(latency, rate).slope_rate() / rate - 1.0).abs() < 1e-6);
        }
        assert!((times(1e6, 10.0).total_rate() - 33_554_432.0 / 4_355_443.2).abs() < 1e-9);
    }

    #[test]
    fn spoiled_points_do_not_bend_it() {
        let mut times = times(50_000.0, 10.0);
        times.0[1].1 *= 9.0;
        times.0[6].1 *= 2.5;
        assert!((times.slope_rate() / 10.0 - 1.0).abs() < 1e-6);
    }

    #[test]
    fn without_a_rising_line_there_is_no_rate() {
        assert!(Times::default().slope_rate().is_nan() && Times::default().total_rate().is_nan());
        // One point: through the origin.
        assert_eq!(Times(vec![(10.0, 5.0)]).slope_rate(), 2.0);
        // A clock that did not move.
        assert!(Times(vec![(10.0, 0.0)]).slope_rate().is_nan());
    }
}
