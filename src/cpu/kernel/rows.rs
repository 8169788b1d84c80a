//! The rows of columns against one another: the sweep, and all pairs.

use super::{Floats, Level, at_level};
use crate::Pairs;
use crate::cpu::columns::PADDING;
use crate::cpu::{Columns, Simd};
use std::ops::Range;

/// Tests every row of `rows` against the rows behind it, up to the first that begins beyond its end on the sweep axis,
/// and adds the pairs: all of them, or those that this strip has to report, because two boxes may share several.
///
/// The columns must ascend by lower bound on the sweep axis.
//
// Never inlined: amid the code of a task it gets fewer registers.
#[inline(never)]
pub(crate) fn sweep_rows<const IN_STRIP: bool>(simd: Simd, columns: &Columns, rows: Range<usize>, pairs: &mut Pairs) {
    if !pairs.is_any_over() {
        sweep_at::<IN_STRIP>(simd, &View::new(columns), rows, pairs);
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
    if !pairs.is_any_over() {
        brute_at(simd, &View::new(columns), rows, first, pairs);
    }
}

// With the view made in the kernels a sweep takes 6 % more instructions.
at_level! {
    #[inline(always)]
    fn sweep_at[const IN_STRIP: bool] [IN_STRIP](view: &View<'_>, rows: Range<usize>, pairs: &mut Pairs) = sweep;

    #[inline(always)]
    fn brute_at[] [](view: &View<'_>, rows: Range<usize>, first: impl Fn(usize) -> usize, pairs: &mut Pairs) = brute;
}

/// The one box.
#[derive(Debug, Clone, Copy)]
pub(super) struct Query {
    /// Bounds, sweep axis first.
    pub(super) low: [f32; 3],
    pub(super) high: [f32; 3],
    pub(super) id: u32,
    /// As in [`Columns::begins`].
    pub(super) begins: u32,
}

/// The columns with their padding.
pub(crate) struct View<'a> {
    pub(super) low: [&'a [f32]; 3],
    pub(super) high: [&'a [f32]; 3],
    pub(super) ids: &'a [u32],
    pub(super) begins: &'a [u32],
    /// Rows that hold boxes. Every column has [`PADDING`] more values behind them.
    pub(super) len: usize,
}

impl<'a> View<'a> {
    pub(super) fn new(columns: &'a Columns) -> Self {
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
    pub(super) fn hits<L: Level>(&self, at: usize, query: &Query, level: L) -> u32 {
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

#[cfg(test)]
mod tests {
    use super::super::node::LANES;
    use super::*;
    use crate::cpu::brute::double_loop;
    use crate::{Aabb, Filter, Membership};
    use std::sync::Arc;

    /// Returns boxes as columns, ascending along x.
    fn sorted(boxes: &[Aabb]) -> Columns {
        let mut columns = Columns::default();
        columns.resize(boxes.len()).unwrap();
        let mut ids: Vec<usize> = (0..boxes.len()).collect();
        ids.sort_by(|&a, &b| boxes[a].min[0].total_cmp(&boxes[b].min[0]));
        ids.iter().enumerate().for_each(|(row, &id)| columns.as_mut().set(row, &boxes[id], 0, id as u32));
        columns
    }

    /// `overlapping` counts the pairs that the filter drops too: it shows how many were found.
    #[test]
    fn search_over_limit_ends_with_its_row() {
        let columns = sorted(&[Aabb::cube([1.0; 3], 0.5); 1000]);
        let ground = |k: usize| Membership { fixed: k >= 500, ..Membership::ALL };
        let mut whole = Pairs::new();
        whole.set_limit(Some(10));
        whole.set_filter(Some(Filter::new((0..1000).map(ground).collect())));
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
        let columns = sorted(&boxes);
        let expected = double_loop(&boxes);
        let (mut swept, mut tested) = (Pairs::new(), Pairs::new());
        let view = View::new(&columns);
        sweep::<false, _>(&view, 0..boxes.len(), &mut swept, Plain);
        brute(&view, 0..boxes.len(), |row| row + 1, &mut tested, Plain);
        assert_eq!(swept.fingerprint(), expected.fingerprint());
        assert_eq!(tested.fingerprint(), expected.fingerprint());
    }
}
