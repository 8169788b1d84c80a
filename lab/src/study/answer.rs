//! What a study says, for machines.

use super::claims::{Claim, Outcome};
use serde::{Deserialize, Serialize};

/// The form of the file.
const SCHEMA: &str = "study/1";

/// The file `study.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Answer {
    /// Always `study/1`.
    pub(super) schema: Schema,
    /// Version of the command.
    pub(crate) version: String,
    /// The command, folders left out.
    pub(crate) command: String,
    /// The reports, as the page numbers them.
    pub(crate) reports: Vec<Read>,
    /// Physical machines whose timings were studied.
    pub(crate) physical_machines: usize,
    /// What the paper claims, with what became of it.
    pub(crate) claims: Vec<Decided>,
    /// Mean regret on machines, or profiles of the only one, that were left out; `None` where nothing could be.
    pub(crate) mean_regret: Option<f64>,
    /// What was left out, as the validation says it.
    pub(crate) held_out: String,
    /// What could not be shown, and why.
    pub(crate) missing: Vec<String>,
    /// Every other file of the study, by its path in the folder.
    pub(crate) files: Vec<String>,
}

/// A report that was read.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Read {
    /// `R1` and so on.
    pub(crate) label: String,
    pub(crate) file: String,
    /// What kind of evidence it is.
    pub(crate) kind: String,
    /// Why its timings are not studied; `None` where they are.
    pub(crate) left_out: Option<String>,
}

/// A claim of the paper.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Decided {
    pub(crate) claim: String,
    pub(crate) parameter: String,
    pub(crate) by_its_table: String,
    pub(crate) by_its_table_because: String,
    pub(crate) by_these_reports: String,
    pub(crate) by_these_reports_because: String,
}

/// The text `study/1`, and no other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub(super) struct Schema;

impl From<Schema> for String {
    fn from(_: Schema) -> Self {
        SCHEMA.to_owned()
    }
}

impl TryFrom<String> for Schema {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        if text == SCHEMA { Ok(Self) } else { Err(format!("the schema is {text:?}; this version reads {SCHEMA:?}")) }
    }
}

impl Default for Answer {
    fn default() -> Self {
        Self {
            schema: Schema,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            command: String::new(),
            reports: Vec::new(),
            physical_machines: 0,
            claims: Vec::new(),
            mean_regret: None,
            held_out: String::new(),
            missing: Vec::new(),
            files: Vec::new(),
        }
    }
}

impl Decided {
    pub(super) fn new(claim: &Claim) -> Self {
        let told = |(outcome, why): &(Outcome, String)| (outcome.to_string(), why.clone());
        let (by_its_table, by_its_table_because) = told(&claim.by_its_table);
        let (by_these_reports, by_these_reports_because) = told(&claim.by_reports);
        Self {
            claim: claim.text.clone(),
            parameter: claim.parameter.clone(),
            by_its_table,
            by_its_table_because,
            by_these_reports,
            by_these_reports_because,
        }
    }
}
