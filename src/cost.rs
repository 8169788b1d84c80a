//! Cost curves: a frame costs a sum of terms, each a count of operations times nanoseconds per operation, times a
//! residual over the load. Several threads change that cost by what calling helpers takes and how much they speed the
//! work up.

mod error;
mod helpers;
mod residual;
mod term;

use crate::Load;
use std::cell::{Cell, OnceCell};
use std::sync::Arc;

pub use error::CurveError;
pub use helpers::Helpers;
use residual::Likeness;
pub use residual::{Places, Residual};
pub(crate) use term::Counts;
pub use term::{Product, Term};

/// Most nanoseconds for one count: an hour for one object. Beyond it the arithmetic of a cost could overflow to
/// infinity, and the difference of two infinities is no cost.
pub const MOST_UNIT_NS: f64 = 3.6e12;

/// The cost of one algorithm on one machine as a function of the load.
///
/// ```
/// use sapwise::algorithm::Load;
/// use sapwise::tuning::{CostCurve, CostTerm, Term};
///
/// let curve = CostCurve::new(vec![CostTerm::new(Term::Call, 100.0), CostTerm::new(Term::Objects, 5.0)]);
/// assert_eq!(curve.cost_ns(&Load::of_objects(20)), 200.0);
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct CostCurve {
    /// Cost on one thread or on its GPUs. Shared by the algorithms of a method, for which it is computed once.
    pub work: Arc<Work>,
    /// Effect of several threads; `None` for one thread and for GPUs.
    pub helpers: Option<Helpers>,
    /// Correction of that: what a prediction leaves unexplained on several threads, and what frames that ran showed.
    pub residual: Option<Residual>,
}

/// The cost of a method on one thread of a machine or on some of its GPUs: a sum of terms times the exponential of a
/// residual.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Work {
    /// Terms of the sum; none is negative.
    pub terms: Vec<CostTerm>,
    /// Work that is done instead when it is cheaper: `pair-cache` does the work of `bvh` when boxes move too far.
    pub fallback: Option<Fallback>,
    /// Last-level cache of the machine, for [`Term::ColdObjects`].
    pub cache_bytes: f64,
    /// The part of the cost that the terms do not explain.
    pub residual: Option<Residual>,
}

/// The work of another method that is done instead.
#[derive(Debug, Clone, PartialEq)]
pub struct Fallback {
    /// The other work. It has no fallback of its own.
    pub work: Arc<Work>,
    /// Factor on its cost here.
    pub factor: f64,
}

/// One term of a cost.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub struct CostTerm {
    /// What is counted.
    pub term: Term,
    /// Nanoseconds for each.
    pub unit_ns: f64,
}

/// A load under which many costs are computed. Their common parts are computed once.
pub(crate) struct Frame<'a> {
    counts: Counts<'a>,
    /// Similarity to the first places that a residual had. The methods of a tuning share their places.
    likeness: OnceCell<(Arc<Places>, Likeness)>,
    /// Costs of works. The algorithms of a method share their work.
    known: [Cell<Option<(&'a Work, f64)>>; 8],
}

impl<'a> Frame<'a> {
    pub(crate) fn new(load: &'a Load) -> Self {
        Self { counts: Counts::new(load), likeness: OnceCell::new(), known: [const { Cell::new(None) }; 8] }
    }

    /// Returns the factor of a residual on a cost.
    fn factor(&self, residual: Option<&Residual>) -> f64 {
        let Some(residual) = residual else { return 1.0 };
        let places = &residual.places;
        let (of, likeness) = self.likeness.get_or_init(|| (Arc::clone(places), places.likeness_of(self.counts.load)));
        let ln = if Arc::ptr_eq(of, places) { residual.ln_of(likeness) } else { residual.ln(self.counts.load) };
        ln.exp()
    }

    fn work(&self, work: &'a Work) -> f64 {
        for known in &self.known {
            match known.get() {
                Some((of, cost)) if std::ptr::eq(of, work) => return cost,
                Some(_) => {}
                None => {
                    // Its fallback, if any, is computed meanwhile and not kept.
                    let cost = work.cost_of(self);
                    known.set(Some((work, cost)));
                    return cost;
                }
            }
        }
        work.cost_of(self)
    }
}

impl CostTerm {
    /// Creates a term with its nanoseconds for each count.
    pub const fn new(term: Term, unit_ns: f64) -> Self {
        Self { term, unit_ns }
    }
}

impl Work {
    /// Creates the sum of these terms, on a machine of unknown cache.
    pub fn new(terms: Vec<CostTerm>) -> Self {
        Self { terms, ..Self::default() }
    }

    /// Returns the nanoseconds of a frame under `load`.
    pub fn ns(&self, load: &Load) -> f64 {
        self.cost_of(&Frame::new(load))
    }

    fn cost_of<'a>(&'a self, frame: &Frame<'a>) -> f64 {
        let sum: f64 = self.terms.iter().map(|t| t.unit_ns * frame.counts.of(t.term, self.cache_bytes)).sum();
        let least = self.fallback.as_ref().map_or(sum, |f| sum.min(f.factor * frame.work(&f.work)));
        least * frame.factor(self.residual.as_ref())
    }

    /// Returns what makes it unusable, if anything.
    #[doc(hidden)]
    pub fn defect(&self) -> Option<CurveError> {
        for &CostTerm { term, unit_ns } in &self.terms {
            if !(0.0..=MOST_UNIT_NS).contains(&unit_ns) {
                return Some(CurveError::Unit { term, unit_ns });
            }
            if matches!(term, Term::Product(product) if !product.is_sound()) {
                return Some(CurveError::Powers { term });
            }
        }
        if !(self.cache_bytes.is_finite() && self.cache_bytes >= 0.0) {
            return Some(CurveError::Cache { bytes: self.cache_bytes });
        }
        if self.residual.as_ref().is_some_and(|r| !r.is_sound()) {
            return Some(CurveError::Residual);
        }
        if self.terms.iter().all(|t| t.unit_ns == 0.0) {
            return Some(CurveError::Nothing);
        }
        let fallback = self.fallback.as_ref()?;
        if fallback.work.fallback.is_some() || !(0.01..=100.0).contains(&fallback.factor) {
            return Some(CurveError::Fallback);
        }
        fallback.work.defect()
    }
}

impl CostCurve {
    /// Creates the sum of these terms on one thread, without fallback and residual, on a machine of unknown cache.
    pub fn new(terms: Vec<CostTerm>) -> Self {
        Self::of(Arc::new(Work::new(terms)))
    }

    /// Creates the cost of this work on one thread or on GPUs.
    pub fn of(work: Arc<Work>) -> Self {
        Self { work, ..Self::default() }
    }

    /// Sets other work that is done instead when it is cheaper, with the factor on its cost here.
    #[must_use]
    pub fn with_fallback(mut self, work: Arc<Work>, factor: f64) -> Self {
        self.work_mut().fallback = Some(Fallback { work, factor });
        self
    }

    /// Returns the cost on one thread or on GPUs, to be changed for this algorithm alone.
    pub fn work_mut(&mut self) -> &mut Work {
        Arc::make_mut(&mut self.work)
    }

    /// Returns the predicted nanoseconds of a frame under `load`.
    pub fn cost_ns(&self, load: &Load) -> f64 {
        self.cost_of(&Frame::new(load))
    }

    pub(crate) fn cost_of<'a>(&'a self, frame: &Frame<'a>) -> f64 {
        let work_ns = frame.work(&self.work);
        let ns = self.helpers.map_or(work_ns, |h| h.cost_ns(frame.counts.load.objects, work_ns));
        ns * frame.factor(self.residual.as_ref())
    }

    /// Returns what makes this curve unusable, if anything.
    pub fn defect(&self) -> Option<CurveError> {
        if let Some(defect) = self.work.defect() {
            return Some(defect);
        }
        if self.helpers.is_some_and(|h| !h.is_sound()) {
            return Some(CurveError::Helpers);
        }
        self.residual.as_ref().is_some_and(|r| !r.is_sound()).then_some(CurveError::Residual)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn load(objects: u32) -> Load {
        Load::of_objects(objects)
    }

    #[test]
    fn a_curve_adds_its_terms_and_multiplies_by_residuals() {
        let curve = CostCurve::new(vec![CostTerm::new(Term::Call, 100.0), CostTerm::new(Term::AllPairs, 2.0)]);
        assert_eq!(curve.cost_ns(&load(5)), 100.0 + 2.0 * 10.0);
        let places = Arc::new(Places::new(vec![load(16)]));
        let residual = Residual::new(Arc::clone(&places), vec![2.0_f64.ln()], false);
        let mut with = curve.clone();
        with.work_mut().residual = Some(residual.clone());
        assert!((with.cost_ns(&load(16)) / curve.cost_ns(&load(16)) - 2.0).abs() < 1e-9);
        with.residual = Some(Residual { constant: 3.0_f64.ln(), ..residual });
        assert!((with.cost_ns(&load(16)) / curve.cost_ns(&load(16)) - 12.0).abs() < 1e-9);
        assert_eq!(with.defect(), None);
    }

    #[test]
    fn an_algorithm_with_a_fallback_takes_the_cheaper_one() {
        let mut curve = CostCurve::new(vec![CostTerm::new(Term::Objects, 2.0), CostTerm::new(Term::Moved, 100.0)])
            .with_fallback(Arc::new(Work::new(vec![CostTerm::new(Term::Objects, 20.0)])), 1.5);
        assert_eq!([0.0, 0.25, 1.0].map(|moved| curve.cost_ns(&load(10).with_moved(moved))), [20.0, 270.0, 300.0]);
        let of_itself = Arc::clone(&curve.work);
        assert_eq!(curve.clone().with_fallback(of_itself, 1.0).defect(), Some(CurveError::Fallback));
        curve.work_mut().fallback = Some(Fallback { work: Arc::new(Work::default()), factor: 1.0 });
        assert_eq!(curve.defect(), Some(CurveError::Nothing));
    }

    #[test]
    fn helpers_divide_work_but_not_calls() {
        let one = CostCurve::new(vec![CostTerm::new(Term::Call, 50.0), CostTerm::new(Term::Objects, 10.0)]);
        let two = CostCurve { helpers: Some(Helpers { call_ns: 1000.0, ..Helpers::new(2) }), ..one.clone() };
        assert_eq!((one.cost_ns(&load(1000)), two.cost_ns(&load(1000))), (10_050.0, 6025.0));
        // Both share one work, which is computed once.
        assert!(Arc::ptr_eq(&one.work, &two.work));
    }

    #[test]
    fn more_works_than_are_kept_have_their_own_costs() {
        let curves: Vec<CostCurve> =
            (1..=20).map(|k| CostCurve::new(vec![CostTerm::new(Term::Objects, f64::from(k))])).collect();
        let load = load(10);
        let frame = Frame::new(&load);
        for _ in 0..2 {
            for (k, curve) in curves.iter().enumerate() {
                assert_eq!(curve.cost_of(&frame), 10.0 * (k + 1) as f64);
            }
        }
    }

    #[test]
    fn impossible_curves_are_refused() {
        let curve = |unit_ns| CostCurve::new(vec![CostTerm::new(Term::Call, unit_ns)]);
        let places = Arc::new(Places::new(vec![load(16)]));
        let with_residual = |weights: &[f64]| {
            let residual = Residual::new(Arc::clone(&places), weights.to_vec(), false);
            CostCurve { residual: Some(residual), ..curve(1.0) }
        };
        assert_eq!(with_residual(&[0.1]).defect(), None);
        for wrong in [&[f64::NAN][..], &[1e9], &[0.1, 0.1]] {
            assert_eq!(with_residual(wrong).defect(), Some(CurveError::Residual), "{wrong:?}");
        }
        let alone = CostCurve { helpers: Some(Helpers::new(1)), ..curve(1.0) };
        assert_eq!(alone.defect(), Some(CurveError::Helpers));
        let powers = CostCurve::new(vec![CostTerm::new(Term::Product(Product { pairs: 9, ..Product::ONE }), 1.0)]);
        assert!(matches!(powers.defect(), Some(CurveError::Powers { .. })));
        assert!(curve(-1.0).defect().is_some() && curve(f64::NAN).defect().is_some() && curve(0.0).defect().is_some());
    }
}
