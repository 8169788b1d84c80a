// A sample of the boxes: one of each of 256 equal parts of the list, at a position that differs from part to part and
// from frame to frame. With equal spacing, a list in which kinds of boxes alternate could show one kind only.

@group(0) @binding(4) var<storage, read_write> sampled: array<u32>;

// The output permutation of PCG (O'Neill, 2014) on one word.
fn mixed(word: u32) -> u32 {
    let state = word * 747796405u + 2891336453u;
    let turned = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (turned >> 22u) ^ turned;
}

fn start(part: u32) -> u32 {
    // part * objects / 256, without a product beyond 32 bits.
    return part * (params.objects / 256u) + part * (params.objects % 256u) / 256u;
}

@compute @workgroup_size(256)
fn sample(@builtin(local_invocation_index) t: u32) {
    let probe = params.objects / 2u * 6u;
    let seed = mixed(boxes[probe] ^ mixed(boxes[probe + 1u]));
    let first = start(t);
    let at = min(first + mixed(seed ^ t) % max(start(t + 1u) - first, 1u), params.objects - 1u);
    for (var k = 0u; k < 6u; k++) {
        sampled[t * 6u + k] = boxes[at * 6u + k];
    }
}
