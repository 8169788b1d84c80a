// Counting sort by cell. `keys.wgsl` has counted the boxes of each cell. The counts become the table of where each
// cell begins, which the search reads too; then each box gets its place.

const THREADS: u32 = 256u;
// Cells of one workgroup.
const EACH: u32 = 4096u;

@group(0) @binding(0) var<uniform> params: Params;
// The counts of the cells, four in each element; `begin` replaces them by where each cell begins. Whole blocks of
// `EACH`; zero behind the last cell.
@group(0) @binding(1) var<storage, read_write> cells: array<vec4u>;
// The sum of each block.
@group(0) @binding(2) var<storage, read_write> sums: array<u32>;
// Where each cell begins.
@group(0) @binding(3) var<storage, read> table: array<u32>;
@group(0) @binding(4) var<storage, read> keys: array<vec2u>;
@group(0) @binding(5) var<storage, read> ranks: array<u32>;
@group(0) @binding(6) var<storage, read_write> order: array<u32>;

fn total(v: vec4u) -> u32 {
    return v.x + v.y + v.z + v.w;
}

// Returns the sums before each of four counts, if `first` is the sum before the first.
fn starts(first: u32, v: vec4u) -> vec4u {
    return vec4u(first, first + v.x, first + v.x + v.y, first + v.x + v.y + v.z);
}

@compute @workgroup_size(256)
fn add_up(@builtin(workgroup_id) w: vec3u, @builtin(num_workgroups) n: vec3u, @builtin(local_invocation_index) t: u32) {
    let block = w.y * n.x + w.x;
    if (block >= params.cell_blocks) {
        return;
    }
    let at = block * (EACH / 4u) + t;
    let own = cells[at] + cells[at + THREADS] + cells[at + 2u * THREADS] + cells[at + 3u * THREADS];
    let all_own = sum(t, total(own));
    if (t == 0u) {
        sums[block] = all_own;
    }
}

@compute @workgroup_size(256)
fn begin(@builtin(workgroup_id) w: vec3u, @builtin(num_workgroups) n: vec3u, @builtin(local_invocation_index) t: u32) {
    let block = w.y * n.x + w.x;
    if (block >= params.cell_blocks) {
        return;
    }
    var before = 0u;
    for (var k = t; k < block; k += THREADS) {
        before += sums[k];
    }
    let at = block * (EACH / 4u) + t * 4u;
    let a = cells[at];
    let b = cells[at + 1u];
    let c = cells[at + 2u];
    let d = cells[at + 3u];
    let first = sum(t, before) + exclusive(t, total(a + b + c + d));
    cells[at] = starts(first, a);
    cells[at + 1u] = starts(first + total(a), b);
    cells[at + 2u] = starts(first + total(a + b), c);
    cells[at + 3u] = starts(first + total(a + b + c), d);
}

@compute @workgroup_size(256)
fn put(@builtin(workgroup_id) w: vec3u, @builtin(num_workgroups) n: vec3u, @builtin(local_invocation_index) t: u32) {
    let at = (w.y * n.x + w.x) * THREADS + t;
    if (at < params.objects) {
        order[table[keys[at].x] + ranks[at]] = at;
    }
}
