//! Buffers that both the CPU and a GPU reach: mapped once, used every frame.

use super::{Gpu, Storage};
use sapwise::error::GpuError;
use sapwise::internals::Workers;
use std::iter;
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::task::Waker;
use std::time::{Duration, Instant};

/// A buffer that the CPU writes or reads while it is mapped, and the GPU copies while it is not.
#[derive(Debug)]
pub(super) struct Transfer {
    storage: Storage,
    mode: wgpu::MapMode,
    mapping: Arc<Mapping>,
}

/// State of a mapping.
#[derive(Debug, Default)]
struct Mapping {
    /// One of the constants below. The device sets it when the mapping is done.
    state: AtomicU8,
    /// The task that waits in a browser, which may not block.
    waiting: Mutex<Option<Waker>>,
}

impl Mapping {
    fn state(&self) -> u8 {
        self.state.load(Ordering::Acquire)
    }

    fn end(&self, mapped: bool) {
        self.state.store(if mapped { MAPPED } else { UNMAPPED }, Ordering::Release);
        if let Some(waker) = self.waiting.lock().unwrap_or_else(PoisonError::into_inner).take() {
            waker.wake();
        }
    }

    /// Waits until it is done.
    #[cfg(target_family = "wasm")]
    async fn ended(&self) {
        std::future::poll_fn(|context| {
            *self.waiting.lock().unwrap_or_else(PoisonError::into_inner) = Some(context.waker().clone());
            if self.state() == ASKED { std::task::Poll::Pending } else { std::task::Poll::Ready(()) }
        })
        .await;
    }
}

const UNMAPPED: u8 = 0;
const ASKED: u8 = 1;
const MAPPED: u8 = 2;

/// Message of a failed mapping. A browser may refuse one before it reports that the device was lost.
const NOT_MAPPED: &str = "the driver refuses to map memory; the device may be lost";

/// Bytes that a worker copies at once.
const COPIED: usize = 64 << 10;

/// Copies to mapped memory, with several threads if there is much, of which one does `beside`: on an NVIDIA H200 one
/// thread writes 15 GB/s over the bus, and four write 32.
pub(super) fn copy(bytes: &[u8], to: wgpu::WriteOnly<'_, [u8]>, workers: &Workers, beside: impl Fn() + Sync) {
    let (chunks, mut rest) = to.into_chunks::<COPIED>();
    // Only chunks of a fixed size may change threads.
    let chunks: Vec<_> = chunks.into_iter().collect();
    let (all, last) = bytes.split_at(chunks.len() * COPIED);
    let copies = chunks.into_iter().zip(all.chunks(COPIED)).map(Some);
    workers.each_of(iter::once(None).chain(copies), |task| match task {
        None => beside(),
        Some((to, from)) => wgpu::WriteOnly::<[u8]>::from(to).copy_from_slice(from),
    });
    rest.copy_from_slice(last);
}

impl Transfer {
    /// Memory that the CPU writes.
    pub(super) fn upload(gpu: &Gpu) -> Result<Self, GpuError> {
        Self::new(gpu, "upload", wgpu::BufferUsages::MAP_WRITE | wgpu::BufferUsages::COPY_SRC, wgpu::MapMode::Write)
    }

    /// Memory that the CPU reads.
    pub(super) fn download(gpu: &Gpu) -> Result<Self, GpuError> {
        Self::new(gpu, "download", wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST, wgpu::MapMode::Read)
    }

    fn new(gpu: &Gpu, label: &'static str, usage: wgpu::BufferUsages, mode: wgpu::MapMode) -> Result<Self, GpuError> {
        Ok(Self { storage: Storage::with_usage(gpu, label, usage)?, mode, mapping: Arc::default() })
    }

    pub(super) fn buffer(&self) -> &wgpu::Buffer {
        self.storage.buffer()
    }

    pub(super) fn bytes(&self) -> u64 {
        self.storage.bytes()
    }

    pub(super) fn ensure(&mut self, gpu: &Gpu, bytes: u64) -> Result<(), GpuError> {
        if bytes > self.storage.bytes() {
            // The old buffer's callback must not change the new buffer's state.
            self.mapping = Arc::default();
            self.storage.ensure(gpu, bytes)?;
        }
        Ok(())
    }

    /// Asks the device to map the first `bytes` as soon as the GPU is done with them.
    pub(super) fn ask(&self, gpu: &Gpu, bytes: u64) {
        if self.mapping.state.compare_exchange(UNMAPPED, ASKED, Ordering::AcqRel, Ordering::Acquire).is_ok() {
            let mapping = Arc::clone(&self.mapping);
            let done = move |result: Result<(), wgpu::BufferAsyncError>| mapping.end(result.is_ok());
            gpu.map(self.storage.buffer().slice(0..bytes.next_multiple_of(8).min(self.bytes())), self.mode, done);
        }
    }

    /// Returns the mapped memory to write to. Waits for the mapping unless it was asked for ahead.
    pub(super) async fn writable(&self, gpu: &Gpu, bytes: u64) -> Result<wgpu::BufferViewMut, GpuError> {
        if self.mapping.state() != MAPPED {
            self.ask(gpu, self.bytes());
            self.wait(gpu, None).await?;
        }
        self.mapped(gpu)?;
        self.storage.buffer().get_mapped_range_mut(0..bytes).map_err(|e| gpu.refusal(NOT_MAPPED, e))
    }

    /// Returns the mapped memory to read from.
    pub(super) fn readable(&self, gpu: &Gpu, bytes: std::ops::Range<u64>) -> Result<wgpu::BufferView, GpuError> {
        self.mapped(gpu)?;
        self.storage.buffer().get_mapped_range(bytes).map_err(|e| gpu.refusal(NOT_MAPPED, e))
    }

    /// Waits until the mapping that was asked for is done, which is after `submission`, or after all of them.
    pub(super) async fn wait(&self, gpu: &Gpu, submission: Option<wgpu::SubmissionIndex>) -> Result<(), GpuError> {
        #[cfg(target_family = "wasm")]
        {
            let _ = submission;
            self.mapping.ended().await;
            gpu.settle().await
        }
        #[cfg(not(target_family = "wasm"))]
        gpu.wait_for(submission)
    }

    /// Checks that the mapping is done, after a wait for the GPU. If several threads wait for one GPU, another one
    /// may have taken this mapping's callback and be about to run it.
    fn mapped(&self, gpu: &Gpu) -> Result<(), GpuError> {
        let mapped = self.arrives_within(gpu, gpu.wait_limit())?;
        if mapped { Ok(()) } else { Err(gpu.refusal(NOT_MAPPED, wgpu::BufferAsyncError)) }
    }

    /// Polls the device until the memory is mapped or time runs out, and returns whether it is mapped. Does not poll
    /// in a browser, which maps only when nothing runs.
    pub(super) fn arrives_within(&self, gpu: &Gpu, limit: Duration) -> Result<bool, GpuError> {
        if cfg!(not(target_family = "wasm")) {
            let start = Instant::now();
            while self.is_on_its_way() && start.elapsed() < limit {
                self.arrived(gpu)?;
                std::thread::yield_now();
            }
        }
        Ok(self.mapping.state() == MAPPED)
    }

    /// Polls the device once, and returns whether the memory is mapped.
    pub(super) fn arrived(&self, gpu: &Gpu) -> Result<bool, GpuError> {
        gpu.poll(wgpu::PollType::Poll).map_err(|e| gpu.refusal(NOT_MAPPED, e))?;
        gpu.check()?;
        Ok(self.mapping.state() == MAPPED)
    }

    /// Returns whether a mapping was asked for and has neither arrived nor failed.
    pub(super) fn is_on_its_way(&self) -> bool {
        self.mapping.state() == ASKED
    }

    /// Hands the memory back to the GPU.
    pub(super) fn unmap(&mut self) {
        if self.mapping.state() != UNMAPPED {
            // A late callback of this mapping must not pass for one of the next.
            self.mapping = Arc::default();
            self.storage.buffer().unmap();
        }
    }
}
