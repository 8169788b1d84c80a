//! The influence of hardware parameters on crossovers, by a model and by the data.

use super::baselines::renamed;
use super::crossovers::MeasuredCrossovers;
use crate::data::{COMPARED, COMPARED_OF_GPUS, Profile, figure};
use crate::fit::measured_costs;
use crate::spread::range;
use rayon::prelude::*;
use sapwise::AlgorithmId;
use sapwise::algorithm::{Backend, BackendClass, Entry};
use sapwise::tuning::{AlgorithmCost, Crossover};
use sapwise_tune::hardware::ParameterId;
use sapwise_tune::model::GPU_PREFIX;
use sapwise_tune::stats::{mean, median};
use sapwise_tune::{Hardware, Model, Parameter};
use std::collections::{BTreeMap, BTreeSet};

/// Octaves for a doubling below which the model says that a parameter does not move a crossover.
const LEAST_OCTAVES: f64 = 0.1;
/// Reports in which a crossover between methods on the CPU must have been measured.
const FEWEST_REPORTS: usize = 3;
/// Fewest hosts for which the data decide about a parameter.
const FEWEST_HOSTS: usize = 3;
/// Ratio of the highest to the lowest value below which a parameter is about the same on all hosts.
const LEAST_RATIO: f64 = 2.0;
/// Correlation of logarithms at or above which the effects of two parameters can't be separated.
const TOGETHER: f64 = 0.9;
/// Follows the name of a method on GPUs.
const ON_GPU: &str = " on a GPU";

/// How far a crossover moves when one hardware parameter doubles.
#[derive(Debug, Clone, PartialEq)]
pub struct Influence {
    /// The two sides, the one that is cheaper with fewer objects first.
    pub crossover: String,
    /// Reports in which it was measured.
    pub reports: usize,
    /// Hosts of these reports.
    pub hosts: usize,
    /// The parameter, by its name in the ranges of a model.
    pub parameter: String,
    /// Octaves for a doubling by the model: the median over reports and scenarios.
    pub by_model: f64,
    /// Octaves for a doubling in the data; `None` if the parameter is the same in all reports.
    pub by_data: Option<Slope>,
    /// Why the hosts can't decide about the parameter; `None` if they can.
    pub undecided: Option<String>,
}

/// A slope over reports.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slope {
    /// From all hosts.
    pub all: f64,
    /// Least and largest with one host left out; `None` if the others don't vary.
    pub without_one: Option<(f64, f64)>,
}

/// A measured crossover.
struct Found<'a> {
    profile: &'a Profile,
    scenario: String,
    log2_objects: f64,
    /// Octaves for a doubling of each parameter by the model, if it predicts the crossover.
    by_model: BTreeMap<String, f64>,
}

/// Returns the influence of each parameter that moves a crossover by the model. Crossovers of most reports come first,
/// in each the parameters that move it farthest.
pub fn influences(profiles: &[Profile], model: &Model) -> Vec<Influence> {
    let found: Vec<Vec<(String, Found<'_>)>> = profiles.par_iter().map(|p| of_profile(p, model)).collect();
    let mut crossovers: BTreeMap<String, Vec<Found<'_>>> = BTreeMap::new();
    found.into_iter().flatten().for_each(|(name, found)| crossovers.entry(name).or_default().push(found));
    let mut all: Vec<Influence> = crossovers.iter().flat_map(|(name, rows)| of_crossover(name, rows)).collect();
    all.sort_by(|a, b| {
        let moved = |i: &Influence| i.by_model.abs();
        (b.reports.cmp(&a.reports)).then(a.crossover.cmp(&b.crossover)).then(moved(b).total_cmp(&moved(a)))
    });
    all
}

/// Returns the crossovers of a profile that matter, each with its name.
fn of_profile<'a>(profile: &'a Profile, model: &Model) -> Vec<(String, Found<'a>)> {
    let Some(base) = costs(profile, model, profile.hardware.clone(), 1) else { return Vec::new() };
    let moved: Vec<_> = parameters()
        .map(|name| {
            // A machine of half the cores may have one: both sides would become the same.
            let is_cores = name == ParameterId::UsableCores;
            let by = |factor: f64| {
                let threads = if is_cores { factor as u32 } else { 1 };
                costs(profile, model, scaled(&profile.hardware, &name, factor)?, threads)
            };
            let down = if is_cores { None } else { by(0.5) };
            (down, by(2.0), name)
        })
        .collect();
    let mut all = Vec::new();
    for own in MeasuredCrossovers::of_scenarios(profile, &measured_costs(profile).0) {
        for crossover in &own.crossovers {
            let Some(name) = name(crossover) else { continue };
            let predicted = own.nearest(crossover, &base).filter(|c| c.crosses).map(|c| c.predicted);
            let octaves = |objects: f64, costs: Option<&Vec<AlgorithmCost>>| {
                let mut at = crossover.clone();
                at.objects = objects;
                Some((own.nearest(&at, costs?)?.predicted / objects).log2())
            };
            let slope = |(down, up, name): &(Option<_>, Option<_>, String)| {
                let [down, up] = [down, up].map(|costs| octaves(predicted?, costs.as_ref()));
                Some((name.clone(), down.map_or(up, |down| Some((up? - down) / 2.0))?))
            };
            let by_model = moved.iter().filter_map(slope).collect();
            let (scenario, log2_objects) = (own.scenario.clone(), crossover.objects.log2());
            all.push((name, Found { profile, scenario, log2_objects, by_model }));
        }
    }
    all
}

/// Predicts the timed algorithms on other hardware. Algorithms on several threads get `threads` times their number.
fn costs(profile: &Profile, model: &Model, hardware: Hardware, threads: u32) -> Option<Vec<AlgorithmCost>> {
    let run = |id: &AlgorithmId| match id.backend() {
        Backend::Cpu(k) if *k > 1 => AlgorithmId::new(id.method(), Backend::Cpu(k * threads)).ok(),
        _ => Some(id.clone()),
    };
    let timed = profile.with_revisions(&profile.available());
    let entries: Vec<Entry> = timed.iter().filter_map(|e| Some(Entry::new(run(&e.id)?, e.revision))).collect();
    let costs = model.predict(&hardware, &entries).ok()?.costs;
    // Under the names that were timed.
    let named = |e: &Entry| {
        let cost = costs.iter().find(|c| run(&e.id).as_ref() == Some(&c.algorithm))?;
        Some(renamed(cost, &e.id))
    };
    Some(timed.iter().filter_map(named).collect())
}

/// The parameters that models read.
fn parameters() -> impl Iterator<Item = String> {
    let of_machine = COMPARED.into_iter().filter(|id| id.quantity().read_by_model).map(|id| id.to_string());
    of_machine.chain(COMPARED_OF_GPUS.into_iter().map(|id| format!("{GPU_PREFIX}{id}")))
}

/// Returns hardware with one parameter times a factor; `None` if it is missing. More cores scale as well as before.
fn scaled(hardware: &Hardware, name: &str, factor: f64) -> Option<Hardware> {
    let mut hardware = hardware.clone();
    let (list, name) = match name.strip_prefix(GPU_PREFIX) {
        Some(name) => (hardware.gpus.iter_mut().flat_map(|g| &mut g.parameters).collect::<Vec<_>>(), name),
        None => (hardware.parameters.iter_mut().collect(), name),
    };
    let with_cores = |p: &Parameter| name == ParameterId::UsableCores && p.name == ParameterId::ScalingAllThreadsRatio;
    let mut any = false;
    for p in list.into_iter().filter(|p| p.name == name || with_cores(p)) {
        p.value = p.value.map(|value| value * factor);
        any |= p.value.is_some();
    }
    any.then_some(hardware)
}

/// Names both sides by method and processor. `None` if they differ in the number of threads or GPUs alone.
fn name(crossover: &Crossover) -> Option<String> {
    let side = |id: &AlgorithmId| match id.backend().class() {
        BackendClass::Gpu => format!("{}{ON_GPU}", id.method()),
        BackendClass::Cpu if id.threads() > 1 => format!("{} on threads", id.method()),
        BackendClass::Cpu => id.method().to_owned(),
    };
    let [below, above] = [&crossover.below, &crossover.above].map(side);
    (below != above).then(|| format!("{below} → {above}"))
}

/// Returns the influences on a crossover of enough reports.
fn of_crossover(name: &str, rows: &[Found<'_>]) -> Vec<Influence> {
    let files: BTreeSet<&str> = rows.iter().map(|r| &r.profile.file[..]).collect();
    let hosts: BTreeSet<&str> = rows.iter().map(|r| r.profile.machine()).collect();
    if files.len() < FEWEST_REPORTS && !name.contains(ON_GPU) {
        return Vec::new();
    }
    let of = |parameter: String| {
        let slopes: Vec<f64> = rows.iter().filter_map(|r| r.by_model.get(&parameter).copied()).collect();
        let by_model = median(&slopes).filter(|octaves| octaves.abs() >= LEAST_OCTAVES)?;
        let by_data = slope(rows, &parameter, None).map(|all| {
            let without: Vec<f64> = hosts.iter().filter_map(|host| slope(rows, &parameter, Some(host))).collect();
            Slope { all, without_one: range(&without).filter(|_| hosts.len() > 1).map(<(f64, f64)>::from) }
        });
        let undecided = undecided(rows, &parameter, hosts.len(), by_data);
        let (crossover, reports, hosts) = (name.to_owned(), files.len(), hosts.len());
        Some(Influence { crossover, reports, hosts, parameter, by_model, by_data, undecided })
    };
    parameters().filter_map(of).collect()
}

/// Returns the logarithm of a parameter to base two.
fn log2(profile: &Profile, parameter: &str) -> Option<f64> {
    figure(&profile.hardware, parameter).filter(|v| *v > 0.0).map(f64::log2)
}

/// Returns the octaves for a doubling by least squares, each scenario with a constant of its own, without one host.
/// `None` if the parameter does not vary within scenarios.
fn slope(rows: &[Found<'_>], parameter: &str, without: Option<&str>) -> Option<f64> {
    let mut scenarios: BTreeMap<&str, Vec<(f64, f64)>> = BTreeMap::new();
    for row in rows.iter().filter(|r| without.is_none_or(|host| r.profile.machine() != host)) {
        let at = (log2(row.profile, parameter)?, row.log2_objects);
        scenarios.entry(&row.scenario).or_default().push(at);
    }
    let (mut products, mut squares) = (0.0, 0.0);
    for points in scenarios.values() {
        let middle = |of: fn(&(f64, f64)) -> f64| mean(&points.iter().map(of).collect::<Vec<f64>>());
        let (x, y) = (middle(|p| p.0), middle(|p| p.1));
        products += points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>();
        squares += points.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>();
    }
    (squares > 1e-6).then(|| products / squares)
}

/// Says why the hosts can't decide about a parameter, if they can't.
fn undecided(rows: &[Found<'_>], parameter: &str, hosts: usize, slope: Option<Slope>) -> Option<String> {
    if hosts < FEWEST_HOSTS {
        return Some(crate::text::count(hosts, "host"));
    }
    let mut profiles: Vec<&Profile> = rows.iter().map(|r| r.profile).collect();
    profiles.dedup_by_key(|p| &p.file);
    let values = |name: &str| profiles.iter().map(|p| log2(p, name)).collect::<Option<Vec<f64>>>();
    let ratio = |values: &[f64]| range(values).map_or(0.0, |[low, high]| (high - low).exp2());
    let Some(own) = values(parameter) else { return Some("not measured everywhere".to_owned()) };
    if ratio(&own) < LEAST_RATIO {
        return Some(format!("varies by {:.2}×", ratio(&own)));
    }
    let others = parameters().filter(|other| other != parameter);
    let other = others
        .filter_map(|other| Some((correlation(&own, &values(&other).filter(|v| ratio(v) >= LEAST_RATIO)?), other)))
        .max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
    if let Some((r, other)) = other.filter(|(r, _)| r.abs() >= TOGETHER) {
        return Some(format!("goes with {other} (r = {r:.2})"));
    }
    let rests_on_one = slope.and_then(|s| s.without_one).is_none_or(|(low, high)| low.signum() != high.signum());
    rests_on_one.then(|| "sign rests on one host".to_owned())
}

/// Returns the correlation of two lists; 0 if one does not vary.
fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let (x, y) = (mean(a), mean(b));
    let sum = |of: &dyn Fn(f64, f64) -> f64| a.iter().zip(b).map(|(a, b)| of(a - x, b - y)).sum::<f64>();
    let r = sum(&|a, b| a * b) / (sum(&|a, _| a * a) * sum(&|_, b| b * b)).sqrt();
    if r.is_finite() { r } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::{Designs, model};
    use crate::synthetic::{Machine, profiles};

    /// Crossovers of two scenarios that go down by 0.7 octaves when the lanes double.
    fn rows(profiles: &[Profile]) -> Vec<Found<'_>> {
        let row = |profile, scenario: &str, constant: f64| Found {
            profile,
            scenario: scenario.to_owned(),
            log2_objects: constant - 0.7 * log2(profile, "simd_lanes").unwrap(),
            by_model: BTreeMap::from(["simd_lanes", "clock_measured_ghz"].map(|name| (name.to_owned(), -0.7))),
        };
        // The second scenario on some machines only, and far above.
        let both = profiles.iter().enumerate();
        both.flat_map(|(k, p)| [Some(row(p, "a", 9.0)), (k > 3).then(|| row(p, "b", 15.0))]).flatten().collect()
    }

    #[test]
    fn a_slope_is_found_whatever_the_scenario_and_the_host() {
        let profiles = profiles(Machine::family());
        let found = of_crossover("a → b", &rows(&profiles));
        let lanes = found.iter().find(|i| i.parameter == "simd_lanes").unwrap();
        assert_eq!((lanes.reports, lanes.hosts, lanes.by_model, &lanes.undecided), (7, 7, -0.7, &None));
        let Slope { all, without_one } = lanes.by_data.unwrap();
        let (least, most) = without_one.unwrap();
        assert!([all, least, most].iter().all(|slope| (slope + 0.7).abs() < 1e-9), "{lanes:?}");
        // The clock has no slope of its own: its sign depends on the hosts.
        let clock = found.iter().find(|i| i.parameter == "clock_measured_ghz").unwrap();
        assert_eq!(clock.undecided.as_deref(), Some("sign rests on one host"), "{clock:?}");
        assert!(of_crossover("a → b", &rows(&profiles[..2])).is_empty());
    }

    #[test]
    fn what_the_hosts_can_not_decide_is_said() {
        let profiles = profiles(Machine::family());
        let of = |profiles: &[Profile], parameter: &str| {
            let rows = rows(profiles);
            let (all, hosts) = (slope(&rows, parameter, None).unwrap_or_default(), profiles.len());
            undecided(&rows, parameter, hosts, Some(Slope { all, without_one: Some((all, all)) })).unwrap_or_default()
        };
        assert_eq!(of(&profiles, "simd_lanes"), "");
        // The test data scale alike on all machines.
        assert!(of(&profiles, "usable_cores").starts_with("goes with scaling_all_threads_ratio (r = 1.00)"));
        assert_eq!(of(&profiles[..2], "simd_lanes"), "2 hosts");
        assert_eq!(of(&[&profiles[..1], &profiles[5..]].concat(), "clock_measured_ghz"), "varies by 1.38×");
        assert_eq!(of(&profiles, "gpu/dispatch_ns"), "not measured everywhere");
    }

    #[test]
    fn a_model_moves_the_crossovers_as_its_terms_say() {
        let profiles = profiles(Machine::family());
        let model = model(&Designs::new(&profiles), &vec![true; profiles.len()], "test").unwrap().0;
        let found = influences(&profiles, &model);
        assert!(found.windows(2).all(|w| w[0].reports >= w[1].reports), "{found:?}");
        let of = |parameter: &str, crossover: &str| {
            found.iter().find(|i| i.crossover == crossover && i.parameter == parameter)
        };
        // Brute force tests all pairs with vectors: wider ones keep it ahead for longer, in the data too.
        let lanes = of("simd_lanes", "brute on threads → sap on threads").unwrap();
        assert!(lanes.by_model > 0.5 && (lanes.by_model - lanes.by_data.unwrap().all).abs() < 0.1, "{lanes:?}");
        // Both sides are cycles.
        assert_eq!(of("clock_measured_ghz", "brute on threads → sap on threads"), None);
        // Helpers that are late pay later, and more of them as well.
        let late = of("fork_join_cold_ns", "brute → brute on threads").unwrap();
        assert!(late.by_model > 0.2 && (late.by_model - late.by_data.unwrap().all).abs() < 0.2, "{late:?}");
        let cores = of("usable_cores", "brute → brute on threads").unwrap();
        assert!((cores.by_model - cores.by_data.unwrap().all).abs() < 0.1, "{cores:?}");
    }
}
