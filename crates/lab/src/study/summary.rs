//! What a study says, for programs: the file `study.json`.

use super::claims::{Claim, Outcome};
use super::entry::Entry;
use crate::MethodScore;
use serde::{Deserialize, Serialize};

/// The form of the file.
const SCHEMA: &str = "study/2";

/// What a study concludes, and which files hold the figures behind it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Summary {
    /// Always `study/2`.
    pub schema: String,
    /// What this file is.
    pub about: String,
    /// Version of Sapwise.
    pub version: String,
    /// The command, folders left out.
    pub command: String,
    /// The reports, as the page numbers them.
    pub reports: Vec<StudiedReport>,
    /// Physical machines whose timings were studied.
    pub physical_machines: usize,
    /// What these machines can say, and what they can't, in sentences.
    pub can_say: Vec<String>,
    /// What the paper claims, with what became of it.
    pub claims: Vec<StudyClaim>,
    /// What was held out to judge the strategies; empty where nothing could be.
    pub held_out: String,
    /// How well each strategy chose on what was held out, the model of this project first. Regrets are shares: 0.1 is 10 %.
    pub strategies: Vec<MethodScore>,
    /// What could not be shown, and why.
    pub missing: Vec<String>,
    /// Every other file of the study.
    pub files: Vec<StudyFile>,
}

/// A file beside `study.json`.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[non_exhaustive]
pub struct StudyFile {
    /// Its path in the folder of the study.
    pub path: String,
    /// What it holds.
    pub holds: String,
}

/// A report that was read.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct StudiedReport {
    /// `R1` and so on.
    pub label: String,
    /// Name of the file.
    pub file: String,
    /// What kind of evidence it is.
    pub kind: String,
    /// Why its timings are not studied; `None` where they are.
    pub left_out: Option<String>,
}

/// A claim of the paper.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct StudyClaim {
    /// The claim.
    pub claim: String,
    /// The parameter that it is about.
    pub parameter: String,
    /// What follows from the paper's own table.
    pub by_its_table: String,
    /// Why.
    pub by_its_table_because: String,
    /// What follows from the studied reports.
    pub by_these_reports: String,
    /// Why.
    pub by_these_reports_because: String,
}

impl Default for Summary {
    fn default() -> Self {
        Self {
            schema: SCHEMA.to_owned(),
            about:
                "A summary. The figures behind it are in the files that it lists; tables/timings.csv has every median time."
                    .to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            command: String::new(),
            reports: Vec::new(),
            physical_machines: 0,
            can_say: Vec::new(),
            claims: Vec::new(),
            held_out: String::new(),
            strategies: Vec::new(),
            missing: Vec::new(),
            files: Vec::new(),
        }
    }
}

impl StudiedReport {
    pub(super) fn new(label: &str, entry: &Entry) -> Self {
        Self {
            label: label.to_owned(),
            file: entry.file.clone(),
            kind: crate::label_text::kind(entry.kind).to_owned(),
            left_out: entry.studied.clone().err(),
        }
    }
}

impl StudyClaim {
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

/// The files that the study of this folder lists; `None` of a text that is no `study.json`.
pub(super) fn listed_files(text: &str) -> Option<Vec<String>> {
    #[derive(Deserialize)]
    struct Listed {
        schema: String,
        files: Vec<StudyFile>,
    }
    let Listed { schema, files } = serde_json::from_str(text).ok()?;
    schema.starts_with("study/").then(|| files.into_iter().map(|file| file.path).collect())
}
