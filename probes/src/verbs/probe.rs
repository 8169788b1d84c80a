//! `sapwise probe`: the hardware parameters of this machine, then the sweep.

use crate::algorithms::Algorithms;
use crate::args::Probe;
use crate::destination::Destination;
use crate::exit::Outcome;
use crate::flaw::flaw;
use crate::hardware::{self, measure_hardware};
use crate::sweep::{Found, sweep_all};
use crate::terminal::Terminal;
use crate::{child, interrupt, node, output, profiles, provenance, summary};
use anyhow::Context;
use sapwise::algorithm::usable_cores;
use sapwise_lab::data::read_report;
use sapwise_lab::report::{self, Report};
use sapwise_lab::sweep::Plan;
use sapwise_tune::{Hardware, measure};
use std::path::Path;
use std::time::Instant;

pub(crate) fn run(arguments: &Probe, algorithms: &Algorithms) -> anyhow::Result<Outcome> {
    if arguments.profiles {
        return profiles::run(arguments, algorithms);
    }
    let began = Instant::now();
    hardware::check_threads(arguments.threads)?;
    let scenarios = arguments.scenarios();
    let plan = (!arguments.hardware_only).then(|| Plan::new(arguments.quick, &scenarios, arguments.max_objects));
    let in_folder = arguments.out.as_deref().filter(|out| out.is_dir()).map(node::report_in);
    if let Some(path) = in_folder.as_deref().filter(|path| path.exists())
        && let Some(there) = good(path, arguments, algorithms)?
    {
        if arguments.json {
            output::print_file(&report::write(&there)?)?;
        } else {
            output::print(&format!(
                "{} is complete: nothing is measured.\nNext: remove it to measure again",
                path.display()
            ))?;
        }
        return Ok(Outcome::Done);
    }
    let out = in_folder.as_deref().or(arguments.out.as_deref());
    let destination = if arguments.json && out.is_none() { None } else { Some(Destination::new(out)?) };
    interrupt::listen()?;
    if arguments.leashed {
        child::when_parent_ends(interrupt::request);
    }
    let (hardware, measured) = measure_hardware(arguments.threads, &arguments.gpus)?;
    let told = summary::gpus_left_out(&arguments.gpus, &hardware, &measured.left_out, &measured.remarks);
    let before = [measured.remarks, hardware.disturbed()].concat();
    let assemble = |found| assemble(arguments, algorithms, &hardware, found, began);
    let mut found = Found { remarks: before.clone(), ..Found::default() };
    if interrupt::requested() {
        found.remarks.push("interrupted during the hardware parameters; the rest is missing".to_owned());
        found.interrupted = true;
    } else if let Some(plan) = &plan {
        let cores = arguments.threads.unwrap_or_else(usable_cores);
        found = sweep_all(plan, cores, arguments.seed, measured.usable, &mut |so_far| {
            if let Some(destination) = &destination {
                let mut so_far = so_far.clone();
                so_far.remarks.splice(0..0, before.iter().cloned());
                let mut report = assemble(so_far);
                report.remarks.push("unfinished: the measurement was under way when this was written".to_owned());
                destination.save_unfinished(&report);
            }
        })?;
        found.remarks.splice(0..0, before.iter().cloned());
    }
    let (failed, interrupted) = (found.failed, found.interrupted);
    let report = assemble(found);
    let saved = destination.as_ref().map(|d| if interrupted { d.save_interrupted(&report) } else { d.save(&report) });
    let saved = saved.transpose();
    let text = if arguments.json {
        report::write(&report)?
    } else {
        let next =
            saved.as_ref().ok().and_then(|path| path.map(|path| summary::next_step(&report, path, &arguments.gpus)));
        let told = told.map(|told| format!("\n{told}\n")).unwrap_or_default();
        summary::report(&report, Terminal::of_standard_output()) + &told + &next.unwrap_or_default()
    };
    // A closed or full standard output is reported last: an error of the report matters more.
    let printed = output::print(&text);
    let saved = saved?;
    if interrupted {
        let told = saved.map_or("the report".to_owned(), |path| path.display().to_string());
        anyhow::bail!("interrupted: {told} holds what was measured until then");
    }
    if failed {
        anyhow::bail!("the sweep has gaps or wrong answers; the remarks of the report say which");
    }
    printed?;
    Ok(Outcome::Done)
}

/// Returns the existing report of this node if it need not be measured again.
///
/// # Errors
/// When it is a good one of another command, or no report: neither is replaced.
fn good(path: &Path, arguments: &Probe, algorithms: &Algorithms) -> anyhow::Result<Option<Report>> {
    let (_, there) = read_report(path, &output::warn).context("name a file, or another folder, with --out")?;
    let now = measure::machine();
    if there.hardware.machine.physical_id != now.physical_id
        || flaw(&there, &algorithms.registry(usable_cores())).is_some()
    {
        return Ok(None);
    }
    let command = provenance::command(arguments);
    let (as_then, as_now) = ((&there.provenance.command, &there.hardware.machine.simd), (&command, &now.simd));
    if as_then != as_now {
        let told = |(command, simd): (&String, &String)| format!("`sapwise {command}` at {simd}");
        let (then, now) = (told(as_then), told(as_now));
        anyhow::bail!(
            "{} was measured by {then}, not by {now}; name a file, or another folder, with --out",
            path.display()
        );
    }
    Ok(Some(there))
}

fn assemble(arguments: &Probe, algorithms: &Algorithms, hardware: &Hardware, found: Found, began: Instant) -> Report {
    Report {
        label: provenance::label(arguments, &found.points, hardware),
        provenance: provenance::provenance(arguments, hardware, began.elapsed()),
        hardware: hardware.clone(),
        algorithms: provenance::timed(&found.points, arguments.threads, hardware, algorithms),
        points: found.points,
        remarks: found.remarks,
    }
}
