//! The inner loops: one box against several at a time, at every SIMD level.
//!
//! A loop is written once over [`Lanes`] and compiled for each level inside a function that enables its instructions.

pub(crate) mod contain;
pub(crate) mod node;

use crate::cpu::SimdLevel;
use crate::cpu::columns::Columns;
use std::ops::Range;

/// Tests every row of `rows` against the rows behind it until one begins beyond its end on the sweep axis.
///
/// The columns must ascend by lower bound on the sweep axis. `emit` gets a row, another row and a mask: bit k is set when
/// the first overlaps the k-th row from the other on.
pub(crate) fn sweep_rows(level: SimdLevel, columns: &Columns, rows: Range<usize>, emit: impl FnMut(usize, usize, u32)) {
    let view = View::new(columns);
    match level {
        // SAFETY: `SimdLevel::in_use` and the tests hand out only levels that this CPU has.
        #[cfg(target_arch = "x86_64")]
        SimdLevel::Avx512 => unsafe { x86::sweep_avx512(&view, rows, emit) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        SimdLevel::Avx2 => unsafe { x86::sweep_avx2(&view, rows, emit) },
        _ => sweep(portable::Portable, &view, rows, emit),
    }
}

/// Tests every row of `rows` against all rows behind it, on all three axes. `emit` as in [`sweep_rows`].
pub(crate) fn brute_rows(level: SimdLevel, columns: &Columns, rows: Range<usize>, emit: impl FnMut(usize, usize, u32)) {
    let view = View::new(columns);
    match level {
        // SAFETY: `SimdLevel::in_use` and the tests hand out only levels that this CPU has.
        #[cfg(target_arch = "x86_64")]
        SimdLevel::Avx512 => unsafe { x86::brute_avx512(&view, rows, emit) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        SimdLevel::Avx2 => unsafe { x86::brute_avx2(&view, rows, emit) },
        _ => brute(portable::Portable, &view, rows, emit),
    }
}

/// Tests one box against the rows from `start` on until one begins beyond its end on the sweep axis. `emit`
/// gets a row and a mask of the rows from there on.
pub(crate) fn query_rows(level: SimdLevel, columns: &Columns, start: usize, query: &Query, emit: impl FnMut(usize, u32)) {
    let view = View::new(columns);
    match level {
        // SAFETY: `SimdLevel::in_use` and the tests hand out only levels that this CPU has.
        #[cfg(target_arch = "x86_64")]
        SimdLevel::Avx512 => unsafe { x86::query_avx512(&view, start, query, emit) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        SimdLevel::Avx2 => unsafe { x86::query_avx2(&view, start, query, emit) },
        _ => query_from(portable::Portable, &view, start, query, emit),
    }
}

/// Bounds of the one box, sweep axis first.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Query {
    pub(crate) low: [f32; 3],
    pub(crate) high: [f32; 3],
}

/// The columns as pointers of one common length.
struct View<'a> {
    low: [&'a [f32]; 3],
    high: [&'a [f32]; 3],
    /// Rows that hold boxes; every column has 16 more values behind them.
    len: usize,
}

impl<'a> View<'a> {
    fn new(columns: &'a Columns) -> Self {
        let (low, high) = columns.padded();
        let len = columns.len();
        // The unchecked loads below rest on this.
        assert!(low.iter().chain(&high).all(|c| c.len() >= len + 16), "columns without padding");
        Self { low, high, len }
    }

    #[inline(always)]
    fn query(&self, row: usize) -> Query {
        Query { low: self.low.map(|c| c[row]), high: self.high.map(|c| c[row]) }
    }
}

/// One vector width. Each bit of a mask is one row, the lowest bit the first.
trait Lanes: Copy {
    /// Rows tested at once; at most 16.
    const COUNT: usize;
    /// The mask of all rows.
    const ALL: u32 = ((1_u64 << Self::COUNT) - 1) as u32;
    /// Rows `at..at + COUNT` against a box that begins no later on the sweep axis: which begin before its end, and
    /// which of those overlap it on the other two axes too.
    ///
    /// # Safety
    /// `at <= view.len`, and the CPU has the instructions.
    unsafe fn reach_and_hits(self, view: &View<'_>, at: usize, query: &Query) -> (u32, u32);
    /// Rows `at..at + COUNT` that end on the sweep axis no earlier than the box begins.
    ///
    /// # Safety
    /// As above.
    unsafe fn ends_after(self, view: &View<'_>, at: usize, low: f32) -> u32;
}

#[inline(always)]
fn sweep<L: Lanes>(lanes: L, view: &View<'_>, rows: Range<usize>, mut emit: impl FnMut(usize, usize, u32)) {
    debug_assert!(rows.end <= view.len);
    for i in rows {
        let query = view.query(i);
        let mut at = i + 1;
        while at < view.len {
            // SAFETY: `at < view.len`; the caller enabled the instructions of `L`.
            let (reach, hits) = unsafe { lanes.reach_and_hits(view, at, &query) };
            if hits != 0 {
                emit(i, at, hits);
            }
            if reach != L::ALL {
                break;
            }
            at += L::COUNT;
        }
    }
}

#[inline(always)]
fn brute<L: Lanes>(lanes: L, view: &View<'_>, rows: Range<usize>, mut emit: impl FnMut(usize, usize, u32)) {
    debug_assert!(rows.end <= view.len);
    for i in rows {
        let query = view.query(i);
        let mut at = i + 1;
        while at < view.len {
            // SAFETY: `at < view.len`; the caller enabled the instructions of `L`.
            let hits = unsafe { lanes.reach_and_hits(view, at, &query).1 & lanes.ends_after(view, at, query.low[0]) };
            if hits != 0 {
                emit(i, at, hits);
            }
            at += L::COUNT;
        }
    }
}

#[inline(always)]
fn query_from<L: Lanes>(lanes: L, view: &View<'_>, start: usize, query: &Query, mut emit: impl FnMut(usize, u32)) {
    let mut at = start;
    while at < view.len {
        // SAFETY: `at < view.len`; the caller enabled the instructions of `L`.
        let (reach, hits) = unsafe { lanes.reach_and_hits(view, at, query) };
        if hits != 0 {
            // SAFETY: as above.
            let hits = hits & unsafe { lanes.ends_after(view, at, query.low[0]) };
            emit(at, hits);
        }
        if reach != L::ALL {
            break;
        }
        at += L::COUNT;
    }
}

/// The positions of the bits of a mask, ascending.
#[inline(always)]
pub(crate) fn each_bit(mut mask: u32, mut f: impl FnMut(usize)) {
    while mask != 0 {
        f(mask.trailing_zeros() as usize);
        mask &= mask - 1;
    }
}

/// Asks for a value that is needed soon. Where there is no such instruction, nothing happens.
#[inline(always)]
pub(crate) fn prefetch<T>(value: &T) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        let at = std::ptr::from_ref(value).cast::<i8>();
        for byte in (0..size_of::<T>()).step_by(64) {
            // SAFETY: SSE is part of x86-64, and the address lies within the value.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(at.add(byte)) };
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = value;
}

mod portable {
    use super::{Lanes, Query, View};

    /// Plain Rust over four rows, which compilers turn into the vectors of the target's baseline.
    #[derive(Clone, Copy)]
    pub(super) struct Portable;

    impl Lanes for Portable {
        const COUNT: usize = 4;

        #[inline(always)]
        unsafe fn reach_and_hits(self, view: &View<'_>, at: usize, query: &Query) -> (u32, u32) {
            let four = |column: &[f32]| -> [f32; 4] { [column[at], column[at + 1], column[at + 2], column[at + 3]] };
            let reach = mask(four(view.low[0]).map(|v| v <= query.high[0]));
            if reach == 0 {
                return (0, 0);
            }
            let (low1, high1) = (four(view.low[1]), four(view.high[1]));
            let (low2, high2) = (four(view.low[2]), four(view.high[2]));
            let hits = [0, 1, 2, 3].map(|k| {
                (low1[k] <= query.high[1])
                    & (high1[k] >= query.low[1])
                    & (low2[k] <= query.high[2])
                    & (high2[k] >= query.low[2])
            });
            (reach, reach & mask(hits))
        }

        #[inline(always)]
        unsafe fn ends_after(self, view: &View<'_>, at: usize, low: f32) -> u32 {
            mask([0, 1, 2, 3].map(|k| view.high[0][at + k] >= low))
        }
    }

    #[inline(always)]
    fn mask(lanes: [bool; 4]) -> u32 {
        u32::from(lanes[0]) | u32::from(lanes[1]) << 1 | u32::from(lanes[2]) << 2 | u32::from(lanes[3]) << 3
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{Lanes, Query, View, brute, query_from, sweep};
    use std::arch::x86_64::*;
    use std::ops::Range;

    #[derive(Clone, Copy)]
    struct Avx2;

    #[derive(Clone, Copy)]
    struct Avx512;

    impl Lanes for Avx2 {
        const COUNT: usize = 8;

        #[inline(always)]
        unsafe fn reach_and_hits(self, view: &View<'_>, at: usize, query: &Query) -> (u32, u32) {
            // SAFETY: every column has 16 values behind `view.len >= at`, and the caller has AVX2.
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
            // SAFETY: every column has 16 values behind `view.len >= at`, and the caller has AVX-512F.
            unsafe {
                let load = |column: &[f32]| _mm512_loadu_ps(column.as_ptr().add(at));
                let below =
                    |mask, column, bound| _mm512_mask_cmp_ps_mask::<_CMP_LE_OQ>(mask, load(column), _mm512_set1_ps(bound));
                let above =
                    |mask, column, bound| _mm512_mask_cmp_ps_mask::<_CMP_GE_OQ>(mask, load(column), _mm512_set1_ps(bound));
                let reach = below(u16::MAX, view.low[0], query.high[0]);
                let second = above(below(reach, view.low[1], query.high[1]), view.high[1], query.low[1]);
                let hits = above(below(second, view.low[2], query.high[2]), view.high[2], query.low[2]);
                (u32::from(reach), u32::from(hits))
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
    }

    #[target_feature(enable = "avx2")]
    pub(super) fn sweep_avx2(view: &View<'_>, rows: Range<usize>, emit: impl FnMut(usize, usize, u32)) {
        sweep(Avx2, view, rows, emit);
    }

    #[target_feature(enable = "avx2")]
    pub(super) fn brute_avx2(view: &View<'_>, rows: Range<usize>, emit: impl FnMut(usize, usize, u32)) {
        brute(Avx2, view, rows, emit);
    }

    #[target_feature(enable = "avx2")]
    pub(super) fn query_avx2(view: &View<'_>, start: usize, query: &Query, emit: impl FnMut(usize, u32)) {
        query_from(Avx2, view, start, query, emit);
    }

    #[target_feature(enable = "avx512f")]
    pub(super) fn sweep_avx512(view: &View<'_>, rows: Range<usize>, emit: impl FnMut(usize, usize, u32)) {
        sweep(Avx512, view, rows, emit);
    }

    #[target_feature(enable = "avx512f")]
    pub(super) fn brute_avx512(view: &View<'_>, rows: Range<usize>, emit: impl FnMut(usize, usize, u32)) {
        brute(Avx512, view, rows, emit);
    }

    #[target_feature(enable = "avx512f")]
    pub(super) fn query_avx512(view: &View<'_>, start: usize, query: &Query, emit: impl FnMut(usize, u32)) {
        query_from(Avx512, view, start, query, emit);
    }
}
