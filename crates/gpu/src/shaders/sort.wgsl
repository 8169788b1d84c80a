// One pass of a stable radix sort over 8 bits, least significant digit first. Atomics form only sums and sets of
// bits, so that the result does not depend on timing. No workgroup waits for another, because drivers don't guarantee
// that all of them run at once.
//
// The kernel that writes the keys of a pass counts their digits: `keys.wgsl`, then `scatter` of the previous pass.

const THREADS: u32 = 256u;
// Invocations of a group, which has a bit for each in a word, and groups of a workgroup.
const LANES: u32 = 32u;
const GROUPS: u32 = 8u;
// Counts for each invocation of `add_counts`.
const EACH: u32 = 16u;

struct Pass {
    number: u32,
    // 1 in the last pass, after which no digit is left to count.
    last: u32,
    unused_a: u32,
    unused_b: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> radix: Pass;
@group(0) @binding(2) var<storage, read> keys_in: array<u32>;
@group(0) @binding(3) var<storage, read> values_in: array<u32>;
@group(0) @binding(4) var<storage, read_write> keys_out: array<u32>;
@group(0) @binding(5) var<storage, read_write> values_out: array<u32>;
@group(0) @binding(6) var<storage, read_write> counts: array<atomic<u32>>;
// Where the keys of each digit and block go: the number of keys before them.
@group(0) @binding(7) var<storage, read_write> starts: array<u32>;

// For each group and digit, a bit for each invocation whose key has the digit; then where the first of these keys
// goes.
var<workgroup> masks: array<atomic<u32>, 2048>;

// Turns counts into starts. Each workgroup adds up all counts before its own: they are few and cached, and one
// dispatch less saves more.
@compute @workgroup_size(256)
fn add_counts(
    @builtin(workgroup_id) w: vec3u,
    @builtin(num_workgroups) n: vec3u,
    @builtin(local_invocation_index) t: u32,
) {
    let count = DIGITS * blocks();
    let first = (w.y * n.x + w.x) * EACH * THREADS;
    if (first >= count) {
        return;
    }
    let base = counts_at(radix.number, 0u, 0u);
    var before = 0u;
    for (var k = t; k < first; k += THREADS) {
        before += atomicLoad(&counts[base + k]);
    }
    var own = 0u;
    let begin = first + t * EACH;
    let end = min(begin + EACH, count);
    for (var k = begin; k < end; k++) {
        own += atomicLoad(&counts[base + k]);
    }
    _ = exclusive(t, before);
    before = scan[THREADS - 1u];
    workgroupBarrier();
    before += exclusive(t, own);
    for (var k = begin; k < end; k++) {
        starts[k] = before;
        before += atomicLoad(&counts[base + k]);
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
    var next = starts[t * blocks() + block];
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
            if (radix.last == 0u) {
                note_digit(radix.number + 1u, key, to);
            }
        }
    }
}
