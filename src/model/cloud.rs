//! Where the machines of the training lie, all their parameters taken together.

use crate::BackendClass;

/// The machines, or GPUs, of the training as points in the space of their parameters' logarithms.
///
/// Each parameter by itself may lie within its range and the combination be like no machine of the training: few cores with the
/// bandwidth of a server. The distance is that of Mahalanobis: the logarithms are less their means, over their deviations, and
/// times the inverse of their correlations, which are shrunk towards none.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Cloud {
    /// Whether the points are machines, by the parameters of their CPUs, or GPUs.
    pub processor: BackendClass,
    /// How many points, one for each physical machine or GPU.
    pub points: u32,
    /// The parameters.
    pub parameters: Vec<CloudParameter>,
    /// The inverse of the shrunk correlations, a row for each parameter.
    pub inverse: Vec<Vec<f64>>,
    /// Largest squared distance of a point from the cloud of the others.
    pub farthest_squared: f64,
}

/// One parameter of a [`Cloud`].
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct CloudParameter {
    /// Its name.
    pub name: String,
    /// Mean of its natural logarithm.
    pub mean_ln: f64,
    /// Standard deviation of that.
    pub deviation_ln: f64,
}

/// Where a machine lies against a [`Cloud`].
#[derive(Debug, Clone, PartialEq)]
pub struct Place<'a> {
    /// Its distance over the largest one in training: above 1 it lies outside.
    pub ratio: f64,
    /// The two parameters that contribute most to the distance.
    pub most: Vec<&'a str>,
}

impl Cloud {
    /// Where a machine with these values lies. A parameter that it lacks counts as at the mean of training.
    #[must_use]
    pub fn place(&self, value: impl Fn(&str) -> Option<f64>) -> Place<'_> {
        let scores: Vec<f64> = self
            .parameters
            .iter()
            .map(|p| value(&p.name).filter(|v| *v > 0.0).map_or(0.0, |v| (v.ln() - p.mean_ln) / p.deviation_ln))
            .collect();
        let mut shares: Vec<(f64, &str)> = Vec::with_capacity(scores.len());
        for ((row, p), score) in self.inverse.iter().zip(&self.parameters).zip(&scores) {
            shares.push((score * row.iter().zip(&scores).map(|(w, s)| w * s).sum::<f64>(), &p.name));
        }
        let squared: f64 = shares.iter().map(|s| s.0).sum();
        shares.sort_by(|a, b| b.0.total_cmp(&a.0));
        let ratio = (squared.max(0.0) / self.farthest_squared).sqrt();
        Place { ratio, most: shares.iter().take(2).map(|s| s.1).collect() }
    }

    /// What makes this cloud unusable, if anything.
    pub(super) fn defect(&self) -> Option<String> {
        let n = self.parameters.len();
        let square = self.inverse.len() == n && self.inverse.iter().all(|r| r.len() == n && r.iter().all(|w| w.is_finite()));
        let spread = |p: &CloudParameter| p.mean_ln.is_finite() && p.deviation_ln.is_finite() && p.deviation_ln > 0.0;
        let sound = square && self.parameters.iter().all(spread) && self.farthest_squared > 0.0;
        (!(sound && self.farthest_squared.is_finite()))
            .then(|| format!("the cloud of the {}s in training has figures that can't be", self.processor))
    }
}
