//! What a handful of samples on a machine that was held out adds to its prediction.

use crate::belief::{Replay, ReplayPoint, learn};
use crate::data::{Profile, Spot};
use anyhow::Result;
use sapwise::{AlgorithmCost, Load, Observed};

/// Samples that are taken, as `predict` does unless told otherwise.
pub(super) const SAMPLES: usize = 8;
/// What was predicted for a profile by a model that had not seen its machine.
pub(super) struct Predicted {
    /// Position of the profile.
    pub(super) held: usize,
    pub(super) costs: Vec<AlgorithmCost>,
}

/// Loads that samples are chosen among, at most.
const MOST_LOADS: usize = 40;

/// The costs after [`SAMPLES`] samples, replayed from the profile. They are chosen over the loads of all of its scenarios, since a tuning may meet any.
/// `None` where it has too few.
///
/// # Errors
/// As [`learn`].
pub(super) fn corrected(profile: &Profile, predicted: Observed) -> Result<Option<Vec<AlgorithmCost>>> {
    let timings = |spot: &Spot| spot.medians.iter().map(|&(k, ns)| (profile.id(k).clone(), ns)).collect();
    let points: Vec<ReplayPoint> =
        profile.points.iter().map(|s| ReplayPoint { load: s.load, timings: timings(s) }).collect();
    let step = points.len().div_ceil(MOST_LOADS).max(1);
    let loads: Vec<Load> = points.iter().step_by(step).map(|p| p.load).collect();
    if loads.len() < 2 || predicted.predicted().is_empty() {
        return Ok(None);
    }
    let learned = learn(predicted, &loads, &mut Replay::new(&points), SAMPLES)?;
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
        // All that works in parallel is predicted three times too slow.
        for cost in costs.iter_mut().filter(|c| c.algorithm.threads() > 1) {
            let observed = cost.curve.observed.as_mut().expect("measured costs were observed");
            observed.constant += 3.0_f64.ln();
        }
        let table = RegretTable::new(&profile);
        let available = profile.available();
        let regret = |costs: &[AlgorithmCost]| table.regret(&profile, &by_costs(costs.to_vec(), &available)).mean;
        let mended = corrected(&profile, Observed::of_unlike_machine(costs.clone())).unwrap().unwrap();
        assert!(
            regret(&costs) > 0.03 && regret(&mended) < 0.5 * regret(&costs),
            "{} {}",
            regret(&costs),
            regret(&mended)
        );
    }
}
