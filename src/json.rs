//! Reports, models and tuning as JSON text.

use crate::report::{Report, ReportSchema};
use crate::{Tuning, Model};
use crate::{tuning::TuningSchema, model::ModelSchema};
use std::fmt;

/// A file of Sapwise, whatever its schema.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Document {
    /// `report/1`.
    Report(Box<Report>),
    /// `model/1`.
    Model(Box<Model>),
    /// `tuning/1`.
    Tuning(Box<Tuning>),
}

/// Why a text is no sound file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct JsonError(String);

impl fmt::Display for JsonError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for JsonError {}

impl From<serde_json::Error> for JsonError {
    fn from(e: serde_json::Error) -> Self {
        Self(e.to_string())
    }
}

/// Reads any file of Sapwise by its `schema` key.
///
/// # Errors
/// The line and column of the defect, the schema where it is none of ours, or the figure that can't be.
pub fn read(text: &str) -> Result<Document, JsonError> {
    /// Only this key; the rest is skipped without being built, so hostile nesting costs nothing.
    #[derive(serde::Deserialize)]
    struct Tag {
        schema: String,
    }
    let tag: Tag = serde_json::from_str(text)?;
    match tag.schema.as_str() {
        ReportSchema::TEXT => report(text).map(|r| Document::Report(Box::new(r))),
        ModelSchema::TEXT => model(text).map(|m| Document::Model(Box::new(m))),
        TuningSchema::TEXT => tuning(text).map(|f| Document::Tuning(Box::new(f))),
        other => Err(JsonError(format!(
            "the schema is {other:?}; this version reads {:?}, {:?} and {:?}",
            ReportSchema::TEXT,
            ModelSchema::TEXT,
            TuningSchema::TEXT
        ))),
    }
}

/// Reads a report and checks its figures.
///
/// # Errors
/// As [`read`].
pub fn report(text: &str) -> Result<Report, JsonError> {
    let report: Report = serde_json::from_str(text)?;
    report.defect().map_or(Ok(report), |d| Err(JsonError(d)))
}

/// Reads a model and checks its figures.
///
/// # Errors
/// As [`read`].
pub fn model(text: &str) -> Result<Model, JsonError> {
    let model: Model = serde_json::from_str(text)?;
    model.defect().map_or(Ok(model), |d| Err(JsonError(d)))
}

/// Reads tuning and checks their figures.
///
/// # Errors
/// As [`read`].
pub fn tuning(text: &str) -> Result<Tuning, JsonError> {
    let tuning: Tuning = serde_json::from_str(text)?;
    tuning.defect().map_or(Ok(tuning), |d| Err(JsonError(d)))
}

/// Writes a report, model or tuning, one key a line.
///
/// # Errors
/// When a figure can't be written.
pub fn write(document: &impl serde::Serialize) -> Result<String, JsonError> {
    Ok(serde_json::to_string_pretty(document)? + "\n")
}

/// Writes a report: one key a line, one point a line, and the raw samples of a parameter on one line, so that a full sweep stays
/// readable and under a megabyte.
///
/// # Errors
/// When a figure can't be written.
pub fn write_report(report: &Report) -> Result<String, JsonError> {
    let frame = one_line_samples(&write(&Report { points: Vec::new(), ..report.clone() })?);
    // A line break within a text is written as an escape, so this can only be the key of the report itself.
    let key = "\n  \"points\": []";
    Ok(match one_a_line("points", &report.points)? {
        Some(points) => frame.replacen(key, &points, 1),
        None => frame,
    })
}

/// Writes a model: one key a line, one cloud or fold a line, so that ten folds stay under 200 kB.
///
/// # Errors
/// When a figure can't be written.
pub fn write_model(model: &Model) -> Result<String, JsonError> {
    let mut text = write(&Model { clouds: Vec::new(), folds: Vec::new(), ..model.clone() })?;
    let lists = [one_a_line("clouds", &model.clouds)?, one_a_line("folds", &model.folds)?];
    // Empty lists are not written, so that what is there goes before the bracket that ends the model.
    for list in lists.into_iter().flatten() {
        text.truncate(text.trim_end_matches("\n}\n").len());
        text += &format!(",{list}\n}}\n");
    }
    Ok(text)
}

/// A key of the outermost level with a list, one item a line. `None` for an empty one.
fn one_a_line(key: &str, items: &[impl serde::Serialize]) -> Result<Option<String>, JsonError> {
    let items: Vec<String> = items.iter().map(serde_json::to_string).collect::<Result<_, _>>()?;
    Ok((!items.is_empty()).then(|| format!("\n  \"{key}\": [\n    {}\n  ]", items.join(",\n    "))))
}

/// The same text with each list of raw samples on the line of its key.
fn one_line_samples(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut inside = false;
    for line in text.lines() {
        out.push_str(if inside { line.trim_start() } else { line });
        // A line break within a text is written as an escape, so this can only be the key. Numbers hold no bracket.
        inside = if inside { !line.contains(']') } else { line.trim_start() == "\"raw\": [" };
        if !inside {
            out.push('\n');
        }
    }
    out
}

/// File names and texts of the JSON Schemas of everything that [`read`] accepts, and of the files in the cache.
///
/// # Errors
/// When a schema can't be written.
#[cfg(feature = "schema")]
pub fn schemas() -> Result<Vec<(&'static str, String)>, JsonError> {
    Ok(vec![
        ("report-1.schema.json", write(&schemars::schema_for!(Report))?),
        ("model-1.schema.json", write(&schemars::schema_for!(Model))?),
        ("tuning-1.schema.json", write(&schemars::schema_for!(Tuning))?),
        ("cache-1.schema.json", write(&schemars::schema_for!(crate::adaptive::cache::Cached))?),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hardware::Parameter;
    use crate::report::{Label, Point, Provenance};
    use crate::{Hardware, Load, Machine};

    #[test]
    fn a_report_reads_back_whatever_its_texts_hold() {
        let hostile = "\n  \"points\": []";
        let point = Point {
            scenario: hostile.to_owned(),
            load: Load { objects: 3, pairs: 0.1, ..Load::default() },
            pairs: 7,
            fingerprint: String::new(),
            foreign_load: Some(0.25),
            spoiled: 0,
            core_to_core_ns: Some([23.5, 179.0]),
            timings: Vec::new(),
        };
        let mut report = Report {
            schema: ReportSchema,
            label: Label::Simulated,
            provenance: Provenance {
                version: String::new(),
                date: String::new(),
                command: hostile.to_owned(),
                seed: u64::MAX,
                threads: None,
                simd: None,
                gpu_threads: None,
                restriction: None,
                optimised: false,
                seconds: 0.5,
            },
            hardware: Hardware {
                machine: Machine::default(),
                parameters: vec![
                    Parameter::missing("x", hostile),
                    Parameter { samples: 3, raw: vec![1.0, 2.5, 1e-7], ..Parameter::reported("y", 1.0, "\"raw\": [") },
                ],
                gpus: Vec::new(),
                gpu_groups: Vec::new(),
            },
            algorithms: Vec::new(),
            points: vec![point.clone(), point],
            remarks: vec![hostile.to_owned()],
        };
        let text = write_report(&report).unwrap();
        assert_eq!(super::report(&text).unwrap(), report);
        assert_eq!(text.lines().filter(|l| l.starts_with("    {\"scenario\"")).count(), 2);
        assert!(text.contains("\n        \"raw\": [1.0,2.5,1e-7]\n"), "{text}");
        report.points.clear();
        assert_eq!(super::report(&write_report(&report).unwrap()).unwrap(), report);
    }
}
