//! `sapwise probe`: the hardware parameters of this machine, then the sweep.

use crate::args::Probe;
use crate::contention::Contention;
use crate::destination::Destination;
use crate::exit::{Outcome, WrongUsage};
use crate::hardware::{self, measure_hardware};
use crate::sweep::{self, Conditions, Found, Plan};
use crate::{interrupt, output, provenance, summary};
use anyhow::Context;
use sapwise::{Hardware, Report, Scenario, usable_cores};
use std::time::Instant;

pub(crate) fn run(arguments: &Probe) -> anyhow::Result<Outcome> {
    let began = Instant::now();
    let plan = plan(arguments)?;
    let destination =
        if arguments.json && arguments.out.is_none() { None } else { Some(Destination::new(arguments.out.as_deref())?) };
    interrupt::listen()?;
    let contention = arguments.contended.then(Contention::start).transpose();
    let contention = contention.context("the threads for --contended can't be started")?;
    let (hardware, measured) = measure_hardware(arguments.threads, arguments.gpus)?;
    let told = summary::gpus_left_out(arguments.gpus, &hardware, &measured.left_out, &measured.remarks);
    let before = [measured.remarks, hardware.disturbed()].concat();
    let mut found = Found { remarks: before.clone(), ..Found::default() };
    if interrupt::requested() {
        found.remarks.push("interrupted during the hardware parameters; what was to follow is missing".to_owned());
        found.interrupted = true;
    } else if let Some(plan) = &plan {
        let conditions = Conditions {
            cores: arguments.threads.unwrap_or_else(usable_cores),
            seed: arguments.seed,
            contended: arguments.contended,
            gpus: measured.usable,
        };
        found = sweep::conduct(plan, &conditions, &mut |so_far| {
            if let Some(destination) = &destination {
                let mut so_far = so_far.clone();
                so_far.remarks.splice(0..0, before.iter().cloned());
                let mut report = assemble(arguments, &hardware, so_far, began);
                report.remarks.push("unfinished: the measurement was going on when this was written".to_owned());
                destination.save_unfinished(&report);
            }
        })?;
        found.remarks.splice(0..0, before.iter().cloned());
    }
    drop(contention);
    let (failed, interrupted) = (found.failed, found.interrupted);
    let report = assemble(arguments, &hardware, found, began);
    let saved = destination.as_ref().map(|d| d.save(&report)).transpose();
    let text = if arguments.json {
        sapwise::json::write_report(&report)?
    } else {
        let next = saved.as_ref().ok().and_then(|path| path.map(|path| summary::next_step(&report, path)));
        let told = told.map(|told| format!("\n{told}\n")).unwrap_or_default();
        summary::report(&report) + &told + &next.unwrap_or_default()
    };
    // A standard output that is closed or full is told last: what went wrong with the report matters more.
    let printed = output::print(&text);
    saved?;
    if interrupted {
        anyhow::bail!("interrupted: the report holds what was measured until then");
    }
    if failed {
        anyhow::bail!("the sweep has gaps or wrong answers; the remarks of the report say which");
    }
    printed?;
    Ok(Outcome::Done)
}

/// What to sweep; `None` with `--hardware-only`.
fn plan(arguments: &Probe) -> anyhow::Result<Option<Plan>> {
    hardware::check_threads(arguments.threads)?;
    let scenarios: Result<Vec<Scenario>, String> = arguments.scenarios.iter().map(|s| s.parse()).collect();
    let mut scenarios = scenarios.map_err(|e| WrongUsage(format!("--scenario: {e}")))?;
    let mut seen = Vec::new();
    scenarios.retain(|s| !seen.contains(s) && (seen.push(*s), true).1);
    Ok((!arguments.hardware_only).then(|| Plan::new(arguments.quick, &scenarios, arguments.max_objects)))
}

fn assemble(arguments: &Probe, hardware: &Hardware, found: Found, began: Instant) -> Report {
    Report {
        schema: sapwise::report::ReportSchema,
        label: provenance::label(arguments, &found.points, hardware),
        provenance: provenance::provenance(arguments, began.elapsed()),
        hardware: hardware.clone(),
        algorithms: provenance::timed(&found.points, arguments.threads, hardware),
        points: found.points,
        remarks: found.remarks,
    }
}
