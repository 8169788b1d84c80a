//! Predicted costs, corrected by timings.

use super::belief::{Belief, Deviations};
use crate::algorithm::Load;
use crate::cost::{Frame, FrameCost};
use crate::tuning::AlgorithmCost;

/// Returns the costs corrected by timings: for each the position of its algorithm in `costs`, the load, the nanoseconds
/// of a frame and the standard deviation of their natural logarithm.
///
/// A timing also moves the costs of algorithms that share its method, its number of threads or its processor. Ignores a
/// timing whose position is out of range or whose nanoseconds are no positive number.
#[must_use]
pub fn corrected(
    costs: &[AlgorithmCost],
    timings: impl IntoIterator<Item = (usize, Load, f64, f64)>,
) -> Vec<AlgorithmCost> {
    let kept: Vec<Option<usize>> =
        costs.iter().map(|c| c.residuals().next().is_some_and(|r| r.by_motion).then_some(0)).collect();
    let mut belief = Belief::new(costs, &kept, Deviations::PREDICTED);
    for (algorithm, load, ns, noise_ln) in timings {
        let Some(cost) = costs.get(algorithm) else { continue };
        let frame = Frame::new(&load);
        let FrameCost { ns: predicted_ns, calls_ns, .. } = cost.curve.parts_of(&frame);
        let calls = if predicted_ns > 0.0 { (calls_ns / predicted_ns).min(1.0) } else { 0.0 };
        let view = belief.view(&frame);
        belief.observe(algorithm, &view, ns / predicted_ns, calls, noise_ln);
    }
    belief.costs(costs, false, 0.0)
}
