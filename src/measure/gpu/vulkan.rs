//! What Vulkan tells of a GPU.
//!
//! Each question is asked only where the driver advertises its extension: the answer of another is undefined.

use super::raw::{Heap, Raw};
use ash::{amd, arm, ext, nv, vk};

/// The answers of a driver. Structures that were not filled are all zero, and a count of zero is no answer.
#[derive(Default)]
struct Answers {
    nvidia: vk::PhysicalDeviceShaderSMBuiltinsPropertiesNV<'static>,
    amd: vk::PhysicalDeviceShaderCorePropertiesAMD<'static>,
    amd2: vk::PhysicalDeviceShaderCoreProperties2AMD<'static>,
    arm: vk::PhysicalDeviceShaderCoreBuiltinsPropertiesARM<'static>,
    arm_rates: vk::PhysicalDeviceShaderCorePropertiesARM<'static>,
    subgroup: vk::PhysicalDeviceSubgroupProperties<'static>,
    memory: vk::PhysicalDeviceMemoryProperties,
    budget: Option<vk::PhysicalDeviceMemoryBudgetPropertiesEXT<'static>>,
}

/// Asks the driver.
pub(super) fn query(adapter: &wgpu::Adapter) -> Raw {
    // SAFETY: nothing is done with the adapter but to read its properties; it outlives this function, and nothing is
    // destroyed.
    let Some(hal) = (unsafe { adapter.as_hal::<wgpu::hal::api::Vulkan>() }) else { return Raw::default() };
    let capabilities = hal.physical_device_capabilities();
    let shared = hal.shared_instance();
    // The functions below belong to version 1.1: on an older instance they may not be loaded, and calling them panics.
    if shared.instance_api_version() < vk::API_VERSION_1_1
        || capabilities.properties().api_version < vk::API_VERSION_1_1
    {
        return Raw::default();
    }
    let (instance, device) = (shared.raw_instance(), hal.raw_physical_device());
    let has = |name| capabilities.supports_extension(name);

    let mut answers = Answers::default();
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut answers.subgroup);
    if has(nv::shader_sm_builtins::NAME) {
        properties = properties.push_next(&mut answers.nvidia);
    }
    if has(amd::shader_core_properties::NAME) {
        properties = properties.push_next(&mut answers.amd);
    }
    if has(amd::shader_core_properties2::NAME) {
        properties = properties.push_next(&mut answers.amd2);
    }
    if has(arm::shader_core_builtins::NAME) {
        properties = properties.push_next(&mut answers.arm);
    }
    if has(arm::shader_core_properties::NAME) {
        properties = properties.push_next(&mut answers.arm_rates);
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
    answers.memory = memory.memory_properties;
    answers.budget = has_budget.then_some(budget);
    answers.raw()
}

impl Answers {
    fn raw(&self) -> Raw {
        let Self { nvidia, amd, amd2, arm, arm_rates, subgroup, .. } = self;
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
            subgroup: first(&[(subgroup.subgroup_size, "Vulkan, subgroupSize")]),
            heaps: self.heaps(),
        }
    }

    fn heaps(&self) -> Vec<Heap> {
        let Self { memory: table, budget, .. } = self;
        let types = &table.memory_types[..(table.memory_type_count as usize).min(table.memory_types.len())];
        let both = vk::MemoryPropertyFlags::DEVICE_LOCAL | vk::MemoryPropertyFlags::HOST_VISIBLE;
        let heap = |k: usize| Heap {
            bytes: table.memory_heaps[k].size,
            is_local: table.memory_heaps[k].flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL),
            is_visible: types.iter().any(|t| t.heap_index as usize == k && t.property_flags.contains(both)),
            free: budget.map(|b| b.heap_budget[k].saturating_sub(b.heap_usage[k])),
        };
        (0..(table.memory_heap_count as usize).min(table.memory_heaps.len())).map(heap).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vk::{MemoryHeapFlags as Heaps, MemoryPropertyFlags as Flags};

    /// A card as its specification has it, and what Mesa 25.0.7 answers for it, recorded through `tools/fake-gpus.sh`.
    struct Card {
        units: u32,
        gib: f64,
        wave: u32,
        has_bar: bool,
        /// Engines, arrays in each, units in each of those.
        shape: [u32; 3],
        active: u32,
        /// Bytes of the heaps, and whether they are the card's.
        heaps: &'static [(u64, bool)],
        /// For each type of memory its heap, and whether it is the card's and whether the CPU reaches it.
        types: &'static [(u32, bool, bool)],
    }

    const WINDOW: &[(u32, bool, bool)] = &[
        (0, true, false),
        (0, true, false),
        (1, false, true),
        (2, true, true),
        (2, true, true),
        (1, false, true),
        (1, false, true),
    ];

    const CARDS: [Card; 4] = [
        // Radeon RX 480, 8 GB.
        Card {
            units: 36,
            gib: 8.0,
            wave: 64,
            has_bar: false,
            shape: [4, 1, 9],
            active: 36,
            heaps: &[(8_321_499_136, true), (16_776_243_200, false), (268_435_456, true)],
            types: WINDOW,
        },
        // Radeon RX Vega 64, 8 GB.
        Card {
            units: 64,
            gib: 8.0,
            wave: 64,
            has_bar: false,
            shape: [4, 1, 16],
            active: 64,
            heaps: &[(8_321_499_136, true), (8_359_135_232, false), (268_435_456, true)],
            types: WINDOW,
        },
        // Radeon RX 6800, 16 GB: 60 of the 80 units of its chip.
        Card {
            units: 60,
            gib: 16.0,
            wave: 64,
            has_bar: false,
            shape: [4, 2, 10],
            active: 60,
            heaps: &[(16_911_433_728, true), (16_746_784_768, false), (268_435_456, true)],
            types: WINDOW,
        },
        // Radeon RX 7900 XTX, 24 GB, recorded on a machine with a resizable BAR.
        Card {
            units: 96,
            gib: 24.0,
            wave: 64,
            has_bar: true,
            shape: [6, 2, 8],
            active: 96,
            heaps: &[(33_254_252_544, false), (25_753_026_560, true)],
            types: &[(1, true, false), (0, false, true), (1, true, true), (0, false, true)],
        },
    ];

    fn answers(card: &Card) -> Answers {
        let mut answers = Answers::default();
        let [engines, arrays, units] = card.shape;
        answers.amd.shader_engine_count = engines;
        answers.amd.shader_arrays_per_engine_count = arrays;
        answers.amd.compute_units_per_shader_array = units;
        answers.amd2.active_compute_unit_count = card.active;
        answers.subgroup.subgroup_size = card.wave;
        answers.memory.memory_heap_count = card.heaps.len() as u32;
        for (k, &(size, local)) in card.heaps.iter().enumerate() {
            let flags = if local { Heaps::DEVICE_LOCAL } else { Heaps::empty() };
            answers.memory.memory_heaps[k] = vk::MemoryHeap { size, flags };
        }
        answers.memory.memory_type_count = card.types.len() as u32;
        for (k, &(heap_index, local, visible)) in card.types.iter().enumerate() {
            let one = |yes: bool, flag: Flags| if yes { flag } else { Flags::empty() };
            let property_flags = one(local, Flags::DEVICE_LOCAL) | one(visible, Flags::HOST_VISIBLE);
            answers.memory.memory_types[k] = vk::MemoryType { property_flags, heap_index };
        }
        answers
    }

    #[test]
    fn answers_for_four_cards_agree_with_their_specifications() {
        for card in &CARDS {
            let raw = answers(card).raw();
            assert_eq!(raw.processors.map(|p| p.0), Some(card.units));
            assert_eq!(raw.lanes.map(|l| l.0), Some(card.units * 64));
            assert_eq!(raw.subgroup.map(|s| s.0), Some(card.wave));
            let gib = raw.local_bytes().unwrap() as f64 / f64::from(1 << 30);
            assert!((gib / card.gib - 1.0).abs() < 0.01, "{gib} GiB for {} units", card.units);
            assert_eq!(raw.has_resizable_bar(), Some(card.has_bar), "{} units", card.units);
            let window = if card.has_bar { raw.largest_local_bytes() } else { Some(256 << 20) };
            assert_eq!(raw.visible_local_bytes(), window, "{} units", card.units);
            assert_eq!(raw.is_unified(), Some(false));
        }
    }

    #[test]
    fn without_the_second_extension_the_units_of_the_chip_count() {
        let mut answers = answers(&CARDS[2]);
        answers.amd2.active_compute_unit_count = 0;
        assert_eq!(answers.raw().processors, Some((80, "VK_AMD_shader_core_properties, compute units")));
        assert_eq!(Answers::default().raw(), Raw::default());
    }
}
