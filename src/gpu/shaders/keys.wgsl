// Before the sort a key for each box, after it the boxes in the order of their keys.

@group(0) @binding(4) var<storage, read_write> keys: array<u32>;
@group(0) @binding(5) var<storage, read> order: array<u32>;
@group(0) @binding(6) var<storage, read_write> sorted: array<Box>;
// For each box, by position in the input, what `Box.hi.w` holds in strips.
@group(0) @binding(7) var<storage, read_write> reach: array<u32>;

fn invocation(w: vec3<u32>, n: vec3<u32>, t: u32) -> u32 {
    return (w.y * n.x + w.x) * 256u + t;
}

@compute @workgroup_size(256)
fn sweep_keys(@builtin(workgroup_id) w: vec3<u32>, @builtin(num_workgroups) n: vec3<u32>, @builtin(local_invocation_index) t: u32) {
    let at = invocation(w, n, t);
    if (at < params.objects) {
        check_box(at);
        keys[at] = order_key(bound(at, 0u, 0u));
    }
}

@compute @workgroup_size(256)
fn sweep_gather(@builtin(workgroup_id) w: vec3<u32>, @builtin(num_workgroups) n: vec3<u32>, @builtin(local_invocation_index) t: u32) {
    let at = invocation(w, n, t);
    if (at < params.objects) {
        sorted[at] = load_box(order[at]);
    }
}

// The slot or cell of a bound, which never descends as the bound ascends: that alone makes the strips correct. It is worked
// out in this one kernel only, because another might round in another way. Bounds outside go to the border cells.
fn cell(bits: u32, axis: u32, cells: u32) -> u32 {
    // Infinities are clamped first: infinity times an inverse of zero is not a number.
    let v = clamp(bitcast<f32>(bits), -3.0e38, 3.0e38);
    let c = (v - params.origin[axis]) * params.inverse[axis];
    return min(u32(clamp(c, 0.0, f32(cells - 1u))), cells - 1u);
}

@compute @workgroup_size(256)
fn strip_keys(@builtin(workgroup_id) w: vec3<u32>, @builtin(num_workgroups) n: vec3<u32>, @builtin(local_invocation_index) t: u32) {
    let at = invocation(w, n, t);
    if (at >= params.objects) {
        return;
    }
    check_box(at);
    let first = vec3<u32>(
        cell(bound(at, 0u, 0u), 0u, params.slots),
        cell(bound(at, 0u, 1u), 1u, params.cells.x),
        cell(bound(at, 0u, 2u), 2u, params.cells.y),
    );
    let last = vec3<u32>(
        cell(bound(at, 1u, 0u), 0u, params.slots),
        cell(bound(at, 1u, 1u), 1u, params.cells.x),
        cell(bound(at, 1u, 2u), 2u, params.cells.y),
    );
    let span = last - first;
    if (span.x > params.longest || span.y > 1u || span.z > 1u) {
        keys[at] = params.large_key;
        reach[at] = 0u;
    } else {
        keys[at] = (first.z * params.cells.x + first.y) * params.slots + first.x;
        reach[at] = span.x | (span.y << 30u) | (span.z << 31u);
    }
}

@compute @workgroup_size(256)
fn strip_gather(@builtin(workgroup_id) w: vec3<u32>, @builtin(num_workgroups) n: vec3<u32>, @builtin(local_invocation_index) t: u32) {
    let at = invocation(w, n, t);
    if (at < params.objects) {
        let source = order[at];
        var b = load_box(source);
        b.hi.w = reach[source];
        sorted[at] = b;
    }
}
