//! One point: every algorithm on the same frames, in random order within each.

use super::statistics::relative_error;
use super::verify::Answer;
use crate::foreign::Window;
use sapwise::report::{Point, Timing};
use sapwise::{Aabb, AlgorithmId, BroadPhase, Load, Pairs, Scene};
use std::time::{Duration, Instant};

/// Frames at most: beyond this the error of a median falls too slowly to be worth the time.
const MOST_FRAMES: usize = 40;
/// Frames at least.
const FEW_FRAMES: usize = 5;
/// Frames at least where the point's time is over.
pub(super) const FEWEST_FRAMES: usize = 3;
/// A point is done when the standard error of every median is below this share of it.
const GOOD_ERROR: f64 = 0.01;
/// Share of a point's time in which spoiled frames are redone. After that they are kept, with the foreign load beside them.
const REDO_SHARE: f64 = 2.0 / 3.0;
/// Share of the CPU that other programs may take before frames count as spoiled.
const SPOILING_LOAD: f64 = 0.05;

/// An algorithm in the race.
pub(crate) struct Runner {
    pub(crate) id: AlgorithmId,
    pub(crate) algorithm: Box<dyn BroadPhase>,
    /// Samples of this point.
    samples: Vec<u64>,
    /// Why it can't go on, if it can't.
    pub(crate) error: Option<String>,
    /// Its last answer.
    answer: Option<Answer>,
}

impl Runner {
    pub(crate) fn new(id: AlgorithmId, algorithm: Box<dyn BroadPhase>) -> Self {
        Self { id, algorithm, samples: Vec::new(), error: None, answer: None }
    }
}

/// What the algorithms of a race share.
pub(crate) struct Race {
    /// One list for all, so that its memory is equally warm for each.
    pairs: Pairs,
    naive: Pairs,
    turns: Turns,
    contended: bool,
}

/// What a point cost beside what it found.
pub(crate) struct Outcome {
    pub(crate) point: Point,
    /// Wall clock of the last frame, everything included.
    pub(crate) frame: Duration,
    /// Wrong answers.
    pub(crate) mismatches: Vec<String>,
}

impl Race {
    /// `pair_limit` bounds the memory: a scene with more pairs ends the race with an error instead of the process.
    pub(crate) fn new(seed: u64, pair_limit: usize, contended: bool) -> Self {
        let mut pairs = Pairs::new();
        pairs.set_limit(Some(pair_limit));
        Self { pairs, naive: Pairs::new(), turns: Turns(seed), contended }
    }

    /// Runs all `runners` on frame after frame of `scene` until their medians are stable or `time` is over.
    pub(crate) fn run(&mut self, runners: &mut [Runner], scene: &mut Scene, time: Duration) -> Outcome {
        let began = Instant::now();
        let mut mismatches = Vec::new();
        runners.iter_mut().for_each(|r| r.samples.clear());
        // The first frame warms the buffers, the thread pools and the branch predictors, and is not counted.
        self.frame(runners, scene, &mut mismatches);
        runners.iter_mut().for_each(|r| r.samples.clear());
        let mut frames = 0;
        let (mut spoiled, mut highest) = (0, None);
        let mut pairs_before = None;
        let mut last = Duration::ZERO;
        loop {
            // Samples are kept or thrown away by windows that are long enough to tell foreign load.
            let window = Window::open();
            let mut fresh = 0;
            while fresh == 0 || !window.is_long_enough() {
                let started = Instant::now();
                pairs_before = self.frame(runners, scene, &mut mismatches);
                last = started.elapsed();
                fresh += 1;
            }
            let foreign = window.foreign_load();
            // Thousands of small frames fit into a window; the last of them are enough.
            let kept = fresh.min(MOST_FRAMES - frames);
            let spent = began.elapsed();
            let redo = !self.contended
                && foreign.is_some_and(|f| f > SPOILING_LOAD)
                && spent + last * fresh as u32 < time.mul_f64(REDO_SHARE);
            let dropped = if redo { fresh } else { fresh - kept };
            for runner in runners.iter_mut() {
                // A runner that failed on the way has none.
                let len = runner.samples.len();
                runner.samples.drain(frames.min(len)..(frames + dropped).min(len));
            }
            if redo {
                spoiled += kept as u32;
                continue;
            }
            frames += kept;
            highest = match (highest, foreign) {
                (Some(a), Some(b)) => Some(f64::max(a, b)),
                (a, b) => a.or(b),
            };
            let racing = || runners.iter().filter(|r| r.error.is_none());
            let stable = racing().all(|r| relative_error(&r.samples).is_some_and(|e| e < GOOD_ERROR));
            let over = began.elapsed() >= time;
            let enough = frames >= FEW_FRAMES && stable || frames >= FEWEST_FRAMES && over;
            if frames >= MOST_FRAMES || enough || racing().next().is_none() {
                break;
            }
        }
        let point = self.point(runners, scene, pairs_before, (highest, spoiled));
        Outcome { point, frame: last, mismatches }
    }

    /// Advances the scene, times every runner on the new frame and compares their answers. Returns the pairs of the frame
    /// before this one.
    fn frame(&mut self, runners: &mut [Runner], scene: &mut Scene, mismatches: &mut Vec<String>) -> Option<u64> {
        let before = runners.iter().find_map(|r| r.answer).map(|a| a.pairs);
        super::scenario::next_frame(scene);
        let boxes = scene.boxes();
        for turn in self.turns.order(runners.len()) {
            let runner = &mut runners[turn];
            runner.answer = None;
            if runner.error.is_some() {
                continue;
            }
            let started = Instant::now();
            let result = runner.algorithm.find_pairs(boxes, &mut self.pairs);
            let elapsed = started.elapsed();
            match result {
                // A clock that ticks slower than the frame must not give 0, which no frame takes.
                Ok(()) => {
                    runner.samples.push((elapsed.as_nanos() as u64).max(1));
                    runner.answer = Some(Answer::of(&self.pairs));
                }
                Err(error) => runner.fail(error.to_string()),
            }
        }
        self.verify(runners, boxes, mismatches);
        before
    }

    fn verify(&mut self, runners: &mut [Runner], boxes: &[Aabb], mismatches: &mut Vec<String>) {
        // Without the double loop the first of the list is taken to be right: it is the simplest that is left.
        let first = runners.iter().find_map(|r| r.answer);
        let Some(right) = Answer::naive(boxes, &mut self.naive).or(first) else { return };
        for runner in runners.iter_mut() {
            if let Some(mismatch) = runner.answer.and_then(|a| a.mismatch(right)) {
                mismatches.push(format!("{}: {mismatch}", runner.id));
                runner.fail(mismatch);
            }
        }
    }

    fn point(&self, runners: &[Runner], scene: &Scene, before: Option<u64>, foreign: (Option<f64>, u32)) -> Point {
        let answer = runners.iter().filter(|r| r.error.is_none()).find_map(|r| r.answer);
        let answer = answer.unwrap_or(Answer { pairs: 0, fingerprint: 0 });
        let timings = runners.iter().map(|r| Timing {
            algorithm: r.id.clone(),
            samples_ns: r.samples.clone(),
            error: r.error.clone(),
        });
        Point {
            scenario: scene.scenario().to_string(),
            load: Load::estimate(scene.boxes(), before),
            pairs: answer.pairs,
            fingerprint: format!("{:016x}", answer.fingerprint),
            foreign_load: foreign.0,
            spoiled: foreign.1,
            timings: timings.collect(),
        }
    }
}

impl Runner {
    /// Takes the algorithm out of the race. Its samples of this point go too: they may stand for wrong answers.
    fn fail(&mut self, reason: String) {
        self.samples.clear();
        self.error = Some(reason);
        self.answer = None;
    }
}

/// Random orders from a seed, so that no algorithm always follows the same one through the caches.
struct Turns(u64);

impl Turns {
    fn order(&mut self, count: usize) -> Vec<usize> {
        let mut order: Vec<usize> = (0..count).collect();
        for k in (1..count).rev() {
            order.swap(k, (self.next() % (k as u64 + 1)) as usize);
        }
        order
    }

    /// splitmix64 (Steele, Lea, Flood 2014).
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    }
}
