//! Why a file can't be read or written.

use super::Schema;
use std::fmt;

/// Why a text is not a valid file, or a value can't be written as one.
#[derive(Debug)]
#[non_exhaustive]
pub enum Error {
    /// Not JSON, a missing key, a value of another type, or an impossible value.
    Data {
        /// Where: `costs[3].curve`. A dot for the whole text.
        path: String,
        /// What is wrong, with line and column.
        source: serde_json::Error,
    },
    /// A key that the schema does not have.
    UnknownKey {
        /// The key with its place: `costs[3].colour`.
        path: String,
        /// The schema.
        schema: Schema,
    },
    /// A file of another kind or of another major version.
    OtherSchema {
        /// What the file names.
        found: String,
        /// What this version reads.
        expected: Schema,
    },
    /// A value that JSON can't hold.
    Write(serde_json::Error),
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Data { path, source } => {
                if path != "." {
                    write!(f, "{path}: ")?;
                }
                source.fmt(f)?;
                if source.is_eof() {
                    f.write_str(": the text ends too early; copy or make the file again")?;
                }
                Ok(())
            }
            Self::UnknownKey { path, schema } => write!(f, "{path} is no key of {schema}"),
            Self::OtherSchema { found, expected } => {
                write!(f, "the schema is {found:?}; this version reads {:?}", expected.to_string())?;
                match expected.name() {
                    "model" => f.write_str(", which `sapwise train REPORTS... --out MODEL.json` makes"),
                    "tuning" => f.write_str(", which `sapwise predict --out TUNING.json` makes"),
                    _ => Ok(()),
                }
            }
            Self::Write(error) => error.fmt(f),
        }
    }
}

// Without a source: this text already contains that of serde's error.
impl std::error::Error for Error {}
