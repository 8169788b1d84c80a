// All pairs. Each workgroup tests a tile of rows against a tile of columns. Tile pairs are numbered along the
// triangle: 0 is tile 0 with itself, 1 and 2 are tile 1 with tiles 0 and 1, and so on.

const TILE: u32 = 128u;
const THREADS: u32 = TILE;
const WORDS: u32 = 4u;

@group(0) @binding(4) var<storage, read_write> sums: array<u32>;
@group(0) @binding(5) var<storage, read_write> pairs: array<vec2u>;

var<workgroup> columns_lo: array<vec4u, TILE>;
// Two arrays: a vec3 would be padded, and with a word less for each column more workgroups run at once.
var<workgroup> columns_hi: array<vec2u, TILE>;
var<workgroup> columns_hi_z: array<u32, TILE>;

// Returns the tiles of a pair, the lower one first.
fn tiles(k: u32) -> vec2u {
    // The root is exact to a few units; the two loops correct it.
    var high = u32((sqrt(8.0 * f32(k) + 1.0) - 1.0) * 0.5);
    while (high > 0u && high * (high + 1u) / 2u > k) {
        high--;
    }
    while ((high + 1u) * (high + 2u) / 2u <= k) {
        high++;
    }
    return vec2u(k - high * (high + 1u) / 2u, high);
}

// Returns a bit for each column that overlaps the row of this invocation; no bit unless `wanted`.
fn hits(tile: vec2u, t: u32, wanted: bool) -> vec4u {
    let first = tile.y * TILE;
    if (wanted && first + t < params.objects) {
        let b = load_box(first + t);
        columns_lo[t] = b.lo;
        columns_hi[t] = b.hi.xy;
        columns_hi_z[t] = b.hi.z;
    }
    workgroupBarrier();
    let row = tile.x * TILE + t;
    var found = vec4u();
    if (!wanted || row >= params.objects) {
        return found;
    }
    let a = load_box(row);
    filter_for(a.lo.w);
    let count = min(TILE, params.objects - first);
    // Within one tile, only columns behind the row: each pair once.
    let begin = select(0u, t + 1u, tile.x == tile.y);
    for (var w = 0u; w < WORDS; w++) {
        var word = 0u;
        let end = min(count, (w + 1u) * 32u);
        for (var c = max(begin, w * 32u); c < end; c++) {
            let lo = columns_lo[c];
            let hi = vec3u(columns_hi[c], columns_hi_z[c]);
            let apart = a.lo.x > hi.x || lo.x > a.hi.x || a.lo.y > hi.y || lo.y > a.hi.y || a.lo.z > hi.z
                || lo.z > a.hi.z;
            word |= select(1u << (c & 31u), 0u, apart || !owned(a.lo.w, lo.w) || !passes(lo.w));
        }
        // Shifted rather than indexed by `w`: compilers may put a vector with a variable index into memory.
        found = vec4u(found.yzw, word);
    }
    return found;
}

fn ones(found: vec4u) -> u32 {
    let c = countOneBits(found);
    return c.x + c.y + c.z + c.w;
}

@compute @workgroup_size(128)
fn count(@builtin(workgroup_id) w: vec3u, @builtin(num_workgroups) n: vec3u, @builtin(local_invocation_index) t: u32) {
    let block = w.y * n.x + w.x;
    if (block >= params.blocks) {
        return;
    }
    let tile = tiles(params.first + block);
    if (tile.x == tile.y && tile.x * TILE + t < params.objects) {
        check_box(tile.x * TILE + t);
    }
    let found = sum(t, ones(hits(tile, t, true)));
    if (t == 0u) {
        sums[block] = found;
    }
}

@compute @workgroup_size(128)
fn write(@builtin(workgroup_id) w: vec3u, @builtin(num_workgroups) n: vec3u, @builtin(local_invocation_index) t: u32) {
    let block = w.y * n.x + w.x;
    if (block >= params.blocks) {
        return;
    }
    let tile = tiles(params.first + block);
    // Most tile pairs of a large sparse scene have no pairs. They can't return here: some compilers allow no barrier
    // after a branch on the content of a buffer.
    var found = hits(tile, t, sums[block] != sums[block + 1u]);
    // Positions before the window wrap around to numbers beyond every capacity.
    var at = sums[block] + exclusive(t, ones(found)) - params.window;
    for (var k = 0u; k < WORDS; k++) {
        var word = found.x;
        found = found.yzww;
        while (word != 0u) {
            let c = k * 32u + firstTrailingBit(word);
            word &= word - 1u;
            // Rows behind the last box have no bits.
            if (at < params.capacity) {
                pairs[at] = pair_of(number(tile.x * TILE + t), columns_lo[c].w);
            }
            at++;
        }
    }
}
