//! Tuning and models as JSON text, and what reads and writes every file of Sapwise.
//!
//! The first key of each file names its schema: `tuning/2`, or `tuning/2.3` where only keys were added since. A file of a newer minor version
//! is read, and what this version does not know in it is skipped and told; in any other file an unknown key is an error. An older
//! schema is refused with the command that converts its files.

mod error;
mod format;

pub use error::Error;
pub use format::{Format, Schema};

use crate::{Model, Tuning};

/// What was read from a file.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Read<T> {
    /// What it holds.
    pub value: T,
    /// The schema that it names.
    pub schema: Schema,
    /// Keys that this version does not know, each with its place, in a file of a newer minor version. Empty for all others.
    pub skipped: Vec<String>,
}

/// Reads tuning and checks its figures.
///
/// # Errors
/// As [`Format::read`].
pub fn tuning(text: &str) -> Result<Tuning, Error> {
    Format::TUNING.read(text).map(|read| read.value)
}

/// Reads what predicts of a model, and checks its figures.
///
/// # Errors
/// As [`Format::read`].
pub fn model(text: &str) -> Result<Model, Error> {
    Format::MODEL.read(text).map(|read| read.value)
}

impl Model {
    /// The model that comes with this library: `models/default.json`, whose card is `models/README.md`.
    ///
    /// # Errors
    /// When the file that was built in is no sound model, which the tests rule out.
    pub fn built_in() -> Result<Self, Error> {
        model(include_str!("../models/default.json"))
    }
}

/// Writes tuning, one key a line.
///
/// # Errors
/// When a figure can't be written.
pub fn write_tuning(tuning: &Tuning) -> Result<String, Error> {
    Format::TUNING.write(tuning)
}

/// Writes a model, one key a line, without what training says of itself.
///
/// # Errors
/// When a figure can't be written.
pub fn write_model(model: &Model) -> Result<String, Error> {
    Format::MODEL.write(model)
}

/// Writes anything that is no file of a schema, one key a line.
///
/// # Errors
/// When a figure can't be written.
pub fn write(value: &impl serde::Serialize) -> Result<String, Error> {
    Ok(serde_json::to_string_pretty(value).map_err(Error::Write)? + "\n")
}

/// File names and texts of the JSON Schemas of tuning and of the engine's part of models. The files in the
/// cache have theirs in `cache_schema`.
///
/// # Errors
/// When a schema can't be written.
#[cfg(feature = "schema")]
pub fn schemas() -> Result<Vec<(String, String)>, Error> {
    Ok(vec![Format::TUNING.json_schema::<Tuning>()?, Format::MODEL.json_schema::<Model>()?])
}

#[cfg(test)]
mod tests;
