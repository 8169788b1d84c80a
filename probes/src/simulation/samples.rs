//! Times of one contestant at one frame, and the oracle that they make.

use sapwise::measure::statistics::median;

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

    pub(crate) fn mean(&self) -> Option<f64> {
        (!self.0.is_empty()).then(|| self.0.iter().map(|s| s.1).sum::<f64>() / self.0.len() as f64)
    }

    /// The sample of a repeat.
    pub(crate) fn at(&self, repeat: usize) -> Option<f64> {
        self.0.iter().find(|s| s.0 == repeat).map(|s| s.1)
    }

    /// Those of the repeats that `keep` admits.
    pub(crate) fn of(&self, keep: impl Fn(usize) -> bool) -> Self {
        Self(self.0.iter().copied().filter(|s| keep(s.0)).collect())
    }

    /// Median over the even repeats for half 0, over the odd ones for half 1.
    fn of_half(&self, half: usize) -> Option<f64> {
        median(&self.0.iter().filter(|s| s.0 % 2 == half).map(|s| s.1).collect::<Vec<_>>())
    }

    /// Mean of the medians of the two halves, the one where there is one half, and infinite without samples.
    ///
    /// Not the median of all: the [`oracle`] has its time from halves, and the median of three skewed times lies above that of six.
    pub(crate) fn time(&self) -> f64 {
        mean_of([self.of_half(0), self.of_half(1)]).unwrap_or(f64::INFINITY)
    }
}

/// The mean of those that there are.
fn mean_of(both: [Option<f64>; 2]) -> Option<f64> {
    match both {
        [Some(a), Some(b)] => Some(a.midpoint(b)),
        [a, b] => a.or(b),
    }
}

/// The fastest in the other half of the repeats: what an oracle runs that must not see the noise of its own frame.
fn best_without(fixed: &[Samples], half: usize) -> Option<usize> {
    let times = |half: usize| fixed.iter().enumerate().filter_map(move |(k, s)| Some((k, s.of_half(half)?)));
    let best = |half: usize| times(half).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, _)| k);
    // With one repeat there is no other half.
    best(1 - half).or_else(|| best(half))
}

/// The time of an oracle at a frame. Infinite without samples.
///
/// The least of several noisy times lies below the time of the algorithm that it belongs to. So the best algorithm is chosen by one
/// half of the repeats and its time taken from the other half, then the other way round, and the mean of the two is given. With one
/// repeat that is the least time all the same.
pub(crate) fn oracle(fixed: &[Samples]) -> f64 {
    let from = |half: usize| fixed[best_without(fixed, half)?].of_half(half);
    mean_of([from(0), from(1)]).unwrap_or_else(|| optimistic_oracle(fixed))
}

/// The least of the times at a frame, which luck has its part in.
pub(crate) fn optimistic_oracle(fixed: &[Samples]) -> f64 {
    fixed.iter().map(Samples::time).fold(f64::INFINITY, f64::min)
}

/// What the oracle's choice took in one repeat, which had no say in the choice.
pub(crate) fn oracle_in(fixed: &[Samples], repeat: usize) -> Option<f64> {
    let best = &fixed[best_without(fixed, repeat % 2)?];
    // Whoever is not timed in every repeat has the time of the others.
    best.at(repeat).or_else(|| Some(best.time()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(ns: &[f64]) -> Samples {
        Samples(ns.iter().copied().enumerate().collect())
    }

    #[test]
    fn an_oracle_pays_what_its_choice_took_in_the_other_half() {
        // Medians of the even repeats 10 and 12, of the odd ones 14 and 11: each half prefers the one that was lucky in it.
        let fixed = [samples(&[10.0, 14.0, 10.0, 14.0]), samples(&[12.0, 11.0, 12.0, 11.0])];
        // Chosen by the even half, the first takes 14 in the odd one; chosen by the odd half, the second takes 12 in the even one.
        assert_eq!(oracle(&fixed), 13.0);
        assert_eq!(optimistic_oracle(&fixed), 11.5);
        assert_eq!([0, 1, 2, 3].map(|r| oracle_in(&fixed, r)), [12.0, 14.0, 12.0, 14.0].map(Some));
        // Where the same one is the best in both halves, the two oracles agree with its time.
        let fixed = [samples(&[10.0, 14.0, 11.0, 10.0]), samples(&[20.0, 21.0, 20.0, 21.0])];
        assert_eq!((oracle(&fixed), optimistic_oracle(&fixed), fixed[0].time()), (11.25, 11.25, 11.25));
    }

    #[test]
    fn of_alike_algorithms_the_least_time_is_too_low_and_the_oracle_is_not() {
        // Eight algorithms that take 100 on average: numbers of a generator, spread evenly over 90 to 110.
        let mut turns = crate::turns::Turns::new(7);
        let mut noisy = || 90.0 + 20.0 * (turns.draw() >> 11) as f64 / (1_u64 << 53) as f64;
        let frames: Vec<Vec<Samples>> =
            (0..400).map(|_| (0..8).map(|_| samples(&[(); 6].map(|()| noisy()))).collect()).collect();
        let mean = |of: fn(&[Samples]) -> f64| frames.iter().map(|f| of(f)).sum::<f64>() / frames.len() as f64;
        let (honest, least) = (mean(oracle), mean(optimistic_oracle));
        assert!((honest - 100.0).abs() < 1.0, "{honest}");
        assert!(least < 97.0, "{least}");
    }

    #[test]
    fn one_repeat_gives_the_least_time_and_whoever_sat_out_has_none() {
        let fixed = [samples(&[10.0]), samples(&[12.0]), samples(&[])];
        assert_eq!((oracle(&fixed), oracle_in(&fixed, 0)), (10.0, Some(10.0)));
        assert_eq!(fixed[2].time(), f64::INFINITY);
        assert_eq!((oracle(&fixed[2..]), oracle_in(&fixed[2..], 0)), (f64::INFINITY, None));
        // Timed twice only, for it is hopeless; the other was interrupted after its third repeat.
        let fixed = [samples(&[10.0, 12.0, 10.0]), samples(&[500.0, 400.0])];
        assert_eq!((oracle(&fixed), fixed[1].time()), (11.0, 450.0));
    }

    #[test]
    fn a_repeat_that_was_cut_short_is_forgotten() {
        let mut cut = samples(&[10.0, 14.0, 99.0]);
        cut.cut(2);
        assert_eq!((cut.len(), cut.time(), cut.mean(), cut.fastest()), (2, 12.0, Some(12.0), 10.0));
        assert_eq!(cut.of(|repeat| repeat == 1).time(), 14.0);
    }
}
