//! Checks of a file: whether it is sound, current and usable here.

mod privacy;
mod report;
mod tuning;

use crate::algorithms::Algorithms;
use crate::gpus::{Seen, look};
use crate::revisions;
use sapwise::Registry;
use sapwise::algorithm::usable_cores;
use sapwise_lab::data::{Document, read_document};
use sapwise_lab::kinds::{Kind, Times, unusable};
use sapwise_tune::{Machine, Model, measure};
use serde::Serialize;
use std::cell::{OnceCell, RefCell};
use std::path::Path;

pub(crate) use report::{doubts, hardware_doubts};

/// The result of the check of one file.
#[derive(Debug, Default, Serialize)]
pub(crate) struct Finding {
    pub(crate) file: String,
    /// `None` when it could not be read.
    pub(crate) schema: Option<&'static str>,
    /// Readable, complete, and no figure in it is impossible.
    pub(crate) sound: bool,
    /// The algorithms are those of this build. `None` when that could not be looked at.
    pub(crate) current: Option<bool>,
    /// It may be used on this machine. `None` when that could not be looked at.
    pub(crate) applicable: Option<bool>,
    /// Problems, for which the file fails.
    pub(crate) problems: Vec<String>,
    /// Why its figures should not be relied on, though it is readable and complete.
    pub(crate) doubts: Vec<String>,
    /// Other information for the user.
    pub(crate) notes: Vec<String>,
    /// The kind of a report.
    #[serde(skip)]
    pub(crate) kind: Option<Kind>,
    /// The times of a report, unless it was cut short or disturbed.
    #[serde(skip)]
    pub(crate) times: Option<Times>,
}

/// The build and the machine that files are checked against.
pub(crate) struct Here {
    registry: Registry,
    machine: Machine,
    /// Looked for when the first file names one.
    gpus: OnceCell<Seen>,
}

impl Here {
    /// This build on this machine.
    pub(crate) fn new(algorithms: &Algorithms) -> Self {
        Self { registry: algorithms.registry(usable_cores()), machine: measure::machine(), gpus: OnceCell::new() }
    }

    /// Reads a file and checks it.
    pub(crate) fn look_at(&self, path: &Path) -> Finding {
        let mut finding = Finding { file: path.display().to_string(), ..Finding::default() };
        // As a note instead of a line on standard error, so that it appears with its file.
        let newer = RefCell::new(Vec::new());
        let read = read_document(path, &|text| newer.borrow_mut().push(text.to_owned()));
        finding.notes.extend(newer.into_inner());
        finding.sound = read.is_ok();
        match read {
            Err(error) => finding.problems.push(format!("{error:#}")),
            Ok(Document::Report(report)) => {
                self.report(&report, &mut finding);
                finding.kind = Some(Kind::of(&report));
                finding.times = unusable(&report).is_none().then(|| Times::of(&report));
            }
            Ok(Document::Model(stored)) => self.model(&stored.model, &mut finding),
            Ok(Document::Tuning(tuning)) => self.tuning(&tuning, &mut finding),
            Ok(_) => finding.problems.push("this version does not check files of this schema".to_owned()),
        }
        finding
    }

    fn model(&self, model: &Model, finding: &mut Finding) {
        finding.schema = Some("model/5");
        let used = model.methods.iter().map(|m| ((m.backend, m.method.as_str()), m.revision));
        finding.set_current(revisions::stale(used, &self.registry), "train it again on new reports");
        finding.applicable = finding.current;
    }

    /// The GPUs of this machine.
    fn gpus(&self) -> &Seen {
        self.gpus.get_or_init(|| {
            let remark = |error| format!("GPUs can't be looked for: {error:#}");
            look().unwrap_or_else(|error| Seen { identities: Vec::new(), remark: Some(remark(error)) })
        })
    }
}

impl Finding {
    /// The name of the schema without its version: `report`.
    pub(crate) fn schema_name(&self) -> Option<&'static str> {
        self.schema.and_then(|schema| schema.split('/').next())
    }

    fn set_current(&mut self, stale: Vec<String>, remedy: &str) {
        self.current = Some(stale.is_empty());
        self.problems.extend(stale.into_iter().map(|s| format!("stale: {s}; {remedy}")));
    }
}
