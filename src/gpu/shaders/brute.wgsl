// All pairs, a tile of rows against a tile of columns in each workgroup. Tile pairs are numbered along the triangle: 0 is
// tile 0 with itself, 1 and 2 are tile 1 with tiles 0 and 1, and so on.

const TILE: u32 = 128u;
const THREADS: u32 = TILE;
const WORDS: u32 = 4u;

@group(0) @binding(4) var<storage, read_write> sums: array<u32>;
@group(0) @binding(5) var<storage, read_write> pairs: array<vec2<u32>>;

var<workgroup> columns_lo: array<vec4<u32>, TILE>;
// In two, because a word less a column lets more workgroups run at once.
var<workgroup> columns_hi: array<vec2<u32>, TILE>;
var<workgroup> columns_hi_z: array<u32, TILE>;

// The tiles of a pair, the lower one first.
fn tiles(k: u32) -> vec2<u32> {
    // The root is exact to a few units; the two loops correct it.
    var high = u32((sqrt(8.0 * f32(k) + 1.0) - 1.0) * 0.5);
    while (high > 0u && high * (high + 1u) / 2u > k) {
        high--;
    }
    while ((high + 1u) * (high + 2u) / 2u <= k) {
        high++;
    }
    return vec2<u32>(k - high * (high + 1u) / 2u, high);
}

// Which columns overlap the row of this invocation, a bit each; none where nothing is `wanted`.
fn hits(tile: vec2<u32>, t: u32, wanted: bool) -> vec4<u32> {
    let first = tile.y * TILE;
    if (wanted && first + t < params.objects) {
        let b = load_box(first + t);
        columns_lo[t] = b.lo;
        columns_hi[t] = b.hi.xy;
        columns_hi_z[t] = b.hi.z;
    }
    workgroupBarrier();
    let row = tile.x * TILE + t;
    var found = vec4<u32>();
    if (!wanted || row >= params.objects) {
        return found;
    }
    let a = load_box(row);
    let count = min(TILE, params.objects - first);
    // Within one tile each pair once: columns behind the row.
    let begin = select(0u, t + 1u, tile.x == tile.y);
    for (var w = 0u; w < WORDS; w++) {
        var word = 0u;
        let end = min(count, (w + 1u) * 32u);
        for (var c = max(begin, w * 32u); c < end; c++) {
            let lo = columns_lo[c];
            let hi = vec3<u32>(columns_hi[c], columns_hi_z[c]);
            let apart = a.lo.x > hi.x || lo.x > a.hi.x || a.lo.y > hi.y || lo.y > a.hi.y || a.lo.z > hi.z || lo.z > a.hi.z;
            word |= select(1u << (c & 31u), 0u, apart || !owned(a.lo.w, lo.w));
        }
        // All words pass through: compilers may put a vector that is indexed by a variable into memory.
        found = vec4<u32>(found.yzw, word);
    }
    return found;
}

fn ones(found: vec4<u32>) -> u32 {
    let c = countOneBits(found);
    return c.x + c.y + c.z + c.w;
}

@compute @workgroup_size(128)
fn count(@builtin(workgroup_id) w: vec3<u32>, @builtin(num_workgroups) n: vec3<u32>, @builtin(local_invocation_index) t: u32) {
    let block = w.y * n.x + w.x;
    if (block >= params.blocks) {
        return;
    }
    let tile = tiles(params.first + block);
    if (tile.x == tile.y && tile.x * TILE + t < params.objects) {
        check_box(tile.x * TILE + t);
    }
    _ = exclusive(t, ones(hits(tile, t, true)));
    if (t == TILE - 1u) {
        sums[block] = scan[t];
    }
}

@compute @workgroup_size(128)
fn write(@builtin(workgroup_id) w: vec3<u32>, @builtin(num_workgroups) n: vec3<u32>, @builtin(local_invocation_index) t: u32) {
    let block = w.y * n.x + w.x;
    if (block >= params.blocks) {
        return;
    }
    let tile = tiles(params.first + block);
    // Most tile pairs of a large sparse scene hold nothing. They must not return here: some compilers take no barrier behind a
    // branch on what a buffer holds.
    var found = hits(tile, t, sums[block] != sums[block + 1u]);
    // Unsigned wrap-around puts what lies before the window beyond every capacity.
    var at = sums[block] + exclusive(t, ones(found)) - params.window;
    for (var k = 0u; k < WORDS; k++) {
        var word = found.x;
        found = found.yzww;
        while (word != 0u) {
            let c = k * 32u + firstTrailingBit(word);
            word &= word - 1u;
            // A row behind the last box has no bit, and no number.
            if (at < params.capacity) {
                pairs[at] = pair_of(number(tile.x * TILE + t), columns_lo[c].w);
            }
            at++;
        }
    }
}
