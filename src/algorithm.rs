//! Names of algorithms, and what your own algorithm needs beside [`BroadPhase`](crate::BroadPhase).

pub use crate::broad_phase::{FrameKind, FrameWork};
pub use crate::cpu::{SimdLevel, SimdLevelError};
pub use crate::entry::Entry;
pub use crate::load::{Displacement, FramePlan, Load, Motion};
pub use crate::registry::{AlgorithmSource, usable_cores};

use std::fmt;
use std::str::FromStr;

/// A method and its backend, written `method@backend`: `brute@cpu1`, `grid-sap@cpu8`, `sap@gpu0`, `grid-sap@gpu0+1`.
///
/// JSON, the command line and logs use this text.
///
/// ```
/// let id: sapwise::AlgorithmId = "grid-sap@cpu8".parse()?;
/// assert_eq!((id.method(), id.threads()), ("grid-sap", 8));
/// # Ok::<(), sapwise::error::ParseIdError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct AlgorithmId {
    method: String,
    backend: Backend,
}

/// The processor of an algorithm.
///
/// ```
/// use sapwise::algorithm::Backend;
///
/// assert_eq!("gpu0+1".parse(), Ok(Backend::Gpu(vec![0, 1])));
/// assert_eq!(Backend::Cpu(4).to_string(), "cpu4");
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Backend {
    /// This many threads of the CPU, at least one.
    Cpu(u32),
    /// These GPUs, ascending, numbered as in `sapwise devices`.
    Gpu(Vec<u32>),
}

crate::described! {
    /// The class of a processor. A method has one cost model and one revision in each class.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
    #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
    pub enum BackendClass {
        /// Threads of the CPU.
        #[default]
        Cpu = "CPU",
        /// One or more GPUs.
        Gpu = "GPU",
    }
}

/// The most threads of an algorithm.
pub(crate) const MOST_THREADS: u32 = 4096;

/// The error of a text that is no algorithm.
///
/// ```
/// use sapwise::AlgorithmId;
///
/// let error = "bvh".parse::<AlgorithmId>().unwrap_err();
/// println!("{error}"); // the text, and what an algorithm looks like
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ParseIdError(String);

impl AlgorithmId {
    /// Makes the id of `method` on `backend`.
    ///
    /// # Errors
    /// `method` must be 1 to 32 of `a-z`, `0-9`, `-` and `_`, and begin with a letter. `backend` must have 1 to 4096
    /// threads, or GPUs in ascending order. Otherwise the text could not be read back.
    pub fn new(method: &str, backend: Backend) -> Result<Self, ParseIdError> {
        let letters = method.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'-' || b == b'_');
        if method.len() > 32 || !letters || !method.starts_with(|c: char| c.is_ascii_lowercase()) {
            return Err(ParseIdError(format!("{method:?} is no method name; use up to 32 of a-z, 0-9, - and _")));
        }
        // Too many threads, no thread, GPUs out of order: all that could not be read back.
        if backend.to_string().parse().as_ref() != Ok(&backend) {
            return Err(ParseIdError(format!(
                "{backend} is no backend; use cpu1 to cpu{MOST_THREADS}, gpu0 or gpu0+1"
            )));
        }
        Ok(Self { method: method.to_owned(), backend })
    }

    /// Makes the id of a built-in method on the CPU.
    #[doc(hidden)]
    pub fn cpu(method: &'static str, threads: u32) -> Self {
        Self { method: method.to_owned(), backend: Backend::Cpu(threads) }
    }

    /// Returns the part before the `@`.
    pub fn method(&self) -> &str {
        &self.method
    }

    /// Returns the part after the `@`.
    pub fn backend(&self) -> &Backend {
        &self.backend
    }

    /// Returns the number of CPU threads that the algorithm keeps busy: one for GPUs.
    pub fn threads(&self) -> u32 {
        match self.backend {
            Backend::Cpu(k) => k,
            Backend::Gpu(_) => 1,
        }
    }
}

impl Backend {
    /// Returns the class of the processor.
    pub fn class(&self) -> BackendClass {
        match self {
            Self::Cpu(_) => BackendClass::Cpu,
            Self::Gpu(_) => BackendClass::Gpu,
        }
    }

    /// Returns the number of CPU threads, or of GPUs.
    pub fn width(&self) -> u32 {
        match self {
            Self::Cpu(threads) => *threads,
            Self::Gpu(gpus) => u32::try_from(gpus.len()).unwrap_or(u32::MAX),
        }
    }
}

impl fmt::Display for AlgorithmId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}@{}", self.method, self.backend)
    }
}

impl fmt::Display for Backend {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Backend::Cpu(threads) => write!(f, "cpu{threads}"),
            Backend::Gpu(devices) => {
                let list: Vec<String> = devices.iter().map(u32::to_string).collect();
                write!(f, "gpu{}", list.join("+"))
            }
        }
    }
}

impl fmt::Display for ParseIdError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for ParseIdError {}

impl FromStr for Backend {
    type Err = ParseIdError;

    fn from_str(text: &str) -> Result<Self, ParseIdError> {
        let bad = || {
            ParseIdError(format!("{text:?} is no backend; use cpu1, cpu4, gpu0, or gpu0+1 with the numbers ascending"))
        };
        if let Some(threads) = text.strip_prefix("cpu") {
            return number(threads).filter(|&k| (1..=MOST_THREADS).contains(&k)).map(Backend::Cpu).ok_or_else(bad);
        }
        let devices: Option<Vec<u32>> = text.strip_prefix("gpu").ok_or_else(bad)?.split('+').map(number).collect();
        match devices {
            Some(list) if list.is_sorted_by(|a, b| a < b) => Ok(Backend::Gpu(list)),
            _ => Err(bad()),
        }
    }
}

impl FromStr for AlgorithmId {
    type Err = ParseIdError;

    fn from_str(text: &str) -> Result<Self, ParseIdError> {
        let (method, backend) = text.split_once('@').ok_or_else(|| {
            ParseIdError(format!("{text:?} is no algorithm; write method@backend, such as grid-sap@cpu1"))
        })?;
        Self::new(method, backend.parse()?)
    }
}

/// Parses a number in its one accepted spelling, so that an id has one text only.
fn number(text: &str) -> Option<u32> {
    text.parse().ok().filter(|n: &u32| n.to_string() == text)
}

crate::text_in_files!(AlgorithmId);

#[cfg(feature = "schema")]
impl schemars::JsonSchema for AlgorithmId {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "AlgorithmId".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({
            "type": "string",
            "pattern": "^[a-z][a-z0-9_-]{0,31}@(cpu[1-9][0-9]{0,3}|gpu[0-9]+(\\+[0-9]+)*)$",
            "description": "method@backend",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_read_back_what_they_write() {
        for text in ["brute@cpu1", "grid-sap@cpu16", "sap@gpu0", "grid-sap@gpu0+1", "my-tree_2@cpu2"] {
            assert_eq!(text.parse::<AlgorithmId>().unwrap().to_string(), text);
        }
    }

    #[test]
    fn malformed_ids_are_refused() {
        for backend in [Backend::Cpu(0), Backend::Cpu(5000), Backend::Gpu(vec![]), Backend::Gpu(vec![1, 0])] {
            assert!(AlgorithmId::new("brute", backend.clone()).is_err(), "{backend:?}");
        }
        let texts = "brute brute@ @cpu1 brute@cpu0 brute@cpu01 brute@cpu-1 b@gpu1+0 b@gpu0+0 Ä@cpu1";
        for text in texts.split(' ').chain([""]) {
            assert!(text.parse::<AlgorithmId>().is_err(), "{text}");
        }
    }
}
