//! The terms of a cost: counts of operations under a load.

use crate::Load;

/// A count of operations that grows with the load in its own way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub enum Term {
    /// One call: dispatch, set-up, fork and join.
    Call,
    /// Boxes read, checked and copied: n.
    Objects,
    /// Comparisons of a sort: n log2 n.
    Sort,
    /// Boxes whose working set does not fit the last-level cache: n times the share of the set outside.
    ColdObjects,
    /// All pairs: n (n - 1) / 2.
    AllPairs,
    /// Pairs that overlap on the sweep axis ([`Load::axis_candidates`]).
    AxisCandidates,
    /// Pairs that overlap on the sweep axis within a strip ([`Load::strip_candidates`]).
    StripCandidates,
    /// Pairs written ([`Load::pairs`]).
    Pairs,
    /// Boxes times how far they move ([`Load::moved`]), for boxes that leave their fat boxes.
    Moved,
    /// Boxes that move by more than a tenth of an edge ([`Load::moved_share`] of all), for the same.
    MovedShare,
    /// A count of a program's own algorithm.
    Product(Product),
}

/// A product of powers of a load's values, for algorithms that the other terms do not describe. A tree has two:
/// `Product { objects: 1, log2_objects: 1, ..Product::ONE }`, and the same with `pairs` in place of `objects`.
///
/// No power is negative, so that no count falls when a value rises. Together they are at most
/// [`Product::MOST_POWERS`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub struct Product {
    /// Power of the number of objects, n.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "is_zero"))]
    pub objects: u8,
    /// Power of its base-2 logarithm, 0 for no object.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "is_zero"))]
    pub log2_objects: u8,
    /// Power of [`Load::pairs`].
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "is_zero"))]
    pub pairs: u8,
    /// Power of [`Load::axis_candidates`].
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "is_zero"))]
    pub axis_candidates: u8,
    /// Power of [`Load::strip_candidates`].
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "is_zero"))]
    pub strip_candidates: u8,
    /// Power of [`Load::moved`], which is 0 to 1.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "is_zero"))]
    pub moved: u8,
}

impl Product {
    /// The empty product, 1.
    pub const ONE: Self =
        Self { objects: 0, log2_objects: 0, pairs: 0, axis_candidates: 0, strip_candidates: 0, moved: 0 };

    /// Most powers of a product together: more of 2^64 candidates each would overflow to infinity.
    pub const MOST_POWERS: u32 = 8;

    /// Returns whether its powers together are at most [`Self::MOST_POWERS`].
    pub(super) fn is_sound(&self) -> bool {
        self.powers().into_iter().map(u32::from).sum::<u32>() <= Self::MOST_POWERS
    }

    fn powers(&self) -> [u8; 6] {
        let Self { objects, log2_objects, pairs, axis_candidates, strip_candidates, moved } = *self;
        [objects, log2_objects, pairs, axis_candidates, strip_candidates, moved]
    }

    fn of(&self, counts: &Counts<'_>) -> f64 {
        let Counts { load: Load { axis_candidates, strip_candidates, pairs, moved, .. }, objects, log2_objects } =
            counts;
        let figures = [objects, log2_objects, pairs, axis_candidates, strip_candidates, moved];
        figures.into_iter().zip(self.powers()).map(|(figure, power)| figure.powi(i32::from(power))).product()
    }
}

/// Returns whether a file leaves this power out.
#[cfg(feature = "serde")]
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference")]
fn is_zero(power: &u8) -> bool {
    *power == 0
}

/// Working set of an algorithm for each box: the box, its sorted copy and its key.
const WORKING_SET_BYTES: f64 = 64.0;

impl Term {
    /// Returns the count under a load, on a machine with a last-level cache of `cache_bytes`.
    pub fn count(self, load: &Load, cache_bytes: f64) -> f64 {
        Counts::new(load).of(self, cache_bytes)
    }
}

/// The values that the terms of all algorithms share under one load, computed once for each decision.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Counts<'a> {
    pub(super) load: &'a Load,
    objects: f64,
    log2_objects: f64,
}

impl<'a> Counts<'a> {
    pub(crate) fn new(load: &'a Load) -> Self {
        let objects = f64::from(load.objects);
        Self { load, objects, log2_objects: objects.max(1.0).log2() }
    }

    /// Returns the count of a term, on a machine with a last-level cache of `cache_bytes`.
    pub(crate) fn of(&self, term: Term, cache_bytes: f64) -> f64 {
        let n = self.objects;
        match term {
            Term::Call => 1.0,
            Term::Objects => n,
            Term::Sort => n * self.log2_objects,
            Term::ColdObjects => n * (1.0 - cache_bytes / (WORKING_SET_BYTES * n).max(1.0)).max(0.0),
            Term::AllPairs => n * (n - 1.0).max(0.0) / 2.0,
            Term::AxisCandidates => self.load.axis_candidates,
            Term::StripCandidates => self.load.strip_candidates,
            Term::Pairs => self.load.pairs,
            Term::Moved => n * self.load.moved,
            Term::MovedShare => n * self.load.moved_share,
            Term::Product(product) => product.of(self),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cold_objects_start_where_the_cache_ends() {
        let load = |objects| Load { objects, ..Load::default() };
        assert_eq!(Term::ColdObjects.count(&load(1000), 64_000.0), 0.0);
        assert_eq!(Term::ColdObjects.count(&load(2000), 64_000.0), 1000.0);
    }

    #[test]
    fn a_scene_at_rest_has_no_moved_boxes() {
        let load = |moved| Load { objects: 200, moved, ..Load::default() };
        assert_eq!([0.0, 0.25, 1.0].map(|moved| Term::Moved.count(&load(moved), 0.0)), [0.0, 50.0, 200.0]);
        assert_eq!(Term::MovedShare.count(&load(0.25).with_moved_share(0.5), 0.0), 100.0);
    }

    #[test]
    fn products_by_hand() {
        let load = Load::of_objects(8).with_pairs(5.0).with_candidates(3.0, 2.0).with_moved(0.5);
        let count = |product: Product| Term::Product(product).count(&load, 0.0);
        assert_eq!(count(Product::ONE), 1.0);
        assert_eq!(count(Product { objects: 1, log2_objects: 1, ..Product::ONE }), Term::Sort.count(&load, 0.0));
        assert_eq!(count(Product { pairs: 1, log2_objects: 2, ..Product::ONE }), 5.0 * 9.0);
        let all = Product { objects: 2, axis_candidates: 1, strip_candidates: 1, moved: 1, ..Product::ONE };
        assert_eq!(count(all), 64.0 * 3.0 * 2.0 * 0.5);
        let nothing = Load::default();
        assert_eq!(Term::Product(Product { objects: 1, log2_objects: 1, ..Product::ONE }).count(&nothing, 0.0), 0.0);
        let most = Product { pairs: 8, ..Product::ONE };
        assert!(most.is_sound() && !Product { moved: 1, ..most }.is_sound());
    }
}
