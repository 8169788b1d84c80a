//! Translates WGSL with the options of wgpu-hal 30.0.1: those of `Kernel::new` and `Kernel::compile` in the library,
//! and wgpu's defaults.

use crate::Result;
use naga::back::spv::Capability;
use naga::back::{hlsl, msl, pipeline_constants, spv};
use naga::proc::{BoundsCheckPolicies, BoundsCheckPolicy};
use naga::valid::{Capabilities, ModuleInfo, ShaderStages, SubgroupOperationSet, ValidationFlags, Validator};
use naga::{AddressSpace, Module, ShaderStage};
use std::borrow::Cow;
use std::path::Path;

/// A module with one of its entry points.
pub(crate) struct Kernel {
    /// Name of the file.
    pub(crate) name: String,
    pub(crate) entry: String,
    /// Whether wgpu adds its checks. It does unless the text begins with `// Without checks.`
    checked: bool,
    module: Module,
    info: ModuleInfo,
}

/// A version of Vulkan.
#[derive(Clone, Copy)]
pub(crate) struct Target {
    /// Version of SPIR-V.
    version: (u8, u8),
    /// Whether the driver checks bounds of buffers (`robustBufferAccess2`). Otherwise naga does.
    robust: bool,
}

/// Vulkan 1.3 with robustness, as current drivers have it.
pub(crate) const NEW: Target = Target { version: (1, 6), robust: true };
/// The oldest that wgpu takes without a remark: Vulkan 1.1 without robustness.
pub(crate) const OLD: Target = Target { version: (1, 3), robust: false };

/// Reads every entry point of every shader in a folder.
pub(crate) fn kernels(dir: &Path) -> Result<Vec<Kernel>> {
    let mut kernels = Vec::new();
    for file in crate::files(dir, "wgsl")? {
        let name = crate::stem(&file);
        let text = std::fs::read_to_string(&file).map_err(|e| format!("{}: {e}", file.display()))?;
        let module = naga::front::wgsl::parse_str(&text).map_err(|e| format!("{name}: {}", e.emit_to_string(&text)))?;
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::SUBGROUP);
        validator.subgroup_stages(ShaderStages::COMPUTE);
        validator.subgroup_operations(SubgroupOperationSet::all());
        let info = validator.validate(&module).map_err(|e| format!("{name}: {}", e.emit_to_string(&text)))?;
        for point in &module.entry_points {
            kernels.push(Kernel {
                name: name.clone(),
                entry: point.name.clone(),
                checked: !text.starts_with("// Without checks.\n"),
                module: module.clone(),
                info: info.clone(),
            });
        }
    }
    Ok(kernels)
}

impl Kernel {
    fn label(&self) -> String {
        format!("{}.{}", self.name, self.entry)
    }

    fn stage(&self) -> (ShaderStage, String) {
        (ShaderStage::Compute, self.entry.clone())
    }

    fn bounds(&self) -> BoundsCheckPolicy {
        if self.checked { BoundsCheckPolicy::Restrict } else { BoundsCheckPolicy::Unchecked }
    }

    /// Returns the module with its overrides at their defaults.
    fn fixed(&self) -> Result<(Cow<'_, Module>, Cow<'_, ModuleInfo>)> {
        let entry = Some((ShaderStage::Compute, self.entry.as_str()));
        pipeline_constants::process_overrides(&self.module, &self.info, entry, &Default::default())
            .map_err(|e| format!("{}: its overrides have no values: {e}", self.label()))
    }

    /// Returns the buffers that the entry point uses: number, and whether it is a uniform buffer.
    pub(crate) fn buffers(&self) -> Vec<(u32, bool)> {
        let index = self.module.entry_points.iter().position(|p| p.name == self.entry);
        let uses = self.info.get_entry_point(index.expect("the kernel was made of this entry point"));
        let used = self.module.global_variables.iter().filter(|(handle, _)| !uses[*handle].is_empty());
        used.filter_map(|(_, v)| Some((v.binding?.binding, v.space == AddressSpace::Uniform))).collect()
    }

    /// Translates the kernel as wgpu does for a Vulkan driver.
    pub(crate) fn spirv(&self, target: Target) -> Result<Vec<u32>> {
        let (module, info) = self.fixed()?;
        let index = self.bounds();
        let buffer = if target.robust { BoundsCheckPolicy::Unchecked } else { index };
        // wgpu allows these to a device with subgroups. A kernel that needs another is an error.
        let capabilities = [
            Capability::Shader,
            Capability::Matrix,
            Capability::GroupNonUniform,
            Capability::GroupNonUniformVote,
            Capability::GroupNonUniformArithmetic,
            Capability::GroupNonUniformBallot,
            Capability::GroupNonUniformShuffle,
            Capability::GroupNonUniformShuffleRelative,
            Capability::GroupNonUniformQuad,
        ];
        let options = spv::Options {
            lang_version: target.version,
            flags: spv::WriterFlags::LABEL_VARYINGS | spv::WriterFlags::FORCE_POINT_SIZE,
            capabilities: Some(capabilities.into_iter().collect()),
            bounds_check_policies: BoundsCheckPolicies { index, buffer, ..Default::default() },
            zero_initialize_workgroup_memory: spv::ZeroInitializeWorkgroupMemoryMode::None,
            force_loop_bounding: self.checked,
            emit_int_div_checks: self.checked,
            ..Default::default()
        };
        let pipeline = spv::PipelineOptions { shader_stage: ShaderStage::Compute, entry_point: self.entry.clone() };
        spv::write_vec(&module, &info, &options, Some(&pipeline))
            .map_err(|e| format!("{}: no SPIR-V: {e}", self.label()))
    }

    /// Translates the kernel as wgpu does for DXC, to the oldest shader model with DXIL. Returns the name of its
    /// entry point first.
    fn hlsl(&self) -> Result<(String, String)> {
        let (module, info) = self.fixed()?;
        let options = hlsl::Options {
            shader_model: hlsl::ShaderModel::V6_0,
            zero_initialize_workgroup_memory: false,
            restrict_indexing: self.checked,
            force_loop_bounding: self.checked,
            ..Default::default()
        };
        let pipeline = hlsl::PipelineOptions { entry_point: Some(self.stage()) };
        let mut text = String::new();
        let written = hlsl::Writer::new(&mut text, &options, &pipeline).write(&module, &info, None);
        let names = written.map_err(|e| format!("{}: no HLSL: {e}", self.label()))?.entry_point_names;
        match names.into_iter().next() {
            Some(Ok(name)) => Ok((name, text)),
            other => Err(format!("{}: no entry point in its HLSL: {other:?}", self.label())),
        }
    }

    /// Translates the kernel as wgpu does for Metal. Metal's compiler runs only on Apple's systems.
    fn metal(&self) -> Result<String> {
        let (module, info) = self.fixed()?;
        let bounds = self.bounds();
        let options = msl::Options {
            lang_version: (2, 4),
            bounds_check_policies: BoundsCheckPolicies { index: bounds, buffer: bounds, ..Default::default() },
            zero_initialize_workgroup_memory: false,
            force_loop_bounding: self.checked,
            ..Default::default()
        };
        let pipeline = msl::PipelineOptions { entry_point: Some(self.stage()), ..Default::default() };
        let (text, _) = msl::write_string(&module, &info, &options, &pipeline)
            .map_err(|e| format!("{}: no Metal Shading Language: {e}", self.label()))?;
        Ok(text)
    }
}

/// Writes every entry point of a folder into another folder, in each language.
pub(crate) fn all(dir: &Path, out: &Path) -> Result<()> {
    let kernels = kernels(dir)?;
    for kernel in &kernels {
        let write = |entry: &str, ending: &str, bytes: &[u8]| {
            let file = out.join(format!("{}.{entry}.{ending}", kernel.name));
            std::fs::write(&file, bytes).map_err(|e| format!("{}: {e}", file.display()))
        };
        write(&kernel.entry, "spv", &bytes(&kernel.spirv(NEW)?))?;
        write(&kernel.entry, "1_1.spv", &bytes(&kernel.spirv(OLD)?))?;
        // naga renames what is a keyword of HLSL, and DXC needs the name of the entry point.
        let (entry, text) = kernel.hlsl()?;
        write(&entry, "hlsl", text.as_bytes())?;
        write(&kernel.entry, "metal", kernel.metal()?.as_bytes())?;
    }
    println!("{} kernels as SPIR-V, HLSL and Metal Shading Language", kernels.len());
    Ok(())
}

fn bytes(words: &[u32]) -> Vec<u8> {
    words.iter().flat_map(|w| w.to_le_bytes()).collect()
}
