//! One scenario through all sizes, within its time.

use super::dropout::Standing;
use super::race::{FEWEST_FRAMES, Race, Runner};
use super::{Event, Order, median, plan};
use sapwise::gpu::Gpus;
use sapwise::report::Point;
use sapwise::{GpuIdentity, Registry, Scenario, Scene};
use std::time::{Duration, Instant};

/// Most pairs in a frame, 8 bytes each: 256 MB, and as much again in the threads of an algorithm.
const PAIR_LIMIT: usize = 32 << 20;

/// Runs the algorithms of a registry through the sizes of an order and hands on what happens.
///
/// # Errors
/// When the scenario is unknown or `emit` fails.
pub(crate) fn sweep(order: &Order, emit: &mut dyn FnMut(Event) -> anyhow::Result<()>) -> anyhow::Result<()> {
    let scenario: Scenario = order.scenario.parse().map_err(anyhow::Error::msg)?;
    let time = Duration::try_from_secs_f64(order.seconds).unwrap_or_default();
    let end = Instant::now() + time;
    let mut registry = Registry::with_cores(order.cores);
    registry.pin_threads();
    for remark in add_gpus(&mut registry, &order.gpus) {
        emit(Event::Remark(format!("{scenario}: {remark}")))?;
    }
    let mut runners = Vec::new();
    for (id, _) in registry.available() {
        match registry.create(&id) {
            Ok(algorithm) => runners.push(Runner::new(id, algorithm)),
            Err(error) => emit(Event::Remark(format!("{scenario}: {error}")))?,
        }
    }
    let mut standings = vec![Standing::default(); runners.len()];
    let mut race = Race::new(order.seed, PAIR_LIMIT, order.contended);
    let mut before: Option<Before> = None;
    for (k, &objects) in order.sizes.iter().enumerate() {
        let left = end.saturating_duration_since(Instant::now());
        if let Some(before) = &mut before
            && before.forecast(objects) > left
        {
            let reached = before.objects;
            if !before.leave_out_slow(&mut standings) || before.forecast(objects) > left {
                let seconds = order.seconds;
                return emit(Event::Remark(format!(
                    "{scenario} ends after {reached} objects: {objects} don't fit into the {seconds:.0} s that it has"
                )));
            }
            keep_racing(&mut runners, &mut standings);
            emit(Event::Remark(format!("{scenario}: for want of time only the fast go on after {reached} objects")))?;
        }
        let mut scene = scenario.start(objects as usize, order.seed);
        let outcome = race.run(&mut runners, &mut scene, left.mul_f64(plan::share(&order.sizes[k..])));
        for mismatch in outcome.mismatches {
            emit(Event::Mismatch(format!("{scenario} at {objects} objects: {mismatch}")))?;
        }
        let best_ns = judge(&mut standings, &outcome.point, objects);
        emit(Event::Point(Box::new(outcome.point)))?;
        keep_racing(&mut runners, &mut standings);
        if runners.is_empty() {
            return emit(Event::Remark(format!("{scenario} ends after {objects} objects: no algorithm is left")));
        }
        before = Some(Before { objects, frame: outcome.frame, best_ns });
    }
    Ok(())
}

/// Adds the algorithms on those of these GPUs that are still there, and gives what keeps others from running.
fn add_gpus(registry: &mut Registry, wanted: &[GpuIdentity]) -> Vec<String> {
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
    /// Median of the best.
    best_ns: f64,
}

impl Before {
    /// The time that a size takes at least.
    fn forecast(&self, objects: u32) -> Duration {
        // Between the exponents of the strips (1) and of a sweep on one axis (5/3). Too low a forecast costs some seconds
        // beyond the time, too high a one costs the last size.
        let growth = (f64::from(objects) / f64::from(self.objects)).powf(1.25);
        self.frame.mul_f64(growth) * (FEWEST_FRAMES as u32 + 1)
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
        let (scenario, sizes) = (scenario.to_owned(), sizes.to_vec());
        Order { scenario, sizes, cores: 2, seed: 3, seconds, gpus: Vec::new(), contended: false }
    }

    fn events(scenario: &str, sizes: &[u32], seconds: f64) -> Vec<Event> {
        let order = order(scenario, sizes, seconds);
        let mut events = Vec::new();
        sweep(&order, &mut |event| {
            events.push(event);
            Ok(())
        })
        .unwrap();
        events
    }

    #[test]
    fn every_point_has_paired_samples_of_all_algorithms_and_the_size_asked_for() {
        for scenario in ["uniform", "fragmentation"] {
            let events = events(scenario, &[10, 300], 10.0);
            let points: Vec<&Point> =
                events.iter().filter_map(|e| if let Event::Point(p) = e { Some(&**p) } else { None }).collect();
            assert_eq!(points.iter().map(|p| p.load.objects).collect::<Vec<_>>(), [10, 300], "{events:?}");
            for point in points {
                assert!(point.timings.len() >= 2);
                let frames = point.timings[0].samples_ns.len();
                assert!((FEWEST_FRAMES..=40).contains(&frames), "{frames}");
                assert!(point.timings.iter().all(|t| t.samples_ns.len() == frames && t.error.is_none()));
            }
        }
    }

    #[test]
    fn a_size_that_does_not_fit_is_told() {
        let events = events("uniform", &[10, 1_000_000], 0.0);
        assert_eq!(events.iter().filter(|e| matches!(e, Event::Point(_))).count(), 1);
        assert!(matches!(events.last(), Some(Event::Remark(text)) if text.contains("1000000")), "{events:?}");
    }

    #[test]
    fn a_gpu_that_is_gone_is_a_remark_and_the_sweep_goes_on() {
        let text = || "none such".to_owned();
        let kind = sapwise::GpuKind::Discrete;
        let gone = GpuIdentity { index: 99, name: text(), device: text(), driver: text(), api: text(), kind };
        let order = Order { gpus: vec![gone], ..order("uniform", &[10], 1.0) };
        let (mut points, mut remarks) = (0, Vec::new());
        sweep(&order, &mut |event| {
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
    fn unknown_scenarios_are_refused() {
        assert!(sweep(&order("x", &[10], 1.0), &mut |_| Ok(())).unwrap_err().to_string().contains("uniform"));
    }
}
