//! The normal distribution. Statistics of samples are in `sapwise-tune`.

/// Half of the central 90 % interval of a normal distribution, in standard deviations.
pub const NORMAL_90: f64 = 1.645;

/// Returns the density of a standard normal variable.
pub fn normal_density(x: f64) -> f64 {
    (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt()
}

/// Returns the mean; 0 for no values.
#[cfg(test)]
pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// Returns the median. `None` for no samples.
#[cfg(all(test, feature = "serde"))]
pub(crate) fn median(samples: &[f64]) -> Option<f64> {
    let mut sorted = samples.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    Some(f64::midpoint(sorted[last / 2], sorted[sorted.len() / 2]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_normal_density_has_its_known_value() {
        assert!((normal_density(0.0) - 0.398_942_28).abs() < 1e-7);
    }
}
