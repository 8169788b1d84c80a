//! The part of a time that the model leaves unexplained, as a function of the load: a Gaussian process with inducing
//! points for each group of timings, with the covariance of [`GroupResidual`] between groups.

use crate::data::Profile;
use anyhow::{Context, Result};
use linfa_linalg::cholesky::Cholesky;
use ndarray::{Array1, Array2, Axis, s};
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

/// Returns the standard deviation of the logarithm of a timing around its residual, from its time over the best of
/// the point.
pub(crate) fn noise_ln(behind: f64) -> f64 {
    NOISE_LN * behind.min(MOST_BEHIND)
}

/// Chooses the places that tell most about the loads of the profiles, each next one where the previous ones tell
/// least: a pivoted Cholesky decomposition of the covariance (Fine and Scheinberg, Efficient SVM training using
/// low-rank kernel representations, 2001).
///
/// They are chosen once for all fits: loads are the same on every machine, so that nothing of a held-out one leaks.
pub(crate) fn places(profiles: &[Profile], without: Option<&str>) -> Places {
    // Profiles of one seed have the same scenes and loads.
    let mut loads: BTreeMap<(&str, u32), Load> = BTreeMap::new();
    for spot in profiles.iter().flat_map(|p| &p.points).filter(|s| Some(s.scenario.as_str()) != without) {
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
    Places::new(chosen)
}

/// Loads at which residuals are fitted, with what all fits at them share.
#[derive(Debug)]
pub(crate) struct Basis {
    pub(crate) places: Arc<Places>,
    /// Lower roots of the covariance of the places, whatever moves and by motion.
    roots: [Array2<f64>; 2],
}

impl Basis {
    pub(crate) fn new(places: Arc<Places>) -> Self {
        let roots = [false, true].map(|by_motion| {
            let mut root = Array2::zeros((places.loads().len(), places.loads().len()));
            for (k, load) in places.loads().iter().enumerate() {
                let before = before_each(&root, &places.likeness(load, by_motion)[..k]);
                let own = 1.0 + JITTER - before.dot(&before);
                root.slice_mut(s![k, ..k]).assign(&before);
                root[[k, k]] = own.max(JITTER).sqrt();
            }
            root
        });
        Self { places, roots }
    }

    /// Returns what the residual under a load is a sum of, in coordinates in which its prior is a unit matrix.
    fn features(&self, load: &Load, by_motion: bool) -> Array1<f64> {
        before_each(&self.roots[usize::from(by_motion)], &self.places.likeness(load, by_motion))
    }

    /// Returns the weights of the places for weights of the features.
    fn of_places(&self, mut weights: Vec<f64>, by_motion: bool) -> Vec<f64> {
        let root = &self.roots[usize::from(by_motion)];
        for k in (0..weights.len()).rev() {
            let known: f64 = (k + 1..weights.len()).map(|j| root[[j, k]] * weights[j]).sum();
            weights[k] = (weights[k] - known) / root[[k, k]];
        }
        weights.iter().map(|w| (w * PER_WEIGHT).round() / PER_WEIGHT).collect()
    }
}

/// Solves `root x = right` for a lower triangle, as far as `right` goes.
fn before_each(root: &Array2<f64>, right: &[f64]) -> Array1<f64> {
    let mut x = Array1::zeros(right.len());
    for (k, value) in right.iter().enumerate() {
        let known = root.slice(s![k, ..k]).dot(&x.slice(s![..k]));
        x[k] = (value - known) / root[[k, k]];
    }
    x
}

/// The rows of a method, each with the group of timings that it belongs to. Timings of one machine form a group if
/// their positions are equal when rounded to a quarter.
#[derive(Debug)]
pub(super) struct Groups {
    by_motion: bool,
    /// Position, as in [`GroupResidual::at`], and number of the physical machine.
    groups: Vec<(Vec<f64>, usize)>,
    of_row: Vec<usize>,
    /// Shape (rows, places).
    features: Array2<f64>,
}

/// What a model leaves unexplained of one timing.
#[derive(Debug, Clone, Copy)]
pub(super) struct Remainder {
    /// Position among the rows of the method.
    pub(super) row: usize,
    /// Natural logarithm of measured over modelled time.
    pub(super) ln: f64,
    /// Time over the best of the point.
    pub(super) behind: f64,
}

impl Groups {
    /// Sorts rows by position and machine, each with its load.
    pub(super) fn new(rows: &[(Load, Vec<f64>, usize)], basis: &Basis, by_motion: bool) -> Self {
        let mut groups: Vec<(Vec<f64>, usize)> = Vec::new();
        let mut of_row = Vec::with_capacity(rows.len());
        let mut features = Array2::zeros((rows.len(), basis.places.loads().len()));
        for ((load, at, machine), mut features) in rows.iter().zip(features.rows_mut()) {
            let group = (at.iter().map(|x| (x * PER_LENGTH).round() / PER_LENGTH).collect(), *machine);
            of_row.push(groups.iter().position(|known| *known == group).unwrap_or(groups.len()));
            if of_row.last() == Some(&groups.len()) {
                groups.push(group);
            }
            features.assign(&basis.features(load, by_motion));
        }
        Self { by_motion, groups, of_row, features }
    }

    /// Returns the most likely residual of each position at which there are timings, and what it leaves of each.
    ///
    /// Minimises `sum (y - K w)^2 / noise^2` plus the prior of all groups together, by conjugate gradients.
    ///
    /// # Errors
    /// When a system can't be solved.
    pub(super) fn residual(
        &self,
        basis: &Basis,
        remainders: &[Remainder],
    ) -> Result<(Vec<GroupResidual>, Vec<f64>)> {
        let spread = robust_deviation(&remainders.iter().map(|r| r.ln).collect::<Vec<f64>>()).unwrap_or(0.0);
        let reach = (REACH * spread).max(LEAST_REACH_LN);
        let mut members: BTreeMap<usize, Vec<&Remainder>> = BTreeMap::new();
        remainders.iter().for_each(|r| members.entry(self.of_row[r.row]).or_default().push(r));
        let (mut blocks, mut right) = (Vec::new(), Array2::zeros((members.len(), self.features.ncols())));
        for (group, mut right) in members.values().zip(right.rows_mut()) {
            let features = self.features.select(Axis(0), &group.iter().map(|r| r.row).collect::<Vec<_>>());
            let precision = Array1::from_iter(group.iter().map(|r| noise_ln(r.behind).powi(-2)));
            let weighted = &features * &precision.insert_axis(Axis(1));
            right.assign(&weighted.t().dot(&Array1::from_iter(group.iter().map(|r| r.ln.clamp(-reach, reach)))));
            blocks.push(weighted.t().dot(&features));
        }
        let groups: Vec<&(Vec<f64>, usize)> = members.keys().map(|k| &self.groups[*k]).collect();
        // Of one machine alone, what is special about it can't be told from what all have.
        let several = groups.iter().any(|g| g.1 != groups[0].1);
        let covariance = Array2::from_shape_fn((groups.len(), groups.len()), |(a, b)| {
            let of_machine = if several && groups[a].1 == groups[b].1 { MACHINE_LN.powi(2) } else { 0.0 };
            let own = if a == b { GROUP_JITTER } else { 0.0 };
            GroupResidual::covariance(&groups[a].0, &groups[b].0) + of_machine + own
        });
        let root = covariance.cholesky().context("the residual over the load can't be solved")?;
        let weights = weights(&root, &blocks, &right);
        // What was special about a machine is dropped: groups at one position count by their sum.
        let mut residual: Vec<GroupResidual> = Vec::new();
        for ((at, _), weights) in groups.into_iter().zip(weights.rows()) {
            match residual.iter_mut().find(|known| known.at == *at) {
                Some(known) => known.weights.iter_mut().zip(weights).for_each(|(sum, w)| *sum += w),
                None => residual.push(GroupResidual { at: at.clone(), weights: weights.to_vec() }),
            }
        }
        let of_groups: Vec<Array1<f64>> =
            self.groups.iter().map(|(at, _)| Array1::from(GroupResidual::weights_at(&residual, at))).collect();
        let left = |r: &Remainder| r.ln - self.features.row(r.row).dot(&of_groups[self.of_row[r.row]]);
        let left = remainders.iter().map(left).collect();
        residual.iter_mut().for_each(|g| g.weights = basis.of_places(std::mem::take(&mut g.weights), self.by_motion));
        Ok((residual, left))
    }
}

/// Returns the weights of all groups, one a row: `right - block u`, where the residual `u` of the groups solves
/// `(covariance^-1 + block) u = right`.
///
/// Solves for `z` with `u = root z`, which has a unit matrix as its prior and needs no inverse of a covariance of
/// which machines and positions make most groups the sum of others.
fn weights(root: &Array2<f64>, blocks: &[Array2<f64>], right: &Array2<f64>) -> Array2<f64> {
    let of_blocks = |z: &Array2<f64>| {
        let mut u = root.dot(z);
        u.rows_mut().into_iter().zip(blocks).for_each(|(mut u, block)| u.assign(&block.dot(&u)));
        u
    };
    let dot = |a: &Array2<f64>, b: &Array2<f64>| (a * b).sum();
    let mut z = Array2::zeros(right.raw_dim());
    let mut left = root.t().dot(right);
    let mut step = left.clone();
    let mut length = dot(&left, &left);
    let enough = SOLVED.powi(2) * length;
    let mut steps=0;
    for _ in 0..MOST_STEPS {
        if length <= enough {
            break;
        }
        steps+=1;
        let image = &step + &root.t().dot(&of_blocks(&step));
        let share = length / dot(&step, &image);
        z.scaled_add(share, &step);
        left.scaled_add(-share, &image);
        let next = dot(&left, &left);
        step = &left + &(next / length * step);
        length = next;
    }
    if std::env::var_os("CGS").is_some() { eprintln!("cg {} groups {steps} steps", blocks.len()); }
    right - &of_blocks(&z)
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
