//! An open GPU: device, queue, limits, and what went wrong with it.

use crate::error::{GpuError, GpuErrorKind};
use crate::hardware::GpuIdentity;
use std::fmt;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// The longest that a submission may take before its GPU counts as lost, unless it is set otherwise. Drivers of desktops give up after 2 to 10 s; a
/// software adapter may be a thousand times slower than a real one.
const WAIT_LIMIT: Duration = Duration::from_secs(60);

/// An open GPU. Clones share it.
#[derive(Clone)]
pub struct Gpu {
    shared: Arc<Shared>,
}

struct Shared {
    identity: GpuIdentity,
    device: wgpu::Device,
    queue: wgpu::Queue,
    limits: wgpu::Limits,
    /// Errors that no scope caught, and the loss of the device.
    fault: Arc<Mutex<Option<String>>>,
    wait_limit_ms: AtomicU64,
}

impl Gpu {
    /// Opens an adapter with all of its limits.
    pub(super) fn open(adapter: &wgpu::Adapter, identity: GpuIdentity) -> Result<Self, GpuError> {
        let limits = adapter.limits();
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("sapwise"),
            // Only to observe how many lanes run in lockstep: no algorithm depends on it.
            required_features: adapter.features() & wgpu::Features::SUBGROUP,
            required_limits: limits.clone(),
            memory_hints: wgpu::MemoryHints::Performance,
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|e| GpuError::caused(GpuErrorKind::NotFound, format!("gpu{} can't be opened", identity.index), e))?;
        Ok(Self::from_parts(device, queue, identity))
    }

    /// A device and queue that the caller has opened, so that a program that draws with wgpu shares them.
    ///
    /// Takes over the device's handlers of lost devices and uncaught errors.
    #[must_use]
    pub fn from_parts(device: wgpu::Device, queue: wgpu::Queue, identity: GpuIdentity) -> Self {
        let fault: Arc<Mutex<Option<String>>> = Arc::default();
        let note = |fault: &Arc<Mutex<Option<String>>>| {
            let fault = Arc::clone(fault);
            move |text: String| {
                fault.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(text);
            }
        };
        let (lost, uncaught) = (note(&fault), note(&fault));
        device.set_device_lost_callback(move |reason, message| lost(format!("the device was lost ({reason:?}): {message}")));
        // The default handler panics.
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| uncaught(error.to_string())));
        let limits = device.limits();
        let wait_limit_ms = AtomicU64::new(WAIT_LIMIT.as_millis() as u64);
        Self { shared: Arc::new(Shared { identity, device, queue, limits, fault, wait_limit_ms }) }
    }

    pub(super) fn wait_limit(&self) -> Duration {
        Duration::from_millis(self.shared.wait_limit_ms.load(Ordering::Relaxed))
    }

    /// Submits, and returns what the device has against it. Without the scope it would count as a fault of the GPU.
    pub(super) fn submit(&self, encoder: wgpu::CommandEncoder) -> Result<wgpu::SubmissionIndex, GpuError> {
        self.check()?;
        self.try_make(|_| self.shared.queue.submit([encoder.finish()]))
    }

    /// Sets the longest that a submission may take before this GPU counts as lost: a minute unless it is set, which is long for a
    /// game. Below a millisecond it is one.
    pub fn set_wait_limit(&self, limit: Duration) {
        let ms = u64::try_from(limit.as_millis()).unwrap_or(u64::MAX);
        self.shared.wait_limit_ms.store(ms.max(1), Ordering::Relaxed);
    }

    /// What the GPU says of itself.
    #[must_use]
    pub fn identity(&self) -> &GpuIdentity {
        &self.shared.identity
    }

    /// The device.
    #[must_use]
    pub fn device(&self) -> &wgpu::Device {
        &self.shared.device
    }

    /// The queue.
    #[must_use]
    pub fn queue(&self) -> &wgpu::Queue {
        &self.shared.queue
    }

    /// The limits that the device was opened with.
    #[must_use]
    pub fn limits(&self) -> &wgpu::Limits {
        &self.shared.limits
    }

    /// Why the GPU can't be used any more, if it can't: it was lost, or an error came that nobody expected.
    #[must_use]
    pub fn fault(&self) -> Option<String> {
        self.shared.fault.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Waits for a submission, at most as long as the [limit](Self::set_wait_limit), and calls back what was mapped before it.
    ///
    /// # Errors
    /// [`GpuErrorKind::Lost`], when the device was lost or takes too long. It counts as lost from then on.
    pub fn wait(&self, submission: wgpu::SubmissionIndex) -> Result<(), GpuError> {
        self.wait_for(Some(submission))
    }

    /// As [`wait`](Self::wait), for everything that was submitted.
    ///
    /// # Errors
    /// As [`wait`](Self::wait).
    pub fn wait_all(&self) -> Result<(), GpuError> {
        self.wait_for(None)
    }

    fn wait_for(&self, submission_index: Option<wgpu::SubmissionIndex>) -> Result<(), GpuError> {
        let limit = self.wait_limit();
        let poll = wgpu::PollType::Wait { submission_index, timeout: Some(limit) };
        if let Err(error) = self.shared.device.poll(poll) {
            let text = match error {
                wgpu::PollError::Timeout => {
                    // Dropping the queue waits for it without a limit. A GPU that hangs is therefore never dropped.
                    std::mem::forget(self.clone());
                    format!("it did not answer within {} ms", limit.as_millis())
                }
                other => other.to_string(),
            };
            self.shared.fault.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(text);
        }
        self.check()
    }

    /// `Err` once the GPU can't be used any more.
    ///
    /// # Errors
    /// [`GpuErrorKind::Lost`] says what happened.
    pub fn check(&self) -> Result<(), GpuError> {
        self.fault().map_or(Ok(()), |text| Err(GpuError::new(GpuErrorKind::Lost, text)))
    }

    /// Runs `make` and returns what it made, or the error of the device: out of memory, invalid, internal.
    ///
    /// # Errors
    /// [`GpuErrorKind::Refused`], with the error of the device as its source.
    pub fn try_make<T>(&self, make: impl FnOnce(&wgpu::Device) -> T) -> Result<T, GpuError> {
        let device = &self.shared.device;
        let filters = [wgpu::ErrorFilter::Internal, wgpu::ErrorFilter::OutOfMemory, wgpu::ErrorFilter::Validation];
        let scopes = filters.map(|filter| device.push_error_scope(filter));
        let made = make(device);
        let mut error = None;
        // Scopes end in the reverse of the order in which they began.
        for scope in scopes.into_iter().rev() {
            error = pollster::block_on(scope.pop()).or(error);
        }
        error.map_or(Ok(made), |e| Err(GpuError::caused(GpuErrorKind::Refused, "the device refuses", e)))
    }
}

impl fmt::Debug for Gpu {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Gpu").field("identity", &self.shared.identity).field("fault", &self.fault()).finish_non_exhaustive()
    }
}
