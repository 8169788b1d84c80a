// One pass of a radix sort over 8 bits: stable, least significant digit first. Atomics form sums and sets of bits only, so that the
// result never depends on timing. No workgroup waits for another: portable drivers don't promise that all of them run.
//
// The digits of a pass are counted by whoever writes its keys: `keys.wgsl`, then the scatter of the pass before.

const THREADS: u32 = 256u;
// Invocations whose keys one word of a mask tells apart, and such groups in a workgroup.
const LANES: u32 = 32u;
const GROUPS: u32 = 8u;
// Counts that an invocation adds up.
const EACH: u32 = 16u;

struct Pass {
    number: u32,
    // 1 in the last one: no digit is left to count.
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
// Where the keys of each digit and block go: how many keys stand before them.
@group(0) @binding(7) var<storage, read_write> starts: array<u32>;

// For each group and digit the invocations that hold it, a bit each; then where the first of them goes.
var<workgroup> masks: array<atomic<u32>, 2048>;

// Turns counts into starts, digit by digit and block by block. Each workgroup adds up all that stands before its own counts: they are few
// and lie in a cache, and a dispatch less is worth more.
@compute @workgroup_size(256)
fn add_counts(@builtin(workgroup_id) w: vec3<u32>, @builtin(num_workgroups) n: vec3<u32>, @builtin(local_invocation_index) t: u32) {
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
fn scatter(@builtin(workgroup_id) w: vec3<u32>, @builtin(num_workgroups) n: vec3<u32>, @builtin(local_invocation_index) t: u32) {
    let block = w.y * n.x + w.x;
    if (block >= blocks()) {
        return;
    }
    // As a digit, this invocation knows where its next key goes.
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
        // Keys of this digit before this one in its group, which keeps the sort stable.
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
