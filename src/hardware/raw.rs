//! Raw samples: what was measured, kept so that every figure can be worked out again.

use super::Parameter;
use crate::stats;

/// How the value of a measured parameter follows from its samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum Statistic {
    /// The median of all.
    #[default]
    Median,
    /// Of a rate: the median of the samples that are not below the upper quartile. For what an interruption can only make slower.
    FastestQuarterMedian,
    /// From a fit through more than one figure a sample. The samples behind it are not kept.
    Fit,
}

impl Statistic {
    /// What it makes of samples; `None` of none, and of a fit.
    #[must_use]
    pub fn of(self, samples: &[f64]) -> Option<f64> {
        match self {
            Self::Median => stats::median(samples),
            Self::FastestQuarterMedian => {
                let fast = stats::quantile(samples, 0.75)?;
                let quarter: Vec<f64> = samples.iter().copied().filter(|&x| x >= fast).collect();
                stats::median(&quarter)
            }
            Self::Fit => None,
        }
    }

    /// Whether it is the median, which files do not name.
    #[must_use]
    pub fn is_median(&self) -> bool {
        *self == Self::Median
    }
}

/// Relative difference up to which a figure agrees with what its samples say.
const TOLERANCE: f64 = 1e-5;

impl Parameter {
    /// Share of the CPU that other programs may take before what is measured meanwhile counts as spoiled.
    pub const SPOILING: f64 = 0.05;

    /// The value, worked out anew from the raw samples. `None` where none are kept.
    #[must_use]
    pub fn recomputed(&self) -> Option<f64> {
        self.statistic.of(&self.raw)
    }

    /// In what the raw samples contradict the figures, if they do.
    pub(crate) fn disagreement(&self) -> Option<String> {
        if self.raw.is_empty() {
            return None;
        }
        if let Some(sample) = self.raw.iter().find(|x| !x.is_finite()) {
            return Some(format!("{sample} is among its raw samples"));
        }
        if self.samples as usize != self.raw.len() {
            return Some(format!("{} samples, but {} raw ones", self.samples, self.raw.len()));
        }
        if self.statistic == Statistic::Fit {
            return Some("raw samples of a fit, which can't be checked".to_owned());
        }
        let told = |x: Option<f64>| x.map_or("missing".to_owned(), |x| x.to_string());
        let differ = |a: Option<f64>, b: Option<f64>| match (a, b) {
            (Some(a), Some(b)) => (a - b).abs() > TOLERANCE * a.abs().max(b.abs()),
            (a, b) => a != b,
        };
        let value = self.recomputed();
        if differ(self.value, value) {
            return Some(format!("the value is {}, but its raw samples give {}", told(self.value), told(value)));
        }
        let dispersion = stats::relative_iqr(&self.raw);
        if differ(self.dispersion, dispersion) {
            let (here, there) = (told(self.dispersion), told(dispersion));
            return Some(format!("the dispersion is {here}, but its raw samples give {there}"));
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hardware::How;

    fn measured() -> Parameter {
        Parameter {
            how: How::Measured,
            value: Some(2.5),
            dispersion: Some(0.6),
            samples: 4,
            raw: vec![4.0, 1.0, 3.0, 2.0],
            ..Parameter::missing("x_ns", "test")
        }
    }

    #[test]
    fn statistics_by_hand() {
        let samples = [1.0, 2.0, 3.0, 4.0, 5.0];
        assert_eq!(Statistic::Median.of(&samples), Some(3.0));
        // The upper quartile is 4.
        assert_eq!(Statistic::FastestQuarterMedian.of(&samples), Some(4.5));
        assert_eq!(Statistic::Fit.of(&samples), None);
        for statistic in [Statistic::Median, Statistic::FastestQuarterMedian] {
            assert_eq!(statistic.of(&[]), None);
            assert_eq!(statistic.of(&[7.0]), Some(7.0));
        }
    }

    #[test]
    fn contradictions_are_told() {
        assert_eq!(measured().disagreement(), None);
        assert_eq!(Parameter { value: Some(2.500_001), ..measured() }.disagreement(), None);
        assert_eq!(Parameter { raw: Vec::new(), value: Some(9.0), ..measured() }.disagreement(), None);
        let told = |p: Parameter, text: &str| assert!(p.disagreement().is_some_and(|d| d.contains(text)), "{p:?}");
        told(Parameter { value: Some(2.501), ..measured() }, "2.501");
        told(Parameter { value: None, ..measured() }, "value is missing");
        told(Parameter { dispersion: Some(0.5), ..measured() }, "0.5");
        told(Parameter { dispersion: None, ..measured() }, "dispersion");
        told(Parameter { samples: 5, ..measured() }, "5 samples");
        told(Parameter { statistic: Statistic::Fit, ..measured() }, "fit");
        told(Parameter { raw: vec![f64::NAN; 4], ..measured() }, "NaN");
    }
}
