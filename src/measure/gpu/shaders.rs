//! Every kernel of this folder is parsed and validated here, on machines without a GPU too.

const SOURCES: [(&str, &str); 5] = [
    ("memory", include_str!("shaders/memory.wgsl")),
    ("latency", include_str!("shaders/latency.wgsl")),
    ("compute", include_str!("shaders/compute.wgsl")),
    ("atomic", include_str!("shaders/atomic.wgsl")),
    ("subgroup", include_str!("shaders/subgroup.wgsl")),
];

#[test]
fn every_shader_is_valid() {
    SOURCES.iter().for_each(|(name, source)| crate::gpu::kernel::assert_valid(name, source));
}
