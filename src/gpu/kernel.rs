//! Kernels: compiled once, bound to buffers, dispatched.

use super::device::Gpu;

/// An entry point of a shader, compiled for one GPU.
#[derive(Debug)]
pub(super) struct Kernel {
    pipeline: wgpu::ComputePipeline,
    label: &'static str,
}

/// A kernel with the buffers that it works on.
#[derive(Debug)]
pub(super) struct Bound {
    pipeline: wgpu::ComputePipeline,
    group: wgpu::BindGroup,
    /// Most workgroups on one axis of a dispatch.
    most: u32,
}

/// The shaders, by what they do. Each is a few files put together, because WGSL has no includes.
pub(super) mod source {
    /// Files of a shader, in the order in which they are put together.
    pub(in crate::gpu) type Source = &'static [&'static str];

    const COMMON: &str = include_str!("shaders/common.wgsl");
    const INPUT: &str = include_str!("shaders/input.wgsl");
    const ROWS: &str = include_str!("shaders/rows.wgsl");

    pub(in crate::gpu) const BRUTE: Source = &[COMMON, INPUT, include_str!("shaders/brute.wgsl")];
    pub(in crate::gpu) const KEYS: Source = &[COMMON, INPUT, include_str!("shaders/keys.wgsl")];
    pub(in crate::gpu) const SAMPLE: Source = &[COMMON, INPUT, include_str!("shaders/sample.wgsl")];
    pub(in crate::gpu) const SCAN: Source = &[COMMON, include_str!("shaders/scan.wgsl")];
    pub(in crate::gpu) const SORT: Source = &[COMMON, include_str!("shaders/sort.wgsl")];
    pub(in crate::gpu) const STRIPS: Source = &[COMMON, ROWS, include_str!("shaders/strips.wgsl")];
    pub(in crate::gpu) const SWEEP: Source = &[COMMON, ROWS, include_str!("shaders/sweep.wgsl")];
    pub(in crate::gpu) const TABLE: Source = &[COMMON, include_str!("shaders/table.wgsl")];
}

impl Kernel {
    /// Compiles an entry point. The layout of its buffers follows from the shader.
    ///
    /// # Errors
    /// The compiler's words.
    pub(super) fn new(gpu: &Gpu, source: source::Source, entry: &'static str) -> Result<Self, String> {
        let text = source.concat();
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
                    // Every kernel writes its shared memory before it reads it.
                    zero_initialize_workgroup_memory: false,
                    ..Default::default()
                },
                cache: None,
            })
        });
        let pipeline = pipeline.map_err(|e| format!("the kernel {entry} does not compile: {e}"))?;
        Ok(Self { pipeline, label: entry })
    }

    /// Binds the buffers that the entry point uses, each with its number in the shader.
    ///
    /// # Errors
    /// When they are not those of the shader.
    pub(super) fn bind(&self, gpu: &Gpu, buffers: &[(u32, &wgpu::Buffer)]) -> Result<Bound, String> {
        let entries: Vec<wgpu::BindGroupEntry<'_>> = buffers
            .iter()
            .map(|&(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        let group = gpu.try_make(|device| {
            device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(self.label),
                layout: &self.pipeline.get_bind_group_layout(0),
                entries: &entries,
            })
        })?;
        let most = gpu.limits().max_compute_workgroups_per_dimension;
        Ok(Bound { pipeline: self.pipeline.clone(), group, most })
    }
}

impl Bound {
    /// Adds a dispatch of at least `workgroups`; the kernel leaves out those beyond.
    pub(super) fn dispatch(&self, pass: &mut wgpu::ComputePass<'_>, workgroups: u32) {
        let wide = workgroups.min(self.most);
        if wide > 0 {
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &self.group, &[]);
            pass.dispatch_workgroups(wide, workgroups.div_ceil(wide), 1);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::source::*;
    use wgpu::naga;

    /// Parses and validates every shader without a driver.
    #[test]
    fn every_shader_is_valid() {
        let sources = [BRUTE, KEYS, SAMPLE, SCAN, SORT, STRIPS, SWEEP, TABLE];
        for source in sources {
            let text = source.concat();
            let module = naga::front::wgsl::parse_str(&text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(&text)));
            let flags = naga::valid::ValidationFlags::all();
            let mut validator = naga::valid::Validator::new(flags, naga::valid::Capabilities::empty());
            validator.validate(&module).unwrap_or_else(|e| panic!("{}", e.emit_to_string(&text)));
        }
    }
}
