//! Checks of a file: whether it is sound, current and applicable here, and what makes it doubtful.

mod figures;
mod model;
mod privacy;
mod report;
mod tuning;

use crate::algorithms::Algorithms;
use crate::gpus::{Seen, look};
use sapwise::measure;
use sapwise::{Machine, Registry, usable_cores};
use sapwise_lab::data::{Document, read_document};
use serde::Serialize;
use std::cell::{OnceCell, RefCell};
use std::path::Path;

pub(crate) use figures::{doubts, hardware_disturbed, hardware_doubts};

/// What is known about one file.
#[derive(Debug, Serialize)]
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
    /// What makes the file fail.
    pub(crate) problems: Vec<String>,
    /// What makes its figures doubtful, though it is readable and complete.
    pub(crate) doubts: Vec<String>,
    /// What else the user should know.
    pub(crate) notes: Vec<String>,
}

/// What files are checked against.
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
        let mut finding = Finding {
            file: path.display().to_string(),
            schema: None,
            sound: false,
            current: None,
            applicable: None,
            problems: Vec::new(),
            doubts: Vec::new(),
            notes: Vec::new(),
        };
        // A note and not a line on standard error: what is told of a file belongs to the findings.
        let newer = RefCell::new(Vec::new());
        let read = read_document(path, &|text| newer.borrow_mut().push(text.to_owned()));
        finding.notes.extend(newer.into_inner());
        match read {
            Err(error) => finding.problems.push(format!("{error:#}")),
            Ok(document) => {
                finding.sound = true;
                match document {
                    Document::Report(report) => {
                        // Pipes have no length, and are nobody's contribution.
                        let bytes = std::fs::metadata(path).map_or(0, |m| m.len());
                        self.report(&report, bytes, &mut finding);
                    }
                    Document::Model(stored) => self.model(&stored, &mut finding),
                    Document::Tuning(tuning) => self.tuning(&tuning, &mut finding),
                    _ => finding.problems.push("this version does not check files of this schema".to_owned()),
                }
            }
        }
        finding
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
    pub(crate) fn kind(&self) -> Option<&'static str> {
        self.schema.and_then(|schema| schema.split('/').next())
    }

    /// Whether it is a report that was cut short.
    pub(crate) fn is_cut_short(&self) -> bool {
        self.doubts.iter().any(|doubt| doubt.starts_with(figures::CUT_SHORT))
    }

    fn set_current(&mut self, stale: Vec<String>, remedy: &str) {
        self.current = Some(stale.is_empty());
        self.problems.extend(stale.into_iter().map(|s| format!("stale: {s}; {remedy}")));
    }
}
