//! The whole sweep, each scenario in a process of its own: a crash costs one scenario.

use super::request::{Event, Schedule, SweepRequest};
use super::visits::visits;
use crate::child::{Ended, run_part};
use crate::interrupt;
use crate::progress::{Progress, Steps as _};
use anyhow::Context;
use sapwise_lab::report::{Point, Report};
use sapwise_lab::sweep::Plan;
use sapwise_scenes::Random;
use sapwise_tune::GpuIdentity;
use std::time::{Duration, Instant};

/// Time of a scenario beyond its own: start-up, the first scene, and a last frame that was forecast too short.
const GRACE: Duration = Duration::from_secs(20);

/// Time to start the process of a scenario, threads included.
const START: Duration = Duration::from_millis(150);

/// The results of a sweep.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Found {
    pub(crate) points: Vec<Point>,
    pub(crate) remarks: Vec<String>,
    /// Whether an algorithm returned a wrong answer or a scenario ended badly.
    pub(crate) failed: bool,
    /// Whether the user stopped it.
    pub(crate) interrupted: bool,
}

/// Sweeps every scenario of a plan on a number of cores and on some GPUs, and calls `keep` after each one, so that
/// nothing measured is lost.
///
/// # Errors
/// When no process can be started. A scenario that crashes is a remark, not an error.
pub(crate) fn sweep_all(
    plan: &Plan,
    cores: u32,
    seed: u64,
    gpus: Vec<GpuIdentity>,
    keep: &mut dyn FnMut(&Found),
) -> anyhow::Result<Found> {
    let began = Instant::now();
    let progress = Progress::new(plan.total.as_secs());
    let mut sweep = Sweep { plan, cores, seed, gpus, began, progress, found: Found::default() };
    for ascent in &plan.ascents {
        if !sweep.go(&ascent.scenario.to_string(), Schedule::Ascent(ascent.sizes.clone()), ascent.time, 0)? {
            return Ok(sweep.found);
        }
        keep(&sweep.found);
    }
    let mut shuffle = Random::new(seed);
    for round in 1..=plan.rounds {
        let left = plan.total.saturating_sub(began.elapsed()) / (plan.rounds + 1 - round);
        let starts = START * plan.ascents.len() as u32;
        for (scenario, mut visits) in visits(&sweep.found.points, left.saturating_sub(starts)) {
            let time = START + Duration::from_secs_f64(visits.iter().map(|v| v.seconds).sum());
            // In random order, so that a machine that slows down does not make large sizes look slower.
            let order = shuffle.shuffled(visits.len());
            visits = order.into_iter().map(|k| visits[k].clone()).collect();
            let before = sweep.found.points.len();
            let goes_on = sweep.go(&scenario, Schedule::Visits(visits), time, u64::from(round))?;
            // Readers separate rounds by their ascending sizes.
            sweep.found.points[before..].sort_by_key(|p| p.load.objects);
            if !goes_on {
                return Ok(sweep.found);
            }
        }
        keep(&sweep.found);
    }
    Ok(sweep.found)
}

/// A sweep under way.
struct Sweep<'a> {
    plan: &'a Plan,
    cores: u32,
    seed: u64,
    /// The GPUs that are still trusted.
    gpus: Vec<GpuIdentity>,
    began: Instant,
    progress: Progress,
    found: Found,
}

impl Sweep<'_> {
    /// Sweeps one scenario in a process of its own. Returns whether the sweep goes on.
    fn go(&mut self, scenario: &str, schedule: Schedule, time: Duration, round: u64) -> anyhow::Result<bool> {
        self.progress.message(scenario);
        match self.run(scenario, schedule, time, round)? {
            Ended::Well => {}
            Ended::Interrupted => {
                let done = self.found.points.last().map_or("before the first point".to_owned(), |p| {
                    format!("after {} at {} objects", p.scenario, p.load.objects)
                });
                self.found.remarks.push(format!("interrupted {done}; the rest is missing"));
                self.found.interrupted = true;
                return Ok(false);
            }
            Ended::Badly(how) => {
                self.found.remarks.push(format!("{scenario}{}{how}", Report::INCOMPLETE));
                self.found.failed = true;
                // A driver is the most likely cause.
                if !self.gpus.is_empty() {
                    let why = "whose process did not end well";
                    self.found.remarks.push(format!("GPUs are left out after {scenario}, {why}"));
                    self.gpus.clear();
                }
            }
        }
        Ok(true)
    }

    fn run(&mut self, scenario: &str, schedule: Schedule, time: Duration, round: u64) -> anyhow::Result<Ended> {
        if interrupt::requested() {
            return Ok(Ended::Interrupted);
        }
        let request = SweepRequest {
            scenario: scenario.to_owned(),
            schedule,
            cores: self.cores,
            // Another scene each round: a property of one scene must not look like one of the machine.
            seed: self.seed.wrapping_add(round),
            seconds: time.as_secs_f64(),
            gpus: self.gpus.clone(),
        };
        let text = serde_json::to_string(&request)?;
        let Self { plan, gpus, began, progress, found, .. } = self;
        run_part(&["sweep", &text], time + GRACE, &mut |line| {
            let event = match serde_json::from_str(line) {
                Ok(event) => event,
                // Drivers may print anything on the standard output of the process that loads them.
                Err(_) if !gpus.is_empty() => return Ok(()),
                Err(error) => return Err(error).with_context(|| format!("{scenario}: its process printed {line:?}")),
            };
            match event {
                Event::Point(point) => {
                    progress.message(&format!("{scenario}: {} objects done", point.load.objects));
                    progress.position(began.elapsed().min(plan.total).as_secs());
                    found.points.push(*point);
                }
                Event::Remark(text) => found.remarks.push(text),
                Event::Mismatch(text) => {
                    let text = format!("{}{text}", Report::WRONG_ANSWER);
                    crate::output::complain(&text);
                    found.remarks.push(text);
                    found.failed = true;
                }
            }
            Ok(())
        })
    }
}
