//! Boxes as columns, so that one vector instruction tests several of them.

use crate::{Aabb, Error};
use std::ops::Range;

/// Readable values behind the last box: the widest vector may start at any box and run past the end.
pub(super) const PADDING: usize = 16;

/// Boxes as eight columns: three lower bounds, three upper bounds, positions in the input, and for a strip the mask of
/// [`StripGrid::each_strip`](crate::load::StripGrid::each_strip).
///
/// Axis 0 is the sweep axis, whichever axis of the input that is. Each column has at least `len() + PADDING` values.
#[derive(Debug, Default)]
pub(crate) struct Columns {
    pub(super) low: [Vec<f32>; 3],
    pub(super) high: [Vec<f32>; 3],
    pub(super) ids: Vec<u32>,
    pub(super) begins: Vec<u32>,
    len: usize,
}

/// A contiguous part of the columns, open for writing.
pub(crate) struct ColumnsMut<'a> {
    pub(crate) low: [&'a mut [f32]; 3],
    pub(crate) high: [&'a mut [f32]; 3],
    pub(crate) ids: &'a mut [u32],
    pub(crate) begins: &'a mut [u32],
}

impl Columns {
    /// Makes room for `len` boxes, whose values are unspecified until written.
    pub(crate) fn resize(&mut self, len: usize) -> Result<(), Error> {
        for column in self.low.iter_mut().chain(&mut self.high) {
            ensure(column, len + PADDING, "columns of boxes")?;
        }
        ensure(&mut self.ids, len + PADDING, "columns of boxes")?;
        ensure(&mut self.begins, len + PADDING, "columns of boxes")?;
        // NaN compares false with everything: the padding ends every sweep and is never a hit.
        self.low[0][len..len + PADDING].fill(f32::NAN);
        self.len = len;
        Ok(())
    }

    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// Returns all boxes, open for writing.
    pub(crate) fn as_mut(&mut self) -> ColumnsMut<'_> {
        let len = self.len;
        ColumnsMut {
            low: self.low.each_mut().map(|c| &mut c[..len]),
            high: self.high.each_mut().map(|c| &mut c[..len]),
            ids: &mut self.ids[..len],
            begins: &mut self.begins[..len],
        }
    }

    /// Returns the boxes in parts of `size`, open for writing.
    pub(crate) fn parts(&mut self, size: usize) -> impl Iterator<Item = ColumnsMut<'_>> + Send {
        let ColumnsMut { low, high, ids, begins } = self.as_mut();
        let (mut low, mut high) = (low.map(|c| c.chunks_mut(size)), high.map(|c| c.chunks_mut(size)));
        ids.chunks_mut(size).zip(begins.chunks_mut(size)).map(move |(ids, begins)| ColumnsMut {
            low: low.each_mut().map(|c| c.next().unwrap_or_default()),
            high: high.each_mut().map(|c| c.next().unwrap_or_default()),
            ids,
            begins,
        })
    }
}

impl ColumnsMut<'_> {
    pub(crate) fn len(&self) -> usize {
        self.ids.len()
    }

    /// Writes box `id` at position `at`, its axes rotated so that `axis` comes first.
    #[inline]
    pub(crate) fn set(&mut self, at: usize, b: &Aabb, axis: usize, id: u32) {
        for k in 0..3 {
            let from = (axis + k) % 3;
            self.low[k][at] = b.min[from];
            self.high[k][at] = b.max[from];
        }
        self.ids[at] = id;
    }
}

/// Grows `list` to at least `len` elements, and by a sixteenth more. Reports a refused allocation.
///
/// It never shrinks, and its elements stay initialised, so that a steady state writes each element once. `Vec` alone
/// would double its memory, which no frame of that size needs.
pub(crate) fn ensure<T: Default>(list: &mut Vec<T>, len: usize, what: &'static str) -> Result<(), Error> {
    if list.len() < len {
        let len = len + len / 16;
        list.try_reserve_exact(len - list.len()).map_err(|_| Error::OutOfMemory { what, elements: len })?;
        list.resize_with(len, T::default);
    }
    Ok(())
}

/// Makes room for `more` elements behind those of a list. Reports a refused allocation.
pub(crate) fn reserve<T>(list: &mut Vec<T>, more: usize, what: &'static str) -> Result<(), Error> {
    list.try_reserve(more).map_err(|_| Error::OutOfMemory { what, elements: list.len() + more })
}

/// Splits a list into parts of these lengths.
pub(crate) fn split<T>(list: &mut [T], lengths: impl Iterator<Item = usize>) -> impl Iterator<Item = &mut [T]> {
    let mut rest = list;
    lengths.map(move |length| {
        let (part, behind) = std::mem::take(&mut rest).split_at_mut(length);
        rest = behind;
        part
    })
}

/// Returns part `k` of `parts` equal parts of `0..len`.
pub(crate) fn part(len: usize, k: usize, parts: usize) -> Range<usize> {
    let at = |k: usize| (len as u64 * k as u64 / parts as u64) as usize;
    at(k)..at(k + 1)
}

/// Maps a bound, which is not NaN, to an integer of the same order.
#[inline]
pub(crate) fn order_key(v: f32) -> u32 {
    let bits = v.to_bits();
    // Negative floats descend as integers: flip all their bits, and the sign bit of the others.
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}
