//! Buffers on a GPU.

use super::Gpu;
use sapwise::error::{GpuError, GpuErrorKind};
use wgpu::util::DeviceExt;

/// A buffer that grows to the largest frame and never shrinks.
#[derive(Debug)]
pub(super) struct Storage {
    label: &'static str,
    usage: wgpu::BufferUsages,
    buffer: wgpu::Buffer,
    /// 0 after the GPU refused memory: the old buffer is destroyed.
    bytes: u64,
}

/// Bytes of the smallest buffer. No binding may be empty.
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

    /// Makes room for `bytes`. Returns whether the buffer was replaced; its content is lost then.
    ///
    /// # Errors
    /// The GPU is out of memory, or allows no buffer of this size.
    pub(super) fn ensure(&mut self, gpu: &Gpu, bytes: u64) -> Result<bool, GpuError> {
        if bytes <= self.bytes {
            return Ok(false);
        }
        // The old one goes first: there may be no memory for both.
        self.buffer.destroy();
        self.bytes = 0;
        self.replace(gpu, bytes)?;
        Ok(true)
    }

    /// Replaces the buffer by one of `bytes` and a quarter more. The old one lives on if someone else holds it.
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
        // A growing scene then replaces the buffer only a few times.
        let wanted = (bytes + bytes / 4).next_multiple_of(256).min(most);
        self.buffer =
            create(gpu, self.label, self.usage, wanted).or_else(|_| create(gpu, self.label, self.usage, bytes))?;
        self.bytes = self.buffer.size();
        Ok(())
    }
}

/// Returns the bytes of the largest buffer with this usage.
pub(super) fn largest(gpu: &Gpu, usage: wgpu::BufferUsages) -> u64 {
    let limits = gpu.limits();
    let binding =
        if usage.contains(wgpu::BufferUsages::STORAGE) { limits.max_storage_buffer_binding_size } else { u64::MAX };
    limits.max_buffer_size.min(binding) & !3
}

/// Creates a uniform buffer of four words.
pub(super) fn constant(gpu: &Gpu, label: &str, words: [u32; 4]) -> Result<wgpu::Buffer, GpuError> {
    gpu.try_make(|device| {
        device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some(label),
            contents: bytemuck::cast_slice(&words),
            usage: wgpu::BufferUsages::UNIFORM,
        })
    })
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
    fn a_refused_buffer_leaves_the_device_usable() {
        let Some(gpu) = crate::first_for_tests() else { return };
        // This usage needs a feature that no device is opened with. The device refuses it the way it refuses memory,
        // which a test can't fill up.
        let mut storage = Storage::new(&gpu, "trial").unwrap();
        let possible = storage.usage;
        storage.usage |= wgpu::BufferUsages::BLAS_INPUT;
        let error = storage.ensure(&gpu, 1 << 20).unwrap_err().to_string();
        assert!(error.contains("trial") && error.contains("gpu0"), "{error}");
        assert!(storage.ensure(&gpu, 1 << 62).unwrap_err().to_string().contains("more than"));
        assert_eq!(gpu.fault(), None);
        storage.usage = possible;
        assert_eq!(storage.ensure(&gpu, 100), Ok(true), "the old buffer is destroyed");
        assert_eq!(storage.ensure(&gpu, 100), Ok(false));
    }
}
