//! The part of a time that the model leaves unexplained, as a function of the load: a Gaussian process with inducing
//! points for each group of timings, with the covariance of [`GroupResidual`] between groups.

use crate::data::Profile;
use crate::fit::rows::Row;
use crate::text::position_or_push;
use anyhow::{Context, Result};
use linfa_linalg::cholesky::Cholesky;
use ndarray::{Array1, Array2, Axis, s};
use rayon::prelude::*;
use sapwise::algorithm::Load;
use sapwise::internals::Places;
use sapwise_scenes::Random;
use sapwise_tune::model::GroupResidual;
use sapwise_tune::stats::robust_deviation;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Standard deviation of the residual that only the groups of one machine share, in natural logarithms. No parameter
/// shows it, so it is not predicted for a new machine.
const MACHINE_LN: f64 = 0.1;
/// Standard deviation of a timing around its residual, in natural logarithms. A third more changes no regret
/// noticeably.
pub(super) const NOISE_LN: f64 = 0.12;
/// Time over the best of the point beyond which the weight of a timing falls no further.
const MOST_BEHIND: f64 = 4.0;
/// Share of the variance that is added to each place alone. It keeps the weights of neighbouring places from growing
/// with opposite signs. Likewise for groups.
const JITTER: f64 = 1e-4;
const GROUP_JITTER: f64 = 1e-6;
/// Steps of a weight within one: finer ones would only lengthen the file of a model.
const PER_WEIGHT: f64 = 1e6;
/// Groups within a unit of position: timings of one machine are grouped by their rounded positions.
const PER_LENGTH: f64 = 4.0;
/// Most loads among which places are chosen.
const MOST_LOADS: usize = 1500;
/// A remainder beyond this many robust standard deviations, and beyond this logarithm, is clipped: it is a disturbed
/// measurement, or too abrupt for a smooth residual.
const REACH: f64 = 3.0;
const LEAST_REACH_LN: f64 = 0.6;
/// Most steps of the solver, and the relative error at which it ends.
const MOST_STEPS: usize = 500;
const SOLVED: f64 = 1e-4;

/// Returns the standard deviation of the logarithm of a timing around its residual, from its time over the best of
/// the point.
pub(crate) fn noise_ln(behind: f64) -> f64 {
    NOISE_LN * behind.min(MOST_BEHIND)
}

/// Chooses the places that explain most of the loads of the profiles. Each next place is the load that the previous
/// ones explain least: a pivoted Cholesky decomposition of the covariance (Fine and Scheinberg, Efficient SVM training
/// using low-rank kernel representations, 2001).
///
/// They are chosen once for all fits, from the loads of held-out machines too. At the sizes of an ascent every machine
/// has alike loads. Visits have sizes of their own: a held-out machine contributes loads near its crossovers, but none
/// of its times.
pub(crate) fn places(profiles: &[Profile], without: Option<&str>) -> Places {
    // Loads at the same size of a scenario are alike: the first one represents all.
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

/// Loads at which residuals are fitted, with the matrices that all fits share.
#[derive(Debug)]
pub(crate) struct Basis {
    pub(crate) places: Arc<Places>,
    /// Lower Cholesky factors of the covariance of the places, without motion and with it.
    roots: [Array2<f64>; 2],
}

/// The features of the residual at each point of each profile, in coordinates in which its prior is a unit matrix:
/// without motion and with it.
pub(crate) type Features = Vec<[Array2<f64>; 2]>;

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

    /// Returns the features of all points.
    pub(crate) fn features(&self, profiles: &[Profile]) -> Features {
        let of = |profile: &Profile, by_motion: bool| {
            let mut features = Array2::zeros((profile.points.len(), self.places.loads().len()));
            for (spot, mut row) in profile.points.iter().zip(features.rows_mut()) {
                let root = &self.roots[usize::from(by_motion)];
                row.assign(&before_each(root, &self.places.likeness(&spot.load, by_motion)));
            }
            features
        };
        profiles.par_iter().map(|p| [of(p, false), of(p, true)]).collect()
    }

    /// Returns the weights of the places for weights of the features.
    pub(super) fn of_places(&self, mut weights: Vec<f64>, by_motion: bool) -> Vec<f64> {
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

/// The timings of one algorithm of a profile.
#[derive(Debug)]
struct Cell {
    /// Position of its first timing among the rows.
    first: usize,
    /// Position among the groups.
    group: usize,
    /// Shape (timings, places).
    features: Array2<f64>,
    /// One over the variance of the noise, for each timing.
    precision: Array1<f64>,
    /// The information of all timings, shape (places, places).
    block: Array2<f64>,
}

/// The timings of a method in groups, in the order of its rows. Timings of one machine form a group if their positions
/// are equal when rounded to a quarter.
#[derive(Debug)]
pub(super) struct Groups {
    by_motion: bool,
    /// Position, as in [`GroupResidual::at`], and number of the physical machine.
    groups: Vec<(Vec<f64>, usize)>,
    cells: Vec<Cell>,
}

impl Groups {
    /// Sorts rows, which come with their positions, the rows of an algorithm in succession. Lower bounds don't count.
    pub(super) fn new(rows: &[(&Row, Vec<f64>)], machines: &[usize], features: &Features, by_motion: bool) -> Self {
        let (mut groups, mut cells): (Vec<(Vec<f64>, usize)>, _) = (Vec::new(), Vec::new());
        let measured: Vec<usize> = (0..rows.len()).filter(|&k| !rows[k].0.floor).collect();
        let source = |k: usize| (rows[k].0.profile, rows[k].0.algorithm);
        for own in measured.chunk_by(|&a, &b| source(a) == source(b)) {
            let (first, at) = &rows[own[0]];
            let group = (at.iter().map(|x| (x * PER_LENGTH).round() / PER_LENGTH).collect(), machines[first.profile]);
            let group = position_or_push(&mut groups, group);
            let spots: Vec<usize> = own.iter().map(|&k| rows[k].0.spot as usize).collect();
            let features = features[first.profile][usize::from(by_motion)].select(Axis(0), &spots);
            let precision = Array1::from_iter(own.iter().map(|&k| noise_ln(rows[k].0.behind).powi(-2)));
            let block = (&features * &precision.view().insert_axis(Axis(1))).t().dot(&features);
            cells.push(Cell { first: own[0], group, features, precision, block });
        }
        Self { by_motion, groups, cells }
    }

    /// Returns the most likely residual of each position with timings, and the remainder of each timing.
    /// `chosen` are the algorithms of profiles that count, by the position of the first timing, and `ln` the natural
    /// logarithms of measured over modelled time of all their timings.
    ///
    /// Minimises `sum (y - K w)^2 / noise^2` plus the prior of all groups together, by conjugate gradients.
    ///
    /// # Errors
    /// When a system can't be solved.
    pub(super) fn residual(
        &self,
        basis: &Basis,
        chosen: impl Fn(usize) -> bool,
        ln: &[f64],
    ) -> Result<(Vec<GroupResidual>, Vec<f64>)> {
        let reach = (REACH * robust_deviation(ln).unwrap_or(0.0)).max(LEAST_REACH_LN);
        let targets: Array1<f64> = ln.iter().map(|ln| ln.clamp(-reach, reach)).collect();
        let count = basis.places.loads().len();
        let mut sums: BTreeMap<usize, (Array2<f64>, Array1<f64>)> = BTreeMap::new();
        let cells: Vec<&Cell> = self.cells.iter().filter(|cell| chosen(cell.first)).collect();
        let mut passed = 0;
        for cell in &cells {
            let empty = || (Array2::zeros((count, count)), Array1::zeros(count));
            let (block, right) = sums.entry(cell.group).or_insert_with(empty);
            let own = targets.slice(s![passed..passed + cell.precision.len()]);
            passed += cell.precision.len();
            *block += &cell.block;
            *right += &(&own * &cell.precision).dot(&cell.features);
        }
        let groups: Vec<&(Vec<f64>, usize)> = sums.keys().map(|k| &self.groups[*k]).collect();
        // With one machine, its own residual can't be separated from the common one.
        let several = groups.iter().any(|g| g.1 != groups[0].1);
        let covariance = Array2::from_shape_fn((groups.len(), groups.len()), |(a, b)| {
            let of_machine = if several && groups[a].1 == groups[b].1 { MACHINE_LN.powi(2) } else { 0.0 };
            let own = if a == b { GROUP_JITTER } else { 0.0 };
            GroupResidual::covariance(&groups[a].0, &groups[b].0) + of_machine + own
        });
        let root = covariance.cholesky().context("the residual over the load can't be solved")?;
        // A machine's own residual is dropped: groups at one position are added up.
        let mut residual: Vec<GroupResidual> = Vec::new();
        let (blocks, right): (Vec<_>, Vec<_>) = sums.into_values().unzip();
        for ((at, _), weights) in groups.into_iter().zip(weights(&root, &blocks, &right).rows()) {
            match residual.iter_mut().find(|known| known.at == *at) {
                Some(known) => known.weights.iter_mut().zip(weights).for_each(|(sum, w)| *sum += w),
                None => residual.push(GroupResidual { at: at.clone(), weights: weights.to_vec() }),
            }
        }
        let mut left = Vec::with_capacity(ln.len());
        for cell in &cells {
            let weights = Array1::from(GroupResidual::weights_at(&residual, &self.groups[cell.group].0));
            left.extend(
                cell.features.dot(&weights).iter().zip(&ln[left.len()..]).map(|(explained, ln)| ln - explained),
            );
        }
        residual.iter_mut().for_each(|g| g.weights = basis.of_places(std::mem::take(&mut g.weights), self.by_motion));
        Ok((residual, left))
    }
}

/// Returns the weights of all groups, one a row: `right - block u`, where the residual `u` of the groups solves
/// `(covariance^-1 + block) u = right`.
///
/// Solves for `z` with `u = root z`, which has a unit matrix as its prior and needs no inverse of a covariance of
/// which machines and positions make most groups the sum of others.
fn weights(root: &Array2<f64>, blocks: &[Array2<f64>], right: &[Array1<f64>]) -> Array2<f64> {
    let right = Array2::from_shape_fn((right.len(), right.first().map_or(0, Array1::len)), |(g, k)| right[g][k]);
    let of_blocks = |z: &Array2<f64>| {
        let mut u = root.dot(z);
        u.rows_mut().into_iter().zip(blocks).for_each(|(mut u, block)| u.assign(&block.dot(&u)));
        u
    };
    let dot = |a: &Array2<f64>, b: &Array2<f64>| (a * b).sum();
    let mut z = Array2::zeros(right.raw_dim());
    let mut left = root.t().dot(&right);
    let mut step = left.clone();
    let mut length = dot(&left, &left);
    let enough = SOLVED.powi(2) * length;
    for _ in 0..MOST_STEPS {
        if length <= enough {
            break;
        }
        let image = &step + &root.t().dot(&of_blocks(&step));
        let share = length / dot(&step, &image);
        z.scaled_add(share, &step);
        left.scaled_add(-share, &image);
        let next = dot(&left, &left);
        step = &left + &(next / length * step);
        length = next;
    }
    right - &of_blocks(&z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::Spot;
    use crate::synthetic::{Machine, profiles};
    use sapwise::internals::Residual;

    /// The residual at a position, of machines with these positions that were timed at all points of a profile with
    /// these remainders.
    fn residual(profile: &Profile, machines: &[f64], ln: impl Fn(usize, &Spot) -> f64, position: f64) -> Residual {
        let all = vec![profile.clone(); machines.len()];
        let basis = Basis::new(Arc::new(places(&all, None)));
        let row = |m: usize, (k, s): (usize, &Spot)| Row {
            profile: m,
            algorithm: 0,
            spot: k as u32,
            load: s.load,
            ns: 1.0,
            behind: 1.0,
            floor: false,
        };
        let of = |m: usize| all[m].points.iter().enumerate().map(move |spot| row(m, spot));
        let rows: Vec<Row> = (0..all.len()).flat_map(of).collect();
        let rows: Vec<(&Row, Vec<f64>)> = rows.iter().map(|r| (r, vec![machines[r.profile]])).collect();
        let numbers: Vec<usize> = (0..all.len()).collect();
        let groups = Groups::new(&rows, &numbers, &basis.features(&all), false);
        let ln: Vec<f64> = rows.iter().map(|(r, _)| ln(r.profile, &all[r.profile].points[r.spot as usize])).collect();
        let (found, left) = groups.residual(&basis, |_| true, &ln).unwrap();
        let at = |at: f64| {
            let weights = GroupResidual::weights_at(&found, &[at]);
            Residual::new(Arc::clone(&basis.places), weights, false)
        };
        for ((row, own), (ln, left)) in rows.iter().zip(ln.iter().zip(left)) {
            assert!((at(own[0]).ln(&row.load) + left - ln).abs() < 1e-3);
        }
        at(position)
    }

    #[test]
    fn places_are_loads_of_the_profiles_and_none_twice() {
        let all = profiles(Machine::family().into_iter().take(2));
        let found = places(&all, None);
        assert!(found.loads().len() >= 20 && found.loads().len() <= Places::MOST);
        for (k, load) in found.loads().iter().enumerate() {
            assert!(all.iter().flat_map(|p| &p.points).any(|s| s.load == *load));
            assert!(!found.loads()[..k].contains(load));
        }
        let without = places(&all, Some("clustered"));
        assert!(without.loads().iter().all(|l| all[0].points.iter().any(|s| s.load == *l && s.scenario == "uniform")));
    }

    #[test]
    fn a_smooth_remainder_is_found_and_a_far_timing_is_held_back() {
        let all = profiles(Machine::family().into_iter().take(2));
        let truth = |l: &Load| {
            0.3 * (f64::from(l.objects).log2() / 4.0).sin() + 0.1 * (l.pairs / f64::from(l.objects)).min(1.0)
        };
        let worst = |disturbed: f64| {
            let far = |s: &Spot| if *s == all[0].points[7] { disturbed } else { 0.0 };
            let found = residual(&all[0], &[2.0], |_, s| truth(&s.load) + far(s), 2.0);
            all[0].points.iter().map(|s| (found.ln(&s.load) - truth(&s.load)).abs()).fold(0.0, f64::max)
        };
        assert!(worst(0.0) < 0.06, "{}", worst(0.0));
        assert!(worst(4.0) < 0.35, "{}", worst(4.0));
    }

    #[test]
    fn a_new_machine_gets_what_machines_of_its_kind_share() {
        let all = profiles(Machine::family().into_iter().take(2));
        // The mean over all loads at a position, of machines with these remainders and positions.
        let at = |machines: &[(f64, f64)], position: f64| {
            let positions: Vec<f64> = machines.iter().map(|m| m.1).collect();
            let found = residual(&all[0], &positions, |m, _| machines[m].0, position);
            all[0].points.iter().map(|s| found.ln(&s.load)).sum::<f64>() / all[0].points.len() as f64
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
        let covariance = ndarray::array![[2.0, 0.5], [0.5, 1.0]];
        let right = [ndarray::array![1.0, -2.0, 3.0], ndarray::array![0.5, 4.0, -1.0]];
        let found = weights(&covariance.cholesky().unwrap(), &blocks, &right);
        // The residual of the groups, by the weights.
        let u = covariance.dot(&found);
        for (k, right) in right.iter().enumerate() {
            let image = &found.row(k) + &blocks[k].dot(&u.row(k));
            assert!((image - right).iter().all(|off: &f64| off.abs() < 1e-3));
        }
    }

    #[test]
    fn without_rows_nothing_is_corrected() {
        let all = profiles(Machine::family().into_iter().take(2));
        let basis = Basis::new(Arc::new(places(&all, None)));
        let groups = Groups::new(&[], &[0, 1], &basis.features(&all), true);
        assert_eq!(groups.residual(&basis, |_| true, &[]).unwrap(), (Vec::new(), Vec::new()));
    }
}
