//! The part of a time that the physical terms leave unexplained, as a function of the load: a Gaussian process with
//! inducing points.

use crate::data::Profile;
use anyhow::{Context, Result};
use linfa_linalg::cholesky::SolveCInplace;
use ndarray::{Array1, Array2, Axis};
use sapwise::algorithm::Load;
use sapwise::internals::Places;
use sapwise_scenes::Random;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Standard deviation of a residual, and of a timing around it, as natural logarithms. Half or twice as much changes
/// no regret noticeably.
const DEVIATION_LN: f64 = 0.2;
const NOISE_LN: f64 = 0.08;
/// Time over the best of the point from which on a timing counts no less for lying further behind.
const MOST_BEHIND: f64 = 4.0;
/// Variance that each place has of its own, as a share. It keeps the weights of neighbouring places from growing
/// against each other.
const JITTER: f64 = 1e-4;
/// Loads among which places are chosen, at most.
const MOST_LOADS: usize = 1500;
/// Timings that a residual is fitted to, at most.
const MOST_ROWS: usize = 2000;
/// A remainder beyond this many robust standard deviations, and beyond this logarithm, is cut to that: a disturbed
/// measurement, or what no smooth residual can follow.
const REACH: f64 = 3.0;
const LEAST_REACH_LN: f64 = 0.6;

/// One timing, for a residual.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Remainder {
    pub(crate) load: Load,
    /// Natural logarithm of measured over modelled time.
    pub(crate) ln: f64,
    /// Time over the best of the point.
    pub(crate) behind: f64,
}

/// Returns the standard deviation of the logarithm of a timing around its residual, from its time over the best of
/// the point.
pub(crate) fn noise_ln(behind: f64) -> f64 {
    NOISE_LN * behind.min(MOST_BEHIND)
}

/// Chooses the places that tell most about the loads of the profiles, each next one where the previous ones tell
/// least: a pivoted Cholesky decomposition of the covariance (Fine and Scheinberg, Efficient SVM training using
/// low-rank kernel representations, 2001).
pub(crate) fn places<'a>(profiles: impl Iterator<Item = &'a Profile>, without: Option<&str>) -> Arc<Places> {
    // Profiles of one seed have the same scenes and loads.
    let mut loads: BTreeMap<(&str, u32), Load> = BTreeMap::new();
    for spot in profiles.flat_map(|p| &p.points).filter(|s| Some(s.scenario.as_str()) != without) {
        loads.entry((&spot.scenario, spot.load.objects)).or_insert(spot.load);
    }
    let loads: Vec<Load> = loads.into_values().collect();
    let some = Random::named(1, &["places"]).shuffled(loads.len());
    let loads: Vec<Load> = some.into_iter().take(MOST_LOADS).map(|k| loads[k]).collect();
    let mut left: Vec<f64> = vec![1.0; loads.len()];
    let mut columns: Vec<Vec<f64>> = Vec::new();
    let mut chosen: Vec<Load> = Vec::new();
    while chosen.len() < Places::MOST.min(loads.len()) {
        let Some(next) = (0..loads.len()).max_by(|&a, &b| left[a].total_cmp(&left[b])) else { break };
        if left[next] < JITTER {
            break;
        }
        let one = Places::of_sizes(vec![loads[next]], &loads);
        let root = left[next].sqrt();
        let column: Vec<f64> = (0..loads.len())
            .map(|k| {
                let known: f64 = columns.iter().map(|c| c[k] * c[next]).sum();
                (one.likeness(&loads[k], true)[0] - known) / root
            })
            .collect();
        left.iter_mut().zip(&column).for_each(|(l, c)| *l = (*l - c * c).max(0.0));
        left[next] = 0.0;
        columns.push(column);
        chosen.push(loads[next]);
    }
    Arc::new(Places::new(chosen))
}

/// Returns the most likely weights of the places for these remainders.
///
/// # Errors
/// When the system can't be solved.
pub(crate) fn weights(places: &Places, remainders: &[Remainder], by_motion: bool) -> Result<Vec<f64>> {
    let some = Random::named(1, &["rows"]).shuffled(remainders.len());
    let rows: Vec<&Remainder> = some.into_iter().take(MOST_ROWS).map(|k| &remainders[k]).collect();
    let spread =
        sapwise::internals::stats::robust_deviation(&rows.iter().map(|r| r.ln).collect::<Vec<f64>>()).unwrap_or(0.0);
    let reach = (REACH * spread).max(LEAST_REACH_LN);
    let count = places.loads().len();
    let mut likeness = Array2::zeros((rows.len(), count));
    for (row, r) in likeness.rows_mut().into_iter().zip(&rows) {
        row.into_iter().zip(places.likeness(&r.load, by_motion)).for_each(|(to, k)| *to = k);
    }
    let precision = Array1::from_iter(rows.iter().map(|r| noise_ln(r.behind).powi(-2)));
    let targets = Array1::from_iter(rows.iter().map(|r| r.ln.clamp(-reach, reach)));
    let mut between = Array2::zeros((count, count));
    for (mut row, load) in between.rows_mut().into_iter().zip(places.loads()) {
        row.assign(&Array1::from(places.likeness(load, by_motion)));
    }
    between += &(JITTER * Array2::<f64>::eye(count));
    let weighted = &likeness * &precision.insert_axis(Axis(1));
    let mut normal = weighted.t().dot(&likeness) + between / DEVIATION_LN.powi(2);
    let right = weighted.t().dot(&targets).insert_axis(Axis(1));
    let weights = normal.solvec_into(right).context("the residual over the load can't be solved")?;
    Ok(weights.remove_axis(Axis(1)).to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::Spot;
    use crate::synthetic::Machine;
    use sapwise::internals::Residual;

    fn profiles() -> Vec<Profile> {
        Machine::family().into_iter().take(2).map(|m| Profile::of(m.name, &m.report())).collect()
    }

    #[test]
    fn places_are_loads_of_the_profiles_and_none_twice() {
        let all = profiles();
        let found = places(all.iter(), None);
        assert!(found.loads().len() >= 20 && found.loads().len() <= Places::MOST);
        for (k, load) in found.loads().iter().enumerate() {
            assert!(all.iter().flat_map(|p| &p.points).any(|s| s.load == *load));
            assert!(!found.loads()[..k].contains(load));
        }
        let without = places(all.iter(), Some("clustered"));
        assert!(without.loads().iter().all(|l| all[0].points.iter().any(|s| s.load == *l && s.scenario == "uniform")));
    }

    #[test]
    fn a_smooth_remainder_is_found_and_a_far_timing_is_held_back() {
        let all = profiles();
        let found = places(all.iter(), None);
        let truth = |l: &Load| {
            0.3 * (f64::from(l.objects).log2() / 4.0).sin() + 0.1 * (l.pairs / f64::from(l.objects)).min(1.0)
        };
        let remainder = |s: &Spot| Remainder { load: s.load, ln: truth(&s.load), behind: 1.0 };
        let mut remainders: Vec<Remainder> = all[0].points.iter().map(remainder).collect();
        let residual = |r: &[Remainder]| Residual::new(Arc::clone(&found), weights(&found, r, false).unwrap(), false);
        let worst = |residual: &Residual| {
            let off = all[0].points.iter().map(|s| (residual.ln(&s.load) - truth(&s.load)).abs());
            off.fold(0.0, f64::max)
        };
        assert!(worst(&residual(&remainders)) < 0.06, "{}", worst(&residual(&remainders)));
        remainders[7].ln += 4.0;
        assert!(worst(&residual(&remainders)) < 0.35, "{}", worst(&residual(&remainders)));
    }

    #[test]
    fn without_rows_nothing_is_corrected() {
        let found = places(profiles().iter(), None);
        assert!(weights(&found, &[], true).unwrap().iter().all(|w| *w == 0.0));
    }
}
