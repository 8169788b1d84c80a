// One pass of a radix sort over 4 bits: stable, least significant digit first, without atomics on global memory, so that the
// result never depends on timing. No workgroup waits for another: portable drivers don't promise that all of them run.

const THREADS: u32 = 64u;
const EACH: u32 = 16u;
const DIGITS: u32 = 16u;

struct Digit {
    // Bits to the right of the digit.
    shift: u32,
    // 1 in the first pass, where the values are the positions.
    first: u32,
    unused_a: u32,
    unused_b: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> digit: Digit;
@group(0) @binding(2) var<storage, read> keys_in: array<u32>;
@group(0) @binding(3) var<storage, read> values_in: array<u32>;
@group(0) @binding(4) var<storage, read_write> keys_out: array<u32>;
@group(0) @binding(5) var<storage, read_write> values_out: array<u32>;
// For each digit the count of each block; after `scan_digits` how many of that digit stand in the blocks before.
@group(0) @binding(6) var<storage, read_write> counts: array<u32>;
// How often each digit occurs.
@group(0) @binding(7) var<storage, read_write> totals: array<u32>;

var<workgroup> bins: array<atomic<u32>, DIGITS>;
var<workgroup> row: array<u32, 256>;
// Counts of two digits in each word, up to 1024 in 16 bits.
var<workgroup> ranks: array<array<vec4<u32>, 2>, THREADS>;

fn blocks() -> u32 {
    return (params.objects + THREADS * EACH - 1u) / (THREADS * EACH);
}

fn digit_of(key: u32) -> u32 {
    return (key >> digit.shift) & (DIGITS - 1u);
}

@compute @workgroup_size(64)
fn histogram(@builtin(workgroup_id) w: vec3<u32>, @builtin(num_workgroups) n: vec3<u32>, @builtin(local_invocation_index) t: u32) {
    let block = w.y * n.x + w.x;
    if (block >= blocks()) {
        return;
    }
    if (t < DIGITS) {
        atomicStore(&bins[t], 0u);
    }
    workgroupBarrier();
    for (var k = 0u; k < EACH; k++) {
        let at = block * THREADS * EACH + k * THREADS + t;
        if (at < params.objects) {
            atomicAdd(&bins[digit_of(keys_in[at])], 1u);
        }
    }
    workgroupBarrier();
    if (t < DIGITS) {
        counts[t * blocks() + block] = atomicLoad(&bins[t]);
    }
}

// One workgroup a digit.
@compute @workgroup_size(256)
fn scan_digits(@builtin(workgroup_id) w: vec3<u32>, @builtin(local_invocation_index) t: u32) {
    let base = w.x * blocks();
    var before = 0u;
    for (var first = 0u; first < blocks(); first += 256u) {
        let count = min(blocks() - first, 256u);
        let inside = t < count;
        var value = 0u;
        if (inside) {
            value = counts[base + first + t];
        }
        row[t] = value;
        workgroupBarrier();
        for (var step = 1u; step < count; step <<= 1u) {
            var left = 0u;
            if (t >= step) {
                left = row[t - step];
            }
            workgroupBarrier();
            row[t] += left;
            workgroupBarrier();
        }
        if (inside) {
            counts[base + first + t] = before + row[t] - value;
        }
        before += row[count - 1u];
        workgroupBarrier();
    }
    if (t == 0u) {
        totals[w.x] = before;
    }
}

@compute @workgroup_size(64)
fn scatter(@builtin(workgroup_id) w: vec3<u32>, @builtin(num_workgroups) n: vec3<u32>, @builtin(local_invocation_index) t: u32) {
    let block = w.y * n.x + w.x;
    if (block >= blocks()) {
        return;
    }
    let begin = (block * THREADS + t) * EACH;
    let end = min(begin + EACH, params.objects);
    // Each invocation counts its own keys, in order: that keeps the sort stable.
    var own: array<vec4<u32>, 2>;
    for (var at = begin; at < end; at++) {
        let d = digit_of(keys_in[at]);
        own[d >> 3u][(d >> 1u) & 3u] += 1u << ((d & 1u) << 4u);
    }
    ranks[t] = own;
    workgroupBarrier();
    for (var step = 1u; step < THREADS; step <<= 1u) {
        var left: array<vec4<u32>, 2>;
        if (t >= step) {
            left = ranks[t - step];
        }
        workgroupBarrier();
        ranks[t][0] += left[0];
        ranks[t][1] += left[1];
        workgroupBarrier();
    }
    var next = array<u32, DIGITS>();
    var lower = 0u;
    for (var d = 0u; d < DIGITS; d++) {
        let word = ranks[t][d >> 3u][(d >> 1u) & 3u] - own[d >> 3u][(d >> 1u) & 3u];
        next[d] = lower + counts[d * blocks() + block] + ((word >> ((d & 1u) << 4u)) & 0xffffu);
        lower += totals[d];
    }
    for (var at = begin; at < end; at++) {
        let key = keys_in[at];
        let d = digit_of(key);
        let to = next[d];
        next[d] = to + 1u;
        keys_out[to] = key;
        var value = at;
        if (digit.first == 0u) {
            value = values_in[at];
        }
        values_out[to] = value;
    }
}
