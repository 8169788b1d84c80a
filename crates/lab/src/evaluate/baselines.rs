//! The simple strategies that a prediction has to beat.

use super::regret_table::Strategy;
use super::role::{Role, roles};
use crate::data::{COMPARED, COMPARED_OF_GPUS, Profile, figure};
use sapwise::algorithm::BackendClass;
use sapwise::tuning::AlgorithmCost;
use sapwise::{AlgorithmId, Tuning};
use sapwise_tune::model::GPU_PREFIX;
use sapwise_tune::{Hardware, stats};
use std::collections::BTreeMap;

/// Always chooses the role with the least mean regret over the training profiles that have it. Each profile comes with
/// the regret of always choosing each of its algorithms. Every machine counts the same; its profiles share its weight.
pub(super) fn single_best<'a>(training: &[(&Profile, &[f64])], available: &[AlgorithmId]) -> Strategy<'a> {
    let regret = |role: &Role| -> Option<f64> {
        let mut machines: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
        for (profile, always) in training {
            let own = role.among(profile.algorithms.iter().map(|t| &t.id)).and_then(|id| profile.position(id));
            if let Some(k) = own {
                machines.entry(profile.machine()).or_default().push(always[usize::from(k)]);
            }
        }
        let means: Vec<f64> = machines.values().map(|regrets| stats::mean(regrets)).collect();
        (!means.is_empty()).then(|| stats::mean(&means))
    };
    // With one thread, the single thread counts as all threads too.
    let known = roles(available).into_iter().flat_map(|(role, _)| [Role { all: true, ..role.clone() }, role]);
    let mut candidates = Vec::from_iter(known);
    candidates.sort();
    let best = candidates.iter().filter_map(|role| Some((regret(role)?, role))).min_by(|a, b| a.0.total_cmp(&b.0));
    let chosen = best.and_then(|(_, role)| role.among(available.iter()).cloned());
    Box::new(move |_| chosen.clone())
}

/// Chooses brute force on one thread up to and including `last` objects, and `above` on all threads from there on.
///
/// With 64 and `grid-sap` this is nexus: brute force up to 64 colliders, then a tree. Here `grid-sap` takes the place
/// of the tree, as the fastest method in large scenes. With 999 and `sap` it is `mujoco_warp`, whose constant of 1000
/// bodies separates two kinds of sweep. Both run on a GPU there, and on the CPU here, which every machine has.
pub(super) fn frozen<'a>(last: u32, above: &str, available: &[AlgorithmId]) -> Strategy<'a> {
    let on_cpu = |method: &'_ str| {
        let of = |id: &&AlgorithmId| id.method() == method && id.backend().class() == BackendClass::Cpu;
        available.iter().filter(of).cloned().collect::<Vec<_>>()
    };
    let small = on_cpu("brute").into_iter().min_by_key(AlgorithmId::threads);
    let large = on_cpu(above).into_iter().max_by_key(AlgorithmId::threads);
    Box::new(move |load| if load.objects <= last { small.clone() } else { large.clone() })
}

/// Chooses the cheapest by cost curves. The nearest number of threads stands in for one that the machine doesn't have.
pub fn by_costs(costs: Vec<AlgorithmCost>, available: &[AlgorithmId]) -> Strategy<'_> {
    by_tuning(tuning(costs), available)
}

/// As [`by_costs`], among the algorithms that a program runs by default.
pub(super) fn by_costs_of_running(costs: Vec<AlgorithmCost>, available: &[AlgorithmId]) -> Strategy<'_> {
    by_tuning(tuning(costs).for_running(), available)
}

fn tuning(costs: Vec<AlgorithmCost>) -> Tuning {
    Tuning::from_costs(sapwise::tuning::Source::Measured, "", costs, &[])
}

fn by_tuning(tuning: Tuning, available: &[AlgorithmId]) -> Strategy<'_> {
    Box::new(move |load| {
        let (best, _) = tuning.cheapest(load, |k| closest(&tuning.costs[k].algorithm, available).is_some())?;
        closest(&tuning.costs[best].algorithm, available)
    })
}

/// Returns the costs of another machine under the names of this one's algorithms: all threads there become all threads
/// here, and fewer threads keep their number. Costs without a counterpart here are left out.
pub(super) fn of_another(costs: &[AlgorithmCost], available: &[AlgorithmId]) -> Vec<AlgorithmCost> {
    let theirs: Vec<AlgorithmId> = costs.iter().map(|c| c.algorithm.clone()).collect();
    let whole = roles(&theirs).into_iter().filter(|(role, _)| role.all);
    let counterpart = |(role, id): (Role, AlgorithmId)| {
        let own = role.among(available.iter()).filter(|own| own.backend().width() > 1)?;
        Some((costs.iter().find(|c| c.algorithm == id)?, own))
    };
    let whole: Vec<(&AlgorithmCost, &AlgorithmId)> = whole.filter_map(counterpart).collect();
    let same = costs.iter().filter(|c| {
        let taken = whole.iter().any(|(known, own)| known.algorithm == c.algorithm || **own == c.algorithm);
        !taken && available.contains(&c.algorithm)
    });
    same.cloned().chain(whole.iter().map(|(known, own)| renamed(known, own))).collect()
}

/// Returns a cost under the name of another algorithm.
pub(super) fn renamed(cost: &AlgorithmCost, id: &AlgorithmId) -> AlgorithmCost {
    AlgorithmCost::new(id.clone(), cost.revision, cost.curve.clone(), cost.spread_ln)
}

/// Returns the available algorithm of the same method and class of processor whose number of threads or GPUs is
/// nearest.
pub(super) fn closest(id: &AlgorithmId, available: &[AlgorithmId]) -> Option<AlgorithmId> {
    let distance =
        |other: &&AlgorithmId| (f64::from(other.backend().width()) / f64::from(id.backend().width())).ln().abs();
    let alike = |a: &&AlgorithmId| a.method() == id.method() && a.backend().class() == id.backend().class();
    // The same GPU first.
    let same = available.iter().find(|a| *a == id);
    same.or_else(|| available.iter().filter(alike).min_by(|a, b| distance(a).total_cmp(&distance(b)))).cloned()
}

/// The logarithms of the parameters that machines are compared by.
#[derive(Debug, Clone)]
pub(super) struct Likeness(Vec<Option<f64>>);

impl Likeness {
    pub(super) fn new(hardware: &Hardware) -> Self {
        let of_gpus = COMPARED_OF_GPUS.iter().map(|id| format!("{GPU_PREFIX}{id}"));
        let names = COMPARED.iter().map(ToString::to_string).chain(of_gpus);
        Self(names.map(|name| figure(hardware, &name).filter(|v| *v > 0.0).map(f64::ln)).collect())
    }
}

/// Returns the position of the nearest machine, by the logarithms of parameters over their standard deviation.
pub(super) fn nearest(known: &[&Likeness], own: &Likeness) -> Option<usize> {
    let mut distances = vec![0.0; known.len()];
    for (k, own) in own.0.iter().enumerate().filter_map(|(k, own)| Some((k, (*own)?))) {
        let values: Vec<Option<f64>> = known.iter().map(|other| other.0[k]).collect();
        let all: Vec<f64> = values.iter().flatten().copied().chain([own]).collect();
        let mean = stats::mean(&all);
        let variance = stats::mean(&all.iter().map(|v| (v - mean).powi(2)).collect::<Vec<f64>>());
        for (distance, value) in distances.iter_mut().zip(values) {
            // An unknown parameter is assumed to be as far off as machines are on average.
            *distance += value.map_or(2.0, |v| if variance > 1e-12 { (v - own).powi(2) / variance } else { 0.0 });
        }
    }
    (0..known.len()).min_by(|&a, &b| distances[a].total_cmp(&distances[b]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::Machine;
    use sapwise::algorithm::Load;

    fn ids(list: &[&str]) -> Vec<AlgorithmId> {
        list.iter().map(|id| id.parse().unwrap()).collect()
    }

    #[test]
    fn constants_and_substitutes_stay_within_what_is_available() {
        let available = ids(&["brute@cpu1", "brute@cpu8", "grid-sap@cpu1", "grid-sap@cpu8"]);
        let choose = frozen(64, "grid-sap", &available);
        let load = Load::of_objects;
        assert_eq!(choose(&load(64)).unwrap().to_string(), "brute@cpu1");
        assert_eq!(choose(&load(65)).unwrap().to_string(), "grid-sap@cpu8");
        assert_eq!(frozen(64, "sap", &available)(&load(100)), None);
        assert_eq!(closest(&"grid-sap@cpu16".parse().unwrap(), &available).unwrap().to_string(), "grid-sap@cpu8");
        assert_eq!(closest(&"tree@cpu1".parse().unwrap(), &available), None);
    }

    #[test]
    fn all_threads_stand_for_all_threads() {
        let cost = |id: &AlgorithmId| {
            crate::synthetic::true_costs(&Machine::family()[0].hardware(), std::slice::from_ref(id)).remove(0)
        };
        let names = |theirs: &[&str], own: &[&str]| -> Vec<String> {
            let costs: Vec<AlgorithmCost> = ids(theirs).iter().map(cost).collect();
            of_another(&costs, &ids(own)).iter().map(|c| c.algorithm.to_string()).collect()
        };
        let [two, sixteen] = [&["bvh@cpu1", "bvh@cpu2"][..], &["bvh@cpu1", "bvh@cpu2", "bvh@cpu16", "sap@cpu1"]];
        assert_eq!(names(two, sixteen), ["bvh@cpu1", "bvh@cpu16"]);
        assert_eq!(names(sixteen, two), ["bvh@cpu1", "bvh@cpu2"]);
        assert_eq!(names(sixteen, &two[..1]), ["bvh@cpu1"]);
        let found = of_another(&ids(sixteen).iter().map(cost).collect::<Vec<_>>(), &ids(two));
        assert_eq!(found[1].curve, cost(&"bvh@cpu16".parse().unwrap()).curve);
    }

    #[test]
    fn one_role_is_chosen_by_the_machines_that_have_it() {
        let family = Machine::family();
        let profiles: Vec<Profile> = family[..3].iter().map(|m| Profile::of("", &m.report())).collect();
        // All threads of `bvh` lose least on each machine, which has 2, 4 and 8.
        let regrets: Vec<Vec<f64>> = profiles
            .iter()
            .zip([2, 4, 8])
            .map(|(p, most)| {
                let of = |id: &AlgorithmId| if id.method() == "bvh" && id.threads() == most { 0.1 } else { 0.5 };
                p.algorithms.iter().map(|t| of(&t.id)).collect()
            })
            .collect();
        let training: Vec<(&Profile, &[f64])> = profiles.iter().zip(&regrets).map(|(p, r)| (p, &r[..])).collect();
        for (own, chosen) in [(&["bvh@cpu1", "bvh@cpu16", "sap@cpu1"][..], "bvh@cpu16"), (&["bvh@cpu1"], "bvh@cpu1")] {
            let choose = single_best(&training, &ids(own));
            assert_eq!(choose(&Load::of_objects(9)).unwrap().to_string(), chosen);
        }
    }

    #[test]
    fn the_nearest_machine_is_itself_and_then_its_like() {
        let family: Vec<Likeness> = Machine::family().iter().map(|m| Likeness::new(&m.hardware())).collect();
        let known: Vec<&Likeness> = family.iter().collect();
        for (k, own) in family.iter().enumerate() {
            assert_eq!(nearest(&known, own), Some(k));
        }
        // Four cores and eight lanes are nearer to four cores and four lanes than to sixteen cores.
        assert_eq!(nearest(&[known[4], known[1]], known[6]), Some(1));
        assert_eq!(nearest(&[], known[0]), None);
    }
}
