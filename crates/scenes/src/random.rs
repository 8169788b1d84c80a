//! Random numbers from a seed.

use sapwise::internals::splitmix;

/// A random number generator: splitmix64 of Steele, Lea and Flood (2014). A seed gives the same numbers on every
/// platform.
///
/// For orders and draws; not for cryptography.
///
/// ```
/// use sapwise_scenes::Random;
///
/// let mut random = Random::new(1);
/// let mut order = random.shuffled(5);
/// order.sort();
/// assert_eq!(order, [0, 1, 2, 3, 4]);
/// assert_eq!(Random::new(7).bits(), Random::new(7).bits());
/// ```
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// Returns the generator of a seed.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Returns the generator of a seed and some words.
    pub fn named(seed: u64, words: &[&str]) -> Self {
        let mut state = Self::new(seed);
        // 256 ends a word, so that "ab", "c" differs from "a", "bc".
        for byte in words.iter().flat_map(|w| w.bytes().map(u64::from).chain([256])) {
            state = Self::new(state.bits() ^ byte);
        }
        state
    }

    /// Returns 64 random bits.
    pub fn bits(&mut self) -> u64 {
        splitmix::next(&mut self.0)
    }

    /// Returns `0..count` in random order (Fisher and Yates). Draws nothing for 0 and 1.
    pub fn shuffled(&mut self, count: usize) -> Vec<usize> {
        let mut order: Vec<usize> = (0..count).collect();
        for k in (1..count).rev() {
            order.swap(k, (self.bits() % (k as u64 + 1)) as usize);
        }
        order
    }

    /// Returns a number uniform over 0 (included) to 1 (excluded).
    pub fn uniform(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Returns a nearly normal number, the sum of twelve uniform ones less six: mean 0, standard deviation 1.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_are_those_of_the_reference_code() {
        // First outputs of Vigna's C code for the seed 1234567, as its ports test them.
        let mut random = Random::new(1_234_567);
        let found = [(); 3].map(|()| random.bits());
        assert_eq!(found, [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423]);
    }

    #[test]
    fn numbers_belong_to_their_words() {
        let draw = |seed, words: &[&str]| Random::named(seed, words).bits();
        assert_eq!(draw(1, &["ab", "c"]), draw(1, &["ab", "c"]));
        let others = [draw(2, &["ab", "c"]), draw(1, &["a", "bc"]), draw(1, &["abc"]), draw(1, &["c", "ab"])];
        assert!(others.iter().all(|&o| o != draw(1, &["ab", "c"])));
    }

    #[test]
    fn a_shuffle_holds_every_number_once_and_the_next_differs() {
        let mut random = Random::new(1);
        let orders: Vec<Vec<usize>> = (0..20).map(|_| random.shuffled(6)).collect();
        for order in &orders {
            let mut sorted = order.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, [0, 1, 2, 3, 4, 5]);
        }
        assert!(orders.iter().any(|o| *o != orders[0]));
    }

    #[test]
    fn normal_numbers_have_their_mean_and_deviation() {
        let mut random = Random::named(1, &[]);
        let draws: Vec<f64> = (0..20_000).map(|_| random.normal()).collect();
        let mean = draws.iter().sum::<f64>() / draws.len() as f64;
        let variance = draws.iter().map(|d| (d - mean) * (d - mean)).sum::<f64>() / draws.len() as f64;
        assert!(mean.abs() < 0.03 && (variance - 1.0).abs() < 0.05, "{mean} {variance}");
    }
}
