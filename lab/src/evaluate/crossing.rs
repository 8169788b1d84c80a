//! How far predicted borders lie from measured ones.

use super::baselines::{closest, usual};
use super::curve::{slice, slice_tuning};
use super::profile::Profile;
use sapwise::{AlgorithmCost, AlgorithmId, Border, Tuning, Load, Source};

/// The borders between the measured tuning of one profile, in the scenario of its slice.
#[derive(Debug, Clone, Default)]
pub(super) struct Borders {
    loads: Vec<Load>,
    borders: Vec<Border>,
}

impl Borders {
    /// By the measured costs of the profile; none where it has too few sizes or timings.
    pub(super) fn new(profile: &Profile, costs: &[AlgorithmCost]) -> Self {
        let scenario = usual(profile.points.iter().map(|s| s.scenario.as_str()));
        let found = slice(profile, scenario).and_then(|loads| {
            let borders = slice_tuning(costs.to_vec(), scenario, &loads)?.crossovers;
            Ok(Self { loads, borders })
        });
        found.unwrap_or_default()
    }

    /// For each border that both algorithms have a predicted cost for, the nearest crossing of those costs in the same direction.
    /// Where they do not cross so within the slice, the end beyond which they would, which is the upper one where the algorithm
    /// below the border is predicted to be cheaper at it. The nearest number of threads stands for one that was not predicted.
    pub(super) fn predicted(&self, costs: &[AlgorithmCost]) -> Vec<Beside> {
        let ids: Vec<AlgorithmId> = costs.iter().map(|c| c.algorithm.clone()).collect();
        let cost = |id: &AlgorithmId| {
            let found = closest(id, &ids)?;
            let cost = costs.iter().find(|c| c.algorithm == found)?;
            // Under its own name, since one cost may stand for both sides.
            Some(AlgorithmCost { algorithm: id.clone(), ..cost.clone() })
        };
        self.borders.iter().filter_map(|b| Some(self.beside(b, cost(&b.below)?, cost(&b.above)?))).collect()
    }

    /// Octaves between the two positions of each of them.
    pub(super) fn errors(&self, costs: &[AlgorithmCost]) -> Vec<f64> {
        self.predicted(costs).iter().map(Beside::octaves).collect()
    }

    fn beside(&self, border: &Border, below: AlgorithmCost, above: AlgorithmCost) -> Beside {
        let beside = |predicted: f64, crosses| Beside {
            below: border.below.clone(),
            above: border.above.clone(),
            measured: border.objects,
            predicted,
            crosses,
        };
        let tuning = Tuning::from_costs(Source::Predicted, "", vec![below, above], &self.loads);
        let alike = tuning.crossovers.iter().filter(|b| b.below == border.below).map(|b| beside(b.objects, true));
        if let Some(nearest) = alike.min_by(|a, b| a.octaves().total_cmp(&b.octaves())) {
            return nearest;
        }
        let later = tuning.step(border.objects as u32).is_some_and(|s| s.algorithm == border.below);
        let end = if later { self.loads.last() } else { self.loads.first() };
        beside(end.map_or(border.objects, |load| f64::from(load.objects.max(1))), false)
    }
}

/// A measured border beside the predicted one.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Beside {
    /// The cheaper one below the border, and the one above it.
    pub(crate) below: AlgorithmId,
    pub(crate) above: AlgorithmId,
    /// Objects at the measured border.
    pub(crate) measured: f64,
    /// Objects at the predicted one; where the predicted costs do not cross, the end of the slice beyond which they would.
    pub(crate) predicted: f64,
    /// Whether the predicted costs cross within the slice.
    pub(crate) crosses: bool,
}

impl Beside {
    /// Octaves between the two, a lower bound where the predicted costs do not cross.
    pub(crate) fn octaves(&self) -> f64 {
        (self.predicted / self.measured).log2().abs()
    }
}

#[cfg(test)]
mod tests {
    use super::super::curve::measured_costs;
    use super::super::synthetic::Machine;
    use super::*;

    fn slower(costs: &[AlgorithmCost], id: &AlgorithmId, factor: f64) -> Vec<AlgorithmCost> {
        let mut costs = costs.to_vec();
        let own = costs.iter_mut().filter(|c| c.algorithm == *id);
        own.flat_map(|c| c.curve.terms.iter_mut().chain(&mut c.curve.fallback_terms)).for_each(|t| t.unit_ns *= factor);
        costs
    }

    #[test]
    fn the_measured_costs_have_no_error_and_wrong_ones_have_the_distance() {
        let profile = Profile::of("", &Machine::family()[2].report());
        let costs = measured_costs(&profile).0;
        let borders = Borders::new(&profile, &costs);
        assert!(!borders.borders.is_empty());
        assert!(borders.errors(&costs).iter().all(|e| *e < 0.03), "{:?}", borders.errors(&costs));
        let border = borders.borders[0].clone();
        let (first, last) = (f64::from(borders.loads[0].objects), f64::from(borders.loads.last().unwrap().objects));
        // Who is cheaper below is said to be cheaper everywhere, and the other way round.
        let ever = borders.errors(&slower(&costs, &border.above, 1e6))[0];
        assert!((ever - (last / border.objects).log2()).abs() < 0.03, "{ever}");
        let never = borders.errors(&slower(&costs, &border.below, 1e6))[0];
        assert!((never - (border.objects / first).log2()).abs() < 0.03, "{never}");
        // A little too slow below moves the border down, not away.
        let near = borders.errors(&slower(&costs, &border.below, 1.3))[0];
        assert!(near > 0.05 && near < never, "{near}");
        // What is not predicted is not judged.
        let others: Vec<AlgorithmCost> =
            costs.iter().filter(|c| c.algorithm.method() != border.below.method()).cloned().collect();
        assert!(borders.errors(&others).len() < borders.borders.len());
    }
}
