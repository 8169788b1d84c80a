//! Runs `Adaptive` and every algorithm on a growing scene of moving boxes, and compares each frame with the
//! definition of overlap. A wrong answer panics, which in WebAssembly is a trap.
//!
//! `tools/wasm.sh` builds it for wasm32-unknown-unknown and runs it in Node.js; `cargo run -p sapwise-example-wasm`
//! runs it here.

use sapwise::algorithm::Load;
use sapwise::tuning::{AlgorithmCost, CostCurve, CostTerm, Source, Term};
use sapwise::{Aabb, Adaptive, BroadPhase, PairOrder, Pairs, Registry, Tuning};

/// The last frame has 1500 boxes.
const FRAMES: usize = 60;
const GROWTH: usize = 25;

fn main() {
    let registry = Registry::new();
    let mut adaptive = Adaptive::new(tuning(&registry), &registry).expect("algorithms on one thread");
    let mut each: Vec<Box<dyn BroadPhase>> =
        registry.available().iter().map(|entry| registry.create(&entry.id).expect("it is available")).collect();
    let mut pairs = Pairs::with_order(PairOrder::Canonical);
    let (mut chosen, mut timed) = (Vec::new(), 0);
    for frame in 1..=FRAMES {
        let boxes = boxes(frame);
        let expected = overlapping(&boxes);
        adaptive.find_pairs(&boxes, &mut pairs).expect("sound boxes");
        assert_eq!(pairs.as_slice(), expected, "the choice, frame {frame}");
        let decision = adaptive.last_decision().expect("a frame ran");
        timed += usize::from(decision.measured_ns.is_some());
        if chosen.last() != Some(decision.algorithm) {
            chosen.push(decision.algorithm.clone());
        }
        for algorithm in &mut each {
            algorithm.find_pairs(&boxes, &mut pairs).expect("sound boxes");
            assert_eq!(pairs.as_slice(), expected, "one of them, frame {frame}");
        }
    }
    assert!(overlapping(&boxes(FRAMES)).len() > 100, "there is something to find");
    assert!(chosen.len() > 1, "the choice changed as the scene grew");
    let has_clock = cfg!(not(all(target_family = "wasm", target_os = "unknown")));
    assert_eq!(timed > 0, has_clock, "frames are timed if there is a clock");
}

/// Returns a tuning in which brute force is cheaper below a few hundred boxes, and the grid above.
fn tuning(registry: &Registry) -> Tuning {
    let cost = |id: &str, term: Term, unit_ns: f64| {
        let entry =
            registry.available().into_iter().find(|entry| entry.id.to_string() == id).expect("a method of ours");
        AlgorithmCost::new(entry.id, entry.revision, CostCurve::new(vec![CostTerm { term, unit_ns }]), 0.1)
    };
    let loads: Vec<Load> = (1..=14).map(|k| Load::of_objects(1 << k)).collect();
    let costs = vec![cost("brute@cpu1", Term::AllPairs, 1.0), cost("grid-sap@cpu1", Term::Objects, 200.0)];
    Tuning::from_costs(Source::Measured, "growing", costs, &loads)
}

/// Returns boxes that have moved a little since the previous frame, and some new ones.
fn boxes(frame: usize) -> Vec<Aabb> {
    let mut state = 0x2545_f491_4f6c_dd1d_u64;
    let mut draw = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 40) as f32 / (1_u64 << 24) as f32
    };
    let mut place = || [draw(), draw(), draw(), draw()];
    let drift = frame as f32 * 0.02;
    (0..frame * GROWTH)
        .map(|_| {
            let [x, y, z, phase] = place();
            Aabb::cube([20.0 * x + drift * phase, 20.0 * y, 20.0 * z - drift * phase], 0.5)
        })
        .collect()
}

fn overlapping(boxes: &[Aabb]) -> Vec<(u32, u32)> {
    let all = 0..boxes.len();
    let after = |i: usize| {
        (i + 1..boxes.len()).filter(move |&j| boxes[i].overlaps(&boxes[j])).map(move |j| (i as u32, j as u32))
    };
    all.flat_map(after).collect()
}

#[cfg(test)]
mod tests {
    #[test]
    fn every_frame_is_right_on_this_machine() {
        super::main();
    }
}
