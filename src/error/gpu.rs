//! Why a GPU can't do its work.

use std::fmt;
use std::sync::Arc;

/// Why a GPU can't do its work.
///
/// The text leaves out the words of the driver, which are the [source](std::error::Error::source); `{:#}` writes both.
///
/// ```
/// use sapwise::error::{GpuError, GpuErrorKind};
///
/// let lost = GpuError::new(GpuErrorKind::Lost, "gpu0 did not answer");
/// assert_eq!((lost.kind(), lost.to_string()), (GpuErrorKind::Lost, "gpu0 did not answer".to_owned()));
/// ```
#[derive(Debug, Clone)]
pub struct GpuError {
    kind: GpuErrorKind,
    text: String,
    source: Option<Arc<dyn std::error::Error + Send + Sync>>,
}

/// Kinds of [`GpuError`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum GpuErrorKind {
    /// There is no such GPU, or it can't be opened.
    NotFound,
    /// It was lost, did not answer in time, or failed unexpectedly. It can't be used any more.
    Lost,
    /// It accepts work and executes nothing: a driver without hardware, or hardware that hangs. It can't be used any
    /// more.
    Inert,
    /// Its driver refuses memory, a kernel or a binding.
    Refused,
    /// The work exceeds a limit of this GPU or of one submission.
    Limit,
}

impl GpuError {
    /// Makes an error without a source.
    pub fn new(kind: GpuErrorKind, text: impl Into<String>) -> Self {
        Self { kind, text: text.into(), source: None }
    }

    /// Makes an error with that of the driver or the device as its source.
    pub fn caused(
        kind: GpuErrorKind,
        text: impl Into<String>,
        source: impl std::error::Error + Send + Sync + 'static,
    ) -> Self {
        Self { kind, text: text.into(), source: Some(Arc::new(source)) }
    }

    /// Replaces the text, unless the GPU is gone: then the failed operation does not matter.
    pub fn of(self, text: impl Into<String>) -> Self {
        match self.kind {
            GpuErrorKind::Lost | GpuErrorKind::Inert => self,
            _ => Self { text: text.into(), ..self },
        }
    }

    /// Returns the kind of error.
    pub fn kind(&self) -> GpuErrorKind {
        self.kind
    }
}

impl PartialEq for GpuError {
    /// Compares kind and text, not the source.
    fn eq(&self, other: &Self) -> bool {
        (self.kind, &self.text) == (other.kind, &other.text)
    }
}

impl Eq for GpuError {}

impl fmt::Display for GpuError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)?;
        match &self.source {
            Some(source) if f.alternate() => write!(f, ": {source}"),
            _ => Ok(()),
        }
    }
}

impl std::error::Error for GpuError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.source.as_ref().map(|source| &**source as &(dyn std::error::Error + 'static))
    }
}
