//! Figures over the samples of one algorithm at one point.

/// The median; the mean of the middle two when their number is even. `None` without samples.
pub(crate) fn median(samples: &[u64]) -> Option<f64> {
    let mut sorted = samples.to_vec();
    sorted.sort_unstable();
    let middle = sorted.len().checked_sub(1)? / 2;
    let upper = sorted[sorted.len() / 2] as f64;
    Some((sorted[middle] as f64 + upper) / 2.0)
}

/// Standard error of the median over the median, from the quartiles, so that single outliers don't count.
///
/// For a normal distribution the standard deviation is the interquartile range over 1.349, and the error of the median is
/// 1.2533 standard deviations over the root of the number of samples. `None` below four samples, which have no quartiles.
pub(crate) fn relative_error(samples: &[u64]) -> Option<f64> {
    if samples.len() < 4 {
        return None;
    }
    let mut sorted = samples.to_vec();
    sorted.sort_unstable();
    let quartile = |k: usize| sorted[(sorted.len() - 1) * k / 4] as f64;
    let deviation = (quartile(3) - quartile(1)) / 1.349;
    let error = 1.2533 * deviation / (sorted.len() as f64).sqrt();
    median(samples).map(|m| error / m.max(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians() {
        assert_eq!(median(&[]), None);
        assert_eq!(median(&[7]), Some(7.0));
        assert_eq!(median(&[9, 1]), Some(5.0));
        assert_eq!(median(&[9, 1, 2]), Some(2.0));
    }

    #[test]
    fn outliers_do_not_widen_the_error_and_spread_does() {
        assert_eq!(relative_error(&[5, 5, 5]), None);
        assert_eq!(relative_error(&[100, 100, 100, 100, 100, 100, 100, 9000]), Some(0.0));
        let wide: Vec<u64> = (0..100).map(|k| 900 + 2 * k).collect();
        assert!((relative_error(&wide).unwrap() - 0.0093).abs() < 0.001);
    }
}
