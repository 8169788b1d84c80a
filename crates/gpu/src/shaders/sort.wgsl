// One pass of a stable radix sort over 8 bits, least significant digit first. Atomics form only sums and sets of
// bits, so that the result does not depend on timing. No workgroup waits for another, because drivers don't guarantee
// that all of them run at once.
//
// The kernel that writes the keys of a pass counts their digits: `keys.wgsl`, then `scatter` of the previous pass.

const THREADS: u32 = 256u;
// Invocations of a group, which has a bit for each in a word, and groups of a workgroup.
const LANES: u32 = 32u;
const GROUPS: u32 = 8u;
// Digits of a workgroup of `add_counts`.
const TOGETHER: u32 = 8u;

struct Pass {
    number: u32,
    unused_a: u32,
    unused_b: u32,
    unused_c: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> radix: Pass;
@group(0) @binding(2) var<storage, read> keys_in: array<u32>;
@group(0) @binding(3) var<storage, read> values_in: array<u32>;
@group(0) @binding(4) var<storage, read_write> keys_out: array<u32>;
@group(0) @binding(5) var<storage, read_write> values_out: array<u32>;
@group(0) @binding(6) var<storage, read_write> counts: array<atomic<u32>>;
// Where the keys of each digit and block go; see `add_counts`.
@group(0) @binding(7) var<storage, read_write> starts: array<u32>;

// For each group and digit, a bit for each invocation whose key has the digit; then where the first of these keys
// goes.
var<workgroup> masks: array<atomic<u32>, 2048>;

// Turns counts into starts, unless there is one block only. Each workgroup has some digits, and its starts are numbers
// of keys with these digits. The number of all of them comes behind all starts.
@compute @workgroup_size(256)
fn add_counts(@builtin(workgroup_id) w: vec3u, @builtin(local_invocation_index) t: u32) {
    let count = TOGETHER * blocks();
    let first = w.x * count;
    let base = counts_at(radix.number, 0u, 0u);
    let each = (count + THREADS - 1u) / THREADS;
    let begin = first + min(t * each, count);
    let end = first + min(t * each + each, count);
    var own = 0u;
    for (var k = begin; k < end; k++) {
        own += atomicLoad(&counts[base + k]);
    }
    var before = exclusive(t, own);
    for (var k = begin; k < end; k++) {
        starts[k] = before;
        before += atomicLoad(&counts[base + k]);
    }
    if (t == THREADS - 1u) {
        starts[DIGITS * blocks() + w.x] = before;
    }
}

@compute @workgroup_size(256)
fn scatter(
    @builtin(workgroup_id) w: vec3u,
    @builtin(num_workgroups) n: vec3u,
    @builtin(local_invocation_index) t: u32,
) {
    let block = w.y * n.x + w.x;
    if (block >= blocks()) {
        return;
    }
    // Invocation t stands for digit t too: where the next key with that digit goes.
    var keys = 0u;
    var start = 0u;
    if (blocks() == 1u) {
        keys = atomicLoad(&counts[counts_at(radix.number, t, 0u)]);
    } else {
        keys = select(0u, starts[DIGITS * blocks() + t / TOGETHER], t % TOGETHER == TOGETHER - 1u);
        start = starts[t * blocks() + block];
    }
    var next = start + exclusive(t, keys);
    for (var group = 0u; group < GROUPS; group++) {
        atomicStore(&masks[group * DIGITS + t], 0u);
    }
    let lane = t % LANES;
    let group_base = t / LANES * DIGITS;
    for (var first = block * BLOCK; first < (block + 1u) * BLOCK; first += THREADS) {
        let at = first + t;
        let inside = at < params.objects;
        var key = 0u;
        if (inside) {
            key = keys_in[at];
        }
        let word = group_base + digit_of(key, radix.number);
        workgroupBarrier();
        if (inside) {
            atomicOr(&masks[word], 1u << lane);
        }
        workgroupBarrier();
        // Earlier keys of the group with the same digit: the sort is stable.
        let rank = countOneBits(atomicLoad(&masks[word]) & ((1u << lane) - 1u));
        workgroupBarrier();
        for (var group = 0u; group < GROUPS; group++) {
            let held = countOneBits(atomicExchange(&masks[group * DIGITS + t], next));
            next += held;
        }
        workgroupBarrier();
        let to = atomicLoad(&masks[word]) + rank;
        workgroupBarrier();
        for (var group = 0u; group < GROUPS; group++) {
            atomicStore(&masks[group * DIGITS + t], 0u);
        }
        if (inside) {
            var value = at;
            if (radix.number > 0u) {
                value = values_in[at];
            }
            keys_out[to] = key;
            values_out[to] = value;
            if (radix.number + 1u < params.passes) {
                note_digit(radix.number + 1u, key, to);
            }
        }
    }
}
