// How many lanes the driver gave a subgroup of this very kernel: adapters report a range.

@group(0) @binding(0) var<storage, read_write> lanes: array<u32>;

@compute @workgroup_size(64)
fn observe(@builtin(local_invocation_index) lane: u32, @builtin(subgroup_size) size: u32) {
    if (lane == 0u) {
        lanes[0] = size;
    }
}
