// A row is tested with the boxes that begin within its length on the sweep axis, in its own strip and those beside it: no box but those
// kept apart reaches further than the strip after its own. Those kept apart are in a tree.

// Position of the first box of each slot of each strip; behind the last slot those of the boxes kept apart, along a curve.
@group(0) @binding(8) var<storage, read> table: array<u32>;

// A state with this bit is a position in the tree, one without it the number of candidates that were tested.
const WALKING: u32 = 0x80000000u;

fn first_state(row: u32) -> u32 {
    return 0u;
}

// Tests a row of a strip with those that begin in the cells it covers. Returns `DONE`, or how many it was tested with.
fn search_cells(row: u32, a: Box, state: u32) -> u32 {
    let key = keys[row];
    let strip = key / params.slots;
    let first = vec2<u32>(strip % params.cells.x, strip / params.cells.x);
    // The cells before the first one, which may reach into it, and behind it those that hi.w has a bit for, on each axis across.
    let before = vec2<u32>(min(first.x, 1u), min(first.y, 1u));
    let cells = before + 1u + vec2<u32>((a.hi.w >> 30u) & 1u, a.hi.w >> 31u);
    let corner = key - (before.y * params.cells.x + before.x) * params.slots;
    // hi.w: slots to the last one covered.
    let slots = (a.hi.w & 0x3fffffffu) + 1u;
    var passed = state;
    for (var k = 0u; k < cells.x * cells.y; k++) {
        let begins = corner + (k / cells.x * params.cells.x + k % cells.x) * params.slots;
        var j = table[begins];
        let candidates = table[begins + slots] - j;
        // Those that an earlier submission has tested.
        let over = min(passed, candidates);
        passed -= over;
        j += over;
        let taken = min(left, candidates - over);
        left -= taken;
        for (let end = j + taken; j < end; j++) {
            let b = boxes[j];
            // Of two boxes the one that begins first reports the pair, of two that begin together the one that stands first.
            let behind = b.lo.x > a.lo.x || (b.lo.x == a.lo.x && j > row);
            if (behind && b.lo.x <= a.hi.x && overlap_across(a, b)) {
                hit(row, a.lo.w, b.lo.w);
            }
        }
        if (over + taken < candidates) {
            return state + params.budget - left;
        }
    }
    return DONE;
}

fn search(row: u32, state: u32) -> u32 {
    let a = boxes[row];
    let large = table[params.large_key];
    var begin = max(row + 1u, large);
    if (state >= WALKING) {
        begin = state & ~WALKING;
    } else if (row < large) {
        let tested = search_cells(row, a, state);
        if (tested != DONE) {
            return tested;
        }
    }
    let next = walk(row, a, begin);
    return select(next | WALKING, DONE, next == DONE);
}
