// A row is tested with the boxes behind it, up to the first that begins after its end.

fn before(row: u32, t: u32, count: u32) -> u32 {
    return exclusive(t, count);
}

// The state is the position of the next candidate.
fn first_state(row: u32) -> u32 {
    return row + 1u;
}

fn search(row: u32, state: u32) -> u32 {
    let a = boxes[row];
    let end = min(state + left, params.objects);
    for (var j = state; j < end; j++) {
        let b = boxes[j];
        if (b.lo.x > a.hi.x) {
            return DONE;
        }
        if (overlap_across(a, b)) {
            hit(row, a.lo.w, b.lo.w);
        }
    }
    if (end < params.objects && boxes[end].lo.x <= a.hi.x) {
        return end;
    }
    return DONE;
}
