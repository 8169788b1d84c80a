// Copies the boxes into the order of their keys, after the sort.

@group(0) @binding(4) var<storage, read> order: array<u32>;
@group(0) @binding(5) var<storage, read_write> sorted: array<Box>;
// `gather_cells` only: cell and reach of each box of the input, where each cell begins, and the cells of the sorted
// boxes.
@group(0) @binding(6) var<storage, read> keys: array<vec2u>;
@group(0) @binding(7) var<storage, read> table: array<u32>;
@group(0) @binding(8) var<storage, read_write> sorted_keys: array<u32>;

@compute @workgroup_size(256)
fn gather(@builtin(workgroup_id) w: vec3u, @builtin(num_workgroups) n: vec3u, @builtin(local_invocation_index) t: u32) {
    let at = (w.y * n.x + w.x) * 256u + t;
    if (at < params.objects) {
        sorted[at] = load_box(order[at]);
    }
}

@compute @workgroup_size(256)
fn gather_cells(
    @builtin(workgroup_id) w: vec3u,
    @builtin(num_workgroups) n: vec3u,
    @builtin(local_invocation_index) t: u32,
) {
    let at = (w.y * n.x + w.x) * 256u + t;
    if (at >= params.objects) {
        return;
    }
    let source = order[at];
    let key = keys[source];
    let begin = table[key.x];
    let end = table[key.x + 1u];
    var to = at;
    // The counting sort leaves the boxes of a cell in random order. Here they get that of the input, so that the
    // order of the pairs does not depend on timing. Each box looks at its whole cell for that, unless the cell has
    // more boxes than a row may be tested with.
    if (end - begin <= params.budget) {
        to = begin;
        for (var k = begin; k < end; k++) {
            to += u32(order[k] < source);
        }
    }
    var b = load_box(source);
    b.hi.w = key.y;
    sorted[to] = b;
    sorted_keys[to] = key.x;
}
