//! Kernels: compiled once, bound to buffers, dispatched.

#[cfg(test)]
pub(super) mod marked;

use super::device::Gpu;
use crate::error::GpuError;

/// An entry point of a shader, compiled for one GPU.
#[derive(Debug)]
pub(crate) struct Kernel {
    pipeline: wgpu::ComputePipeline,
    label: &'static str,
    /// `None` of an ordinary kernel.
    #[cfg(test)]
    arrays: Option<marked::Arrays>,
}

/// A kernel with the buffers that it works on.
#[derive(Debug)]
pub(crate) struct Bound {
    pipeline: wgpu::ComputePipeline,
    /// `None` where the kernel uses no buffer.
    group: Option<wgpu::BindGroup>,
    /// Most workgroups on one axis of a dispatch.
    most: u32,
    #[cfg(test)]
    marks: Option<std::sync::Arc<marked::Marks>>,
}

/// The shaders, by what they do. Each is a few files put together, because WGSL has no includes.
pub(super) mod source {
    /// Files of a shader, in the order in which they are put together.
    pub(in crate::gpu) type Source = &'static [&'static str];

    const COMMON: &str = include_str!("shaders/common.wgsl");
    const INPUT: &str = include_str!("shaders/input.wgsl");
    const PREFIX: &str = include_str!("shaders/prefix.wgsl");
    const ROWS: &str = include_str!("shaders/rows.wgsl");

    const CURVE: &str = include_str!("shaders/curve.wgsl");
    const DIVISION: &str = include_str!("shaders/division.wgsl");
    const DIGITS: &str = include_str!("shaders/digits.wgsl");
    const LEVELS: &str = include_str!("shaders/levels.wgsl");
    const WALK: &str = include_str!("shaders/walk.wgsl");

    pub(in crate::gpu) const BRUTE: Source = &[COMMON, INPUT, PREFIX, include_str!("shaders/brute.wgsl")];
    pub(in crate::gpu) const KEYS: Source =
        &[COMMON, INPUT, DIVISION, CURVE, include_str!("shaders/keys.wgsl"), DIGITS];
    pub(in crate::gpu) const CELLS: Source = &[COMMON, PREFIX, include_str!("shaders/cells.wgsl")];
    pub(in crate::gpu) const GATHER: Source = &[COMMON, INPUT, include_str!("shaders/gather.wgsl")];
    pub(in crate::gpu) const SAMPLE: Source = &[COMMON, INPUT, include_str!("shaders/sample.wgsl")];
    pub(in crate::gpu) const SCAN: Source = &[COMMON, include_str!("shaders/scan.wgsl")];
    pub(in crate::gpu) const SORT: Source = &[COMMON, PREFIX, include_str!("shaders/sort.wgsl"), DIGITS];
    pub(in crate::gpu) const GRID_SAP: Source =
        &[COMMON, PREFIX, ROWS, LEVELS, WALK, include_str!("shaders/grid_sap.wgsl")];
    pub(in crate::gpu) const BVH: Source = &[COMMON, PREFIX, ROWS, LEVELS, WALK, include_str!("shaders/bvh.wgsl")];
    pub(in crate::gpu) const SAP: Source = &[COMMON, PREFIX, ROWS, include_str!("shaders/sap.wgsl")];
    pub(in crate::gpu) const TREE: Source = &[COMMON, LEVELS, include_str!("shaders/tree.wgsl")];
}

impl Kernel {
    /// Compiles an entry point. The layout of its buffers follows from the shader.
    ///
    /// # Errors
    /// With the compiler's words as their source.
    pub(super) fn new(gpu: &Gpu, source: source::Source, entry: &'static str) -> Result<Self, GpuError> {
        let checks = wgpu::ShaderRuntimeChecks {
            bounds_checks: false,
            force_loop_bounding: false,
            int_div_checks: false,
            ..Default::default()
        };
        // SAFETY: these texts are part of this program. No index in them depends on a box but through a clamp, each buffer is as long as
        // its kernels need it for the parameters of the frame (`ensure` of its owner), each loop ends, and no divisor of a frame is zero.
        unsafe { Self::make(gpu, source.concat(), entry, &[], checks) }
    }

    /// As [`new`](Self::new), from any text, with constants for its overrides, and with the checks of wgpu in the kernel.
    ///
    /// # Errors
    /// With the compiler's words as their source.
    #[cfg(any(test, feature = "measure-gpu"))]
    pub(crate) fn compile(
        gpu: &Gpu,
        text: String,
        entry: &'static str,
        constants: &[(&str, f64)],
    ) -> Result<Self, GpuError> {
        // SAFETY: with all checks any text is safe.
        unsafe { Self::make(gpu, text, entry, constants, wgpu::ShaderRuntimeChecks::checked()) }
    }

    /// # Safety
    /// Without the checks the kernel must index no buffer beyond its end, and end.
    unsafe fn make(
        gpu: &Gpu,
        text: String,
        entry: &'static str,
        constants: &[(&str, f64)],
        checks: wgpu::ShaderRuntimeChecks,
    ) -> Result<Self, GpuError> {
        #[cfg(test)]
        let (text, arrays) = marked::text_and_arrays(text);
        let pipeline = gpu.try_make(|device| {
            let source = wgpu::ShaderSource::Wgsl(text.into());
            let text = wgpu::ShaderModuleDescriptor { label: Some(entry), source };
            // SAFETY: the caller's promise.
            let module = unsafe { device.create_shader_module_trusted(text, checks) };
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
        Ok(Self {
            pipeline,
            label: entry,
            #[cfg(test)]
            arrays,
        })
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
        Ok(Bound {
            pipeline: self.pipeline.clone(),
            group,
            most,
            #[cfg(test)]
            marks: self.arrays.as_ref().map(|arrays| arrays.bind(gpu, self, buffers)).transpose()?,
        })
    }
}

impl Bound {
    /// Adds a dispatch of at least `workgroups`; the kernel leaves out those beyond.
    pub(crate) fn dispatch(&self, pass: &mut wgpu::ComputePass<'_>, workgroups: u32) {
        let wide = workgroups.min(self.most);
        if wide > 0 {
            #[cfg(test)]
            DISPATCHED.set(DISPATCHED.get() + 1);
            pass.set_pipeline(&self.pipeline);
            if let Some(group) = &self.group {
                pass.set_bind_group(0, group, &[]);
            }
            #[cfg(test)]
            if let Some(marks) = &self.marks {
                marks.dispatch(pass);
            }
            pass.dispatch_workgroups(wide, workgroups.div_ceil(wide), 1);
        }
    }
}

#[cfg(test)]
std::thread_local! {
    static DISPATCHED: std::cell::Cell<u32> = const { std::cell::Cell::new(0) };
}

/// How many dispatches this thread has recorded.
#[cfg(test)]
pub(super) fn dispatched() -> u32 {
    DISPATCHED.get()
}

/// Fails the test unless the text is a shader that wgpu takes. Needs no driver. Other compilers are to judge it too (`tools/shader-check.sh`), so it
/// is written as `NAME.wgsl` into the folder that `SAPWISE_SHADERS` names, if any.
#[cfg(test)]
pub(crate) fn assert_valid(name: &str, text: &str) {
    use wgpu::naga::{front, valid};
    let module = front::wgsl::parse_str(text).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(text)));
    assert!(!module.entry_points.is_empty(), "{name}");
    let mut validator = valid::Validator::new(valid::ValidationFlags::all(), valid::Capabilities::SUBGROUP);
    validator.subgroup_stages(valid::ShaderStages::COMPUTE);
    validator.subgroup_operations(valid::SubgroupOperationSet::all());
    validator.validate(&module).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(text)));
    if let Some(folder) = std::env::var_os("SAPWISE_SHADERS") {
        std::fs::write(std::path::Path::new(&folder).join(format!("{name}.wgsl")), text).unwrap();
    }
}

#[cfg(test)]
mod tests {
    use super::assert_valid;
    use super::source::*;

    /// Names of overrides with their values, as they stand in WGSL.
    type Constants = &'static [(&'static str, &'static str)];

    /// Parses and validates every shader without a driver.
    #[test]
    fn every_shader_is_valid() {
        // A variant, with other values of its overrides, is one more entry with a name of its own.
        let sources: &[(&str, Source, Constants)] = &[
            ("brute", BRUTE, &[]),
            ("keys", KEYS, &[]),
            ("sample", SAMPLE, &[]),
            ("scan", SCAN, &[]),
            ("sort", SORT, &[]),
            ("grid_sap", GRID_SAP, &[]),
            ("sap", SAP, &[]),
            ("cells", CELLS, &[]),
            ("gather", GATHER, &[]),
            ("tree", TREE, &[]),
            ("bvh", BVH, &[]),
        ];
        for (name, source, constants) in sources {
            // Whoever compiles the text elsewhere is told how wgpu does it: see `tools/shaders`.
            assert_valid(name, &format!("// Without checks.\n{}", with_defaults(&source.concat(), constants)));
        }
    }

    /// The shader with these values as the defaults of its overrides, so that every compiler makes the kernel that runs.
    fn with_defaults(text: &str, constants: Constants) -> String {
        constants.iter().fold(text.to_owned(), |text, (name, value)| {
            let found = text.split_once(&format!("override {name}:"));
            let (before, after) = found.unwrap_or_else(|| panic!("the shader has no override {name}"));
            let (declared, after) = after.split_once(';').expect("a declaration ends with a semicolon");
            let kind = declared.split('=').next().unwrap_or_default().trim();
            format!("{before}override {name}: {kind} = {value};{after}")
        })
    }

    #[test]
    fn the_constants_of_a_variant_become_defaults() {
        let text = "override a: u32 = 1u; override ab: bool; fn f() {}";
        assert_eq!(with_defaults(text, &[]), text);
        let variant = with_defaults(text, &[("ab", "true"), ("a", "4")]);
        assert_eq!(variant, "override a: u32 = 4; override ab: bool = true; fn f() {}");
    }

    #[test]
    #[should_panic = "no override b"]
    fn a_variant_without_its_override_is_no_variant() {
        with_defaults("override a: u32 = 1u;", &[("b", "1")]);
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
