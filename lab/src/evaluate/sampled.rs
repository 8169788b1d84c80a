//! What a handful of samples on a machine that was held out adds to its prediction.

use crate::belief::{Prior, Replay, ReplayPoint, learn};
use crate::data::{Profile, Spot};
use crate::fit::{TimingError, measured_slice, prior};
use anyhow::Result;
use sapwise::AlgorithmCost;
use std::collections::BTreeMap;

/// Samples that are taken, as `predict` does unless told otherwise.
pub(super) const SAMPLES: usize = 8;
/// Timings of a held-out profile that tell how far predictions are off, about.
const TIMINGS: usize = 120;

/// What was predicted for a profile by a model that had not seen its machine.
pub(super) struct Predicted {
    /// Position of the profile.
    pub(super) held: usize,
    pub(super) costs: Vec<AlgorithmCost>,
}

/// How far predictions were off on what was held out, by profile.
pub(super) struct Errors(BTreeMap<usize, Vec<TimingError>>);

impl Errors {
    /// Of all predictions. Errors on one physical machine belong together, however many profiles it has.
    pub(super) fn new(profiles: &[Profile], predicted: &[Predicted]) -> Self {
        let mut errors: BTreeMap<usize, Vec<TimingError>> = BTreeMap::new();
        for p in predicted {
            let profile = &profiles[p.held];
            // Held out twice, for two restrictions: the errors of two models are no noise of the timings.
            if errors.contains_key(&p.held) {
                continue;
            }
            let machine = profiles.iter().position(|o| o.machine() == profile.machine()).unwrap_or(p.held);
            let all = profile.points.iter().flat_map(|spot| spot.medians.iter().map(move |m| (spot, *m)));
            let off = all.filter_map(|(spot, (k, ns))| {
                let id = profile.id(k);
                let predicted = p.costs.iter().find(|c| c.algorithm == *id)?.curve.cost_ns(&spot.load);
                let log2_objects = f64::from(spot.load.objects).log2();
                Some(TimingError { machine, algorithm: id.clone(), log2_objects, ln_ratio: (ns / predicted).ln() })
            });
            let off: Vec<TimingError> = off.collect();
            let step = off.len().div_ceil(TIMINGS).max(1);
            errors.insert(p.held, off.into_iter().step_by(step).collect());
        }
        Self(errors)
    }

    /// The prior of the profiles that are not in `fold`; with an empty one of all.
    pub(super) fn prior(&self, fold: &[usize]) -> Prior {
        let others = self.0.iter().filter(|(held, _)| !fold.contains(held)).flat_map(|(_, errors)| errors);
        prior(&others.cloned().collect::<Vec<_>>())
    }
}

/// The costs after [`SAMPLES`] samples of the scenario, replayed from the profile. `None` where it has too few sizes of it.
///
/// # Errors
/// As [`learn`].
pub(super) fn corrected(
    profile: &Profile,
    scenario: &str,
    predicted: &Predicted,
    prior: &Prior,
) -> Result<Option<Vec<AlgorithmCost>>> {
    let Ok(slice) = measured_slice(profile, scenario) else { return Ok(None) };
    let timings = |spot: &Spot| spot.medians.iter().map(|&(k, ns)| (profile.id(k).clone(), ns)).collect();
    let within = profile.points.iter().filter(|s| s.scenario == scenario);
    let points: Vec<ReplayPoint> = within.map(|s| ReplayPoint { load: s.load, timings: timings(s) }).collect();
    let learned = learn(predicted.costs.clone(), prior, &slice, &mut Replay::new(&points), SAMPLES)?;
    Ok(Some(learned.costs()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::{RegretTable, by_costs};
    use crate::fit::measured_costs;
    use crate::synthetic::Machine;

    #[test]
    fn samples_mend_a_prediction_that_is_off_by_a_factor() {
        let profile = Profile::of("", &Machine::family()[2].report());
        let mut costs = measured_costs(&profile).0;
        // All that works in parallel is predicted three times too fast.
        for cost in costs.iter_mut().filter(|c| c.algorithm.threads() > 1) {
            let curve = &mut cost.curve;
            curve.terms.iter_mut().chain(&mut curve.fallback_terms).for_each(|t| t.unit_ns /= 3.0);
        }
        let table = RegretTable::new(&profile);
        let available = profile.available();
        let regret = |costs: &[AlgorithmCost]| table.regret(&profile, &by_costs(costs.to_vec(), &available)).mean;
        let predicted = Predicted { held: 0, costs: costs.clone() };
        let mended = corrected(&profile, "uniform", &predicted, &Prior::ASSUMED).unwrap().unwrap();
        assert!(regret(&costs) > 0.05 && regret(&mended) < 0.5 * regret(&costs), "{} {}", regret(&costs), regret(&mended));
        assert!(corrected(&profile, "nowhere", &predicted, &Prior::ASSUMED).unwrap().is_none());
    }

    #[test]
    fn a_prior_of_others_does_not_see_the_errors_of_a_fold() {
        let profiles: Vec<Profile> =
            Machine::family().into_iter().take(4).map(|m| Profile::of(m.name, &m.report())).collect();
        let predicted: Vec<Predicted> = (0..4)
            .map(|held| {
                let mut costs = measured_costs(&profiles[held]).0;
                // The last machine is nothing like its prediction.
                let factor = if held == 3 { 5.0 } else { 1.1 };
                costs.iter_mut().flat_map(|c| &mut c.curve.terms).for_each(|t| t.unit_ns *= factor);
                Predicted { held, costs }
            })
            .collect();
        let errors = Errors::new(&profiles, &predicted);
        assert_ne!(errors.prior(&[3]), errors.prior(&[]));
        assert_eq!(errors.prior(&[3]), Errors::new(&profiles, &predicted[..3]).prior(&[]));
    }
}
