//! From reports to what can be trained on: sound timings of the newest revisions.

use sapwise::report::{Label, Point, Report, Timing};
use sapwise::{AlgorithmId, BackendClass, Load};
use std::collections::BTreeMap;

use super::Evidence;
use crate::sweep::median;

/// A report of which only usable timings are left.
#[derive(Debug, Clone)]
pub(crate) struct Profile {
    /// File name without folders.
    pub(crate) file: String,
    /// The report.
    pub(crate) report: Report,
}

/// The median time of one algorithm at one point.
#[derive(Debug, Clone)]
pub(crate) struct Row {
    /// Position of the profile in the list that the rows were made from.
    pub(crate) profile: usize,
    /// The algorithm.
    pub(crate) algorithm: AlgorithmId,
    /// The load of the point.
    pub(crate) load: Load,
    /// Median over the frames.
    pub(crate) ns: f64,
    /// The time is a lower bound: the algorithm had left the race before this point.
    pub(crate) floor: bool,
}

/// A median of fewer samples says nothing about disturbed frames.
const FEWEST_SAMPLES: usize = 3;
/// An algorithm that left the race is taken to be at least this many times slower than the best at larger sizes, or as many
/// times as it last was.
const LEFT_BEHIND: f64 = 2.0;

/// The reports that can be trained on, and what was left out and why.
pub(crate) fn usable(reports: &[(String, Report)], evidence: Evidence) -> (Vec<Profile>, Vec<String>) {
    let mut notes = Vec::new();
    let mut kept: Vec<(&String, &Report)> = Vec::new();
    for (file, report) in reports {
        let refusal = refusal(report, evidence).or_else(|| {
            let twin = kept.iter().find(|(_, r)| r.hardware == report.hardware && r.points == report.points)?;
            Some(format!("holds the same measurement as {}", twin.0))
        });
        match refusal {
            Some(why) => notes.push(format!("{file} is left out: it {why}")),
            None => kept.push((file, report)),
        }
    }
    let newest = newest_revisions(&kept);
    let newest_of = |id: &AlgorithmId| newest.get(&key(id)).copied().unwrap_or(0);
    let mut profiles = Vec::new();
    for (file, report) in kept {
        let sound = sound(report, &newest);
        for stale in report.algorithms.iter().filter(|t| t.revision < newest_of(&t.id)) {
            let newest = newest_of(&stale.id);
            notes.push(format!("{file}: {} is left out, its revision {} is older than {newest}", stale.id, stale.revision));
        }
        if sound.points.is_empty() {
            notes.push(format!("{file} is left out: no point has {FEWEST_SAMPLES} samples of a current algorithm"));
        } else {
            profiles.push(Profile { file: file.clone(), report: sound });
        }
    }
    (profiles, notes)
}

fn refusal(report: &Report, evidence: Evidence) -> Option<String> {
    match (report.label, evidence) {
        (Label::Published, _) => return Some("holds published parameters, without timings".to_owned()),
        (Label::Simulated, Evidence::Real) => {
            let why =
                "is simulated, which is no evidence of how fast a machine is; `train --simulated` takes such reports alone";
            return Some(why.to_owned());
        }
        (Label::Simulated, Evidence::Simulated) => {}
        (_, Evidence::Simulated) => {
            return Some("is of a real machine, and with --simulated only simulated ones are trained on".to_owned());
        }
        (_, Evidence::Real) => {}
    }
    if !report.provenance.optimised {
        return Some(
            "was timed by an unoptimised build; measure again with one built by `cargo build --release`".to_owned(),
        );
    }
    if report.points.is_empty() {
        return Some("holds no timings; measure again without `--hardware-only`".to_owned());
    }
    // Two threads of which one waits for its turn on a core take 4 ms where alone they take 50 us. No parameter of the hardware tells
    // that, and a model that has seen it predicts it of others.
    if report.label == Label::RealContended && report.provenance.threads.is_none() {
        return Some(
            "was measured while other programs ran on the same cores; measure again when the machine is idle, or with \
             --contended and --threads, which leave cores to both"
                .to_owned(),
        );
    }
    None
}

/// What shares a revision: a method on one class of processor.
type Key = (BackendClass, String);

fn key(id: &AlgorithmId) -> Key {
    (id.backend().class(), id.method().to_owned())
}

/// The newest revision of each method on each class of processor.
fn newest_revisions(reports: &[(&String, &Report)]) -> BTreeMap<Key, u32> {
    let mut newest = BTreeMap::new();
    for timed in reports.iter().flat_map(|(_, r)| &r.algorithms) {
        let known = newest.entry(key(&timed.id)).or_insert(timed.revision);
        *known = timed.revision.max(*known);
    }
    newest
}

/// The report without stale algorithms, timings with an error or too few samples, and points that are empty then.
fn sound(report: &Report, newest: &BTreeMap<Key, u32>) -> Report {
    let mut sound = report.clone();
    sound.algorithms.retain(|t| newest.get(&key(&t.id)).is_none_or(|&n| t.revision == n));
    let known = |id: &AlgorithmId| sound.algorithms.iter().any(|t| t.id == *id);
    for point in &mut sound.points {
        point.timings.retain(|t| is_sound(t) && known(&t.algorithm));
    }
    sound.points.retain(|p| !p.timings.is_empty() && p.load.objects > 0);
    sound
}

fn is_sound(timing: &Timing) -> bool {
    timing.error.is_none() && timing.samples_ns.len() >= FEWEST_SAMPLES
}

/// The medians of a point, for its algorithms with sound timings.
pub(crate) fn medians(point: &Point) -> Vec<(&AlgorithmId, f64)> {
    let of = |t: &Timing| median(&t.samples_ns).unwrap_or(0.0);
    point.timings.iter().filter(|t| is_sound(t)).map(|t| (&t.algorithm, of(t))).collect()
}

/// The cheapest of medians; `None` of none.
pub(crate) fn best(medians: &[(&AlgorithmId, f64)]) -> Option<f64> {
    medians.iter().map(|m| m.1).min_by(f64::total_cmp)
}

/// One row for each algorithm and point, and a lower bound for each point of a scenario beyond the last at which an algorithm
/// was timed. `profile` is noted in the rows.
pub(crate) fn rows(report: &Report, profile: usize) -> Vec<Row> {
    let mut rows = Vec::new();
    let timed: Vec<(&Point, Vec<(&AlgorithmId, f64)>)> = report.points.iter().map(|p| (p, medians(p))).collect();
    for algorithm in report.algorithms.iter().map(|t| &t.id) {
        // For each scenario the sizes at which it was timed, and how many times slower than the best it was there.
        let mut ratios: BTreeMap<&str, BTreeMap<u32, f64>> = BTreeMap::new();
        let mut row = |load: Load, ns: f64, floor: bool| {
            rows.push(Row { profile, algorithm: algorithm.clone(), load, ns, floor });
        };
        for (point, medians) in &timed {
            let (Some(&(_, ns)), Some(best)) = (medians.iter().find(|m| m.0 == algorithm), best(medians)) else { continue };
            row(point.load, ns, false);
            ratios.entry(&point.scenario).or_default().insert(point.load.objects, ns / best);
        }
        let on_gpu = algorithm.backend().class() == BackendClass::Gpu;
        // A GPU has a large fixed cost: it starts far behind and gains. One that left the race while it gained, for want of
        // time, may be ahead beyond.
        ratios.retain(|_, course| !(on_gpu && gains(course)));
        let last: BTreeMap<&str, (u32, f64)> =
            ratios.iter().filter_map(|(s, course)| course.last_key_value().map(|(&n, &ratio)| (*s, (n, ratio)))).collect();
        for (point, medians) in &timed {
            let Some(&(objects, behind)) = last.get(point.scenario.as_str()) else { continue };
            if let Some(best) = best(medians).filter(|_| point.load.objects > objects) {
                row(point.load, best * behind.max(LEFT_BEHIND), true);
            }
        }
    }
    rows
}

/// Whether an algorithm came nearer to the best from the last size but one to the last.
fn gains(course: &BTreeMap<u32, f64>) -> bool {
    let mut from_the_last = course.values().rev();
    matches!((from_the_last.next(), from_the_last.next()), (Some(last), Some(before)) if last < before)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::synthetic::Machine;

    fn named(report: Report) -> (String, Report) {
        ("a.json".to_owned(), report)
    }

    #[test]
    fn simulated_published_unoptimised_empty_and_repeated_reports_are_told() {
        let good = Machine::family()[0].report();
        let [mut simulated, mut published, mut debug, mut empty] = [(); 4].map(|()| good.clone());
        simulated.label = Label::Simulated;
        published.label = Label::Published;
        debug.provenance.optimised = false;
        empty.points.clear();
        let (profiles, notes) = usable(&[simulated, published, debug, empty, good.clone(), good].map(named), Evidence::Real);
        assert_eq!(profiles.len(), 1);
        let told = ["simulated", "published", "unoptimised", "--hardware-only", "the same measurement"];
        assert!(told.iter().all(|t| notes.iter().any(|n| n.contains(t))) && notes.len() == 5, "{notes:?}");
    }

    #[test]
    fn real_and_simulated_reports_are_never_mixed() {
        let [real, mut simulated] = [0, 1].map(|k| Machine::family()[k].report());
        simulated.label = Label::Simulated;
        let both = [named(real), ("b.json".to_owned(), simulated)];
        for (evidence, kept, told) in [(Evidence::Real, 0, "b.json"), (Evidence::Simulated, 1, "a.json")] {
            let (profiles, notes) = usable(&both, evidence);
            assert!(profiles.len() == 1 && profiles[0].file == both[kept].0, "{evidence:?}");
            assert!(notes.len() == 1 && notes[0].starts_with(told) && notes[0].contains("--simulated"), "{notes:?}");
        }
    }

    #[test]
    fn contended_reports_are_trained_on_where_the_others_had_cores_of_their_own() {
        let mut contended = Machine::family()[0].report();
        contended.label = Label::RealContended;
        let (profiles, notes) = usable(&[named(contended.clone())], Evidence::Real);
        assert!(profiles.is_empty() && notes[0].contains("on the same cores"), "{notes:?}");
        contended.provenance.threads = Some(1);
        assert_eq!(usable(&[named(contended)], Evidence::Real).0.len(), 1);
    }

    #[test]
    fn old_revisions_errors_and_few_samples_are_dropped() {
        let [mut old, new] = [0, 1].map(|k| Machine::family()[k].report());
        let mut newer = new.clone();
        newer.algorithms.iter_mut().filter(|t| t.id.method() == "strips").for_each(|t| t.revision += 1);
        old.points[0].timings[0].error = Some("out of memory".to_owned());
        old.points[0].timings[1].samples_ns.truncate(2);
        let before = old.points[0].timings.len();
        let strips = old.points[0].timings.iter().filter(|t| t.algorithm.method() == "strips").count();
        let (profiles, notes) = usable(&[named(old), named(newer)], Evidence::Real);
        assert!(profiles[0].report.algorithms.iter().all(|t| t.id.method() != "strips"));
        let stale = profiles[1].report.algorithms.iter().filter(|t| t.id.method() == "strips").count();
        assert!(stale > 0 && notes.iter().all(|n| n.contains("revision")), "{notes:?}");
        assert_eq!(profiles[0].report.points[0].timings.len(), before - 2 - strips);
    }

    #[test]
    fn a_gpu_that_gained_when_it_left_has_no_floor_beyond() {
        let mut report = Machine::family_with_gpus()[1].report();
        let on_gpu = |id: &AlgorithmId| id.to_string() == "strips@gpu0";
        let left = |report: &Report| rows(report, 0).iter().any(|r| on_gpu(&r.algorithm) && r.floor);
        assert!(!left(&report));
        // For want of time it leaves at 500 objects.
        for point in report.points.iter_mut().filter(|p| p.load.objects > 500) {
            point.timings.retain(|t| !on_gpu(&t.algorithm));
        }
        assert!(!left(&report));
        // And the same when it fell behind before.
        for point in report.points.iter_mut().filter(|p| (300..=500).contains(&p.load.objects)) {
            let own = point.timings.iter_mut().find(|t| on_gpu(&t.algorithm)).unwrap();
            own.samples_ns.iter_mut().for_each(|ns| *ns *= 10);
        }
        assert!(left(&report));
    }

    #[test]
    fn whoever_left_the_race_has_floors_beyond() {
        let report = Machine::family()[0].report();
        let rows = rows(&report, 3);
        // Half of the rows are of the other scenario, in which it left the race at another size.
        let brute = rows.iter().filter(|r| r.algorithm.to_string() == "brute@cpu1");
        let brute: Vec<&Row> = brute.filter(|r| r.load.pairs == f64::from(r.load.objects)).collect();
        let largest = brute.iter().filter(|r| !r.floor).map(|r| r.load.objects).max().unwrap();
        assert!(brute.iter().any(|r| r.floor) && brute.iter().all(|r| r.floor == (r.load.objects > largest)));
        assert!(rows.iter().all(|r| r.profile == 3 && r.ns > 0.0));
    }
}
