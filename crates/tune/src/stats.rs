//! Medians, quantiles and dispersion: the statistics of a handful of samples.
//!
//! NaN is left out: one failed division must not make a statistic unknown.

pub use sapwise::internals::stats::NORMAL_90;

/// Returns the `q`-quantile, `q` from 0 to 1, with linear interpolation between the two nearest samples (type 7 of
/// Hyndman and Fan, the default of R and NumPy). `None` for no samples. A `q` outside 0 to 1 is clamped.
pub fn quantile(samples: &[f64], q: f64) -> Option<f64> {
    let mut sorted: Vec<f64> = samples.iter().copied().filter(|x| !x.is_nan()).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    // A NaN `q` becomes index 0 through the saturating cast below.
    let position = q.clamp(0.0, 1.0) * last as f64;
    let below = (position.floor() as usize).min(last);
    let above = (below + 1).min(last);
    let (low, high) = (sorted[below], sorted[above]);
    let fraction = position - below as f64;
    // Equal neighbours are returned as they are: infinity minus infinity would be no number.
    Some(if fraction > 0.0 && low != high { low + (high - low) * fraction } else { low })
}

/// Returns the median. `None` for no samples.
pub fn median(samples: &[f64]) -> Option<f64> {
    quantile(samples, 0.5)
}

/// Returns the mean; 0 for no values.
pub fn mean(values: &[f64]) -> f64 {
    if values.is_empty() { 0.0 } else { values.iter().sum::<f64>() / values.len() as f64 }
}

/// Standard deviation of a normal distribution over its median absolute deviation.
const NORMAL_OVER_MAD: f64 = 1.4826;

/// Returns a standard deviation that outliers don't move: the median absolute deviation from the median, scaled for a
/// normal distribution. `None` for no samples.
pub fn robust_deviation(samples: &[f64]) -> Option<f64> {
    let middle = median(samples)?;
    let away: Vec<f64> = samples.iter().map(|x| (x - middle).abs()).collect();
    Some(NORMAL_OVER_MAD * median(&away)?)
}

/// Returns the interquartile range over the median, a dispersion without a unit.
///
/// `None` for fewer than four samples, and if the median is zero or infinite.
pub fn relative_iqr(samples: &[f64]) -> Option<f64> {
    if samples.iter().filter(|x| !x.is_nan()).count() < 4 {
        return None;
    }
    let spread = quantile(samples, 0.75)? - quantile(samples, 0.25)?;
    let relative = spread / median(samples)?.abs();
    relative.is_finite().then_some(relative)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_by_hand() {
        assert_eq!([median(&[]), median(&[f64::NAN])], [None; 2]);
        assert_eq!(median(&[7.0]), Some(7.0));
        assert_eq!(median(&[3.0, 1.0]), Some(2.0));
        assert_eq!(median(&[5.0, 1.0, 3.0]), Some(3.0));
        assert_eq!(median(&[f64::NAN, 1.0, 3.0]), Some(2.0));
        assert_eq!(median(&[f64::INFINITY, f64::INFINITY, f64::INFINITY, 1.0]), Some(f64::INFINITY));
    }

    #[test]
    fn quantiles_by_hand() {
        // numpy.quantile([1, 2, 3, 4], [0, 0.25, 0.5, 0.75, 1]) is 1, 1.75, 2.5, 3.25, 4.
        let samples = [4.0, 2.0, 1.0, 3.0];
        let got = [0.0, 0.25, 0.5, 0.75, 1.0, -1.0, 2.0, f64::NAN].map(|q| quantile(&samples, q));
        assert_eq!(got, [1.0, 1.75, 2.5, 3.25, 4.0, 1.0, 4.0, 1.0].map(Some));
        assert_eq!(quantile(&[], 0.25), None);
    }

    #[test]
    fn means_and_dispersions_by_hand() {
        assert_eq!((mean(&[]), mean(&[1.0, 2.0, 6.0])), (0.0, 3.0));
        // Away from the median 3: 2, 1, 0, 1 and 97.
        assert_eq!(robust_deviation(&[1.0, 2.0, 3.0, 4.0, 100.0]), Some(1.4826));
        assert_eq!(robust_deviation(&[]), None);
        assert_eq!([relative_iqr(&[]), relative_iqr(&[1.0, 2.0, 3.0])], [None; 2]);
        // Quartiles 1.75 and 3.25, median 2.5.
        assert_eq!(relative_iqr(&[1.0, 2.0, 3.0, 4.0]), Some(0.6));
        assert_eq!(relative_iqr(&[0.0; 4]), None);
        assert_eq!(relative_iqr(&[2.0; 9]), Some(0.0));
    }
}
