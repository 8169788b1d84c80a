//! The sweep as a whole: each scenario in a process of its own.

use super::{Event, Order, Plan};
use crate::child::{Ended, run_part};
use crate::interrupt;
use crate::progress::Progress;
use anyhow::Context;
use sapwise::report::Point;
use sapwise::{GpuIdentity, Scenario};
use std::time::Duration;

/// What a scenario may take beyond its time: start-up, the first scene and a last frame that was forecast too short.
const GRACE: Duration = Duration::from_secs(20);

/// What a sweep has found so far.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Found {
    pub(crate) points: Vec<Point>,
    pub(crate) remarks: Vec<String>,
    /// Whether an algorithm gave a wrong answer or a scenario ended badly.
    pub(crate) failed: bool,
    /// Whether the user stopped it.
    pub(crate) interrupted: bool,
}

/// What is the same for all scenarios of a sweep.
pub(crate) struct Conditions {
    pub(crate) cores: u32,
    pub(crate) seed: u64,
    pub(crate) contended: bool,
    /// The GPUs to sweep.
    pub(crate) gpus: Vec<GpuIdentity>,
}

/// Sweeps every scenario of a plan. `keep` is called after each of them, so that nothing measured is lost.
///
/// # Errors
/// When no process can be started. A scenario that crashes is a remark, not an error.
pub(crate) fn conduct(plan: &Plan, conditions: &Conditions, keep: &mut dyn FnMut(&Found)) -> anyhow::Result<Found> {
    let progress = Progress::new(plan.points());
    let mut found = Found::default();
    let mut gpus = &conditions.gpus[..];
    for (k, scenario) in plan.scenarios.iter().enumerate() {
        progress.message(scenario.to_string());
        let ended = one(plan, *scenario, conditions, gpus, &progress, &mut found)?;
        match ended {
            Ended::Well => {}
            Ended::Interrupted => {
                let done = found.points.last().map_or("before the first point".to_owned(), |p| {
                    format!("after {} at {} objects", p.scenario, p.load.objects)
                });
                found.remarks.push(format!("interrupted {done}; what was to follow is missing"));
                found.interrupted = true;
                return Ok(found);
            }
            Ended::Badly(how) => {
                found.remarks.push(format!("{scenario} is incomplete: its process {how}"));
                found.failed = true;
                // Whatever it was, a driver is the first to be suspected.
                if !gpus.is_empty() {
                    found.remarks.push(format!("GPUs are left out after {scenario}, whose process did not end well"));
                    gpus = &[];
                }
            }
        }
        // Sizes that did not fit into the time count as done.
        progress.position((k as u64 + 1) * plan.sizes.len() as u64);
        keep(&found);
    }
    Ok(found)
}

fn one(
    plan: &Plan,
    scenario: Scenario,
    conditions: &Conditions,
    gpus: &[GpuIdentity],
    progress: &Progress,
    found: &mut Found,
) -> anyhow::Result<Ended> {
    if interrupt::requested() {
        return Ok(Ended::Interrupted);
    }
    let order = Order {
        scenario: scenario.to_string(),
        sizes: plan.sizes.clone(),
        cores: conditions.cores,
        seed: conditions.seed,
        seconds: plan.each.as_secs_f64(),
        gpus: gpus.to_vec(),
        contended: conditions.contended,
    };
    let text = serde_json::to_string(&order)?;
    run_part(&["sweep", &text], plan.each + GRACE, &mut |line| {
        let event = match serde_json::from_str(line) {
            Ok(event) => event,
            // Drivers print what they like on the standard output of whoever loads them.
            Err(_) if !gpus.is_empty() => return Ok(()),
            Err(error) => return Err(error).with_context(|| format!("{scenario}: its process printed {line:?}")),
        };
        match event {
            Event::Point(point) => {
                progress.message(format!("{scenario}: {} objects done", point.load.objects));
                progress.advance(1);
                found.points.push(*point);
            }
            Event::Remark(text) => found.remarks.push(text),
            Event::Mismatch(text) => {
                crate::output::complain(&format!("WRONG ANSWER: {text}"));
                found.remarks.push(format!("WRONG ANSWER: {text}"));
                found.failed = true;
            }
        }
        Ok(())
    })
}
