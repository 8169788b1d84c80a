//! The part of a method's time that its physical terms do not explain, shared by groups of timings.
//!
//! A Gaussian process over the load for each group, a host's SIMD level: the more alike two levels are, the more alike
//! their residuals. A new machine gets the weighted sum of all groups. Far from all loads of the training it is zero,
//! and the physical terms alone hold.

use super::PredictError;
use super::needed::needed;
use crate::hardware::{Hardware, ParameterId};

/// Standard deviation that all groups share, and that alike groups share, as natural logarithms. Chosen, as the
/// lengths below, with the regrets of the six hosts of the training in sight (`docs/limitations.md`).
const SHARED_LN: f64 = 0.2;
const ALIKE_LN: f64 = 0.15;
/// Length over which groups are alike, in natural logarithms of SIMD lanes.
const WIDTH_LENGTH: f64 = 0.7;

/// The residual of the groups that lie at one position.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub struct GroupResidual {
    /// What the groups are compared by: the natural logarithm of SIMD lanes over its length; empty on GPUs.
    pub at: Vec<f64>,
    /// A weight for each of [`Model::places`](super::Model::places).
    pub weights: Vec<f64>,
}

impl GroupResidual {
    /// Returns the position of work on one thread of a machine.
    ///
    /// # Errors
    /// When the machine lacks the number of SIMD lanes.
    pub fn of_one_thread(hardware: &Hardware) -> Result<Vec<f64>, PredictError> {
        Ok(vec![needed(hardware, ParameterId::SimdLanes)?.ln() / WIDTH_LENGTH])
    }

    /// Returns the covariance of the residuals of two positions under the same load.
    pub fn covariance(a: &[f64], b: &[f64]) -> f64 {
        let squared: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
        SHARED_LN.powi(2) + ALIKE_LN.powi(2) * (-0.5 * squared).exp()
    }

    /// Returns the weights at a position: the sum of those of all groups, each times its covariance with it. Empty
    /// without groups.
    pub fn weights_at(groups: &[Self], at: &[f64]) -> Vec<f64> {
        let mut sum = vec![0.0; groups.first().map_or(0, |g| g.weights.len())];
        for group in groups {
            let covariance = Self::covariance(at, &group.at);
            sum.iter_mut().zip(&group.weights).for_each(|(sum, weight)| *sum += covariance * weight);
        }
        sum
    }

    /// Returns what makes the residual of a method unusable, if anything.
    pub(super) fn defect(groups: &[Self], places: usize, axes: usize) -> Option<String> {
        if let Some(group) = groups.iter().find(|g| g.weights.len() != places) {
            Some(format!("its residual has {} weights for {places} places", group.weights.len()))
        } else if let Some(group) = groups.iter().find(|g| g.at.len() != axes) {
            Some(format!("its residual has a position of {} numbers where {axes} are needed", group.at.len()))
        } else {
            let finite = |g: &Self| g.at.iter().chain(&g.weights).all(|x| x.is_finite());
            (!groups.iter().all(finite)).then(|| "its residual is not finite".to_owned())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_machine_gets_most_of_its_own_kind_and_some_of_the_others() {
        let group = |at: f64, weight: f64| GroupResidual { at: vec![at], weights: vec![weight, 0.0] };
        let groups = [group(0.0, 1.0), group(9.0, -1.0)];
        let near = GroupResidual::weights_at(&groups, &[0.0]);
        assert!((near[0] - 0.15_f64.powi(2)).abs() < 1e-9 && near[1] == 0.0, "{near:?}");
        // Half way between both nothing is left.
        assert_eq!(GroupResidual::weights_at(&groups, &[4.5]), [0.0, 0.0]);
        assert_eq!(GroupResidual::weights_at(&[], &[4.5]), [0.0; 0]);
        assert!((GroupResidual::covariance(&[], &[]) - 0.0625).abs() < 1e-12);
    }

    #[test]
    fn unusable_residuals_are_named() {
        let groups = [GroupResidual { at: vec![0.0], weights: vec![0.1] }];
        let defect = |places, axes| GroupResidual::defect(&groups, places, axes);
        assert_eq!(defect(1, 1), None);
        assert!(defect(2, 1).unwrap().contains("1 weights for 2 places"));
        assert!(defect(1, 2).unwrap().contains("position of 1 numbers"));
        let infinite = [GroupResidual { at: vec![0.0], weights: vec![f64::NAN] }];
        assert!(GroupResidual::defect(&infinite, 1, 1).unwrap().contains("not finite"));
    }
}
