// A row is tested with the boxes that begin within its length on the sweep axis, in its own strip and its neighbours:
// only oversized boxes reach further than the next strip. Oversized boxes are in a tree.

// Position of the first box of each slot of each strip, and then of each cell of oversized boxes, along the curve.
@group(0) @binding(8) var<storage, read> table: array<u32>;

// A state with this bit is a position in the tree. Without it, it is the number of candidates tested so far.
const WALKING: u32 = 0x80000000u;

fn before(row: u32, t: u32, count: u32) -> u32 {
    return exclusive(t, count);
}

fn first_state(row: u32) -> u32 {
    return 0u;
}

// Tests a row with the boxes that begin in the cells it covers. Returns `DONE`, or the number of candidates tested so
// far.
fn search_cells(row: u32, a: Box, state: u32) -> u32 {
    let key = keys[row];
    let strip = key / params.slots;
    let first = vec2u(strip % params.cells.x, strip / params.cells.x);
    // On each of the other two axes: the cell before its first one, whose boxes may reach into it, its first, and the
    // next if hi.w has the bit for it.
    let before = vec2u(min(first.x, 1u), min(first.y, 1u));
    let cells = before + 1u + vec2u((a.hi.w >> 30u) & 1u, a.hi.w >> 31u);
    let corner = key - (before.y * params.cells.x + before.x) * params.slots;
    // The lower bits of hi.w: slots from the first to the last covered one.
    let slots = (a.hi.w & 0x3fffffffu) + 1u;
    var passed = state;
    for (var k = 0u; k < cells.x * cells.y; k++) {
        let begins = corner + (k / cells.x * params.cells.x + k % cells.x) * params.slots;
        var j = table[begins];
        let candidates = table[begins + slots] - j;
        // Earlier submissions have tested these.
        let over = min(passed, candidates);
        passed -= over;
        j += over;
        let taken = min(left, candidates - over);
        left -= taken;
        for (let end = j + taken; j < end; j++) {
            let b = boxes[j];
            // The box that begins first reports the pair; if both begin together, the one with the lower position.
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
