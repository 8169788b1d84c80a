//! What each candidate is expected to cost under the present load.

use super::frame_batch::Predicted;
use super::learner::Learner;
use super::switching::{Expected, SwitchingCosts};
use crate::cost::{Frame, FrameCost};
use crate::load::Load;
use crate::tuning::AlgorithmCost;
use crate::tuning::belief::View;

/// What is predicted of a load holds for another that differs by no more than this share: costs are known less well
/// than that. Its correction holds for so many frames: waits pass, whether anything is observed or not.
const ALIKE: f64 = 0.01;
const HOLDS: u64 = 64;

/// The costs of all candidates, in their order.
#[derive(Debug, Clone)]
pub(super) struct Estimates {
    /// In the mean over a candidate's frames with all waits, and by kinds of frames.
    pub(super) mean_ns: Vec<f64>,
    pub(super) expected: Vec<Expected>,
    /// What the tuning says without correction.
    pub(super) predicted: Vec<Predicted>,
    /// The load as what is learned sees it.
    pub(super) view: View,
    /// What the tuning says of a frame that goes on, and under which load.
    built: Vec<FrameCost>,
    predicted_for: Option<Load>,
    /// The frame for which that was corrected, and how much was observed by then.
    corrected: Option<(u64, u64)>,
}

impl Estimates {
    /// Of so many candidates, of which so many have costs: all or none.
    pub(super) fn new(candidates: usize, costs: usize) -> Self {
        Self {
            mean_ns: vec![f64::INFINITY; candidates],
            expected: vec![Expected { mean_ns: f64::INFINITY, alone_ns: f64::INFINITY }; candidates],
            predicted: vec![Predicted::default(); candidates],
            view: View::default(),
            built: vec![FrameCost::default(); costs],
            predicted_for: None,
            corrected: None,
        }
    }

    /// What they were corrected by is another by now.
    pub(super) fn doubt(&mut self) {
        self.corrected = None;
    }

    /// Fills in what every candidate is expected to cost, as far as that is not known from a load that was alike.
    pub(super) fn update(
        &mut self,
        load: &Load,
        costs: &[AlgorithmCost],
        learner: Option<&Learner>,
        switching: &SwitchingCosts,
        frame: u64,
    ) {
        let alike = self.predicted_for.is_some_and(|of| load.is_within(ALIKE, &of));
        if !alike {
            let under = Frame::new(load);
            self.view = learner.map_or_else(View::default, |l| l.view(&under));
            self.built.iter_mut().zip(costs).for_each(|(built, cost)| *built = cost.curve.parts_of(&under));
            self.predicted_for = Some(*load);
        }
        let observed = learner.map_or(0, Learner::observed);
        let holds = |(at, then)| then == observed && frame - at < HOLDS;
        if alike && self.corrected.is_some_and(holds) {
            return;
        }
        self.corrected = Some((frame, observed));
        let learner = learner.filter(|l| l.observed() > 0);
        for (k, &FrameCost { ns, fallback_ns, calls_ns }) in self.built.iter().enumerate() {
            let alone_ns = fallback_ns.unwrap_or(ns).max(ns);
            let mean_ns = switching.mean_ns(k, frame, ns, alone_ns);
            let predicted = Predicted { ns: mean_ns, calls_ns: calls_ns.min(ns) };
            let factor = learner.map_or(1.0, |l| l.correction_ln(k, &self.view, predicted.calls()).exp());
            let wait_ns = learner.map_or(0.0, |l| l.wait_ns(k, frame));
            self.predicted[k] = predicted;
            self.expected[k] = Expected { mean_ns: mean_ns * factor, alone_ns: alone_ns * factor };
            self.mean_ns[k] = mean_ns * factor + wait_ns;
        }
    }
}
