// Atomic additions: in each round every word of the buffer is added to once, by neighbouring invocations side by side.

struct Shape {
    rounds: u32,
    // Words of the buffer, minus one: a power of two.
    mask: u32,
}

@group(0) @binding(0) var<uniform> shape: Shape;
@group(0) @binding(1) var<storage, read_write> words: array<atomic<u32>>;

@compute @workgroup_size(256)
fn add(@builtin(workgroup_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let base = id.x * 1024u + lane;
    for (var r = 0u; r < shape.rounds; r++) {
        // The block moves from round to round, so that a workgroup does not stay with lines that it alone uses.
        let at = base + r * 1024u;
        atomicAdd(&words[at & shape.mask], 1u);
        atomicAdd(&words[(at + 256u) & shape.mask], 1u);
        atomicAdd(&words[(at + 512u) & shape.mask], 1u);
        atomicAdd(&words[(at + 768u) & shape.mask], 1u);
    }
}
