//! Adaptive sampling: the sizes at which the choice is in doubt and one more visit is worth its time.
//!
//! What a wrong choice costs at a size is known up to the error of the medians there. The errors that matter are not those of the
//! frames of one visit, which lie close together, but those from visit to visit: how fast a machine wakes threads, or what its
//! neighbours do to its memory, stays the same for some milliseconds and then changes by half. They show where a median does not lie
//! on a line with those of the neighbouring sizes.

use super::request::Visit;
use sapwise::AlgorithmId;
use sapwise::measure::Watch;
use sapwise_lab::report::Point;
use sapwise_lab::sweep::{WARM_UP, median};
use std::collections::BTreeMap;
use std::time::Duration;

/// Error of the logarithm of a median from visit to visit, at least.
const LEAST_ERROR: f64 = 0.02;
/// The same where no neighbours tell.
const USUAL_ERROR: f64 = 0.05;
/// Two neighbouring sizes with different winners get one between them where they are further apart than this factor.
const NARROW: f64 = 1.2;
/// Who is slower by less than this factor takes part in a visit.
const CONTENDER: f64 = 1.25;
/// So does everyone whose lead over the fastest may be one of errors: within this many standard errors.
const POSSIBLE: f64 = 3.0;
/// The start of a scene, beside the window that tells foreign load.
const START: Duration = Duration::from_millis(50);
/// Frames with samples for which a visit to a large scene has time.
const FRAMES: f64 = 12.0;
/// Time to move and check one object in one frame, all that is not an algorithm.
const NS_PER_OBJECT: f64 = 60.0;

/// The visits of one round, by scenario, each list ascending by size: those that promise most for their time, at most one for each
/// size, within `time`.
pub(super) fn visits(points: &[Point], time: Duration) -> BTreeMap<String, Vec<Visit>> {
    let mut candidates: Vec<Candidate> =
        scenarios(points).into_iter().flat_map(|(s, sizes)| candidates(s, &sizes)).collect();
    candidates.retain(|p| p.worth > 0.0 && p.algorithms.len() > 1);
    // Asks the system, so it is done once and not for each candidate.
    let shortest = (Watch::begin().shortest() + START).as_secs_f64();
    candidates.iter_mut().for_each(|p| p.seconds = p.seconds.max(shortest));
    candidates.sort_by(|a, b| (b.worth / b.seconds).total_cmp(&(a.worth / a.seconds)));
    let mut left = time.as_secs_f64();
    let mut chosen: BTreeMap<String, Vec<Visit>> = BTreeMap::new();
    for candidate in candidates {
        if candidate.seconds <= left {
            left -= candidate.seconds;
            let Candidate { scenario, objects, seconds, algorithms, .. } = candidate;
            chosen.entry(scenario.to_owned()).or_default().push(Visit { objects, seconds, algorithms });
        }
    }
    chosen.values_mut().for_each(|visits| visits.sort_by_key(|v| v.objects));
    chosen
}

/// A size of a scenario that could be visited.
struct Candidate<'a> {
    scenario: &'a str,
    objects: u32,
    /// What the visit takes off the expected regret of the choice.
    worth: f64,
    /// What its frames take.
    seconds: f64,
    algorithms: Vec<AlgorithmId>,
}

/// What is known of a size: for each algorithm the mean over the visits of the logarithm of its median, and their number.
type Size = BTreeMap<AlgorithmId, (f64, f64)>;

fn scenarios(points: &[Point]) -> BTreeMap<&str, BTreeMap<u32, Size>> {
    let mut scenarios: BTreeMap<&str, BTreeMap<u32, Size>> = BTreeMap::new();
    for point in points {
        let size = scenarios.entry(&point.scenario).or_default().entry(point.load.objects).or_default();
        for timing in &point.timings {
            let Some(ns) = median(&timing.samples_ns) else { continue };
            let (mean, visits) = size.entry(timing.algorithm.clone()).or_default();
            *visits += 1.0;
            *mean += (ns.ln() - *mean) / *visits;
        }
    }
    scenarios
}

fn candidates<'a>(scenario: &'a str, sizes: &BTreeMap<u32, Size>) -> Vec<Candidate<'a>> {
    let list: Vec<(u32, &Size)> = sizes.iter().map(|(&n, size)| (n, size)).collect();
    let mut candidates = Vec::new();
    for (k, &(objects, size)) in list.iter().enumerate() {
        let neighbours = k.checked_sub(1).and_then(|b| list.get(b)).zip(list.get(k + 1));
        let rivals: Vec<Rival> = size
            .iter()
            .map(|(id, &(log, visits))| {
                let off = neighbours.and_then(|(b, a)| Some(log - between(*b, *a, objects, id)?));
                // A line through two neighbours has an error of its own: half the variance of one.
                let error = off.map_or(USUAL_ERROR, |off| (off.abs() / 1.5_f64.sqrt()).max(LEAST_ERROR));
                Rival { id, log, error, visits }
            })
            .collect();
        candidates.extend(candidate(scenario, objects, &rivals));
    }
    for pair in list.windows(2) {
        let [(low, below), (high, above)] = [pair[0], pair[1]];
        if leader(below) == leader(above) || f64::from(high) < NARROW * f64::from(low) {
            continue;
        }
        let objects = (f64::from(low) * f64::from(high)).sqrt().round() as u32;
        let known = below.keys().filter_map(|id| Some((id, between((low, below), (high, above), objects, id)?)));
        let rivals: Vec<Rival> = known.map(|(id, log)| Rival { id, log, error: USUAL_ERROR, visits: 1.0 }).collect();
        candidates.extend(candidate(scenario, objects, &rivals));
    }
    candidates
}

/// What the line through two sizes says of an algorithm at a third.
fn between(below: (u32, &Size), above: (u32, &Size), objects: u32, id: &AlgorithmId) -> Option<f64> {
    let ((low, below), (high, above)) = (below, above);
    let (from, to) = (below.get(id)?.0, above.get(id)?.0);
    let share = (f64::from(objects) / f64::from(low)).ln() / (f64::from(high) / f64::from(low)).ln();
    Some(from + (to - from) * share)
}

fn leader(size: &Size) -> Option<&AlgorithmId> {
    size.iter().min_by(|a, b| a.1.0.total_cmp(&b.1.0)).map(|(id, _)| id)
}

/// An algorithm at a candidate.
struct Rival<'a> {
    id: &'a AlgorithmId,
    log: f64,
    /// Standard error of `log` in one visit.
    error: f64,
    visits: f64,
}

fn candidate<'a>(scenario: &'a str, objects: u32, rivals: &[Rival]) -> Option<Candidate<'a>> {
    let best = rivals.iter().min_by(|a, b| a.log.total_cmp(&b.log))?;
    let mut candidate = Candidate { scenario, objects, worth: 0.0, seconds: 0.0, algorithms: Vec::new() };
    let each_frame = NS_PER_OBJECT * f64::from(objects);
    let mut ns = each_frame * (FRAMES + WARM_UP as f64);
    for rival in rivals {
        let gap = rival.log - best.log;
        let error = |more: f64| {
            let variance = |r: &Rival| r.error * r.error / (r.visits + more);
            (variance(rival) + variance(best)).sqrt()
        };
        if gap > CONTENDER.ln().max(POSSIBLE * error(0.0)) {
            continue;
        }
        candidate.algorithms.push(rival.id.clone());
        // Not known here is which algorithms are incremental and need a warm-up. Every one gets time for it: a visit that ends early costs nothing.
        ns += rival.log.exp() * (FRAMES + WARM_UP as f64);
        if gap > 0.0 {
            candidate.worth =
                f64::max(candidate.worth, expected_loss(gap, error(0.0)) - expected_loss(gap, error(1.0)));
        }
    }
    candidate.seconds = ns / 1e9;
    Some(candidate)
}

/// What is lost on average by choosing the one that seems faster by `gap`, when the gap has a standard error: the unit normal loss,
/// here within a factor of 1.5 of it.
fn expected_loss(gap: f64, error: f64) -> f64 {
    let z = gap / error;
    error * (-z * z / 2.0).exp() / (std::f64::consts::TAU.sqrt() * (1.0 + z * z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use sapwise::Load;
    use sapwise_lab::report::Timing;

    fn point(scenario: &str, objects: u32, ns: &[(&str, f64)]) -> Point {
        let timing = |&(id, ns): &(&str, f64)| Timing {
            algorithm: format!("{id}@cpu1").parse().unwrap(),
            samples_ns: vec![ns as u64; 5],
            error: None,
        };
        Point {
            scenario: scenario.to_owned(),
            load: Load::of_objects(objects),
            pairs: 0,
            fingerprint: String::new(),
            foreign_load: None,
            spoiled: 0,
            core_to_core_ns: None,
            timings: ns.iter().map(timing).collect(),
        }
    }

    /// Costs n^2 / 10 and 30 n, which cross at 300, and one that is far behind.
    fn course(scenario: &str, sizes: &[u32]) -> Vec<Point> {
        let costs = |n: u32| {
            [
                ("brute", f64::from(n) * f64::from(n) / 10.0),
                ("grid-sap", 30.0 * f64::from(n)),
                ("sap", 900.0 * f64::from(n)),
            ]
        };
        sizes.iter().map(|&n| point(scenario, n, &costs(n))).collect()
    }

    #[test]
    fn visits_go_between_the_winners_and_leave_out_who_is_far_behind() {
        let points = course("uniform", &[10, 32, 100, 250, 420, 1000, 3162]);
        let visits = visits(&points, Duration::from_secs(1));
        let visits = &visits["uniform"];
        assert!(visits.iter().any(|v| v.objects == 324), "{visits:?}");
        for visit in visits {
            assert!((100..=1000).contains(&visit.objects), "{visits:?}");
            let methods: Vec<&str> = visit.algorithms.iter().map(AlgorithmId::method).collect();
            assert_eq!(methods, ["brute", "grid-sap"]);
        }
    }

    #[test]
    fn a_median_off_the_line_of_its_neighbours_is_visited_again() {
        let sizes = [1000, 2000, 4000, 8000, 16_000];
        assert!(visits(&course("slab", &sizes), Duration::from_secs(9)).is_empty());
        let mut points = course("slab", &sizes);
        let disturbed = points[2].timings.iter_mut().find(|t| t.algorithm.method() == "grid-sap").unwrap();
        disturbed.samples_ns.fill(30 * 4000 * 12);
        let visits = visits(&points, Duration::from_secs(9));
        assert!(visits["slab"].iter().any(|v| v.objects == 4000 && v.algorithms.len() >= 2), "{visits:?}");
    }

    #[test]
    fn the_time_is_kept_and_repeated_visits_are_worth_less() {
        let points = course("uniform", &[10, 100, 290, 310, 1000]);
        let total = |points: &[Point], seconds| {
            let visits = visits(points, Duration::from_secs_f64(seconds));
            visits.values().flatten().map(|v| v.seconds).sum::<f64>()
        };
        assert_eq!(total(&points, 0.1), 0.0);
        assert!((0.25..=0.4).contains(&total(&points, 0.4)));
        let worth = |points: &[Point]| {
            let scenarios = scenarios(points);
            let candidates = candidates("uniform", &scenarios["uniform"]);
            candidates.iter().find(|p| p.objects == 290).map(|p| p.worth).unwrap()
        };
        let twice: Vec<Point> = points.iter().chain(&points).cloned().collect();
        assert!(worth(&twice) < 0.6 * worth(&points) && worth(&twice) > 0.0);
    }
}
