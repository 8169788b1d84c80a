//! What makes a tuning unusable.

use crate::AlgorithmId;
use crate::cost::CurveError;
use std::fmt;

/// What makes a tuning unusable.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum TuningError {
    /// There is no step at 0 objects.
    NoFirstStep,
    /// The steps are not ascending.
    StepOrder,
    /// A crossover outside its interval, or with only one end of it.
    Crossover {
        /// The algorithm below it.
        below: AlgorithmId,
        /// The algorithm above it.
        above: AlgorithmId,
    },
    /// A cost that names a missing work. Only in files.
    NoWork {
        /// The algorithm.
        algorithm: AlgorithmId,
        /// The position that it names.
        work: usize,
    },
    /// A work that falls back to a work that is not before it. Only in files.
    NoFallback {
        /// The position that it names.
        work: usize,
    },
    /// Residuals with different places.
    Places {
        /// An algorithm whose places differ from those of the first.
        algorithm: AlgorithmId,
    },
    /// An impossible cost curve.
    Curve {
        /// The algorithm.
        algorithm: AlgorithmId,
        /// What is wrong with it.
        source: CurveError,
    },
    /// A spread that is negative or not a number.
    Spread {
        /// The algorithm.
        algorithm: AlgorithmId,
        /// The spread.
        spread_ln: f64,
    },
    /// An algorithm with two costs.
    Repeated {
        /// The algorithm.
        algorithm: AlgorithmId,
    },
}

impl fmt::Display for TuningError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoFirstStep => f.write_str("the steps don't begin at 0 objects"),
            Self::StepOrder => f.write_str("the steps are not ascending"),
            Self::Crossover { below, above } => {
                write!(f, "the crossover from {below} to {above} does not lie within its interval")
            }
            Self::NoWork { algorithm, work } => write!(f, "the cost of {algorithm}: there is no work {work}"),
            Self::NoFallback { work } => {
                write!(f, "a work falls back to the work {work}, which does not stand before it")
            }
            Self::Places { algorithm } => {
                write!(
                    f,
                    "the cost of {algorithm}: its residual is known at other places than that of the first algorithm"
                )
            }
            Self::Curve { algorithm, source } => write!(f, "the cost of {algorithm}: {source}"),
            Self::Spread { algorithm, spread_ln } => write!(f, "the cost of {algorithm}: a spread of {spread_ln}"),
            Self::Repeated { algorithm } => write!(f, "{algorithm} stands there twice"),
        }
    }
}

impl std::error::Error for TuningError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Curve { source, .. } => Some(source),
            _ => None,
        }
    }
}
