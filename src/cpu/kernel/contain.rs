//! Tests whether boxes are valid and lie within others: many at a time, at every SIMD level.

use crate::aabb::Aabb;
use crate::cpu::level::Simd;

/// Boxes tested together. Eight have 48 bounds: three vectors of 16, or six of eight.
pub(crate) const BLOCK: usize = 8;

/// Calls `doubtful`, with the position and the outer boxes of the block, for every block of up to [`BLOCK`] boxes of
/// which one is invalid or reaches out of its outer box. `outer` has the length of `boxes`.
pub(crate) fn each_doubtful_block(
    simd: Simd,
    boxes: &[Aabb],
    outer: &mut [Aabb],
    doubtful: impl FnMut(usize, &mut [Aabb]),
) {
    match simd {
        // SAFETY: the proof says that this CPU has the instructions.
        #[cfg(target_arch = "x86_64")]
        Simd::Avx512(_) => unsafe { x86::blocks_avx512(boxes, outer, doubtful) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Simd::Avx2(_) => unsafe { x86::blocks_avx2(boxes, outer, doubtful) },
        Simd::Portable => blocks(boxes, outer, all_within, doubtful),
    }
}

/// Returns whether a box is valid and lies within another: false for NaN.
#[inline(always)]
pub(crate) fn within(b: &Aabb, outer: &Aabb) -> bool {
    // Without branches, which would cost more than the tests: six boxes in seven pass all of them.
    let axis = |a: usize| (b.min[a] >= outer.min[a]) & (b.max[a] <= outer.max[a]) & (b.min[a] <= b.max[a]);
    axis(0) & axis(1) & axis(2)
}

#[inline(always)]
fn all_within(boxes: &[Aabb; BLOCK], outer: &[Aabb; BLOCK]) -> bool {
    boxes.iter().zip(outer).fold(true, |all, (b, outer)| all & within(b, outer))
}

#[inline(always)]
fn blocks(
    boxes: &[Aabb],
    outer: &mut [Aabb],
    all_within: impl Fn(&[Aabb; BLOCK], &[Aabb; BLOCK]) -> bool,
    mut doubtful: impl FnMut(usize, &mut [Aabb]),
) {
    let (mut at, whole) = (0, boxes.len() / BLOCK * BLOCK);
    let (blocks, _) = boxes.as_chunks::<BLOCK>();
    let (outer_blocks, last) = outer.as_chunks_mut::<BLOCK>();
    for (block, outer) in blocks.iter().zip(outer_blocks) {
        if !all_within(block, outer) {
            doubtful(at, outer);
        }
        at += BLOCK;
    }
    if !boxes[whole..].iter().zip(&*last).all(|(b, outer)| within(b, outer)) {
        doubtful(whole, last);
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{BLOCK, blocks};
    use crate::Aabb;
    use std::arch::x86_64::*;

    /// Bit k is set if bound k of the 48 bounds of eight boxes is a lower one.
    const LOWER: u64 = {
        let (mut bits, mut k) = (0, 0);
        while k < 6 * BLOCK {
            bits |= ((k % 6 < 3) as u64) << k;
            k += 1;
        }
        bits
    };

    #[target_feature(enable = "avx512f")]
    pub(super) fn blocks_avx512(boxes: &[Aabb], outer: &mut [Aabb], doubtful: impl FnMut(usize, &mut [Aabb])) {
        // The closure is inlined here, where the instructions are enabled.
        let all_within = |boxes: &[Aabb; BLOCK], outer: &[Aabb; BLOCK]| {
            let (b, o) = (boxes.as_ptr().cast::<f32>(), outer.as_ptr().cast::<f32>());
            let mut bad = 0;
            for k in [0_usize, 16, 32] {
                let lower = (LOWER >> k) as __mmask16;
                // SAFETY: a block has 48 floats; `Aabb` is `repr(C)`. The upper bound follows its lower one three
                // floats later, and the mask leaves out the lanes beyond the block.
                unsafe {
                    let (inner, bound) = (_mm512_loadu_ps(b.add(k)), _mm512_loadu_ps(o.add(k)));
                    let upper = _mm512_maskz_loadu_ps(lower, b.add(k).wrapping_add(3));
                    bad |= _mm512_mask_cmp_ps_mask::<_CMP_NGE_UQ>(lower, inner, bound);
                    bad |= _mm512_mask_cmp_ps_mask::<_CMP_NLE_UQ>(!lower, inner, bound);
                    bad |= _mm512_mask_cmp_ps_mask::<_CMP_NLE_UQ>(lower, inner, upper);
                }
            }
            bad == 0
        };
        blocks(boxes, outer, all_within, doubtful);
    }

    #[target_feature(enable = "avx2")]
    pub(super) fn blocks_avx2(boxes: &[Aabb], outer: &mut [Aabb], doubtful: impl FnMut(usize, &mut [Aabb])) {
        let all_within = |boxes: &[Aabb; BLOCK], outer: &[Aabb; BLOCK]| {
            let (b, o) = (boxes.as_ptr().cast::<f32>(), outer.as_ptr().cast::<f32>());
            let mut good = _mm256_castsi256_ps(_mm256_set1_epi32(-1));
            for k in [0_usize, 8, 16, 24, 32, 40] {
                let bit = |lane: usize| if LOWER >> (k + lane) & 1 == 1 { -1 } else { 0 };
                let lower = _mm256_setr_epi32(bit(0), bit(1), bit(2), bit(3), bit(4), bit(5), bit(6), bit(7));
                // SAFETY: as for AVX-512; a masked load reads no lane whose mask is clear.
                unsafe {
                    let (inner, bound) = (_mm256_loadu_ps(b.add(k)), _mm256_loadu_ps(o.add(k)));
                    let upper = _mm256_maskload_ps(b.add(k).wrapping_add(3), lower);
                    let lower = _mm256_castsi256_ps(lower);
                    let from = _mm256_and_ps(
                        _mm256_cmp_ps::<_CMP_GE_OQ>(inner, bound),
                        _mm256_cmp_ps::<_CMP_LE_OQ>(inner, upper),
                    );
                    good =
                        _mm256_and_ps(good, _mm256_blendv_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(inner, bound), from, lower));
                }
            }
            _mm256_movemask_ps(good) == 0xff
        };
        blocks(boxes, outer, all_within, doubtful);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
