//! A user's algorithm, which `Adaptive` runs when it is cheapest: for scenes in which nothing moves at times.
//!
//! ```sh
//! cargo run --release -p sapwise --example custom
//! ```
//!
//! The cost here is a guess, which its frames correct. `probes/examples/own_algorithm.rs` measures one.

use sapwise::algorithm::Load;
use sapwise::tuning::{AlgorithmCost, CostCurve, CostTerm, Product, Source, Term};
use sapwise::{Aabb, Adaptive, AlgorithmId, BroadPhase, Error, Pairs, Registry, Tuning};
use sapwise_scenes::Scenario;

/// Its name in tunings, reports and decisions.
pub(crate) const ID: &str = "rested@cpu1";

/// Returns the pairs of the previous frame if no box has changed, and runs another algorithm otherwise.
pub(crate) struct Rested {
    other: Box<dyn BroadPhase>,
    before: Vec<Aabb>,
    pairs: Pairs,
}

impl Rested {
    pub(crate) fn new(other: Box<dyn BroadPhase>) -> Self {
        Self { other, before: Vec::new(), pairs: Pairs::new() }
    }
}

impl BroadPhase for Rested {
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        pairs.clear();
        // A NaN bound differs from itself, so the other algorithm gets every invalid box, and names it.
        if self.before != boxes {
            // Forget the previous frame first: after an error nothing is known.
            self.before.clear();
            self.pairs.clear();
            self.other.find_pairs(boxes, &mut self.pairs)?;
            self.before.extend_from_slice(boxes);
        }
        // One by one: `pairs` handles the order, the limit and the filter.
        self.pairs.iter().for_each(|&(i, j)| pairs.push(i, j));
        pairs.finish()
    }

    /// A frame is cheaper after a similar one.
    fn is_incremental(&self) -> bool {
        true
    }
}

/// Returns a registry with [`Rested`], which runs `other` otherwise.
pub(crate) fn registry(other: &'static str) -> Registry {
    let mut registry = Registry::with_cores(1);
    // The 1 is the revision: raise it when the algorithm gets faster or slower, so that old timings count as stale.
    registry.add(ID.parse().expect("a method and a backend"), 1, move || {
        let other = other.parse().expect("a method and a backend");
        Ok(Box::new(Rested::new(Registry::with_cores(1).create(&other)?)))
    });
    registry
}

/// Returns the cost of an algorithm: nanoseconds for each unit of some terms.
pub(crate) fn cost(registry: &Registry, id: &str, terms: &[(Term, f64)]) -> AlgorithmCost {
    let algorithm: AlgorithmId = id.parse().expect("a method and a backend");
    let revision = registry.entries().iter().find(|e| e.id == algorithm).map_or(1, |e| e.revision);
    let terms = terms.iter().map(|&(term, unit_ns)| CostTerm { term, unit_ns }).collect();
    AlgorithmCost::new(algorithm, revision, CostCurve::new(terms), 0.5)
}

/// Returns a tuning with these costs, and its steps for 10 to a million boxes.
pub(crate) fn tuning(costs: Vec<AlgorithmCost>) -> Tuning {
    let load = |k: u32| Load::of_objects(10_u32.pow(k));
    Tuning::from_costs(Source::Default, "", costs, &(1..=6).map(load).collect::<Vec<Load>>())
}

#[allow(dead_code, reason = "the tests of this example have no use for its main")]
fn main() -> Result<(), Error> {
    let registry = registry("grid-sap@cpu1");
    // Comparing a box takes about a nanosecond, and so does copying a pair. If boxes move, it costs more than the other
    // one. A product of counts makes a user's own term: here that of the pairs.
    let tuning = tuning(vec![
        cost(&registry, "grid-sap@cpu1", &[(Term::Objects, 60.0)]),
        cost(
            &registry,
            ID,
            &[(Term::Objects, 2.0), (Term::Product(Product { pairs: 1, ..Product::ONE }), 1.0), (Term::Moved, 1000.0)],
        ),
    ]);
    let mut adaptive = Adaptive::new(tuning, &registry)?;
    let mut scene = Scenario::Uniform.start(5000, 1);
    let mut pairs = Pairs::new();
    for frame in 0..600 {
        // Everything moves for a hundred frames, then rests for a hundred, three times.
        if frame % 200 < 100 {
            scene.advance();
        }
        adaptive.find_pairs(scene.boxes(), &mut pairs)?;
        if let (0, Some(decision)) = (frame % 50, adaptive.last_decision()) {
            let ns = decision.predicted_ns.unwrap_or_default();
            println!("frame {frame}: {} pairs by {}, expected to take {ns:.0} ns", pairs.len(), decision.algorithm);
        }
    }
    Ok(())
}
