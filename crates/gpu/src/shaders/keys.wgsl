// The key of each box, and the counts of first digits or of cells, for the sort.

// Radix sort: a key. Counting sort: the cell, then `Box.hi.w`.
@group(0) @binding(4) var<storage, read_write> keys: array<u32>;
// The number of boxes for each digit and block of the first pass, or for each cell. Cleared before.
@group(0) @binding(5) var<storage, read_write> counts: array<atomic<u32>>;
// The rank of each box in its cell, in random order, which `gather_cells` replaces by that of the input.
@group(0) @binding(6) var<storage, read_write> ranks: array<u32>;

fn invocation(w: vec3u, n: vec3u, t: u32) -> u32 {
    return (w.y * n.x + w.x) * 256u + t;
}

fn put_key(at: u32, key: u32) {
    check_box(at);
    keys[at] = key;
    note_digit(0u, key, at);
}

@compute @workgroup_size(256)
fn sweep_keys(
    @builtin(workgroup_id) w: vec3u,
    @builtin(num_workgroups) n: vec3u,
    @builtin(local_invocation_index) t: u32,
) {
    let at = invocation(w, n, t);
    if (at < params.objects) {
        put_key(at, order_key(bound(at, 0u, 0u)));
    }
}

@compute @workgroup_size(256)
fn curve_keys(
    @builtin(workgroup_id) w: vec3u,
    @builtin(num_workgroups) n: vec3u,
    @builtin(local_invocation_index) t: u32,
) {
    let at = invocation(w, n, t);
    if (at < params.objects) {
        put_key(at, curve(at) >> params.curve_shift);
    }
}

// Returns the first and the last cell of a box on an axis of the grid.
fn cells_of(at: u32, axis: u32) -> vec2u {
    let base = GRID + axis * PARTS;
    return vec2u(cell(tame(bound(at, 0u, axis)), base), cell(tame(bound(at, 1u, axis)), base));
}

@compute @workgroup_size(256)
fn cell_keys(
    @builtin(workgroup_id) w: vec3u,
    @builtin(num_workgroups) n: vec3u,
    @builtin(local_invocation_index) t: u32,
) {
    let at = invocation(w, n, t);
    if (at >= params.objects) {
        return;
    }
    check_box(at);
    let x = cells_of(at, 0u);
    let y = cells_of(at, 1u);
    let z = cells_of(at, 2u);
    let more = vec3u(x.y - x.x, y.y - y.x, z.y - z.x);
    var key = (z.x * params.cells.x + y.x) * params.slots + x.x;
    var reach = more.x | (more.y << 30u) | (more.z << 31u);
    // An inverted box, or one with a NaN, may end before it begins. It is reported, but searched first: its reach would
    // lie outside the table. On the other two axes the difference is huge.
    let is_long =
        x.y < x.x || (more.x > 16u && tame(bound(at, 1u, 0u)) - tame(bound(at, 0u, 0u)) > params.longest);
    if (is_long || more.y > 1u || more.z > 1u) {
        key = params.large_key + (curve(at) >> params.curve_shift);
        reach = 0u;
    }
    keys[at * 2u] = key;
    keys[at * 2u + 1u] = reach;
    ranks[at] = atomicAdd(&counts[key], 1u);
}
