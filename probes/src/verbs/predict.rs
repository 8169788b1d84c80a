//! `sapwise predict`: the tuning of a machine without a sweep, or from the one that its report holds.

use super::predict_kinds;
use crate::algorithms::Algorithms;
use crate::args::Predict;
use crate::check::hardware_doubts;
use crate::exit::Outcome;
use crate::hardware::{self, measure_hardware};
use crate::prediction::{self, Slice};
use crate::terminal::Terminal;
use crate::{interrupt, output, outputs, shell, summary};
use anyhow::Context;
use sapwise_lab::data::read_report;
use sapwise_lab::write::write_text;
use sapwise_scenes::Scenario;
use sapwise_tune::json;
use std::path::PathBuf;

pub(crate) fn run(arguments: &Predict, algorithms: &Algorithms) -> anyhow::Result<Outcome> {
    hardware::check_threads(arguments.threads)?;
    if let Some(folder) = arguments.report.as_deref().filter(|path| path.is_dir()) {
        return predict_kinds::run(folder, arguments, algorithms);
    }
    let report = arguments.report.as_deref().map(|path| read_report(path, &output::warn)).transpose();
    let report = report.context("the report can't be used")?.map(|(_, report)| report);
    let inputs: Vec<PathBuf> = arguments.report.iter().chain(&arguments.model).cloned().collect();
    outputs::check(&inputs, &arguments.out.iter().collect::<Vec<_>>())?;
    let model = prediction::model(arguments.model.as_deref())?.model;
    // Until here Ctrl-C ends the program, even when it waits for a pipe.
    interrupt::listen()?;
    let terminal = Terminal::of_standard_output();
    // A sentence on GPUs for people, and their failures for the file.
    let (mut told, mut remarks) = (None, Vec::new());
    let (hardware, mut tuning) = match report {
        Some(report) => {
            if !arguments.measured {
                let all = report.hardware.gpus.iter().map(|g| g.gpu.clone());
                told = arguments.gpus.tell(&all.filter(|g| !arguments.gpus.takes(g)).collect::<Vec<_>>());
            }
            let tuning = prediction::of_report(&report, arguments, &model, algorithms)?;
            (report.hardware, tuning)
        }
        None => {
            let (hardware, measured) = measure_hardware(arguments.threads, &arguments.gpus)?;
            remarks = [hardware_doubts(&hardware), hardware.disturbed()].concat();
            interrupt::check()?;
            hardware::check_plausible(&hardware)?;
            told = summary::gpus_left_out(&arguments.gpus, &hardware, &measured.left_out, &measured.remarks);
            remarks.extend(measured.remarks);
            let (gpus, slice) = (measured.usable, Slice::of(arguments.scenario.unwrap_or(Scenario::Uniform))?);
            let tuning = prediction::predict(&model, &hardware, &gpus, &slice, algorithms)?;
            (hardware, tuning)
        }
    };
    tuning.warnings.append(&mut remarks);
    if let Some(path) = &arguments.out {
        write_text(path, &json::write_tuning(&tuning)?)?;
    }
    let outcome = if interrupt::requested() { Outcome::Failed } else { Outcome::Done };
    if arguments.json {
        output::print_file(&json::write_tuning(&tuning)?)?;
        return Ok(outcome);
    }
    let mut text = if arguments.verbose {
        format!("{}\n{}", summary::hardware(&hardware, terminal), summary::tuning(&tuning, terminal))
    } else {
        summary::prediction(&hardware, &tuning, terminal)
    };
    text.extend(told.map(|told| format!("{told}\n")));
    text += &match &arguments.out {
        Some(path) => {
            let next = format!("run fragmentation --tuning {}{}", shell::path(path), arguments.gpus.words());
            format!("Written to {}.\n{}", path.display(), shell::next(&next))
        }
        None => shell::next(&shell::again(&["--out", "tuning.json"])),
    };
    output::print(&text)?;
    Ok(outcome)
}
