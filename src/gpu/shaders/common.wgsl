// What every kernel shares: the parameters of a frame, and bounds as integers.
//
// Bounds are compared as integers in the order of the floats. Float comparisons would be shorter, but drivers may flush
// denormals to zero and may take NaN and infinities to be absent, and each of the two loses pairs.

// A part of an axis with cells of one width.
struct Segment {
    begin: f32,
    // Cells in a unit of length; 0 where there is one.
    per_length: f32,
    // The number of its first cell.
    first: u32,
    // Its last cell, counted from its first.
    last: u32,
}

struct Params {
    // Boxes in this frame or piece.
    objects: u32,
    // 1 where `ids` holds a number and an owner bit for each box, 0 where a box's number is its position.
    piece: u32,
    // Sweep axis, 0 to 2; the other two follow it in a circle.
    axis: u32,
    // Pairs that `pairs` has room for.
    capacity: u32,
    // Brute force: the first tile pair of this submission.
    first: u32,
    // Blocks of rows, or tile pairs, in this submission.
    blocks: u32,
    // Position in the whole list of the first pair that `pairs` is to take.
    window: u32,
    // Slots of a strip along the sweep axis.
    slots: u32,
    // Cells of the grid across the sweep axis.
    cells: vec2<u32>,
    // Sort key of the first of the boxes that are kept apart, behind all others.
    large_key: u32,
    // A box longer than this on the sweep axis that covers many slots is kept apart.
    longest: f32,
    // Which submission this is: another number than the one before, and never 0.
    submission: u32,
    // How many submissions of this frame came before.
    round: u32,
    // Candidates and nodes that a row is tested with in one submission.
    budget: u32,
    // The highest level of the tree; see `tree.wgsl`.
    top: u32,
    // Bits of a place on the curve that the cell of a box kept apart leaves out.
    curve_shift: u32,
    // Blocks of cells.
    cell_blocks: u32,
    // One over the longest extent of a usual box.
    usual: f32,
    unused: u32,
    // For each axis, x the sweep axis, how it is divided into the cells of the curve, then into slots and the cells of the grid; see `division.wgsl`.
    segments: array<Segment, 96>,
}

// What a submission found, for the CPU to read.
struct Header {
    // Pairs found, 64 bits.
    total_low: u32,
    total_high: u32,
    // Twice the position of the first invalid box, plus 1 if it is inverted; all ones when every box is valid.
    invalid: atomic<u32>,
    // 1 where a row has candidates beyond its budget.
    more: atomic<u32>,
    // The number of the submission. Without it nothing was executed, and whatever else stands here says nothing.
    ran: u32,
    // For the indirect dispatch of a kernel over the pairs, workgroups of 64 of them.
    groups_x: u32,
    groups_y: u32,
    groups_z: u32,
    // How many of the pairs stand in `pairs`.
    held: u32,
}

// A box with its axes turned so that x is the sweep axis. lo.w is its number, the owner bit on top.
struct Box {
    lo: vec4<u32>,
    hi: vec4<u32>,
}

// The bit of `Box.lo.w` that says that this piece reports the pairs of the box, whatever the other box says.
const OWNER: u32 = 0x80000000u;

// Bits of a float as an integer of the same order; both zeros are one.
fn order_key(bits: u32) -> u32 {
    let b = select(bits, 0u, bits == 0x80000000u);
    return select(b | 0x80000000u, ~b, (b >> 31u) == 1u);
}

fn is_nan(bits: u32) -> bool {
    return (bits & 0x7fffffffu) > 0x7f800000u;
}

// A pair with the lower number first, without owner bits.
fn pair_of(a: u32, b: u32) -> vec2<u32> {
    let i = a & ~OWNER;
    let j = b & ~OWNER;
    return vec2<u32>(min(i, j), max(i, j));
}

fn overlap_across(a: Box, b: Box) -> bool {
    return a.lo.y <= b.hi.y && b.lo.y <= a.hi.y && a.lo.z <= b.hi.z && b.lo.z <= a.hi.z;
}

fn owned(a: u32, b: u32) -> bool {
    return ((a | b) & OWNER) != 0u;
}
