//! Files of before version 0.2 in the form that is read now.
//!
//! Works on the text of a file, so that it needs no types of old versions. What is current already is refused: nothing is converted twice.

use crate::report;
use sapwise::json;
use serde_json::{Map, Value, json};

/// The old names of the methods, and what each is called now.
const METHODS: [(&str, &str); 3] = [("strips", "grid-sap"), ("sweep", "sap"), ("verlet", "pair-cache")];
/// Keys whose text is an algorithm or a method.
const NAMES: [&str; 5] = ["algorithm", "id", "method", "below", "above"];
/// Keys of the text, or the list of texts, that people read.
const TEXTS: [&str; 4] = ["remarks", "warnings", "error", "interval_basis"];
/// A file in its current form.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Converted {
    /// The text of the file.
    pub text: String,
    /// Its schema, such as `report/2`.
    pub schema: &'static str,
    /// What was left out, in words. Empty where all was kept.
    pub dropped: Vec<String>,
}

/// Why a text was not converted.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ConvertError {
    /// It is no JSON.
    #[error("it is no JSON")]
    Json(#[source] serde_json::Error),
    /// It is current.
    #[error("it is {0} already; there is nothing to convert")]
    Current(String),
    /// A cache holds what is measured again in seconds.
    #[error("it is a cache, which is not converted; delete it, and the next start measures again")]
    Cache,
    /// A model of before has another form, which its reports fill and no figure of it does.
    #[error("models of before are not converted: train again with `sapwise train REPORTS... --out MODEL.json`")]
    Model,
    /// Another file.
    #[error("{0}; report/1, tuning/1 and fields/1 are converted")]
    Unknown(String),
    /// Its form is that of an old file, and what it holds is not sound.
    #[error("it is no sound {0}")]
    Unsound(&'static str, #[source] Unsound),
}

/// Reads a converted text as what it is now and writes it in its own layout.
type Rewrite = fn(&str) -> Result<String, Unsound>;

/// Converts `report/1` into `report/2`, and `fields/1` and `tuning/1` into `tuning/2`. No figure that is kept changes.
///
/// # Errors
/// Where the text is of none of these schemas, is damaged, or is current already.
pub fn convert(text: &str) -> Result<Converted, ConvertError> {
    let file: Value = serde_json::from_str(text).map_err(ConvertError::Json)?;
    let Value::Object(mut file) = file else { return Err(ConvertError::Unknown("it is no object".to_owned())) };
    let schema = file.get("schema").and_then(Value::as_str).unwrap_or_default().to_owned();
    let mut dropped = Vec::new();
    let (schema, current): (_, Rewrite) = match schema.as_str() {
        "report/1" => ("report/2", |text| Ok(report::write(&report::read(text)?.value)?)),
        "model/1" | "model/2" => return Err(ConvertError::Model),
        "fields/1" | "tuning/1" => {
            dropped = share_works(&mut file);
            ("tuning/2", |text| Ok(json::write_tuning(&json::tuning(text)?)?))
        }
        "cache/1" | "cache/2" => return Err(ConvertError::Cache),
        "" => return Err(ConvertError::Unknown("it names no schema".to_owned())),
        current if ["report/", "model/", "tuning/", "cache/"].iter().any(|s| current.starts_with(s)) => {
            return Err(ConvertError::Current(schema));
        }
        other => return Err(ConvertError::Unknown(format!("its schema is {other:?}"))),
    };
    file.insert("schema".to_owned(), schema.into());
    let mut file = Value::Object(file);
    rename(&mut file);
    // Read and written as any other file: what can't be read is refused here, and the keys stand in their usual order.
    let text = current(&file.to_string()).map_err(|why| ConvertError::Unsound(schema, why))?;
    Ok(Converted { text, schema, dropped })
}

type Unsound = Box<dyn std::error::Error + Send + Sync>;

/// Puts what each algorithm costs into a list of works, and tells what is left out.
fn share_works(tuning: &mut Map<String, Value>) -> Vec<String> {
    let (mut works, mut corrected) = (Vec::new(), 0);
    let costs =
        tuning.get_mut("costs").and_then(Value::as_array_mut).into_iter().flatten().filter_map(Value::as_object_mut);
    for cost in costs {
        let Some(Value::Object(mut curve)) = cost.remove("curve") else { continue };
        let cache = curve.get("cache_bytes").cloned().unwrap_or(Value::Null);
        let fallback = ["fallback_terms", "otherwise"].iter().find_map(|key| curve.remove(*key));
        let fallback = fallback.filter(|terms| terms.as_array().is_some_and(|list| !list.is_empty())).map(|terms| {
            works.push(json!({ "terms": terms, "fallback": null, "cache_bytes": cache }));
            json!({ "work": works.len() - 1, "factor": 1.0 })
        });
        corrected +=
            usize::from(curve.get("correction").and_then(Value::as_array).is_some_and(|knots| !knots.is_empty()));
        works.push(json!({ "terms": curve.remove("terms"), "fallback": fallback, "cache_bytes": cache }));
        let more = [("work", json!(works.len() - 1)), ("helpers", Value::Null), ("observed", Value::Null)];
        cost.extend(more.map(|(key, value)| (key.to_owned(), value)));
    }
    tuning.insert("works".to_owned(), Value::Array(works));
    let told = format!(
        "correction: of {corrected} algorithms, by the number of objects alone; predict or measure again to have one by the load"
    );
    if corrected > 0 { vec![told] } else { Vec::new() }
}

/// Calls methods and keys by their current names, wherever in the file they stand.
fn rename(value: &mut Value) {
    match value {
        Value::Array(items) => items.iter_mut().for_each(rename),
        Value::Object(entries) => {
            for (key, value) in entries {
                match value {
                    Value::String(name) if NAMES.contains(&key.as_str()) => *name = renamed(name),
                    value if TEXTS.contains(&key.as_str()) => rename_in_texts(value),
                    value => rename(value),
                }
            }
        }
        _ => {}
    }
}

/// The current name of a method, with whatever processor stands behind it.
fn renamed(name: &str) -> String {
    let (method, backend) = name.split_at(name.find('@').unwrap_or(name.len()));
    let method = METHODS.iter().find(|m| m.0 == method).map_or(method, |m| m.1);
    format!("{method}{backend}")
}

fn rename_in_texts(value: &mut Value) {
    match value {
        Value::Array(items) => items.iter_mut().for_each(rename_in_texts),
        Value::String(text) => {
            // An algorithm is a word with an @; the name of a method alone may be a plain word, such as "sweep".
            let inside = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '@' || c == '+';
            let mut words = Vec::new();
            let mut rest = text.as_str();
            while !rest.is_empty() {
                let end = rest.find(|c| inside(c) != rest.starts_with(inside)).unwrap_or(rest.len());
                let (word, after) = rest.split_at(end);
                words.push(if word.contains('@') { renamed(word) } else { word.to_owned() });
                rest = after;
            }
            *text = words.concat();
        }
        _ => {}
    }
}
