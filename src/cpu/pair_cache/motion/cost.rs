//! Costs per box of the parts of a frame, in nanoseconds, on one of the machines in `datasets/`. Only their ratios
//! matter, and only for the choice of a margin: they need not be those of the present machine.

/// A box tested against its grown box.
pub(super) const BOX: f32 = 1.5;
/// A kept pair tested.
const KEPT: f32 = 2.5;
/// A box visited again in a frame in which some box left.
pub(super) const AGAIN: f32 = 3.0;
/// A box that left, and each node that its query visits while the tree is in the cache.
const LEFT: [f32; 2] = [60.0, 15.0];
/// A box and a pair found by a refitted tree.
const SCRATCH: [f32; 2] = [16.0, 4.5];
/// A box and a kept pair of a rebuild.
const REBUILD: [f32; 2] = [60.0, 10.5];

/// A box sorted and put into a leaf.
const SORT: f32 = 25.0;

/// The cost of a box from scratch.
pub(super) fn scratch(far: f32, density: f32) -> f32 {
    far.sqrt() * (SCRATCH[0] + SCRATCH[1] * density)
}

/// The cost per box of a rebuild that keeps this many pairs per box.
pub(super) fn rebuild(far: f32, kept: f32) -> f32 {
    far.sqrt() * (REBUILD[0] + REBUILD[1] * kept)
}

/// The cost per box of sorting all anew.
pub(super) fn renewal(far: f32) -> f32 {
    far.sqrt() * SORT
}

/// The cost of testing a box and its kept pairs.
pub(super) fn tests(far: f32, kept: f32) -> f32 {
    BOX + far.sqrt() * KEPT * kept
}

/// The cost of a box that left and whose query visits this many nodes.
pub(super) fn left(far: f32, nodes: f32) -> f32 {
    far * LEFT[0] + self::nodes(far, nodes)
}

/// The cost of visiting this many nodes of the tree.
pub(super) fn nodes(far: f32, nodes: f32) -> f32 {
    far * LEFT[1] * nodes
}

/// The cost of visiting a node over that in a small scene: a large tree lies outside the caches. Reading memory in
/// order costs the root of this.
pub(super) fn far(objects: usize) -> f32 {
    (1.0 + 0.8 * (objects as f32 / 30_000.0).log2()).clamp(1.0, 5.0)
}

/// The share of boxes with this `margin` that leave in a frame, for a random walk with steps of `motion`. More leave
/// in straight flight, which shows in a few frames.
pub(super) fn leaving(motion: f32, margin: f32) -> f32 {
    (motion / margin).powi(2).min(1.0)
}
