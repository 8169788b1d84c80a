//! What a program does between two frames, in place of it.
//!
//! Algorithms that do the same work on the same boxes, as those that differ in their number of threads do in small scenes, seem to leave each other a branch predictor
//! that knows the way through the frame (counters to prove it are not to be had in a virtual machine). In `uniform` of up to 3000 boxes the `pair-cache` of the adaptive choice, whose margin was another, took 1.15 to 1.19 times as
//! long as each of the two fixed ones, which were alike, for no more work; beside one fixed one alone 0.98 to 1.09 times (medians of the frames, three seeds each, Zen 5). No program runs a frame twice.

use std::hint::black_box;

/// Memory that it walks through, in words of eight bytes: as much as second-level caches have.
const WORDS: usize = 1 << 17;
/// Words of a line of memory.
const LINE: usize = 8;

/// Takes what caches and the branch predictor have of the turn before.
pub(super) struct OtherWork {
    words: Vec<u64>,
    state: u64,
}

impl OtherWork {
    pub(super) fn new() -> Self {
        Self { words: vec![0; WORDS], state: 1 }
    }

    /// Writes to each line of the memory, with two branches for each that nobody can predict.
    pub(super) fn run(&mut self) {
        for word in self.words.iter_mut().step_by(LINE) {
            self.state = self.state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            // Without the black boxes these would become arithmetic.
            if self.state >> 63 == 0 {
                *word = black_box(*word + 1);
            }
            if self.state >> 62 & 1 == 0 {
                *word = black_box(*word ^ self.state);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_turn_finds_other_work_than_the_one_before() {
        let mut work = OtherWork::new();
        let turns: Vec<Vec<u64>> = (0..3)
            .map(|_| {
                work.run();
                work.words.iter().copied().step_by(LINE).collect()
            })
            .collect();
        // A quarter of the lines is read only.
        let changed = |k: usize| turns[k].iter().zip(&turns[k + 1]).filter(|(a, b)| a != b).count();
        let lines = WORDS / LINE;
        assert!([0, 1].map(changed).iter().all(|&changed| (lines * 7 / 10..lines * 8 / 10).contains(&changed)));
    }
}
