//! Predicted costs that timings correct.

use super::basis::View;
use super::{Belief, Deviations, Expected, SIZE, Slopes, values};
use crate::cost::{Frame, FrameCost};
use crate::{AlgorithmCost, CostCurve, Load};

/// How the logarithm of one algorithm's cost under one load hangs on what is believed.
#[derive(Debug, Clone)]
pub struct Slope {
    pub(super) algorithm: usize,
    pub(super) shared: Slopes,
    pub(super) own: [f64; SIZE],
    view: View,
    calls: f64,
}

/// Costs that timings correct, of which each may tell about all.
#[derive(Debug, Clone)]
pub struct Observed {
    costs: Vec<AlgorithmCost>,
    belief: Belief,
}

impl Observed {
    /// These predictions, of which nothing was observed yet. Their order numbers the algorithms.
    #[must_use]
    pub fn new(costs: Vec<AlgorithmCost>) -> Self {
        Self::within(costs, Deviations::PREDICTED)
    }

    /// The same of a machine unlike those that the predictions rest on: observations are believed sooner.
    #[must_use]
    pub fn of_unlike_machine(costs: Vec<AlgorithmCost>) -> Self {
        Self::within(costs, Deviations::UNLIKE)
    }

    fn within(costs: Vec<AlgorithmCost>, deviations: Deviations) -> Self {
        let kept: Vec<Option<usize>> =
            costs.iter().map(|c| c.residuals().next().is_some_and(|r| r.by_motion).then_some(0)).collect();
        Self { belief: Belief::new(&costs, &kept, deviations), costs }
    }

    /// The predictions.
    #[must_use]
    pub fn predicted(&self) -> &[AlgorithmCost] {
        &self.costs
    }

    /// Takes in that frames under `load` took the algorithm `ns` nanoseconds. `noise_ln` is the standard deviation of that figure's logarithm around what
    /// the load tells. False, and nothing is learned, where there is no such algorithm, or a figure is no positive number.
    pub fn observe(&mut self, algorithm: usize, load: &Load, ns: f64, noise_ln: f64) -> bool {
        let Some(cost) = self.costs.get(algorithm) else { return false };
        let frame = Frame::new(load);
        let (predicted_ns, calls) = shares(&cost.curve, &frame);
        let view = self.belief.view(&frame);
        self.belief.observe(algorithm, &view, ns / predicted_ns, calls, noise_ln)
    }

    /// Expected natural logarithm of an algorithm's nanoseconds under a load, infinite where its cost can't be predicted, and how it hangs on what
    /// is believed.
    #[must_use]
    pub fn expected_ln(&self, algorithm: usize, load: &Load) -> (f64, Slope) {
        let frame = Frame::new(load);
        let (predicted_ns, calls) = shares(&self.costs[algorithm].curve, &frame);
        let view = self.belief.view(&frame);
        let ln = predicted_ns.ln() + self.belief.deviation_ln(algorithm, &view, calls);
        let shared = self.belief.shared(algorithm, calls).1;
        let own = values(view.of(self.belief.algorithms[algorithm].by_motion));
        (if ln.is_finite() { ln } else { f64::INFINITY }, Slope { algorithm, shared, own, view, calls })
    }

    /// Prepares for an observation, and returns the variance of its logarithm before its noise.
    pub fn prepare(&mut self, slope: &Slope) -> f64 {
        let Expected { shared, own, .. } = self.belief.expect(slope.algorithm, &slope.view, slope.calls);
        shared + own
    }

    /// Covariance of the logarithm of a cost with the observation of `observed` that was [prepared](Self::prepare) for last.
    #[must_use]
    pub fn covariance(&self, observed: &Slope, other: &Slope) -> f64 {
        self.belief.along(observed.algorithm, other)
    }

    /// The costs as they are expected now.
    #[must_use]
    pub fn costs(&self) -> Vec<AlgorithmCost> {
        self.belief.costs(&self.costs, false, 0.0)
    }
}

/// Nanoseconds of a frame, and the share of calls in them.
fn shares<'a>(curve: &'a CostCurve, frame: &Frame<'a>) -> (f64, f64) {
    let FrameCost { ns, calls_ns, .. } = curve.parts_of(frame);
    (ns, if ns > 0.0 { (calls_ns / ns).min(1.0) } else { 0.0 })
}
