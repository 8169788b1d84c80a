use super::*;
use crate::AlgorithmId;
use crate::algorithm::Load;
use crate::cost::Helpers;
use crate::tuning::{CostCurve, CostTerm, Term};

fn cost(id: &str, unit_ns: f64) -> AlgorithmCost {
    let id: AlgorithmId = id.parse().unwrap();
    let mut curve = CostCurve::new(vec![CostTerm::new(Term::Objects, unit_ns)]);
    if id.threads() > 1 {
        curve = curve.with_helpers(Helpers::new(id.threads()).with_call(2000.0, 1000.0));
    }
    AlgorithmCost::new(id, 1, curve, 0.1)
}

fn costs() -> Vec<AlgorithmCost> {
    [("sap@cpu1", 10.0), ("sap@cpu2", 10.0), ("brute@cpu1", 20.0), ("brute@cpu2", 20.0), ("sap@gpu0", 5.0)]
        .map(|(id, unit)| cost(id, unit))
        .into()
}

fn load(objects: u32) -> Load {
    let n = f64::from(objects);
    Load::of_objects(objects).with_pairs(0.5 * n).with_candidates(n.powf(1.5), 4.0 * n)
}

/// Predictions, and what is believed of them.
struct Observed {
    costs: Vec<AlgorithmCost>,
    belief: Belief,
}

impl Observed {
    fn within(deviations: Deviations) -> Self {
        let costs = costs();
        Self { belief: Belief::new(&costs, &[None; 5], deviations), costs }
    }

    /// A frame took `factor` times what was predicted.
    fn observe(&mut self, algorithm: usize, load: &Load, factor: f64, noise_ln: f64) -> bool {
        let (view, calls) = self.view(algorithm, load);
        self.belief.observe(algorithm, &view, factor, calls, noise_ln)
    }

    fn view(&self, algorithm: usize, load: &Load) -> (View, f64) {
        let frame = Frame::new(load);
        let parts = self.costs[algorithm].curve.parts_of(&frame);
        (self.belief.view(&frame), parts.calls_ns / parts.ns)
    }

    /// By how much each cost is expected to differ from its prediction.
    fn deviations(&self, load: &Load) -> Vec<f64> {
        let of = |k: usize| {
            let (view, calls) = self.view(k, load);
            self.belief.deviation_ln(k, &view, calls)
        };
        (0..self.costs.len()).map(of).collect()
    }
}

#[test]
fn an_observation_moves_relatives_the_more_the_nearer_they_are() {
    let mut observed = Observed::within(Deviations::PREDICTED);
    let here = load(1000);
    assert!(observed.observe(0, &here, 1.5, 0.05));
    let moved = observed.deviations(&here);
    // Itself, its method on two threads, another method, another processor.
    assert!(moved[0] > moved[1] && moved[1] > moved[2] && moved[2] > 0.05 && moved[4] == 0.0, "{moved:?}");
    assert!((0.3..0.42).contains(&moved[0]), "{moved:?}");
    // Far away on its own part only the constants are left.
    let far = observed.deviations(&load(1_000_000));
    assert!(far[0] < 0.9 * moved[0] && far[0] > 0.2, "{far:?} {moved:?}");
}

#[test]
fn many_observations_are_believed_and_doubt_falls() {
    let mut observed = Observed::within(Deviations::PREDICTED);
    let here = load(5000);
    let doubt = |observed: &mut Observed| {
        let (view, calls) = observed.view(1, &here);
        let expected = observed.belief.expect(1, &view, calls);
        expected.shared + expected.own
    };
    let before = doubt(&mut observed);
    for _ in 0..40 {
        assert!(observed.observe(1, &here, 0.7, 0.1));
    }
    assert!((observed.deviations(&here)[1] - 0.7_f64.ln()).abs() < 0.03);
    assert!(doubt(&mut observed) < 0.1 * before && doubt(&mut observed) >= 0.0);
}

#[test]
fn the_costs_are_those_that_are_expected() {
    let mut observed = Observed::within(Deviations::UNLIKE);
    for (k, objects, factor) in [(0, 300, 1.2), (1, 40_000, 2.0), (3, 2000, 0.6), (4, 100_000, 3.0), (2, 50, 0.9)] {
        assert!(observed.observe(k, &load(objects), factor, 0.05));
    }
    let after = observed.belief.costs(&observed.costs, false, 0.0);
    for objects in [20, 900, 30_000, 700_000] {
        let here = load(objects);
        for ((cost, before), deviation) in after.iter().zip(&observed.costs).zip(observed.deviations(&here)) {
            let ratio = (cost.curve.cost_ns(&here) / before.curve.cost_ns(&here)).ln() - deviation;
            assert!(ratio.abs() < 1e-9, "{} at {objects}: {ratio}", cost.algorithm);
            assert_eq!(cost.curve.defect(), None);
        }
    }
}

#[test]
fn a_time_that_waited_for_a_core_is_not_believed_as_it_stands() {
    let mut observed = Observed::within(Deviations::PREDICTED);
    let here = load(1000);
    assert!(observed.observe(0, &here, 1000.0, 0.1));
    assert!(observed.deviations(&here)[0] < 1.3);
}

#[test]
fn what_is_no_time_tells_nothing() {
    let here = load(1000);
    let ns = costs()[0].curve.cost_ns(&here);
    let none = [
        (0, here, f64::NAN, 0.1),
        (0, here, 0.0, 0.1),
        (0, here, -1.0, 0.1),
        (0, here, f64::INFINITY, 0.1),
        (9, here, ns, 0.1),
        (0, here, ns, f64::NAN),
    ];
    let after = crate::tuning::corrected(&costs(), none);
    for (after, before) in after.iter().zip(costs()) {
        assert_eq!(after.curve.cost_ns(&here), before.curve.cost_ns(&here));
    }
    let after = crate::tuning::corrected(&costs(), [(0, here, 1.5 * ns, 0.05)]);
    assert!(after[0].curve.cost_ns(&here) > 1.3 * ns);
}

#[test]
fn what_was_observed_of_a_machine_that_may_have_changed_is_forgotten_in_time() {
    let list = costs();
    let mut belief = Belief::new(&list, &[None; 5], Deviations::UNLIKE);
    let here = load(1000);
    let view = belief.view(&Frame::new(&here));
    let doubt = |belief: &mut Belief| {
        let expected = belief.expect(1, &view, 0.2);
        expected.shared + expected.own
    };
    let before = doubt(&mut belief);
    for frame in 0..50 {
        belief.pass(frame);
        assert!(belief.observe(1, &view, 1.4, 0.2, 0.05));
    }
    let (known, ln) = (doubt(&mut belief), belief.deviation_ln(1, &view, 0.2));
    belief.pass(1_000_000);
    let (later, ln_later) = (doubt(&mut belief), belief.deviation_ln(1, &view, 0.2));
    assert!(known < 0.2 * before && later > 0.9 * before && later <= before * 1.001, "{before} {known} {later}");
    assert!((ln - 1.4_f64.ln()).abs() < 0.02 && ln_later.abs() < ln, "{ln} {ln_later}");
}

#[test]
fn what_keeping_spares_at_one_pace_is_forgotten_at_another() {
    let list = vec![cost("pair-cache@cpu1", 10.0), cost("sap@cpu1", 20.0)];
    let mut belief = Belief::new(&list, &[Some(0), None], Deviations::UNLIKE);
    let view = belief.view(&Frame::new(&load(1000)));
    for frame in 0..50 {
        belief.pass(frame);
        assert!(belief.observe(0, &view, 3.0, 0.0, 0.05) && belief.observe(1, &view, 1.0, 0.0, 0.05));
    }
    let believed = |belief: &Belief| [0, 1].map(|k| belief.deviation_ln(k, &view, 0.0));
    let before = believed(&belief);
    assert!((before[0] - 3.0_f64.ln()).abs() < 0.05, "{before:?}");
    // As little as the noise of what tells it, and as good as still either way.
    assert!(!belief.change_pace(0.1, 0.13) && !belief.change_pace(0.0, 0.002) && believed(&belief) == before);
    let told = |belief: &Belief| belief.told_of_ratio(&belief.running(1, &view, 0.0), 0, &view, 0.0, 0.01);
    let told_before = told(&belief);
    assert!(belief.change_pace(0.2, 0.0));
    let after = believed(&belief);
    assert!(after[0] < 0.6 * before[0] && after[1] == before[1], "{before:?} {after:?}");
    assert!(told(&belief) > 2.0 * told_before);
}

#[test]
fn frames_tell_less_of_a_ratio_the_noisier_they_are_and_nothing_of_what_both_have_in_common() {
    let list = vec![cost("grid-sap@cpu1", 10.0), cost("sap@cpu1", 20.0)];
    let mut belief = Belief::new(&list, &[None, None], Deviations::UNLIKE);
    let view = belief.view(&Frame::new(&load(1000)));
    let told = |belief: &Belief, noise: f64| belief.told_of_ratio(&belief.running(1, &view, 0.0), 0, &view, 0.0, noise);
    let [exact, noisy, useless] = [0.0, 0.1, 100.0].map(|noise| told(&belief, noise));
    assert!(exact > noisy && noisy > useless && useless < 0.01, "{exact} {noisy} {useless}");
    // The class alone is off by 0.8.
    assert!(exact < 0.3, "{exact}");
    (0..20).for_each(|_| assert!(belief.observe(0, &view, 1.2, 0.0, 0.02)));
    assert!(told(&belief, 0.01) < 0.3 * noisy);
}
