//! The inner loops: one box against several at a time, at every SIMD level.
//!
//! Each loop is written once over [`Lanes`], and compiled for each level inside a function that enables its
//! instructions.

pub(crate) mod bounds;
pub(crate) mod contain;
pub(crate) mod distance;
pub(crate) mod marks;
pub(crate) mod nearest_first;
pub(crate) mod node;
#[cfg(any(test, not(target_arch = "x86_64")))]
mod portable;
pub(crate) mod ray;
mod sixteen;
pub(crate) mod small;
pub(crate) mod walk;
#[cfg(target_arch = "x86_64")]
mod x86;

use crate::aabb::Aabb;
use crate::cpu::columns::{Columns, PADDING};
use crate::cpu::level::Simd;
use crate::pair::Pair;
use crate::pairs::{Pairs, each_bit};
use std::ops::Range;

/// The vectors of [`SimdLevel::Portable`]: those that every CPU of the target has.
#[cfg(target_arch = "x86_64")]
use x86::Sse2 as Baseline;

#[cfg(not(target_arch = "x86_64"))]
use portable::Portable as Baseline;

/// Tests every row of `rows` against the rows behind it, up to the first that begins beyond its end on the sweep axis,
/// and adds the pairs.
///
/// The columns must ascend by lower bound on the sweep axis.
pub(crate) fn sweep_rows<R: Rows>(simd: Simd, columns: &Columns, rows: Range<usize>, pairs: &mut Pairs) {
    if pairs.is_any_over() {
        return;
    }
    let view = View::new(columns);
    match simd {
        // SAFETY: the proof says that this CPU has the instructions.
        #[cfg(target_arch = "x86_64")]
        Simd::Avx512(proof) => unsafe { x86::sweep_avx512::<R>(proof, &view, rows, pairs) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Simd::Avx2(proof) => unsafe { x86::sweep_avx2::<R>(proof, &view, rows, pairs) },
        Simd::Portable => sweep::<_, R>(Baseline, &view, rows, pairs),
    }
}

/// Tests every row of `rows` against all rows from `first` of it on, on all three axes, and adds the pairs.
pub(crate) fn brute_rows(
    simd: Simd,
    columns: &Columns,
    rows: Range<usize>,
    first: impl Fn(usize) -> usize,
    pairs: &mut Pairs,
) {
    if pairs.is_any_over() {
        return;
    }
    let view = View::new(columns);
    match simd {
        // SAFETY: the proof says that this CPU has the instructions.
        #[cfg(target_arch = "x86_64")]
        Simd::Avx512(proof) => unsafe { x86::brute_avx512(proof, &view, rows, first, pairs) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Simd::Avx2(proof) => unsafe { x86::brute_avx2(proof, &view, rows, first, pairs) },
        Simd::Portable => brute(Baseline, &view, rows, first, pairs),
    }
}

/// Which pairs of rows count.
pub(crate) trait Rows {
    /// Whether this strip reports only the pairs for which both bits of the mask of
    /// [`StripGrid::each_strip`](crate::load::StripGrid::each_strip) are set in either box.
    const IN_STRIP: bool;
}

/// The rows are all boxes: every pair counts.
pub(crate) struct All;

/// The rows are the boxes of a strip. Two boxes may share several strips, and one of these reports the pair.
pub(crate) struct InStrip;

impl Rows for All {
    const IN_STRIP: bool = false;
}

impl Rows for InStrip {
    const IN_STRIP: bool = true;
}

/// The one box.
#[derive(Debug, Clone, Copy)]
struct Query {
    /// Bounds, sweep axis first.
    low: [f32; 3],
    high: [f32; 3],
    id: u32,
    /// As in [`Columns::begins`].
    begins: u32,
}

/// The columns with their padding.
struct View<'a> {
    low: [&'a [f32]; 3],
    high: [&'a [f32]; 3],
    ids: &'a [u32],
    begins: &'a [u32],
    /// Rows that hold boxes. Every column has [`PADDING`] more values behind them.
    len: usize,
}

impl<'a> View<'a> {
    fn new(columns: &'a Columns) -> Self {
        // The unchecked loads below rest on these lengths.
        let end = columns.len() + PADDING;
        Self {
            low: columns.low.each_ref().map(|c| &c[..end]),
            high: columns.high.each_ref().map(|c| &c[..end]),
            ids: &columns.ids[..end],
            begins: &columns.begins[..end],
            len: columns.len(),
        }
    }

    #[inline(always)]
    fn query(&self, row: usize) -> Query {
        Query {
            low: self.low.map(|c| c[row]),
            high: self.high.map(|c| c[row]),
            id: self.ids[row],
            begins: self.begins[row],
        }
    }
}

/// One vector width. Each bit of a mask is one row, the lowest bit the first.
trait Lanes: Copy {
    /// Rows tested at once; at most 16.
    const COUNT: usize;
    /// The mask of all rows.
    const ALL: u32 = ((1_u64 << Self::COUNT) - 1) as u32;
    /// Tests rows `at..at + COUNT` against a box that begins no later on the sweep axis. Returns which begin before its
    /// end, and which of those overlap it on the other two axes too.
    ///
    /// # Safety
    /// `at <= view.len`, and the calling function has the instructions enabled.
    unsafe fn reach_and_hits(self, view: &View<'_>, at: usize, query: &Query) -> (u32, u32);
    /// Returns which of the rows `at..at + COUNT` end on the sweep axis no earlier than the box begins.
    ///
    /// # Safety
    /// As above.
    unsafe fn ends_after(self, view: &View<'_>, at: usize, low: f32) -> u32;
    /// Returns the rows of `hits` whose pair with the box this strip has to report: see [`Rows::IN_STRIP`].
    ///
    /// # Safety
    /// As above.
    #[inline(always)]
    unsafe fn owned(self, view: &View<'_>, at: usize, begins: u32, hits: u32) -> u32 {
        let mut owned = hits;
        // Most boxes stand in one strip: both bits are set, and those of the others don't matter.
        if begins != 3 {
            each_bit(hits, |bit| owned &= !(u32::from(begins | view.begins[at + bit] != 3) << bit));
        }
        owned
    }
    /// Writes the pairs of `id` with the rows `at + k`, k the bits of `hits`, to the head of `room`, which holds
    /// `COUNT` pairs. The rest of `room` is unspecified afterwards.
    ///
    /// # Safety
    /// As above.
    #[inline(always)]
    unsafe fn write(self, view: &View<'_>, at: usize, id: u32, hits: u32, room: &mut [Pair]) {
        write_each(id, &view.ids[at..], hits, room);
    }
}

/// Adds the pairs of a row and the rows that it hits.
#[inline(always)]
fn add<L: Lanes, R: Rows>(lanes: L, view: &View<'_>, at: usize, query: &Query, hits: u32, pairs: &mut Pairs) {
    // SAFETY: `at < view.len`; the caller enabled the instructions of `L`.
    let hits = if R::IN_STRIP { unsafe { lanes.owned(view, at, query.begins, hits) } } else { hits };
    if let Some(room) = pairs.room(L::COUNT) {
        // SAFETY: as above.
        unsafe { lanes.write(view, at, query.id, hits, room) };
        pairs.extend_by(hits.count_ones() as usize);
    } else {
        pairs.push_mask(query.id, &view.ids[at..], hits);
    }
}

#[inline(always)]
fn sweep<L: Lanes, R: Rows>(lanes: L, view: &View<'_>, rows: Range<usize>, pairs: &mut Pairs) {
    debug_assert!(rows.end <= view.len);
    for i in rows {
        let query = view.query(i);
        let mut at = i + 1;
        while at < view.len {
            // SAFETY: `at < view.len`; the caller enabled the instructions of `L`.
            let (reach, hits) = unsafe { lanes.reach_and_hits(view, at, &query) };
            if hits != 0 {
                add::<L, R>(lanes, view, at, &query, hits, pairs);
            }
            if reach != L::ALL {
                break;
            }
            at += L::COUNT;
        }
        // 2^20 boxes in one point have 5 * 10^11 pairs: a caller who wants a thousand must not wait for all.
        if pairs.is_over() {
            return;
        }
    }
}

#[inline(always)]
fn brute<L: Lanes>(lanes: L, view: &View<'_>, rows: Range<usize>, first: impl Fn(usize) -> usize, pairs: &mut Pairs) {
    debug_assert!(rows.end <= view.len);
    for i in rows {
        let query = view.query(i);
        let mut at = first(i);
        while at < view.len {
            // SAFETY: `at < view.len`; the caller enabled the instructions of `L`.
            let hits = unsafe { lanes.reach_and_hits(view, at, &query).1 & lanes.ends_after(view, at, query.low[0]) };
            if hits != 0 {
                add::<L, All>(lanes, view, at, &query, hits, pairs);
            }
            at += L::COUNT;
        }
        // As in `sweep`.
        if pairs.is_over() {
            return;
        }
    }
}

/// Returns the lower and the upper bounds of a box, in lanes 0 to 2. Lane 3 is unspecified.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
pub(crate) fn corners(b: &Aabb) -> [std::arch::x86_64::__m128; 2] {
    use std::arch::x86_64::*;
    let at = std::ptr::from_ref(b).cast::<f32>();
    // SAFETY: SSE2 is part of x86-64. The loads read floats 0 to 3 and 2 to 5 of an `Aabb`, which is `repr(C)`.
    unsafe { [_mm_loadu_ps(at), _mm_castsi128_ps(_mm_srli_si128::<4>(_mm_castps_si128(_mm_loadu_ps(at.add(2)))))] }
}

/// Writes the pairs of a box with each of the others whose bit is set to the head of `room`.
#[inline(always)]
fn write_each(id: u32, others: &[u32], hits: u32, room: &mut [Pair]) {
    let mut room = room.iter_mut();
    each_bit(hits, |bit| {
        let other = others[bit];
        if let Some(pair) = room.next() {
            *pair = (id.min(other), id.max(other));
        }
    });
}

/// Returns whether two boxes overlap, without the branches of [`Aabb::overlaps`]: no CPU predicts them if every other
/// pair is a hit.
#[inline(always)]
pub(crate) fn overlap(a: &Aabb, b: &Aabb) -> bool {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::*;
        let ([low_a, high_a], [low_b, high_b]) = (corners(a), corners(b));
        // SAFETY: SSE is part of x86-64.
        unsafe {
            let meet = _mm_and_ps(_mm_cmple_ps(low_a, high_b), _mm_cmple_ps(low_b, high_a));
            _mm_movemask_ps(meet) & 7 == 7
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    {
        let axis = |k: usize| (a.min[k] <= b.max[k]) & (b.min[k] <= a.max[k]);
        axis(0) & axis(1) & axis(2)
    }
}

/// Prefetches a value that is needed soon; does nothing on targets without such an instruction.
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
        // A value that need not begin a cache line may end in one more: of boxes, one in four does.
        if const { align_of::<T>() < 64 } {
            // SAFETY: as above.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(at.add(size_of::<T>() - 1)) };
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = value;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Aabb, Filter, Membership};
    use std::sync::Arc;

    /// `overlapping` counts the pairs that the filter drops too: it shows how many were found.
    #[test]
    fn search_over_limit_ends_with_its_row() {
        let boxes = vec![Aabb::cube([1.0; 3], 0.5); 1000];
        let mut columns = Columns::default();
        columns.resize(boxes.len()).unwrap();
        boxes.iter().enumerate().for_each(|(row, b)| columns.as_mut().set(row, b, 0, row as u32));
        let ground = |k: usize| Membership { fixed: k >= 500, ..Membership::ALL };
        let whole = {
            let mut pairs = Pairs::new();
            pairs.set_limit(Some(10));
            pairs.set_filter(Some(Filter::new((0..1000).map(ground).collect())));
            pairs
        };
        let brute_rows =
            |simd, columns: &Columns, rows, pairs: &mut Pairs| brute_rows(simd, columns, rows, |row| row + 1, pairs);
        for search in [&sweep_rows::<All> as &dyn Fn(Simd, &Columns, Range<usize>, &mut Pairs), &brute_rows] {
            let mut pairs = whole.clone();
            search(Simd::Portable, &columns, 0..1000, &mut pairs);
            assert!(pairs.is_over() && pairs.overlapping() == 10, "{}", pairs.overlapping());
            search(Simd::Portable, &columns, 600..1000, &mut pairs);
            assert_eq!(pairs.overlapping(), 10, "a list over the limit is left alone");
            // So is another part of the same frame.
            let any_over = Arc::default();
            let mut parts = [Pairs::new(), Pairs::new()];
            parts.iter_mut().for_each(|part| part.begin_part(&whole, &any_over));
            parts.iter_mut().for_each(|part| search(Simd::Portable, &columns, 0..1000, part));
            assert_eq!(parts.map(|part| part.len()), [10, 0]);
        }
    }

    #[test]
    fn portable_kernels_match_the_double_loop() {
        let boxes: Vec<Aabb> = (0..203)
            .map(|k| Aabb::cube([k as f32 / 8.0, (k * 7 % 13) as f32, (k * 5 % 11) as f32], 0.5 + (k % 5) as f32))
            .collect();
        let mut columns = Columns::default();
        columns.resize(boxes.len()).unwrap();
        let mut at: Vec<usize> = (0..boxes.len()).collect();
        at.sort_by(|&a, &b| boxes[a].min[0].total_cmp(&boxes[b].min[0]));
        for (row, &id) in at.iter().enumerate() {
            columns.as_mut().set(row, &boxes[id], 0, id as u32);
        }
        let mut expected = Pairs::new();
        (0..boxes.len()).for_each(|j| {
            (0..j).filter(|&i| boxes[i].overlaps(&boxes[j])).for_each(|i| expected.push(i as u32, j as u32));
        });
        let view = View::new(&columns);
        let (mut swept, mut tested) = (Pairs::new(), Pairs::new());
        sweep::<_, All>(portable::Portable, &view, 0..boxes.len(), &mut swept);
        brute(portable::Portable, &view, 0..boxes.len(), |row| row + 1, &mut tested);
        assert_eq!(swept.fingerprint(), expected.fingerprint());
        assert_eq!(tested.fingerprint(), expected.fingerprint());
    }
}
