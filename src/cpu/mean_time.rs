//! The mean of a time over the last frames.

/// Frames over which the mean is taken, and the most by which one of them may exceed it: an interruption by the system
/// says nothing.
const FRAMES: f64 = 8.0;
const MOST_RISE: f64 = 2.0;

/// The mean; `None` without a frame.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct MeanTime(pub(crate) Option<f64>);

impl MeanTime {
    /// Adds the time of a frame.
    pub(crate) fn add(&mut self, now: f64) {
        self.0 = Some(self.0.map_or(now, |mean| mean + (now.min(MOST_RISE * mean) - mean) / FRAMES));
    }
}

/// Returns whether neither number of boxes is more than twice the other: then times for each box are comparable.
pub(crate) fn is_as_many(a: usize, b: usize) -> bool {
    a <= 2 * b.max(1) && b <= 2 * a.max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_follows_a_change_and_hardly_an_interruption() {
        let mut mean = MeanTime::default();
        assert_eq!(mean.0, None);
        mean.add(8.0);
        assert_eq!(mean.0, Some(8.0));
        mean.add(1.0e9);
        assert_eq!(mean.0, Some(9.0));
        (0..100).for_each(|_| mean.add(2.0));
        assert!((mean.0.unwrap() - 2.0).abs() < 0.01);
    }
}
