// Turns the counts of blocks into the position of each block's first pair, in place, and adds up all pairs in 64
// bits. One workgroup goes through the list.

const THREADS: u32 = 256u;
const EACH: u32 = 16u;
// Most workgroups on an axis of a dispatch that every GPU takes.
const MOST_GROUPS: u32 = 65535u;

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(3) var<storage, read_write> header: Header;
// Whole blocks of `THREADS * EACH` counts.
@group(0) @binding(4) var<storage, read_write> sums: array<vec4u>;

// The lower and the upper 16 bits are summed separately, so that no sum exceeds 32 bits.
var<workgroup> scan: array<vec2u, THREADS>;

fn total(v: vec4u) -> u32 {
    return v.x + v.y + v.z + v.w;
}

@compute @workgroup_size(256)
fn positions(@builtin(local_invocation_index) t: u32) {
    var before = vec2u();
    // The position behind the last block is the number of pairs.
    for (var first = 0u; first <= params.blocks; first += THREADS * EACH) {
        let begin = first + t * EACH;
        // Invocations with a block, or with the position behind the last one.
        let count = clamp((params.blocks - first) / EACH + 1u, 1u, THREADS);
        var counts: array<vec4u, EACH / 4u>;
        var own = vec2u();
        for (var k = 0u; k < EACH / 4u; k++) {
            let at = begin + k * 4u;
            let inside = vec4u(at, at + 1u, at + 2u, at + 3u) < vec4u(params.blocks);
            let value = select(vec4u(), sums[at / 4u], inside);
            counts[k] = value;
            own += vec2u(total(value & vec4u(0xffffu)), total(value >> vec4u(16u)));
        }
        scan[t] = own;
        workgroupBarrier();
        for (var step = 1u; step < count; step <<= 1u) {
            var left = vec2u();
            if (t >= step) {
                left = scan[t - step];
            }
            workgroupBarrier();
            scan[t] += left;
            workgroupBarrier();
        }
        let mine = before + scan[t] - own;
        var position = mine.x + (mine.y << 16u);
        for (var k = 0u; k < EACH / 4u; k++) {
            let v = counts[k];
            sums[begin / 4u + k] = position + vec4u(0u, v.x, v.x + v.y, v.x + v.y + v.z);
            position += total(v);
        }
        before += scan[count - 1u];
        before = vec2u(before.x & 0xffffu, before.y + (before.x >> 16u));
        workgroupBarrier();
    }
    if (t == 0u) {
        header.total_low = before.x | (before.y << 16u);
        header.total_high = before.y >> 16u;
        let held = select(min(header.total_low, params.capacity), params.capacity, header.total_high > 0u);
        let groups = held / 64u + min(held % 64u, 1u);
        header.groups_x = min(groups, MOST_GROUPS);
        header.groups_y = (groups + MOST_GROUPS - 1u) / MOST_GROUPS;
        header.groups_z = 1u;
        header.held = held;
        header.ran = params.submission;
    }
}
