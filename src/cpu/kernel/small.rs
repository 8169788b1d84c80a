//! All pairs of a few dozen boxes.

use super::rows::Query;
use super::{Floats, Level, View, at_level};
use crate::Pairs;
use crate::cpu::{Columns, Simd};

/// The most rows: a bit each in a word.
pub(crate) const MOST_ROWS: usize = 64;

/// Rows whose pairs are written together.
const WRITTEN: usize = 8;

/// Pairs written for each row before it is known whether there are any. Most boxes of a small world have at most that
/// many behind them, and no CPU predicts the number.
const UNASKED: usize = 2;

/// Tests every row against all rows behind it, on all three axes, and adds the pairs. Row k is box `first + k`; there
/// are at most [`MOST_ROWS`].
pub(crate) fn small_world(simd: Simd, columns: &Columns, first: u32, pairs: &mut Pairs) {
    small_at(simd, &View::new(columns), first, pairs);
}

at_level! {
    #[inline(always)]
    fn small_at[] [](view: &View<'_>, first: u32, pairs: &mut Pairs) = small;
}

#[inline(always)]
fn small<L: Level>(view: &View<'_>, first: u32, pairs: &mut Pairs, level: L) {
    let mut hits = [0; MOST_ROWS];
    let hits = &mut hits[..view.len];
    for at in (0..view.len).step_by(L::Rows::COUNT) {
        // The rows up to the end of this vector.
        let rows = view.len.min(at + L::Rows::COUNT);
        let (low, high) = (view.low.map(|c| &c[..rows]), view.high.map(|c| &c[..rows]));
        for (row, hits) in hits[..rows].iter_mut().enumerate() {
            let query = Query { low: low.map(|c| c[row]), high: high.map(|c| c[row]), id: 0, begins: 0 };
            *hits |= u64::from(view.hits(at, &query, level)) << at;
        }
    }
    hits.iter_mut().enumerate().for_each(|(row, hits)| *hits &= !1 << row);
    for (from, hits) in (0..).step_by(WRITTEN).zip(hits.chunks(WRITTEN)) {
        add(first, from, hits, pairs);
    }
}

/// Adds the pairs of row `from + k` with the rows b, b the bits of `hits[k]`. Row 0 is box `first`.
#[inline(always)]
fn add(first: u32, from: u32, hits: &[u64], pairs: &mut Pairs) {
    // Wrapping: without a hit this is no box.
    let pair = |id, hits: u64| (id, first.wrapping_add(hits.trailing_zeros()));
    let rows = (first + from..).zip(hits.iter().copied());
    if let Some(room) = pairs.room(WRITTEN * MOST_ROWS) {
        let mut added = 0;
        for (id, mut hits) in rows {
            for _ in 0..UNASKED {
                room[added] = pair(id, hits);
                added += usize::from(hits != 0);
                hits &= hits.wrapping_sub(1);
            }
            while hits != 0 {
                room[added] = pair(id, hits);
                added += 1;
                hits &= hits - 1;
            }
        }
        pairs.extend_by(added);
    } else {
        for (id, mut hits) in rows {
            while hits != 0 {
                let (id, other) = pair(id, hits);
                pairs.push(id, other);
                hits &= hits - 1;
            }
        }
    }
}
