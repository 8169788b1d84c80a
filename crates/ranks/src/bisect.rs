//! Cuts space so that each rank has its share of the work: recursive coordinate bisection (Berger and Bokhari, 1987).
//!
//! Each plane is a weighted quantile of the centres of boxes. Ranks find it exactly, digit by digit, by adding up
//! histograms over ordered floats. So no rank needs the boxes of another, and boxes far away or infinite widen no
//! histogram. Each part gets a plane on every axis and keeps the one that the least work crosses.

use crate::cuts::{Cuts, Plane, centre, middle};
use crate::sample::Sample;

/// Bins of a histogram: a digit of eight bits.
const BINS: usize = 256;
/// A plane is good enough if the work below it is off by at most this fraction: 1 / `FINE`.
const FINE: u64 = 2000;

/// A part of space to divide.
struct Part {
    /// Position of its plane in pre-order.
    plane: usize,
    /// Its ranks.
    first: usize,
    end: usize,
    /// Share of its work wanted below the plane.
    share: f64,
    cuts: [Search; 3],
}

/// The search for a plane on one axis.
#[derive(Debug, Clone, Copy, Default)]
struct Search {
    /// The digits found so far.
    prefix: u64,
    /// Work below all centres with these digits.
    below: u64,
    /// Work wanted below the plane.
    target: u64,
    /// The plane as an ordered number, and the work below it.
    found: Option<(u64, u64)>,
}

/// Cuts space by samples of the boxes and each rank's share of the work.
///
/// `sum` replaces each value by its sum over all ranks, as [`Exchange::sum`](crate::Exchange::sum) does; with the
/// samples of all ranks in one place it does nothing. All ranks pass the same `shares`, whose sum is 1, and get the
/// same cuts. It takes a few passes over the samples for each doubling of ranks, and sums at most 6 KiB a rank in a
/// pass.
pub fn bisect(samples: &mut [Sample], shares: &[f64], sum: &mut dyn FnMut(&mut [u64])) -> Cuts {
    let mut planes = vec![Plane { axis: 0, at: 0.0 }; shares.len().saturating_sub(1)];
    let mut parts: Vec<Part> = part(0, 0, shares.len(), shares).into_iter().collect();
    samples.iter_mut().for_each(|s| s.part = 0);
    while !parts.is_empty() {
        search(samples, &mut parts, sum);
        let axes = axes(samples, &parts, sum);
        let mut next = Vec::with_capacity(2 * parts.len());
        // The parts below and above each plane.
        let mut moves = Vec::with_capacity(parts.len());
        for (part_, axis) in parts.iter().zip(axes) {
            let plane = Plane { axis: axis as u8, at: value(part_.cuts[axis].plane().0) };
            planes[part_.plane] = plane;
            let half = middle(part_.first, part_.end);
            let mut enter = |child: Option<Part>| {
                child.map_or(u32::MAX, |c| {
                    next.push(c);
                    next.len() as u32 - 1
                })
            };
            let below = enter(part(part_.plane + 1, part_.first, half, shares));
            let above = enter(part(part_.plane + half - part_.first, half, part_.end, shares));
            moves.push((plane, below, above));
        }
        for s in samples.iter_mut().filter(|s| s.part != u32::MAX) {
            let (plane, below, above) = moves[s.part as usize];
            s.part = if centre(&s.bounds)[usize::from(plane.axis)] < plane.at { below } else { above };
        }
        parts = next;
    }
    Cuts::new(planes)
}

/// The part of these ranks; `None` for a single rank.
fn part(plane: usize, first: usize, end: usize, shares: &[f64]) -> Option<Part> {
    if end - first < 2 {
        return None;
    }
    let sum = |ranks: &[f64]| ranks.iter().sum::<f64>();
    let (below, all) = (sum(&shares[first..middle(first, end)]), sum(&shares[first..end]));
    let even = (middle(first, end) - first) as f64 / (end - first) as f64;
    let share = if all > 0.0 { (below / all).clamp(0.0, 1.0) } else { even };
    Some(Part { plane, first, end, share, cuts: [Search::default(); 3] })
}

/// Finds a plane on each axis of each part, digit by digit.
fn search(samples: &[Sample], parts: &mut [Part], sum: &mut dyn FnMut(&mut [u64])) {
    for round in 0..4 {
        let shift = 24 - 8 * round;
        // Only unfinished searches have a histogram.
        let mut slots = vec![[usize::MAX; 3]; parts.len()];
        let mut open = 0;
        for (slots, part) in slots.iter_mut().zip(&*parts) {
            for (slot, _) in slots.iter_mut().zip(&part.cuts).filter(|(_, cut)| cut.found.is_none()) {
                *slot = open;
                open += 1;
            }
        }
        if open == 0 {
            return;
        }
        let mut bins = vec![0; open * BINS];
        for s in samples.iter().filter(|s| s.part != u32::MAX) {
            let (slots, part) = (slots[s.part as usize], &parts[s.part as usize]);
            let middle = centre(&s.bounds);
            for a in 0..3 {
                let key = key(middle[a]);
                if slots[a] != usize::MAX && (round == 0 || key >> (shift + 8) == part.cuts[a].prefix) {
                    bins[slots[a] * BINS + (key >> shift) as usize % BINS] += s.weight;
                }
            }
        }
        sum(&mut bins);
        for (part, slots) in parts.iter_mut().zip(&slots) {
            for (cut, &slot) in part.cuts.iter_mut().zip(slots).filter(|(_, slot)| **slot != usize::MAX) {
                cut.narrow(&bins[slot * BINS..(slot + 1) * BINS], shift, part.share);
            }
        }
    }
}

impl Search {
    /// Continues in the bin that contains the target, or ends at an edge near it.
    fn narrow(&mut self, bins: &[u64], shift: u32, share: f64) {
        if shift == 24 {
            self.target = (bins.iter().sum::<u64>() as f64 * share) as u64;
        }
        let fine = self.target / FINE;
        let edge = |bin: usize| (self.prefix << 8 | bin as u64) << shift;
        let mut below = self.below;
        for (bin, &work) in bins.iter().enumerate() {
            let above = below + work;
            // A histogram without work ends at its first edge.
            if above >= self.target || bin + 1 == BINS {
                let (under, over) = (self.target.abs_diff(below), self.target.abs_diff(above));
                if shift == 0 || under.min(over) <= fine {
                    self.found =
                        Some(if under <= over { (edge(bin), below) } else { (edge(bin) + (1 << shift), above) });
                } else {
                    self.prefix = self.prefix << 8 | bin as u64;
                    self.below = below;
                }
                return;
            }
            below = above;
        }
    }

    /// The plane as an ordered number, and the work below it; zeros if none was found.
    fn plane(&self) -> (u64, u64) {
        self.found.unwrap_or_default()
    }
}

/// Chooses for each part the axis whose plane crosses the least work and comes closest to the share.
fn axes(samples: &[Sample], parts: &[Part], sum: &mut dyn FnMut(&mut [u64])) -> Vec<usize> {
    let mut crossed = vec![0; 3 * parts.len()];
    let planes: Vec<[f32; 3]> = parts.iter().map(|p| p.cuts.map(|cut| value(cut.plane().0))).collect();
    for s in samples.iter().filter(|s| s.part != u32::MAX) {
        let part = s.part as usize;
        for a in 0..3 {
            let at = planes[part][a];
            if s.bounds.min[a] < at && s.bounds.max[a] >= at {
                crossed[3 * part + a] += s.weight;
            }
        }
    }
    sum(&mut crossed);
    // All ranks of the part wait for the work that one side has too much of.
    let cost = |k: usize, a: usize| {
        let (part, cut) = (&parts[k], &parts[k].cuts[a]);
        crossed[3 * k + a]
            .saturating_add(cut.plane().1.abs_diff(cut.target).saturating_mul((part.end - part.first) as u64))
    };
    (0..parts.len()).map(|k| (0..3).min_by_key(|&a| cost(k, a)).unwrap_or(0)).collect()
}

/// A float as an integer in the same order.
#[inline]
fn key(v: f32) -> u64 {
    let bits = v.to_bits();
    u64::from(if bits >> 31 == 1 { !bits } else { bits | 1 << 31 })
}

/// The float of such an integer, clamped to the finite ones.
fn value(key: u64) -> f32 {
    let key = key.min(u64::from(u32::MAX)) as u32;
    let v = f32::from_bits(if key >> 31 == 1 { key & !(1 << 31) } else { !key });
    // NaNs are beyond the infinities, the negative ones below.
    if v.is_nan() { if key >> 31 == 1 { f32::MAX } else { f32::MIN } } else { v.clamp(f32::MIN, f32::MAX) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Exchange, Threads};
    use sapwise::Aabb;
    use sapwise_scenes::{Random, Scenario};

    fn counts(cuts: &Cuts, boxes: &[Aabb]) -> Vec<usize> {
        let mut counts = vec![0; cuts.regions().len()];
        boxes.iter().for_each(|b| counts[cuts.rank_of(centre(b))] += 1);
        counts
    }

    #[test]
    fn ordered_numbers_are_in_the_order_of_floats() {
        let values = [f32::NEG_INFINITY, f32::MIN, -1.5, -1e-40, 0.0, 1e-40, 2.0, f32::MAX, f32::INFINITY];
        assert!(values.windows(2).all(|w| key(w[0]) < key(w[1])));
        assert!(values[1..8].iter().all(|&v| value(key(v)) == v));
        assert_eq!([value(0), value(1 << 32)], [f32::MIN, f32::MAX]);
    }

    #[test]
    fn every_rank_gets_its_share_and_the_same_cuts() {
        for scenario in [Scenario::Uniform, Scenario::Clustered, Scenario::Parked, Scenario::Stations, Scenario::Tower]
        {
            let scene = scenario.start(7000, 1);
            let boxes = scene.boxes();
            for ranks in [2, 3, 7, 16] {
                let mut shares: Vec<f64> = (0..ranks).map(|k| 1.0 + k as f64 / ranks as f64).collect();
                let all: f64 = shares.iter().sum();
                shares.iter_mut().for_each(|s| *s /= all);
                let found = Threads::run(ranks, |mut threads| {
                    let own: Vec<Aabb> = boxes.iter().skip(threads.rank()).step_by(ranks).copied().collect();
                    bisect(&mut Sample::of(&own, usize::MAX), &shares, &mut |v| threads.sum(v))
                });
                assert!(found.iter().all(|cuts| *cuts == found[0]));
                for (count, share) in counts(&found[0], boxes).into_iter().zip(&shares) {
                    let wanted = share * boxes.len() as f64;
                    let off = (count as f64 - wanted).abs();
                    assert!(off < 0.01 * wanted + 4.0, "{scenario} {ranks}: {count} of {wanted}");
                }
            }
        }
    }

    #[test]
    fn a_row_is_cut_across_and_one_point_is_not_cut() {
        let row: Vec<Aabb> = (0..1000).map(|k| Aabb::new([0.0, k as f32, 0.0], [9.0, k as f32 + 0.5, 9.0])).collect();
        let point = vec![Aabb::cube([3.0; 3], 0.5); 100];
        let found = Threads::run(4, |mut threads| {
            let first = threads.rank() == 0;
            let mut cut = |boxes: &[Aabb]| {
                let own = if first { boxes } else { &[] };
                bisect(&mut Sample::of(own, usize::MAX), &[0.25; 4], &mut |v| threads.sum(v))
            };
            [cut(&row), cut(&point), cut(&[])]
        });
        let [row_cuts, point_cuts, none] = &found[0];
        assert_eq!(counts(row_cuts, &row), [250; 4]);
        assert!(row_cuts.regions().iter().all(|r| r.low[0] == f32::NEG_INFINITY && r.low[2] == f32::NEG_INFINITY));
        let mut at_point = counts(point_cuts, &point);
        at_point.sort_unstable();
        assert_eq!(at_point, [0, 0, 0, 100]);
        assert_eq!(none.regions().len(), 4);
    }

    #[test]
    fn a_region_has_fewer_expensive_boxes() {
        let mut random = Random::new(1);
        let boxes: Vec<Aabb> = (0..8000).map(|_| Aabb::cube([random.uniform() as f32, 0.0, 0.0], 0.0)).collect();
        let found = Threads::run(2, |mut threads| {
            let own: Vec<Aabb> = boxes.iter().skip(threads.rank()).step_by(2).copied().collect();
            let mut samples = Sample::of(&own, 1000);
            let halves = Cuts::new(vec![Plane { axis: 0, at: 0.5 }]);
            Sample::weigh(&mut samples, &halves, &[3.0, 1.0]);
            bisect(&mut samples, &[0.5; 2], &mut |v| threads.sum(v))
        });
        // Boxes below 1/2 weigh 3, so half of the weight is below 1/3.
        assert!((found[0].regions()[0].high[0] - 1.0 / 3.0).abs() < 0.02, "{:?}", found[0]);
    }
}
