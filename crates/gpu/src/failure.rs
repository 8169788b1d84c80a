//! Why a frame on a GPU failed.

use sapwise::error::{GpuError, GpuErrorKind, Unavailable};
use sapwise::{AlgorithmId, Error};

/// Tells a failure of the GPU, after which the frame can run elsewhere, from one of the frame.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Failure {
    /// The GPU can't do it: it was lost, is out of memory, or the frame is beyond its limits.
    Gpu(GpuError),
    /// The boxes are invalid, or the host is out of memory.
    Frame(Error),
}

impl Failure {
    /// The frame is more than a GPU, or one submission, can take.
    pub(super) fn limit(text: impl Into<String>) -> Self {
        Self::Gpu(GpuError::new(GpuErrorKind::Limit, text))
    }

    /// Converts it to the error of an algorithm.
    pub(super) fn of(self, algorithm: &AlgorithmId) -> Error {
        match self {
            Self::Frame(error) => error,
            Self::Gpu(error) => unavailable(algorithm, error),
        }
    }
}

/// Returns the error of an algorithm that a GPU can't run.
pub(super) fn unavailable(algorithm: &AlgorithmId, error: GpuError) -> Error {
    Error::Unavailable { algorithm: algorithm.clone(), reason: Unavailable::Gpu(error) }
}

impl From<GpuError> for Failure {
    fn from(error: GpuError) -> Self {
        Self::Gpu(error)
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Self::Frame(error)
    }
}
