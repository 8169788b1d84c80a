//! Reads and writes tunings, models and every other file of Sapwise as JSON text.
//!
//! The first key of a file names its schema: `tuning/3`, or `tuning/3.3` for a newer minor version, which only added
//! keys. Keys that this version does not know are skipped and listed in a file of a newer minor version, and are an
//! error in any other file. A file of another major version is refused.

mod error;
mod format;

pub use error::Error;
pub use format::{Format, Read, Schema};

use crate::Model;
use sapwise::Tuning;

/// Reads a tuning and checks its values.
///
/// # Errors
/// As [`Format::read`].
pub fn tuning(text: &str) -> Result<Tuning, Error> {
    Format::TUNING.read(text).map(|read| read.value)
}

/// Reads the predicting part of a model and checks its values.
///
/// # Errors
/// As [`Format::read`].
pub fn model(text: &str) -> Result<Model, Error> {
    Format::MODEL.read::<Model>(text)?.checked(Model::defect).map(|read| read.value)
}

/// The text of the built-in model, from `build.rs`.
pub(crate) const BUILT_IN: &str = include_str!(concat!(env!("OUT_DIR"), "/model.json"));

impl Model {
    /// The model that comes with this library: `models/default.json`, whose card is `models/README.md`.
    ///
    /// # Errors
    /// None: a test reads the file.
    pub fn built_in() -> Result<Self, Error> {
        model(BUILT_IN)
    }
}

/// Writes a tuning, one key a line.
///
/// # Errors
/// [`Error::Write`] when `serde_json` refuses a value. A number that is not finite becomes `null`, which no reader
/// takes.
pub fn write_tuning(tuning: &Tuning) -> Result<String, Error> {
    Format::TUNING.write(tuning)
}

/// Writes a value without a schema, one key a line.
///
/// # Errors
/// [`Error::Write`] when `serde_json` refuses a value. A number that is not finite becomes `null`, which no reader
/// takes.
pub fn write(value: &impl serde::Serialize) -> Result<String, Error> {
    Ok(serde_json::to_string_pretty(value).map_err(Error::Write)? + "\n")
}

/// Returns file names and texts of the JSON Schemas of tunings and of the predicting part of models.
///
/// # Errors
/// [`Error::Write`] when a schema can't be written.
#[cfg(feature = "schema")]
pub fn schemas() -> Result<Vec<(String, String)>, Error> {
    Ok(vec![Format::TUNING.json_schema::<Tuning>()?, Format::MODEL.json_schema::<Model>()?])
}

#[cfg(test)]
mod tests;
