// Counting and writing the pairs of sorted boxes, one row an invocation. The file that follows says which boxes a row is
// tested with: `search(row)` calls `hit` for each pair.

const THREADS: u32 = 64u;
// Pairs of a row that are kept while they are counted, so that most rows are searched once.
const KEPT: u32 = 4u;
// Candidates that a row is tested with in one submission; more come in further ones. Some drivers end a loop silently: lavapipe
// after 65 535 turns of all loops of an invocation together. Others give up on a dispatch that takes seconds.
const CANDIDATES: u32 = 32768u;

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> keys: array<u32>;
@group(0) @binding(2) var<storage, read> boxes: array<Box>;
@group(0) @binding(3) var<storage, read_write> header: Header;
@group(0) @binding(4) var<storage, read_write> sums: array<u32>;
@group(0) @binding(5) var<storage, read_write> pairs: array<vec2<u32>>;
@group(0) @binding(6) var<storage, read_write> counts: array<u32>;
@group(0) @binding(7) var<storage, read_write> kept: array<u32>;

var<private> writing: bool;
// Hits of this row so far.
var<private> found: u32;
// Position of the row's first pair in `pairs`.
var<private> start: u32;
// Candidates of this row that earlier submissions tested and that are yet to be passed over, and those that are left to this one.
var<private> passed: u32;
var<private> left: u32;
// Whether there are candidates beyond those.
var<private> more: bool;

// The part of the candidates from `begin` to `end` that this submission tests.
fn part(begin: u32, end: u32) -> vec2<u32> {
    let over = min(passed, end - begin);
    passed -= over;
    let taken = min(left, end - begin - over);
    left -= taken;
    more = more || taken < end - begin - over;
    return vec2<u32>(begin + over, begin + over + taken);
}

fn test_row(row: u32) {
    passed = params.first;
    left = CANDIDATES;
    search(row);
}

fn store(at: u32, pair: vec2<u32>) {
    // Unsigned wrap-around puts what lies before the window beyond every capacity.
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
        kept[row * KEPT + found] = b;
    }
    found++;
}

@compute @workgroup_size(64)
fn count(@builtin(workgroup_id) w: vec3<u32>, @builtin(num_workgroups) n: vec3<u32>, @builtin(local_invocation_index) t: u32) {
    let block = w.y * n.x + w.x;
    if (block >= params.blocks) {
        return;
    }
    let row = block * THREADS + t;
    if (row < params.objects) {
        test_row(row);
        counts[row] = found;
        if (more) {
            atomicStore(&header.more, 1u);
        }
    }
    _ = exclusive(t, found);
    if (t == THREADS - 1u) {
        sums[block] = scan[t];
    }
}

@compute @workgroup_size(64)
fn write(@builtin(workgroup_id) w: vec3<u32>, @builtin(num_workgroups) n: vec3<u32>, @builtin(local_invocation_index) t: u32) {
    let block = w.y * n.x + w.x;
    if (block >= params.blocks) {
        return;
    }
    let row = block * THREADS + t;
    var count = 0u;
    if (row < params.objects) {
        count = counts[row];
    }
    start = sums[block] + exclusive(t, count) - params.window;
    if (count > KEPT) {
        writing = true;
        test_row(row);
        return;
    }
    if (count == 0u) {
        return;
    }
    let a = boxes[row].lo.w;
    for (var k = 0u; k < count; k++) {
        store(start + k, pair_of(a, kept[row * KEPT + k]));
    }
}
