//! What a program does between two frames, in place of it.
//!
//! Algorithms that do the same work on the same boxes, as those that differ in their number of threads do in small scenes, seem to leave each other a branch predictor
//! that knows the way through the frame (counters to prove it are not to be had in a virtual machine). In `uniform` of up to 3000 boxes the `pair-cache` of the adaptive choice, whose margin was another, took 1.15 to 1.19 times as
//! long as each of the two fixed ones, which were alike, for no more work; beside one fixed one alone 0.98 to 1.09 times (medians of the frames, three seeds each, Zen 5). No program runs a frame twice.

use sapwise_scenes::Random;
use std::hint::black_box;

/// Memory that it walks through, in words of eight bytes: as much as second-level caches have.
const WORDS: usize = 1 << 17;
/// Words of a line of memory.
const LINE: usize = 8;

/// Takes what the caches and the branch predictor of the calling thread have of the turn before. Those of other cores keep it, and so do caches that are larger.
pub(super) struct OtherWork {
    words: Vec<u64>,
    random: Random,
}

impl OtherWork {
    pub(super) fn new() -> Self {
        Self { words: vec![0; WORDS], random: Random::new(1) }
    }

    /// Reads each line of the memory and writes to three quarters of them, with two branches for each that nobody can predict.
    pub(super) fn run(&mut self) {
        for word in self.words.iter_mut().step_by(LINE) {
            let bits = self.random.bits();
            let before = black_box(*word);
            // Without the black boxes these would become arithmetic.
            if bits >> 63 == 0 {
                *word = black_box(before.wrapping_add(1));
            }
            if bits >> 62 & 1 == 0 {
                *word = black_box(*word ^ bits);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_turn_takes_other_branches_than_the_one_before() {
        let mut work = OtherWork::new();
        let lines = |work: &OtherWork| work.words.iter().copied().step_by(LINE).collect::<Vec<_>>();
        // Which lines a turn has written to.
        let mut turn = || {
            let before = lines(&work);
            work.run();
            before.iter().zip(lines(&work)).map(|(before, after)| *before != after).collect::<Vec<_>>()
        };
        let (first, second) = (turn(), turn());
        let share = |some: &mut dyn Iterator<Item = bool>| some.filter(|b| *b).count() as f64 / first.len() as f64;
        assert!((share(&mut second.iter().copied()) - 0.75).abs() < 0.02);
        // Of two turns that know nothing of each other 2 x 3/4 x 1/4.
        assert!((share(&mut first.iter().zip(&second).map(|(a, b)| a != b)) - 0.375).abs() < 0.02);
    }
}
