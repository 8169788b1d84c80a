// Counting the pairs of each row. The first ones are kept.

fn hit(row: u32, a: u32, b: u32) {
    if (!owned(a, b) || !passes(b)) {
        return;
    }
    if (found < KEPT) {
        kept[found * params.objects + row] = b;
    }
    found++;
}

@compute @workgroup_size(64)
fn count(@builtin(workgroup_id) w: vec3u, @builtin(num_workgroups) n: vec3u, @builtin(local_invocation_index) t: u32) {
    let block = w.y * n.x + w.x;
    let row = block * THREADS + t;
    if (block >= params.blocks || row >= params.objects) {
        return;
    }
    let state = test_row(row);
    rows[row] = found;
    rows[state_at(row, params.round + 1u)] = state;
    if (state != DONE) {
        atomicStore(&header.more, 1u);
    }
    if (found > 0u) {
        atomicAdd(&sums[block], found);
    }
}
