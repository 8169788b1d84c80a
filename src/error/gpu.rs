//! What can go wrong with a GPU.

use std::fmt;
use std::sync::Arc;

/// Why a GPU can't do what was asked of it.
///
/// Its text leaves out the words of the driver, which are its [source](std::error::Error::source); `{:#}` writes both.
#[derive(Debug, Clone)]
pub struct GpuError {
    kind: GpuErrorKind,
    text: String,
    source: Option<Arc<dyn std::error::Error + Send + Sync>>,
}

/// What a program may want to tell apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum GpuErrorKind {
    /// There is no such GPU, or it can't be opened.
    NotFound,
    /// It was lost, did not answer in time, or an error came that nobody expected. It can't be used any more.
    Lost,
    /// It takes work and says that it is done, and executes nothing: a driver without hardware behind it, or hardware that hangs. It
    /// can't be used any more.
    Inert,
    /// Its device or driver refuses: memory, a kernel, a binding.
    Refused,
    /// It is more than this GPU, or a single submission to it, can take.
    Limit,
}

impl GpuError {
    /// An error in a sentence.
    pub(crate) fn new(kind: GpuErrorKind, text: impl Into<String>) -> Self {
        Self { kind, text: text.into(), source: None }
    }

    /// An error in a sentence, and what the driver or the device said.
    pub(crate) fn caused(
        kind: GpuErrorKind,
        text: impl Into<String>,
        source: impl std::error::Error + Send + Sync + 'static,
    ) -> Self {
        Self { kind, text: text.into(), source: Some(Arc::new(source)) }
    }

    /// The same, said of something greater. That a GPU is gone is no matter of what it was to do.
    pub(crate) fn of(self, text: impl Into<String>) -> Self {
        match self.kind {
            GpuErrorKind::Lost | GpuErrorKind::Inert => self,
            _ => Self { text: text.into(), ..self },
        }
    }

    /// What kind of error it is.
    #[must_use]
    pub fn kind(&self) -> GpuErrorKind {
        self.kind
    }
}

impl PartialEq for GpuError {
    /// By kind and text, whatever the driver said.
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
