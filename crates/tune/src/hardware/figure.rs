//! One parameter of a machine: its value and origin.

use super::{HardwareError, Statistic};
use crate::stats;
use sapwise::named;

/// One parameter of a machine: its value and origin.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
#[non_exhaustive]
pub struct Parameter {
    /// Name, with its unit as the last words: of a [`ParameterId`](super::ParameterId), of a
    /// [`GpuParameterId`](super::GpuParameterId), or unknown to this version.
    pub name: String,
    /// The value; `None` if it is missing. [`Parameter::statistic`] derives measured values from the samples.
    pub value: Option<f64>,
    /// Interquartile range over median of the samples. `None` for fewer than four.
    pub dispersion: Option<f64>,
    /// Number of samples behind the value.
    pub samples: u32,
    /// Number of samples that were discarded because of foreign load.
    pub spoiled: u32,
    /// Highest share of the CPU, 0 to 1, that other programs took during the kept samples. `None` if unknown.
    pub foreign_load: Option<f64>,
    /// Where the value came from.
    pub how: How,
    /// The method of a measurement, the interface that reported the value, or why it is missing.
    pub source: String,
    /// How the value follows from the samples.
    #[serde(default, skip_serializing_if = "Statistic::is_median")]
    pub statistic: Statistic,
    /// The kept samples in order of measurement, in the unit of the name, to six significant digits. Value,
    /// dispersion and number of samples follow from them. Empty if nothing was measured, if the value comes from a
    /// fit, and in old reports.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub raw: Vec<f64>,
}

named! {
    /// Where a value came from.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    #[non_exhaustive]
    pub enum How("origin of a figure") {
        /// Measured on this machine.
        Measured = "measured",
        /// Reported by the operating system, the CPU or a driver.
        Reported = "reported",
        /// Printed in a paper or by a vendor; the source cites it.
        Published = "published",
        /// Unknown; the source says why.
        Missing = "missing",
    }
}

/// Relative difference up to which a value agrees with its samples.
const TOLERANCE: f64 = 1e-5;

impl Parameter {
    /// Share of the CPU that other programs may take before samples count as spoiled.
    pub const SPOILING: f64 = 0.05;

    /// Creates a parameter with a value that the system reports.
    pub fn reported(name: impl AsRef<str>, value: f64, source: &str) -> Self {
        Self { how: How::Reported, value: Some(value), samples: 1, ..Self::missing(name, source) }
    }

    /// Creates a parameter with a measured value of which no samples are kept.
    pub fn measured(name: impl AsRef<str>, value: f64, source: &str) -> Self {
        Self { how: How::Measured, ..Self::reported(name, value, source) }
    }

    /// Creates a parameter from measured samples. It is missing if the statistic has no value for them.
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

    /// Creates a parameter without a value.
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

    /// Returns the parameter of a name in a list.
    pub(crate) fn find(list: &[Self], name: impl AsRef<str>) -> Option<&Self> {
        list.iter().find(|p| p.name == name.as_ref())
    }

    /// Computes the value from the raw samples. `None` if none are kept.
    pub fn recomputed(&self) -> Option<f64> {
        self.statistic.of(&self.raw)
    }

    /// Returns the first contradiction between the raw samples and what follows from them.
    pub(crate) fn disagreement(&self) -> Option<String> {
        if self.raw.is_empty() {
            return None;
        }
        if let Some(sample) = self.raw.iter().find(|x| !x.is_finite()) {
            return Some(format!("{sample} is among its raw samples"));
        }
        let again = Self::from_samples(&self.name, self.statistic, self.raw.clone(), "");
        let figures = [
            ("value", self.value, again.value),
            ("dispersion", self.dispersion, again.dispersion),
            ("number of samples", Some(self.samples.into()), Some(again.samples.into())),
        ];
        let (what, own, raw) = figures.into_iter().find(|&(_, own, raw): &(_, Option<f64>, _)| match (own, raw) {
            (Some(own), Some(raw)) => (own - raw).abs() > TOLERANCE * own.abs().max(raw.abs()),
            (own, raw) => own != raw,
        })?;
        let text = |x: Option<f64>| x.map_or("missing".to_owned(), |x| x.to_string());
        Some(format!("the {what} is {}, but its raw samples give {}", text(own), text(raw)))
    }

    /// Returns what is wrong with a list of parameters, if anything. `of` names their owner.
    pub(super) fn defect(of: &str, parameters: &[Self]) -> Option<HardwareError> {
        for (k, p) in parameters.iter().enumerate() {
            let parameter = format!("{}{of}", p.name);
            if let Some(value) = p.value.filter(|v| !v.is_finite() || *v < 0.0) {
                let what = format!("the parameter {parameter} is {value:e}; it must be a number and not negative");
                return Some(HardwareError(what));
            }
            if let Some(why) = p.disagreement() {
                return Some(HardwareError(format!("the parameter {parameter}: {why}")));
            }
            if parameters[..k].iter().any(|q| q.name == p.name) {
                return Some(HardwareError(format!("the parameter {parameter} is listed twice")));
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contradictions_are_reported() {
        let measured = || Parameter::from_samples("x_ns", Statistic::Median, vec![4.0, 1.0, 3.0, 2.0], "test");
        assert_eq!((measured().value, measured().dispersion, measured().disagreement()), (Some(2.5), Some(0.6), None));
        assert_eq!(Parameter { value: Some(2.500_001), ..measured() }.disagreement(), None);
        assert_eq!(Parameter { raw: Vec::new(), value: Some(9.0), ..measured() }.disagreement(), None);
        let told = |p: Parameter, text: &str| assert!(p.disagreement().is_some_and(|d| d.contains(text)), "{p:?}");
        told(Parameter { value: Some(2.501), ..measured() }, "2.501");
        told(Parameter { value: None, ..measured() }, "value is missing");
        told(Parameter { dispersion: Some(0.5), ..measured() }, "0.5");
        told(Parameter { dispersion: None, ..measured() }, "dispersion");
        told(Parameter { samples: 5, ..measured() }, "number of samples is 5");
        told(Parameter { statistic: Statistic::Fit, ..measured() }, "give missing");
        told(Parameter { raw: vec![f64::NAN; 4], ..measured() }, "NaN");
    }
}
