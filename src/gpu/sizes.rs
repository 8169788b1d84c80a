//! Sizes that kernels, their buffers and the count of their traffic share.

/// Pairs of a row that are kept from the counting to the writing; see `shaders/rows.wgsl`.
pub(super) const KEPT: u32 = 4;

/// Cells of one workgroup of `shaders/cells.wgsl`.
pub(super) const CELLS_OF_BLOCK: u32 = 4096;

/// The most nodes of the highest level of a tree, which a walk tests one after the other.
const MOST_ROOTS: u32 = 64;

/// How many times three levels are put on a tree until few nodes are left; see `shaders/levels.wgsl`.
pub(super) fn raises(objects: u32) -> u32 {
    let mut count = 1;
    while nodes(objects, 3 * count) > MOST_ROOTS {
        count += 1;
    }
    count
}

/// Nodes of a level of a tree, of which each has eight of the level below; boxes at level 0.
pub(super) fn nodes(objects: u32, level: u32) -> u32 {
    (u64::from(objects)).div_ceil(1 << (3 * level)) as u32
}
