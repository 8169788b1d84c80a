//! One figure of a machine, and where it came from.

use super::{HardwareError, Statistic};
use crate::named::named;
use crate::stats;

/// One figure of a machine.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "model", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
#[non_exhaustive]
pub struct Parameter {
    /// Name with its unit as the last words: that of a [`ParameterId`](super::ParameterId) or a
    /// [`GpuParameterId`](super::GpuParameterId), or one that this version does not know.
    pub name: String,
    /// The figure: when it was measured, what [`Parameter::statistic`] makes of the samples. `None` when it is missing.
    pub value: Option<f64>,
    /// Interquartile range over median of the samples. `None` when there are fewer than four.
    pub dispersion: Option<f64>,
    /// How many samples stand behind the value.
    pub samples: u32,
    /// Samples that were thrown away because foreign load spoiled them.
    pub spoiled: u32,
    /// Highest share of the CPU, 0 to 1, that other programs took during the samples kept. `None` when it can't be told.
    pub foreign_load: Option<f64>,
    /// Whether the figure was measured, reported by the system, printed somewhere, or is missing.
    pub how: How,
    /// The method of a measurement, the interface of a report, or why the figure is missing.
    pub source: String,
    /// How the value follows from the samples.
    #[cfg_attr(feature = "model", serde(default, skip_serializing_if = "Statistic::is_median"))]
    pub statistic: Statistic,
    /// The samples kept, in the unit of the name, in the order of measurement, to six significant digits. Value, dispersion and
    /// number of samples follow from them. Empty where nothing was measured, where the value is that of a fit, and in reports
    /// made before they were kept.
    #[cfg_attr(feature = "model", serde(default, skip_serializing_if = "Vec::is_empty"))]
    pub raw: Vec<f64>,
}

named! {
    /// Where a figure came from.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    #[non_exhaustive]
    pub enum How("origin of a figure") {
        /// Timed on this machine.
        Measured = "measured",
        /// Told by the operating system, the CPU or a driver.
        Reported = "reported",
        /// Printed in a paper or by a vendor; the source says where, and in which units.
        Published = "published",
        /// Not known; the source says why.
        Missing = "missing",
    }
}

/// Relative difference up to which a figure agrees with what its samples say.
const TOLERANCE: f64 = 1e-5;

impl Parameter {
    /// Share of the CPU that other programs may take before what is measured meanwhile counts as spoiled.
    pub const SPOILING: f64 = 0.05;

    /// A figure told by the system.
    #[must_use]
    pub fn reported(name: impl AsRef<str>, value: f64, source: &str) -> Self {
        Self { how: How::Reported, value: Some(value), samples: 1, ..Self::missing(name, source) }
    }

    /// A figure that was measured, of which no samples are kept.
    #[must_use]
    pub fn measured(name: impl AsRef<str>, value: f64, source: &str) -> Self {
        Self { how: How::Measured, ..Self::reported(name, value, source) }
    }

    /// What a statistic makes of samples that were measured, which are kept. Missing where it makes nothing of them.
    #[must_use]
    pub fn from_samples(name: impl AsRef<str>, statistic: Statistic, raw: Vec<f64>, source: &str) -> Self {
        let Some(value) = statistic.of(&raw) else {
            return Self::missing(name, &format!("no usable sample: {source}"));
        };
        Self {
            dispersion: stats::relative_iqr(&raw),
            samples: u32::try_from(raw.len()).unwrap_or(u32::MAX),
            statistic,
            raw,
            ..Self::measured(name, value, source)
        }
    }

    /// A figure that is not known, and why.
    #[must_use]
    pub fn missing(name: impl AsRef<str>, why: &str) -> Self {
        Self {
            name: name.as_ref().to_owned(),
            value: None,
            dispersion: None,
            samples: 0,
            spoiled: 0,
            foreign_load: None,
            how: How::Missing,
            source: why.to_owned(),
            statistic: Statistic::Median,
            raw: Vec::new(),
        }
    }

    /// The parameter of a name in a list.
    pub(crate) fn find(list: &[Self], name: impl AsRef<str>) -> Option<&Self> {
        list.iter().find(|p| p.name == name.as_ref())
    }

    /// The value, worked out again from the raw samples. `None` where none are kept.
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

    /// What is wrong with a list of parameters, if anything. `of` says whose they are.
    pub(super) fn defect(of: &str, parameters: &[Self]) -> Option<HardwareError> {
        for (k, p) in parameters.iter().enumerate() {
            let parameter = format!("{}{of}", p.name);
            if let Some(value) = p.value.filter(|v| !v.is_finite() || *v < 0.0) {
                return Some(HardwareError::Figure { parameter, value });
            }
            if let Some(why) = p.disagreement() {
                return Some(HardwareError::Samples { parameter, why });
            }
            if parameters[..k].iter().any(|q| q.name == p.name) {
                return Some(HardwareError::Repeated { what: format!("the parameter {parameter}") });
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contradictions_are_told() {
        let measured = || Parameter::from_samples("x_ns", Statistic::Median, vec![4.0, 1.0, 3.0, 2.0], "test");
        assert_eq!((measured().value, measured().dispersion, measured().disagreement()), (Some(2.5), Some(0.6), None));
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
