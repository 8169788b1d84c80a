//! SSE2, which every x86-64 CPU has, AVX2 and AVX-512.

use super::small::small;
use super::{Lanes, Query, Rows, View, brute, sweep};
use crate::cpu::level::{Avx2, Avx512};
use crate::pair::Pair;
use crate::pairs::Pairs;
use std::arch::x86_64::*;
use std::mem::offset_of;
use std::ops::Range;

/// Eight rows in two vectors.
#[derive(Clone, Copy)]
pub(super) struct Sse2;

impl Lanes for Sse2 {
    const COUNT: usize = 8;

    #[inline(always)]
    unsafe fn reach_and_hits(self, view: &View<'_>, at: usize, query: &Query) -> (u32, u32) {
        let half = |at: usize| {
            // SAFETY: every column has 16 values behind `view.len >= at`.
            unsafe {
                let below =
                    |column: &[f32], bound| _mm_cmple_ps(_mm_loadu_ps(column.as_ptr().add(at)), _mm_set1_ps(bound));
                let above =
                    |column: &[f32], bound| _mm_cmpge_ps(_mm_loadu_ps(column.as_ptr().add(at)), _mm_set1_ps(bound));
                let reach = below(view.low[0], query.high[0]);
                let second = _mm_and_ps(below(view.low[1], query.high[1]), above(view.high[1], query.low[1]));
                let third = _mm_and_ps(below(view.low[2], query.high[2]), above(view.high[2], query.low[2]));
                let hits = _mm_and_ps(reach, _mm_and_ps(second, third));
                (_mm_movemask_ps(reach) as u32, _mm_movemask_ps(hits) as u32)
            }
        };
        let ((reach, hits), (more_reach, more_hits)) = (half(at), half(at + 4));
        (reach | more_reach << 4, hits | more_hits << 4)
    }

    #[inline(always)]
    unsafe fn ends_after(self, view: &View<'_>, at: usize, low: f32) -> u32 {
        let half = |at: usize| {
            // SAFETY: as above.
            unsafe {
                let high = _mm_loadu_ps(view.high[0].as_ptr().add(at));
                _mm_movemask_ps(_mm_cmpge_ps(high, _mm_set1_ps(low))) as u32
            }
        };
        half(at) | half(at + 4) << 4
    }
}

impl Lanes for Avx2 {
    const COUNT: usize = 8;

    #[inline(always)]
    unsafe fn reach_and_hits(self, view: &View<'_>, at: usize, query: &Query) -> (u32, u32) {
        // SAFETY: every column has 16 values behind `view.len >= at`; `self` is the proof of AVX2.
        unsafe {
            let load = |column: &[f32]| _mm256_loadu_ps(column.as_ptr().add(at));
            let below = |column, bound| _mm256_cmp_ps::<_CMP_LE_OQ>(load(column), _mm256_set1_ps(bound));
            let above = |column, bound| _mm256_cmp_ps::<_CMP_GE_OQ>(load(column), _mm256_set1_ps(bound));
            let reach = below(view.low[0], query.high[0]);
            let second = _mm256_and_ps(below(view.low[1], query.high[1]), above(view.high[1], query.low[1]));
            let third = _mm256_and_ps(below(view.low[2], query.high[2]), above(view.high[2], query.low[2]));
            let hits = _mm256_and_ps(reach, _mm256_and_ps(second, third));
            (_mm256_movemask_ps(reach) as u32, _mm256_movemask_ps(hits) as u32)
        }
    }

    #[inline(always)]
    unsafe fn ends_after(self, view: &View<'_>, at: usize, low: f32) -> u32 {
        // SAFETY: as above.
        unsafe {
            let high = _mm256_loadu_ps(view.high[0].as_ptr().add(at));
            _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_GE_OQ>(high, _mm256_set1_ps(low))) as u32
        }
    }
}

impl Lanes for Avx512 {
    const COUNT: usize = 16;

    #[inline(always)]
    unsafe fn reach_and_hits(self, view: &View<'_>, at: usize, query: &Query) -> (u32, u32) {
        // SAFETY: every column has 16 values behind `view.len >= at`; `self` is the proof of AVX-512F.
        unsafe {
            let load = |column: &[f32]| _mm512_loadu_ps(column.as_ptr().add(at));
            // Each comparison by itself: one masked by the result of another would wait for it.
            let below = |column, bound| _mm512_cmp_ps_mask::<_CMP_LE_OQ>(load(column), _mm512_set1_ps(bound));
            let above = |column, bound| _mm512_cmp_ps_mask::<_CMP_GE_OQ>(load(column), _mm512_set1_ps(bound));
            let reach = below(view.low[0], query.high[0]);
            let second = below(view.low[1], query.high[1]) & above(view.high[1], query.low[1]);
            let third = below(view.low[2], query.high[2]) & above(view.high[2], query.low[2]);
            (u32::from(reach), u32::from(reach & second & third))
        }
    }

    #[inline(always)]
    unsafe fn ends_after(self, view: &View<'_>, at: usize, low: f32) -> u32 {
        // SAFETY: as above.
        unsafe {
            let high = _mm512_loadu_ps(view.high[0].as_ptr().add(at));
            u32::from(_mm512_cmp_ps_mask::<_CMP_GE_OQ>(high, _mm512_set1_ps(low)))
        }
    }

    #[inline(always)]
    unsafe fn owned(self, view: &View<'_>, at: usize, begins: u32, hits: u32) -> u32 {
        // SAFETY: as above.
        unsafe {
            let all = _mm512_loadu_si512(view.begins.as_ptr().add(at).cast());
            let both = _mm512_or_si512(all, _mm512_set1_epi32(begins as i32));
            hits & u32::from(_mm512_cmpeq_epi32_mask(both, _mm512_set1_epi32(3)))
        }
    }

    #[inline(always)]
    unsafe fn write(self, view: &View<'_>, at: usize, id: u32, hits: u32, room: &mut [Pair]) {
        // SAFETY: as above for the column, of which 16 values are read.
        unsafe {
            let others = &*view.ids.as_ptr().add(at).cast();
            write_avx512(id, others, hits, room.first_chunk_mut().unwrap());
        }
    }
}

// Rust promises no layout of a tuple: this stops the build if it is another one.
const _: () = assert!(size_of::<Pair>() == 8 && offset_of!(Pair, 0) == 0 && offset_of!(Pair, 1) == 4);

/// Writes the pairs of a box with each of `others` whose bit is set to the head of `room`. The rest of `room` is
/// unspecified afterwards.
#[target_feature(enable = "avx512f")]
#[inline]
pub(super) fn write_avx512(id: u32, others: &[u32; 16], hits: u32, room: &mut [Pair; 16]) {
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

/// As [`write_avx512`].
#[target_feature(enable = "avx2")]
#[inline]
pub(super) fn write_avx2(id: u32, others: &[u32; 16], hits: u32, room: &mut [Pair; 16]) {
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

#[target_feature(enable = "avx2")]
pub(super) fn sweep_avx2<R: Rows>(proof: Avx2, view: &View<'_>, rows: Range<usize>, pairs: &mut Pairs) {
    sweep::<_, R>(proof, view, rows, pairs);
}

#[target_feature(enable = "avx2")]
pub(super) fn brute_avx2(
    proof: Avx2,
    view: &View<'_>,
    rows: Range<usize>,
    first: impl Fn(usize) -> usize,
    pairs: &mut Pairs,
) {
    brute(proof, view, rows, first, pairs);
}

#[target_feature(enable = "avx512f")]
pub(super) fn sweep_avx512<R: Rows>(proof: Avx512, view: &View<'_>, rows: Range<usize>, pairs: &mut Pairs) {
    sweep::<_, R>(proof, view, rows, pairs);
}

#[target_feature(enable = "avx512f")]
pub(super) fn brute_avx512(
    proof: Avx512,
    view: &View<'_>,
    rows: Range<usize>,
    first: impl Fn(usize) -> usize,
    pairs: &mut Pairs,
) {
    brute(proof, view, rows, first, pairs);
}

#[target_feature(enable = "avx2")]
pub(super) fn small_avx2(proof: Avx2, view: &View<'_>, first: u32, pairs: &mut Pairs) {
    small(proof, view, first, pairs);
}

#[target_feature(enable = "avx512f")]
pub(super) fn small_avx512(proof: Avx512, view: &View<'_>, first: u32, pairs: &mut Pairs) {
    small(proof, view, first, pairs);
}
