// The parameters of a frame, and bounds as integers, for all kernels.
//
// Bounds are compared as integers in the order of the floats. Float comparisons would be shorter, but drivers may
// flush denormals to zero and may assume that there are no NaN and infinities. Either loses pairs.

// A part of an axis, with cells of one width.
struct Segment {
    begin: f32,
    // Cells in a unit of length; 0 if there is one cell.
    per_length: f32,
    // Number of the first cell.
    first: u32,
    // Number of the last cell, counted from the first.
    last: u32,
}

struct Params {
    // Boxes of this frame or piece.
    objects: u32,
    // 1: `ids` has the number and the owner bit of each box. 0: the number of a box is its position.
    piece: u32,
    // Sweep axis, 0 to 2. The other two follow cyclically.
    axis: u32,
    // Length of `pairs`.
    capacity: u32,
    // Brute force: the first tile pair of this submission.
    first: u32,
    // Blocks of rows, or tile pairs, in this submission.
    blocks: u32,
    // Position in the whole list of the first pair in `pairs`.
    window: u32,
    // Slots of a strip along the sweep axis.
    slots: u32,
    // Cells of the grid on the two other axes.
    cells: vec2u,
    // Cell of the first oversized boxes; the cells of all others come before.
    large_key: u32,
    // A box that is longer than this on the sweep axis and covers many slots is oversized.
    longest: f32,
    // Number of this submission: never 0, and never that of the previous one.
    submission: u32,
    // Earlier submissions of this frame with the same blocks.
    round: u32,
    // Most candidates and nodes that a row is tested with in one submission.
    budget: u32,
    // Highest level of the tree; see `levels.wgsl`.
    top: u32,
    // Lower bits of a place on the curve that a key, or the cell of an oversized box, drops.
    curve_shift: u32,
    // Blocks of cells; see `cells.wgsl`.
    cell_blocks: u32,
    // One over the longest extent of a usual box.
    usual: f32,
    // Passes of the radix sort.
    passes: u32,
    // Bits of the grid of the curve, above which are those of the size.
    curve_bits: u32,
    // Memberships of the filter, if there is one; see `filter.wgsl`.
    members: u32,
    unused_a: u32,
    unused_b: u32,
    // The parts of the three axes, the sweep axis first: into the cells of the curve, then into slots and cells of
    // the grid. See `division.wgsl`.
    segments: array<Segment, 96>,
}

// What a submission found.
struct Header {
    // Number of pairs, 64 bits.
    total_low: u32,
    total_high: u32,
    // Twice the position of the first invalid box, plus 1 if it is inverted. All ones if every box is valid.
    invalid: atomic<u32>,
    // 1 if a row has candidates beyond its budget.
    more: atomic<u32>,
    // Number of the submission. If it is another one, no kernel ran and the other fields are stale.
    ran: u32,
    // For an indirect dispatch over the pairs, 64 for each workgroup.
    groups_x: u32,
    groups_y: u32,
    groups_z: u32,
    // Number of pairs in `pairs`.
    held: u32,
}

// A box, with its axes rotated so that x is the sweep axis. lo.w is its number, with the owner bit on top.
struct Box {
    lo: vec4u,
    hi: vec4u,
}

// The bit of `Box.lo.w` that says that this piece reports the pairs of the box. One of the two boxes of a pair needs
// it.
const OWNER: u32 = 0x80000000u;

// Maps the bits of a float to an integer with the same order. Both zeros map to one.
fn order_key(bits: u32) -> u32 {
    let b = select(bits, 0u, bits == 0x80000000u);
    return select(b | 0x80000000u, ~b, (b >> 31u) == 1u);
}

fn is_nan(bits: u32) -> bool {
    return (bits & 0x7fffffffu) > 0x7f800000u;
}

// Returns a pair with the lower number first, without owner bits.
fn pair_of(a: u32, b: u32) -> vec2u {
    let i = a & ~OWNER;
    let j = b & ~OWNER;
    return vec2u(min(i, j), max(i, j));
}

fn overlap_across(a: Box, b: Box) -> bool {
    return a.lo.y <= b.hi.y && b.lo.y <= a.hi.y && a.lo.z <= b.hi.z && b.lo.z <= a.hi.z;
}

fn owned(a: u32, b: u32) -> bool {
    return ((a | b) & OWNER) != 0u;
}
