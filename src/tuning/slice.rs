//! A slice through the loads: where along it the cheapest algorithm changes.

use super::AlgorithmCost;
use crate::Load;
use crate::cost::Counts;

/// Loads this far apart in objects, as a logarithm, have nothing looked up between them: a field narrower than that may be
/// missed.
const FINEST_LN: f64 = 0.03;

/// Halvings of a stretch that is [`FINEST_LN`] wide: a border in it is then known to a ten-thousandth.
const HALVINGS: u32 = 8;

/// Loads, ascending by objects, and everything between them on logarithmic axes. A place is the number of a load and the share
/// of the way to the next.
pub(super) struct Slice<'a> {
    loads: &'a [Load],
}

/// A stretch of a slice: the places, loads and cheapest algorithms at its two ends.
#[derive(Clone, Copy)]
struct Stretch {
    from: (f64, Load, usize),
    to: (f64, Load, usize),
}

impl<'a> Slice<'a> {
    pub(super) fn new(loads: &'a [Load]) -> Self {
        Self { loads }
    }

    fn last(&self) -> f64 {
        self.loads.len().saturating_sub(1) as f64
    }

    fn load(&self, place: f64) -> Load {
        let below = (place.max(0.0) as usize).min(self.loads.len() - 1);
        let share = place - below as f64;
        match self.loads.get(below + 1) {
            Some(above) if share > 0.0 => between(&self.loads[below], above, share),
            _ => self.loads[below],
        }
    }

    /// The place of a number of objects, or the nearest end.
    fn place(&self, objects: f64) -> f64 {
        let above = self.loads.partition_point(|l| f64::from(l.objects) <= objects);
        let (Some(below), Some(b)) = (above.checked_sub(1), self.loads.get(above)) else {
            return if above == 0 { 0.0 } else { self.last() };
        };
        let [a, x, b] = [f64::from(self.loads[below].objects), objects, f64::from(b.objects)].map(|n| (n + 1.0).ln());
        below as f64 + (x - a) / (b - a)
    }

    /// The number of objects from which a condition holds, looking from `objects` upwards or downwards in steps that double,
    /// then halving the last of them. The end of the slice where it holds nowhere. A short stretch in which it holds may be
    /// stepped over.
    pub(super) fn reach(&self, objects: f64, upwards: bool, holds: impl Fn(&Load) -> bool) -> f64 {
        let (start, end) = (self.place(objects), if upwards { self.last() } else { 0.0 });
        let (mut not_yet, mut at, mut step) = (start, start, 0.05);
        while !holds(&self.load(at)) {
            if at == end {
                return f64::from(self.load(end).objects);
            }
            not_yet = at;
            at = if upwards { (at + step).min(end) } else { (at - step).max(end) };
            step *= 2.0;
        }
        // A hundredth of the distance between two loads is less than a percent in objects for those that ask.
        while (at - not_yet).abs() > 0.01 {
            let middle = f64::midpoint(at, not_yet);
            *(if holds(&self.load(middle)) { &mut at } else { &mut not_yet }) = middle;
        }
        f64::from(self.load(at).objects)
    }

    /// The loads from which on another algorithm is the cheapest, and which, by its position in `costs`. The first is where the
    /// slice begins.
    ///
    /// Halves the slice, and in each stretch keeps only the algorithms that may be the cheapest somewhere within: those whose cost
    /// can fall below what the others can't exceed. Where one is left there is nothing to look for.
    pub(super) fn steps(&self, costs: &[AlgorithmCost]) -> Vec<(Load, usize)> {
        let all: Vec<usize> = (0..costs.len()).collect();
        let mut steps = Vec::new();
        let Some(first) = self.loads.first() else { return steps };
        let Some(best) = cheapest(costs, &all, first) else { return steps };
        steps.push((*first, best));
        let mut from = (0.0, *first, best);
        for (k, load) in self.loads.iter().enumerate().skip(1) {
            let to = (k as f64, *load, cheapest(costs, &all, load).unwrap_or(best));
            self.search(costs, &all, Stretch { from, to }, &mut steps);
            from = to;
        }
        steps
    }

    fn search(&self, costs: &[AlgorithmCost], among: &[usize], stretch: Stretch, steps: &mut Vec<(Load, usize)>) {
        let Stretch { from, to } = stretch;
        if to.1.objects <= from.1.objects.saturating_add(1)
            || (f64::from(to.1.objects) / f64::from(from.1.objects.max(1))).ln() <= FINEST_LN
        {
            if from.2 != to.2 {
                note(steps, self.crossing(&costs[from.2], &costs[to.2], stretch), to.2);
            }
            return;
        }
        let candidates = candidates(costs, among, &from.1, &to.1);
        if candidates.len() < 2 {
            return;
        }
        let place = f64::midpoint(from.0, to.0);
        let load = self.load(place);
        let middle = (place, load, cheapest(costs, &candidates, &load).unwrap_or(from.2));
        self.search(costs, &candidates, Stretch { from, to: middle }, steps);
        self.search(costs, &candidates, Stretch { from: middle, to }, steps);
    }

    /// The first load of a stretch at which the second of two algorithms is cheaper.
    fn crossing(&self, below: &AlgorithmCost, above: &AlgorithmCost, stretch: Stretch) -> Load {
        let (mut low, mut high, mut load) = (stretch.from.0, stretch.to.0, stretch.to.1);
        for _ in 0..HALVINGS {
            let place = f64::midpoint(low, high);
            let middle = self.load(place);
            if above.curve.cost_ns(&middle) < below.curve.cost_ns(&middle) {
                (high, load) = (place, middle);
            } else {
                low = place;
            }
        }
        load
    }
}

/// Notes that an algorithm is the cheapest from a load on. Between two whole numbers of objects no other one is.
fn note(steps: &mut Vec<(Load, usize)>, load: Load, best: usize) {
    while steps.last().is_some_and(|s| s.0.objects >= load.objects) && steps.len() > 1 {
        steps.pop();
    }
    match steps.last_mut() {
        Some(last) if last.0.objects >= load.objects => last.1 = best,
        Some(last) if last.1 == best => {}
        _ => steps.push((load, best)),
    }
}

fn cheapest(costs: &[AlgorithmCost], among: &[usize], load: &Load) -> Option<usize> {
    let counts = Counts::new(load);
    let mut best: Option<(usize, f64)> = None;
    for &k in among {
        let ns = costs[k].curve.cost_of(&counts);
        if best.is_none_or(|b| ns < b.1) {
            best = Some((k, ns));
        }
    }
    best.map(|b| b.0)
}

/// Which algorithms may be the cheapest at some load between two.
fn candidates(costs: &[AlgorithmCost], among: &[usize], a: &Load, b: &Load) -> Vec<usize> {
    // No figure of a load in between lies outside those of the two, and no count of operations falls when a figure rises.
    let corner = |of: fn(f64, f64) -> f64| Load {
        objects: of(f64::from(a.objects), f64::from(b.objects)) as u32,
        axis_candidates: of(a.axis_candidates, b.axis_candidates),
        strip_candidates: of(a.strip_candidates, b.strip_candidates),
        pairs: of(a.pairs, b.pairs),
        moved: of(a.moved, b.moved),
    };
    let (least, most) = (corner(f64::min), corner(f64::max));
    let (least, most) = (Counts::new(&least), Counts::new(&most));
    let bounds: Vec<(f64, f64)> = among.iter().map(|&k| costs[k].curve.bounds(&least, &most)).collect();
    let reached = bounds.iter().map(|b| b.1).fold(f64::INFINITY, f64::min);
    // Rounding must not shut out the cheapest itself.
    among.iter().zip(&bounds).filter(|(_, b)| b.0 <= reached * (1.0 + 1e-9)).map(|(&k, _)| k).collect()
}

/// The load a share of the way from one to another.
fn between(a: &Load, b: &Load, share: f64) -> Load {
    // Shifted by one because a candidate count may be zero.
    let mix = |x: f64, y: f64| ((x + 1.0).ln() * (1.0 - share) + (y + 1.0).ln() * share).exp() - 1.0;
    Load {
        objects: mix(f64::from(a.objects), f64::from(b.objects)).round() as u32,
        axis_candidates: mix(a.axis_candidates, b.axis_candidates),
        strip_candidates: mix(a.strip_candidates, b.strip_candidates),
        pairs: mix(a.pairs, b.pairs),
        moved: a.moved * (1.0 - share) + b.moved * share,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::splitmix;
    use crate::{CostCurve, CostTerm, Knot, Term};

    fn draw(state: &mut u64) -> f64 {
        (splitmix::next(state) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Curves of many terms with corrections that bend, over loads of which some figures fall while the objects rise.
    fn drawn(seed: u64) -> (Vec<AlgorithmCost>, Vec<Load>) {
        let mut state = seed;
        let costs = (0..16).map(|k| {
            let mut unit = |scale: f64| scale * (6.0 * draw(&mut state) - 3.0).exp();
            let terms = vec![
                CostTerm { term: Term::Call, unit_ns: unit(2000.0) },
                CostTerm { term: Term::Objects, unit_ns: unit(20.0) },
                CostTerm { term: Term::Sort, unit_ns: unit(1.0) },
                CostTerm { term: Term::ColdObjects, unit_ns: unit(5.0) },
                CostTerm { term: Term::AllPairs, unit_ns: unit(0.01) },
                CostTerm { term: Term::StripCandidates, unit_ns: unit(1.0) },
                CostTerm { term: Term::Moved, unit_ns: unit(20.0) },
            ];
            let knot = |k| Knot { log2_objects: f64::from(k), ln_factor: 0.4 * draw(&mut state) };
            let curve =
                CostCurve { terms, fallback_terms: Vec::new(), cache_bytes: 1e6, correction: (3..=24).map(knot).collect() };
            AlgorithmCost { algorithm: format!("m{k}@cpu1").parse().unwrap(), revision: 1, curve, spread_ln: 0.1 }
        });
        let costs = costs.collect();
        let load = |k: i32| {
            let n = 10.0_f64.powf(f64::from(k) / 4.0).round();
            let strip_candidates = 3.0 * n.powf(1.2);
            Load { objects: n as u32, strip_candidates, moved: n.powf(-0.2), pairs: n, axis_candidates: n.powf(1.6) }
        };
        (costs, (4..=24).map(load).collect())
    }

    #[test]
    fn no_field_of_three_percent_is_lost_against_a_walk_in_steps_of_a_thousandth() {
        let mut borders = 0;
        for seed in 0..40 {
            let (costs, loads) = drawn(seed);
            let slice = Slice::new(&loads);
            let all: Vec<usize> = (0..costs.len()).collect();
            let mut walked: Vec<(u32, usize)> = Vec::new();
            let mut place = 0.0;
            while place <= slice.last() {
                let load = slice.load(place);
                let best = cheapest(&costs, &all, &load).unwrap();
                if walked.last().is_none_or(|w| w.1 != best) {
                    walked.push((load.objects, best));
                }
                place += 0.001 / (10.0_f64.ln() / 4.0);
            }
            let steps = slice.steps(&costs);
            let at = |n: u32| steps[..steps.partition_point(|s| s.0.objects <= n)].last().unwrap().1;
            for (k, &(objects, best)) in walked.iter().enumerate() {
                let next = walked.get(k + 1).map_or(1_000_000, |w| w.0);
                if f64::from(next) > 1.031 * f64::from(objects) && next > objects + 1 {
                    let middle = (f64::from(objects) * f64::from(next)).sqrt() as u32;
                    assert_eq!(at(middle), best, "seed {seed}: {objects} to {next} of {walked:?}");
                }
            }
            assert!(steps.is_sorted_by(|a, b| a.0.objects < b.0.objects && a.1 != b.1), "seed {seed}");
            borders += steps.len() - 1;
        }
        assert!(borders > 80, "{borders} borders");
    }

    #[test]
    fn a_reach_ends_where_its_condition_begins_or_where_the_slice_ends() {
        let loads: Vec<Load> = (1..=20).map(|k| Load { objects: 1 << k, ..Load::default() }).collect();
        let slice = Slice::new(&loads);
        let from = |objects: f64, upwards, limit: u32| slice.reach(objects, upwards, |l| (l.objects > limit) == upwards);
        assert!((from(1000.0, true, 5000) / 5000.0 - 1.0).abs() < 0.01);
        assert!((from(1000.0, false, 70) / 70.0 - 1.0).abs() < 0.02);
        assert_eq!((from(1000.0, true, u32::MAX), from(1000.0, false, 0)), (1_048_576.0, 2.0));
        // Where it holds from the start, nothing is walked.
        assert_eq!(from(1000.0, true, 10), 1000.0);
    }

    #[test]
    fn borders_between_neighbouring_numbers_of_objects_collapse() {
        let load = |objects| Load { objects, ..Load::default() };
        let mut steps = vec![(load(10), 0)];
        note(&mut steps, load(11), 1);
        note(&mut steps, load(11), 2);
        assert_eq!(steps, [(load(10), 0), (load(11), 2)]);
        note(&mut steps, load(11), 0);
        assert_eq!(steps, [(load(10), 0)]);
        note(&mut steps, load(10), 3);
        assert_eq!(steps, [(load(10), 3)]);
    }
}
