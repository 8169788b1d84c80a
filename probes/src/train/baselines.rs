//! Ways to choose an algorithm that a prediction has to beat.

use super::curve::{measured_costs, measured_fields};
use super::rows::{Profile, best, medians};
use super::{GPU_PARAMETERS, PARAMETERS, figure};
use anyhow::Result;
use sapwise::model::GPU_PREFIX;
use sapwise::report::Point;
use sapwise::{AlgorithmCost, AlgorithmId, BackendClass, Fields, Hardware, Load, Report};
use std::collections::BTreeMap;

/// Chooses an algorithm under a load among those that a machine has; `None` where it knows none of them.
pub(crate) type Chooser<'a> = Box<dyn Fn(&Load) -> Option<AlgorithmId> + 'a>;

/// The cost of an algorithm over the best, where nothing is known of it: a guess. Who leaves the race as hopeless is slower
/// than this, but where time is short an algorithm leaves at three times the best already.
pub(crate) const NOT_TIMED: f64 = 10.0;

/// Sizes a decade that count as one when regrets are averaged.
const PER_DECADE: f64 = 4.0;

/// Regret of a choice in each quarter of a decade of each scenario of a report: the mean over the points there.
///
/// A sweep goes most often to the sizes at which two algorithms lie close, where every choice costs little. Counted one by one these
/// points would pass off any way to choose as better than it is.
pub(crate) fn regrets(profile: &Profile, choose: &Chooser<'_>) -> Vec<f64> {
    let mut regrets: BTreeMap<(&str, i64), Vec<f64>> = BTreeMap::new();
    for point in &profile.report.points {
        let medians = medians(point);
        let Some(best) = best(&medians) else { continue };
        let chosen = choose(&point.load);
        let timed = chosen.as_ref().and_then(|id| over_best(&medians, best, id).or_else(|| elsewhere(profile, point, id)));
        let quarter = (PER_DECADE * f64::from(point.load.objects.max(1)).log10()).round() as i64;
        regrets.entry((&point.scenario, quarter)).or_default().push(timed.unwrap_or(NOT_TIMED) - 1.0);
    }
    regrets.values().map(|here| average(here)).collect()
}

fn over_best(medians: &[(&AlgorithmId, f64)], best: f64, id: &AlgorithmId) -> Option<f64> {
    Some(medians.iter().find(|m| m.0 == id)?.1 / best)
}

/// How far away another size may be from which it is taken how far behind an algorithm is.
const LIKE: f64 = 2.0;

/// The cost of an algorithm over the best at the nearest other size of the scenario: a sweep goes to some sizes more than once, and
/// then only with those between which the choice lies.
fn elsewhere(profile: &Profile, like: &Point, id: &AlgorithmId) -> Option<f64> {
    let distance = |p: &Point| (f64::from(p.load.objects) / f64::from(like.load.objects)).ln().abs();
    let near = profile.report.points.iter().filter(|p| p.scenario == like.scenario && distance(p) <= LIKE.ln());
    let timed = near.filter_map(|p| {
        let medians = medians(p);
        Some((distance(p), over_best(&medians, best(&medians)?, id)?))
    });
    timed.min_by(|a, b| a.0.total_cmp(&b.0)).map(|nearest| nearest.1)
}

/// The algorithms of a profile that were timed anywhere in it.
pub(crate) fn available(profile: &Profile) -> Vec<AlgorithmId> {
    let timed = |id: &&AlgorithmId| profile.report.points.iter().any(|p| p.timings.iter().any(|t| t.algorithm == **id));
    profile.report.algorithms.iter().map(|t| &t.id).filter(timed).cloned().collect()
}

/// Always the algorithm with the least mean regret over the points of the training profiles, each profile counting the same.
pub(crate) fn single_best<'a>(training: &[&Profile], available: &[AlgorithmId]) -> Chooser<'a> {
    let mean = |id: &AlgorithmId| {
        let always: Chooser<'_> = Box::new(|_| Some(id.clone()));
        training.iter().map(|p| average(&regrets(p, &always))).sum::<f64>()
    };
    let mut scored: Vec<(f64, &AlgorithmId)> = available.iter().map(|id| (mean(id), id)).collect();
    scored.sort_by(|a, b| a.0.total_cmp(&b.0));
    let chosen = scored.first().map(|s| s.1.clone());
    Box::new(move |_| chosen.clone())
}

/// Brute force on one thread up to and including `last` objects, `above` on all threads from there on.
///
/// With 64 and `strips` this is nexus, which has brute force for up to 64 colliders and a tree beyond; strips stand for the
/// tree, being what is fastest in large scenes here. With 999 and `sweep` it is `mujoco_warp`, whose constant of 1000 bodies
/// parts two kinds of sweep after a brute force that is chosen by a count of filtered pairs, which is not known here; the
/// constant is taken for the border between brute force and sweep. Both run on a GPU there; here both run on the CPU, which
/// every machine has.
pub(crate) fn frozen<'a>(last: u32, above: &str, available: &[AlgorithmId]) -> Chooser<'a> {
    let on_cpu = |method: &'_ str| {
        let of = |id: &&AlgorithmId| id.method() == method && id.backend().class() == BackendClass::Cpu;
        available.iter().filter(of).cloned().collect::<Vec<_>>()
    };
    let small = on_cpu("brute").into_iter().min_by_key(AlgorithmId::threads);
    let large = on_cpu(above).into_iter().max_by_key(AlgorithmId::threads);
    Box::new(move |load| if load.objects <= last { small.clone() } else { large.clone() })
}

/// The measured thresholds of the first training profile, by the number of objects alone, whatever the machine. Where they name
/// a GPU and the machine has none, the same method runs on all of its cores.
///
/// # Errors
/// When that profile has too few timings for thresholds.
pub(crate) fn default_machine<'a>(training: &[&Profile], available: &'a [AlgorithmId]) -> Result<Chooser<'a>> {
    let Some(first) = training.first() else { return Ok(Box::new(|_| None)) };
    let fields = measured_fields(&first.report, slice_scenario(&first.report))?;
    Ok(Box::new(move |load| fields.step(load.objects).and_then(|s| stand_in(&s.algorithm, available))))
}

/// The measured costs of the training profile whose hardware is nearest, under the whole load.
pub(crate) fn nearest_machine<'a>(training: &[&Profile], hardware: &Hardware, available: &'a [AlgorithmId]) -> Chooser<'a> {
    let known: Vec<&Hardware> = training.iter().map(|p| &p.report.hardware).collect();
    match nearest(&known, hardware) {
        Some(k) => by_costs(measured_costs(&training[k].report).0, available),
        None => Box::new(|_| None),
    }
}

/// The cheapest by cost curves; the nearest number of threads stands for one that the machine doesn't have.
pub(crate) fn by_costs(costs: Vec<AlgorithmCost>, available: &[AlgorithmId]) -> Chooser<'_> {
    let fields = Fields::from_costs(sapwise::Source::Measured, "", costs, &[]);
    Box::new(move |load| {
        let best = fields.rank(load, |k| closest(&fields.costs[k].algorithm, available).is_some())?.best;
        closest(&fields.costs[best].algorithm, available)
    })
}

/// `uniform` where a report has it, else its first scenario.
pub(crate) fn slice_scenario(report: &Report) -> &str {
    let names = || report.points.iter().map(|p| p.scenario.as_str());
    names().find(|n| *n == "uniform").or_else(|| names().next()).unwrap_or("uniform")
}

/// The available algorithm of the same method and class of processor whose number of threads or GPUs is nearest.
fn closest(id: &AlgorithmId, available: &[AlgorithmId]) -> Option<AlgorithmId> {
    let distance = |other: &&AlgorithmId| (f64::from(other.backend().width()) / f64::from(id.backend().width())).ln().abs();
    let alike = |a: &&AlgorithmId| a.method() == id.method() && a.backend().class() == id.backend().class();
    // The same GPU first, where there are several of equal number.
    let same = available.iter().find(|a| *a == id);
    same.or_else(|| available.iter().filter(alike).min_by(|a, b| distance(a).total_cmp(&distance(b)))).cloned()
}

/// [`closest`], or the same method on the most threads that are available.
fn stand_in(id: &AlgorithmId, available: &[AlgorithmId]) -> Option<AlgorithmId> {
    let of_method = || available.iter().filter(|a| a.method() == id.method()).max_by_key(|a| a.threads()).cloned();
    closest(id, available).or_else(of_method)
}

/// Position of the nearest hardware, by the logarithms of the parameters that both have, over their standard deviation.
fn nearest(known: &[&Hardware], hardware: &Hardware) -> Option<usize> {
    let logarithm = |h: &Hardware, name: &str| figure(h, name).filter(|v| *v > 0.0).map(f64::ln);
    let mut distances = vec![0.0; known.len()];
    let of_gpu = GPU_PARAMETERS.map(|name| format!("{GPU_PREFIX}{name}"));
    for name in PARAMETERS.into_iter().chain(of_gpu.iter().map(String::as_str)) {
        let Some(own) = logarithm(hardware, name) else { continue };
        let values: Vec<Option<f64>> = known.iter().map(|h| logarithm(h, name)).collect();
        let all: Vec<f64> = values.iter().flatten().copied().chain([own]).collect();
        let mean = average(&all);
        let variance = average(&all.iter().map(|v| (v - mean).powi(2)).collect::<Vec<f64>>());
        for (distance, value) in distances.iter_mut().zip(values) {
            // What is not known is taken to be as far as machines are from each other on average.
            *distance += value.map_or(2.0, |v| if variance > 1e-12 { (v - own).powi(2) / variance } else { 0.0 });
        }
    }
    (0..known.len()).min_by(|&a, &b| distances[a].total_cmp(&distances[b]))
}

/// The mean; 0 of nothing.
pub(crate) fn average(values: &[f64]) -> f64 {
    if values.is_empty() { 0.0 } else { values.iter().sum::<f64>() / values.len() as f64 }
}

#[cfg(test)]
mod tests {
    use super::super::synthetic::Machine;
    use super::*;

    fn ids(list: &[&str]) -> Vec<AlgorithmId> {
        list.iter().map(|id| id.parse().unwrap()).collect()
    }

    #[test]
    fn constants_and_substitutes_stay_within_what_is_available() {
        let available = ids(&["brute@cpu1", "brute@cpu8", "strips@cpu1", "strips@cpu8"]);
        let choose = frozen(64, "strips", &available);
        let load = |objects| Load { objects, ..Load::default() };
        assert_eq!(choose(&load(64)).unwrap().to_string(), "brute@cpu1");
        assert_eq!(choose(&load(65)).unwrap().to_string(), "strips@cpu8");
        assert_eq!(frozen(64, "sweep", &available)(&load(100)), None);
        assert_eq!(closest(&"strips@cpu16".parse().unwrap(), &available).unwrap().to_string(), "strips@cpu8");
        assert_eq!(closest(&"tree@cpu1".parse().unwrap(), &available), None);
    }

    #[test]
    fn the_nearest_machine_is_itself_and_then_its_like() {
        let family: Vec<Hardware> = Machine::family().iter().map(Machine::hardware).collect();
        let known: Vec<&Hardware> = family.iter().collect();
        for (k, hardware) in family.iter().enumerate() {
            assert_eq!(nearest(&known, hardware), Some(k));
        }
        // Four cores and eight lanes are nearer to four cores and four lanes than to sixteen cores.
        assert_eq!(nearest(&[known[4], known[1]], known[6]), Some(1));
        assert_eq!(nearest(&[], known[0]), None);
    }

    #[test]
    fn what_was_not_timed_costs_what_it_did_nearby_or_ten_times_the_best() {
        let profile = Profile { file: String::new(), report: Machine::family()[0].report() };
        let never: Chooser<'_> = Box::new(|_| None);
        assert!(regrets(&profile, &never).iter().all(|r| (r - 9.0).abs() < 1e-9));
        let mut twice = profile.clone();
        let id = twice.report.points[0].timings[0].algorithm.clone();
        let mut again = twice.report.points[0].clone();
        again.timings.remove(0);
        twice.report.points.push(again);
        let always: Chooser<'_> = Box::new(|_| Some(id.clone()));
        // And a size that was visited again counts once.
        assert_eq!(regrets(&twice, &always), regrets(&profile, &always));
        let available = available(&profile);
        let sweep = regrets(&profile, &by_costs(measured_costs(&profile.report).0, &available));
        assert!(average(&sweep) < 0.02, "{}", average(&sweep));
    }
}
