//! Draws from a seed.

use crate::turns::Turns;

/// Deviates from the numbers of [`Turns`].
pub(crate) struct Random(Turns);

impl Random {
    /// The draws that belong to some words: the same wherever and in whatever order they are asked for.
    pub(crate) fn named(seed: u64, words: &[&str]) -> Self {
        let mut state = Turns::new(seed);
        // The end of a word counts too, so that "ab", "c" is not "a", "bc".
        for byte in words.iter().flat_map(|w| w.bytes().map(u64::from).chain([256])) {
            state = Turns::new(state.draw() ^ byte);
        }
        Self(state)
    }

    pub(crate) fn next(&mut self) -> u64 {
        self.0.draw()
    }

    /// From 0 up to, not including, 1.
    pub(crate) fn uniform(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Normal, from twelve uniform ones: mean 0, deviation 1, nothing beyond 6.
    pub(crate) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }

    /// Log-normal: median 1, deviation `sigma` in natural logarithms.
    pub(crate) fn log_normal(&mut self, sigma: f64) -> f64 {
        (sigma * self.normal()).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_belong_to_their_words() {
        let draw = |seed, words: &[&str]| Random::named(seed, words).next();
        assert_eq!(draw(1, &["ab", "c"]), draw(1, &["ab", "c"]));
        let others = [draw(2, &["ab", "c"]), draw(1, &["a", "bc"]), draw(1, &["abc"]), draw(1, &["c", "ab"])];
        assert!(others.iter().all(|&o| o != draw(1, &["ab", "c"])));
    }

    #[test]
    fn deviates_have_their_mean_and_deviation() {
        let mut random = Random::named(1, &[]);
        let draws: Vec<f64> = (0..20_000).map(|_| random.normal()).collect();
        let mean = draws.iter().sum::<f64>() / draws.len() as f64;
        let variance = draws.iter().map(|d| (d - mean) * (d - mean)).sum::<f64>() / draws.len() as f64;
        assert!(mean.abs() < 0.03 && (variance - 1.0).abs() < 0.05, "{mean} {variance}");
    }
}
