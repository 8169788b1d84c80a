// Searching the pairs of sorted boxes, one row for each invocation. The next file defines the candidates of a row:
// `search` calls `hit` for each pair. Its `before` returns the number of pairs of the block before a row.
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

// Pairs of this row found in this submission.
var<private> found: u32;
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
    filter_for(boxes[row].lo.w);
    return search(row, state);
}
