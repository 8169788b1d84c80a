//! How an axis is divided into cells; see `shaders/division.wgsl`.
//!
//! With cells of one width, a few boxes far away would leave few cells for the others. So an axis is divided into
//! parts, each with cells of one width. The ends of the parts are the corners of a line that approximates the
//! distribution of the boxes, by the method of Ramer (1972) and of Douglas and Peucker (1973). Evenly spread boxes
//! have one part; otherwise each cluster and each gap has its own.

/// Most parts of an axis: eight clusters and the gaps between them.
pub(super) const PARTS: usize = 16;

/// A part is straight unless the rank of a box is off its line by more than this times the root of the number of
/// boxes. One in a thousand samples of evenly spread boxes has such a box (Kolmogorov's distribution).
const NOISE: f64 = 1.95;

/// A cluster ends this many mean distances beyond its outermost sampled box, because others lie further out.
const BEYOND: f64 = 2.0;

/// The parts of an axis, ascending.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Parts {
    /// Begin of each part, with the rank of the sampled box there. The last entry is the end of the last part.
    corners: [(f64, f64); PARTS + 1],
    count: usize,
}

/// A part with its cells: `Segment` of `shaders/common.wgsl`.
#[derive(Debug, Clone, Copy, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct Segment {
    begin: f32,
    /// Cells in a unit of length; 0 if the part has one cell.
    per_length: f32,
    /// The number of its first cell.
    first: u32,
    /// Its last cell, counted from its first.
    last: u32,
}

/// The cells of an axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Division {
    pub(super) segments: [Segment; PARTS],
    pub(super) cells: u32,
}

impl Parts {
    /// Divides an axis by the centres of sampled boxes, ascending and finite.
    pub(super) fn of(centres: &[f32]) -> Self {
        let Some(end) = centres.len().checked_sub(1) else { return Self { count: 1, ..Self::default() } };
        // First and last box, and the sharpest corner between.
        let part = |first: usize, last: usize| (first, last, sharpest(centres, first, last));
        let mut straight = vec![part(0, end)];
        while straight.len() < PARTS
            && let Some((k, corner)) = straight
                .iter()
                .enumerate()
                .filter_map(|(k, part)| Some((k, part.2?)))
                .max_by(|a, b| a.1.1.total_cmp(&b.1.1))
        {
            let (first, last, _) = straight[k];
            straight.splice(k..=k, [part(first, corner.0), part(corner.0, last)]);
        }
        let mut parts = Self { count: straight.len(), ..Self::default() };
        let ends = straight.iter().map(|part| part.0).chain([end]);
        for (corner, at) in parts.corners.iter_mut().zip(ends) {
            *corner = (f64::from(centres[at]), at as f64);
        }
        parts.widen_clusters();
        parts
    }

    /// Moves each corner into the emptier of its two parts.
    fn widen_clusters(&mut self) {
        let corners = self.corners;
        let width = |k: usize| corners[k + 1].0 - corners[k].0;
        let distance = |k: usize| width(k) / (corners[k + 1].1 - corners[k].1);
        for k in 1..self.count {
            // Neither end passes the middle of a part, because both may move.
            let (before, after) = (distance(k - 1), distance(k));
            self.corners[k].0 += if before < after {
                (BEYOND * before).min(0.4 * width(k))
            } else {
                -(BEYOND * after).min(0.4 * width(k - 1))
            };
        }
    }

    /// Divides each part into cells. `cells` maps the part's width and its share of the boxes to their number; each
    /// part has at least one.
    pub(super) fn divide(&self, cells: impl Fn(f64, f64) -> f64) -> Division {
        let all = self.corners[self.count].1.max(1.0);
        // Unused parts begin at the largest float: the kernels clamp bounds below it.
        let mut division = Division { segments: [Segment { begin: f32::MAX, ..Segment::default() }; PARTS], cells: 0 };
        for (segment, ends) in division.segments.iter_mut().zip(self.corners[..=self.count].windows(2)) {
            let width = ends[1].0 - ends[0].0;
            let wanted = cells(width, (ends[1].1 - ends[0].1) / all).floor().max(1.0);
            // A part has one cell if it has no width, or if the inverse of a cell's width overflows.
            let per_length = if wanted > 1.0 { (wanted / width) as f32 } else { 0.0 };
            let count = if per_length.is_finite() { wanted as u32 } else { 1 };
            *segment = Segment {
                begin: ends[0].0 as f32,
                per_length: if count > 1 { per_length } else { 0.0 },
                first: division.cells,
                last: count - 1,
            };
            division.cells += count;
        }
        division
    }
}

/// Returns the box that is furthest from the line between two others, and its distance over that of noise. `None` if
/// noise explains all.
fn sharpest(centres: &[f32], first: usize, last: usize) -> Option<(usize, f64)> {
    let at = |k: usize| f64::from(centres[k]);
    let boxes = (last - first) as f64;
    let per_length = boxes / (at(last) - at(first));
    let off = |k: usize| ((k - first) as f64 - (at(k) - at(first)) * per_length).abs() / (NOISE * boxes.sqrt());
    let all = (first + 1..last).map(|k| (k, off(k)));
    all.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|&(_, off)| off.is_finite() && off > 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the cell of a value, as the kernel does.
    fn cell(division: &Division, value: f32) -> u32 {
        let segment = division.segments.iter().rev().find(|s| s.begin <= value).unwrap_or(&division.segments[0]);
        segment.first + (((value - segment.begin) * segment.per_length).max(0.0) as u32).min(segment.last)
    }

    /// Returns 256 uniformly random places, sorted.
    fn evenly(seed: u64, length: f64) -> Vec<f32> {
        let mut list: Vec<f32> = (0..256)
            .map(|k| (sapwise::internals::splitmix::mix(seed << 32 | k) as f64 / u64::MAX as f64 * length) as f32)
            .collect();
        list.sort_unstable_by(f32::total_cmp);
        list
    }

    #[test]
    fn evenly_spread_boxes_have_one_part() {
        let bent = (0..1000).filter(|&seed| Parts::of(&evenly(seed, 100.0)).count > 1).count();
        assert!(bent <= 5, "{bent} of 1000");
        let division = Parts::of(&evenly(1, 100.0)).divide(|width, share| (width * share / 9.0).round());
        assert_eq!((division.cells, division.segments[1].begin), (11, f32::MAX));
    }

    #[test]
    fn clusters_and_gaps_have_their_own_parts() {
        // Two clusters of length 100, a million apart, and a few boxes far below both.
        let mut centres: Vec<f32> = evenly(1, 100.0)
            .into_iter()
            .step_by(2)
            .chain(evenly(2, 100.0).into_iter().step_by(2).map(|v| v + 1.0e6))
            .collect();
        centres.splice(0..0, [-1.0e30; 12]);
        let parts = Parts::of(&centres);
        let division = parts.divide(|_, share| 1000.0 * share);
        let in_cluster = |low: f32| {
            (0..100).map(|k| cell(&division, low + k as f32)).collect::<std::collections::BTreeSet<_>>().len()
        };
        assert!(in_cluster(0.0) > 90 && in_cluster(1.0e6) > 90, "{division:?}");
        assert!((4..=7).contains(&parts.count), "{parts:?}");
    }

    #[test]
    fn no_cell_descends_as_the_bound_ascends() {
        for seed in 0..50 {
            // Exponential growth has the most corners.
            let centres: Vec<f32> =
                evenly(seed, 1.0).iter().map(|v| (v * 40.0 * ((seed % 7) as f32 + 0.1)).exp() - 5.0).collect();
            let division = Parts::of(&centres).divide(|width, share| (width * 3.0).min(share * 5000.0));
            let mut bounds: Vec<f32> =
                centres.iter().flat_map(|&v| [v.next_down(), v, v.next_up(), v * 1.5, -v]).collect();
            bounds.extend(division.segments.iter().flat_map(|s| [s.begin.next_down(), s.begin, s.begin.next_up()]));
            bounds.extend([-1.0e38, 1.0e38, 0.0]);
            bounds.retain(|v| v.abs() <= 1.0e38);
            bounds.sort_unstable_by(f32::total_cmp);
            assert!(bounds.is_sorted_by_key(|&v| cell(&division, v)), "{division:?}");
            assert!(bounds.iter().all(|&v| cell(&division, v) < division.cells));
        }
    }

    #[test]
    fn worlds_without_a_width_have_one_cell() {
        for centres in [&[][..], &[1.0], &[1.0, 1.0, 1.0], &[0.0, f32::MIN_POSITIVE / 1.0e6]] {
            let division = Parts::of(centres).divide(|_, _| 1.0e6);
            assert_eq!((division.cells, division.segments[0].per_length), (1, 0.0), "{centres:?}");
        }
    }
}
