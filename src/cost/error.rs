//! What makes a cost curve unusable.

use super::{MOST_UNIT_NS, Product, Term};
use std::fmt;

/// What makes a cost curve unusable.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum CurveError {
    /// A unit that is negative or above [`MOST_UNIT_NS`].
    Unit {
        /// The term.
        term: Term,
        /// Its unit.
        unit_ns: f64,
    },
    /// A product of more than [`Product::MOST_POWERS`] powers.
    Powers {
        /// The term.
        term: Term,
    },
    /// A cache of an impossible size.
    Cache {
        /// Its size.
        bytes: f64,
    },
    /// A residual with more weights than places, or with an impossible weight.
    Residual,
    /// Helpers with impossible values.
    Helpers,
    /// A fallback that has a fallback itself, or an impossible factor.
    Fallback,
    /// No term above zero.
    Nothing,
}

impl fmt::Display for CurveError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unit { term, unit_ns } => {
                write!(f, "the term {term:?} has {unit_ns} ns a unit; use 0 to {MOST_UNIT_NS:e}")
            }
            Self::Powers { term } => write!(f, "{term:?} has too many powers; use at most {}", Product::MOST_POWERS),
            Self::Cache { bytes } => write!(f, "a cache of {bytes} bytes; it must be finite and not negative"),
            Self::Residual => f.write_str("a residual has more weights than places, or an impossible weight"),
            Self::Fallback => f.write_str("a fallback has a fallback itself, or a factor outside 0.01 to 100"),
            Self::Helpers => f.write_str("helpers have fewer than two threads, an impossible time or no speed-up"),
            Self::Nothing => f.write_str("no term is above zero, so the cost is always zero"),
        }
    }
}

impl std::error::Error for CurveError {}
