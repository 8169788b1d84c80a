//! What the parts of a frame cost for each box, in nanoseconds, on one of the machines in `datasets/`. Only their
//! ratios matter here, and only for the choice of a margin: they need not be those of the machine at hand.

/// A box looked at.
pub(super) const BOX: f32 = 1.5;
/// A kept pair tested.
const KEPT: f32 = 2.5;
/// A box looked at again in a frame in which some box left.
pub(super) const AGAIN: f32 = 3.0;
/// A box that left, and each node of the tree that is looked at for it, while the tree is in the cache.
const LEFT: [f32; 2] = [60.0, 15.0];
/// A box and a pair found by a tree that is refitted.
const SCRATCH: [f32; 2] = [16.0, 4.5];
/// A box and a kept pair when all are grown again.
const REBUILD: [f32; 2] = [60.0, 10.5];

/// A box sorted and put into a leaf.
const SORT: f32 = 25.0;

/// The cost of a box from scratch.
pub(super) fn scratch(far: f32, density: f32) -> f32 {
    far.sqrt() * (SCRATCH[0] + SCRATCH[1] * density)
}

/// The cost of a box when all are grown again and this many pairs of each are kept.
pub(super) fn rebuild(far: f32, kept: f32) -> f32 {
    far.sqrt() * (REBUILD[0] + REBUILD[1] * kept)
}

/// The cost of a box where all are sorted anew.
pub(super) fn renewal(far: f32) -> f32 {
    far.sqrt() * SORT
}

/// The cost of a box whose kept pairs are tested.
pub(super) fn tests(far: f32, kept: f32) -> f32 {
    BOX + far.sqrt() * KEPT * kept
}

/// The cost of a box that left when this many nodes are looked at for each.
pub(super) fn left(far: f32, nodes: f32) -> f32 {
    far * LEFT[0] + self::nodes(far, nodes)
}

/// The cost of looking at this many nodes of the tree.
pub(super) fn nodes(far: f32, nodes: f32) -> f32 {
    far * LEFT[1] * nodes
}

/// How many times as much a look at a node of the tree costs than in a small scene: with the number of objects the tree
/// moves out of the caches. What reads memory in order suffers less, by the root of this.
pub(super) fn far(objects: usize) -> f32 {
    (1.0 + 0.8 * (objects as f32 / 30_000.0).log2()).clamp(1.0, 5.0)
}

/// The share of boxes that leave in a frame, when they move by `motion` and may by `margin`, as of those that wander.
/// More leave of those that fly straight on, which shows in a few frames.
pub(super) fn leaving(motion: f32, margin: f32) -> f32 {
    (motion / margin).powi(2).min(1.0)
}
