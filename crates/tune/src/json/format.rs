//! Reads and writes files of one schema.

use super::Error;
use serde::Serialize;
use serde::de::{DeserializeOwned, Error as _};
use serde_ignored::Path;
use std::fmt;

/// The schema of a file: `tuning/3`, or `tuning/3.3`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Schema {
    name: String,
    major: u32,
    minor: u32,
}

impl Schema {
    /// The kind of file: the part before the slash.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The major version; files of different ones can't be read as each other.
    pub fn major(&self) -> u32 {
        self.major
    }

    /// The minor version; a newer one only added keys.
    pub fn minor(&self) -> u32 {
        self.minor
    }

    /// The schema that a text names, whatever else the text holds.
    ///
    /// # Errors
    /// [`Error::Data`] when the text is not JSON or names no schema.
    pub fn of(text: &str) -> Result<Self, Error> {
        /// Only this key: serde skips the rest without building it, so that deep nesting costs nothing.
        #[derive(serde::Deserialize)]
        #[serde(expecting = "an object with the key `schema`")]
        struct Tag {
            schema: String,
        }
        let tag: Tag = serde_json::from_str(text).map_err(|source| Error::Data { path: ".".to_owned(), source })?;
        Ok(Self::parse(&tag.schema).unwrap_or(Self { name: tag.schema, major: 0, minor: 0 }))
    }

    fn parse(text: &str) -> Option<Self> {
        let (name, version) = text.split_once('/')?;
        let (major, minor) = version.split_once('.').unwrap_or((version, "0"));
        // `u32::from_str` would accept a sign.
        let number = |text: &str| text.bytes().all(|b| b.is_ascii_digit()).then(|| text.parse().ok())?;
        Some(Self { name: name.to_owned(), major: number(major)?, minor: number(minor)? })
    }
}

impl fmt::Display for Schema {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)?;
        // 0 for a text without a version.
        if self.major > 0 {
            write!(f, "/{}", self.major)?;
        }
        if self.minor > 0 {
            write!(f, ".{}", self.minor)?;
        }
        Ok(())
    }
}

/// The content of a file.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Read<T> {
    /// The content.
    pub value: T,
    /// The schema that the file names.
    pub schema: Schema,
    /// Unknown keys of a newer minor version, each with its place; empty for every other file.
    pub skipped: Vec<String>,
}

impl<T> Read<T> {
    /// Refuses a value in which `defect` finds something.
    ///
    /// # Errors
    /// [`Error::Data`] with what `defect` returns.
    pub fn checked<D: fmt::Display>(self, defect: impl FnOnce(&T) -> Option<D>) -> Result<Self, Error> {
        match defect(&self.value) {
            None => Ok(self),
            Some(why) => Err(Error::Data { path: ".".to_owned(), source: serde_json::Error::custom(why) }),
        }
    }
}

/// A kind of file. The type that is read has no key `schema`: this checks it and writes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Format {
    name: &'static str,
    major: u32,
    /// Keys of the outermost level that belong to another reader.
    foreign: &'static [&'static str],
}

impl Format {
    /// Files of tunings.
    pub const TUNING: Self = Self::new("tuning", 3);

    /// Files of models, without the notes of their training.
    pub const MODEL: Self = Self::new("model", 5).skipping(&["training"]);

    /// A kind of file in the major version that the caller reads and writes.
    pub const fn new(name: &'static str, major: u32) -> Self {
        Self { name, major, foreign: &[] }
    }

    /// The same without these keys of the outermost level, which are skipped and not listed.
    #[must_use]
    pub const fn skipping(self, foreign: &'static [&'static str]) -> Self {
        Self { foreign, ..self }
    }

    fn schema(&self) -> Schema {
        Schema { name: self.name.to_owned(), major: self.major, minor: 0 }
    }

    /// Reads a file.
    ///
    /// # Errors
    /// [`Error::OtherSchema`] for a file of another kind or major version, [`Error::UnknownKey`] for a key that the
    /// schema does not have, [`Error::Data`] for everything else.
    pub fn read<T: DeserializeOwned>(&self, text: &str) -> Result<Read<T>, Error> {
        let schema = Schema::of(text)?;
        if (&*schema.name, schema.major) != (self.name, self.major) {
            return Err(Error::OtherSchema { found: schema.to_string(), expected: self.schema() });
        }
        let own = |key: &str| key == "schema" || self.foreign.contains(&key);
        let mut skipped = Vec::new();
        let mut note = |path: Path<'_>| {
            if !matches!(&path, Path::Map { parent: Path::Root, key } if own(key)) {
                skipped.push(place(&path));
            }
        };
        let mut json = serde_json::Deserializer::from_str(text);
        let read = serde_path_to_error::deserialize(serde_ignored::Deserializer::new(&mut json, &mut note));
        // Before the missing keys: a misspelt key is unknown and missing.
        if schema.minor == 0 && !skipped.is_empty() {
            return Err(Error::UnknownKey { path: skipped.swap_remove(0), schema });
        }
        let value = read.map_err(|e| Error::Data { path: e.path().to_string(), source: e.into_inner() })?;
        json.end().map_err(|source| Error::Data { path: ".".to_owned(), source })?;
        Ok(Read { value, schema, skipped })
    }

    /// Writes a file, one key a line, the schema first.
    ///
    /// # Errors
    /// [`Error::Write`] when `serde_json` refuses a value.
    pub fn write<T: Serialize>(&self, value: &T) -> Result<String, Error> {
        let schema = format!("{{\n  \"schema\": \"{}\",", self.schema());
        Ok(super::write(value)?.replacen('{', &schema, 1))
    }

    /// Returns file name and text of the JSON Schema of files that hold a `T`.
    ///
    /// # Errors
    /// [`Error::Write`] when it can't be written.
    #[cfg(feature = "schema")]
    pub fn json_schema<T: schemars::JsonSchema>(&self) -> Result<(String, String), Error> {
        let mut schema = schemars::schema_for!(T);
        let tag = serde_json::json!({ "const": self.schema().to_string() });
        let object = schema.ensure_object();
        if let Some(keys) = object.get_mut("properties").and_then(serde_json::Value::as_object_mut) {
            keys.insert("schema".to_owned(), tag);
            for key in self.foreign {
                keys.insert((*key).to_owned(), true.into());
            }
        }
        if let Some(required) = object.get_mut("required").and_then(serde_json::Value::as_array_mut) {
            required.insert(0, "schema".into());
        }
        Ok((format!("{}-{}.schema.json", self.name, self.major), super::write(&schema)?))
    }
}

/// A place in a file as serde_path_to_error writes it: `costs[3].curve`.
fn place(path: &Path<'_>) -> String {
    match path {
        Path::Root => String::new(),
        Path::Seq { parent, index } => format!("{}[{index}]", place(parent)),
        Path::Map { parent: Path::Root, key } => key.clone(),
        Path::Map { parent, key } => format!("{}.{key}", place(parent)),
        Path::Some { parent } | Path::NewtypeStruct { parent } | Path::NewtypeVariant { parent } => place(parent),
    }
}
