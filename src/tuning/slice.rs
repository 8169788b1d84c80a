//! Finds where the cheapest algorithm changes along a line of loads.

use super::{AlgorithmCost, Crossover};
use crate::Load;
use crate::cost::Frame;
use crate::stats::NORMAL_90;

/// Distance between two loads that are compared, as a logarithm of objects. A narrower field may be missed.
const FINEST_LN: f64 = 0.03;

/// An algorithm within this factor of the cheapest keeps its field. The larger factor applies if both have the same
/// method: in small frames all its numbers of threads run the same code, and chance decides which is cheaper.
const SAME: f64 = 1.02;
const SAME_METHOD: f64 = 1.05;

/// Halvings of a stretch of [`FINEST_LN`]: they find a crossover to a ten-thousandth.
const HALVINGS: u32 = 8;

/// Loads that ascend by objects, interpolated in between on logarithmic axes. A place is the position of a load plus
/// the share of the way to the next.
pub(super) struct Slice<'a>(pub(super) &'a [Load]);

impl Slice<'_> {
    fn last(&self) -> f64 {
        self.0.len().saturating_sub(1) as f64
    }

    fn load(&self, place: f64) -> Load {
        let below = (place.max(0.0) as usize).min(self.0.len() - 1);
        let share = place - below as f64;
        match self.0.get(below + 1) {
            Some(above) if share > 0.0 => between(&self.0[below], above, share),
            _ => self.0[below],
        }
    }

    /// Returns the place of a number of objects, or the nearer end.
    fn place(&self, objects: f64) -> f64 {
        let above = self.0.partition_point(|l| f64::from(l.objects) <= objects);
        let (Some(below), Some(b)) = (above.checked_sub(1), self.0.get(above)) else {
            return if above == 0 { 0.0 } else { self.last() };
        };
        let [a, x, b] = [f64::from(self.0[below].objects), objects, f64::from(b.objects)].map(|n| (n + 1.0).ln());
        below as f64 + (x - a) / (b - a)
    }

    /// Returns the number of objects at which a condition begins to hold, upwards or downwards from `objects`; the end
    /// of the slice if it never does. Doubling steps find a load at which it holds, and may miss a short stretch.
    /// Halving the last step finds the begin.
    fn reach(&self, objects: f64, upwards: bool, holds: impl Fn(&Load) -> bool) -> f64 {
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
        // With four loads a decade a hundredth of their distance is 0.6 % in objects.
        while (at - not_yet).abs() > 0.01 {
            let middle = f64::midpoint(at, not_yet);
            *(if holds(&self.load(middle)) { &mut at } else { &mut not_yet }) = middle;
        }
        f64::from(self.load(at).objects)
    }

    /// Returns the loads from which another algorithm is the cheapest, with its position in `costs`. The first load is
    /// the begin of the slice. An algorithm keeps its field while it is within [`SAME`] of the cheapest.
    pub(super) fn steps(&self, costs: &[AlgorithmCost]) -> Vec<(Load, usize)> {
        let mut steps = Vec::new();
        let Some(first) = self.0.first() else { return steps };
        let Some((cheapest_here, least)) = cheapest(costs, first, |_| true) else { return steps };
        // The first of those that cost about the same: it has the fewest threads.
        let holds = |best: usize, other: usize, load: &Load, least: f64| {
            let same_method = costs[best].algorithm.method() == costs[other].algorithm.method();
            costs[best].curve.cost_ns(load) <= if same_method { SAME_METHOD } else { SAME } * least
        };
        let same = |k: &usize| holds(*k, cheapest_here, first, least);
        let mut best = (0..costs.len()).find(same).unwrap_or(cheapest_here);
        steps.push((*first, best));
        // Places since the last step, all of which belong to its algorithm.
        let mut held = vec![(0.0, *first)];
        for k in 1..self.0.len() {
            let ln = (f64::from(self.0[k].objects) / f64::from(self.0[k - 1].objects.max(1))).ln();
            let parts = (ln / FINEST_LN).ceil().max(1.0) as u32;
            for part in 1..=parts {
                let place = (k - 1) as f64 + f64::from(part) / f64::from(parts);
                let load = self.load(place);
                let Some((other, least)) = cheapest(costs, &load, |_| true) else { return steps };
                if !holds(best, other, &load, least) {
                    // Goes back to the last place at which the other algorithm was not cheaper.
                    let not_cheaper = |load: &Load| costs[other].curve.cost_ns(load) >= costs[best].curve.cost_ns(load);
                    let from = held.iter().rposition(|(_, load)| not_cheaper(load)).unwrap_or(0);
                    let to = held.get(from + 1).copied().unwrap_or((place, load));
                    note(&mut steps, self.crossing(&costs[best], &costs[other], held[from].0, to), other);
                    best = other;
                    held.clear();
                }
                held.push((place, load));
            }
        }
        steps
    }

    /// Returns the crossover of two algorithms whose fields meet at `objects` objects. `spread` returns the standard
    /// deviation of the logarithm of the ratio of the two costs.
    pub(super) fn crossover(
        &self,
        below: &AlgorithmCost,
        above: &AlgorithmCost,
        objects: u32,
        spread: impl Fn(&Load) -> f64,
    ) -> Crossover {
        let objects = f64::from(objects);
        let doubt = |load: &Load| NORMAL_90 * spread(load);
        // Positive if the algorithm of the upper field is cheaper.
        let gain = |load: &Load| (below.curve.cost_ns(load) / above.curve.cost_ns(load)).ln();
        Crossover {
            below: below.algorithm.clone(),
            above: above.algorithm.clone(),
            objects,
            low: Some(self.reach(objects, false, |load| gain(load) <= -doubt(load))),
            high: Some(self.reach(objects, true, |load| gain(load) >= doubt(load))),
        }
    }

    /// Returns the first load between two places at which `above` is cheaper than `below`.
    fn crossing(&self, below: &AlgorithmCost, above: &AlgorithmCost, from: f64, to: (f64, Load)) -> Load {
        let (mut low, (mut high, mut load)) = (from, to);
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

/// Adds a step. It replaces steps that begin at the same number of objects or later.
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

/// Returns position and cost of the cheapest usable algorithm.
pub(super) fn cheapest(costs: &[AlgorithmCost], load: &Load, usable: impl Fn(usize) -> bool) -> Option<(usize, f64)> {
    let frame = Frame::new(load);
    let usable = costs.iter().enumerate().filter(|&(k, _)| usable(k));
    usable.map(|(k, cost)| (k, cost.curve.cost_of(&frame))).min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Interpolates between two loads.
fn between(a: &Load, b: &Load, share: f64) -> Load {
    // Shifted by one, because a count may be zero.
    let mix = |x: f64, y: f64| ((x + 1.0).ln() * (1.0 - share) + (y + 1.0).ln() * share).exp() - 1.0;
    Load {
        objects: mix(f64::from(a.objects), f64::from(b.objects)).round() as u32,
        axis_candidates: mix(a.axis_candidates, b.axis_candidates),
        strip_candidates: mix(a.strip_candidates, b.strip_candidates),
        pairs: mix(a.pairs, b.pairs),
        moved: a.moved * (1.0 - share) + b.moved * share,
        moved_share: a.moved_share * (1.0 - share) + b.moved_share * share,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tuning::Term;
    use crate::tuning::tests::{cost, drawn::drawn};

    #[test]
    fn no_field_of_three_percent_is_missed() {
        let mut borders = 0;
        for seed in 0..40 {
            let (costs, loads) = drawn(seed);
            let slice = Slice(&loads);
            let steps = slice.steps(&costs);
            let at = |n: u32| steps[..steps.partition_point(|s| s.0.objects <= n)].last().unwrap().1;
            let mut place = 0.0;
            let mut worse_since = None;
            while place <= slice.last() {
                let load = slice.load(place);
                let (_, least) = cheapest(&costs, &load, |_| true).unwrap();
                // The choice may cost 2 % more, and anything along 3 % of the objects.
                worse_since = (costs[at(load.objects)].curve.cost_ns(&load) > 1.021 * least)
                    .then(|| worse_since.unwrap_or(load.objects));
                let since = worse_since.unwrap_or(load.objects);
                assert!(
                    f64::from(load.objects) <= 1.035 * f64::from(since) || load.objects <= since + 1,
                    "seed {seed}: from {since} to {} of {steps:?}",
                    load.objects
                );
                place += 0.001 / (10.0_f64.ln() / 4.0);
            }
            assert!(steps.is_sorted_by(|a, b| a.0.objects < b.0.objects && a.1 != b.1), "seed {seed}");
            borders += steps.len() - 1;
        }
        assert!(borders > 60, "{borders} borders");
    }

    #[test]
    fn the_fewest_threads_win_a_tie_of_one_method() {
        let cost = |id: &str, ns: f64| cost(id, &[(Term::Call, ns)], 0.0);
        let loads = [10, 1000].map(Load::of_objects);
        let first = |costs: &[AlgorithmCost]| {
            let steps = Slice(&loads).steps(costs);
            assert_eq!(steps.len(), 1);
            costs[steps[0].1].algorithm.to_string()
        };
        assert_eq!(first(&[cost("sap@cpu1", 100.0), cost("sap@cpu2", 96.0)]), "sap@cpu1");
        assert_eq!(first(&[cost("sap@cpu1", 100.0), cost("sap@cpu2", 94.0)]), "sap@cpu2");
        assert_eq!(first(&[cost("sap@cpu1", 100.0), cost("bvh@cpu1", 96.0)]), "bvh@cpu1");
    }

    #[test]
    fn reach_ends_at_its_condition_or_at_the_end() {
        let loads: Vec<Load> = (1..=20).map(|k| Load { objects: 1 << k, ..Load::default() }).collect();
        let slice = Slice(&loads);
        let from =
            |objects: f64, upwards, limit: u32| slice.reach(objects, upwards, |l| (l.objects > limit) == upwards);
        assert!((from(1000.0, true, 5000) / 5000.0 - 1.0).abs() < 0.01);
        assert!((from(1000.0, false, 70) / 70.0 - 1.0).abs() < 0.02);
        assert_eq!((from(1000.0, true, u32::MAX), from(1000.0, false, 0)), (1_048_576.0, 2.0));
        assert_eq!(from(1000.0, true, 10), 1000.0);
    }

    #[test]
    fn crossovers_at_neighbouring_numbers_collapse() {
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
