//! The inner loops: one box against several at a time, at every SIMD level.
//!
//! Each loop is written once over a [`Level`], and compiled for each level inside a function that enables its
//! instructions. A closure is compiled by itself, without these instructions, unless the compiler inlines it: vectors
//! stand in small closures alone, elsewhere in functions that are always inlined.

pub(crate) mod bounds;
pub(crate) mod contain;
pub(crate) mod distance;
mod floats;
pub(crate) mod marks;
pub(crate) mod nearest_first;
pub(crate) mod node;
pub(crate) mod ray;
pub(crate) mod small;
pub(crate) mod walk;
#[cfg(target_arch = "x86_64")]
mod x86;

use crate::aabb::Aabb;
use crate::cpu::columns::{Columns, PADDING};
use crate::cpu::level::Simd;
use crate::pair::Pair;
use crate::pairs::{Pairs, each_bit};
use baseline::Four;
use contain::{BLOCK, within};
use floats::Floats;
use node::LANES;
use std::ops::Range;

/// A SIMD level for which code is compiled. A value proves that this CPU has its instructions.
pub(crate) trait Level: Copy {
    /// Rows of columns that are tested together: at most 16.
    type Rows: Floats;
    /// The lanes of a node.
    type Lanes: Floats;

    /// Returns the rows of `hits` whose pair with the box this strip has to report: those for which both bits of the
    /// mask of [`StripGrid::each_strip`](crate::load::StripGrid::each_strip) are set in either box. Bit k of `hits` is
    /// row `at + k`.
    ///
    /// # Safety
    /// `at <= view.len`.
    #[inline(always)]
    unsafe fn owned(self, view: &View<'_>, at: usize, begins: u32, hits: u32) -> u32 {
        let mut owned = hits;
        // Most boxes stand in one strip: both bits are set, and those of the others don't matter.
        if begins != 3 {
            each_bit(hits, |bit| owned &= !(u32::from(begins | view.begins[at + bit] != 3) << bit));
        }
        owned
    }

    /// Writes the pairs of `id` with the rows of `hits` to the head of `room`, which holds a pair for each row that is
    /// tested. The rest of `room` is unspecified afterwards.
    ///
    /// # Safety
    /// `at <= view.len`.
    #[inline(always)]
    unsafe fn write_rows(self, view: &View<'_>, at: usize, id: u32, hits: u32, room: &mut [Pair]) {
        write_each(id, &view.ids[at..], hits, room);
    }

    /// Writes the pairs of a box with each of `others` whose bit is set to the head of `room`. The rest of `room` is
    /// unspecified afterwards.
    #[inline(always)]
    fn write(self, id: u32, others: &[u32; LANES], hits: u32, room: &mut [Pair; LANES]) {
        write_each(id, others, hits, room);
    }

    /// Returns whether all of these boxes are valid and lie within the others.
    #[inline(always)]
    fn all_within(self, boxes: &[Aabb; BLOCK], outer: &[Aabb; BLOCK]) -> bool {
        boxes.iter().zip(outer).fold(true, |all, (b, outer)| all & within(b, outer))
    }
}

/// The instructions that every CPU of the target has: SSE2 on x86-64, `simd128` on WebAssembly if the build has it,
/// elsewhere what the compiler makes of plain Rust.
#[derive(Clone, Copy)]
pub(crate) struct Baseline;

impl Level for Baseline {
    type Rows = baseline::Rows;
    type Lanes = baseline::Lanes;
}

#[cfg(target_arch = "x86_64")]
mod baseline {
    use std::arch::x86_64::__m128;
    pub(super) type Four = [__m128; 1];
    pub(super) type Rows = [__m128; 2];
    pub(super) type Lanes = [__m128; 4];
}

#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
mod baseline {
    use std::arch::wasm32::v128;
    pub(super) type Four = [v128; 1];
    pub(super) type Rows = [v128; 2];
    pub(super) type Lanes = [v128; 4];
}

#[cfg(not(any(target_arch = "x86_64", all(target_arch = "wasm32", target_feature = "simd128"))))]
mod baseline {
    pub(super) type Four = [f32; 4];
    pub(super) type Rows = [f32; 4];
    pub(super) type Lanes = [f32; 16];
}

/// Calls a kernel in a function that enables the instructions of a SIMD level. The kernel is inlined there, and takes
/// the [`Level`] behind its other arguments. In brackets: generic parameters of the kernel before that of the level,
/// then their names.
macro_rules! at_level {
    (
        $simd:expr, [$($generic:tt)*] [$($name:ident)*]
        $($kernel:ident)::+ ($($arg:ident: $of:ty),* $(,)?) $(-> $out:ty)?
    ) => {{
        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = "avx512f")]
        fn avx512<$($generic)*>($($arg: $of,)* level: $crate::cpu::level::Avx512) $(-> $out)? {
            $($kernel)::+::<$($name,)* _>($($arg,)* level)
        }
        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = "avx2")]
        fn avx2<$($generic)*>($($arg: $of,)* level: $crate::cpu::level::Avx2) $(-> $out)? {
            $($kernel)::+::<$($name,)* _>($($arg,)* level)
        }
        match $simd {
            // SAFETY: the level proves that this CPU has the instructions.
            #[cfg(target_arch = "x86_64")]
            $crate::cpu::level::Simd::Avx512(level) => unsafe { avx512::<$($name,)*>($($arg,)* level) },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            $crate::cpu::level::Simd::Avx2(level) => unsafe { avx2::<$($name,)*>($($arg,)* level) },
            $crate::cpu::level::Simd::Portable => {
                $($kernel)::+::<$($name,)* _>($($arg,)* $crate::cpu::kernel::Baseline)
            }
        }
    }};
}
use at_level;

/// Tests every row of `rows` against the rows behind it, up to the first that begins beyond its end on the sweep axis,
/// and adds the pairs: all of them, or those that this strip has to report, because two boxes may share several.
///
/// The columns must ascend by lower bound on the sweep axis.
//
// Never inlined: amid the code of a task it gets fewer registers.
#[inline(never)]
pub(crate) fn sweep_rows<const IN_STRIP: bool>(simd: Simd, columns: &Columns, rows: Range<usize>, pairs: &mut Pairs) {
    if pairs.is_any_over() {
        return;
    }
    let view = &View::new(columns);
    at_level!(simd, [const IN_STRIP: bool] [IN_STRIP] sweep(view: &View<'_>, rows: Range<usize>, pairs: &mut Pairs));
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
    let view = &View::new(columns);
    at_level!(simd, [] [] brute(
        view: &View<'_>,
        rows: Range<usize>,
        first: impl Fn(usize) -> usize,
        pairs: &mut Pairs,
    ));
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
pub(crate) struct View<'a> {
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

    /// Tests the rows from `at` on against a box that begins no later on the sweep axis. Returns which begin before
    /// its end, and which of those overlap it on the other two axes too, one bit each.
    ///
    /// # Safety
    /// `at <= self.len`.
    #[inline(always)]
    unsafe fn reach_and_hits<L: Level>(&self, at: usize, query: &Query, _: L) -> (u32, u32) {
        // SAFETY: every column has 16 values behind `self.len`; the level proves that this CPU has its instructions.
        unsafe {
            let load = |column: &[f32]| L::Rows::load(column.as_ptr().add(at));
            let begins = |a: usize| load(self.low[a]).at_most(L::Rows::splat(query.high[a]));
            let ends = |a: usize| L::Rows::splat(query.low[a]).at_most(load(self.high[a]));
            let reach = begins(0);
            if L::Rows::SCALAR && L::Rows::bits(reach) == 0 {
                return (0, 0);
            }
            // Each comparison by itself: one masked by the result of another would wait for it.
            let across = L::Rows::and(L::Rows::and(begins(1), ends(1)), L::Rows::and(begins(2), ends(2)));
            (L::Rows::bits(reach), L::Rows::bits(L::Rows::and(reach, across)))
        }
    }

    /// Tests the rows from `at` on against a box on all three axes. Returns the hits, one bit each.
    #[inline(always)]
    fn hits<L: Level>(&self, at: usize, query: &Query, level: L) -> u32 {
        assert!(at <= self.len);
        // SAFETY: as there.
        unsafe {
            let high = L::Rows::load(self.high[0].as_ptr().add(at));
            let ends = L::Rows::bits(L::Rows::splat(query.low[0]).at_most(high));
            self.reach_and_hits(at, query, level).1 & ends
        }
    }
}

/// Adds the pairs of a row and the rows that it hits.
#[inline(always)]
fn add<const IN_STRIP: bool, L: Level>(
    view: &View<'_>,
    at: usize,
    query: &Query,
    hits: u32,
    pairs: &mut Pairs,
    level: L,
) {
    // SAFETY: the callers test rows from `at < view.len` on.
    let hits = if IN_STRIP { unsafe { level.owned(view, at, query.begins, hits) } } else { hits };
    if let Some(room) = pairs.room(L::Rows::COUNT) {
        // SAFETY: as above.
        unsafe { level.write_rows(view, at, query.id, hits, room) };
        pairs.extend_by(hits.count_ones() as usize);
    } else {
        pairs.push_mask(query.id, &view.ids[at..], hits);
    }
}

#[inline(always)]
fn sweep<const IN_STRIP: bool, L: Level>(view: &View<'_>, rows: Range<usize>, pairs: &mut Pairs, level: L) {
    debug_assert!(rows.end <= view.len);
    let all = u32::MAX >> (u32::BITS as usize - L::Rows::COUNT);
    for i in rows {
        let query = view.query(i);
        let mut at = i + 1;
        while at < view.len {
            // SAFETY: `at < view.len`.
            let (reach, hits) = unsafe { view.reach_and_hits(at, &query, level) };
            if hits != 0 {
                add::<IN_STRIP, _>(view, at, &query, hits, pairs, level);
            }
            if reach != all {
                break;
            }
            at += L::Rows::COUNT;
        }
        // 2^20 boxes in one point have 5 * 10^11 pairs: a caller who wants a thousand must not wait for all.
        if pairs.is_over() {
            return;
        }
    }
}

#[inline(always)]
fn brute<L: Level>(view: &View<'_>, rows: Range<usize>, first: impl Fn(usize) -> usize, pairs: &mut Pairs, level: L) {
    debug_assert!(rows.end <= view.len);
    for i in rows {
        let query = view.query(i);
        let mut at = first(i);
        while at < view.len {
            let hits = view.hits(at, &query, level);
            if hits != 0 {
                add::<false, _>(view, at, &query, hits, pairs, level);
            }
            at += L::Rows::COUNT;
        }
        // As in `sweep`.
        if pairs.is_over() {
            return;
        }
    }
}

/// Returns the lower and the upper bounds of a box, in lanes 0 to 2. Lane 3 is unspecified.
#[inline(always)]
pub(crate) fn corners(b: &Aabb) -> [Four; 2] {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::*;
        let at = std::ptr::from_ref(b).cast::<f32>();
        // SAFETY: SSE2 is part of x86-64. The loads read floats 0 to 3 and 2 to 5 of an `Aabb`, which is `repr(C)`.
        unsafe {
            let high = _mm_srli_si128::<4>(_mm_castps_si128(_mm_loadu_ps(at.add(2))));
            [[_mm_loadu_ps(at)], [_mm_castsi128_ps(high)]]
        }
    }
    // SAFETY: every CPU of the target has the instructions of `Four`; there are four floats to read.
    #[cfg(not(target_arch = "x86_64"))]
    [b.min, b.max].map(|[x, y, z]| unsafe { Four::load([x, y, z, 0.0].as_ptr()) })
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
    let ([low_a, high_a], [low_b, high_b]) = (corners(a), corners(b));
    // SAFETY: every CPU has the instructions of `Four`.
    unsafe { Four::bits(Four::and(low_a.at_most(high_b), low_b.at_most(high_a))) & 7 == 7 }
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
        for search in [&sweep_rows::<false> as &dyn Fn(Simd, &Columns, Range<usize>, &mut Pairs), &brute_rows] {
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

    /// The level of every CPU but those of x86-64.
    #[derive(Clone, Copy)]
    struct Plain;

    impl Level for Plain {
        type Rows = [f32; 4];
        type Lanes = [f32; LANES];
    }

    #[test]
    fn plain_kernels_match_the_double_loop() {
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
        sweep::<false, _>(&view, 0..boxes.len(), &mut swept, Plain);
        brute(&view, 0..boxes.len(), |row| row + 1, &mut tested, Plain);
        assert_eq!(swept.fingerprint(), expected.fingerprint());
        assert_eq!(tested.fingerprint(), expected.fingerprint());
    }
}
