// Counting and writing the pairs of sorted boxes, one row for each invocation. The next file defines the candidates
// of a row: `search` calls `hit` for each pair. Its `before` returns the number of pairs of the block before a row.
//
// A row is tested with `params.budget` candidates in one submission and goes on in the next. Drivers give up on a
// dispatch that takes seconds, and some end loops silently: lavapipe after 65 535 turns of all loops of an invocation
// together.

const THREADS: u32 = 64u;
// Pairs that a row keeps while it counts, so that most rows are searched once.
const KEPT: u32 = 8u;
// The state of a row without further candidates.
const DONE: u32 = 0xffffffffu;

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> keys: array<u32>;
@group(0) @binding(2) var<storage, read> boxes: array<Box>;
@group(0) @binding(3) var<storage, read_write> header: Header;
// The number of pairs of each block, cleared before `count`; then the position of its first pair.
@group(0) @binding(4) var<storage, read_write> sums: array<atomic<u32>>;
@group(0) @binding(5) var<storage, read_write> pairs: array<vec2u>;
// The number of pairs of each row in this submission; then the states of all rows before even submissions, then
// before odd ones.
@group(0) @binding(6) var<storage, read_write> rows: array<u32>;
// The partner in the first pair of each row, then in the second, and so on.
@group(0) @binding(7) var<storage, read_write> kept: array<u32>;

var<private> writing: bool;
// Pairs of this row found in this submission.
var<private> found: u32;
// Position of the first pair of this row in `pairs`.
var<private> start: u32;
// Candidates and nodes left in the budget of this row.
var<private> left: u32;

fn state_at(row: u32, round: u32) -> u32 {
    return (1u + (round & 1u)) * params.objects + row;
}

// Tests a row with its next candidates. Returns its new state.
fn test_row(row: u32) -> u32 {
    var state = first_state(row);
    if (params.round > 0u) {
        state = rows[state_at(row, params.round)];
        if (state == DONE) {
            return DONE;
        }
    }
    left = params.budget;
    return search(row, state);
}

fn store(at: u32, pair: vec2u) {
    // Positions before the window wrap around to numbers beyond every capacity.
    if (at < params.capacity) {
        pairs[at] = pair;
    }
}

fn hit(row: u32, a: u32, b: u32) {
    if (!owned(a, b)) {
        return;
    }
    if (writing) {
        store(start + found, pair_of(a, b));
    } else if (found < KEPT) {
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
        writing = true;
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
