//! What all files of Sapwise share: the key that names the schema, and what becomes of keys that nobody knows.

use super::{Error, Read};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_ignored::Path;
use std::borrow::Cow;
use std::fmt;

/// The schema of a file: `tuning/2`, or `tuning/2.3`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Schema {
    name: Cow<'static, str>,
    major: u32,
    minor: u32,
}

impl Schema {
    /// What comes before the slash: which kind of file it is.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Files of one major version can't be read as those of another.
    #[must_use]
    pub fn major(&self) -> u32 {
        self.major
    }

    /// In a newer minor version only keys were added.
    #[must_use]
    pub fn minor(&self) -> u32 {
        self.minor
    }

    /// The schema that a text names, whatever else it holds.
    ///
    /// # Errors
    /// [`Error::Data`] when it is no JSON or names none.
    pub fn of(text: &str) -> Result<Self, Error> {
        /// Only this key; the rest is skipped without being built, so hostile nesting costs nothing.
        #[derive(serde::Deserialize)]
        #[serde(expecting = "an object with the key `schema`")]
        struct Tag {
            schema: String,
        }
        let tag: Tag = serde_json::from_str(text).map_err(|source| Error::Data { path: ".".to_owned(), source })?;
        Ok(Self::parse(&tag.schema).unwrap_or(Self { name: Cow::Owned(tag.schema), major: 0, minor: 0 }))
    }

    fn parse(text: &str) -> Option<Self> {
        let (name, version) = text.split_once('/')?;
        let (major, minor) = version.split_once('.').unwrap_or((version, "0"));
        // A sign is no digit.
        let number = |text: &str| text.bytes().all(|b| b.is_ascii_digit()).then(|| text.parse().ok())?;
        Some(Self { name: Cow::Owned(name.to_owned()), major: number(major)?, minor: number(minor)? })
    }
}

impl fmt::Display for Schema {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)?;
        // What names no version is told as it stands.
        if self.major > 0 {
            write!(f, "/{}", self.major)?;
        }
        if self.minor > 0 {
            write!(f, ".{}", self.minor)?;
        }
        Ok(())
    }
}

/// How files of a schema are read and written. The type that is read holds no key `schema`: this checks and writes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Format {
    name: &'static str,
    major: u32,
    minor: u32,
    /// What files of this kind were called once.
    old_name: Option<&'static str>,
    /// Keys of the outermost level that are someone else's.
    foreign: &'static [&'static str],
}

impl Format {
    /// Files of tuning.
    pub const TUNING: Self = Self { old_name: Some("fields"), ..Self::new("tuning", 2, 0) };

    /// Files of models, without what training says of itself.
    pub const MODEL: Self = Self::new("model", 3, 0).skipping(&["training"]);

    /// The format of a schema in the newest version that the caller knows.
    #[must_use]
    pub const fn new(name: &'static str, major: u32, minor: u32) -> Self {
        Self { name, major, minor, old_name: None, foreign: &[] }
    }

    /// The same for a reader to whom these keys of the outermost level mean nothing, and who does not tell them.
    #[must_use]
    pub const fn skipping(self, foreign: &'static [&'static str]) -> Self {
        Self { foreign, ..self }
    }

    /// The schema, as files are written.
    #[must_use]
    pub fn schema(&self) -> Schema {
        Schema { name: Cow::Borrowed(self.name), major: self.major, minor: self.minor }
    }

    /// Reads a file.
    ///
    /// # Errors
    /// [`Error::OldSchema`] or [`Error::OtherSchema`] when it is of another schema, [`Error::UnknownKey`] when it has a key that the
    /// schema does not have, and [`Error::Data`] for everything else that is wrong with it.
    pub fn read<T: DeserializeOwned>(&self, text: &str) -> Result<Read<T>, Error> {
        let schema = self.accept(Schema::of(text)?)?;
        let mut skipped = Vec::new();
        let mut note = |path: Path<'_>| {
            let own = matches!(path, Path::Map { parent: Path::Root, ref key } if key == "schema" || self.foreign.contains(&key.as_str()));
            if !own {
                skipped.push(place(&path));
            }
        };
        let mut json = serde_json::Deserializer::from_str(text);
        let read = serde_path_to_error::deserialize(serde_ignored::Deserializer::new(&mut json, &mut note));
        // Before what is missing: a key that is spelled wrong is both.
        if schema.minor <= self.minor && !skipped.is_empty() {
            return Err(Error::UnknownKey { path: skipped.swap_remove(0), schema });
        }
        let value = read.map_err(|e| Error::Data { path: e.path().to_string(), source: e.into_inner() })?;
        json.end().map_err(|source| Error::Data { path: ".".to_owned(), source })?;
        Ok(Read { value, schema, skipped })
    }

    /// Whether files of a schema can be read.
    fn accept(&self, found: Schema) -> Result<Schema, Error> {
        let expected = || self.schema();
        let same_kind = found.name == self.name;
        if same_kind && found.major == self.major {
            Ok(found)
        } else if found.major > 0 && (same_kind && found.major < self.major || self.old_name == Some(found.name())) {
            Err(Error::OldSchema { found: found.to_string(), expected: expected() })
        } else {
            Err(Error::OtherSchema { found: found.to_string(), expected: expected() })
        }
    }

    /// Writes a file, one key a line, the schema first.
    ///
    /// # Errors
    /// [`Error::Write`] when a figure can't be written.
    pub fn write<T: Serialize>(&self, value: &T) -> Result<String, Error> {
        #[derive(Serialize)]
        struct Tagged<'a, T> {
            schema: String,
            #[serde(flatten)]
            value: &'a T,
        }
        super::write(&Tagged { schema: self.schema().to_string(), value })
    }

    /// File name and text of the JSON Schema of files that hold a type.
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

/// A place in a file, in words that [`Error::Data`] uses too: `costs[3].curve`.
fn place(path: &Path<'_>) -> String {
    match path {
        Path::Root => String::new(),
        Path::Seq { parent, index } => format!("{}[{index}]", place(parent)),
        Path::Map { parent, key } => {
            let parent = place(parent);
            if parent.is_empty() { key.clone() } else { format!("{parent}.{key}") }
        }
        Path::Some { parent } | Path::NewtypeStruct { parent } | Path::NewtypeVariant { parent } => place(parent),
    }
}
