//! The sizes that a round of a sweep visits again: those at which the best two algorithms take similar times.

use super::request::Visit;
use sapwise::AlgorithmId;
use sapwise_lab::report::Point;
use sapwise_lab::sweep::{WARM_UP, median};
use sapwise_tune::measure::Watch;
use std::collections::BTreeMap;
use std::time::Duration;

/// An algorithm within this factor of the best takes part in a visit.
const CLOSE: f64 = 1.25;
/// Neighbouring sizes further apart than this factor get a size between them when different algorithms are best
/// there.
const NARROW: f64 = 1.2;
/// Time to start a scene.
const START: Duration = Duration::from_millis(50);
/// Frames with samples that a visit to a large scene has time for.
const FRAMES: f64 = 12.0;
/// Time to move and verify one object in one frame.
const NS_PER_OBJECT: f64 = 60.0;

/// The results at a size: number of visits, and the mean of each algorithm's medians over them, in nanoseconds.
#[derive(Default)]
struct Size {
    visits: u32,
    ns: BTreeMap<AlgorithmId, f64>,
}

impl Size {
    fn add(&mut self, point: &Point) {
        self.visits += 1;
        for timing in &point.timings {
            if let Some(ns) = median(&timing.samples_ns) {
                let mean = self.ns.entry(timing.algorithm.clone()).or_insert(ns);
                *mean += (ns - *mean) / f64::from(self.visits);
            }
        }
    }

    fn best(&self) -> Option<&AlgorithmId> {
        self.ns.iter().min_by(|a, b| a.1.total_cmp(b.1)).map(|(id, _)| id)
    }

    /// Returns a visit of the algorithms that are close to the best; `None` when the best is alone. It takes at least
    /// `shortest` seconds.
    fn visit(&self, objects: u32, shortest: f64) -> Option<Visit> {
        let limit = CLOSE * self.ns.get(self.best()?)?;
        let close: BTreeMap<&AlgorithmId, f64> =
            self.ns.iter().map(|(id, ns)| (id, *ns)).filter(|(_, ns)| *ns <= limit).collect();
        // Any of them may be incremental and need its warm-up. A visit that ends early costs nothing.
        let frame_ns = NS_PER_OBJECT * f64::from(objects) + close.values().sum::<f64>();
        let seconds = (frame_ns * (FRAMES + WARM_UP as f64) / 1e9).max(shortest);
        let algorithms: Vec<AlgorithmId> = close.into_keys().cloned().collect();
        (algorithms.len() > 1).then_some(Visit { objects, seconds, algorithms })
    }
}

/// Returns the visits of one round within `time`, by scenario, ascending by size. Sizes with the fewest earlier visits
/// are chosen first, then those that take the least time.
pub(super) fn visits(points: &[Point], time: Duration) -> BTreeMap<String, Vec<Visit>> {
    let mut scenarios: BTreeMap<&str, BTreeMap<u32, Size>> = BTreeMap::new();
    for point in points {
        scenarios.entry(&point.scenario).or_default().entry(point.load.objects).or_default().add(point);
    }
    let shortest = (Watch::begin().shortest() + START).as_secs_f64();
    let mut candidates: Vec<(u32, &str, Visit)> = Vec::new();
    for (&scenario, sizes) in &scenarios {
        let known = sizes.iter().filter_map(|(&n, size)| Some((size.visits, scenario, size.visit(n, shortest)?)));
        candidates.extend(known);
        let neighbours = sizes.iter().zip(sizes.iter().skip(1));
        candidates.extend(neighbours.filter_map(|(a, b)| Some((0, scenario, between(a, b, shortest)?))));
    }
    candidates.sort_by(|a, b| (a.0, a.2.seconds).partial_cmp(&(b.0, b.2.seconds)).unwrap_or(std::cmp::Ordering::Equal));
    let mut left = time.as_secs_f64();
    let mut chosen: BTreeMap<String, Vec<Visit>> = BTreeMap::new();
    for (_, scenario, visit) in candidates {
        if visit.seconds <= left {
            left -= visit.seconds;
            chosen.entry(scenario.to_owned()).or_default().push(visit);
        }
    }
    chosen.values_mut().for_each(|visits| visits.sort_by_key(|v| v.objects));
    chosen
}

/// Returns a visit between two sizes at which different algorithms are the best.
fn between(below: (&u32, &Size), above: (&u32, &Size), shortest: f64) -> Option<Visit> {
    let ((&low, below), (&high, above)) = (below, above);
    if below.best() == above.best() || f64::from(high) < NARROW * f64::from(low) {
        return None;
    }
    let objects = (f64::from(low) * f64::from(high)).sqrt().round() as u32;
    let both = |(id, ns): (&AlgorithmId, &f64)| Some((id.clone(), (ns * above.ns.get(id)?).sqrt()));
    Size { visits: 0, ns: below.ns.iter().filter_map(both).collect() }.visit(objects, shortest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sapwise::algorithm::Load;
    use sapwise_lab::report::Timing;

    /// Costs n^2 / 10 and 30 n, which cross at 300, and one that is far behind.
    fn course(sizes: &[u32]) -> Vec<Point> {
        let timing = |id: &str, ns: u32| Timing {
            algorithm: format!("{id}@cpu1").parse().unwrap(),
            samples_ns: vec![ns.into(); 5],
            error: None,
        };
        let point = |&n: &u32| Point {
            scenario: "uniform".to_owned(),
            load: Load::of_objects(n),
            timings: vec![timing("brute", n * n / 10), timing("grid-sap", 30 * n), timing("sap", 900 * n)],
            ..Point::default()
        };
        sizes.iter().map(point).collect()
    }

    #[test]
    fn visits_go_where_two_are_close_and_between_different_winners() {
        let visits = visits(&course(&[10, 100, 250, 290, 310, 420, 1000]), Duration::from_secs(9));
        let sizes: Vec<u32> = visits["uniform"].iter().map(|v| v.objects).collect();
        assert_eq!(sizes, [250, 290, 310]);
        for visit in &visits["uniform"] {
            let methods: Vec<&str> = visit.algorithms.iter().map(AlgorithmId::method).collect();
            assert_eq!(methods, ["brute", "grid-sap"]);
        }
        let visits = super::visits(&course(&[10, 250, 370, 1000]), Duration::from_secs(9));
        let sizes: Vec<u32> = visits["uniform"].iter().map(|v| v.objects).collect();
        assert_eq!(sizes, [250, 304, 370]);
    }

    #[test]
    fn the_time_is_kept_and_what_was_visited_less_comes_first() {
        let points = course(&[10, 290, 310]);
        assert!(visits(&points, Duration::ZERO).is_empty());
        let visit = visits(&points, Duration::from_secs(9))["uniform"][0].seconds;
        let again = [&points[..], &points[1..2]].concat();
        let one = visits(&again, Duration::from_secs_f64(1.5 * visit));
        assert_eq!(one["uniform"].iter().map(|v| v.objects).collect::<Vec<_>>(), [310]);
    }
}
