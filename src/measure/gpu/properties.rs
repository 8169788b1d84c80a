//! What a GPU, its driver and the system tell: clock, processors, memory and limits.

use std::time::{Duration, Instant};

use super::bench::{Bench, one_line};
use super::compute::Arithmetic;
use super::nvml::{self, Nvml};
use super::raw::Raw;
use super::sysfs::Sysfs;
use crate::hardware::{GpuKind, GpuParameterId, Parameter};

const SUBGROUP_SOURCE: &str = include_str!("shaders/subgroup.wgsl");

const NVIDIA: u32 = 0x10de;
const INTEL: u32 = 0x8086;
const APPLE: u32 = 0x106b;

pub(super) fn measure(bench: &Bench<'_>, raw: &Raw, executes: bool) -> Vec<Parameter> {
    let info = bench.gpu.device().adapter_info();
    let (nvml, sysfs, clock) = if bench.is_software() || !executes { (None, None, None) } else { ask(bench, &info) };
    let mut parameters = limits(bench);
    parameters.push(memory(bench, raw, nvml.as_ref(), sysfs.as_ref()));
    parameters.push(clock_parameter(bench, &info, nvml.as_ref(), clock));
    parameters.extend(processors(bench, &info, raw, nvml.as_ref(), sysfs.as_ref()));
    parameters.push(subgroup(bench, &info, raw, executes));
    parameters.push(unified(bench, raw));
    parameters.extend(heaps(bench, raw));
    parameters
}

/// Asks NVML or sysfs, with the GPU at work while its clock is read.
fn ask(bench: &Bench<'_>, info: &wgpu::AdapterInfo) -> (Option<Nvml>, Option<Sysfs>, Option<(f64, &'static str)>) {
    let load = Load::new(bench);
    let mut submission = None;
    let mut start = || submission = load.as_ref().and_then(|load| load.start(bench));
    let answer = if info.vendor == NVIDIA {
        (Some(nvml::query(&info.device_pci_bus_id, start)), None, None)
    } else {
        let sysfs = Sysfs::find(&info.device_pci_bus_id, info.vendor, info.device);
        // The highest of a few: the clock rises while the work runs.
        let clock = sysfs.as_ref().and_then(|sysfs| {
            start();
            let began = Instant::now();
            let mut highest = sysfs.clock_ghz();
            while highest.is_some() && began.elapsed() < LOAD {
                std::thread::sleep(Duration::from_millis(2));
                highest = highest.into_iter().chain(sysfs.clock_ghz()).max_by(|a, b| a.0.total_cmp(&b.0));
            }
            highest
        });
        (None, sysfs, clock)
    };
    if let Some(submission) = submission {
        // A failure shows in what is measured next.
        let _ = bench.gpu.wait(submission);
    }
    answer
}

/// How long the GPU works while its clock is read.
const LOAD: Duration = Duration::from_millis(24);

/// Work for about [`LOAD`].
struct Load {
    work: Arithmetic,
    rounds: u32,
}

impl Load {
    fn new(bench: &Bench<'_>) -> Option<Self> {
        let work = Arithmetic::new(bench).ok()?;
        let rounds = work.calibrate(bench, LOAD / 8).ok()?;
        Some(Self { work, rounds })
    }

    fn start(&self, bench: &Bench<'_>) -> Option<wgpu::SubmissionIndex> {
        let bound = self.work.bind(bench, self.rounds).ok()?;
        self.work.submit(bench, &bound, 8).ok()
    }
}

fn limits(bench: &Bench<'_>) -> Vec<Parameter> {
    let limits = bench.gpu.limits();
    let told = |id: GpuParameterId, value: u64, limit: &str| {
        Parameter::reported(id, value as f64, &format!("wgpu limit {limit}"))
    };
    vec![
        told(
            GpuParameterId::WorkgroupInvocations,
            limits.max_compute_invocations_per_workgroup.into(),
            "max_compute_invocations_per_workgroup",
        ),
        told(
            GpuParameterId::WorkgroupMemoryBytes,
            limits.max_compute_workgroup_storage_size.into(),
            "max_compute_workgroup_storage_size",
        ),
        told(GpuParameterId::BindingBytes, limits.max_storage_buffer_binding_size, "max_storage_buffer_binding_size"),
        told(GpuParameterId::BufferBytes, limits.max_buffer_size, "max_buffer_size"),
    ]
}

fn memory(bench: &Bench<'_>, raw: &Raw, nvml: Option<&Nvml>, sysfs: Option<&Sysfs>) -> Parameter {
    let name = GpuParameterId::MemoryBytes;
    if let Some(bytes) = nvml.and_then(|nvml| nvml.memory_bytes.as_ref().ok()) {
        return Parameter::reported(name, *bytes as f64, "NVML");
    }
    // An integrated AMD GPU lists only its carve-out here, and uses much more of the machine's memory.
    let is_card = bench.gpu.identity().kind == GpuKind::Discrete;
    if let Some(bytes) = sysfs.filter(|_| is_card).and_then(Sysfs::memory_bytes) {
        return Parameter::reported(name, bytes as f64, "amdgpu, mem_info_vram_total");
    }
    match (raw.local_bytes(), bench.is_software()) {
        (Some(bytes), false) => Parameter::reported(name, bytes as f64, "Vulkan, sum of the device-local heaps"),
        (Some(bytes), true) => {
            let source =
                "Vulkan, sum of the device-local heaps: what the program allows itself of the machine's memory";
            Parameter::reported(name, bytes as f64, source)
        }
        (None, _) => {
            let api = &bench.gpu.identity().api;
            Parameter::missing(
                name,
                &format!("no question about memory is known to this version for a GPU driven through {api}"),
            )
        }
    }
}

const SOFTWARE: &str =
    "a program on the CPU acts as the GPU, it has no processors of its own; see the parameters of the CPU";

fn clock_parameter(
    bench: &Bench<'_>,
    info: &wgpu::AdapterInfo,
    nvml: Option<&Nvml>,
    sysfs: Option<(f64, &'static str)>,
) -> Parameter {
    let name = GpuParameterId::ClockGhz;
    if bench.is_software() {
        return Parameter::missing(name, SOFTWARE);
    }
    match (nvml.map(|nvml| &nvml.clock_ghz), sysfs) {
        (Some(Ok(ghz)), _) => Parameter::reported(name, *ghz, "NVML, clock of the multiprocessors under load"),
        (_, Some((ghz, source))) => Parameter::reported(name, ghz, &format!("{source}, under load")),
        (Some(Err(why)), None) => Parameter::missing(name, why),
        (None, None) => Parameter::missing(name, unknown(info)),
    }
}

fn processors(
    bench: &Bench<'_>,
    info: &wgpu::AdapterInfo,
    raw: &Raw,
    nvml: Option<&Nvml>,
    sysfs: Option<&Sysfs>,
) -> [Parameter; 2] {
    let names = [GpuParameterId::Processors, GpuParameterId::Lanes];
    if bench.is_software() {
        return names.map(|name| Parameter::missing(name, SOFTWARE));
    }
    let kfd = sysfs.and_then(Sysfs::compute);
    let told = |id: GpuParameterId, (count, source): (u32, &str)| Parameter::reported(id, f64::from(count), source);
    let or_why =
        |id: GpuParameterId, found: Option<(u32, &str)>, nvml: Option<&Result<u32, String>>| match (found, nvml) {
            (Some(found), _) => told(id, found),
            (None, Some(Err(why))) => Parameter::missing(id, why),
            _ => Parameter::missing(id, unknown(info)),
        };
    let units = nvml.map(|nvml| &nvml.processors);
    let by_nvml = |count: Option<&Result<u32, String>>, source: &'static str| Some((*count?.as_ref().ok()?, source));
    let found = raw
        .processors
        .or_else(|| by_nvml(units, "NVML, CUDA cores over the cores that a multiprocessor of this capability has"))
        .or_else(|| kfd.map(|kfd| (kfd.units, "KFD, simd_count over simd_per_cu")));
    let processors = or_why(GpuParameterId::Processors, found, units);
    let cores = nvml.map(|nvml| &nvml.cores);
    let found = by_nvml(cores, "NVML, CUDA cores")
        .or(raw.lanes)
        .or_else(|| kfd.map(|kfd| (kfd.lanes, "KFD, 64 lanes for each compute unit")));
    [processors, or_why(GpuParameterId::Lanes, found, cores)]
}

/// Why clock and processors of a GPU of this vendor are not known.
fn unknown(info: &wgpu::AdapterInfo) -> &'static str {
    match info.vendor {
        INTEL => {
            "neither Vulkan nor sysfs tells for Intel GPUs; parallel_units and arithmetic_gflop_per_s are measured instead"
        }
        APPLE => "Metal does not tell; parallel_units and arithmetic_gflop_per_s are measured instead",
        _ => "no extension of the driver tells; parallel_units and arithmetic_gflop_per_s are measured instead",
    }
}

fn subgroup(bench: &Bench<'_>, info: &wgpu::AdapterInfo, raw: &Raw, executes: bool) -> Parameter {
    let name = GpuParameterId::SubgroupLanes;
    let (low, high) = (info.subgroup_min_size, info.subgroup_max_size);
    if let (false, Some((lanes, source))) = (executes, raw.subgroup) {
        return Parameter::reported(name, f64::from(lanes), source);
    }
    let seen = if !executes {
        Err("the GPU executes nothing".to_owned())
    } else if bench.gpu.device().features().contains(wgpu::Features::SUBGROUP) {
        observe(bench)
    } else {
        Err("the device has no subgroups".to_owned())
    };
    match seen {
        Ok(lanes) if lanes > 0 => {
            let source = format!("@builtin(subgroup_size) of a kernel; the adapter reports {low} to {high}");
            Parameter::reported(name, f64::from(lanes), &source)
        }
        _ if low == high && low > 0 => Parameter::reported(name, f64::from(low), "wgpu, adapter"),
        Ok(_) => Parameter::missing(name, &format!("the kernel saw none; the adapter reports {low} to {high} lanes")),
        Err(why) => {
            Parameter::missing(name, &format!("the adapter reports {low} to {high} lanes, and: {}", one_line(&why)))
        }
    }
}

fn observe(bench: &Bench<'_>) -> Result<u32, String> {
    let lanes = bench.storage(16)?;
    let kernel = bench.kernel(SUBGROUP_SOURCE, "observe", &[])?;
    bench.time_dispatches(&bench.bind(&kernel, &[(0, &lanes)])?, 1, 1)?;
    bench.first_word(&lanes)
}

/// What the CPU reaches of the memory of a card.
fn heaps(bench: &Bench<'_>, raw: &Raw) -> [Parameter; 3] {
    use GpuParameterId::{DeviceLocalBytes, HostVisibleLocalBytes, ResizableBar};
    let bytes = |id: GpuParameterId, bytes: Option<u64>, source: &str| match bytes {
        Some(bytes) => Parameter::reported(id, bytes as f64, source),
        None => Parameter::missing(id, "no driver has told of its heaps of memory"),
    };
    let bar = match (bench.gpu.identity().kind, raw.has_resizable_bar()) {
        (GpuKind::Discrete, Some(yes)) => {
            let source = "Vulkan, whether the host-visible device-local heap is as large as the device-local one";
            Parameter::reported(ResizableBar, f64::from(u8::from(yes)), source)
        }
        (GpuKind::Discrete, None) => Parameter::missing(ResizableBar, "no driver has told of its heaps of memory"),
        _ => Parameter::missing(ResizableBar, "a matter of cards with memory of their own"),
    };
    [
        bytes(DeviceLocalBytes, raw.largest_local_bytes(), "Vulkan, the largest device-local heap"),
        bytes(
            HostVisibleLocalBytes,
            raw.visible_local_bytes(),
            "Vulkan, the largest device-local heap with a host-visible type",
        ),
        bar,
    ]
}

fn unified(bench: &Bench<'_>, raw: &Raw) -> Parameter {
    let name = GpuParameterId::UnifiedMemory;
    let told = |yes: bool, source: &str| Parameter::reported(name, f64::from(u8::from(yes)), source);
    match bench.gpu.identity().kind {
        GpuKind::Software => told(true, "a program on the CPU acts as the GPU"),
        GpuKind::Integrated => told(true, "wgpu, an integrated GPU"),
        GpuKind::Discrete => told(false, "wgpu, a discrete GPU"),
        GpuKind::Virtual | GpuKind::Other => match raw.is_unified() {
            Some(yes) => told(yes, "Vulkan, whether every heap is device-local"),
            None => Parameter::missing(name, "the driver does not tell what kind of GPU it is, nor its heaps"),
        },
    }
}
