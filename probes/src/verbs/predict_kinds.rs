//! `sapwise predict --report FOLDER`: a tuning for each kind of machine among reports.

use super::predict::of_report;
use crate::algorithms::Algorithms;
use crate::args::Predict;
use crate::exit::{Outcome, WrongUsage};
use crate::progress::Progress;
use crate::terminal::Terminal;
use crate::{interrupt, output, outputs, prediction, shell};
use anyhow::{Context, bail};
use sapwise::{GpuIdentity, json};
use sapwise_lab::data::read_reports;
use sapwise_lab::fleet::{Fleet, Kind, Node};
use sapwise_lab::report::{Report, Restricted};
use sapwise_lab::text::count;
use sapwise_lab::write::write_text;
use std::collections::BTreeMap;
use std::path::Path;

/// A report with the name of its file.
type Named = (String, Report);

/// The report that stands for a kind of machine.
struct Choice<'a> {
    kind: Kind,
    /// `None` where none can be believed.
    best: Option<(Node, &'a Named)>,
}

pub(super) fn run(folder: &Path, arguments: &Predict, algorithms: &Algorithms) -> anyhow::Result<Outcome> {
    let Some(out) = arguments.out.as_deref().filter(|_| !arguments.json) else {
        let why = "the reports of a folder may be of several kinds of machines: name a folder for their tunings with --out, without --json";
        return Err(WrongUsage(why.to_owned()).into());
    };
    if out.canonicalize().is_ok_and(|out| folder.canonicalize().is_ok_and(|folder| folder == out)) {
        let why = format!("{} holds the reports; name another folder for the tunings", out.display());
        return Err(WrongUsage(why).into());
    }
    let model = prediction::model(arguments.model.as_deref())?.model;
    interrupt::listen()?;
    let progress = Progress::new(0);
    let reports = read_reports(&[folder.to_owned()], &progress)?;
    drop(progress);
    outputs::make_folder(out)?;
    let terminal = Terminal::of_standard_output();
    let mut rows = vec![["tuning", "machine", "from", ""].map(str::to_owned).to_vec()];
    let mut without = 0;
    for (file, Choice { kind, best }) in choose(&reports, arguments) {
        interrupt::check()?;
        let machine = format!("{}, {}, {}", kind.cpu, count(kind.cores as usize, "core"), kind.simd);
        let Some((_, (name, report))) = best else {
            without += 1;
            let why = "none of its reports can be believed; `sapwise fleet` tells why";
            rows.push(vec![file, machine, "-".to_owned(), terminal.bad(why)]);
            continue;
        };
        let tuning = of_report(report, arguments, &model, algorithms).with_context(|| name.clone())?;
        write_text(&out.join(&file), &json::write_tuning(&tuning)?)?;
        let told = tuning.warnings.first().map_or(terminal.good("good"), |why| terminal.warning(why));
        rows.push(vec![file, machine, name.clone(), told]);
    }
    if rows.len() == 1 {
        bail!("none of the reports in {} is of a machine with all it has", folder.display());
    }
    let mut text = terminal.table(&rows);
    let written = rows.len() - 1 - without;
    text += &format!("\n{} written to {}.\n", count(written, "tuning"), out.display());
    text += "A program reads the one that Machine::tuning_file names and passes it to Adaptive::new.\n";
    text += &format!("Next: sapwise fleet {}", shell::path(folder));
    output::print(&text)?;
    Ok(if without == 0 { Outcome::Done } else { Outcome::Failed })
}

/// For each file name the kind of machine and the report that stands for it: of those that can be believed the one whose times are nearest to
/// those of its kind. What was measured beside other programs on purpose stands for no machine that a program will start on.
fn choose<'a>(reports: &'a [Named], arguments: &Predict) -> BTreeMap<String, Choice<'a>> {
    let fleet = Fleet::of(reports);
    let off = |node: &Node| node.over_its_kind.map_or(0.0, |ratio| ratio.ln().abs());
    // The kinds stand in the order of how many nodes they have. Hosts that only their clock tells apart have one file: the first such kind's.
    let mut chosen: BTreeMap<String, Choice<'_>> = BTreeMap::new();
    for node in &fleet.nodes {
        let kind = &fleet.kinds[node.kind];
        let beside = |what: &Restricted| matches!(what, Restricted::ContendedMemory | Restricted::ContendedCache);
        if kind.taken.iter().any(beside) {
            continue;
        }
        let Some(named) = reports.iter().find(|(name, _)| *name == node.file) else { continue };
        let hardware = &named.1.hardware;
        let gpus: Vec<GpuIdentity> =
            hardware.gpus.iter().map(|g| g.gpu.clone()).filter(|g| arguments.gpus.takes(g)).collect();
        let file = hardware.machine.tuning_file(kind.cores, &gpus);
        let choice = chosen.entry(file).or_insert_with(|| Choice { kind: kind.clone(), best: None });
        let nearer = choice.best.as_ref().is_none_or(|(other, _)| other.kind == node.kind && off(node) < off(other));
        if node.problem.is_none() && nearer {
            choice.best = Some((node.clone(), named));
        }
    }
    chosen
}
