// Reads and writes over a working set: a workgroup takes 64 KiB, an invocation 16 vectors of 16 bytes. The loads are written out, since
// naga bounds every loop with a counter of its own.

struct Shape {
    // Vectors of the working set, minus one. Working sets are powers of two.
    mask: u32,
    // Makes each writing pass write something else.
    seed: u32,
}

@group(0) @binding(0) var<uniform> shape: Shape;
@group(0) @binding(1) var<storage, read> source: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read_write> sink: array<u32>;
@group(0) @binding(3) var<storage, read_write> target_set: array<vec4<u32>>;

fn at(group: u32, lane: u32, row: u32) -> u32 {
    return (group * 4096u + row * 256u + lane) & shape.mask;
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

// Different in every word, so that no memory compresses it.
fn noise(index: u32) -> vec4<u32> {
    let x = (index ^ shape.seed) * 0x9e3779b9u;
    return vec4<u32>(x, x * 0x85ebca6bu, x * 0xc2b2ae35u, ~x * 0x27d4eb2fu);
}

fn put(index: u32) {
    target_set[index] = noise(index);
}

@compute @workgroup_size(256)
fn write_set(@builtin(workgroup_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let g = id.x;
    put(at(g, lane, 0u));
    put(at(g, lane, 1u));
    put(at(g, lane, 2u));
    put(at(g, lane, 3u));
    put(at(g, lane, 4u));
    put(at(g, lane, 5u));
    put(at(g, lane, 6u));
    put(at(g, lane, 7u));
    put(at(g, lane, 8u));
    put(at(g, lane, 9u));
    put(at(g, lane, 10u));
    put(at(g, lane, 11u));
    put(at(g, lane, 12u));
    put(at(g, lane, 13u));
    put(at(g, lane, 14u));
    put(at(g, lane, 15u));
}
