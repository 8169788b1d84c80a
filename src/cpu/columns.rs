//! Boxes turned into columns, so that one vector instruction tests several of them.

use crate::aabb::Aabb;
use crate::error::Error;
use std::ops::Range;

/// Readable boxes behind the last one: the widest vector may start at any box and run past the end.
pub(super) const PADDING: usize = 16;

/// Boxes as eight columns: three lower bounds, three upper bounds, positions in the input, and for a strip
/// the mask of [`StripGrid::each_strip`](crate::load::StripGrid::each_strip).
///
/// Axis 0 is the sweep axis, whichever axis of the input that is.
#[derive(Debug, Default)]
pub(crate) struct Columns {
    low: [Vec<f32>; 3],
    high: [Vec<f32>; 3],
    ids: Vec<u32>,
    begins: Vec<u32>,
    len: usize,
}

/// The columns with their padding: at least `len() + 16` values each.
pub(crate) struct Padded<'a> {
    pub(crate) low: [&'a [f32]; 3],
    pub(crate) high: [&'a [f32]; 3],
    pub(crate) ids: &'a [u32],
    pub(crate) begins: &'a [u32],
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

    pub(crate) fn low(&self, axis: usize) -> &[f32] {
        &self.low[axis][..self.len]
    }

    pub(crate) fn high(&self, axis: usize) -> &[f32] {
        &self.high[axis][..self.len]
    }

    pub(crate) fn ids(&self) -> &[u32] {
        &self.ids[..self.len]
    }

    pub(crate) fn padded(&self) -> Padded<'_> {
        let end = self.len + PADDING;
        Padded {
            low: self.low.each_ref().map(|c| &c[..end]),
            high: self.high.each_ref().map(|c| &c[..end]),
            ids: &self.ids[..end],
            begins: &self.begins[..end],
        }
    }

    /// All boxes, open for writing.
    pub(crate) fn as_mut(&mut self) -> ColumnsMut<'_> {
        let len = self.len;
        let [a, b, c] = &mut self.low;
        let [d, e, f] = &mut self.high;
        ColumnsMut {
            low: [&mut a[..len], &mut b[..len], &mut c[..len]],
            high: [&mut d[..len], &mut e[..len], &mut f[..len]],
            ids: &mut self.ids[..len],
            begins: &mut self.begins[..len],
        }
    }
}

impl<'a> ColumnsMut<'a> {
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

    /// The parts before and from `middle`.
    #[cfg(feature = "parallel")]
    pub(crate) fn split(self, middle: usize) -> (ColumnsMut<'a>, ColumnsMut<'a>) {
        let ([a, b, c], [d, e, f]) = (self.low, self.high);
        let cut = |v: &'a mut [f32]| v.split_at_mut(middle);
        let ((a0, a1), (b0, b1), (c0, c1)) = (cut(a), cut(b), cut(c));
        let ((d0, d1), (e0, e1), (f0, f1)) = (cut(d), cut(e), cut(f));
        let (i0, i1) = self.ids.split_at_mut(middle);
        let (g0, g1) = self.begins.split_at_mut(middle);
        (
            ColumnsMut { low: [a0, b0, c0], high: [d0, e0, f0], ids: i0, begins: g0 },
            ColumnsMut { low: [a1, b1, c1], high: [d1, e1, f1], ids: i1, begins: g1 },
        )
    }
}

/// Grows `list` to at least `len` elements, a sixteenth more, and reports a refused allocation.
///
/// It never shrinks, and elements once there stay initialised, so that a steady state writes each element just once. Twice the length, as
/// lists grow by themselves, would hold memory that no frame of that size needs.
pub(crate) fn ensure<T: Clone + Default>(list: &mut Vec<T>, len: usize, what: &'static str) -> Result<(), Error> {
    if list.len() < len {
        let len = len + len / 16;
        list.try_reserve_exact(len - list.len()).map_err(|_| Error::OutOfMemory { what, elements: len })?;
        list.resize(len, T::default());
    }
    Ok(())
}

/// Part `k` of `parts` equal parts of `0..len`.
pub(crate) fn part(len: usize, k: usize, parts: usize) -> Range<usize> {
    let at = |k: usize| (len as u64 * k as u64 / parts as u64) as usize;
    at(k)..at(k + 1)
}

/// Maps a bound to an integer of the same order. NaN must not come here.
#[inline]
pub(crate) fn order_key(v: f32) -> u32 {
    let bits = v.to_bits();
    // Negative floats descend as integers: flip all their bits, and the sign bit of the others.
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_keys_ascend_with_the_bounds() {
        let values = [f32::NEG_INFINITY, -1.0e30, -1.0, -1.0e-40, -0.0, 0.0, 1.0e-40, 1.0, 1.0e30, f32::INFINITY];
        assert!(values.map(order_key).is_sorted_by(|a, b| a < b));
    }

    #[test]
    fn parts_cover_everything_once() {
        for (len, parts) in [(0, 3), (1, 4), (10, 3), (16, 16)] {
            let all: Vec<usize> = (0..parts).flat_map(|k| part(len, k, parts)).collect();
            assert_eq!(all, (0..len).collect::<Vec<_>>());
        }
    }
}
