//! The JSON Schemas of all files.

use crate::report::{self, Report};
use crate::training::Training;
use sapwise_tune::json::{self, Error};
use serde_json::Value;

/// Returns the file names and texts of the JSON Schemas of tunings, models with their training, and reports.
///
/// # Errors
/// When a schema can't be written.
pub fn schemas() -> Result<Vec<(String, String)>, Error> {
    let mut schemas = json::schemas()?;
    for (_, text) in schemas.iter_mut().filter(|(name, _)| name.starts_with("model-")) {
        *text = with_training(text)?;
    }
    schemas.push(report::FORMAT.json_schema::<Report>()?);
    Ok(schemas)
}

/// Puts the schema of the training into that of a model.
fn with_training(model: &str) -> Result<String, Error> {
    let mut model: Value = serde_json::from_str(model).map_err(Error::Write)?;
    let mut training = schemars::schema_for!(Training).to_value();
    if let Some(training) = training.as_object_mut() {
        training.remove("$schema");
        if let (Some(Value::Object(own)), Some(all)) = (training.remove("$defs"), model["$defs"].as_object_mut()) {
            all.extend(own);
        }
    }
    model["properties"]["training"] = training;
    json::write(&model)
}
