//! Times of one contestant at one frame.

use sapwise::stats::median;

/// The samples of a contestant at a frame, each with the repeat that it was taken in.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Samples(Vec<(usize, f64)>);

impl Samples {
    pub(crate) fn push(&mut self, repeat: usize, ns: f64) {
        self.0.push((repeat, ns));
    }

    /// Forgets what was measured from that repeat on.
    pub(crate) fn cut(&mut self, repeat: usize) {
        self.0.retain(|s| s.0 < repeat);
    }

    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }

    /// Infinite without samples.
    pub(crate) fn fastest(&self) -> f64 {
        self.0.iter().map(|s| s.1).fold(f64::INFINITY, f64::min)
    }

    /// The sample of a repeat.
    pub(crate) fn at(&self, repeat: usize) -> Option<f64> {
        self.0.iter().find(|s| s.0 == repeat).map(|s| s.1)
    }

    /// Those of the repeats that `keep` admits.
    pub(crate) fn of(&self, keep: impl Fn(usize) -> bool) -> Self {
        Self(self.0.iter().copied().filter(|s| keep(s.0)).collect())
    }

    /// The samples of the even repeats for half 0, of the odd ones for half 1.
    pub(super) fn half(&self, half: usize) -> impl Iterator<Item = f64> {
        self.0.iter().filter(move |s| s.0 % 2 == half).map(|s| s.1)
    }

    /// Their median.
    pub(super) fn of_half(&self, half: usize) -> Option<f64> {
        median(&self.half(half).collect::<Vec<_>>())
    }

    /// Mean of the medians of the two halves, the one where there is one half, and infinite without samples.
    ///
    /// Not the median of all: the [oracle](super::oracle::Oracle) has its time from halves, and the median of three skewed times lies above that of six.
    pub(crate) fn time(&self) -> f64 {
        mean_of([self.of_half(0), self.of_half(1)]).unwrap_or(f64::INFINITY)
    }
}

/// The mean of those that there are.
pub(super) fn mean_of(both: [Option<f64>; 2]) -> Option<f64> {
    match both {
        [Some(a), Some(b)] => Some(a.midpoint(b)),
        [a, b] => a.or(b),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(ns: &[f64]) -> Samples {
        Samples(ns.iter().copied().enumerate().collect())
    }

    #[test]
    fn a_time_is_the_mean_of_the_medians_of_both_halves() {
        assert_eq!(samples(&[10.0, 14.0, 11.0, 10.0]).time(), 11.25);
        assert_eq!(samples(&[10.0, 14.0, 12.0, 15.0, 99.0, 16.0]).time(), 13.5);
        assert_eq!((samples(&[10.0]).time(), samples(&[]).time()), (10.0, f64::INFINITY));
    }

    #[test]
    fn a_repeat_that_was_cut_short_is_forgotten() {
        let mut cut = samples(&[10.0, 14.0, 99.0]);
        cut.cut(2);
        assert_eq!((cut.len(), cut.time(), cut.fastest()), (2, 12.0, 10.0));
        assert_eq!(cut.of(|repeat| repeat == 1).time(), 14.0);
    }
}
