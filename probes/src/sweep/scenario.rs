//! One scenario through all sizes, within its time.

use super::dropout::Standing;
use super::race::{FEWEST_FRAMES, Outcome, Race, Runner};
use super::{Course, Event, Order, Visit, median, plan};
use crate::algorithms::Algorithms;
use sapwise::gpu::Gpus;
use sapwise::report::Point;
use sapwise::{AlgorithmId, GpuIdentity, Registry};
use sapwise_scenes::{Scenario, Scene};
use std::time::{Duration, Instant};

/// Most pairs in a frame, 8 bytes each: 256 MB, and as much again in the threads of an algorithm.
pub(crate) const PAIR_LIMIT: usize = 32 << 20;

/// Runs the algorithms of a registry along the course of an order and hands on what happens.
///
/// # Errors
/// When the scenario is unknown or `emit` fails.
pub(crate) fn sweep(
    order: &Order,
    algorithms: &Algorithms,
    emit: &mut dyn FnMut(Event) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let scenario: Scenario = order.scenario.parse()?;
    let mut registry = algorithms.registry(order.cores);
    registry.pin_threads();
    for remark in add_gpus(&mut registry, &order.gpus) {
        emit(Event::Remark(format!("{scenario}: {remark}")))?;
    }
    let mut runners = Vec::new();
    for (id, _) in registry.available() {
        if !order.course.admits(&id) {
            continue;
        }
        match registry.create(&id) {
            Ok(algorithm) => runners.push(Runner::new(id, algorithm)),
            Err(error) => emit(Event::Remark(format!("{scenario}: {id} is left out: {error}")))?,
        }
    }
    // From here on: opening a GPU takes seconds, and is not the time of any size.
    let end = Instant::now() + Duration::try_from_secs_f64(order.seconds).unwrap_or_default();
    let stage = Stage {
        scenario,
        seed: order.seed,
        end,
        race: Race::new(order.seed, PAIR_LIMIT, order.cores, order.contended),
        emit,
    };
    match &order.course {
        Course::Ascent(sizes) => stage.ascend(runners, sizes, order.seconds),
        Course::Visits(visits) => stage.visit(runners, visits),
    }
}

/// What both courses share.
struct Stage<'a> {
    scenario: Scenario,
    seed: u64,
    end: Instant,
    race: Race,
    emit: &'a mut dyn FnMut(Event) -> anyhow::Result<()>,
}

impl Stage<'_> {
    /// Everyone through all sizes, until they leave the race or the time is over.
    fn ascend(mut self, mut runners: Vec<Runner>, sizes: &[u32], seconds: f64) -> anyhow::Result<()> {
        let scenario = self.scenario;
        let mut standings = vec![Standing::default(); runners.len()];
        let mut before: Option<Before> = None;
        for (k, &objects) in sizes.iter().enumerate() {
            let left = self.end.saturating_duration_since(Instant::now());
            if let Some(before) = &mut before
                && before.forecast(objects) > left
            {
                let reached = before.objects;
                if !before.leave_out_slow(&mut standings) || before.forecast(objects) > left {
                    return self.remark(format!(
                        "{scenario} ends after {reached} objects: {objects} don't fit into the {seconds:.0} s that it has"
                    ));
                }
                keep_racing(&mut runners, &mut standings);
                self.remark(format!("{scenario}: for want of time only the fast go on after {reached} objects"))?;
            }
            let outcome = self.point(&mut runners, objects, left.mul_f64(plan::share(&sizes[k..])))?;
            let best_ns = judge(&mut standings, &outcome.point, objects);
            (self.emit)(Event::Point(Box::new(outcome.point)))?;
            keep_racing(&mut runners, &mut standings);
            if runners.is_empty() {
                return self.remark(format!("{scenario} ends after {objects} objects: no algorithm is left"));
            }
            before = Some(Before { objects, frame: outcome.frame, warm_up: outcome.warm_up, best_ns });
        }
        Ok(())
    }

    /// Single points, in the order given, until the time is over. What is left then was not promised, so nothing is said of it.
    fn visit(mut self, mut runners: Vec<Runner>, visits: &[Visit]) -> anyhow::Result<()> {
        let order: Vec<AlgorithmId> = runners.iter().map(|r| r.id.clone()).collect();
        for visit in visits {
            let left = self.end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                break;
            }
            let (mut racing, resting): (Vec<Runner>, Vec<Runner>) =
                runners.into_iter().partition(|r| r.error.is_none() && visit.algorithms.contains(&r.id));
            if racing.len() > 1 {
                let time = Duration::try_from_secs_f64(visit.seconds).unwrap_or_default();
                let outcome = self.point(&mut racing, visit.objects, time.min(left))?;
                (self.emit)(Event::Point(Box::new(outcome.point)))?;
            }
            runners = resting;
            runners.append(&mut racing);
            // The first of the list is what the answers of large frames are held against.
            runners.sort_by_key(|r| order.iter().position(|id| *id == r.id));
        }
        Ok(())
    }

    /// One size, with what was wrong told.
    fn point(&mut self, runners: &mut [Runner], objects: u32, time: Duration) -> anyhow::Result<Outcome> {
        let mut scene = self.scenario.start(objects as usize, self.seed);
        let mut outcome = self.race.run(runners, &mut scene, time);
        for mismatch in outcome.mismatches.drain(..) {
            (self.emit)(Event::Mismatch(format!("{} at {objects} objects: {mismatch}", self.scenario)))?;
        }
        Ok(outcome)
    }

    fn remark(&mut self, text: String) -> anyhow::Result<()> {
        (self.emit)(Event::Remark(text))
    }
}

/// Adds the algorithms on those of these GPUs that are still there, and gives what keeps others from running.
pub(crate) fn add_gpus(registry: &mut Registry, wanted: &[GpuIdentity]) -> Vec<String> {
    if wanted.is_empty() {
        return Vec::new();
    }
    let gpus = Gpus::find();
    let (there, gone): (Vec<_>, Vec<_>) = wanted.iter().cloned().partition(|g| gpus.identities().any(|h| h == g));
    let gone = gone.into_iter().map(|g| {
        format!("gpu{} ({}) was there when the hardware was measured and is gone; it is left out", g.index, g.name)
    });
    registry.add_gpus(&gpus.choose(|g| there.contains(g)));
    gone.collect()
}

/// The size before.
struct Before {
    objects: u32,
    /// Wall clock of a frame with all algorithms.
    frame: Duration,
    /// Wall clock of the frames before the samples.
    warm_up: Duration,
    /// Median of the best.
    best_ns: f64,
}

impl Before {
    /// The time that a size takes at least.
    fn forecast(&self, objects: u32) -> Duration {
        // Between the exponents of the strips (1) and of a sweep on one axis (5/3). Too low a forecast costs some seconds
        // beyond the time, too high a one costs the last size.
        let growth = (f64::from(objects) / f64::from(self.objects)).powf(1.25);
        (self.warm_up + self.frame * (FEWEST_FRAMES as u32)).mul_f64(growth)
    }

    /// Takes the slow out of the race and their time out of the frame. Whether there were any.
    fn leave_out_slow(&mut self, standings: &mut [Standing]) -> bool {
        let ratios: f64 = standings.iter_mut().filter_map(Standing::leave_if_slow).sum();
        let of_best = |times: f64| Duration::try_from_secs_f64(times * self.best_ns / 1e9).unwrap_or_default();
        // The medians that are taken off may add up to more than the shortest frame; those who stay take at least this.
        let staying = standings.iter().filter(|s| !s.out).count();
        self.frame = self.frame.saturating_sub(of_best(ratios)).max(of_best(staying as f64));
        ratios > 0.0
    }
}

/// Lets every standing know how its algorithm did, and gives the median of the best.
fn judge(standings: &mut [Standing], point: &Point, objects: u32) -> f64 {
    let medians: Vec<Option<f64>> = point.timings.iter().map(|t| median(&t.samples_ns)).collect();
    let best = medians.iter().flatten().copied().fold(f64::INFINITY, f64::min);
    for ((standing, timing), median) in standings.iter_mut().zip(&point.timings).zip(medians) {
        match median {
            Some(median) => standing.judge(median / best, timing.algorithm.method(), objects),
            None => standing.out = true,
        }
    }
    best
}

fn keep_racing(runners: &mut Vec<Runner>, standings: &mut Vec<Standing>) {
    let mut stays = standings.iter().map(|s| !s.out).collect::<Vec<_>>().into_iter();
    runners.retain(|_| stays.next().unwrap_or(false));
    standings.retain(|s| !s.out);
}

/// Goes on to the next frame that has as many objects as the size says.
///
/// Only in `fragmentation` the number changes, and samples of different sizes can't be put together.
pub(crate) fn next_frame(scene: &mut Scene) {
    for _ in 0..Scenario::FRAGMENTATION_FRAMES {
        scene.advance();
        if scene.boxes().len() == scene.peak_objects() {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn order(scenario: &str, sizes: &[u32], seconds: f64) -> Order {
        let (scenario, course) = (scenario.to_owned(), Course::Ascent(sizes.to_vec()));
        Order { scenario, course, cores: 2, seed: 3, seconds, gpus: Vec::new(), contended: false }
    }

    fn events(order: &Order) -> Vec<Event> {
        let mut events = Vec::new();
        sweep(order, &Algorithms::default(), &mut |event| {
            events.push(event);
            Ok(())
        })
        .unwrap();
        events
    }

    fn points(events: &[Event]) -> Vec<&Point> {
        events.iter().filter_map(|e| if let Event::Point(p) = e { Some(&**p) } else { None }).collect()
    }

    #[test]
    fn every_point_has_samples_of_all_algorithms_and_the_size_asked_for() {
        for scenario in ["uniform", "fragmentation"] {
            let events = events(&order(scenario, &[10, 300], 10.0));
            let points = points(&events);
            assert_eq!(points.iter().map(|p| p.load.objects).collect::<Vec<_>>(), [10, 300], "{events:?}");
            for point in points {
                assert!(point.timings.len() >= 2);
                let frames = point.timings.iter().map(|t| t.samples_ns.len());
                assert!(frames.clone().all(|n| (FEWEST_FRAMES..=40).contains(&n)), "{point:?}");
                assert!(point.timings.iter().all(|t| t.error.is_none()));
            }
        }
    }

    #[test]
    fn visits_race_only_those_who_were_asked() {
        let algorithms: Vec<AlgorithmId> = ["brute@cpu1", "sap@cpu1"].map(|id| id.parse().unwrap()).into();
        let visit = |objects, algorithms: &[AlgorithmId]| Visit { objects, seconds: 0.0, algorithms: algorithms.into() };
        // One alone gives no choice to be in doubt of.
        let visits = vec![visit(300, &algorithms), visit(20, &algorithms), visit(50, &algorithms[..1])];
        let order = Order { course: Course::Visits(visits), ..order("clustered", &[], 60.0) };
        let events = events(&order);
        let points = points(&events);
        assert_eq!(points.iter().map(|p| p.load.objects).collect::<Vec<_>>(), [300, 20]);
        for point in points {
            let raced: Vec<_> = point.timings.iter().map(|t| t.algorithm.clone()).collect();
            assert!(raced.len() == 2 && algorithms.iter().all(|id| raced.contains(id)), "{raced:?}");
        }
    }

    #[test]
    fn a_size_that_does_not_fit_is_told() {
        let events = events(&order("uniform", &[10, 1_000_000], 0.0));
        assert_eq!(points(&events).len(), 1);
        assert!(matches!(events.last(), Some(Event::Remark(text)) if text.contains("1000000")), "{events:?}");
    }

    #[test]
    fn a_gpu_that_is_gone_is_a_remark_and_the_sweep_goes_on() {
        let text = || "none such".to_owned();
        let kind = sapwise::GpuKind::Discrete;
        let gone = GpuIdentity { index: 99, name: text(), device: text(), driver: text(), api: text(), kind };
        let order = Order { gpus: vec![gone], ..order("uniform", &[10], 1.0) };
        let (mut points, mut remarks) = (0, Vec::new());
        sweep(&order, &Algorithms::default(), &mut |event| {
            match event {
                Event::Point(_) => points += 1,
                Event::Remark(text) => remarks.push(text),
                Event::Mismatch(text) => panic!("{text}"),
            }
            Ok(())
        })
        .unwrap();
        assert_eq!((points, remarks.len()), (1, 1), "{remarks:?}");
        assert!(remarks[0].contains("gpu99 (none such) was there"), "{remarks:?}");
    }

    #[test]
    fn a_users_algorithm_is_timed_like_ours_and_one_that_can_not_be_made_is_named() {
        let mut algorithms = Algorithms::default();
        let brute = || Registry::with_cores(1).create(&"brute@cpu1".parse().unwrap());
        algorithms.add("mine", 1, false, move |_| brute()).unwrap();
        let refused = |_| Err(sapwise::Error::OutOfMemory { what: "nodes", elements: 3 });
        algorithms.add("huge", 1, false, refused).unwrap();
        let (mut raced, mut remarks) = (Vec::new(), Vec::new());
        sweep(&order("uniform", &[10], 1.0), &algorithms, &mut |event| {
            match event {
                Event::Point(point) => raced.extend(point.timings.into_iter().map(|t| t.algorithm.to_string())),
                Event::Remark(text) => remarks.push(text),
                Event::Mismatch(text) => panic!("{text}"),
            }
            Ok(())
        })
        .unwrap();
        assert!(raced.contains(&"mine@cpu1".to_owned()) && !raced.contains(&"huge@cpu1".to_owned()), "{raced:?}");
        assert_eq!(remarks.len(), 1, "{remarks:?}");
        assert!(remarks[0].starts_with("uniform: huge@cpu1 is left out: no memory for 3 nodes"), "{remarks:?}");
    }

    #[test]
    fn unknown_scenarios_are_refused() {
        assert!(
            sweep(&order("x", &[10], 1.0), &Algorithms::default(), &mut |_| Ok(()))
                .unwrap_err()
                .to_string()
                .contains("uniform")
        );
    }
}
