//! The GPUs of this machine.

use super::Gpu;
use sapwise::error::{GpuError, GpuErrorKind};
use sapwise::internals::{GpuIdentity, GpuKind};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// GPUs that were found or that the program gave, in the order of their numbers. A GPU is opened once for all clones.
///
/// ```
/// use sapwise_gpu::Gpus;
///
/// for gpu in Gpus::find().identities() {
///     println!("gpu{}: {}", gpu.index, gpu.name);
/// }
/// ```
#[derive(Debug, Clone, Default)]
pub struct Gpus {
    found: Vec<Arc<Found>>,
}

#[derive(Debug)]
struct Found {
    identity: GpuIdentity,
    /// `None` for a GPU that the program opened itself.
    adapter: Option<wgpu::Adapter>,
    opened: Mutex<Option<Result<Gpu, GpuError>>>,
    /// `None` for the default.
    wait_limit: Mutex<Option<Duration>>,
}

impl Gpus {
    /// Finds GPUs. Loads the drivers of the system, which takes tens of milliseconds.
    ///
    /// The environment variables of drivers and wgpu apply (`VK_DRIVER_FILES`, `WGPU_BACKEND`, ...).
    pub fn find() -> Self {
        let adapters = pollster::block_on(adapters());
        let infos: Vec<wgpu::AdapterInfo> = adapters.iter().map(wgpu::Adapter::get_info).collect();
        let keep = |k: usize| {
            !infos[..k].iter().any(|b| same_card(&infos[k], b)) && !infos.iter().any(|b| twins(&infos[k], b))
        };
        let mut adapters: Vec<(wgpu::AdapterInfo, wgpu::Adapter)> =
            infos.iter().cloned().zip(adapters).enumerate().filter(|(k, _)| keep(*k)).map(|(_, found)| found).collect();
        adapters.sort_by_key(|(info, _)| kind(info.device_type));
        let found = adapters.into_iter().zip(0..);
        Self { found: found.map(|((info, adapter), k)| Found::new(identity(k, &info), Some(adapter), None)).collect() }
    }

    /// GPUs that the program opened itself, under the numbers of their identities. Algorithms work on its devices and
    /// queues. The first of two with the same number counts.
    ///
    /// ```no_run
    /// use sapwise::Registry;
    /// use sapwise::internals::GpuIdentity;
    /// use sapwise_gpu::{Gpu, Gpus, wgpu30 as wgpu};
    ///
    /// fn registry(device: &wgpu::Device, queue: &wgpu::Queue) -> Registry {
    ///     let identity = sapwise_gpu::identity(0, &device.adapter_info());
    ///     let mut registry = Registry::new();
    ///     sapwise_gpu::add_to(&mut registry, &Gpus::of([Gpu::from_parts(device.clone(), queue.clone(), identity)]));
    ///     registry
    /// }
    /// ```
    pub fn of(gpus: impl IntoIterator<Item = Gpu>) -> Self {
        let mut found: Vec<Arc<Found>> = Vec::new();
        for gpu in gpus {
            let identity = gpu.identity().clone();
            if !found.iter().any(|f| f.identity.index == identity.index) {
                found.push(Found::new(identity, None, Some(Ok(gpu))));
            }
        }
        found.sort_by_key(|f| f.identity.index);
        Self { found }
    }

    /// No GPU at all. Loads no driver.
    pub fn none() -> Self {
        Self::default()
    }

    /// Returns those that `wanted` accepts. They keep their numbers.
    ///
    /// ```
    /// # use sapwise::internals::GpuKind;
    /// # use sapwise_gpu::Gpus;
    /// let real = Gpus::find().choose(|gpu| gpu.kind != GpuKind::Software);
    /// ```
    pub fn choose(&self, wanted: impl Fn(&GpuIdentity) -> bool) -> Self {
        Self { found: self.found.iter().filter(|f| wanted(&f.identity)).cloned().collect() }
    }

    /// Sets the [wait limit](Gpu::set_wait_limit) of each of them, now if it is open or when it is opened.
    ///
    /// ```
    /// # use sapwise_gpu::Gpus;
    /// let gpus = Gpus::find();
    /// // A game goes on with the CPU if a driver does not answer.
    /// gpus.set_wait_limit(std::time::Duration::from_millis(500));
    /// ```
    pub fn set_wait_limit(&self, limit: Duration) {
        for found in &self.found {
            found.wait_limit.lock().unwrap_or_else(PoisonError::into_inner).replace(limit);
            // A GPU that is being opened reads the limit afterwards.
            if let Some(Ok(gpu)) = &*found.opened.lock().unwrap_or_else(PoisonError::into_inner) {
                gpu.set_wait_limit(limit);
            }
        }
    }

    fn found(&self, index: u32) -> Option<&Found> {
        self.found.iter().map(|f| &**f).find(|f| f.identity.index == index)
    }

    /// Returns the identity of each.
    pub fn identities(&self) -> impl ExactSizeIterator<Item = &GpuIdentity> {
        self.found.iter().map(|f| &f.identity)
    }

    /// Returns how many there are.
    pub fn len(&self) -> usize {
        self.found.len()
    }

    /// Returns whether there is none.
    pub fn is_empty(&self) -> bool {
        self.found.is_empty()
    }

    /// Returns the adapter with this number, for more than [`GpuIdentity`] has. `None` for a GPU that the program
    /// opened itself.
    pub fn adapter(&self, index: u32) -> Option<&wgpu::Adapter> {
        self.found(index)?.adapter.as_ref()
    }

    /// Opens a GPU, or returns it if it is open already.
    ///
    /// A GPU that was lost or could not be opened stays so; call [`find`](Self::find) again.
    ///
    /// # Errors
    /// [`GpuErrorKind::NotFound`] if there is no such GPU or its driver refuses.
    pub fn open(&self, index: u32) -> Result<Gpu, GpuError> {
        let Some(found) = self.found(index) else {
            let text = match self.len() {
                0 => "no GPU was found; install a Vulkan driver, or leave GPUs out".to_owned(),
                _ => {
                    let there: Vec<String> = self.identities().map(|g| format!("gpu{}", g.index)).collect();
                    format!("there is no gpu{index}, only {}; see `sapwise devices`", there.join(", "))
                }
            };
            return Err(GpuError::new(GpuErrorKind::NotFound, text));
        };
        // A driver that panics while the lock is held leaves the slot as it was.
        let mut slot = found.opened.lock().unwrap_or_else(PoisonError::into_inner);
        slot.get_or_insert_with(|| found.open()).clone()
    }

    /// Opens a GPU a second time, with a queue and memory of its own.
    ///
    /// # Errors
    /// As [`open`](Self::open), and for a GPU that the program opened itself.
    pub fn open_another(&self, index: u32) -> Result<Gpu, GpuError> {
        let none = || GpuError::new(GpuErrorKind::NotFound, format!("there is no gpu{index}"));
        self.found(index).ok_or_else(none)?.open()
    }
}

/// Returns the adapters that run compute shaders.
pub(super) async fn adapters() -> Vec<wgpu::Adapter> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle().with_env();
    descriptor.backends &= wgpu::Backends::PRIMARY;
    // Installed validation layers would check every call, in release builds too.
    descriptor.flags -= wgpu::InstanceFlags::VALIDATION | wgpu::InstanceFlags::DEBUG;
    let backends = descriptor.backends;
    let instance = wgpu::Instance::new(descriptor);
    let mut adapters = instance.enumerate_adapters(backends).await;
    adapters.retain(|a| a.get_downlevel_capabilities().flags.contains(wgpu::DownlevelFlags::COMPUTE_SHADERS));
    adapters
}

impl Found {
    fn new(identity: GpuIdentity, adapter: Option<wgpu::Adapter>, opened: Option<Result<Gpu, GpuError>>) -> Arc<Self> {
        Arc::new(Self { identity, adapter, opened: Mutex::new(opened), wait_limit: Mutex::default() })
    }

    fn open(&self) -> Result<Gpu, GpuError> {
        let Some(adapter) = &self.adapter else {
            let text = format!("gpu{} is the program's own device, which can't be opened again", self.identity.index);
            return Err(GpuError::new(GpuErrorKind::NotFound, text));
        };
        let gpu = pollster::block_on(Gpu::open(adapter, self.identity.clone()))?;
        if let Some(limit) = *self.wait_limit.lock().unwrap_or_else(PoisonError::into_inner) {
            gpu.set_wait_limit(limit);
        }
        Ok(gpu)
    }
}

/// Returns the identity of a GPU with this number, from what wgpu reports. An open device has it in
/// `wgpu::Device::adapter_info`.
pub fn identity(index: u32, info: &wgpu::AdapterInfo) -> GpuIdentity {
    GpuIdentity {
        index,
        name: info.name.clone(),
        device: format!("{:04x}:{:04x}", info.vendor, info.device),
        driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
        api: info.backend.to_str().to_owned(),
        kind: kind(info.device_type),
    }
}

/// Returns whether `a` is the DX12 adapter of a card that also has a Vulkan one, which is preferred.
fn twins(a: &wgpu::AdapterInfo, b: &wgpu::AdapterInfo) -> bool {
    a.backend == wgpu::Backend::Dx12
        && b.backend == wgpu::Backend::Vulkan
        && (a.vendor, a.device) == (b.vendor, b.device)
}

/// Returns whether two drivers show the same card. The first is taken.
fn same_card(a: &wgpu::AdapterInfo, b: &wgpu::AdapterInfo) -> bool {
    !a.device_pci_bus_id.is_empty()
        && (a.backend, &a.device_pci_bus_id, a.vendor, a.device)
            == (b.backend, &b.device_pci_bus_id, b.vendor, b.device)
}

fn kind(device_type: wgpu::DeviceType) -> GpuKind {
    match device_type {
        wgpu::DeviceType::DiscreteGpu => GpuKind::Discrete,
        wgpu::DeviceType::IntegratedGpu => GpuKind::Integrated,
        wgpu::DeviceType::VirtualGpu => GpuKind::Virtual,
        wgpu::DeviceType::Cpu => GpuKind::Software,
        wgpu::DeviceType::Other => GpuKind::Other,
    }
}

/// Opens the first GPU. `None` if there is none and `SAPWISE_REQUIRE_GPU` is not 1.
#[cfg(test)]
pub(crate) fn first_for_tests() -> Option<Gpu> {
    let opened = Gpus::find().open(0);
    assert!(opened.is_ok() || std::env::var_os("SAPWISE_REQUIRE_GPU").is_none_or(|v| v != "1"), "no GPU was found");
    opened.ok()
}
