//! Every kernel of this folder is parsed and validated here, on machines without a GPU too.

use wgpu::naga;

const SOURCES: [(&str, &str); 5] = [
    ("memory", include_str!("shaders/memory.wgsl")),
    ("latency", include_str!("shaders/latency.wgsl")),
    ("compute", include_str!("shaders/compute.wgsl")),
    ("atomic", include_str!("shaders/atomic.wgsl")),
    ("subgroup", include_str!("shaders/subgroup.wgsl")),
];

#[test]
fn kernels_are_valid() {
    for (name, source) in SOURCES {
        let module = naga::front::wgsl::parse_str(source).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(source)));
        assert!(!module.entry_points.is_empty(), "{name}");
        let mut validator =
            naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::SUBGROUP);
        validator.subgroup_stages(naga::valid::ShaderStages::COMPUTE);
        validator.subgroup_operations(naga::valid::SubgroupOperationSet::all());
        if let Err(error) = validator.validate(&module) {
            panic!("{name}: {}", error.emit_to_string(source));
        }
    }
}
