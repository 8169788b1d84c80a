//! Tests whether boxes are valid and lie within others: many at a time, at every SIMD level.

use super::{Level, at_level};
use crate::Aabb;

/// Boxes tested together. Eight have 48 bounds: three vectors of 16, or six of eight.
pub(crate) const BLOCK: usize = 8;

at_level! {
    /// Calls `doubtful`, with the position and the outer boxes of the block, for every block of up to [`BLOCK`] boxes
    /// of which one is invalid or reaches out of its outer box. `outer` has the length of `boxes`.
    pub(crate) fn each_doubtful_block[] [](
        boxes: &[Aabb], outer: &mut [Aabb], doubtful: impl FnMut(usize, &mut [Aabb])
    ) = blocks;
}

/// Returns whether a box is valid and lies within another: false for NaN.
#[inline(always)]
pub(crate) fn within(b: &Aabb, outer: &Aabb) -> bool {
    // Without branches, which would cost more than the tests: six boxes in seven pass all of them.
    let axis = |a: usize| (b.min[a] >= outer.min[a]) & (b.max[a] <= outer.max[a]) & (b.min[a] <= b.max[a]);
    axis(0) & axis(1) & axis(2)
}

#[inline(always)]
fn blocks<L: Level>(boxes: &[Aabb], outer: &mut [Aabb], mut doubtful: impl FnMut(usize, &mut [Aabb]), level: L) {
    let (mut at, whole) = (0, boxes.len() / BLOCK * BLOCK);
    let (blocks, _) = boxes.as_chunks::<BLOCK>();
    let (outer_blocks, last) = outer.as_chunks_mut::<BLOCK>();
    for (block, outer) in blocks.iter().zip(outer_blocks) {
        if !level.all_within(block, outer) {
            doubtful(at, outer);
        }
        at += BLOCK;
    }
    if !boxes[whole..].iter().zip(&*last).all(|(b, outer)| within(b, outer)) {
        doubtful(whole, last);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::Simd;

    #[test]
    fn every_level_finds_the_doubtful_blocks() {
        let outer = vec![Aabb::new([-1.0, -2.0, -3.0], [1.0, 2.0, 3.0]); 21];
        for simd in Simd::every() {
            let doubtful = |boxes: &[Aabb]| {
                let mut found = Vec::new();
                each_doubtful_block(simd, boxes, &mut outer.clone(), |at, block| found.push((at, block.len())));
                found
            };
            assert_eq!(doubtful(&outer), [], "{simd:?}");
            for at in 0..21 {
                for bound in 0..6 {
                    for wrong in [f32::NAN, 1.0e9, -1.0e9] {
                        let mut boxes = outer.clone();
                        let b = &mut boxes[at];
                        *(if bound < 3 { &mut b.min[bound] } else { &mut b.max[bound - 3] }) = wrong;
                        let expected = (at / 8 * 8, if at < 16 { 8 } else { 5 });
                        assert_eq!(doubtful(&boxes), [expected], "{simd:?}: box {at}, bound {bound}, {wrong}");
                    }
                }
            }
        }
    }
}
