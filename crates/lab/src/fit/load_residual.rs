//! The part of a time that the model leaves unexplained, as a function of the load: a Gaussian process with inducing
//! points for each group of timings, with the covariance of [`GroupResidual`] between groups.

use crate::data::Profile;
use anyhow::{Context, Result};
use linfa_linalg::cholesky::{Cholesky, InverseC};
use linfa_linalg::triangular::{SolveTriangular, UPLO};
use ndarray::{Array1, Array2, Axis, ShapeBuilder};
use sapwise::algorithm::Load;
use sapwise::internals::Places;
use sapwise::internals::stats::robust_deviation;
use sapwise_scenes::Random;
use sapwise_tune::model::GroupResidual;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Standard deviation of what the groups of one machine have in common beside what all groups have, in natural
/// logarithms. No parameter shows it, so that a new machine gets nothing of it.
const MACHINE_LN: f64 = 0.1;
/// Standard deviation of a timing around its residual, in natural logarithms. A third more changes no regret
/// noticeably.
const NOISE_LN: f64 = 0.12;
/// Time over the best of the point from which on a timing counts no less for lying further behind.
const MOST_BEHIND: f64 = 4.0;
/// Variance that each place has of its own, as a share. It keeps the weights of neighbouring places from growing
/// against each other. Likewise for groups.
const JITTER: f64 = 1e-4;
const GROUP_JITTER: f64 = 1e-6;
/// Steps of a weight within one: finer ones would only lengthen the file of a model.
const PER_WEIGHT: f64 = 1e6;
/// Groups of one machine within a length of positions.
const PER_LENGTH: f64 = 4.0;
/// Loads among which places are chosen, at most.
const MOST_LOADS: usize = 1500;
/// A remainder beyond this many robust standard deviations, and beyond this logarithm, is cut to that: a disturbed
/// measurement, or what no smooth residual can follow.
const REACH: f64 = 3.0;
const LEAST_REACH_LN: f64 = 0.6;
/// Steps of the solver, at most, and the length of the error over that of the right side at which it ends.
const MOST_STEPS: usize = 500;
const SOLVED: f64 = 1e-4;

/// One timing, for a residual.
#[derive(Debug, Clone)]
pub(crate) struct Remainder {
    pub(crate) load: Load,
    /// Natural logarithm of measured over modelled time.
    pub(crate) ln: f64,
    /// Time over the best of the point.
    pub(crate) behind: f64,
    /// Number of the physical machine.
    pub(crate) machine: usize,
    /// Position of the group, as in [`GroupResidual::at`].
    pub(crate) at: Vec<f64>,
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

/// Returns the most likely residual of each position at which there are timings.
///
/// Timings of one machine form a group if their positions are equal when rounded to a quarter. Minimises
/// `sum (y - K w)^2 / noise^2` plus the prior of all groups together, by conjugate gradients with the blocks of the
/// groups as preconditioner.
///
/// # Errors
/// When a system can't be solved.
pub(crate) fn residual(places: &Places, remainders: &[Remainder], by_motion: bool) -> Result<Vec<GroupResidual>> {
    let spread = robust_deviation(&remainders.iter().map(|r| r.ln).collect::<Vec<f64>>()).unwrap_or(0.0);
    let reach = (REACH * spread).max(LEAST_REACH_LN);
    let key = |r: &Remainder| (r.at.iter().map(|x| (x * PER_LENGTH).round() as i64).collect(), r.machine);
    let mut groups: BTreeMap<(Vec<i64>, usize), Vec<&Remainder>> = BTreeMap::new();
    remainders.iter().for_each(|r| groups.entry(key(r)).or_default().push(r));
    let at: Vec<Vec<f64>> =
        groups.keys().map(|(key, _)| key.iter().map(|k| *k as f64 / PER_LENGTH).collect()).collect();
    let groups: Vec<Vec<&Remainder>> = groups.into_values().collect();
    if groups.is_empty() {
        return Ok(Vec::new());
    }
    let unsolved = "the residual over the load can't be solved";
    let count = places.loads().len();
    let mut between = Array2::zeros((count, count));
    for (mut row, load) in between.rows_mut().into_iter().zip(places.loads()) {
        row.assign(&Array1::from(places.likeness(load, by_motion)));
    }
    let root = (between + JITTER * Array2::<f64>::eye(count)).cholesky().context(unsolved)?;
    let whiten = root.solve_triangular(&by_columns(count), UPLO::Lower).context(unsolved)?;
    let mut blocks = Vec::new();
    let mut right = Array2::zeros((groups.len(), count));
    for (group, mut right) in groups.iter().zip(right.rows_mut()) {
        let mut likeness = Array2::zeros((group.len(), count));
        for (row, r) in likeness.rows_mut().into_iter().zip(group) {
            row.into_iter().zip(places.likeness(&r.load, by_motion)).for_each(|(to, k)| *to = k);
        }
        let precision = Array1::from_iter(group.iter().map(|r| noise_ln(r.behind).powi(-2)));
        let targets = Array1::from_iter(group.iter().map(|r| r.ln.clamp(-reach, reach)));
        let weighted = &likeness * &precision.insert_axis(Axis(1));
        // In coordinates in which the prior of a group is a unit matrix.
        blocks.push(whiten.dot(&weighted.t().dot(&likeness)).dot(&whiten.t()));
        right.assign(&whiten.dot(&weighted.t().dot(&targets)));
    }
    // Of one machine alone, what is special about it can't be told from what all have.
    let several = groups.iter().any(|g| g[0].machine != groups[0][0].machine);
    let covariance = Array2::from_shape_fn((groups.len(), groups.len()), |(a, b)| {
        let [first, second] = [a, b].map(|k| groups[k][0].machine);
        let of_machine = if several && first == second { MACHINE_LN.powi(2) } else { 0.0 };
        let own = if a == b { GROUP_JITTER } else { 0.0 };
        GroupResidual::covariance(&at[a], &at[b]) + of_machine + own
    });
    let inverse = covariance.invc().context(unsolved)?;
    let solved = inverse.dot(&solved(&inverse, &blocks, &right).context(unsolved)?);
    let weights = solved.dot(&whiten).mapv(|w| (w * PER_WEIGHT).round() / PER_WEIGHT);
    // What was special about a machine is dropped: groups at one position count by their sum.
    let mut residual: Vec<GroupResidual> = Vec::new();
    for (at, weights) in at.into_iter().zip(weights.rows()) {
        match residual.iter_mut().find(|known| known.at == at) {
            Some(known) => known.weights.iter_mut().zip(weights).for_each(|(sum, w)| *sum += w),
            None => residual.push(GroupResidual { at, weights: weights.to_vec() }),
        }
    }
    Ok(residual)
}

/// Returns a unit matrix that lies in memory column by column, in which the triangular solver walks through it.
fn by_columns(count: usize) -> Array2<f64> {
    let mut unit = Array2::zeros((count, count).f());
    unit.diag_mut().fill(1.0);
    unit
}

/// Solves `inverse u + block_g u_g = right` for all groups together, one group a row.
fn solved(inverse: &Array2<f64>, blocks: &[Array2<f64>], right: &Array2<f64>) -> linfa_linalg::Result<Array2<f64>> {
    let mut of_blocks = Vec::new();
    for (k, block) in blocks.iter().enumerate() {
        let root = (block + inverse[[k, k]] * Array2::<f64>::eye(block.nrows())).cholesky()?;
        let half = root.solve_triangular(&by_columns(block.nrows()), UPLO::Lower)?;
        of_blocks.push(half.t().dot(&half));
    }
    let by_group = |matrices: &[Array2<f64>], x: &Array2<f64>| {
        let mut out = Array2::zeros(x.raw_dim());
        for ((mut out, x), m) in out.rows_mut().into_iter().zip(x.rows()).zip(matrices) {
            out.assign(&m.dot(&x));
        }
        out
    };
    let dot = |a: &Array2<f64>, b: &Array2<f64>| (a * b).sum();
    let mut x = Array2::zeros(right.raw_dim());
    let mut left = right.clone();
    let mut ahead = by_group(&of_blocks, &left);
    let mut step = ahead.clone();
    let mut gain = dot(&left, &ahead);
    let enough = SOLVED * dot(right, right).sqrt();
    for _ in 0..MOST_STEPS {
        if dot(&left, &left).sqrt() <= enough {
            break;
        }
        let image = inverse.dot(&step) + by_group(blocks, &step);
        let length = gain / dot(&step, &image);
        x.scaled_add(length, &step);
        left.scaled_add(-length, &image);
        ahead = by_group(&of_blocks, &left);
        let next = dot(&left, &ahead);
        step = &ahead + &(next / gain * step);
        gain = next;
    }
    Ok(x)
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
        let remainder =
            |s: &Spot| Remainder { load: s.load, ln: truth(&s.load), behind: 1.0, machine: 0, at: vec![2.0] };
        let mut remainders: Vec<Remainder> = all[0].points.iter().map(remainder).collect();
        let residual = |r: &[Remainder]| {
            let groups = residual(&found, r, false).unwrap();
            Residual::new(Arc::clone(&found), GroupResidual::weights_at(&groups, &[2.0]), false)
        };
        let worst = |residual: &Residual| {
            let off = all[0].points.iter().map(|s| (residual.ln(&s.load) - truth(&s.load)).abs());
            off.fold(0.0, f64::max)
        };
        assert!(worst(&residual(&remainders)) < 0.06, "{}", worst(&residual(&remainders)));
        remainders[7].ln += 4.0;
        assert!(worst(&residual(&remainders)) < 0.35, "{}", worst(&residual(&remainders)));
    }

    #[test]
    fn a_new_machine_gets_what_machines_of_its_kind_share() {
        let all = profiles();
        let found = places(all.iter(), None);
        // The mean over all loads at a position, of machines with these remainders and positions.
        let at = |machines: &[(f64, f64)], position: f64| {
            let of = |(machine, &(ln, at)): (usize, &(f64, f64))| {
                let remainder = move |s: &Spot| Remainder { load: s.load, ln, behind: 1.0, machine, at: vec![at] };
                all[0].points.iter().map(remainder).collect::<Vec<_>>()
            };
            let groups =
                residual(&found, &machines.iter().enumerate().flat_map(of).collect::<Vec<_>>(), false).unwrap();
            let weights = GroupResidual::weights_at(&groups, &[position]);
            let residual = Residual::new(Arc::clone(&found), weights, false);
            all[0].points.iter().map(|s| residual.ln(&s.load)).sum::<f64>() / all[0].points.len() as f64
        };
        let opposed = at(&[(0.2, 2.0), (-0.2, 2.0)], 2.0);
        assert!(opposed.abs() < 0.01, "{opposed}");
        let agreed = at(&[(0.2, 2.0), (0.2, 2.0)], 2.0);
        assert!((0.16..0.2).contains(&agreed), "{agreed}");
        // One machine shows less than two, and another kind of machine gets less.
        let [own, other] = [2.0, 9.0].map(|position| at(&[(0.2, 2.0), (0.0, 9.0)], position));
        assert!(own < agreed && other < 0.5 * own, "{own} {other}");
    }

    #[test]
    fn the_solver_fulfils_its_equation() {
        let block =
            |k: f64| Array2::from_shape_fn((3, 3), |(a, b)| if a == b { 5.0 + k } else { k / (1 + a + b) as f64 });
        let blocks = [block(0.5), block(2.0)];
        let inverse = ndarray::array![[2.0, -0.5], [-0.5, 1.0]];
        let right = ndarray::array![[1.0, -2.0, 3.0], [0.5, 4.0, -1.0]];
        let x = solved(&inverse, &blocks, &right).unwrap();
        let mut image = inverse.dot(&x);
        image.rows_mut().into_iter().zip(&blocks).zip(x.rows()).for_each(|((mut to, m), x)| to += &m.dot(&x));
        assert!((image - right).iter().all(|off| off.abs() < 1e-3));
    }

    #[test]
    fn without_rows_nothing_is_corrected() {
        let found = places(profiles().iter(), None);
        assert_eq!(residual(&found, &[], true).unwrap(), []);
    }
}
