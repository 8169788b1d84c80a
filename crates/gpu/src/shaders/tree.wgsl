// Makes the next three levels of the tree.

struct Raise {
    // The level below them.
    level: u32,
    unused_a: u32,
    unused_b: u32,
    unused_c: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> raise: Raise;
@group(0) @binding(2) var<storage, read_write> boxes: array<Box>;
// Where each cell begins. `raise_large` skips nodes before the first oversized box, which no walk reaches.
@group(0) @binding(3) var<storage, read> table: array<u32>;

var<workgroup> lows: array<vec4u, 64>;
var<workgroup> highs: array<vec4u, 64>;

// Returns the bounds of nothing.
fn nothing() -> Box {
    return Box(vec4u(0xffffffffu, 0xffffffffu, 0xffffffffu, 0u), vec4u());
}

fn both(a: Box, b: Box) -> Box {
    return Box(min(a.lo, b.lo), max(a.hi, b.hi));
}

fn levels(group: u32, t: u32) {
    let below = base(raise.level);
    let first = below + span(raise.level);
    let second = first + span(raise.level + 1u);
    let third = second + span(raise.level + 2u);
    let at = group * 64u + t;
    var node = nothing();
    if (at < span(raise.level + 1u)) {
        for (var k = at * 8u; k < min(at * 8u + 8u, span(raise.level)); k++) {
            node = both(node, boxes[below + k]);
        }
        boxes[first + at] = node;
    }
    lows[t] = node.lo;
    highs[t] = node.hi;
    workgroupBarrier();
    node = nothing();
    if (t < 8u) {
        for (var k = t * 8u; k < t * 8u + 8u; k++) {
            node = both(node, Box(lows[k], highs[k]));
        }
        if (group * 8u + t < span(raise.level + 2u)) {
            boxes[second + group * 8u + t] = node;
        }
    }
    workgroupBarrier();
    if (t < 8u) {
        lows[t] = node.lo;
        highs[t] = node.hi;
    }
    workgroupBarrier();
    if (t == 0u) {
        node = nothing();
        for (var k = 0u; k < 8u; k++) {
            node = both(node, Box(lows[k], highs[k]));
        }
        boxes[third + group] = node;
    }
}

@compute @workgroup_size(64)
fn raise_all(
    @builtin(workgroup_id) w: vec3u,
    @builtin(num_workgroups) n: vec3u,
    @builtin(local_invocation_index) t: u32,
) {
    let group = w.y * n.x + w.x;
    if (group >= span(raise.level + 3u)) {
        return;
    }
    levels(group, t);
}

@compute @workgroup_size(64)
fn raise_large(
    @builtin(workgroup_id) w: vec3u,
    @builtin(num_workgroups) n: vec3u,
    @builtin(local_invocation_index) t: u32,
) {
    let group = w.y * n.x + w.x;
    let end = (group + 1u) << (3u * (raise.level + 3u));
    if (group >= span(raise.level + 3u) || end <= table[params.large_key]) {
        return;
    }
    levels(group, t);
}
