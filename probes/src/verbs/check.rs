//! `sapwise check`: whether files are sound, current and applicable here.

use crate::args::Check;
use crate::document::read_document;
use crate::exit::Outcome;
use crate::gpus::{Seen, difference, look, uses};
use crate::{output, revisions};
use sapwise::json::Document;
use sapwise::measure::{self, Family, Options};
use sapwise::model::Range;
use sapwise::report::Label;
use sapwise::{
    AlgorithmId, Backend, BackendClass, Fields, GpuKind, How, Machine, Model, Parameter, Registry, Report, usable_cores,
};
use serde::Serialize;
use std::cell::OnceCell;
use std::path::Path;

/// The answer for machines.
#[derive(Serialize)]
struct Answer {
    files: Vec<Finding>,
}

/// What is known about one file.
#[derive(Debug, Serialize)]
struct Finding {
    file: String,
    /// `None` when it could not be read.
    schema: Option<&'static str>,
    /// Readable, complete, and no figure in it is impossible.
    sound: bool,
    /// The algorithms are those of this build. `None` when that could not be looked at.
    current: Option<bool>,
    /// It may be used on this machine. `None` when that could not be looked at.
    applicable: Option<bool>,
    /// What makes the file fail.
    problems: Vec<String>,
    /// What the user should know beside.
    notes: Vec<String>,
}

/// What files are held against.
struct Here {
    registry: Registry,
    machine: Machine,
    /// Looked for when the first file names one.
    gpus: OnceCell<Seen>,
}

pub(crate) fn run(arguments: &Check) -> anyhow::Result<Outcome> {
    let here = Here { registry: Registry::new(), machine: measure::machine(), gpus: OnceCell::new() };
    let files: Vec<Finding> = arguments.files.iter().map(|path| here.look_at(path)).collect();
    let failed = files.iter().any(|f| !f.problems.is_empty());
    if arguments.json {
        output::print_json(&Answer { files })?;
    } else {
        files.iter().try_for_each(|f| output::print(&text(f)))?;
    }
    Ok(if failed { Outcome::Failed } else { Outcome::Done })
}

fn text(finding: &Finding) -> String {
    let state = if finding.problems.is_empty() { "good" } else { "BAD" };
    let schema = finding.schema.map_or(String::new(), |s| format!(" {s}"));
    let mut text = format!("{}:{schema} {state}", finding.file);
    for problem in &finding.problems {
        text.push_str(&format!("\n  problem: {problem}"));
    }
    for note in &finding.notes {
        text.push_str(&format!("\n  note: {note}"));
    }
    text
}

impl Here {
    fn look_at(&self, path: &Path) -> Finding {
        let mut finding = Finding {
            file: path.display().to_string(),
            schema: None,
            sound: false,
            current: None,
            applicable: None,
            problems: Vec::new(),
            notes: Vec::new(),
        };
        match read_document(path) {
            Err(error) => finding.problems.push(format!("{error:#}")),
            Ok(document) => {
                finding.sound = true;
                match document {
                    Document::Report(report) => self.report(&report, &mut finding),
                    Document::Model(model) => self.model(&model, &mut finding),
                    Document::Fields(fields) => self.fields(&fields, &mut finding),
                    _ => finding.notes.push("a schema that this command does not know how to check".to_owned()),
                }
            }
        }
        finding
    }

    fn report(&self, report: &Report, finding: &mut Finding) {
        finding.schema = Some("report/1");
        finding.set_current(revisions::stale_in_report(report, &self.registry), "probe again");
        let same = report.hardware.machine.physical_id == self.machine.physical_id;
        let other_gpus = if same { self.other_gpus(report) } else { Vec::new() };
        finding.applicable = Some(same && other_gpus.is_empty());
        finding.notes.extend(other_gpus);
        let cpu = &report.hardware.machine.cpu;
        finding.notes.push(match report.label {
            Label::Simulated => format!("simulated: no evidence of accuracy; {cpu}"),
            Label::Published => format!("published parameters without timings, `train` refuses them: {cpu}"),
            _ if same => "measured on a machine like this one".to_owned(),
            _ => format!("measured on another machine: {cpu}"),
        });
        if !report.provenance.optimised && report.label != Label::Published {
            finding.notes.push("measured by a build without optimisation: `train` refuses it".to_owned());
        }
        finding.notes.extend(report.remarks.iter().map(|r| format!("remark: {r}")));
    }

    fn model(&self, model: &Model, finding: &mut Finding) {
        finding.schema = Some("model/1");
        let used = model.methods.iter().map(|m| ((m.backend, m.method.as_str()), m.revision));
        finding.set_current(revisions::stale(used, &self.registry), "train it again on new reports");
        finding.applicable = Some(finding.current == Some(true));
        let known = model.trained_on.iter().any(|t| t.physical_id == self.machine.physical_id);
        finding.notes.push(if known {
            "trained on a machine like this one".to_owned()
        } else {
            "not trained on a machine like this one; `sapwise predict` measures whether it extrapolates here".to_owned()
        });
        if model.is_simulated() {
            finding.notes.push("trained on simulated machines: no evidence of accuracy".to_owned());
        }
        let cores = usable_cores();
        let on_cpu = model.methods.iter().filter(|m| m.backend == BackendClass::Cpu);
        let most = on_cpu.map(|m| m.max_threads).max().unwrap_or(0);
        if cores > most {
            finding.notes.push(format!("extrapolates: trained on up to {most} threads, this machine has {cores}"));
        }
        finding.notes.extend(outside(model));
    }

    fn fields(&self, fields: &Fields, finding: &mut Finding) {
        finding.schema = Some("fields/1");
        finding.set_current(
            revisions::stale_in_fields(fields, &self.registry),
            "predict again, or probe again where they were measured",
        );
        let mut wanted = fields.algorithms();
        wanted.extend(fields.steps.iter().map(|s| &s.algorithm));
        let mut missing: Vec<String> = wanted.into_iter().filter_map(|id| self.unavailable(id)).collect();
        missing.sort_unstable();
        missing.dedup();
        finding.applicable = Some(missing.is_empty());
        finding.problems.extend(missing);
        finding.notes.extend(self.programs(fields));
        if fields.extrapolated {
            finding.notes.push("predicted for a machine outside what the model was trained on".to_owned());
        }
    }

    /// Why an algorithm can't run here, if it can't.
    fn unavailable(&self, id: &AlgorithmId) -> Option<String> {
        if let Some(entry) = self.registry.entries().iter().find(|e| e.id == *id) {
            return entry.unavailable.as_ref().map(|why| format!("{id} can't run here: {why}"));
        }
        match id.backend() {
            // The revision check has told already that the method is unknown; without costs nothing has.
            _ if !revisions::is_known(id, &self.registry) => Some(format!("{id} is not in this build")),
            Backend::Cpu(threads) if *threads <= usable_cores() => None,
            Backend::Cpu(_) => Some(format!("{id} needs more than the {} cores of this machine", usable_cores())),
            Backend::Gpu(indices) => self.gpus().lacks(indices).map(|why| format!("{id} can't run here: {why}")),
            _ => Some(format!("{id} can't run here: this version does not know its processor")),
        }
    }

    /// The GPUs of this machine.
    fn gpus(&self) -> &Seen {
        self.gpus.get_or_init(|| {
            let remark = |error| format!("GPUs can't be looked for: {error:#}");
            look().unwrap_or_else(|error| Seen { identities: Vec::new(), remark: Some(remark(error)) })
        })
    }

    /// How the GPUs that a report has timings of differ from those of this machine.
    fn other_gpus(&self, report: &Report) -> Vec<String> {
        let mut timed: Vec<u32> = report.algorithms.iter().flat_map(|t| uses(&t.id)).copied().collect();
        timed.sort_unstable();
        timed.dedup();
        let there = |k: u32| report.hardware.gpu(k).map(|g| &g.gpu);
        let here = |k: u32| self.gpus().identities.iter().find(|g| g.index == k);
        timed.into_iter().filter_map(|k| difference(there(k), here(k))).collect()
    }

    /// Which algorithms of fields run on programs that act as GPUs.
    fn programs(&self, fields: &Fields) -> Vec<String> {
        let mut notes = Vec::new();
        for id in fields.algorithms().into_iter().filter(|id| !uses(id).is_empty()) {
            let gpus = self.gpus().identities.iter().filter(|g| uses(id).contains(&g.index));
            for gpu in gpus.filter(|g| g.kind == GpuKind::Software) {
                notes.push(format!("{id}: gpu{} is a program on the CPU here: {}", gpu.index, gpu.name));
            }
        }
        notes
    }
}

/// In which parameters that the system reports this machine lies outside the training. Those that take seconds to measure
/// are left to `predict`.
fn outside(model: &Model) -> Vec<String> {
    let quick = Options { brief: true, ..Options::default() };
    let families = [Family::Topology, Family::Caches].into_iter();
    let parameters: Vec<Parameter> = families.flat_map(|f| measure::family(f, &quick)).collect();
    let mut notes = Vec::new();
    for range in &model.ranges {
        let reported = parameters.iter().find(|p| p.name == range.parameter && p.how == How::Reported);
        let Some(value) = reported.and_then(|p| p.value) else { continue };
        // The same tolerance as that of a prediction.
        if value < range.min / 1.1 || value > range.max * 1.1 {
            let Range { parameter, min, max } = range;
            notes.push(format!("extrapolates: {parameter} is {value}, in training it was {min} to {max}"));
        }
    }
    notes
}

impl Finding {
    fn set_current(&mut self, stale: Vec<String>, remedy: &str) {
        self.current = Some(stale.is_empty());
        self.problems.extend(stale.into_iter().map(|s| format!("stale: {s}; {remedy}")));
    }
}
