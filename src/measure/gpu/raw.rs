//! What Vulkan tells of a GPU and wgpu does not: processors, lanes, memory.
//!
//! Each question is asked only where the driver advertises its extension: the answer of another is undefined.

/// What the driver told. Empty where the GPU is not driven through Vulkan.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Raw {
    /// Multiprocessors, compute units or shader cores, and who said so.
    pub(super) processors: Option<(u32, &'static str)>,
    /// Multiply-adds that can start in one cycle on all processors, and who said so.
    pub(super) lanes: Option<(u32, &'static str)>,
    /// Heaps of memory.
    pub(super) heaps: Vec<Heap>,
}

/// A heap of memory.
#[cfg_attr(target_vendor = "apple", allow(dead_code, reason = "Metal has no heaps to list"))]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Heap {
    pub(super) bytes: u64,
    /// Whether it is the GPU's own.
    pub(super) is_local: bool,
    /// Bytes that this process may still have of it, where the driver tells.
    pub(super) free: Option<u64>,
}

impl Raw {
    /// Bytes of the GPU's own heaps.
    pub(super) fn local_bytes(&self) -> Option<u64> {
        let bytes = self.heaps.iter().filter(|h| h.is_local).fold(0_u64, |sum, h| sum.saturating_add(h.bytes));
        (bytes > 0).then_some(bytes)
    }

    /// Bytes of the largest heap of the GPU that are free, or all of them where the driver does not tell.
    pub(super) fn free_bytes(&self) -> Option<u64> {
        self.heaps.iter().filter(|h| h.is_local).map(|h| h.free.unwrap_or(h.bytes).min(h.bytes)).max()
    }

    /// Whether all memory that the GPU sees is its own, as it is where it shares the CPU's.
    pub(super) fn is_unified(&self) -> Option<bool> {
        (!self.heaps.is_empty()).then(|| self.heaps.iter().all(|h| h.is_local))
    }
}

/// Asks the driver.
#[cfg(target_vendor = "apple")]
pub(super) fn query(_adapter: &wgpu::Adapter) -> Raw {
    Raw::default()
}

/// Asks the driver.
#[cfg(not(target_vendor = "apple"))]
pub(super) fn query(adapter: &wgpu::Adapter) -> Raw {
    use ash::{amd, arm, ext, nv, vk};

    // SAFETY: nothing is done with the adapter but to read its properties; it outlives this function, and nothing is
    // destroyed.
    let Some(hal) = (unsafe { adapter.as_hal::<wgpu::hal::api::Vulkan>() }) else { return Raw::default() };
    let capabilities = hal.physical_device_capabilities();
    let shared = hal.shared_instance();
    // The functions below belong to version 1.1: on an older instance they may not be loaded, and calling them panics.
    if shared.instance_api_version() < vk::API_VERSION_1_1 || capabilities.properties().api_version < vk::API_VERSION_1_1 {
        return Raw::default();
    }
    let (instance, device) = (shared.raw_instance(), hal.raw_physical_device());
    let has = |name| capabilities.supports_extension(name);

    let mut nvidia = vk::PhysicalDeviceShaderSMBuiltinsPropertiesNV::default();
    let mut amd = vk::PhysicalDeviceShaderCorePropertiesAMD::default();
    let mut amd2 = vk::PhysicalDeviceShaderCoreProperties2AMD::default();
    let mut arm = vk::PhysicalDeviceShaderCoreBuiltinsPropertiesARM::default();
    let mut arm_rates = vk::PhysicalDeviceShaderCorePropertiesARM::default();
    let mut properties = vk::PhysicalDeviceProperties2::default();
    if has(nv::shader_sm_builtins::NAME) {
        properties = properties.push_next(&mut nvidia);
    }
    if has(amd::shader_core_properties::NAME) {
        properties = properties.push_next(&mut amd);
    }
    if has(amd::shader_core_properties2::NAME) {
        properties = properties.push_next(&mut amd2);
    }
    if has(arm::shader_core_builtins::NAME) {
        properties = properties.push_next(&mut arm);
    }
    if has(arm::shader_core_properties::NAME) {
        properties = properties.push_next(&mut arm_rates);
    }
    // SAFETY: the physical device belongs to the instance, both live as long as `hal`; every structure in the chain is a
    // default one of the right type that outlives the call, and its extension is advertised.
    unsafe { instance.get_physical_device_properties2(device, &mut properties) };

    let mut budget = vk::PhysicalDeviceMemoryBudgetPropertiesEXT::default();
    let mut memory = vk::PhysicalDeviceMemoryProperties2::default();
    let has_budget = has(ext::memory_budget::NAME);
    if has_budget {
        memory = memory.push_next(&mut budget);
    }
    // SAFETY: as above.
    unsafe { instance.get_physical_device_memory_properties2(device, &mut memory) };
    let table = memory.memory_properties;
    let count = (table.memory_heap_count as usize).min(table.memory_heaps.len());
    let heaps = (0..count).map(|k| Heap {
        bytes: table.memory_heaps[k].size,
        is_local: table.memory_heaps[k].flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL),
        free: has_budget.then(|| budget.heap_budget[k].saturating_sub(budget.heap_usage[k])),
    });
    let heaps = heaps.collect();

    // Structures that were not filled are all zero, and a count of zero is no answer.
    let arm_lanes = arm.shader_core_count.saturating_mul(arm_rates.fma_rate);
    let amd_units = amd
        .shader_engine_count
        .saturating_mul(amd.shader_arrays_per_engine_count)
        .saturating_mul(amd.compute_units_per_shader_array);
    let amd_active = if amd2.active_compute_unit_count > 0 { amd2.active_compute_unit_count } else { amd_units };
    let first = |candidates: &[(u32, &'static str)]| candidates.iter().copied().find(|(count, _)| *count > 0);
    Raw {
        processors: first(&[
            (nvidia.shader_sm_count, "VK_NV_shader_sm_builtins"),
            (amd2.active_compute_unit_count, "VK_AMD_shader_core_properties2, active compute units"),
            (amd_units, "VK_AMD_shader_core_properties, compute units"),
            (arm.shader_core_count, "VK_ARM_shader_core_builtins"),
        ]),
        lanes: first(&[
            // Four units of 16 lanes, or two of 32: 64 either way. Instructions that pair two multiply-adds are not
            // counted.
            (amd_active.saturating_mul(64), "VK_AMD_shader_core_properties, 64 lanes for each compute unit"),
            (arm_lanes, "VK_ARM_shader_core_builtins and VK_ARM_shader_core_properties, multiply-adds a cycle"),
        ]),
        heaps,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GIB: u64 = 1 << 30;

    fn heap(bytes: u64, is_local: bool, free: Option<u64>) -> Heap {
        Heap { bytes, is_local, free }
    }

    #[test]
    fn a_card_and_its_window() {
        let heaps =
            vec![heap(8 * GIB, true, Some(6 * GIB)), heap(16 * GIB, false, None), heap(GIB / 4, true, Some(GIB / 4))];
        let raw = Raw { heaps, ..Raw::default() };
        assert_eq!(raw.local_bytes(), Some(8 * GIB + GIB / 4));
        assert_eq!(raw.free_bytes(), Some(6 * GIB));
        assert_eq!(raw.is_unified(), Some(false));
    }

    #[test]
    fn one_memory_and_none() {
        let raw = Raw { heaps: vec![heap(2 * GIB, true, None)], ..Raw::default() };
        assert_eq!((raw.local_bytes(), raw.free_bytes(), raw.is_unified()), (Some(2 * GIB), Some(2 * GIB), Some(true)));
        let raw = Raw::default();
        assert_eq!((raw.local_bytes(), raw.free_bytes(), raw.is_unified()), (None, None, None));
    }
}
