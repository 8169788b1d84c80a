//! Clock, processors and memory of a GPU, as its driver reports them.

use std::time::Duration;

use super::arithmetic::Arithmetic;
use super::bench::Bench;
use crate::hardware::{GpuParameterId, Parameter};
use crate::measure::in_order;

const NAMES: [GpuParameterId; 4] =
    [GpuParameterId::MemoryBytes, GpuParameterId::ClockGhz, GpuParameterId::Processors, GpuParameterId::Lanes];

pub(super) fn measure(bench: &Bench<'_>, heaps: &[u64], executes: bool) -> Vec<Parameter> {
    let asked = if bench.is_software() {
        Err("a program on the CPU acts as the GPU and has no processors of its own".to_owned())
    } else if !executes {
        Err("the GPU executes nothing".to_owned())
    } else {
        ask(bench)
    };
    let (mut found, why) = match asked {
        Ok(found) => (found, "the driver does not report it".to_owned()),
        Err(why) => (Vec::new(), why),
    };
    if !heaps.is_empty() {
        let bytes = heaps.iter().sum::<u64>() as f64;
        found.push(Parameter::reported(GpuParameterId::MemoryBytes, bytes, "Vulkan, sum of the device-local heaps"));
    }
    in_order(&NAMES, &found, &why)
}

/// Asks NVIDIA's driver, with the GPU at work: an idle GPU clocks down.
fn ask(bench: &Bench<'_>) -> Result<Vec<Parameter>, String> {
    const NVIDIA: u32 = 0x10de;
    let info = bench.gpu.device().adapter_info();
    if info.vendor != NVIDIA {
        return Err("only NVIDIA's driver reports it".to_owned());
    }
    // About 24 ms.
    let work = Arithmetic::new(bench, Duration::from_millis(3)).and_then(|work| work.submit(bench, 8));
    let answer = super::nvml::query(&info.device_pci_bus_id);
    // A failure shows in what is measured next.
    let _ = work.and_then(|submission| bench.gpu.wait(submission));
    answer
}

/// Returns the sizes of the GPU's own heaps of memory; empty if it is not driven through Vulkan.
#[cfg(not(target_vendor = "apple"))]
pub(super) fn heaps(adapter: Option<&wgpu::Adapter>) -> Vec<u64> {
    const DEVICE_LOCAL: u32 = 1;
    // SAFETY: only properties of the adapter are read, and it outlives this function.
    let Some(hal) = adapter.and_then(|a| unsafe { a.as_hal::<wgpu::hal::api::Vulkan>() }) else { return Vec::new() };
    let instance = hal.shared_instance().raw_instance();
    // SAFETY: the physical device belongs to the instance, and both live as long as `hal`.
    let memory = unsafe { instance.get_physical_device_memory_properties(hal.raw_physical_device()) };
    let heaps = memory.memory_heaps.iter().take(memory.memory_heap_count as usize);
    heaps.filter(|heap| heap.flags.as_raw() & DEVICE_LOCAL != 0).map(|heap| heap.size).collect()
}

#[cfg(target_vendor = "apple")]
pub(super) fn heaps(_: Option<&wgpu::Adapter>) -> Vec<u64> {
    Vec::new()
}
