//! What the tests of the contract share.

use sapwise::{Aabb, Pair};

/// The oracle: the definition of overlap, in a double loop.
pub fn naive(boxes: &[Aabb]) -> Vec<Pair> {
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
pub struct Random(pub u64);

impl Random {
    /// A float from 0 to 1.
    pub fn next(&mut self) -> f32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 40) as f32 / (1_u64 << 24) as f32
    }

    /// Cubes of up to 1.1 times that half edge in a world of that size.
    pub fn cubes(&mut self, count: usize, world: [f32; 3], half: f32) -> Vec<Aabb> {
        (0..count).map(|_| Aabb::cube(world.map(|side| self.next() * side), half * (0.1 + self.next()))).collect()
    }
}
