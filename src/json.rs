//! Models and tuning as JSON text.

use crate::model::ModelSchema;
use crate::tuning::TuningSchema;
use crate::{Model, Tuning};
use std::fmt;

/// A file of Sapwise, whatever its schema.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Document {
    /// `model/2`.
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
        ModelSchema::TEXT => model(text).map(|m| Document::Model(Box::new(m))),
        TuningSchema::TEXT => tuning(text).map(|f| Document::Tuning(Box::new(f))),
        other => Err(JsonError(format!(
            "the schema is {other:?}; this version reads {:?} and {:?}",
            ModelSchema::TEXT,
            TuningSchema::TEXT
        ))),
    }
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

/// Writes a model or tuning, one key a line.
///
/// # Errors
/// When a figure can't be written.
pub fn write(document: &impl serde::Serialize) -> Result<String, JsonError> {
    Ok(serde_json::to_string_pretty(document)? + "\n")
}

/// File names and texts of the JSON Schemas of everything that [`read`] accepts, and of the files in the cache.
///
/// # Errors
/// When a schema can't be written.
#[cfg(feature = "schema")]
pub fn schemas() -> Result<Vec<(&'static str, String)>, JsonError> {
    Ok(vec![
        ("model-2.schema.json", write(&schemars::schema_for!(Model))?),
        ("tuning-1.schema.json", write(&schemars::schema_for!(Tuning))?),
        ("cache-2.schema.json", write(&schemars::schema_for!(crate::adaptive::cache::Cached))?),
    ])
}
