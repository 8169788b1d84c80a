//! How far predicted crossovers lie from measured ones.

use super::baselines::{closest, renamed};
use crate::data::Profile;
use crate::fit::{measured_slice, slice_tuning};
use sapwise::algorithm::Load;
use sapwise::tuning::{AlgorithmCost, Crossover, Source};
use sapwise::{AlgorithmId, Tuning};
use std::collections::BTreeSet;

/// A crossover matters if the algorithm below it costs this many times the one above at [`BEYOND`] times its objects.
const COSTS: f64 = 1.1;
const BEYOND: f64 = 2.0;

/// The crossovers of the measured tuning of one profile in one of its scenarios.
#[derive(Debug, Clone)]
pub(super) struct MeasuredCrossovers {
    pub(super) scenario: String,
    loads: Vec<Load>,
    pub(super) crossovers: Vec<Crossover>,
}

impl MeasuredCrossovers {
    /// Derives those that matter from the measured costs of the profile, for each scenario with enough sizes and
    /// timings.
    pub(super) fn of_scenarios(profile: &Profile, costs: &[AlgorithmCost]) -> Vec<Self> {
        let scenarios: BTreeSet<&str> = profile.scenarios().collect();
        scenarios.into_iter().filter_map(|scenario| Self::new(profile, scenario, costs)).collect()
    }

    fn new(profile: &Profile, scenario: &str, costs: &[AlgorithmCost]) -> Option<Self> {
        let loads = measured_slice(profile, scenario).ok()?;
        let mut crossovers = slice_tuning(costs.to_vec(), scenario, &loads).ok()?.crossovers;
        let cost = |id: &AlgorithmId| costs.iter().find(|c| c.algorithm == *id);
        crossovers.retain(|c| {
            let sides = cost(&c.below).zip(cost(&c.above));
            sides.is_some_and(|(below, above)| ln_ratio(&loads, BEYOND * c.objects, below, above) > COSTS.ln())
        });
        Some(Self { scenario: scenario.to_owned(), loads, crossovers })
    }

    /// Returns the [nearest](Self::nearest) predicted crossing of each crossover whose algorithms have predicted
    /// costs.
    pub(super) fn predicted(&self, costs: &[AlgorithmCost]) -> Vec<ComparedCrossover> {
        self.crossovers.iter().filter_map(|b| self.nearest(b, costs)).collect()
    }

    /// Returns the nearest crossing of predicted costs in the same direction as a crossover. If they don't cross so
    /// within the slice, it is the end beyond which they would: the upper one if the algorithm below the crossover is
    /// predicted to be cheaper at it. The nearest number of threads stands in for one that was not predicted.
    pub(super) fn nearest(&self, crossover: &Crossover, costs: &[AlgorithmCost]) -> Option<ComparedCrossover> {
        let ids: Vec<AlgorithmId> = costs.iter().map(|c| c.algorithm.clone()).collect();
        let cost = |id: &AlgorithmId| {
            let found = closest(id, &ids)?;
            // Under its own name, since one cost may serve for both sides.
            costs.iter().find(|c| c.algorithm == found).map(|cost| renamed(cost, id))
        };
        Some(self.compared(crossover, cost(&crossover.below)?, cost(&crossover.above)?))
    }

    /// Returns the octaves between measured and predicted position, for each crossover with predicted costs.
    pub(super) fn errors(&self, costs: &[AlgorithmCost]) -> Vec<f64> {
        self.predicted(costs).iter().map(ComparedCrossover::octaves).collect()
    }

    fn compared(&self, crossover: &Crossover, below: AlgorithmCost, above: AlgorithmCost) -> ComparedCrossover {
        let compared = |predicted: f64, crosses| ComparedCrossover {
            below: crossover.below.clone(),
            above: crossover.above.clone(),
            measured: crossover.objects,
            predicted,
            crosses,
        };
        let tuning = Tuning::from_costs(Source::Predicted, "", vec![below, above], &self.loads);
        let alike = tuning.crossovers.iter().filter(|b| b.below == crossover.below).map(|b| compared(b.objects, true));
        if let Some(nearest) = alike.min_by(|a, b| a.octaves().total_cmp(&b.octaves())) {
            return nearest;
        }
        let later = tuning.step(crossover.objects as u32).is_some_and(|s| s.algorithm == crossover.below);
        let end = if later { self.loads.last() } else { self.loads.first() };
        compared(end.map_or(crossover.objects, |load| f64::from(load.objects.max(1))), false)
    }
}

/// Returns the logarithm of the cost of one algorithm over that of another at a number of objects, interpolated
/// between the loads of a slice. Beyond the slice it is the value at the nearer end.
fn ln_ratio(loads: &[Load], objects: f64, of: &AlgorithmCost, over: &AlgorithmCost) -> f64 {
    let at = |load: &Load| (of.curve.cost_ns(load) / over.curve.cost_ns(load)).ln();
    let above = loads.partition_point(|l| f64::from(l.objects) <= objects);
    match (above.checked_sub(1).map(|k| &loads[k]), loads.get(above)) {
        (Some(below), Some(above)) => {
            let [a, x, b] = [f64::from(below.objects), objects, f64::from(above.objects)].map(|n| (n + 1.0).ln());
            at(below) + (x - a) / (b - a) * (at(above) - at(below))
        }
        (Some(end), None) | (None, Some(end)) => at(end),
        (None, None) => 0.0,
    }
}

/// A measured crossover beside the predicted one.
#[derive(Debug, Clone, PartialEq)]
pub struct ComparedCrossover {
    /// The cheaper one below the crossover.
    pub below: AlgorithmId,
    /// The cheaper one above it.
    pub above: AlgorithmId,
    /// Objects at the measured crossover.
    pub measured: f64,
    /// Objects at the predicted one; if the predicted costs don't cross, the end of the slice beyond which they would.
    pub predicted: f64,
    /// Whether the predicted costs cross within the slice.
    pub crosses: bool,
}

impl ComparedCrossover {
    /// Returns the octaves between the two, a lower bound if the predicted costs don't cross.
    pub fn octaves(&self) -> f64 {
        (self.predicted / self.measured).log2().abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::measured_costs;
    use crate::synthetic::Machine;

    fn slower(costs: &[AlgorithmCost], id: &AlgorithmId, factor: f64) -> Vec<AlgorithmCost> {
        let mut costs = costs.to_vec();
        for cost in costs.iter_mut().filter(|c| c.algorithm == *id) {
            let residual = cost.curve.residual.as_mut().expect("measured costs were observed");
            residual.constant += factor.ln();
        }
        costs
    }

    #[test]
    fn the_measured_costs_have_no_error_and_wrong_ones_have_the_distance() {
        let profile = Profile::of("", &Machine::family()[2].report());
        let costs = measured_costs(&profile).0;
        let crossovers = MeasuredCrossovers::new(&profile, "uniform", &costs).unwrap();
        assert!(!crossovers.crossovers.is_empty());
        assert!(crossovers.errors(&costs).iter().all(|e| *e < 0.03), "{:?}", crossovers.errors(&costs));
        let crossover = crossovers.crossovers[0].clone();
        let (first, last) =
            (f64::from(crossovers.loads[0].objects), f64::from(crossovers.loads.last().unwrap().objects));
        // The algorithm below is predicted to be cheaper everywhere, and then nowhere.
        let ever = crossovers.errors(&slower(&costs, &crossover.above, 1e6))[0];
        assert!((ever - (last / crossover.objects).log2()).abs() < 0.03, "{ever}");
        let never = crossovers.errors(&slower(&costs, &crossover.below, 1e6))[0];
        assert!((never - (crossover.objects / first).log2()).abs() < 0.03, "{never}");
        // A little too slow below moves the crossover down, not away.
        let near = crossovers.errors(&slower(&costs, &crossover.below, 1.3))[0];
        assert!(near > 0.05 && near < never, "{near}");
        // An algorithm without a predicted cost is not judged.
        let others: Vec<AlgorithmCost> =
            costs.iter().filter(|c| c.algorithm.method() != crossover.below.method()).cloned().collect();
        assert!(crossovers.errors(&others).len() < crossovers.crossovers.len());
    }

    #[test]
    fn a_crossover_of_equals_does_not_matter() {
        let profile = Profile::of("", &Machine::family()[2].report());
        let costs = measured_costs(&profile).0;
        let all = MeasuredCrossovers::of_scenarios(&profile, &costs);
        assert_eq!(all.iter().map(|c| &c.scenario[..]).collect::<Vec<_>>(), ["clustered", "uniform"]);
        let uniform = &all[1];
        let crossover = &uniform.crossovers[0];
        // The one above costs as much as the one below, and a little less from the crossover on.
        let below = costs.iter().find(|c| c.algorithm == crossover.below).unwrap();
        let above = AlgorithmCost::new(crossover.above.clone(), 1, below.curve.clone(), 0.0);
        let found =
            MeasuredCrossovers::new(&profile, "uniform", &slower(&[below.clone(), above], &crossover.above, 0.99));
        assert_eq!(found.unwrap().crossovers, []);
        let at = |objects: f64| ln_ratio(&uniform.loads, objects, below, &costs[0]);
        assert!(at(1e12).is_finite() && at(0.0).is_finite() && ln_ratio(&[], 9.0, below, below) == 0.0);
    }
}
