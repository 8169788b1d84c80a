// Writing the pairs of each row: those that it kept, or those of a second search if they were more.

// Position of the first pair of this row in `pairs`.
var<private> start: u32;

fn store(at: u32, pair: vec2u) {
    // Positions before the window wrap around to numbers beyond every capacity.
    if (at < params.capacity) {
        pairs[at] = pair;
    }
}

fn hit(row: u32, a: u32, b: u32) {
    if (owned(a, b) && passes(b)) {
        store(start + found, pair_of(a, b));
        found++;
    }
}

@compute @workgroup_size(64)
fn write(@builtin(workgroup_id) w: vec3u, @builtin(num_workgroups) n: vec3u, @builtin(local_invocation_index) t: u32) {
    let block = w.y * n.x + w.x;
    if (block >= params.blocks) {
        return;
    }
    let row = block * THREADS + t;
    var count = 0u;
    if (row < params.objects) {
        count = rows[row];
    }
    start = atomicLoad(&sums[block]) + before(row, t, count) - params.window;
    if (count > KEPT) {
        _ = test_row(row);
        return;
    }
    if (count == 0u) {
        return;
    }
    let a = boxes[row].lo.w;
    for (var k = 0u; k < count; k++) {
        store(start + k, pair_of(a, kept[k * params.objects + row]));
    }
}
