//! Kernels: compiled once, bound to buffers, dispatched.

use super::{Gpu, Place};
use sapwise::error::GpuError;

/// An entry point of a shader, compiled for one GPU.
#[derive(Debug)]
pub struct Kernel {
    pipeline: wgpu::ComputePipeline,
    label: &'static str,
}

/// A kernel with the buffers that it works on.
#[derive(Debug)]
pub struct Bound {
    pipeline: wgpu::ComputePipeline,
    /// `None` if the kernel uses no buffer.
    group: Option<wgpu::BindGroup>,
    label: &'static str,
    gpu: Gpu,
}

/// The shaders. Each is a concatenation of files, because WGSL has no includes.
pub(crate) mod source {
    /// The files of a shader, in order.
    pub(crate) type Source = &'static [&'static str];

    const COMMON: &str = include_str!("shaders/common.wgsl");
    const INPUT: &str = include_str!("shaders/input.wgsl");
    const PREFIX: &str = include_str!("shaders/prefix.wgsl");
    const ROWS: &str = include_str!("shaders/rows.wgsl");
    const BY_ROWS: [&str; 2] = [include_str!("shaders/count_rows.wgsl"), include_str!("shaders/write_rows.wgsl")];

    const CURVE: &str = include_str!("shaders/curve.wgsl");
    const DIVISION: &str = include_str!("shaders/division.wgsl");
    const DIGITS: &str = include_str!("shaders/digits.wgsl");
    const LEVELS: &str = include_str!("shaders/levels.wgsl");
    const WALK: &str = include_str!("shaders/walk.wgsl");

    pub(crate) const KEYS: Source = &[COMMON, INPUT, DIVISION, CURVE, include_str!("shaders/keys.wgsl"), DIGITS];
    pub(crate) const CELLS: Source = &[COMMON, PREFIX, include_str!("shaders/cells.wgsl")];
    pub(crate) const GATHER: Source = &[COMMON, INPUT, include_str!("shaders/gather.wgsl")];
    pub(crate) const SAMPLE: Source = &[COMMON, INPUT, include_str!("shaders/sample.wgsl")];
    pub(crate) const SCAN: Source = &[COMMON, include_str!("shaders/scan.wgsl")];
    pub(crate) const SORT: Source = &[COMMON, PREFIX, include_str!("shaders/sort.wgsl"), DIGITS];
    pub(crate) const TREE: Source = &[COMMON, LEVELS, include_str!("shaders/tree.wgsl")];

    /// What the kernels that count and write pairs share, and the rest of each.
    pub(crate) type Pairing = (Source, [&'static str; 2]);

    pub(crate) const BRUTE: Pairing = (&[COMMON, INPUT, PREFIX], [include_str!("shaders/brute.wgsl"); 2]);
    pub(crate) const GRID_SAP: Pairing =
        (&[COMMON, PREFIX, ROWS, LEVELS, WALK, include_str!("shaders/grid_sap.wgsl")], BY_ROWS);
    pub(crate) const BVH: Pairing = (&[COMMON, ROWS, LEVELS, include_str!("shaders/bvh.wgsl")], BY_ROWS);
    pub(crate) const SAP: Pairing = (&[COMMON, PREFIX, ROWS, include_str!("shaders/sap.wgsl")], BY_ROWS);

    /// Defines which pairs pass: all of them, or those that a filter wants.
    pub(crate) const UNFILTERED: &str = include_str!("shaders/unfiltered.wgsl");
    pub(crate) const FILTER: &str = include_str!("shaders/filter.wgsl");

    /// Returns the files of the kernel that counts pairs, and of the one that writes them.
    pub(crate) fn pairing((shared, each): Pairing, filter: &'static str) -> [Vec<&'static str>; 2] {
        each.map(|own| [shared, &[filter, own]].concat())
    }
}

impl Kernel {
    /// Compiles an entry point. The layout of its buffers follows from the shader.
    ///
    /// # Errors
    /// The compiler's error is the source.
    pub(super) fn new(gpu: &Gpu, source: &[&str], entry: &'static str) -> Result<Self, GpuError> {
        let checks = wgpu::ShaderRuntimeChecks {
            bounds_checks: false,
            force_loop_bounding: false,
            int_div_checks: false,
            ..Default::default()
        };
        // SAFETY: the texts are part of this program. An index depends on a box, valid or not, only through a clamp or
        // the distance from one clamped cell to a later one. Each buffer is as long as its kernels need it for the
        // parameters of the frame (`ensure` of its owner), every loop ends, and no divisor is zero.
        unsafe { Self::make(gpu, source.concat(), entry, &[], checks) }
    }

    /// Compiles any text, with values for its overrides, and with wgpu's checks in the kernel.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn compile(gpu: &Gpu, text: String, entry: &'static str, constants: &[(&str, f64)]) -> Result<Self, GpuError> {
        // SAFETY: with all checks, any text is safe.
        unsafe { Self::make(gpu, text, entry, constants, wgpu::ShaderRuntimeChecks::checked()) }
    }

    /// # Safety
    /// Without checks the kernel must index no buffer beyond its end, and must end.
    unsafe fn make(
        gpu: &Gpu,
        text: String,
        entry: &'static str,
        constants: &[(&str, f64)],
        checks: wgpu::ShaderRuntimeChecks,
    ) -> Result<Self, GpuError> {
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
                    // No result depends on workgroup memory that was not written.
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
    /// They are not those of the shader.
    pub fn bind(&self, gpu: &Gpu, buffers: &[(u32, &wgpu::Buffer)]) -> Result<Bound, GpuError> {
        let most_bound = gpu.limits().max_storage_buffer_binding_size & !3;
        let entries: Vec<wgpu::BindGroupEntry<'_>> = buffers
            .iter()
            .map(|&(binding, buffer)| {
                // A caller's buffer may be larger than a binding can be, or not end on a word.
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
        Ok(Bound { pipeline: self.pipeline.clone(), group, label: self.label, gpu: gpu.clone() })
    }
}

impl Bound {
    /// Adds a dispatch of `workgroups` or a few more, which the kernel ignores.
    pub fn dispatch(&self, pass: &mut wgpu::ComputePass<'_>, workgroups: u32) {
        let wide = workgroups.min(self.gpu.limits().max_compute_workgroups_per_dimension);
        if wide > 0 {
            #[cfg(test)]
            DISPATCHED.set(DISPATCHED.get() + 1);
            pass.set_pipeline(&self.pipeline);
            if let Some(group) = &self.group {
                pass.set_bind_group(0, group, &[]);
            }
            pass.dispatch_workgroups(wide, workgroups.div_ceil(wide), 1);
            self.gpu.ends(self.label, Place::Pass(pass));
        }
    }
}

#[cfg(test)]
std::thread_local! {
    static DISPATCHED: std::cell::Cell<u32> = const { std::cell::Cell::new(0) };
}

/// Returns how many dispatches this thread has recorded.
#[cfg(test)]
pub(super) fn dispatched() -> u32 {
    DISPATCHED.get()
}

/// Panics unless wgpu takes the text as a shader. Needs no driver. Writes it to `NAME.wgsl` in the folder
/// `SAPWISE_SHADERS`, if set, for the compilers of `tools/shader-check.sh`.
#[cfg(not(target_family = "wasm"))]
pub fn assert_valid(name: &str, text: &str) {
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

    /// Parses and validates every shader without a driver.
    #[test]
    fn every_shader_is_valid() {
        let mut sources: Vec<(String, Vec<&str>)> = [
            ("keys", KEYS),
            ("sample", SAMPLE),
            ("scan", SCAN),
            ("sort", SORT),
            ("cells", CELLS),
            ("gather", GATHER),
            ("tree", TREE),
        ]
        .map(|(name, source)| (name.to_owned(), source.to_vec()))
        .to_vec();
        for (name, texts) in [("brute", BRUTE), ("sap", SAP), ("grid_sap", GRID_SAP), ("bvh", BVH)] {
            for (filter, text) in [("", UNFILTERED), ("_filter", FILTER)] {
                let [count, write] = pairing(texts, text);
                if count != write {
                    sources.push((format!("{name}{filter}_write"), write));
                }
                sources.push((format!("{name}{filter}"), count));
            }
        }
        for (name, source) in sources {
            // `tools/shaders` reads from the first line how wgpu compiles the text.
            assert_valid(&name, &format!("// Without checks.\n{}", source.concat()));
        }
    }

    #[test]
    fn a_refused_shader_leaves_the_device_usable() {
        let Some(gpu) = crate::first_for_tests() else { return };
        for text in ["fn no(", "@compute @workgroup_size(1) fn other() {}"] {
            let error = super::Kernel::compile(&gpu, text.to_owned(), "entry", &[]).unwrap_err().to_string();
            assert!(error.contains("entry does not compile"), "{error}");
        }
        assert_eq!(gpu.fault(), None);
    }
}
