//! What the tests of the contract share.
#![allow(dead_code, reason = "each test program uses a part of this")]

use sapwise::{Aabb, Pair};

/// The oracle: the definition of overlap, in a double loop.
pub(crate) fn naive(boxes: &[Aabb]) -> Vec<Pair> {
    let mut pairs = Vec::new();
    for i in 0..boxes.len() {
        for j in i + 1..boxes.len() {
            if boxes[i].overlaps(&boxes[j]) {
                pairs.push((i as u32, j as u32));
            }
        }
    }
    pairs
}

/// A small generator of its own (Marsaglia's xorshift), so that the test does not rest on the library's.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    /// A float from 0 to 1.
    pub(crate) fn next(&mut self) -> f32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 40) as f32 / (1_u64 << 24) as f32
    }

    /// Cubes of up to 1.1 times that half edge in a world of that size.
    pub(crate) fn cubes(&mut self, count: usize, world: [f32; 3], half: f32) -> Vec<Aabb> {
        (0..count).map(|_| Aabb::cube(world.map(|side| self.next() * side), half * (0.1 + self.next()))).collect()
    }
}

/// The GPUs of this machine; `None`, said aloud, where there is none and none is required.
#[cfg(feature = "gpu")]
pub(crate) fn gpus() -> Option<sapwise::gpu::Gpus> {
    let gpus = sapwise::gpu::Gpus::find();
    if gpus.is_empty() {
        assert!(
            std::env::var_os("SAPWISE_REQUIRE_GPU").is_none_or(|v| v != "1"),
            "SAPWISE_REQUIRE_GPU=1, and no GPU was found"
        );
        println!("skipped: no GPU was found");
        return None;
    }
    Some(gpus)
}
