//! The operations for which AVX2 and AVX-512 have their own code.

use super::{BLOCK, LANES, Level, View};
use crate::cpu::level::{Avx2, Avx512};
use crate::{Aabb, Pair};
use std::arch::x86_64::*;
use std::mem::offset_of;

impl Level for Avx2 {
    type Rows = [__m256; 1];
    type Lanes = [__m256; 2];

    #[inline(always)]
    fn write(self, id: u32, others: &[u32; LANES], hits: u32, room: &mut [Pair; LANES]) {
        // SAFETY: `self` is the proof of AVX2.
        unsafe { write_avx2(id, others, hits, room) };
    }

    #[inline(always)]
    fn all_within(self, boxes: &[Aabb; BLOCK], outer: &[Aabb; BLOCK]) -> bool {
        let (b, o) = (boxes.as_ptr().cast::<f32>(), outer.as_ptr().cast::<f32>());
        // SAFETY: `self` is the proof of AVX2. A block has 48 floats; `Aabb` is `repr(C)`. The upper bound follows its
        // lower one three floats later, and a masked load reads no lane whose mask is clear.
        unsafe {
            let mut good = _mm256_castsi256_ps(_mm256_set1_epi32(-1));
            for k in [0_usize, 8, 16, 24, 32, 40] {
                let bit = |lane: usize| if LOWER >> (k + lane) & 1 == 1 { -1 } else { 0 };
                let lower = _mm256_setr_epi32(bit(0), bit(1), bit(2), bit(3), bit(4), bit(5), bit(6), bit(7));
                let (inner, bound) = (_mm256_loadu_ps(b.add(k)), _mm256_loadu_ps(o.add(k)));
                let upper = _mm256_maskload_ps(b.add(k).wrapping_add(3), lower);
                let lower = _mm256_castsi256_ps(lower);
                let from =
                    _mm256_and_ps(_mm256_cmp_ps::<_CMP_GE_OQ>(inner, bound), _mm256_cmp_ps::<_CMP_LE_OQ>(inner, upper));
                let to = _mm256_cmp_ps::<_CMP_LE_OQ>(inner, bound);
                good = _mm256_and_ps(good, _mm256_blendv_ps(to, from, lower));
            }
            _mm256_movemask_ps(good) == 0xff
        }
    }
}

impl Level for Avx512 {
    type Rows = [__m512; 1];
    type Lanes = [__m512; 1];

    #[inline(always)]
    unsafe fn owned(self, view: &View<'_>, at: usize, begins: u32, hits: u32) -> u32 {
        // SAFETY: every column has 16 values behind `view.len >= at`; `self` is the proof of AVX-512F.
        unsafe {
            let all = _mm512_loadu_si512(view.begins.as_ptr().add(at).cast());
            let both = _mm512_or_si512(all, _mm512_set1_epi32(begins as i32));
            hits & u32::from(_mm512_cmpeq_epi32_mask(both, _mm512_set1_epi32(3)))
        }
    }

    #[inline(always)]
    unsafe fn write_rows(self, view: &View<'_>, at: usize, id: u32, hits: u32, room: &mut [Pair]) {
        // SAFETY: as above.
        let others = unsafe { &*view.ids.as_ptr().add(at).cast() };
        self.write(id, others, hits, room.first_chunk_mut().unwrap());
    }

    #[inline(always)]
    fn write(self, id: u32, others: &[u32; LANES], hits: u32, room: &mut [Pair; LANES]) {
        // SAFETY: `self` is the proof of AVX-512F.
        unsafe { write_avx512(id, others, hits, room) };
    }

    #[inline(always)]
    fn all_within(self, boxes: &[Aabb; BLOCK], outer: &[Aabb; BLOCK]) -> bool {
        let (b, o) = (boxes.as_ptr().cast::<f32>(), outer.as_ptr().cast::<f32>());
        let mut bad = 0;
        for k in [0_usize, 16, 32] {
            let lower = (LOWER >> k) as __mmask16;
            // SAFETY: as for AVX2; the mask leaves out the lanes beyond the block.
            unsafe {
                let (inner, bound) = (_mm512_loadu_ps(b.add(k)), _mm512_loadu_ps(o.add(k)));
                let upper = _mm512_maskz_loadu_ps(lower, b.add(k).wrapping_add(3));
                bad |= _mm512_mask_cmp_ps_mask::<_CMP_NGE_UQ>(lower, inner, bound);
                bad |= _mm512_mask_cmp_ps_mask::<_CMP_NLE_UQ>(!lower, inner, bound);
                bad |= _mm512_mask_cmp_ps_mask::<_CMP_NLE_UQ>(lower, inner, upper);
            }
        }
        bad == 0
    }
}

/// Bit k is set if bound k of the 48 bounds of eight boxes is a lower one.
const LOWER: u64 = {
    let (mut bits, mut k) = (0, 0);
    while k < 6 * BLOCK {
        bits |= ((k % 6 < 3) as u64) << k;
        k += 1;
    }
    bits
};

// Rust promises no layout of a tuple: this stops the build if it is another one.
const _: () = assert!(size_of::<Pair>() == 8 && offset_of!(Pair, 0) == 0 && offset_of!(Pair, 1) == 4);

/// Writes the pairs of a box with each of `others` whose bit is set to the head of `room`. The rest of `room` is
/// unspecified afterwards.
#[target_feature(enable = "avx512f")]
#[inline]
fn write_avx512(id: u32, others: &[u32; 16], hits: u32, room: &mut [Pair; 16]) {
    let to = room.as_mut_ptr().cast::<i32>();
    // SAFETY: there are 16 others, and `room` holds 32 integers.
    unsafe {
        let all = _mm512_loadu_si512(others.as_ptr().cast());
        let others = _mm512_maskz_compress_epi32(hits as __mmask16, all);
        let one = _mm512_set1_epi32(id as i32);
        let (low, high) = (_mm512_min_epu32(others, one), _mm512_max_epu32(others, one));
        let first = _mm512_setr_epi32(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
        let second = _mm512_setr_epi32(8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31);
        _mm512_storeu_si512(to.cast(), _mm512_permutex2var_epi32(low, first, high));
        _mm512_storeu_si512(to.add(16).cast(), _mm512_permutex2var_epi32(low, second, high));
    }
}

/// For each mask of eight lanes: the numbers of its lanes, one a byte, then zeros.
static LANES_OF: [u64; 256] = {
    let mut table = [0; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut lane, mut count) = (0, 0);
        while lane < 8 {
            if mask >> lane & 1 == 1 {
                table[mask] |= lane << (8 * count);
                count += 1;
            }
            lane += 1;
        }
        mask += 1;
    }
    table
};

/// Does the same as [`write_avx512`].
#[target_feature(enable = "avx2")]
#[inline]
fn write_avx2(id: u32, others: &[u32; 16], hits: u32, room: &mut [Pair; 16]) {
    let one = _mm256_set1_epi32(id as i32);
    let mut half = |k: usize, at: usize| {
        // SAFETY: there are eight others from `8 k` on. At most `8 k` pairs stand before `at`, and eight are written,
        // so that `room` holds them.
        unsafe {
            let lanes = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(LANES_OF[(hits >> (8 * k)) as usize & 255] as i64));
            let all = _mm256_loadu_si256(others.as_ptr().add(8 * k).cast());
            let others = _mm256_permutevar8x32_epi32(all, lanes);
            let (low, high) = (_mm256_min_epu32(others, one), _mm256_max_epu32(others, one));
            // Pairs 0, 1, 4, 5 and 2, 3, 6, 7.
            let (a, b) = (_mm256_unpacklo_epi32(low, high), _mm256_unpackhi_epi32(low, high));
            let to = room.as_mut_ptr().add(at);
            _mm256_storeu_si256(to.cast(), _mm256_permute2x128_si256::<0x20>(a, b));
            _mm256_storeu_si256(to.add(4).cast(), _mm256_permute2x128_si256::<0x31>(a, b));
        }
    };
    half(0, 0);
    half(1, (hits & 255).count_ones() as usize);
}
