//! A stand-in for the work of a program between two frames.
//!
//! No program runs the same frame twice. Without this, a contestant that does the same work as the one before it
//! finds a trained branch predictor: in `uniform` with up to 3000 boxes the adaptive choice then took 1.15 to 1.19 ×
//! the time of two fixed algorithms of equal speed (medians of the frames, three seeds each, Zen 5).

use sapwise_scenes::Random;
use std::hint::black_box;

/// Memory that a turn walks through, in words of eight bytes: the size of a second-level cache.
const WORDS: usize = 1 << 17;
/// Words of a cache line.
const LINE: usize = 8;

/// Work that evicts the caches of the calling core and retrains its branch predictor.
pub(super) struct OtherWork {
    words: Vec<u64>,
    random: Random,
}

impl OtherWork {
    pub(super) fn new() -> Self {
        Self { words: vec![0; WORDS], random: Random::new(1) }
    }

    /// Reads each cache line and writes three quarters of them, with two unpredictable branches for each.
    pub(super) fn run(&mut self) {
        for word in self.words.iter_mut().step_by(LINE) {
            let bits = self.random.bits();
            let before = black_box(*word);
            // The black boxes keep the compiler from replacing the branches by arithmetic.
            if bits >> 63 == 0 {
                *word = black_box(before.wrapping_add(1));
            }
            if bits >> 62 & 1 == 0 {
                *word = black_box(*word ^ bits);
            }
        }
    }
}
