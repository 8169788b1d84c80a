//! Defects of a tuning.

use crate::AlgorithmId;
use crate::cost::CurveError;

crate::described! {
    /// A defect that makes a tuning unusable.
    #[derive(Debug, Clone, PartialEq)]
    #[non_exhaustive]
    pub enum TuningError {
        /// There is no step at 0 objects.
        NoFirstStep = "the steps don't begin at 0 objects",
        /// The steps are not ascending.
        StepOrder = "the steps are not ascending",
        /// A crossover outside its interval, or with only one end of it.
        Crossover {
            /// The algorithm below it.
            below: AlgorithmId,
            /// The algorithm above it.
            above: AlgorithmId,
        } = "the crossover from {below} to {above} does not lie within its interval",
        /// A cost that names a missing work. Only in files.
        NoWork {
            /// The algorithm.
            algorithm: AlgorithmId,
            /// The position that it names.
            work: usize,
        } = "the cost of {algorithm}: there is no work {work}",
        /// A work that falls back to a work that is not before it. Only in files.
        NoFallback {
            /// The position that it names.
            work: usize,
        } = "a work falls back to the work {work}, which does not stand before it",
        /// Residuals with different places.
        Places {
            /// An algorithm whose places differ from those of the first.
            algorithm: AlgorithmId,
        } = "the cost of {algorithm}: its residual is known at other places than that of the first algorithm",
        /// An impossible cost curve.
        Curve {
            /// The algorithm.
            algorithm: AlgorithmId,
            /// What is wrong with it.
            source: CurveError,
        } = "the cost of {algorithm}: {source}",
        /// A spread that is negative or not a number.
        Spread {
            /// The algorithm.
            algorithm: AlgorithmId,
            /// The spread.
            spread_ln: f64,
        } = "the cost of {algorithm}: a spread of {spread_ln}",
        /// An algorithm with two costs.
        Repeated {
            /// The algorithm.
            algorithm: AlgorithmId,
        } = "{algorithm} stands there twice",
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
