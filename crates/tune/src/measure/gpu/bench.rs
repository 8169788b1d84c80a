//! Shared by the families of GPU measurements: buffers, kernels, timed submissions, and calibrated amounts of work.

use std::time::{Duration, Instant};

use wgpu::util::{BufferInitDescriptor, DeviceExt};

use crate::hardware::{GpuParameterId, Parameter};
use crate::measure::Options;
use sapwise::internals::GpuKind;
pub(super) use sapwise_gpu::kernel::{Bound, Kernel};
use sapwise_gpu::{Gpu, GpuError, GpuErrorKind};

pub(super) type Result<T> = std::result::Result<T, GpuError>;

/// An open GPU under measurement.
pub(super) struct Bench<'a> {
    pub(super) gpu: &'a Gpu,
    pub(super) options: &'a Options,
}

impl Bench<'_> {
    /// Whether a program on the CPU acts as the GPU. It is hundreds of times slower and has no clock of its own.
    pub(super) fn is_software(&self) -> bool {
        self.gpu.identity().kind == GpuKind::Software
    }

    /// Returns the value for this kind of GPU.
    pub(super) fn pick<T>(&self, hardware: T, software: T) -> T {
        if self.is_software() { software } else { hardware }
    }

    pub(super) fn buffer(&self, bytes: u64, usage: wgpu::BufferUsages) -> Result<wgpu::Buffer> {
        let mapped_at_creation = usage.contains(wgpu::BufferUsages::MAP_WRITE);
        let descriptor =
            wgpu::BufferDescriptor { label: Some("sapwise measure"), size: bytes, usage, mapped_at_creation };
        self.gpu.try_make(|device| device.create_buffer(&descriptor))
    }

    /// Makes a buffer that kernels write and that is copied from and to.
    pub(super) fn storage(&self, bytes: u64) -> Result<wgpu::Buffer> {
        use wgpu::BufferUsages as U;
        self.buffer(bytes, U::STORAGE | U::COPY_SRC | U::COPY_DST)
    }

    /// Makes a buffer of up to four 32-bit constants, in the order of the kernel's structure.
    pub(super) fn uniform(&self, words: [u32; 2]) -> Result<wgpu::Buffer> {
        // Uniform structures end on multiples of 16 bytes on some interfaces.
        let padded = [words[0], words[1], 0, 0];
        let contents = bytemuck::cast_slice(&padded);
        let usage = wgpu::BufferUsages::UNIFORM;
        self.gpu.try_make(|d| d.create_buffer_init(&BufferInitDescriptor { label: None, contents, usage }))
    }

    /// Compiles an entry point and binds its buffers, each with its binding number.
    pub(super) fn bind(&self, source: &str, entry: &'static str, buffers: &[(u32, &wgpu::Buffer)]) -> Result<Bound> {
        Kernel::compile(self.gpu, source.to_owned(), entry, &[])?.bind(self.gpu, buffers)
    }

    /// Records commands and submits them.
    pub(super) fn submit(&self, record: impl FnOnce(&mut wgpu::CommandEncoder)) -> Result<wgpu::SubmissionIndex> {
        let mut commands = self.gpu.record();
        record(&mut commands);
        self.gpu.submit(commands)
    }

    /// Records commands, submits them and waits for them. Returns the time of all three.
    pub(super) fn time(&self, record: impl FnOnce(&mut wgpu::CommandEncoder)) -> Result<Duration> {
        let start = Instant::now();
        let submission = self.submit(record)?;
        self.gpu.wait(submission)?;
        Ok(start.elapsed())
    }

    /// Returns the time of `count` dispatches of `groups` workgroups each, in one pass.
    pub(super) fn time_dispatches(&self, bound: &Bound, groups: u32, count: u32) -> Result<Duration> {
        self.time(|encoder| record(bound, encoder, groups, count))
    }

    /// Makes 4 bytes of memory that the CPU reads.
    pub(super) fn word(&self) -> Result<wgpu::Buffer> {
        self.buffer(4, wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST)
    }

    /// Reads the first word of a buffer by way of [`word`](Self::word).
    pub(super) fn read_word(&self, buffer: &wgpu::Buffer, staging: &wgpu::Buffer) -> Result<u32> {
        let submission = self.submit(|encoder| encoder.copy_buffer_to_buffer(buffer, 0, staging, 0, 4))?;
        self.gpu.map(staging.slice(..), wgpu::MapMode::Read, |_| {});
        self.gpu.wait(submission)?;
        let view = staging.slice(..).get_mapped_range().map_err(not_mapped)?;
        let word = view.first_chunk().map(|bytes| u32::from_le_bytes(*bytes));
        drop(view);
        self.gpu.unmap(staging);
        word.ok_or_else(|| broken("a mapping of 4 bytes is shorter".to_owned()))
    }
}

/// The error of memory that the CPU can't reach.
pub(super) fn not_mapped(error: impl std::error::Error + Send + Sync + 'static) -> GpuError {
    GpuError::caused(GpuErrorKind::Refused, "its memory can't be mapped", error)
}

/// The error of a driver that returns wrong results.
pub(super) fn broken(what: String) -> GpuError {
    GpuError::new(GpuErrorKind::Refused, format!("{what}: the driver is broken"))
}

/// Records a pass of `count` dispatches.
pub(super) fn record(bound: &Bound, encoder: &mut wgpu::CommandEncoder, groups: u32, count: u32) {
    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
    for _ in 0..count {
        bound.dispatch(&mut pass, groups);
    }
}

/// Returns how much work, from 1 to `most`, takes about `target`. `run` does an amount of work and returns its time.
///
/// The first run of a kernel may compile it, so the smallest amount runs twice.
pub(super) fn calibrate<E>(
    target: Duration,
    most: u32,
    mut run: impl FnMut(u32) -> std::result::Result<Duration, E>,
) -> std::result::Result<u32, E> {
    run(1)?;
    let mut amount = 1_u32;
    // Each turn multiplies by up to 16: eight of them pass every u32.
    for _ in 0..10 {
        let time = run(amount)?;
        if amount >= most || time.as_secs_f64() >= 0.7 * target.as_secs_f64() {
            break;
        }
        let factor = (target.as_secs_f64() / time.as_secs_f64().max(1e-9)).clamp(1.0, 16.0);
        amount = ((f64::from(amount) * factor).ceil() as u32).clamp(amount.saturating_add(1), most);
    }
    Ok(amount.min(most))
}

/// Returns the parameters, or the same names as missing with the words of the driver.
pub(super) fn or_missing(ids: &[GpuParameterId], measured: Result<Vec<Parameter>>) -> Vec<Parameter> {
    measured.unwrap_or_else(|why| super::super::missing(ids, &one_line(&format!("{why:#}"))))
}

/// The first words of an error as one line: those of shaders are pages with drawings.
fn one_line(text: &str) -> String {
    const MOST: usize = 240;
    let line = text.split_whitespace().collect::<Vec<_>>().join(" ");
    match line.char_indices().nth(MOST) {
        Some((end, _)) => format!("{} ...", line[..end].trim_end()),
        None => line,
    }
}

/// Amount a nanosecond, which is thousands of millions a second. Infinite if the clock did not move.
pub(super) fn per_ns(amount: f64, time: Duration) -> f64 {
    amount / (time.as_secs_f64() * 1e9)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A device that takes 2 µs to answer and 3 µs for each piece of work.
    fn device(amount: u32) -> std::result::Result<Duration, ()> {
        Ok(Duration::from_micros(2) + Duration::from_micros(3) * amount)
    }

    #[test]
    fn calibration_reaches_its_target() {
        let amount = calibrate(Duration::from_millis(5), u32::MAX, device).unwrap();
        let time = device(amount).unwrap();
        assert!((Duration::from_micros(3500)..Duration::from_millis(10)).contains(&time), "{amount}: {time:?}");
        assert_eq!(calibrate(Duration::from_micros(1), 100, device), Ok(1));
        assert_eq!(calibrate(Duration::from_secs(1), 100, device), Ok(100));
        assert!(calibrate(Duration::from_secs(1), 100, |_| Err(())).is_err());
        // A clock that stands still.
        assert_eq!(calibrate(Duration::from_secs(1), 1 << 20, |_| Ok::<_, ()>(Duration::ZERO)), Ok(1 << 20));
    }

    #[test]
    fn errors_fit_on_a_line() {
        assert_eq!(one_line("no\n\n  memory"), "no memory");
        assert_eq!(one_line(&"ä".repeat(1000)).chars().count(), 244);
    }

    #[test]
    fn every_shader_is_valid() {
        for (name, source) in [
            ("arithmetic", include_str!("shaders/arithmetic.wgsl")),
            ("latency", include_str!("shaders/latency.wgsl")),
            ("memory", include_str!("shaders/memory.wgsl")),
        ] {
            sapwise_gpu::kernel::assert_valid(name, source);
        }
    }
}
