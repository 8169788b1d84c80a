//! What every family of GPU measurements needs: buffers, kernels, timed submissions, and a work load of the right size.

use std::time::{Duration, Instant};

use wgpu::util::{BufferInitDescriptor, DeviceExt};

pub(super) use crate::gpu::kernel::{Bound, Kernel};
use crate::gpu::{Gpu, GpuError};
use crate::hardware::{GpuKind, GpuParameterId, Parameter};
use crate::measure::Options;
use crate::measure::foreign_load::{self, Figure, Plan};

/// An open GPU under measurement.
pub(super) struct Bench<'a> {
    pub(super) gpu: &'a Gpu,
    pub(super) options: &'a Options,
}

impl<'a> Bench<'a> {
    pub(super) fn new(gpu: &'a Gpu, options: &'a Options) -> Self {
        Self { gpu, options }
    }

    /// Whether the GPU is a program on the CPU: hundreds of times slower, and without a clock of its own.
    pub(super) fn is_software(&self) -> bool {
        self.gpu.identity().kind == GpuKind::Software
    }

    /// One of two values.
    pub(super) fn pick<T>(&self, hardware: T, software: T) -> T {
        if self.is_software() { software } else { hardware }
    }

    /// As many samples as wanted, unless the limit in milliseconds comes first.
    pub(super) fn plan(&self, samples: usize, limit_ms: u64) -> Plan {
        self.options.plan(samples, limit_ms)
    }

    /// Takes samples of several figures together, until one fails.
    pub(super) fn collect(
        &self,
        plan: Plan,
        sample: impl FnMut() -> Result<Vec<f64>, String>,
    ) -> Result<Vec<Figure>, String> {
        foreign_load::try_collect(plan, sample)
    }

    pub(super) fn buffer(&self, bytes: u64, usage: wgpu::BufferUsages) -> Result<wgpu::Buffer, String> {
        let mapped_at_creation = usage.contains(wgpu::BufferUsages::MAP_WRITE);
        let descriptor =
            wgpu::BufferDescriptor { label: Some("sapwise measure"), size: bytes, usage, mapped_at_creation };
        self.gpu.try_make(|device| device.create_buffer(&descriptor)).map_err(words)
    }

    /// A buffer that kernels write, and that is copied from and to.
    pub(super) fn storage(&self, bytes: u64) -> Result<wgpu::Buffer, String> {
        use wgpu::BufferUsages as U;
        self.buffer(bytes, U::STORAGE | U::COPY_SRC | U::COPY_DST)
    }

    /// A small buffer of constants: 32-bit words in the order of the kernel's structure.
    pub(super) fn uniform(&self, words: &[u32]) -> Result<wgpu::Buffer, String> {
        // Uniform structures end on multiples of 16 bytes on some interfaces.
        let mut padded = words.to_vec();
        padded.resize(words.len().next_multiple_of(4), 0);
        let contents = bytemuck::cast_slice(&padded);
        let usage = wgpu::BufferUsages::UNIFORM;
        self.gpu
            .try_make(|d| d.create_buffer_init(&BufferInitDescriptor { label: None, contents, usage }))
            .map_err(self::words)
    }

    /// Compiles an entry point, with constants for its overrides.
    pub(super) fn kernel(
        &self,
        source: &str,
        entry: &'static str,
        constants: &[(&str, f64)],
    ) -> Result<Kernel, String> {
        Kernel::compile(self.gpu, source.to_owned(), entry, constants).map_err(words)
    }

    /// A kernel with its buffers, each with its binding number. Only those that the entry point uses may be named.
    pub(super) fn bind(&self, kernel: &Kernel, buffers: &[(u32, &wgpu::Buffer)]) -> Result<Bound, String> {
        kernel.bind(self.gpu, buffers).map_err(words)
    }

    /// Records commands and submits them.
    pub(super) fn submit(
        &self,
        record: impl FnOnce(&mut wgpu::CommandEncoder),
    ) -> Result<wgpu::SubmissionIndex, String> {
        let mut commands = self.gpu.record();
        record(&mut commands);
        self.gpu.submit(commands).map_err(words)
    }

    /// Records commands, submits them and waits for them; the time of all three.
    pub(super) fn time(&self, record: impl FnOnce(&mut wgpu::CommandEncoder)) -> Result<Duration, String> {
        let start = Instant::now();
        let submission = self.submit(record)?;
        self.gpu.wait(submission).map_err(words)?;
        Ok(start.elapsed())
    }

    /// Time of `count` dispatches of `groups` workgroups each, in one pass.
    pub(super) fn time_dispatches(&self, bound: &Bound, groups: u32, count: u32) -> Result<Duration, String> {
        self.time(|encoder| record(bound, encoder, groups, count))
    }

    /// The first word of a buffer.
    pub(super) fn first_word(&self, buffer: &wgpu::Buffer) -> Result<u32, String> {
        let staging = self.buffer(4, wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST)?;
        self.read_word(buffer, &staging)
    }

    /// The first word of a buffer, by way of 4 bytes of memory that the CPU reads.
    pub(super) fn read_word(&self, buffer: &wgpu::Buffer, staging: &wgpu::Buffer) -> Result<u32, String> {
        let submission = self.submit(|encoder| encoder.copy_buffer_to_buffer(buffer, 0, staging, 0, 4))?;
        self.gpu.map(staging.slice(..), wgpu::MapMode::Read, |_| {});
        self.gpu.wait(submission).map_err(words)?;
        let view = staging.slice(..).get_mapped_range().map_err(|e| e.to_string())?;
        let word = view.first_chunk().map(|bytes| u32::from_le_bytes(*bytes));
        drop(view);
        self.gpu.unmap(staging);
        word.ok_or_else(|| "a mapping came without its bytes".to_owned())
    }
}

/// What a parameter says where a GPU failed: with the words of the driver.
#[expect(clippy::needless_pass_by_value, reason = "for `map_err`")]
pub(super) fn words(error: GpuError) -> String {
    format!("{error:#}")
}

/// Records a pass of `count` dispatches.
pub(super) fn record(bound: &Bound, encoder: &mut wgpu::CommandEncoder, groups: u32, count: u32) {
    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
    for _ in 0..count {
        bound.dispatch(&mut pass, groups);
    }
}

/// How much work takes about `target`: from 1 up, at most `most`. `run` does this much work and returns its time.
///
/// The first run of a kernel may compile it, so the smallest amount runs twice.
pub(super) fn calibrate(
    target: Duration,
    most: u32,
    mut run: impl FnMut(u32) -> Result<Duration, String>,
) -> Result<u32, String> {
    run(1)?;
    let mut amount = 1_u32;
    // Each turn multiplies by up to 16: eight of them pass every u32.
    for _ in 0..10 {
        let time = run(amount)?;
        if amount >= most || time.as_secs_f64() >= 0.7 * target.as_secs_f64() {
            break;
        }
        let factor = (target.as_secs_f64() / time.as_secs_f64().max(1e-9)).clamp(1.0, 16.0);
        amount = ((f64::from(amount) * factor).ceil() as u32).clamp(amount.saturating_add(1), most.max(1));
    }
    Ok(amount.min(most.max(1)))
}

/// The parameters, or the same names as missing with the reason.
pub(super) fn or_missing(ids: &[GpuParameterId], measured: Result<Vec<Parameter>, String>) -> Vec<Parameter> {
    measured.unwrap_or_else(|why| {
        let why = one_line(&why);
        ids.iter().map(|id| Parameter::missing(id, &why)).collect()
    })
}

/// The first words of an error as one line: those of shaders are pages with drawings.
pub(super) fn one_line(text: &str) -> String {
    const MOST: usize = 240;
    let line = text.split_whitespace().collect::<Vec<_>>().join(" ");
    match line.char_indices().nth(MOST) {
        Some((end, _)) => format!("{} ...", line[..end].trim_end()),
        None => line,
    }
}

/// Seconds of work per second become billions with this: amounts a nanosecond.
pub(super) fn per_ns(amount: f64, time: Duration) -> f64 {
    // A clock that did not move yields infinity, which is no usable sample.
    amount / (time.as_secs_f64() * 1e9)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A device that takes 2 us to answer and 3 us for each piece of work.
    fn device(amount: u32) -> Result<Duration, String> {
        Ok(Duration::from_micros(2) + Duration::from_micros(3) * amount)
    }

    #[test]
    fn calibration_reaches_its_target() {
        let amount = calibrate(Duration::from_millis(5), u32::MAX, device).unwrap();
        let time = device(amount).unwrap();
        assert!((Duration::from_micros(3500)..Duration::from_millis(10)).contains(&time), "{amount}: {time:?}");
        assert_eq!(calibrate(Duration::from_micros(1), 100, device), Ok(1));
        assert_eq!(calibrate(Duration::from_secs(1), 100, device), Ok(100));
        assert_eq!(calibrate(Duration::from_secs(1), 0, device), Ok(1));
        assert!(calibrate(Duration::from_secs(1), 100, |_| Err("lost".to_owned())).is_err());
    }

    #[test]
    fn errors_fit_on_a_line() {
        assert_eq!(one_line("no\n\n  memory"), "no memory");
        assert_eq!(one_line(&"ä".repeat(1000)).chars().count(), 244);
    }

    #[test]
    fn calibration_ends_on_a_clock_that_stands_still() {
        assert_eq!(calibrate(Duration::from_secs(1), 1 << 20, |_| Ok(Duration::ZERO)), Ok(1 << 20));
    }
}
