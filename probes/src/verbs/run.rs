//! `sapwise run`: the in-line simulation.

use crate::args::Run;
use crate::document::read_document;
use crate::exit::Outcome;
use crate::hardware::measure_hardware;
use crate::simulation::{self, Course, simulate};
use crate::{files, interrupt, output, plot, prediction, table, train};
use anyhow::bail;
use sapwise::json::Document;
use sapwise::{Fields, Registry, Scenario, Source};
use serde::Serialize;
use std::collections::BTreeMap;

/// The answer for machines.
#[derive(Serialize)]
struct Answer<'a> {
    scenario: String,
    frames: usize,
    objects: Range,
    repeats: usize,
    seed: u64,
    interrupted: bool,
    source: Source,
    total_ms: Totals,
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
    fixed: BTreeMap<String, f64>,
}

#[derive(Serialize)]
struct Decision<'a> {
    from_frame: usize,
    objects: usize,
    algorithm: &'a sapwise::AlgorithmId,
}

pub(crate) fn run(arguments: &Run) -> anyhow::Result<Outcome> {
    interrupt::listen()?;
    let fields = fields(arguments)?;
    interrupt::check()?;
    let source = fields.source;
    let usual_frames =
        if arguments.scenario == Scenario::Fragmentation { Scenario::FRAGMENTATION_FRAMES as u32 } else { 200 };
    let course = Course {
        scenario: arguments.scenario,
        objects: arguments.objects as usize,
        frames: arguments.frames.unwrap_or(usual_frames) as usize,
        repeats: arguments.repeats as usize,
        seed: arguments.seed,
    };
    let mut registry = Registry::new();
    registry.pin_threads();
    let outcome = simulate(&course, fields, &registry)?;
    if let Some(path) = &arguments.plot {
        let svg = plot::simulation(&course, &outcome)?;
        files::write_atomically(path, |w| Ok(w.write_all(svg.as_bytes())?))?;
    }
    let answer = answer(&course, &outcome, source);
    if arguments.json {
        output::print_json(&answer)?;
    } else {
        let plotted = arguments.plot.as_ref().map(|p| format!("\nDrawn in {}.", p.display()));
        output::print(&(text(&answer) + &plotted.unwrap_or_default()))?;
    }
    Ok(if outcome.interrupted { Outcome::Failed } else { Outcome::Done })
}

/// The fields of the file, which may be a report whose timings they are measured from; else those predicted for this machine.
fn fields(arguments: &Run) -> anyhow::Result<Fields> {
    let Some(path) = &arguments.fields else {
        let hardware = measure_hardware(None)?;
        return prediction::predict(&super::predict::model(None)?, &hardware, Scenario::Uniform);
    };
    match read_document(path)? {
        Document::Fields(fields) => Ok(*fields),
        Document::Report(report) => train::measured_fields(&report, "uniform"),
        _ => bail!("{} is a model; give fields or a report, or leave --fields out to have them predicted", path.display()),
    }
}

fn answer<'a>(course: &Course, outcome: &'a simulation::Outcome, source: Source) -> Answer<'a> {
    let objects = || outcome.frames.iter().map(|f| f.objects);
    let fixed = outcome.fixed.iter().enumerate().map(|(k, id)| (id.to_string(), outcome.fixed_ms(k))).collect();
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
        source,
        total_ms: Totals { adaptive: outcome.adaptive_ms(), oracle: outcome.oracle_ms(), fixed },
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
    text += &format!(
        "\nRegret {:.2} %, {} switches, worst frame {:.2} times the oracle's, {:.3} of the best fixed ({}).",
        answer.regret * 100.0,
        answer.switches,
        answer.worst_frame,
        answer.over_best_fixed,
        answer.best_fixed
    );
    if answer.interrupted {
        text += "\nInterrupted: the repeats that were complete are shown.";
    }
    text
}
