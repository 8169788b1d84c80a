//! Kernels: compiled once, bound to buffers, dispatched.

use super::device::Gpu;
use crate::error::GpuError;

/// An entry point of a shader, compiled for one GPU.
#[derive(Debug)]
pub(crate) struct Kernel {
    pipeline: wgpu::ComputePipeline,
    label: &'static str,
}

/// A kernel with the buffers that it works on.
#[derive(Debug)]
pub(crate) struct Bound {
    pipeline: wgpu::ComputePipeline,
    /// `None` where the kernel uses no buffer.
    group: Option<wgpu::BindGroup>,
    /// Most workgroups on one axis of a dispatch.
    most: u32,
}

/// The shaders, by what they do. Each is a few files put together, because WGSL has no includes.
pub(super) mod source {
    /// Files of a shader, in the order in which they are put together.
    pub(in crate::gpu) type Source = &'static [&'static str];

    const COMMON: &str = include_str!("shaders/common.wgsl");
    const INPUT: &str = include_str!("shaders/input.wgsl");
    const PREFIX: &str = include_str!("shaders/prefix.wgsl");
    const ROWS: &str = include_str!("shaders/rows.wgsl");

    pub(in crate::gpu) const BRUTE: Source = &[COMMON, INPUT, PREFIX, include_str!("shaders/brute.wgsl")];
    pub(in crate::gpu) const KEYS: Source = &[COMMON, INPUT, include_str!("shaders/keys.wgsl")];
    pub(in crate::gpu) const SAMPLE: Source = &[COMMON, INPUT, include_str!("shaders/sample.wgsl")];
    pub(in crate::gpu) const SCAN: Source = &[COMMON, include_str!("shaders/scan.wgsl")];
    pub(in crate::gpu) const SORT: Source = &[COMMON, include_str!("shaders/sort.wgsl")];
    pub(in crate::gpu) const GRID_SAP: Source = &[COMMON, PREFIX, ROWS, include_str!("shaders/grid_sap.wgsl")];
    pub(in crate::gpu) const SAP: Source = &[COMMON, PREFIX, ROWS, include_str!("shaders/sap.wgsl")];
    pub(in crate::gpu) const TABLE: Source = &[COMMON, include_str!("shaders/table.wgsl")];
}

impl Kernel {
    /// Compiles an entry point. The layout of its buffers follows from the shader.
    ///
    /// # Errors
    /// With the compiler's words as their source.
    pub(super) fn new(gpu: &Gpu, source: source::Source, entry: &'static str) -> Result<Self, GpuError> {
        Self::compile(gpu, source.concat(), entry, &[])
    }

    /// As [`new`](Self::new), from any text, with constants for its overrides.
    ///
    /// # Errors
    /// With the compiler's words as their source.
    pub(crate) fn compile(
        gpu: &Gpu,
        text: String,
        entry: &'static str,
        constants: &[(&str, f64)],
    ) -> Result<Self, GpuError> {
        let pipeline = gpu.try_make(|device| {
            let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(entry),
                source: wgpu::ShaderSource::Wgsl(text.into()),
            });
            device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(entry),
                layout: None,
                module: &module,
                entry_point: Some(entry),
                compilation_options: wgpu::PipelineCompilationOptions {
                    // No result depends on shared memory that was not written before.
                    zero_initialize_workgroup_memory: false,
                    constants,
                },
                cache: None,
            })
        });
        let pipeline = pipeline.map_err(|e| e.of(format!("the kernel {entry} does not compile")))?;
        Ok(Self { pipeline, label: entry })
    }

    /// Binds the buffers that the entry point uses, each with its number in the shader.
    ///
    /// # Errors
    /// When they are not those of the shader.
    pub(crate) fn bind(&self, gpu: &Gpu, buffers: &[(u32, &wgpu::Buffer)]) -> Result<Bound, GpuError> {
        let most_bound = gpu.limits().max_storage_buffer_binding_size & !3;
        let entries: Vec<wgpu::BindGroupEntry<'_>> = buffers
            .iter()
            .map(|&(binding, buffer)| {
                // A caller's buffer may be larger than a kernel can see, or not end on a word.
                let size = std::num::NonZero::new((buffer.size() & !3).min(most_bound));
                let resource = wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer, offset: 0, size });
                wgpu::BindGroupEntry { binding, resource }
            })
            .collect();
        let make = |device: &wgpu::Device| {
            device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(self.label),
                layout: &self.pipeline.get_bind_group_layout(0),
                entries: &entries,
            })
        };
        let group = if entries.is_empty() { None } else { Some(gpu.try_make(make)?) };
        let most = gpu.limits().max_compute_workgroups_per_dimension;
        Ok(Bound { pipeline: self.pipeline.clone(), group, most })
    }
}

impl Bound {
    /// Adds a dispatch of at least `workgroups`; the kernel leaves out those beyond.
    pub(crate) fn dispatch(&self, pass: &mut wgpu::ComputePass<'_>, workgroups: u32) {
        let wide = workgroups.min(self.most);
        if wide > 0 {
            pass.set_pipeline(&self.pipeline);
            if let Some(group) = &self.group {
                pass.set_bind_group(0, group, &[]);
            }
            pass.dispatch_workgroups(wide, workgroups.div_ceil(wide), 1);
        }
    }
}

/// Fails the test unless the text is a shader that wgpu takes. Needs no driver.
#[cfg(test)]
pub(crate) fn assert_valid(name: &str, text: &str) {
    use wgpu::naga::{front, valid};
    let module = front::wgsl::parse_str(text).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(text)));
    assert!(!module.entry_points.is_empty(), "{name}");
    let mut validator = valid::Validator::new(valid::ValidationFlags::all(), valid::Capabilities::SUBGROUP);
    validator.subgroup_stages(valid::ShaderStages::COMPUTE);
    validator.subgroup_operations(valid::SubgroupOperationSet::all());
    validator.validate(&module).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(text)));
}

#[cfg(test)]
mod tests {
    use super::assert_valid;
    use super::source::*;

    /// Parses and validates every shader without a driver.
    #[test]
    fn every_shader_is_valid() {
        let sources = [BRUTE, KEYS, SAMPLE, SCAN, SORT, GRID_SAP, SAP, TABLE];
        for (k, source) in sources.iter().enumerate() {
            assert_valid(&format!("shader {k}"), &source.concat());
        }
    }

    #[test]
    fn a_shader_that_does_not_compile_is_an_error_and_the_device_goes_on() {
        let Some(gpu) = crate::gpu::first_for_tests() else { return };
        for text in ["fn no(", "@compute @workgroup_size(1) fn other() {}"] {
            let error = super::Kernel::compile(&gpu, text.to_owned(), "entry", &[]).unwrap_err().to_string();
            assert!(error.contains("entry does not compile"), "{error}");
        }
        assert_eq!(gpu.fault(), None);
    }
}
