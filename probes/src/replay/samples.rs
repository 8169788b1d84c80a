//! The times of an algorithm at a frame, and the least time that switching between algorithms could reach.

use sapwise_tune::stats::median;

/// Frames of a window. An incremental algorithm rebuilds every few dozen frames; an oracle that chose for every frame
/// alone would run it in its cheap frames and leave it for its rebuilds.
pub(crate) const WINDOW: usize = 32;

/// Times in nanoseconds, each with its repeat.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Samples(Vec<(usize, f64)>);

impl Samples {
    pub(super) fn push(&mut self, repeat: usize, ns: f64) {
        self.0.push((repeat, ns));
    }

    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    /// Infinite without samples.
    pub(super) fn fastest(&self) -> f64 {
        self.0.iter().map(|s| s.1).fold(f64::INFINITY, f64::min)
    }

    /// The samples of the repeats that `keep` admits.
    pub(super) fn of(&self, keep: impl Fn(usize) -> bool) -> Self {
        Self(self.0.iter().copied().filter(|s| keep(s.0)).collect())
    }

    /// Median over the even repeats (half 0) or the odd ones (half 1).
    fn of_half(&self, half: usize) -> Option<f64> {
        median(&self.of(|repeat| repeat % 2 == half).0.iter().map(|s| s.1).collect::<Vec<_>>())
    }

    /// Mean of the medians of both halves, as [`windows`] has it; infinite without samples.
    pub(super) fn time(&self) -> f64 {
        mean_of([self.of_half(0), self.of_half(1)])
    }
}

fn mean_of(both: [Option<f64>; 2]) -> f64 {
    match both {
        [Some(a), Some(b)] => a.midpoint(b),
        [a, b] => a.or(b).unwrap_or(f64::INFINITY),
    }
}

/// The time of each frame when the best algorithm of its window runs it; infinite when none was timed in the whole
/// window. `frames` holds the samples of every algorithm at every frame.
///
/// One half of the repeats chooses and the other half gives the time, then the other way round: the minimum of noisy
/// times is lower than what any algorithm takes. With one repeat the same half does both.
pub(super) fn windows(frames: &[Vec<Samples>]) -> Vec<f64> {
    let is_timed = |half| frames.iter().flatten().any(|s| s.of_half(half).is_some());
    let halves = [0, 1].map(|half| if is_timed(half) { half } else { 1 - half });
    let of_window = |window: &[Vec<Samples>]| -> Vec<f64> {
        let chosen = halves.map(|half| {
            let total = |k: usize| window.iter().map(|frame| frame[k].of_half(half)).sum::<Option<f64>>();
            let totals = (0..window[0].len()).filter_map(|k| Some((k, total(k)?)));
            totals.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, _)| k)
        });
        let time = |frame: &Vec<Samples>| mean_of([0, 1].map(|k| frame[chosen[1 - k]?].of_half(halves[k])));
        window.iter().map(time).collect()
    };
    frames.chunks(WINDOW).flat_map(of_window).collect()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub(crate) fn samples(ns: &[f64]) -> Samples {
        Samples(ns.iter().copied().enumerate().filter(|s| s.1.is_finite()).collect())
    }

    #[test]
    fn a_time_is_the_mean_of_the_medians_of_both_halves() {
        assert_eq!(samples(&[10.0, 14.0, 11.0, 10.0]).time(), 11.25);
        assert_eq!((samples(&[10.0]).time(), samples(&[]).time()), (10.0, f64::INFINITY));
        assert_eq!(samples(&[10.0, 14.0]).of(|repeat| repeat == 1).time(), 14.0);
    }

    #[test]
    fn one_half_chooses_and_the_other_gives_the_time() {
        // Medians of the even repeats 10 and 12, of the odd ones 14 and 11: each half prefers the algorithm that was
        // lucky in it.
        let frame = vec![samples(&[10.0, 14.0, 10.0, 14.0]), samples(&[12.0, 11.0, 12.0, 11.0])];
        assert_eq!(windows(&[frame]), [13.0]);
        let once = vec![samples(&[10.0]), samples(&[12.0]), samples(&[])];
        assert_eq!(windows(&[once]), [10.0]);
        assert_eq!(windows(&[vec![samples(&[])]]), [f64::INFINITY]);
    }

    #[test]
    fn an_algorithm_pays_for_its_rebuilds_within_a_window() {
        let frame =
            |at: usize| vec![samples(&[if at.is_multiple_of(8) { 90.0 } else { 10.0 }; 4]), samples(&[18.0; 4])];
        let frames: Vec<_> = (0..WINDOW + 4).map(frame).collect();
        let ns = windows(&frames);
        // The mean of the first is 20 in the whole window, and 30 in the four frames behind it.
        assert_eq!(ns, vec![18.0; WINDOW + 4]);
    }
}
