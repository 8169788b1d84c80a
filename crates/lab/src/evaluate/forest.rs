//! A random forest for the time of each method, the baseline that knows no physics.

use super::regret_table::Strategy;
use crate::data::{COMPARED, COMPARED_OF_GPUS, MethodKey, Profile, method_key};
use crate::fit::{Row, rows, thinned};
use anyhow::{Context, Result};
use sapwise::AlgorithmId;
use sapwise::algorithm::{Backend, Load};
use sapwise_scenes::Random;
use sapwise_tune::Hardware;
use smartcore::ensemble::random_forest_regressor::{RandomForestRegressor, RandomForestRegressorParameters};
use smartcore::linalg::basic::matrix::DenseMatrix;
use std::collections::BTreeMap;

/// Trees of a forest.
const TREES: usize = 25;
/// Most rows that a forest is grown from.
const MOST_ROWS: usize = 3000;
/// Approximate number of profiles that forests are grown from, and fewest rows of each for a method: from a handful of
/// rows no tree learns how time grows with the load.
const MOST_PROFILES: usize = 400;
const FEWEST_OF_PROFILE: usize = 15;
/// Rows in a leaf.
const LEAF: usize = 8;
/// Seed of the trees.
const SEED: u64 = 1;

/// The rows of every method, for all forests.
pub(super) struct Table(BTreeMap<MethodKey, Vec<Example>>);

struct Example {
    profile: usize,
    /// Position of its point in the profile.
    spot: u32,
    features: Vec<f64>,
    ln_ns: f64,
}

impl Table {
    /// Collects the rows. The lower bound of an algorithm that had left the sweep counts as a time: a tree does not
    /// extrapolate. Without the bound it would predict the last measured time even for a million objects.
    pub(super) fn new(profiles: &[Profile]) -> Self {
        let step = profiles.len().div_ceil(MOST_PROFILES).max(1);
        let most = (MOST_ROWS / profiles.len().div_ceil(step).max(1)).max(FEWEST_OF_PROFILE);
        let mut table: BTreeMap<MethodKey, Vec<Example>> = BTreeMap::new();
        for (k, profile) in profiles.iter().enumerate().step_by(step) {
            let mut own: BTreeMap<MethodKey, Vec<Row>> = BTreeMap::new();
            for row in rows(profile, k, None) {
                own.entry(method_key(profile.id(row.algorithm))).or_default().push(row);
            }
            for (key, rows) in own {
                let example = |r: Row| Example {
                    profile: k,
                    spot: r.spot,
                    features: features(&profile.hardware, profile.id(r.algorithm).backend(), &r.load),
                    ln_ns: r.ns.ln(),
                };
                table.entry(key).or_default().extend(thinned(rows, most, k).into_iter().map(example));
            }
        }
        Self(table)
    }

    /// Grows forests from the chosen profiles, without the points that `left_out` names by profile and position.
    ///
    /// # Errors
    /// When smartcore refuses a fit.
    pub(super) fn grow(&self, chosen: &[bool], left_out: impl Fn(usize, u32) -> bool) -> Result<Forests> {
        let mut forests = BTreeMap::new();
        for (key, examples) in &self.0 {
            let known: Vec<&Example> =
                examples.iter().filter(|e| chosen[e.profile] && !left_out(e.profile, e.spot)).collect();
            // At random: even steps would take rows of the same few sizes from every profile.
            let order = Random::new(SEED).shuffled(known.len());
            let known: Vec<&Example> = order.into_iter().take(MOST_ROWS).map(|k| known[k]).collect();
            if known.len() > LEAF {
                forests.insert(key.clone(), Forest::grow(&known)?);
            }
        }
        Ok(Forests(forests))
    }
}

/// A forest for each method of the training.
pub(super) struct Forests(BTreeMap<MethodKey, Forest>);

impl Forests {
    /// Chooses the algorithm with the least predicted time.
    pub(super) fn chooser<'a>(&'a self, hardware: &'a Hardware, available: &'a [AlgorithmId]) -> Strategy<'a> {
        Box::new(move |load| {
            let ln_ns = |id: &AlgorithmId| self.0.get(&method_key(id))?.ln_ns(&features(hardware, id.backend(), load));
            let costs = available.iter().filter_map(|id| Some((id, ln_ns(id)?)));
            costs.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(id, _)| id.clone())
        })
    }
}

struct Forest(RandomForestRegressor<f64, f64, DenseMatrix<f64>, Vec<f64>>);

impl Forest {
    fn grow(examples: &[&Example]) -> Result<Self> {
        let columns = examples.first().map_or(0, |e| e.features.len());
        // Column by column, as a tree looks for a split.
        let values = (0..columns).flat_map(|c| examples.iter().map(move |e| e.features[c])).collect();
        let x =
            DenseMatrix::new(examples.len(), columns, values, true).context("the rows of a random forest differ")?;
        let y: Vec<f64> = examples.iter().map(|e| e.ln_ns).collect();
        let parameters = RandomForestRegressorParameters::default()
            .with_n_trees(TREES)
            .with_m(columns.div_ceil(3))
            .with_min_samples_leaf(LEAF)
            .with_seed(SEED);
        Ok(Self(RandomForestRegressor::fit(&x, &y, parameters).context("a random forest could not be grown")?))
    }

    fn ln_ns(&self, features: &[f64]) -> Option<f64> {
        let x = DenseMatrix::new(1, features.len(), features.to_vec(), false).ok()?;
        self.0.predict(&x).ok()?.first().copied()
    }
}

/// Returns the features that a tree may split by: the load, the number of threads or GPUs, and the logarithms of the
/// parameters that machines are compared by, on GPUs those of the first one. A missing parameter is zero.
fn features(hardware: &Hardware, backend: &Backend, load: &Load) -> Vec<f64> {
    let of_load = [
        f64::from(load.objects).ln_1p(),
        load.axis_candidates.ln_1p(),
        load.strip_candidates.ln_1p(),
        load.pairs.ln_1p(),
        load.moved,
        load.moved_share,
        f64::from(backend.width()).ln(),
    ];
    let logarithm = |value: Option<f64>| value.filter(|v| *v > 0.0).map_or(0.0, f64::ln);
    let of_machine = COMPARED.iter().map(|id| logarithm(hardware.value(*id)));
    let of_gpu = match backend {
        Backend::Gpu(indices) => {
            let gpu = indices.first().and_then(|k| hardware.gpu(*k));
            COMPARED_OF_GPUS.iter().map(|id| logarithm(gpu.and_then(|g| g.value(*id)))).collect()
        }
        _ => Vec::new(),
    };
    of_load.into_iter().chain(of_machine).chain(of_gpu).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::regret_table::RegretTable;
    use crate::synthetic::{Machine, profiles};

    /// Mean regret on the last machine of forests that were grown from `chosen`.
    fn regret(profiles: &[Profile], chosen: &[bool]) -> f64 {
        let forests = Table::new(profiles).grow(chosen, |_, _| false).unwrap();
        let held = profiles.last().unwrap();
        let available = held.available();
        RegretTable::new(held).regret(held, &forests.chooser(&held.hardware, &available)).mean
    }

    #[test]
    fn forests_choose_well_on_a_machine_that_they_saw_and_on_another_and_always_alike() {
        let all = profiles(Machine::family_with_gpus());
        let mut others = vec![true; all.len()];
        others[all.len() - 1] = false;
        let (seen, unseen) = (regret(&all, &vec![true; all.len()]), regret(&all, &others));
        assert!(seen < 0.1 && unseen < 0.5, "{seen} {unseen}");
        assert_eq!(unseen.to_bits(), regret(&all, &others).to_bits());
    }

    #[test]
    fn what_left_the_race_is_not_chosen_beyond() {
        let all = profiles(Machine::family_with_gpus());
        let forests = Table::new(&all).grow(&vec![true; all.len()], |_, _| false).unwrap();
        let available = all[2].available();
        let choose = forests.chooser(&all[2].hardware, &available);
        for spot in all[2].points.iter().filter(|s| s.load.objects > 100_000) {
            assert_ne!(choose(&spot.load).unwrap().method(), "brute", "{:?}", spot.load);
        }
        assert!(Forests(BTreeMap::new()).chooser(&all[2].hardware, &available)(&all[2].points[0].load).is_none());
    }
}
