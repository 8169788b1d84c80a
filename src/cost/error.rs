//! What makes a cost curve unusable.

use super::{Product, Term};
use std::fmt;

/// What makes a cost curve unusable.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum CurveError {
    /// A negative unit, or one beyond [`MOST_UNIT_NS`](super::MOST_UNIT_NS).
    Unit {
        /// The term.
        term: Term,
        /// Its unit.
        unit_ns: f64,
    },
    /// A product of more powers than [`Product::MOST_POWERS`].
    Powers {
        /// The term.
        term: Term,
    },
    /// A cache of a size that none has.
    Cache {
        /// Its size.
        bytes: f64,
    },
    /// A residual with more weights than places, or one beyond every measurement.
    Residual,
    /// Helpers with figures that can't be.
    Helpers,
    /// A fallback that falls back itself, or costs a factor that none does.
    Fallback,
    /// No term above zero.
    Nothing,
}

impl fmt::Display for CurveError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unit { term, unit_ns } => write!(f, "the term {term:?} has {unit_ns} ns a unit"),
            Self::Powers { term } => write!(f, "{term:?} has more than {} powers", Product::MOST_POWERS),
            Self::Cache { bytes } => write!(f, "a cache of {bytes} bytes"),
            Self::Residual => {
                f.write_str("a residual with more weights than places, or with one beyond every measurement")
            }
            Self::Fallback => f.write_str("a fallback that falls back itself, or costs a factor that none does"),
            Self::Helpers => f.write_str("helpers of fewer than two threads, with a time that can't be or no speed-up"),
            Self::Nothing => f.write_str("no term above zero, so the cost is always nothing"),
        }
    }
}

impl std::error::Error for CurveError {}
