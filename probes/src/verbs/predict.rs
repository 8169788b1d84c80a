//! `sapwise predict`: the tuning of a machine without a sweep, or from the one that its report holds.

use crate::algorithms::Algorithms;
use crate::args::Predict;
use crate::document::read_document;
use crate::exit::{Outcome, WrongUsage};
use crate::hardware::{self, measure_hardware};
use crate::prediction::{self, Slice};
use crate::terminal::{self, Terminal};
use crate::{files, interrupt, output, summary, train};
use anyhow::{Context, bail};
use sapwise::json::{self, Document};
use sapwise::{Model, Report};
use sapwise_scenes::Scenario;
use std::path::Path;

pub(crate) fn run(arguments: &Predict, algorithms: &Algorithms) -> anyhow::Result<Outcome> {
    hardware::check_threads(arguments.threads)?;
    let report = arguments.report.as_deref().map(read_report).transpose()?;
    files::refuse_overwriting(arguments.report.as_slice(), &arguments.out.iter().collect::<Vec<_>>())?;
    let model = if arguments.measured { None } else { Some(model(arguments.model.as_deref())?) };
    // Until here Ctrl-C ends the program, even when it waits for a pipe.
    interrupt::listen()?;
    let terminal = Terminal::of_standard_output();
    let (mut text, mut slice) = (String::new(), None);
    // A sentence on GPUs for people, and what went wrong with them for the file.
    let (mut told, mut remarks) = (None, Vec::new());
    // Whether a sample gave wrong pairs.
    let mut wrong = false;
    let mut tuning = match (&model, &report) {
        (None, Some(report)) => {
            let mut report = report.clone();
            arguments.gpus.restrict(&mut report);
            let report = &report;
            let scenario = arguments.scenario.map(|s| s.to_string());
            train::measured_tuning(report, scenario.as_deref().unwrap_or_else(|| train::slice_scenario(report)))?
        }
        (None, None) => return Err(WrongUsage("--measured needs --report".to_owned()).into()),
        (Some(model), report) => {
            let scenario = arguments.scenario.unwrap_or(Scenario::Uniform);
            let (hardware, measured) = match report {
                Some(report) => (train::as_at_the_points(&report.hardware, report), None),
                None => {
                    let (hardware, measured) = measure_hardware(arguments.threads, &arguments.gpus)?;
                    (hardware, Some(measured))
                }
            };
            if report.is_none() {
                text = format!("{}\n", summary::hardware(&hardware, terminal));
            }
            interrupt::check()?;
            let gpus = match measured {
                Some(measured) => {
                    told = summary::gpus_left_out(&arguments.gpus, &hardware, &measured.left_out, &measured.remarks);
                    remarks = measured.remarks;
                    measured.usable
                }
                None => {
                    let all = hardware.gpus.iter().map(|g| g.gpu.clone());
                    let (taken, left_out): (Vec<_>, Vec<_>) = all.partition(|g| arguments.gpus.takes(g));
                    told = arguments.gpus.tell(&left_out);
                    taken
                }
            };
            let slice = slice.insert(Slice::of(scenario)?);
            if report.is_none() && arguments.samples > 0 {
                let sampled = prediction::predict_and_sample(model, &hardware, &gpus, slice, algorithms, arguments.samples)?;
                wrong = sampled.1;
                sampled.0
            } else {
                prediction::predict(model, &hardware, &gpus, slice, algorithms)?
            }
        }
    };
    tuning.warnings.append(&mut remarks);
    if let Some(path) = &arguments.out {
        files::write_text(path, &json::write(&tuning)?)?;
    }
    let outcome = if wrong || interrupt::requested() { Outcome::Failed } else { Outcome::Done };
    if arguments.json {
        output::print_json(&tuning)?;
        return Ok(outcome);
    }
    text += &summary::tuning(&tuning, terminal);
    let chart = match (&slice, &report) {
        (Some(slice), _) => terminal::costs(&tuning, &slice.loads),
        (None, report) => report.as_ref().and_then(|report| terminal::timings(report, &tuning.scenario)),
    };
    text += &chart.and_then(|chart| chart.draw(terminal)).map(|chart| format!("\n{chart}")).unwrap_or_default();
    if report.is_some() && model.is_some() && arguments.samples > 0 {
        text += "\nNo sample was taken: they are taken on this machine, and the prediction is for that of a report.\n";
    }
    if let Some(told) = told {
        text += &format!("\n{told}\n");
    }
    text += &match &arguments.out {
        Some(path) => format!("Written to {}. Next: sapwise run fragmentation --tuning {}", path.display(), path.display()),
        None => "Next: the same with --out tuning.json, then sapwise run fragmentation --tuning tuning.json".to_owned(),
    };
    output::print(&text)?;
    Ok(outcome)
}

/// The model in a file, or the one that is built in.
///
/// # Errors
/// When the file is no sound model.
pub(super) fn model(path: Option<&Path>) -> anyhow::Result<Model> {
    let Some(path) = path else { return Ok(Model::built_in()?) };
    match read_document(path)? {
        Document::Model(model) => Ok(*model),
        _ => bail!("{} is no model; make one with `sapwise train`", path.display()),
    }
}

fn read_report(path: &Path) -> anyhow::Result<Report> {
    match read_document(path).context("the report can't be used")? {
        Document::Report(report) => Ok(*report),
        _ => bail!("{} is no report; make one with `sapwise probe --out R.json`", path.display()),
    }
}
