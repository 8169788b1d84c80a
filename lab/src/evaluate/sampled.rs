//! What a handful of samples on a machine that was left out adds to its prediction.

use super::curve;
use super::prior::{HeldOut, prior};
use super::profile::{Profile, Spot};
use super::robust::value_at_weight;
use super::yardstick::average;
use crate::samples::{Replay, ReplayPoint, learn};
use anyhow::Result;
use sapwise::model::{Coverage, FEWEST_MACHINES, Role};
use sapwise::{AlgorithmCost, Prior};
use std::collections::BTreeMap;

/// Samples that are taken, as `predict` does unless told otherwise.
pub(super) const SAMPLES: usize = 8;
/// Share of new machines that an interval is to hold.
const CONFIDENCE: f64 = 0.9;
/// Timings of a held-out profile that tell how far predictions are off, about.
const TIMINGS: usize = 120;

/// What was predicted for a profile by a model that had not seen its machine.
pub(super) struct Predicted {
    /// Position of the profile.
    pub(super) held: usize,
    pub(super) costs: Vec<AlgorithmCost>,
}

/// How far predictions were off on what was left out, by profile.
pub(super) struct Errors(BTreeMap<usize, Vec<HeldOut>>);

impl Errors {
    /// Of all predictions. Errors on one physical machine belong together, however many profiles it has.
    pub(super) fn new(profiles: &[Profile], predicted: &[Predicted]) -> Self {
        let mut errors: BTreeMap<usize, Vec<HeldOut>> = BTreeMap::new();
        for p in predicted {
            let profile = &profiles[p.held];
            // Left out twice, for two restrictions: the errors of two models are no noise of the timings.
            if errors.contains_key(&p.held) {
                continue;
            }
            let machine = profiles.iter().position(|o| o.machine() == profile.machine()).unwrap_or(p.held);
            let all = profile.points.iter().flat_map(|spot| spot.medians.iter().map(move |m| (spot, *m)));
            let off = all.filter_map(|(spot, (k, ns))| {
                let id = profile.id(k);
                let predicted = p.costs.iter().find(|c| c.algorithm == *id)?.curve.cost_ns(&spot.load);
                let log2_objects = f64::from(spot.load.objects).log2();
                Some(HeldOut { machine, algorithm: id.clone(), log2_objects, ln_ratio: (ns / predicted).ln() })
            });
            let off: Vec<HeldOut> = off.collect();
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

/// Share of held-out times that lie within the interval which the errors on the other held-out machines give, each machine weighing the
/// same; `None` with fewer machines than an interval takes.
///
/// The interval is that of the jackknife+ but for the spread of the fits among each other, which widens it: the share is a lower bound.
/// Borders are not looked at.
pub(super) fn coverage(errors: &Errors) -> Option<Coverage> {
    let mut roles: BTreeMap<Role, BTreeMap<usize, Vec<f64>>> = BTreeMap::new();
    for held in errors.0.values().flatten() {
        let of_machine = roles.entry(Role::of(&held.algorithm)).or_default().entry(held.machine).or_default();
        of_machine.push(held.ln_ratio.abs());
    }
    let (mut within, mut count) = (BTreeMap::<usize, (f64, f64)>::new(), 0);
    for by_machine in roles.values().filter(|m| m.len() >= FEWEST_MACHINES as usize) {
        for (machine, own) in by_machine {
            let mut others: Vec<(f64, f64)> = by_machine
                .iter()
                .filter(|(other, _)| *other != machine)
                .flat_map(|(_, errors)| errors.iter().map(|e| (*e, 1.0 / errors.len() as f64)))
                .collect();
            others.sort_by(|a, b| a.0.total_cmp(&b.0));
            // One machine more than were seen is asked about.
            let needed = CONFIDENCE * by_machine.len() as f64;
            let reach = value_at_weight(&others, needed).unwrap_or(f64::INFINITY);
            let sum = within.entry(*machine).or_default();
            sum.0 += own.iter().filter(|e| **e <= reach).count() as f64;
            sum.1 += own.len() as f64;
            count += own.len();
        }
    }
    let shares: Vec<f64> = within.values().map(|(within, all)| within / all).collect();
    let found = Coverage { times: average(&shares), times_count: count, crossings: None, crossings_count: 0 };
    // No role was timed on enough machines.
    (count > 0).then_some(found)
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
    let Ok(slice) = curve::slice(profile, scenario) else { return Ok(None) };
    let timings = |spot: &Spot| spot.medians.iter().map(|&(k, ns)| (profile.id(k).clone(), ns)).collect();
    let within = profile.points.iter().filter(|s| s.scenario == scenario);
    let points: Vec<ReplayPoint> = within.map(|s| ReplayPoint { load: s.load, timings: timings(s) }).collect();
    let learned = learn(predicted.costs.clone(), prior, &slice, &mut Replay::new(&points), SAMPLES)?;
    Ok(Some(learned.costs()))
}

#[cfg(test)]
mod tests {
    use super::super::curve::measured_costs;
    use super::super::synthetic::Machine;
    use super::super::yardstick::Yardstick;
    use super::super::{available, by_costs};
    use super::*;
    use sapwise_scenes::Random;

    #[test]
    fn samples_mend_a_prediction_that_is_off_by_a_factor() {
        let profile = Profile::of("", &Machine::family()[2].report());
        let mut costs = measured_costs(&profile).0;
        // All that works in parallel is predicted three times too fast.
        for cost in costs.iter_mut().filter(|c| c.algorithm.threads() > 1) {
            let curve = &mut cost.curve;
            curve.terms.iter_mut().chain(&mut curve.fallback_terms).for_each(|t| t.unit_ns /= 3.0);
        }
        let yardstick = Yardstick::new(&profile);
        let available = available(&profile);
        let regret = |costs: &[AlgorithmCost]| yardstick.regret(&profile, &by_costs(costs.to_vec(), &available)).mean;
        let predicted = Predicted { held: 0, costs: costs.clone() };
        let mended = corrected(&profile, "uniform", &predicted, &Prior::ASSUMED).unwrap().unwrap();
        assert!(regret(&costs) > 0.05 && regret(&mended) < 0.5 * regret(&costs), "{} {}", regret(&costs), regret(&mended));
        assert!(corrected(&profile, "nowhere", &predicted, &Prior::ASSUMED).unwrap().is_none());
    }

    #[test]
    fn nine_times_in_ten_lie_within_what_the_other_machines_give() {
        let mut random = Random::named(7, &[]);
        let id: sapwise::AlgorithmId = "grid-sap@cpu1".parse().unwrap();
        let mut errors = |machines: usize, factor: f64| {
            let of = |machine: usize| {
                let off = 0.2 * random.normal() * if machine == 0 { factor } else { 1.0 };
                let held = |_| HeldOut { machine, algorithm: id.clone(), log2_objects: 10.0, ln_ratio: off };
                (machine, (0..5).map(held).collect())
            };
            Errors((0..machines).map(of).collect())
        };
        assert_eq!(coverage(&errors(9, 1.0)), None);
        let found = coverage(&errors(400, 1.0)).unwrap();
        assert!((found.times - 0.9).abs() < 0.03 && found.times_count == 2000, "{found:?}");
        let one_off = coverage(&errors(20, 100.0)).unwrap();
        assert!(one_off.times < 1.0, "{one_off:?}");
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
