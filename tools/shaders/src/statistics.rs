//! Statistics of each kernel from the compiler of a Vulkan driver: `VK_KHR_pipeline_executable_properties`.

use crate::Result;
use crate::translate::{Kernel, NEW, kernels};
use ash::{Device, Entry, Instance, khr, vk};
use std::ffi::CStr;
use std::path::Path;

/// Columns of the table, with RADV's name of each statistic. The first is a property.
const COLUMNS: [(&str, &str); 10] = [
    ("subgroup_lanes", ""),
    ("occupancy_subgroups_per_simd", "Subgroups per SIMD"),
    ("vgprs", "VGPRs"),
    ("sgprs", "SGPRs"),
    ("spilled_vgprs", "Spilled VGPRs"),
    ("spilled_sgprs", "Spilled SGPRs"),
    ("scratch_bytes", "Scratch size"),
    ("lds_bytes", "LDS size"),
    ("instructions", "Instructions"),
    ("code_bytes", "Code size"),
];

/// Columns that must be 0.
const FORBIDDEN: [&str; 3] = ["spilled_vgprs", "spilled_sgprs", "scratch_bytes"];

/// Prints the statistics of every kernel of a folder as CSV.
///
/// # Errors
/// A kernel spills registers or takes scratch memory.
pub(crate) fn print(family: &str, dir: &Path) -> Result<()> {
    let kernels = kernels(dir)?;
    let driver = Driver::open()?;
    println!("driver,family,shader,entry_point,{}", COLUMNS.map(|(column, _)| column).join(","));
    let mut wrong = Vec::new();
    for kernel in &kernels {
        let Kernel { name, entry, .. } = kernel;
        let values = driver.statistics(kernel)?;
        for ((column, _), value) in COLUMNS.iter().zip(&values) {
            if FORBIDDEN.contains(column) && *value > 0 {
                wrong.push(format!("{name}.{entry} on {family}: {column} is {value}, and must be 0"));
            }
        }
        let values: Vec<String> = values.iter().map(u64::to_string).collect();
        println!("{},{family},{name},{entry},{}", driver.version, values.join(","));
    }
    if wrong.is_empty() { Ok(()) } else { Err(wrong.join("\nshaders: ")) }
}

struct Driver {
    // Keeps the loader's library open.
    _entry: Entry,
    device: Device,
    executables: khr::pipeline_executable_properties::Device,
    version: String,
}

/// Returns the error of a call that the driver refused.
pub(crate) fn refused(what: &'static str) -> impl Fn(vk::Result) -> String {
    move |e| format!("the Vulkan driver refuses {what}: {e}")
}

/// Loads the loader, and creates an instance for Vulkan 1.3.
pub(crate) fn instance() -> Result<(Entry, Instance)> {
    // SAFETY: loads the system's Vulkan loader, whose initialisers may run.
    let entry = unsafe { Entry::load() }.map_err(|e| format!("no Vulkan loader: {e}"))?;
    let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
    let info = vk::InstanceCreateInfo::default().application_info(&application);
    // SAFETY: the structures live until the call returns.
    let instance = unsafe { entry.create_instance(&info, None) }.map_err(refused("an instance"))?;
    Ok((entry, instance))
}

impl Driver {
    /// Opens the only device as wgpu-hal does.
    fn open() -> Result<Self> {
        let (entry, instance) = instance()?;
        // SAFETY: the instance is valid, as in the calls below.
        let found = unsafe { instance.enumerate_physical_devices() }.map_err(refused("to list its devices"))?;
        let &[physical] = &found[..] else {
            return Err(format!("there are {} Vulkan devices; let VK_DRIVER_FILES name a single one", found.len()));
        };
        let mut driver = vk::PhysicalDeviceDriverProperties::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
        let mut robustness = vk::PhysicalDeviceRobustness2FeaturesEXT::default();
        let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut robustness);
        // SAFETY: the chains hold structures that Vulkan 1.3 and the extension define, and live until the calls
        // return.
        unsafe {
            instance.get_physical_device_properties2(physical, &mut properties);
            instance.get_physical_device_features2(physical, &mut features);
        }
        if properties.properties.api_version < vk::API_VERSION_1_3 || robustness.robust_buffer_access2 == 0 {
            let why =
                "this device lacks Vulkan 1.3 or robustBufferAccess2: the statistics would be those of other SPIR-V";
            return Err(why.to_owned());
        }
        let version = driver.driver_info_as_c_str().unwrap_or_default().to_string_lossy().into_owned();
        let queues = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0])];
        let extensions = [khr::pipeline_executable_properties::NAME.as_ptr(), ash::ext::robustness2::NAME.as_ptr()];
        // With both, RADV checks the bounds of buffers, as it does for wgpu.
        let core = vk::PhysicalDeviceFeatures::default().robust_buffer_access(true);
        let mut robustness = vk::PhysicalDeviceRobustness2FeaturesEXT::default().robust_buffer_access2(true);
        let mut infos =
            vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default().pipeline_executable_info(true);
        let mut sizes = vk::PhysicalDeviceSubgroupSizeControlFeatures::default().subgroup_size_control(true);
        let info = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_extension_names(&extensions)
            .enabled_features(&core)
            .push_next(&mut robustness)
            .push_next(&mut infos)
            .push_next(&mut sizes);
        // SAFETY: as above.
        let device = unsafe { instance.create_device(physical, &info, None) }.map_err(refused("to open the device"))?;
        let executables = khr::pipeline_executable_properties::Device::new(&instance, &device);
        Ok(Self { _entry: entry, device, executables, version })
    }

    /// Compiles a kernel, and returns the values of the columns. Destroys nothing, because the process ends soon.
    fn statistics(&self, kernel: &Kernel) -> Result<Vec<u64>> {
        let pipeline = self.pipeline(kernel)?;
        let info = vk::PipelineInfoKHR::default().pipeline(pipeline);
        // SAFETY: the pipeline was made with the flag that these calls need.
        let parts = unsafe { self.executables.get_pipeline_executable_properties(&info) };
        let parts = parts.map_err(refused("properties of a pipeline"))?;
        let [part] = &parts[..] else { return Err(format!("{} executables in a compute pipeline", parts.len())) };
        let info = vk::PipelineExecutableInfoKHR::default().pipeline(pipeline);
        // SAFETY: as above.
        let statistics = unsafe { self.executables.get_pipeline_executable_statistics(&info) };
        let statistics = statistics.map_err(refused("statistics of a pipeline"))?;
        let mut values = vec![u64::from(part.subgroup_size)];
        for &(column, name) in &COLUMNS[1..] {
            let named = |s: &&vk::PipelineExecutableStatisticKHR<'_>| text(&s.name) == name;
            let Some(statistic) = statistics.iter().find(named) else {
                let names: Vec<_> = statistics.iter().map(|s| text(&s.name)).collect();
                return Err(format!("{column}: this driver has no \"{name}\" among {}", names.join(", ")));
            };
            // SAFETY: every kind except Booleans fills or begins with an integer, and no column is a Boolean.
            values.push(unsafe { statistic.value.u64 });
        }
        Ok(values)
    }

    fn pipeline(&self, kernel: &Kernel) -> Result<vk::Pipeline> {
        let code = kernel.spirv(NEW)?;
        let bindings: Vec<_> = kernel.buffers().into_iter().map(binding).collect();
        let entry = std::ffi::CString::new(kernel.entry.as_str()).expect("WGSL has no zero in a name");
        // SAFETY: the structures live until the calls return; spirv-val has checked the code.
        unsafe {
            let info = vk::ShaderModuleCreateInfo::default().code(&code);
            let module = self.device.create_shader_module(&info, None).map_err(refused("a shader module"))?;
            let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
            let set = self.device.create_descriptor_set_layout(&info, None).map_err(refused("a layout"))?;
            let sets = [set];
            let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets);
            let layout = self.device.create_pipeline_layout(&info, None).map_err(refused("a layout"))?;
            // As wgpu-hal does for a device with subgroups.
            let stage = vk::PipelineShaderStageCreateInfo::default()
                .flags(vk::PipelineShaderStageCreateFlags::ALLOW_VARYING_SUBGROUP_SIZE)
                .stage(vk::ShaderStageFlags::COMPUTE)
                .module(module)
                .name(&entry);
            let info = vk::ComputePipelineCreateInfo::default()
                .flags(vk::PipelineCreateFlags::CAPTURE_STATISTICS_KHR)
                .stage(stage)
                .layout(layout);
            let made = self.device.create_compute_pipelines(vk::PipelineCache::null(), &[info], None);
            let made =
                made.map_err(|(_, e)| format!("{}.{}: {}", kernel.name, kernel.entry, refused("the pipeline")(e)))?;
            Ok(made[0])
        }
    }
}

fn binding((number, uniform): (u32, bool)) -> vk::DescriptorSetLayoutBinding<'static> {
    let kind = if uniform { vk::DescriptorType::UNIFORM_BUFFER } else { vk::DescriptorType::STORAGE_BUFFER };
    vk::DescriptorSetLayoutBinding::default()
        .binding(number)
        .descriptor_type(kind)
        .descriptor_count(1)
        .stage_flags(vk::ShaderStageFlags::COMPUTE)
}

/// Returns a name in a structure of Vulkan.
fn text(name: &[std::ffi::c_char]) -> String {
    // SAFETY: Vulkan ends these arrays with a zero.
    unsafe { CStr::from_ptr(name.as_ptr()) }.to_string_lossy().into_owned()
}
