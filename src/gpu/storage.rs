//! Buffers on a GPU that grow and stay.

use super::device::Gpu;
use crate::algorithm::AlgorithmId;
use crate::error::{Error, GpuError, GpuErrorKind, Unavailable};

/// What a frame can fail with on a GPU, apart from what is wrong with the frame itself.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Failure {
    /// The GPU can't do it: lost, out of memory, beyond its limits.
    Gpu(GpuError),
    /// The frame is at fault, or the memory of the host.
    Frame(Error),
}

impl Failure {
    /// More than a GPU, or one submission to it, can take.
    pub(super) fn limit(text: impl Into<String>) -> Self {
        Self::Gpu(GpuError::new(GpuErrorKind::Limit, text))
    }

    /// The error of an algorithm.
    pub(super) fn of(self, algorithm: &AlgorithmId) -> Error {
        match self {
            Self::Frame(error) => error,
            Self::Gpu(error) => unavailable(algorithm, error),
        }
    }
}

/// An algorithm that a GPU can't run.
pub(super) fn unavailable(algorithm: &AlgorithmId, error: GpuError) -> Error {
    Error::Unavailable { algorithm: algorithm.clone(), reason: Unavailable::Gpu(error) }
}

impl From<GpuError> for Failure {
    fn from(error: GpuError) -> Self {
        Self::Gpu(error)
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Self::Frame(error)
    }
}

/// A buffer that grows to the largest frame seen and stays.
#[derive(Debug)]
pub(super) struct Storage {
    label: &'static str,
    usage: wgpu::BufferUsages,
    buffer: wgpu::Buffer,
    /// 0 after a refusal, when there is no memory behind the buffer.
    bytes: u64,
}

/// Bytes of the smallest buffer: no binding may be empty.
const SMALLEST: u64 = 256;

impl Storage {
    /// A buffer that kernels read and write, and that can be copied from and to.
    pub(super) fn new(gpu: &Gpu, label: &'static str) -> Result<Self, GpuError> {
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
        Self::with_usage(gpu, label, usage)
    }

    pub(super) fn with_usage(gpu: &Gpu, label: &'static str, usage: wgpu::BufferUsages) -> Result<Self, GpuError> {
        Ok(Self { label, usage, buffer: create(gpu, label, usage, SMALLEST)?, bytes: SMALLEST })
    }

    pub(super) fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }

    pub(super) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Makes room for `bytes`. Whether the buffer is another one now; its content is gone then.
    ///
    /// # Errors
    /// When the GPU has no such memory, or no buffer may be as large.
    pub(super) fn ensure(&mut self, gpu: &Gpu, bytes: u64) -> Result<bool, GpuError> {
        if bytes <= self.bytes {
            return Ok(false);
        }
        // The old one is given back first: there may be no room for both.
        self.buffer.destroy();
        self.bytes = 0;
        self.replace(gpu, bytes)?;
        Ok(true)
    }

    /// A buffer of `bytes` and a quarter more in place of this one, which stays with whoever holds it.
    ///
    /// # Errors
    /// As [`ensure`](Self::ensure).
    pub(super) fn replace(&mut self, gpu: &Gpu, bytes: u64) -> Result<(), GpuError> {
        let most = largest(gpu, self.usage);
        if bytes > most {
            let index = gpu.identity().index;
            let text = format!("{bytes} bytes for {} are more than the {most} that gpu{index} allows", self.label);
            return Err(GpuError::new(GpuErrorKind::Limit, text));
        }
        // A quarter more than asked for, so that a growing scene grows the buffer a few times in all.
        let wanted = (bytes + bytes / 4).next_multiple_of(256).min(most);
        self.buffer =
            create(gpu, self.label, self.usage, wanted).or_else(|_| create(gpu, self.label, self.usage, bytes))?;
        self.bytes = self.buffer.size();
        Ok(())
    }
}

/// Bytes of the largest buffer of a usage.
pub(super) fn largest(gpu: &Gpu, usage: wgpu::BufferUsages) -> u64 {
    let limits = gpu.limits();
    let binding =
        if usage.contains(wgpu::BufferUsages::STORAGE) { limits.max_storage_buffer_binding_size } else { u64::MAX };
    limits.max_buffer_size.min(binding) & !3
}

fn create(gpu: &Gpu, label: &'static str, usage: wgpu::BufferUsages, bytes: u64) -> Result<wgpu::Buffer, GpuError> {
    gpu.check()?;
    let descriptor = wgpu::BufferDescriptor {
        label: Some(label),
        size: bytes.next_multiple_of(4),
        usage,
        mapped_at_creation: false,
    };
    gpu.try_make(|device| device.create_buffer(&descriptor))
        .map_err(|e| e.of(format!("gpu{} has no memory of {bytes} bytes for {label}", gpu.identity().index)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_device_refuses_is_an_error_and_the_device_goes_on() {
        let Some(gpu) = crate::gpu::first_for_tests() else { return };
        // A device makes buffers of this usage with a feature only that none is opened with. A refusal of memory comes the same
        // way, and can't be had without filling the memory of the machine.
        let mut storage = Storage::new(&gpu, "trial").unwrap();
        let possible = storage.usage;
        storage.usage |= wgpu::BufferUsages::BLAS_INPUT;
        let error = storage.ensure(&gpu, 1 << 20).unwrap_err().to_string();
        assert!(error.contains("trial") && error.contains("gpu0"), "{error}");
        assert!(storage.ensure(&gpu, 1 << 62).unwrap_err().to_string().contains("more than"));
        assert_eq!(gpu.fault(), None);
        storage.usage = possible;
        assert_eq!(storage.ensure(&gpu, 100), Ok(true), "the buffer before was given back");
        assert_eq!(storage.ensure(&gpu, 100), Ok(false));
    }
}
