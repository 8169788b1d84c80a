//! An open GPU: device, queue, limits, and what went wrong with it.

use super::scope::Scope;
use super::watch::Watch;
use super::{Late, Place, Recording};
use sapwise::error::{GpuError, GpuErrorKind};
use sapwise::internals::GpuIdentity;
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

/// Default time after which a GPU that does not answer counts as lost. Drivers of desktops give up after 2 to 10 s; a
/// software adapter may be a thousand times slower than a real one.
const WAIT_LIMIT: Duration = Duration::from_secs(60);

/// An open GPU. Clones share it.
///
/// ```
/// use sapwise_gpu::Gpus;
///
/// let gpus = Gpus::find();
/// if !gpus.is_empty() {
///     let gpu = gpus.open(0)?;
///     gpu.check()?; // whether it can still be used
///     println!("{} bytes in a buffer", gpu.limits().max_buffer_size);
/// }
/// # Ok::<(), sapwise_gpu::GpuError>(())
/// ```
#[derive(Clone)]
pub struct Gpu {
    shared: Arc<Shared>,
}

struct Shared {
    identity: GpuIdentity,
    device: wgpu::Device,
    queue: wgpu::Queue,
    limits: wgpu::Limits,
    /// Why it can no longer be used.
    fault: Fault,
    wait_limit_ms: AtomicU64,
    watch: OnceLock<Watch>,
    late: Late,
}

/// Set once: the first fault stays.
type Fault = Arc<Mutex<Option<GpuError>>>;

fn note(fault: &Fault, error: GpuError) {
    fault.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
}

impl Gpu {
    /// Opens an adapter with all its limits.
    pub(super) async fn open(adapter: &wgpu::Adapter, identity: GpuIdentity) -> Result<Self, GpuError> {
        let limits = adapter.limits();
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("sapwise"),
            // Only to measure how many lanes run in lockstep: no algorithm depends on it.
            required_features: adapter.features() & wgpu::Features::SUBGROUP,
            required_limits: limits.clone(),
            memory_hints: wgpu::MemoryHints::Performance,
            ..Default::default()
        };
        let (device, queue) = adapter.request_device(&descriptor).await.map_err(|e| {
            GpuError::caused(GpuErrorKind::NotFound, format!("gpu{} can't be opened", identity.index), e)
        })?;
        let gpu = Self::from_parts(device, queue, identity);
        gpu.listen();
        Ok(gpu)
    }

    /// A device and queue that the program opened, for example to draw with.
    ///
    /// The program's handlers for lost devices and uncaught errors stay in place, and never see an error of ours. We
    /// notice a lost device when it takes no more work.
    pub fn from_parts(device: wgpu::Device, queue: wgpu::Queue, identity: GpuIdentity) -> Self {
        let limits = device.limits();
        let wait_limit_ms = AtomicU64::new(WAIT_LIMIT.as_millis() as u64);
        let (fault, watch, late) = (Fault::default(), OnceLock::new(), Late::default());
        Self { shared: Arc::new(Shared { identity, device, queue, limits, fault, wait_limit_ms, watch, late }) }
    }

    /// Sets the handlers of a device that we opened ourselves, so that a loss is known before the next frame.
    fn listen(&self) {
        let (lost, uncaught) = (Arc::clone(&self.shared.fault), Arc::clone(&self.shared.fault));
        self.shared.device.set_device_lost_callback(move |reason, message| {
            let text = format!("the device was lost ({reason:?}): {message}");
            note(&lost, GpuError::new(GpuErrorKind::Lost, text));
        });
        // The default handler panics.
        self.shared.device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            note(&uncaught, GpuError::new(GpuErrorKind::Lost, error.to_string()));
        }));
    }

    pub(super) fn wait_limit(&self) -> Duration {
        Duration::from_millis(self.shared.wait_limit_ms.load(Ordering::Relaxed))
    }

    /// Sets what sees every part of the frames on this GPU, for benchmarks. Only the first counts.
    #[doc(hidden)]
    pub fn watch(&self, watch: Watch) {
        let _ = self.shared.watch.set(watch);
    }

    /// Tells the watch, if there is one, that a part of a frame ends here.
    pub(super) fn ends(&self, part: &'static str, place: Place<'_, '_>) {
        if let Some(watch) = self.shared.watch.get() {
            watch(part, place);
        }
    }

    /// Begins to record commands. Errors of other calls, until the commands are submitted, count as theirs.
    #[doc(hidden)]
    pub fn record(&self) -> Recording {
        let mut recording = Recording::new(&self.shared.device);
        self.ends("before", Place::Commands(&mut recording));
        recording
    }

    /// Submits what was recorded.
    ///
    /// # Errors
    /// The device refuses it, or was lost.
    #[doc(hidden)]
    pub fn submit(&self, mut recording: Recording) -> Result<wgpu::SubmissionIndex, GpuError> {
        self.check()?;
        self.ends("copies after", Place::Commands(&mut recording));
        let submission = recording.submit(&self.shared.queue, &self.shared.late);
        let submission = submission.map_err(|e| self.refusal("the device refuses", e));
        self.ends("submitting", Place::Host);
        submission
    }

    /// Asks the device to map a part of a buffer. Only `done` gets the result.
    #[doc(hidden)]
    pub fn map(
        &self,
        slice: wgpu::BufferSlice<'_>,
        mode: wgpu::MapMode,
        done: impl FnOnce(Result<(), wgpu::BufferAsyncError>) + Send + 'static,
    ) {
        let _scope = Scope::of_one(&self.shared.device, wgpu::ErrorFilter::Validation);
        slice.map_async(mode, done);
    }

    /// Unmaps a buffer. If the device was lost this fails, and the next submission reports it.
    #[doc(hidden)]
    pub fn unmap(&self, buffer: &wgpu::Buffer) {
        let _scope = Scope::of_one(&self.shared.device, wgpu::ErrorFilter::Validation);
        buffer.unmap();
    }

    /// Returns the error of a device that refuses; if it was lost, that instead, because its other errors follow from
    /// it.
    pub(super) fn refusal(&self, text: &str, source: impl std::error::Error + Send + Sync + 'static) -> GpuError {
        let refused = GpuError::caused(GpuErrorKind::Refused, text, source);
        self.check().err().or_else(|| self.probe().err()).unwrap_or(refused)
    }

    /// Checks that the device still takes work. A lost device does not report it: it returns handles to nothing.
    pub(super) fn probe(&self) -> Result<(), GpuError> {
        let scope = Scope::new(&self.shared.device);
        let submission = self.shared.queue.submit([]);
        drop(scope);
        let polled =
            self.poll(wgpu::PollType::Wait { submission_index: Some(submission), timeout: Some(Duration::ZERO) });
        match polled {
            Err(wgpu::PollError::WrongSubmissionIndex(..)) => note(&self.shared.fault, lost()),
            // It takes work.
            Ok(_) | Err(wgpu::PollError::Timeout) => {}
        }
        self.check()
    }

    /// Sets the time after which this GPU counts as lost if it does not answer. Default: a minute, which is long for
    /// a game; at least a millisecond. [`Gpus::set_wait_limit`](super::Gpus::set_wait_limit) sets it for GPUs that
    /// are not open yet.
    pub fn set_wait_limit(&self, limit: Duration) {
        let ms = u64::try_from(limit.as_millis()).unwrap_or(u64::MAX);
        self.shared.wait_limit_ms.store(ms.max(1), Ordering::Relaxed);
    }

    /// Returns the identity of the GPU.
    pub fn identity(&self) -> &GpuIdentity {
        &self.shared.identity
    }

    /// Returns the device.
    pub fn device(&self) -> &wgpu::Device {
        &self.shared.device
    }

    /// Returns the queue.
    pub fn queue(&self) -> &wgpu::Queue {
        &self.shared.queue
    }

    /// Returns the limits with which the device was opened.
    pub fn limits(&self) -> &wgpu::Limits {
        &self.shared.limits
    }

    /// Returns why the GPU can no longer be used: it was lost, or an unexpected error came. `None` if it can.
    pub fn fault(&self) -> Option<String> {
        self.error().map(|error| error.to_string())
    }

    fn error(&self) -> Option<GpuError> {
        self.shared.fault.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Marks the GPU as one that executes nothing, and returns why it can no longer be used: this, or an earlier
    /// fault.
    #[doc(hidden)]
    pub fn inert(&self) -> GpuError {
        let GpuIdentity { index, name, .. } = self.identity();
        let text = format!(
            "gpu{index} ({name}) executes nothing: its driver reports work as done, but no kernel ran; \
             update the driver, restart the machine or leave this GPU out"
        );
        // Dropping the queue asserts that all its work is done.
        std::mem::forget(self.clone());
        let error = GpuError::new(GpuErrorKind::Inert, text);
        note(&self.shared.fault, error.clone());
        self.error().unwrap_or(error)
    }

    /// Waits for a submission, at most as long as the [limit](Self::set_wait_limit), and runs the callbacks of
    /// finished mappings. In a browser, where nothing may wait, it does neither.
    ///
    /// # Errors
    /// [`GpuErrorKind::Lost`] if the device was lost or takes too long. It counts as lost from then on.
    pub fn wait(&self, submission: wgpu::SubmissionIndex) -> Result<(), GpuError> {
        self.wait_for(Some(submission))
    }

    /// Waits for everything that was submitted, as [`wait`](Self::wait) does.
    ///
    /// # Errors
    /// As [`wait`](Self::wait).
    pub fn wait_all(&self) -> Result<(), GpuError> {
        self.wait_for(None)
    }

    /// Waits for the browser's errors about all calls.
    #[cfg(target_family = "wasm")]
    pub(super) async fn settle(&self) -> Result<(), GpuError> {
        if let Some(error) = self.shared.late.settle().await {
            // Nobody knows any more which call it was, so the device can't be relied on.
            note(&self.shared.fault, GpuError::caused(GpuErrorKind::Refused, "the device refuses", error));
        }
        self.check()
    }

    pub(super) fn wait_for(&self, submission_index: Option<wgpu::SubmissionIndex>) -> Result<(), GpuError> {
        if cfg!(target_family = "wasm") {
            return self.check();
        }
        let limit = self.wait_limit();
        let began = Instant::now();
        match self.poll(wgpu::PollType::Wait { submission_index, timeout: Some(limit) }) {
            Ok(_) => {}
            // The driver reports a timeout without having waited.
            Err(wgpu::PollError::Timeout) if began.elapsed() < limit / 2 => drop(self.inert()),
            Err(wgpu::PollError::Timeout) => {
                // Dropping the queue would wait without a limit, so a GPU that hangs is never dropped.
                std::mem::forget(self.clone());
                let text = format!("it did not answer within {} ms", limit.as_millis());
                note(&self.shared.fault, GpuError::new(GpuErrorKind::Lost, text));
            }
            // The device does not know a submission that it took.
            Err(wgpu::PollError::WrongSubmissionIndex(..)) => note(&self.shared.fault, lost()),
        }
        self.check()
    }

    /// Polls the device. A loss during the poll becomes the GPU's fault.
    pub(super) fn poll(&self, poll: wgpu::PollType) -> Result<wgpu::PollStatus, wgpu::PollError> {
        // wgpu 30 panics if the driver reports a lost device, and if a wait ends before the work is done.
        catch_unwind(AssertUnwindSafe(|| self.shared.device.poll(poll))).unwrap_or_else(|panic| {
            match fault_by_panic(&*panic) {
                Some(GpuErrorKind::Lost) => note(&self.shared.fault, lost()),
                Some(_) => drop(self.inert()),
                // The program's own callback, which our wait ran.
                None => resume_unwind(panic),
            }
            Ok(wgpu::PollStatus::Poll)
        })
    }

    /// Returns the first words of a buffer that can be copied from, for tests and benchmarks. No watch sees it.
    ///
    /// # Errors
    /// The device refuses the memory, or was lost.
    #[doc(hidden)]
    pub fn read_words(&self, from: &wgpu::Buffer, count: u64) -> Result<Vec<u32>, GpuError> {
        if count == 0 {
            return Ok(Vec::new());
        }
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        let descriptor = wgpu::BufferDescriptor { label: None, size: 4 * count, usage, mapped_at_creation: false };
        let copy = self.try_make(|device| device.create_buffer(&descriptor))?;
        let mut encoder = self.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(from, 0, &copy, 0, 4 * count);
        let submission = self.queue().submit([encoder.finish()]);
        copy.map_async(wgpu::MapMode::Read, .., |_| {});
        self.wait(submission)?;
        let view = copy.get_mapped_range(..).map_err(|e| self.refusal("the device maps no memory", e))?;
        Ok(bytemuck::cast_slice(&view).to_vec())
    }

    /// Checks that the GPU can still be used.
    ///
    /// # Errors
    /// [`GpuErrorKind::Lost`] or [`GpuErrorKind::Inert`].
    pub fn check(&self) -> Result<(), GpuError> {
        self.error().map_or(Ok(()), Err)
    }

    /// Runs `make` and returns what it made.
    ///
    /// # Errors
    /// [`GpuErrorKind::Refused`], with the device's error as its source: out of memory, invalid or internal.
    pub fn try_make<T>(&self, make: impl FnOnce(&wgpu::Device) -> T) -> Result<T, GpuError> {
        let scope = Scope::new(&self.shared.device);
        let made = make(&self.shared.device);
        scope.end(&self.shared.late).map_err(|e| self.refusal("the device refuses", e)).map(|()| made)
    }
}

fn lost() -> GpuError {
    GpuError::new(GpuErrorKind::Lost, "the device was lost: it takes no more work")
}

/// Returns the fault of a device that made wgpu panic; `None` for another panic.
fn fault_by_panic(panic: &(dyn std::any::Any + Send)) -> Option<GpuErrorKind> {
    let text = panic.downcast_ref::<String>()?;
    if text.starts_with("Error in Device::poll: ") {
        Some(GpuErrorKind::Lost)
    } else if text.starts_with("If the queue is empty, the current submission index") {
        Some(GpuErrorKind::Inert)
    } else {
        None
    }
}

impl fmt::Debug for Gpu {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Gpu")
            .field("identity", &self.shared.identity)
            .field("fault", &self.fault())
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::{GpuErrorKind, fault_by_panic};
    use std::any::Any;

    #[test]
    fn panics_of_wgpu_are_faults_and_others_are_not() {
        let text = |text: &str| fault_by_panic(&*(Box::new(text.to_owned()) as Box<dyn Any + Send>));
        // The texts of `CoreDevice::poll` and `Device::maintain` in wgpu 30.
        assert_eq!(text("Error in Device::poll:   Parent device is lost\n"), Some(GpuErrorKind::Lost));
        let done =
            "If the queue is empty, the current submission index (0) should be at least the wait submission index (1)";
        assert_eq!(text(done), Some(GpuErrorKind::Inert));
        assert_eq!(text("the program's own"), None);
        assert_eq!(fault_by_panic(&*(Box::new("a literal") as Box<dyn Any + Send>)), None);
    }
}
