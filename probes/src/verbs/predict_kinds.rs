//! `sapwise predict --report FOLDER`: one tuning for each kind of machine in a folder of reports.

use crate::algorithms::Algorithms;
use crate::args::Predict;
use crate::exit::{Outcome, WrongUsage};
use crate::progress::Progress;
use crate::terminal::Terminal;
use crate::{interrupt, output, outputs, prediction, shell};
use anyhow::{Context, bail};
use sapwise_lab::data::read_reports;
use sapwise_lab::kinds::{Kind, Times, unusable};
use sapwise_lab::report::{Label, Report};
use sapwise_lab::text::count;
use sapwise_lab::write::write_text;
use sapwise_tune::{GpuIdentity, json};
use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::path::Path;

pub(super) fn run(folder: &Path, arguments: &Predict, algorithms: &Algorithms) -> anyhow::Result<Outcome> {
    let Some(out) = arguments.out.as_deref().filter(|_| !arguments.json) else {
        bail!(WrongUsage(format!(
            "{} is a folder: name one report in it, or add `--out FOLDER` (without --json) for one tuning a machine",
            folder.display()
        )));
    };
    // The next call would take the tunings for reports.
    if outputs::place(out).starts_with(outputs::place(folder)) {
        bail!(WrongUsage(format!("{} holds the reports; name a folder elsewhere for the tunings", folder.display())));
    }
    let model = prediction::model(arguments.model.as_deref())?.model;
    interrupt::listen()?;
    let progress = Progress::new(0);
    let mut reports = read_reports(&[folder.to_owned()], &progress)?;
    drop(progress);
    // Published machines are in nobody's fleet.
    reports.retain(|(_, report)| report.label != Label::Published);
    if reports.is_empty() {
        bail!("{} holds published parameters only; name a folder with measured reports", folder.display());
    }
    let chosen = choose(&reports, arguments);
    if chosen.values().any(|(_, best)| best.is_ok()) {
        outputs::make_folder(out)?;
    }
    let terminal = Terminal::of_standard_output();
    let mut rows = vec![["tuning", "machine", "from", ""].map(str::to_owned).to_vec()];
    let mut without = 0;
    for (file, (kind, best)) in chosen {
        interrupt::check()?;
        let machine = format!("{}, {}, {}", kind.cpu, count(kind.cores as usize, "core"), kind.simd);
        let (name, report) = match best {
            Ok(best) => &reports[best],
            Err(why) => {
                without += 1;
                rows.push(vec![file, machine, "-".to_owned(), terminal.bad(&format!("no tuning: {why}"))]);
                continue;
            }
        };
        let tuning = prediction::of_report(report, arguments, &model, algorithms).with_context(|| name.clone())?;
        write_text(&out.join(&file), &json::write_tuning(&tuning)?)?;
        let told = tuning.warnings.first().map_or(terminal.good("good"), |why| terminal.warning(why));
        rows.push(vec![file, machine, name.clone(), told]);
    }
    let mut text = terminal.table(&rows);
    let written = rows.len() - 1 - without;
    text += &format!("\n{} written to {}.\n", count(written, "tuning"), out.display());
    if written > 0 {
        text += "A program reads the one that Machine::tuning_file names and passes it to Adaptive::new.\n";
    }
    text += &shell::next(&format!("check {}", shell::path(folder)));
    output::print(&text)?;
    Ok(if without == 0 { Outcome::Done } else { Outcome::Failed })
}

/// Returns for each file name the kind of machine, and its report whose times are nearest to those of the others, or
/// why none of its reports can represent it.
///
/// Hosts that differ only in their clock share one file: the kind with the most reports gets it.
fn choose(reports: &[(String, Report)], arguments: &Predict) -> BTreeMap<String, (Kind, Result<usize, &'static str>)> {
    let mut kinds: BTreeMap<Kind, Vec<usize>> = BTreeMap::new();
    for (k, (_, report)) in reports.iter().enumerate() {
        kinds.entry(Kind::of(report)).or_default().push(k);
    }
    let mut kinds: Vec<(Kind, Vec<usize>)> = kinds.into_iter().collect();
    kinds.sort_by_key(|(_, members)| Reverse(members.len()));
    let mut chosen: BTreeMap<String, (Kind, Result<usize, &'static str>)> = BTreeMap::new();
    for (kind, members) in kinds {
        let hardware = &reports[members[0]].1.hardware;
        let gpus: Vec<GpuIdentity> =
            hardware.gpus.iter().map(|g| g.gpu.clone()).filter(|g| arguments.gpus.takes(g)).collect();
        let file = hardware.machine.tuning_file(kind.cores, &gpus);
        if !chosen.get(&file).is_some_and(|(_, best)| best.is_ok()) {
            let why = members.iter().find_map(|&k| unusable(&reports[k].1)).unwrap_or_default();
            let usable = members.into_iter().filter(|&k| unusable(&reports[k].1).is_none());
            chosen.insert(file, (kind, nearest(reports, &usable.collect::<Vec<usize>>()).ok_or(why)));
        }
    }
    chosen
}

/// Returns the report whose times are nearest to those of the others.
fn nearest(reports: &[(String, Report)], members: &[usize]) -> Option<usize> {
    let times: Vec<Times> = members.iter().map(|&k| Times::of(&reports[k].1)).collect();
    let off = |own: usize| {
        let others: Vec<&Times> = times.iter().enumerate().filter(|(k, _)| *k != own).map(|(_, t)| t).collect();
        times[own].over(&others).map_or(0.0, |agreement| agreement.median.ln().abs())
    };
    let offs: Vec<f64> = (0..times.len()).map(off).collect();
    (0..members.len()).min_by(|&a, &b| offs[a].total_cmp(&offs[b])).map(|k| members[k])
}
