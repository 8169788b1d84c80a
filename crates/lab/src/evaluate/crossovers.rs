//! How far predicted crossovers lie from measured ones.

use super::baselines::closest;
use crate::data::Profile;
use crate::fit::{measured_slice, slice_tuning};
use sapwise::algorithm::Load;
use sapwise::tuning::{AlgorithmCost, Crossover, Source};
use sapwise::{AlgorithmId, Tuning};

/// The crossovers of the measured tuning of one profile, in its usual scenario.
#[derive(Debug, Clone, Default)]
pub(super) struct MeasuredCrossovers {
    loads: Vec<Load>,
    crossovers: Vec<Crossover>,
}

impl MeasuredCrossovers {
    /// Derives them from the measured costs of the profile; none if it has too few sizes or timings.
    pub(super) fn new(profile: &Profile, costs: &[AlgorithmCost]) -> Self {
        let scenario = profile.usual_scenario();
        let found = measured_slice(profile, scenario).and_then(|loads| {
            let crossovers = slice_tuning(costs.to_vec(), scenario, &loads)?.crossovers;
            Ok(Self { loads, crossovers })
        });
        found.unwrap_or_default()
    }

    /// Returns for each crossover whose algorithms have predicted costs the nearest crossing of those costs in the
    /// same direction. If they don't cross so within the slice, it is the end beyond which they would: the upper one
    /// if the algorithm below the crossover is predicted to be cheaper at it. The nearest number of threads stands in
    /// for one that was not predicted.
    pub(super) fn predicted(&self, costs: &[AlgorithmCost]) -> Vec<ComparedCrossover> {
        let ids: Vec<AlgorithmId> = costs.iter().map(|c| c.algorithm.clone()).collect();
        let cost = |id: &AlgorithmId| {
            let found = closest(id, &ids)?;
            let cost = costs.iter().find(|c| c.algorithm == found)?;
            // Under its own name, since one cost may stand in for both sides.
            Some(AlgorithmCost::new(id.clone(), cost.revision, cost.curve.clone(), cost.spread_ln))
        };
        self.crossovers.iter().filter_map(|b| Some(self.compared(b, cost(&b.below)?, cost(&b.above)?))).collect()
    }

    /// Returns the octaves between the two positions of each of them.
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
            let observed = cost.curve.observed.as_mut().expect("measured costs were observed");
            observed.constant += factor.ln();
        }
        costs
    }

    #[test]
    fn the_measured_costs_have_no_error_and_wrong_ones_have_the_distance() {
        let profile = Profile::of("", &Machine::family()[2].report());
        let costs = measured_costs(&profile).0;
        let crossovers = MeasuredCrossovers::new(&profile, &costs);
        assert!(!crossovers.crossovers.is_empty());
        assert!(crossovers.errors(&costs).iter().all(|e| *e < 0.03), "{:?}", crossovers.errors(&costs));
        let crossover = crossovers.crossovers[0].clone();
        let (first, last) =
            (f64::from(crossovers.loads[0].objects), f64::from(crossovers.loads.last().unwrap().objects));
        // Who is cheaper below is said to be cheaper everywhere, and the other way round.
        let ever = crossovers.errors(&slower(&costs, &crossover.above, 1e6))[0];
        assert!((ever - (last / crossover.objects).log2()).abs() < 0.03, "{ever}");
        let never = crossovers.errors(&slower(&costs, &crossover.below, 1e6))[0];
        assert!((never - (crossover.objects / first).log2()).abs() < 0.03, "{never}");
        // A little too slow below moves the crossover down, not away.
        let near = crossovers.errors(&slower(&costs, &crossover.below, 1.3))[0];
        assert!(near > 0.05 && near < never, "{near}");
        // What is not predicted is not judged.
        let others: Vec<AlgorithmCost> =
            costs.iter().filter(|c| c.algorithm.method() != crossover.below.method()).cloned().collect();
        assert!(crossovers.errors(&others).len() < crossovers.crossovers.len());
    }
}
