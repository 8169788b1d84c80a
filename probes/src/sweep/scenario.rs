//! One scenario through all sizes, within its time.

use super::race::{FEWEST_FRAMES, Race, Raced, Racer};
use super::request::{Event, Schedule, SweepRequest, Visit};
use crate::algorithms::Algorithms;
use sapwise::{AlgorithmId, Registry};
use sapwise_gpu::Gpus;
use sapwise_lab::report::Point;
use sapwise_lab::sweep::{Standing, median, share};
use sapwise_scenes::Scenario;
use sapwise_tune::GpuIdentity;
use std::time::{Duration, Instant};

/// Most pairs in a frame, 8 bytes each: 256 MB, and as much again in the threads of an algorithm.
const PAIR_LIMIT: usize = 32 << 20;

/// Runs the algorithms of a registry through the schedule of a request, and hands on each event.
///
/// # Errors
/// When the scenario is unknown or `emit` fails.
pub(crate) fn sweep(
    request: &SweepRequest,
    algorithms: &Algorithms,
    emit: &mut dyn FnMut(Event) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let scenario: Scenario = request.scenario.parse().map_err(anyhow::Error::msg)?;
    let mut registry = algorithms.registry(request.cores);
    registry.pin_threads();
    for remark in add_gpus(&mut registry, &request.gpus) {
        emit(Event::Remark(format!("{scenario}: {remark}")))?;
    }
    let mut racers = Vec::new();
    for id in registry.available().into_iter().map(|e| e.id) {
        if !request.schedule.admits(&id) {
            continue;
        }
        match registry.create(&id) {
            Ok(algorithm) => racers.push(Racer::new(id, algorithm)),
            Err(error) => emit(Event::Remark(format!("{scenario}: {id} is left out: {error}")))?,
        }
    }
    // From here on: opening a GPU takes seconds and belongs to no size.
    let end = Instant::now() + Duration::try_from_secs_f64(request.seconds).unwrap_or_default();
    let race = Race::new(request.seed, PAIR_LIMIT, request.cores);
    let own = ScenarioSweep { scenario, registry, seed: request.seed, end, race, emit };
    match &request.schedule {
        Schedule::Ascent(sizes) => own.ascend(racers, sizes, request.seconds),
        Schedule::Visits(visits) => own.visit(racers, visits),
    }
}

/// The sweep of one scenario.
struct ScenarioSweep<'a> {
    scenario: Scenario,
    registry: Registry,
    seed: u64,
    end: Instant,
    race: Race,
    emit: &'a mut dyn FnMut(Event) -> anyhow::Result<()>,
}

impl ScenarioSweep<'_> {
    /// Runs everyone through all sizes, until they leave the race or the time is over.
    fn ascend(mut self, mut racers: Vec<Racer>, sizes: &[u32], seconds: f64) -> anyhow::Result<()> {
        let scenario = self.scenario;
        let mut standings = vec![Standing::default(); racers.len()];
        let mut before: Option<Before> = None;
        for (k, &objects) in sizes.iter().enumerate() {
            let left = self.end.saturating_duration_since(Instant::now());
            if let Some(before) = &mut before
                && before.forecast(objects) > left
            {
                let reached = before.objects;
                if !before.leave_out_slow(&mut standings) || before.forecast(objects) > left {
                    return self.remark(format!(
                        "{scenario} ends after {reached} objects: {objects} objects would exceed its {seconds:.0} s"
                    ));
                }
                keep_racing(&mut racers, &mut standings);
                self.remark(format!(
                    "{scenario}: after {reached} objects only the fastest algorithms were timed, to stay within \
                     {seconds:.0} s"
                ))?;
            }
            let outcome = self.point(&mut racers, objects, left.mul_f64(share(&sizes[k..])))?;
            let best_ns = judge(&mut standings, &outcome.point, objects);
            (self.emit)(Event::Point(Box::new(outcome.point)))?;
            keep_racing(&mut racers, &mut standings);
            if racers.is_empty() {
                return self.remark(format!("{scenario} ends after {objects} objects: no algorithm is left"));
            }
            before = Some(Before { objects, frame: outcome.frame, warm_up: outcome.warm_up, best_ns });
        }
        Ok(())
    }

    /// Runs single points in the order given, until the time is over. Visits that are left then are dropped silently.
    fn visit(mut self, mut racers: Vec<Racer>, visits: &[Visit]) -> anyhow::Result<()> {
        let order: Vec<AlgorithmId> = racers.iter().map(|r| r.id.clone()).collect();
        for visit in visits {
            let left = self.end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                break;
            }
            let (mut racing, resting): (Vec<Racer>, Vec<Racer>) =
                racers.into_iter().partition(|r| r.error.is_none() && visit.algorithms.contains(&r.id));
            if racing.len() > 1 {
                let time = Duration::try_from_secs_f64(visit.seconds).unwrap_or_default();
                let outcome = self.point(&mut racing, visit.objects, time.min(left))?;
                (self.emit)(Event::Point(Box::new(outcome.point)))?;
            }
            racers = resting;
            racers.append(&mut racing);
            // The answers of large frames are compared with that of the first.
            racers.sort_by_key(|r| order.iter().position(|id| *id == r.id));
        }
        Ok(())
    }

    /// Runs one size and reports wrong answers.
    fn point(&mut self, racers: &mut [Racer], objects: u32, time: Duration) -> anyhow::Result<Raced> {
        let mut scene = self.scenario.start(objects as usize, self.seed);
        // It must not remember another scene: after a failed try with ten boxes, `pair-cache` kept no pairs at all
        // larger sizes, and took 2.5 × the time.
        for racer in racers.iter_mut().filter(|r| r.error.is_none() && r.algorithm.is_incremental()) {
            racer.algorithm = self.registry.create(&racer.id)?;
        }
        let mut outcome = self.race.run(racers, &mut scene, time);
        for mismatch in outcome.mismatches.drain(..) {
            (self.emit)(Event::Mismatch(format!("{} at {objects} objects: {mismatch}", self.scenario)))?;
        }
        Ok(outcome)
    }

    fn remark(&mut self, text: String) -> anyhow::Result<()> {
        (self.emit)(Event::Remark(text))
    }
}

/// Adds the algorithms on those of these GPUs that are still there, and returns a remark for each of the others.
pub(crate) fn add_gpus(registry: &mut Registry, wanted: &[GpuIdentity]) -> Vec<String> {
    if wanted.is_empty() {
        return Vec::new();
    }
    let gpus = Gpus::find();
    let (there, gone): (Vec<_>, Vec<_>) = wanted.iter().cloned().partition(|g| gpus.identities().any(|h| h == g));
    let gone = gone.into_iter().map(|g| {
        format!("gpu{} ({}) was there when the hardware was measured and is now gone; it is left out", g.index, g.name)
    });
    sapwise_gpu::add_to(registry, &gpus.choose(|g| there.contains(g)));
    gone.collect()
}

/// The previous size.
struct Before {
    objects: u32,
    /// Wall clock of a frame with all algorithms.
    frame: Duration,
    /// Wall clock of the warm-up.
    warm_up: Duration,
    /// Median of the best algorithm.
    best_ns: f64,
}

impl Before {
    /// Returns the least time that a size takes.
    fn forecast(&self, objects: u32) -> Duration {
        // Between the exponents of `grid-sap` (1) and of a sweep on one axis (5/3). A forecast that is too low costs
        // some seconds; one that is too high costs the last size.
        let growth = (f64::from(objects) / f64::from(self.objects)).powf(1.25);
        (self.warm_up + self.frame * (FEWEST_FRAMES as u32)).mul_f64(growth)
    }

    /// Takes slow algorithms out of the race and their time out of the frame. Returns whether there were any.
    fn leave_out_slow(&mut self, standings: &mut [Standing]) -> bool {
        let ratios: f64 = standings.iter_mut().filter_map(Standing::leave_if_slow).sum();
        let of_best = |times: f64| Duration::try_from_secs_f64(times * self.best_ns / 1e9).unwrap_or_default();
        // The subtracted medians may add up to more than the shortest frame. The remaining algorithms take at least
        // the second duration.
        let staying = standings.iter().filter(|s| !s.out).count();
        self.frame = self.frame.saturating_sub(of_best(ratios)).max(of_best(staying as f64));
        ratios > 0.0
    }
}

/// Judges every algorithm, and returns the median of the best.
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

fn keep_racing(racers: &mut Vec<Racer>, standings: &mut Vec<Standing>) {
    let mut stays = standings.iter().map(|s| !s.out).collect::<Vec<_>>().into_iter();
    racers.retain(|_| stays.next().unwrap_or(false));
    standings.retain(|s| !s.out);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::algorithms::UserAlgorithm;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

    fn request(scenario: &str, sizes: &[u32], seconds: f64) -> SweepRequest {
        let (scenario, schedule) = (scenario.to_owned(), Schedule::Ascent(sizes.to_vec()));
        SweepRequest { scenario, schedule, cores: 2, seed: 3, seconds, gpus: Vec::new() }
    }

    /// The points and the remarks of a sweep.
    fn swept(request: &SweepRequest, algorithms: &Algorithms) -> (Vec<Point>, Vec<String>) {
        let (mut points, mut remarks) = (Vec::new(), Vec::new());
        let mut keep = |event| {
            match event {
                Event::Point(point) => points.push(*point),
                Event::Remark(text) => remarks.push(text),
                Event::Mismatch(text) => panic!("{text}"),
            }
            Ok(())
        };
        sweep(request, algorithms, &mut keep).unwrap();
        (points, remarks)
    }

    #[test]
    fn every_point_has_samples_of_all_algorithms_and_the_size_asked_for() {
        for scenario in ["uniform", "fragmentation"] {
            let (points, remarks) = swept(&request(scenario, &[10, 300], 10.0), &Algorithms::default());
            assert_eq!(points.iter().map(|p| p.load.objects).collect::<Vec<_>>(), [10, 300], "{remarks:?}");
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
        let visit =
            |objects, algorithms: &[AlgorithmId]| Visit { objects, seconds: 0.0, algorithms: algorithms.into() };
        // With one alone no choice is in doubt.
        let visits = vec![visit(300, &algorithms), visit(20, &algorithms), visit(50, &algorithms[..1])];
        let request = SweepRequest { schedule: Schedule::Visits(visits), ..request("clustered", &[], 60.0) };
        let points = swept(&request, &Algorithms::default()).0;
        assert_eq!(points.iter().map(|p| p.load.objects).collect::<Vec<_>>(), [300, 20]);
        for point in points {
            let raced: Vec<_> = point.timings.iter().map(|t| t.algorithm.clone()).collect();
            assert!(raced.len() == 2 && algorithms.iter().all(|id| raced.contains(id)), "{raced:?}");
        }
    }

    #[test]
    fn a_size_that_does_not_fit_is_told() {
        let (points, remarks) = swept(&request("uniform", &[10, 1_000_000], 0.0), &Algorithms::default());
        assert_eq!(points.len(), 1);
        assert!(remarks.last().is_some_and(|text| text.contains("1000000 objects would exceed")), "{remarks:?}");
    }

    #[test]
    fn a_gpu_that_is_gone_is_a_remark_and_the_sweep_goes_on() {
        let gone = GpuIdentity::new(99, "none such", sapwise_tune::GpuKind::Discrete);
        let request = SweepRequest { gpus: vec![gone], ..request("uniform", &[10], 1.0) };
        let (points, remarks) = swept(&request, &Algorithms::default());
        assert_eq!((points.len(), remarks.len()), (1, 1), "{remarks:?}");
        assert!(remarks[0].contains("gpu99 (none such) was there"), "{remarks:?}");
    }

    #[test]
    fn a_users_algorithm_is_timed_like_ours_and_one_that_can_not_be_made_is_named() {
        let mut algorithms = Algorithms::default();
        let brute = || Registry::with_cores(1).create(&"brute@cpu1".parse().unwrap());
        algorithms.add(UserAlgorithm::on_one_thread("mine", 1, brute)).unwrap();
        let refused = || Err(sapwise::Error::OutOfMemory { what: "nodes", elements: 3 });
        algorithms.add(UserAlgorithm::on_one_thread("huge", 1, refused)).unwrap();
        let (points, remarks) = swept(&request("uniform", &[10], 1.0), &algorithms);
        let raced: Vec<String> = points[0].timings.iter().map(|t| t.algorithm.to_string()).collect();
        assert!(raced.contains(&"mine@cpu1".to_owned()) && !raced.contains(&"huge@cpu1".to_owned()), "{raced:?}");
        assert_eq!(remarks.len(), 1, "{remarks:?}");
        assert!(remarks[0].starts_with("uniform: huge@cpu1 is left out: no memory for 3 nodes"), "{remarks:?}");
    }

    #[test]
    fn incremental_algorithms_are_created_anew_for_each_point() {
        let mut algorithms = Algorithms::default();
        let made = ["brute", "pair-cache"].map(|method| {
            let made = Arc::<AtomicUsize>::default();
            let count = Arc::clone(&made);
            let create = move || {
                count.fetch_add(1, Relaxed);
                Registry::with_cores(1).create(&format!("{method}@cpu1").parse().unwrap())
            };
            algorithms.add(UserAlgorithm::on_one_thread(&format!("my-{method}"), 1, create)).unwrap();
            made
        });
        let (points, remarks) = swept(&request("uniform", &[10, 20, 40], 10.0), &algorithms);
        assert_eq!(points.len(), 3, "{remarks:?}");
        assert_eq!(made.map(|made| made.load(Relaxed)), [1, 1 + 3]);
    }

    #[test]
    fn unknown_scenarios_are_refused() {
        let refused = sweep(&request("x", &[10], 1.0), &Algorithms::default(), &mut |_| Ok(()));
        assert!(refused.unwrap_err().to_string().contains("uniform"));
    }
}
