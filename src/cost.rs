//! What a frame costs: a sum of terms, each a count of operations times nanoseconds per operation.

mod term;

use crate::Load;
use std::fmt;

pub use term::{Counts, Product, Term};

/// The most nanoseconds that one count may take: an hour for one object. Beyond these bounds the arithmetic of a cost would end in infinities,
/// and an infinity less an infinity is no cost.
pub const MOST_UNIT_NS: f64 = 3.6e12;
/// 2^64 objects.
const MOST_LOG2_OBJECTS: f64 = 64.0;
/// A correction by e^50.
const MOST_LN_FACTOR: f64 = 50.0;

/// The cost of one algorithm on one machine as a function of the load.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct CostCurve {
    /// Terms of the sum; none is negative.
    pub terms: Vec<CostTerm>,
    /// Terms of the fallback of the algorithm, which it takes where this sum is the smaller one: `pair-cache` does what `bvh` does where
    /// boxes move too far. Empty where it has none.
    pub fallback_terms: Vec<CostTerm>,
    /// Last-level cache of the machine, for [`Term::ColdObjects`].
    pub cache_bytes: f64,
    /// What the terms leave unexplained, ascending by `log2_objects`: the sum is multiplied by `exp(ln_factor)`,
    /// linear between knots and constant beyond the outer ones. Empty: nothing is corrected.
    pub correction: Vec<Knot>,
}

/// One term of a cost curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CostTerm {
    /// What is counted.
    pub term: Term,
    /// Nanoseconds for each.
    pub unit_ns: f64,
}

/// One point of a correction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Knot {
    /// Base-2 logarithm of the number of objects.
    pub log2_objects: f64,
    /// Natural logarithm of measured over modelled time there.
    pub ln_factor: f64,
}

impl CostTerm {
    /// Nanoseconds for each count of a term.
    #[must_use]
    pub const fn new(term: Term, unit_ns: f64) -> Self {
        Self { term, unit_ns }
    }
}

impl CostCurve {
    /// The sum of these terms, without a fallback or a correction, on a machine of which no cache is known.
    #[must_use]
    pub fn new(terms: Vec<CostTerm>) -> Self {
        Self { terms, ..Self::default() }
    }

    /// The same with the terms of a fallback.
    #[must_use]
    pub fn with_fallback(self, fallback_terms: Vec<CostTerm>) -> Self {
        Self { fallback_terms, ..self }
    }

    /// The same on a machine with a last-level cache of this many bytes.
    #[must_use]
    pub fn with_cache(self, cache_bytes: f64) -> Self {
        Self { cache_bytes, ..self }
    }

    /// The same with a correction, whose knots ascend.
    #[must_use]
    pub fn with_correction(self, correction: Vec<Knot>) -> Self {
        Self { correction, ..self }
    }

    /// Predicted nanoseconds for a frame under `load`.
    #[must_use]
    pub fn cost_ns(&self, load: &Load) -> f64 {
        self.cost_of(&Counts::new(load))
    }

    pub(crate) fn cost_of(&self, counts: &Counts<'_>) -> f64 {
        let sum = self.uncorrected(counts);
        if self.correction.is_empty() { sum } else { sum * self.ln_correction(counts.log2_objects()).exp() }
    }

    /// Predicted nanoseconds of the fallback, where there is one.
    pub(crate) fn fallback_of(&self, counts: &Counts<'_>) -> Option<f64> {
        let ns: f64 = self.fallback_terms.iter().map(|t| t.unit_ns * counts.of(t.term, self.cache_bytes)).sum();
        (!self.fallback_terms.is_empty()).then(|| ns * self.ln_correction(counts.log2_objects()).exp())
    }

    /// What of the predicted nanoseconds is due to [`Term::Call`].
    pub(crate) fn calls_of(&self, counts: &Counts<'_>) -> f64 {
        let ns: f64 = self.terms.iter().filter(|t| t.term == Term::Call).map(|t| t.unit_ns).sum();
        ns * self.ln_correction(counts.log2_objects()).exp()
    }

    /// The sum of the terms, of the fallback where that is cheaper.
    fn uncorrected(&self, counts: &Counts<'_>) -> f64 {
        let sum =
            |terms: &[CostTerm]| -> f64 { terms.iter().map(|t| t.unit_ns * counts.of(t.term, self.cache_bytes)).sum() };
        let first = sum(&self.terms);
        if self.fallback_terms.is_empty() { first } else { first.min(sum(&self.fallback_terms)) }
    }

    /// What the cost is at least and at most under the loads of which no count is below `least` nor above `most`.
    pub(crate) fn bounds(&self, least: &Counts<'_>, most: &Counts<'_>) -> (f64, f64) {
        let (low, high) = (self.uncorrected(least), self.uncorrected(most));
        if self.correction.is_empty() {
            return (low, high);
        }
        // It is linear between knots, so that its extremes lie at the ends or at the knots between them.
        let (from, to) = (least.log2_objects(), most.log2_objects());
        let (a, b) = (self.ln_correction(from), self.ln_correction(to));
        let first = self.correction.partition_point(|k| k.log2_objects <= from);
        let inner = self.correction[first..].iter().take_while(|k| k.log2_objects < to).map(|k| k.ln_factor);
        let (lowest, highest) = inner.fold((a.min(b), a.max(b)), |(l, h), k| (l.min(k), h.max(k)));
        (low * lowest.exp(), high * highest.exp())
    }

    /// The correction with `ln` added to it, as knots at its own places and at `octaves`, within what a file may hold.
    #[must_use]
    pub fn corrected_by(&self, octaves: impl Iterator<Item = f64>, ln: impl Fn(f64) -> f64) -> Vec<Knot> {
        let mut octaves: Vec<f64> = self.correction.iter().map(|k| k.log2_objects).chain(octaves).collect();
        octaves.sort_by(f64::total_cmp);
        octaves.dedup();
        let knot = |log2_objects: f64| {
            let ln_factor = self.ln_correction(log2_objects) + ln(log2_objects);
            Knot { log2_objects, ln_factor: ln_factor.clamp(-MOST_LN_FACTOR, MOST_LN_FACTOR) }
        };
        octaves.into_iter().map(knot).collect()
    }

    /// The correction at a base-2 logarithm of the number of objects, as a natural logarithm.
    #[must_use]
    pub fn ln_correction(&self, x: f64) -> f64 {
        let after = self.correction.partition_point(|k| k.log2_objects <= x);
        match (after.checked_sub(1).map(|k| self.correction[k]), self.correction.get(after)) {
            (Some(a), Some(b)) => {
                let share = (x - a.log2_objects) / (b.log2_objects - a.log2_objects);
                a.ln_factor + share * (b.ln_factor - a.ln_factor)
            }
            (Some(outer), None) => outer.ln_factor,
            (None, Some(outer)) => outer.ln_factor,
            (None, None) => 0.0,
        }
    }

    /// What makes this curve unusable, if anything.
    #[must_use]
    pub fn defect(&self) -> Option<CurveError> {
        let terms = || self.terms.iter().chain(&self.fallback_terms);
        if let Some(t) = terms().find(|t| !(0.0..=MOST_UNIT_NS).contains(&t.unit_ns)) {
            return Some(CurveError::Unit { term: t.term, unit_ns: t.unit_ns });
        }
        if let Some(t) = terms().find(|t| matches!(t.term, Term::Product(p) if !p.is_sound())) {
            return Some(CurveError::Powers { term: t.term });
        }
        if !(self.cache_bytes.is_finite() && self.cache_bytes >= 0.0) {
            return Some(CurveError::Cache { bytes: self.cache_bytes });
        }
        let bounded = |k: &Knot| k.log2_objects.abs() <= MOST_LOG2_OBJECTS && k.ln_factor.abs() <= MOST_LN_FACTOR;
        if !self.correction.iter().all(bounded) || !self.correction.is_sorted_by(|a, b| a.log2_objects < b.log2_objects) {
            return Some(CurveError::Correction);
        }
        let nothing = |terms: &[CostTerm]| terms.iter().all(|t| t.unit_ns == 0.0);
        if nothing(&self.terms) || !self.fallback_terms.is_empty() && nothing(&self.fallback_terms) {
            return Some(CurveError::Nothing);
        }
        None
    }
}

/// What makes a cost curve unusable.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum CurveError {
    /// A negative unit, or one beyond [`MOST_UNIT_NS`].
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
    /// Knots of the correction that are not ascending, or beyond every measurement.
    Correction,
    /// No term above zero.
    Nothing,
}

impl fmt::Display for CurveError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unit { term, unit_ns } => write!(f, "the term {term:?} has {unit_ns} ns a unit"),
            Self::Powers { term } => write!(f, "{term:?} has more than {} powers", Product::MOST_POWERS),
            Self::Cache { bytes } => write!(f, "a cache of {bytes} bytes"),
            Self::Correction => f.write_str("knots of the correction that are not ascending, or beyond every measurement"),
            Self::Nothing => f.write_str("no term above zero, so the cost is always nothing"),
        }
    }
}

impl std::error::Error for CurveError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_adds_its_terms_and_applies_its_correction_between_knots() {
        let mut curve = CostCurve {
            terms: vec![CostTerm { term: Term::Call, unit_ns: 100.0 }, CostTerm { term: Term::AllPairs, unit_ns: 2.0 }],
            ..CostCurve::default()
        };
        let load = |objects| Load { objects, ..Load::default() };
        assert_eq!(curve.cost_ns(&load(5)), 100.0 + 2.0 * 10.0);
        curve.correction =
            vec![Knot { log2_objects: 2.0, ln_factor: 0.0 }, Knot { log2_objects: 4.0, ln_factor: 2.0_f64.ln() }];
        assert_eq!(curve.cost_ns(&load(4)), 112.0);
        assert!((curve.cost_ns(&load(8)) - 156.0 * 2.0_f64.sqrt()).abs() < 1e-9);
        assert!((curve.cost_ns(&load(1024)) / (100.0 + 1024.0 * 1023.0) - 2.0).abs() < 1e-9);
        assert_eq!(curve.defect(), None);
    }

    #[test]
    fn an_algorithm_with_a_fallback_takes_the_cheaper_one() {
        let term = |term, unit_ns| CostTerm { term, unit_ns };
        let mut curve = CostCurve {
            terms: vec![term(Term::Objects, 2.0), term(Term::Moved, 100.0)],
            fallback_terms: vec![term(Term::Objects, 30.0)],
            ..CostCurve::default()
        };
        let load = |moved| Load { objects: 10, moved, ..Load::default() };
        assert_eq!([0.0, 0.25, 1.0].map(|moved| curve.cost_ns(&load(moved))), [20.0, 270.0, 300.0]);
        curve.fallback_terms = vec![term(Term::Objects, 0.0)];
        assert!(curve.defect().is_some());
    }

    #[test]
    fn impossible_curves_are_told() {
        let curve = |unit_ns| CostCurve { terms: vec![CostTerm { term: Term::Call, unit_ns }], ..CostCurve::default() };
        let knot = |log2_objects| Knot { log2_objects, ln_factor: 0.0 };
        let far = CostCurve { correction: vec![knot(-1e308), knot(1e308)], ..curve(1.0) };
        assert!(far.defect().is_some() && curve(1.0).defect().is_none());
        let powers = CostCurve::new(vec![CostTerm::new(Term::Product(Product::ONE.pairs(9)), 1.0)]);
        assert!(matches!(powers.defect(), Some(CurveError::Powers { .. })));
        assert!(curve(-1.0).defect().is_some() && curve(f64::NAN).defect().is_some() && curve(0.0).defect().is_some());
    }
}
