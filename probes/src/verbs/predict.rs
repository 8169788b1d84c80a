//! `sapwise predict`: the tuning of a machine without a sweep, or from the one that its report holds.

use super::predict_kinds;
use crate::algorithms::Algorithms;
use crate::args::Predict;
use crate::check::{doubts, hardware_disturbed, hardware_doubts};
use crate::exit::Outcome;
use crate::hardware::{self, measure_hardware};
use crate::prediction::{self, Slice};
use crate::terminal::Terminal;
use crate::{interrupt, output, outputs, revisions, shell, summary};
use anyhow::{Context, bail};
use sapwise::{Model, Tuning, json, usable_cores};
use sapwise_lab::data::usual_scenario;
use sapwise_lab::data::{Document, read_document};
use sapwise_lab::fit::measured_tuning;
use sapwise_lab::report::Report;
use sapwise_lab::write::write_text;
use sapwise_scenes::Scenario;
use std::path::{Path, PathBuf};

pub(crate) fn run(arguments: &Predict, algorithms: &Algorithms) -> anyhow::Result<Outcome> {
    hardware::check_threads(arguments.threads)?;
    if let Some(folder) = arguments.report.as_deref().filter(|path| path.is_dir()) {
        return predict_kinds::run(folder, arguments, algorithms);
    }
    let report = arguments.report.as_deref().map(read_report).transpose()?;
    let inputs: Vec<PathBuf> = arguments.report.iter().chain(&arguments.model).cloned().collect();
    outputs::check(&inputs, &arguments.out.iter().collect::<Vec<_>>())?;
    let model = prediction::model(arguments.model.as_deref())?.model;
    // Until here Ctrl-C ends the program, even when it waits for a pipe.
    interrupt::listen()?;
    let terminal = Terminal::of_standard_output();
    let mut text = String::new();
    // A sentence on GPUs for people, and their failures for the file.
    let (mut told, mut remarks) = (None, Vec::new());
    // Whether a sample returned wrong pairs.
    let mut wrong = false;
    let mut tuning = match &report {
        Some(report) => {
            if !arguments.measured {
                let all = report.hardware.gpus.iter().map(|g| g.gpu.clone());
                told = arguments.gpus.tell(&all.filter(|g| !arguments.gpus.takes(g)).collect::<Vec<_>>());
            }
            of_report(report, arguments, &model, algorithms)?
        }
        None => {
            let (hardware, measured) = measure_hardware(arguments.threads, &arguments.gpus)?;
            text = format!("{}\n", summary::hardware(&hardware, terminal));
            remarks = hardware_doubts(&hardware);
            remarks.extend(hardware_disturbed(&hardware));
            interrupt::check()?;
            told = summary::gpus_left_out(&arguments.gpus, &hardware, &measured.left_out, &measured.remarks);
            remarks.extend(measured.remarks);
            let (gpus, slice) = (measured.usable, Slice::of(arguments.scenario.unwrap_or(Scenario::Uniform))?);
            if arguments.samples > 0 {
                let sampled =
                    prediction::predict_and_sample(&model, &hardware, &gpus, &slice, algorithms, arguments.samples)?;
                wrong = sampled.1;
                sampled.0
            } else {
                prediction::predict(&model, &hardware, &gpus, &slice, algorithms)?
            }
        }
    };
    tuning.warnings.append(&mut remarks);
    if let Some(path) = &arguments.out {
        write_text(path, &json::write_tuning(&tuning)?)?;
    }
    let outcome = if wrong || interrupt::requested() { Outcome::Failed } else { Outcome::Done };
    if arguments.json {
        output::print_file(&json::write_tuning(&tuning)?)?;
        return Ok(outcome);
    }
    text += &summary::tuning(&tuning, terminal);
    if report.is_some() && arguments.samples > 0 {
        text += "\nNo sample was taken: samples are timed on this machine, and the prediction is for the machine of the report.\n";
    }
    if let Some(told) = told {
        text += &format!("\n{told}\n");
    }
    text += &match &arguments.out {
        Some(path) => {
            format!("Written to {}.\nNext: sapwise run fragmentation --tuning {}", path.display(), shell::path(path))
        }
        None => format!("Next: {}", shell::again(&["--out", "tuning.json"])),
    };
    output::print(&text)?;
    Ok(outcome)
}

/// The tuning of the machine of a report, with what is doubtful about it.
pub(super) fn of_report(
    report: &Report,
    arguments: &Predict,
    model: &Model,
    algorithms: &Algorithms,
) -> anyhow::Result<Tuning> {
    let mut tuning = if arguments.measured {
        let mut report = report.clone();
        arguments.gpus.restrict(&mut report);
        let scenario = arguments.scenario.map(|s| s.to_string());
        measured_tuning(&report, scenario.as_deref().unwrap_or_else(|| usual_scenario(&report)), Some(model))?
    } else {
        let gpus = report.hardware.gpus.iter().map(|g| g.gpu.clone());
        let taken: Vec<_> = gpus.filter(|g| arguments.gpus.takes(g)).collect();
        let slice = Slice::of(arguments.scenario.unwrap_or(Scenario::Uniform))?;
        let mut tuning = prediction::predict(model, &report.hardware, &taken, &slice, algorithms)?;
        // No sample is taken of it: it may be another machine than this one.
        prediction::advise(
            &mut tuning,
            "the machine of the report is unlike those of training: predict with --measured from a report that `sapwise probe` has made there",
        );
        tuning
    };
    // What a model predicts does not rest on the timings of the report.
    if arguments.measured {
        let stale = revisions::stale_in_report(report, &algorithms.registry(usable_cores()));
        tuning.warnings.extend(stale.into_iter().map(|why| format!("the report is stale: {why}; probe again")));
    }
    tuning.warnings.extend(doubts(report).into_iter().map(|doubt| format!("the report is doubtful: {doubt}")));
    Ok(tuning)
}

fn read_report(path: &Path) -> anyhow::Result<Report> {
    match read_document(path, &output::warn).context("the report can't be used")? {
        Document::Report(report) => Ok(*report),
        _ => bail!("{} is no report; make one with `sapwise probe --out R.json`", path.display()),
    }
}
