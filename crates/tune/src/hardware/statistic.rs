//! How a value follows from its samples.

use crate::stats;
use sapwise::named;

named! {
    /// How a measured value follows from its samples.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
    #[non_exhaustive]
    pub enum Statistic("statistic") {
        /// Median of all samples.
        #[default]
        Median = "median",
        /// Of a rate: median of the samples at or above the upper quartile. For loops that an interruption can only
        /// make slower.
        FastestQuarterMedian = "fastest_quarter_median",
        /// A fit through several values a sample, which are not kept. Only in reports of earlier versions.
        Fit = "fit",
    }
}

impl Statistic {
    /// Computes the value; `None` for no samples and for a fit.
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

    /// Whether it is the median, which files leave out.
    pub fn is_median(&self) -> bool {
        *self == Self::Median
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
