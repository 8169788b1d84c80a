//! Why a text is no sound file.

use super::Schema;
use std::fmt;

/// Why a text is no sound file, or why something can't be written as one.
#[derive(Debug)]
#[non_exhaustive]
pub enum Error {
    /// No JSON, a key that is missing or has a value of another kind, or a figure that can't be.
    Data {
        /// Where: `costs[3].curve`. A dot where it is the whole text.
        path: String,
        /// What was wrong, with line and column.
        source: serde_json::Error,
    },
    /// A key that the schema does not have.
    UnknownKey {
        /// The key, with its place: `costs[3].colour`.
        path: String,
        /// The schema.
        schema: Schema,
    },
    /// Another schema than the one that was asked for.
    OtherSchema {
        /// What the file names.
        found: String,
        /// What this version reads.
        expected: Schema,
    },
    /// An older version of the schema.
    OldSchema {
        /// What the file names.
        found: String,
        /// What this version reads.
        expected: Schema,
    },
    /// Something that JSON can't hold.
    Write(serde_json::Error),
}

impl Error {
    /// Line and column of what was wrong, from 1, where it has a place.
    #[must_use]
    pub fn position(&self) -> Option<(usize, usize)> {
        match self {
            Self::Data { source, .. } => Some((source.line(), source.column())),
            _ => None,
        }
    }
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
                    f.write_str(": the text ends too early, as one that was cut off while it was written or copied; copy or make it again")?;
                }
                Ok(())
            }
            Self::UnknownKey { path, schema } => write!(f, "{path} is no key of {schema}"),
            Self::OtherSchema { found, expected } => {
                write!(f, "the schema is {found:?}; this version reads {:?}", expected.to_string())
            }
            Self::OldSchema { found, expected } => {
                let again = match expected.name() {
                    "report" => "measure again with `sapwise probe --out REPORT.json`",
                    "model" => "train again with `sapwise train REPORTS... --out MODEL.json`",
                    _ => "predict again with `sapwise predict --out TUNING.json`",
                };
                write!(
                    f,
                    "the schema is {found:?}, of an older version; this one reads {:?}: {again}",
                    expected.to_string()
                )
            }
            Self::Write(error) => error.fmt(f),
        }
    }
}

// No source: the text of serde's error is part of this one's, and nothing is behind it.
impl std::error::Error for Error {}
