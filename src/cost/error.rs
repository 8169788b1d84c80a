//! Defects of a cost curve.

use super::{MOST_UNIT_NS, Product, Term};

const MOST_POWERS: u32 = Product::MOST_POWERS;

crate::described! {
    /// A defect that makes a cost curve unusable.
    #[derive(Debug, Clone, Copy, PartialEq)]
    #[non_exhaustive]
    pub enum CurveError {
        /// A unit that is negative or above [`MOST_UNIT_NS`].
        Unit {
            /// The term.
            term: Term,
            /// Its unit.
            unit_ns: f64,
        } = "the term {term:?} has {unit_ns} ns a unit; use 0 to {MOST_UNIT_NS:e}",
        /// A product of more than [`Product::MOST_POWERS`] powers.
        Powers {
            /// The term.
            term: Term,
        } = "{term:?} has too many powers; use at most {MOST_POWERS}",
        /// A cache of an impossible size.
        Cache {
            /// Its size.
            bytes: f64,
        } = "a cache of {bytes} bytes; it must be finite and not negative",
        /// A residual with more weights than places, or with an impossible weight.
        Residual = "a residual has more weights than places, or an impossible weight",
        /// Helpers with impossible values.
        Helpers = "helpers have fewer than two threads, an impossible time or no speed-up",
        /// A fallback that has a fallback itself, or an impossible factor.
        Fallback = "a fallback has a fallback itself, or a factor outside 0.01 to 100",
        /// No term above zero.
        Nothing = "no term is above zero, so the cost is always zero",
    }
}

impl std::error::Error for CurveError {}
