//! `sapwise run`: the in-line simulation.

use crate::algorithms::Algorithms;
use crate::args::Run;
use crate::document::read_document;
use crate::exit::Outcome;
use crate::gpus::{self, GpuChoice};
use crate::hardware::measure_hardware;
use crate::simulation::{self, Course, simulate};
use crate::{files, interrupt, output, plot, prediction, revisions, table, train};
use anyhow::{Context, bail};
use sapwise::json::Document;
use sapwise::{AlgorithmId, Fields, Registry, Scenario, Source, measure, usable_cores};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// The answer for machines.
#[derive(Serialize)]
struct Answer<'a> {
    scenario: String,
    frames: usize,
    objects: Range,
    repeats: usize,
    seed: u64,
    interrupted: bool,
    /// Median over the frames of the share of the CPU that other programs took; null where that can't be told.
    foreign_load: Option<f64>,
    /// Where the fields came from.
    source: Source,
    extrapolated: bool,
    /// Of the fields.
    warnings: Vec<String>,
    total_ms: Totals,
    /// The fixed algorithms that left the course, by their ids.
    left_out: BTreeMap<String, LeftOut>,
    regret: f64,
    /// The best fixed algorithm, and the time of the adaptive module over its time.
    best_fixed: String,
    over_best_fixed: f64,
    worst_frame: f64,
    switches: usize,
    /// What was run from which frame on.
    decisions: Vec<Decision<'a>>,
}

#[derive(Serialize)]
struct Range {
    min: usize,
    max: usize,
}

#[derive(Serialize)]
struct Totals {
    adaptive: f64,
    oracle: f64,
    /// Of those that ran every frame.
    fixed: BTreeMap<String, f64>,
}

/// A fixed algorithm that a frame took too long.
#[derive(Serialize)]
struct LeftOut {
    /// Its last frame.
    after_frame: usize,
    /// Its total until then.
    at_least_ms: f64,
}

#[derive(Serialize)]
struct Decision<'a> {
    from_frame: usize,
    objects: usize,
    algorithm: &'a AlgorithmId,
}

pub(crate) fn run(arguments: &Run, algorithms: &Algorithms) -> anyhow::Result<Outcome> {
    let mut registry = algorithms.registry(usable_cores());
    registry.pin_threads();
    let read = arguments.fields.as_deref().map(|path| read_fields(path, &registry, &arguments.gpus)).transpose()?;
    // Until here Ctrl-C ends the program, even when it waits for a pipe.
    interrupt::listen()?;
    let mut fields = match read {
        Some(fields) => fields,
        None => {
            let (hardware, measured) = measure_hardware(None, &arguments.gpus)?;
            let model = super::predict::model(None)?;
            let mut fields = prediction::predict(&model, &hardware, &measured.usable, Scenario::Uniform, algorithms)?;
            fields.warnings.extend(measured.remarks);
            fields
        }
    };
    interrupt::check()?;
    let gpu_warnings = add_gpus(&mut registry, &fields, &arguments.gpus)?;
    fields.warnings.extend(gpu_warnings);
    let mut origin =
        Origin { source: fields.source, extrapolated: fields.extrapolated, warnings: std::mem::take(&mut fields.warnings) };
    let usual_frames =
        if arguments.scenario == Scenario::Fragmentation { Scenario::FRAGMENTATION_FRAMES as u32 } else { 200 };
    let course = Course {
        scenario: arguments.scenario,
        objects: arguments.objects as usize,
        frames: arguments.frames.unwrap_or(usual_frames) as usize,
        repeats: arguments.repeats as usize,
        seed: arguments.seed,
    };
    let mut outcome = simulate(&course, fields, &registry)?;
    origin.warnings.append(&mut outcome.notes);
    if let Some(path) = &arguments.plot {
        let svg = plot::simulation(&course, &outcome)?;
        files::write_text(path, &svg)?;
    }
    let answer = answer(&course, &outcome, origin);
    if arguments.json {
        output::print_json(&answer)?;
    } else {
        let plotted = arguments.plot.as_ref().map(|p| format!("\nDrawn in {}.", p.display()));
        output::print(&(text(&answer) + &plotted.unwrap_or_default()))?;
    }
    Ok(if outcome.interrupted { Outcome::Failed } else { Outcome::Done })
}

/// Adds the algorithms on the GPUs that are taken, where the fields name any, and gives what keeps some from running.
///
/// # Errors
/// When no process can be started.
fn add_gpus(registry: &mut Registry, fields: &Fields, choice: &GpuChoice) -> anyhow::Result<Vec<String>> {
    let mut named: Vec<&AlgorithmId> = fields.algorithms();
    named.retain(|id| !gpus::uses(id).is_empty());
    if named.is_empty() {
        return Ok(Vec::new());
    }
    if choice.no_gpus {
        return Ok(named.into_iter().map(|id| format!("{id} is left out by --no-gpus")).collect());
    }
    let seen = gpus::look()?;
    choice.check(&seen)?;
    let mut warnings: Vec<String> = Vec::new();
    let (taken, left_out): (Vec<_>, Vec<_>) = seen.identities.iter().cloned().partition(|g| choice.takes(g));
    for id in named {
        let out = left_out.iter().find(|g| gpus::uses(id).contains(&g.index));
        warnings.extend(seen.lacks(gpus::uses(id)).map(|why| format!("{id} is left out: {why}")));
        warnings.extend(out.map(|g| match choice.only[..] {
            [] => {
                format!("{id} is left out: gpu{} ({}) is a program on the CPU; --software-gpus takes it in", g.index, g.name)
            }
            _ => format!("{id} is left out: --gpu does not name gpu{}", g.index),
        }));
    }
    if !taken.is_empty() {
        match seen.load() {
            Ok(gpus) => registry.add_gpus(&gpus.choose(|g| taken.contains(g))),
            Err(why) => warnings.push(why),
        }
    }
    Ok(warnings)
}

/// What is told about the fields.
struct Origin {
    source: Source,
    extrapolated: bool,
    warnings: Vec<String>,
}

/// The fields of a file, which may be a report whose timings they are measured from.
///
/// # Errors
/// When the file is neither, or tells of other revisions of the algorithms than those of this build.
fn read_fields(path: &Path, registry: &Registry, choice: &GpuChoice) -> anyhow::Result<Fields> {
    let fresh = |stale: Vec<String>| match &stale[..] {
        [] => Ok(()),
        _ => bail!("{} is stale: {}; predict again or probe again", path.display(), stale.join("; ")),
    };
    match read_document(path)? {
        Document::Fields(fields) => {
            fresh(revisions::stale_in_fields(&fields, registry))?;
            Ok(*fields)
        }
        Document::Report(mut report) => {
            choice.restrict(&mut report);
            fresh(revisions::stale_in_report(&report, registry))?;
            let mut fields = train::measured_fields(&report, train::slice_scenario(&report))
                .with_context(|| format!("{} gives no fields", path.display()))?;
            let machine = &report.hardware.machine;
            if machine.physical_id != measure::machine().physical_id {
                fields.warnings.push(format!("the report was measured on another machine: {}", machine.cpu));
            }
            Ok(fields)
        }
        _ => bail!("{} is a model; give fields or a report, or leave --fields out to have them predicted", path.display()),
    }
}

fn answer<'a>(course: &Course, outcome: &'a simulation::Outcome, origin: Origin) -> Answer<'a> {
    let objects = || outcome.frames.iter().map(|f| f.objects);
    let named = || outcome.fixed.iter().map(ToString::to_string).enumerate();
    let fixed = named().filter_map(|(k, id)| Some((id, outcome.fixed_ms(k)?))).collect();
    let left_out = named().filter_map(|(k, id)| {
        let (after_frame, at_least_ms) = outcome.left(k)?;
        Some((id, LeftOut { after_frame, at_least_ms }))
    });
    let best = outcome.best_fixed();
    let mut decisions: Vec<Decision<'_>> = Vec::new();
    let mut before = None;
    for (at, frame) in outcome.frames.iter().enumerate() {
        if let Some(k) = frame.chosen.filter(|&k| before != Some(k)) {
            decisions.push(Decision { from_frame: at, objects: frame.objects, algorithm: &outcome.fixed[k] });
            before = Some(k);
        }
    }
    Answer {
        scenario: course.scenario.to_string(),
        frames: outcome.frames.len(),
        objects: Range { min: objects().min().unwrap_or(0), max: objects().max().unwrap_or(0) },
        repeats: outcome.repeats,
        seed: course.seed,
        interrupted: outcome.interrupted,
        foreign_load: outcome.foreign_load,
        source: origin.source,
        extrapolated: origin.extrapolated,
        warnings: origin.warnings,
        total_ms: Totals { adaptive: outcome.adaptive_ms(), oracle: outcome.oracle_ms(), fixed },
        left_out: left_out.collect(),
        regret: outcome.regret(),
        best_fixed: best.map_or_else(String::new, |(k, _)| outcome.fixed[k].to_string()),
        over_best_fixed: best.map_or(1.0, |(_, ms)| outcome.adaptive_ms() / ms),
        worst_frame: outcome.worst_frame(),
        switches: outcome.switches(),
        decisions,
    }
}

fn text(answer: &Answer<'_>) -> String {
    let Answer { scenario, frames, repeats, .. } = answer;
    let mut text = format!(
        "{scenario}, {frames} frames of {} to {} objects, medians of {repeats} repeats, verified against each other\n\n",
        answer.objects.min, answer.objects.max
    );
    let oracle = answer.total_ms.oracle;
    let row = |name: &str, ms: f64| vec![name.to_owned(), format!("{ms:.2}"), format!("{:.3}", ms / oracle)];
    let mut fixed: Vec<(&String, f64)> = answer.total_ms.fixed.iter().map(|(id, ms)| (id, *ms)).collect();
    fixed.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut rows = vec![["run by", "total ms", "over the oracle"].map(str::to_owned).to_vec()];
    rows.push(row("oracle (best at every frame)", oracle));
    rows.push(row("adaptive", answer.total_ms.adaptive));
    rows.extend(fixed.iter().map(|(id, ms)| row(id, *ms)));
    text += &table::columns(&rows);
    for (id, LeftOut { after_frame, at_least_ms }) in &answer.left_out {
        text +=
            &format!("{id} left the course after frame {after_frame}, hopeless: at least {at_least_ms:.2} ms until then\n");
    }
    text += &format!(
        "\nRegret {:.2} %, {} switches, worst frame {:.2} times the oracle's, {:.3} of the best fixed ({}).",
        answer.regret * 100.0,
        answer.switches,
        answer.worst_frame,
        answer.over_best_fixed,
        answer.best_fixed
    );
    if let Some(load) = answer.foreign_load {
        text += &format!("\nOther programs took {:.0} % of the CPU, median over the frames.", load * 100.0);
    }
    for warning in &answer.warnings {
        text += &format!("\nwarning: {warning}");
    }
    if answer.interrupted {
        text += "\nInterrupted: the repeats that were complete are shown.";
    }
    text
}
