// Reads over a working set: a workgroup takes 64 KiB, an invocation 16 vectors of 16 bytes. The loads are written out, since naga bounds
// every loop with a counter of its own.

@group(0) @binding(1) var<storage, read> source: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read_write> sink: array<u32>;
@group(0) @binding(3) var<storage, read_write> target_set: array<vec4<u32>>;

fn at(group: u32, lane: u32, row: u32) -> u32 {
    return group * 4096u + row * 256u + lane;
}

@compute @workgroup_size(256)
fn read_set(@builtin(workgroup_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let g = id.x;
    var sum = source[at(g, lane, 0u)] ^ source[at(g, lane, 1u)] ^ source[at(g, lane, 2u)] ^ source[at(g, lane, 3u)];
    sum ^= source[at(g, lane, 4u)] ^ source[at(g, lane, 5u)] ^ source[at(g, lane, 6u)] ^ source[at(g, lane, 7u)];
    sum ^= source[at(g, lane, 8u)] ^ source[at(g, lane, 9u)] ^ source[at(g, lane, 10u)] ^ source[at(g, lane, 11u)];
    sum ^= source[at(g, lane, 12u)] ^ source[at(g, lane, 13u)] ^ source[at(g, lane, 14u)] ^ source[at(g, lane, 15u)];
    // Hardly ever true, but the compiler can't know: without a use of the sum the loads would be dropped.
    if ((sum.x ^ sum.y ^ sum.z ^ sum.w) == 0x9e3779b9u) {
        sink[0] = lane;
    }
}

// Writes a different value to every word, so that no memory compresses it.
@compute @workgroup_size(256)
fn fill(@builtin(workgroup_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    for (var row = 0u; row < 16u; row++) {
        let index = at(id.x, lane, row);
        let x = (index ^ 0x5bd1e995u) * 0x9e3779b9u;
        target_set[index] = vec4<u32>(x, x * 0x85ebca6bu, x * 0xc2b2ae35u, ~x * 0x27d4eb2fu);
    }
}
