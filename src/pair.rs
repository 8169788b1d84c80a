//! A pair of boxes.

/// A pair of boxes: two positions in the input, the lower one first.
pub type Pair = (u32, u32);
