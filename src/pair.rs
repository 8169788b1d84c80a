//! How a pair is written.

/// Two positions in the input, the lower one first.
pub type Pair = (u32, u32);
