//! One point: every algorithm on the same frames, in random order within each.
//!
//! Medians favour an incremental algorithm: they leave out its rebuilds, one frame in 20 to 100. Nor does its margin
//! settle within so few frames.

use super::contest::{Contest, FEW_FRAMES};
use super::verify::Answer;
use sapwise::algorithm::{Displacement, Load};
use sapwise::{Aabb, AlgorithmId, BroadPhase, Pairs};
use sapwise_lab::report::{Point, Timing};
use sapwise_lab::sweep::{WARM_UP, next_frame};
use sapwise_scenes::{Random, Scene};
use sapwise_tune::Parameter;
use sapwise_tune::measure::{Options, Watch, core_to_core_ns};
use std::time::{Duration, Instant};

/// Most frames: beyond this the error of a median falls too slowly to be worth the time.
const MOST_FRAMES: usize = 40;
/// Fewest frames when the time of the point is over.
pub(super) const FEWEST_FRAMES: usize = 3;
/// Most windows that are thrown away for each kept one: on a machine that is always busy more would only take time.
const MOST_REDONE: u32 = 2;
/// Share of a point's time in which spoiled frames are redone. Later ones are kept with the foreign load beside them.
const REDO_SHARE: f64 = 2.0 / 3.0;

/// An algorithm in the race.
pub(crate) struct Racer {
    pub(crate) id: AlgorithmId,
    pub(crate) algorithm: Box<dyn BroadPhase>,
    /// Samples of this point.
    samples: Vec<u64>,
    /// Why it left the race, if it did.
    pub(crate) error: Option<String>,
    /// Whether it takes no further part at this point.
    rests: bool,
    /// Its last answer.
    answer: Option<Answer>,
}

impl Racer {
    pub(crate) fn new(id: AlgorithmId, algorithm: Box<dyn BroadPhase>) -> Self {
        Self { id, algorithm, samples: Vec::new(), error: None, rests: false, answer: None }
    }
}

/// The state that all algorithms of a race share.
pub(crate) struct Race {
    /// One list for all, so that its memory is equally warm for each.
    pairs: Pairs,
    naive: Pairs,
    shuffle: Random,
    displacement: Displacement,
    /// Cores that algorithms may use.
    cores: Options,
}

/// A point, and the time that it took.
pub(crate) struct Raced {
    pub(crate) point: Point,
    /// Wall clock of the shortest frame in which nobody rested, everything included. The shortest, because a
    /// disturbed frame must not cost the next size.
    pub(crate) frame: Duration,
    /// Wall clock of the warm-up, every frame counted as the shortest of them.
    pub(crate) warm_up: Duration,
    /// Wrong answers.
    pub(crate) mismatches: Vec<String>,
}

impl Race {
    /// `pair_limit` bounds the memory: an algorithm that finds more pairs leaves the race with an error.
    pub(crate) fn new(seed: u64, pair_limit: usize, cores: u32) -> Self {
        let mut pairs = Pairs::new();
        pairs.set_limit(Some(pair_limit));
        Self {
            pairs,
            naive: Pairs::new(),
            shuffle: Random::new(seed),
            displacement: Displacement::default(),
            cores: Options::default().with_threads(Some(cores)),
        }
    }

    /// Runs `racers` on frame after frame of `scene` until the fastest is clear or `time` is over. Racers that are
    /// surely beaten rest for the remaining frames, so that their samples are the first ones of the point.
    pub(crate) fn run(&mut self, racers: &mut [Racer], scene: &mut Scene, time: Duration) -> Raced {
        let began = Instant::now();
        let mut mismatches = Vec::new();
        for racer in racers.iter_mut() {
            racer.samples.clear();
            racer.rests = false;
        }
        let core_to_core = core_to_core_ns(&self.cores);
        // The first frame warms buffers, thread pools and branch predictors, and is not counted.
        self.frame(racers, scene, |_| true, &mut mismatches);
        let mut warm_up = Duration::ZERO;
        let is_incremental = |r: &Racer| r.error.is_none() && r.algorithm.is_incremental();
        if racers.iter().any(is_incremental) {
            let frame = || {
                let started = Instant::now();
                self.frame(racers, scene, is_incremental, &mut mismatches);
                started.elapsed()
            };
            warm_up = std::iter::repeat_with(frame).take(WARM_UP).min().unwrap_or_default() * WARM_UP as u32;
        }
        racers.iter_mut().for_each(|r| r.samples.clear());
        let mut frames = 0;
        let (mut spoiled, mut highest) = (0, None);
        let (mut windows, mut thrown) = (0, 0);
        let mut shortest = Duration::MAX;
        let mut loads = Vec::new();
        loop {
            // Samples are kept or thrown away by windows that are long enough to measure foreign load.
            let watch = Watch::begin();
            let mut fresh = 0;
            let loads_before = loads.len();
            while fresh == 0 || !watch.is_long_enough() {
                let started = Instant::now();
                let pairs_before = self.frame(racers, scene, |r| !r.rests, &mut mismatches);
                if racers.iter().all(|r| !r.rests) {
                    shortest = shortest.min(started.elapsed());
                }
                let motion = self.displacement.motion(scene.boxes());
                loads.push(Load::estimate(scene.boxes(), pairs_before.map(|pairs| pairs as f64), motion));
                fresh += 1;
            }
            let foreign = watch.foreign_load();
            // Thousands of small frames fit into a window. The samples come from all over it, because a machine wakes
            // threads faster or slower for milliseconds at a time.
            let kept = fresh.min(MOST_FRAMES - frames);
            let spent = began.elapsed();
            let redo = thrown < MOST_REDONE * (windows + 1)
                && foreign.is_some_and(|f| f > Parameter::SPOILING)
                && spent + shortest * (fresh as u32) < time.mul_f64(REDO_SHARE);
            for racer in racers.iter_mut() {
                racer.keep(frames, if redo { 0 } else { kept });
            }
            if redo {
                loads.truncate(loads_before);
                spoiled += kept as u32;
                thrown += 1;
                continue;
            }
            windows += 1;
            frames += kept;
            highest = match (highest, foreign) {
                (Some(a), Some(b)) => Some(f64::max(a, b)),
                (a, b) => a.or(b),
            };
            let racing: Vec<usize> = (0..racers.len()).filter(|&k| racers[k].races()).collect();
            let samples: Vec<&[u64]> = racing.iter().map(|&k| &racers[k].samples[..]).collect();
            let contest = Contest::judge(&samples);
            contest.beaten.iter().for_each(|&k| racers[racing[k]].rests = true);
            let over = began.elapsed() >= time;
            let enough = frames >= FEW_FRAMES && contest.decided || frames >= FEWEST_FRAMES && over;
            if frames >= MOST_FRAMES || enough || racing.is_empty() {
                break;
            }
        }
        let mut point = self.point(racers, scene, mean(&loads));
        point.foreign_load = highest;
        point.spoiled = spoiled;
        point.core_to_core_ns = core_to_core.and_then(|before| Some([before, core_to_core_ns(&self.cores)?]));
        Raced { point, frame: shortest, warm_up, mismatches }
    }

    /// Advances the scene, times every racer that `takes_part` on the new frame and compares their answers. Returns
    /// the number of pairs in the previous frame.
    fn frame(
        &mut self,
        racers: &mut [Racer],
        scene: &mut Scene,
        takes_part: impl Fn(&Racer) -> bool,
        mismatches: &mut Vec<String>,
    ) -> Option<u64> {
        let before = racers.iter().find_map(|r| r.answer).map(|a| a.pairs);
        self.displacement.watch(scene.boxes());
        next_frame(scene);
        let boxes = scene.boxes();
        for turn in self.shuffle.shuffled(racers.len()) {
            let racer = &mut racers[turn];
            racer.answer = None;
            if racer.error.is_some() || !takes_part(racer) {
                continue;
            }
            let started = Instant::now();
            let result = racer.algorithm.find_pairs(boxes, &mut self.pairs);
            let elapsed = started.elapsed();
            match result {
                // A clock that ticks slower than the frame gives 0, which no report may hold.
                Ok(()) => {
                    racer.samples.push((elapsed.as_nanos() as u64).max(1));
                    racer.answer = Some(Answer::of(&self.pairs));
                }
                Err(error) => racer.fail(error.to_string()),
            }
        }
        self.verify(racers, boxes, mismatches);
        before
    }

    fn verify(&mut self, racers: &mut [Racer], boxes: &[Aabb], mismatches: &mut Vec<String>) {
        // For large frames the answer of the first racer counts as right: it is the simplest one left.
        let first = racers.iter().find_map(|r| r.answer);
        let Some(right) = Answer::naive(boxes, &mut self.naive).or(first) else { return };
        for racer in racers.iter_mut() {
            if let Some(mismatch) = racer.answer.and_then(|a| a.mismatch(right)) {
                mismatches.push(format!("{}: {mismatch}", racer.id));
                racer.fail(mismatch);
            }
        }
    }

    /// The point without foreign load and core-to-core latency.
    fn point(&self, racers: &[Racer], scene: &Scene, load: Load) -> Point {
        let answer = racers.iter().filter(|r| r.error.is_none()).find_map(|r| r.answer);
        let answer = answer.unwrap_or(Answer { pairs: 0, fingerprint: 0 });
        let timings = racers.iter().map(|r| Timing {
            algorithm: r.id.clone(),
            samples_ns: r.samples.clone(),
            error: r.error.clone(),
        });
        Point {
            scenario: scene.scenario().to_string(),
            load,
            pairs: answer.pairs,
            fingerprint: format!("{:016x}", answer.fingerprint),
            timings: timings.collect(),
            ..Point::default()
        }
    }
}

/// Returns the mean load of frames with the same number of objects. A single frame may be unlike the others:
/// `teleport` jumps in every 30th.
fn mean(loads: &[Load]) -> Load {
    let mean = |value: fn(&Load) -> f64| loads.iter().map(value).sum::<f64>() / loads.len() as f64;
    Load::of_objects(loads[0].objects)
        .with_pairs(mean(|l| l.pairs))
        .with_candidates(mean(|l| l.axis_candidates), mean(|l| l.strip_candidates))
        .with_moved(mean(|l| l.moved))
        .with_moved_share(mean(|l| l.moved_share))
}

impl Racer {
    fn races(&self) -> bool {
        self.error.is_none() && !self.rests
    }

    /// Keeps this many of the samples from `from` on, evenly spaced. A racer that failed or rests has none there.
    fn keep(&mut self, from: usize, kept: usize) {
        let fresh = self.samples.len().saturating_sub(from);
        if fresh > 0 {
            (0..kept).for_each(|k| self.samples[from + k] = self.samples[from + k * fresh / kept]);
            self.samples.truncate(from + kept);
        }
    }

    /// Takes the algorithm out of the race and drops its samples of this point, which may belong to wrong answers.
    fn fail(&mut self, reason: String) {
        self.samples.clear();
        self.error = Some(reason);
        self.answer = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

    fn brute() -> Box<dyn BroadPhase> {
        sapwise::Registry::new().create(&"brute@cpu1".parse().unwrap()).unwrap()
    }

    #[test]
    fn samples_are_kept_from_all_over_a_window() {
        let mut racer = Racer::new("brute@cpu1".parse().unwrap(), brute());
        racer.samples = (0..103).collect();
        racer.keep(3, 10);
        assert_eq!(racer.samples, [0, 1, 2, 3, 13, 23, 33, 43, 53, 63, 73, 83, 93]);
        racer.keep(13, 5);
        assert_eq!(racer.samples.len(), 13);
        racer.keep(3, 0);
        assert_eq!(racer.samples, [0, 1, 2]);
    }

    /// Returns one pair too many.
    struct Wrong;

    impl BroadPhase for Wrong {
        fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), sapwise::Error> {
            brute().find_pairs(boxes, pairs)?;
            pairs.push(0, 1);
            pairs.push(0, 1);
            pairs.finish()
        }
    }

    #[test]
    fn a_wrong_answer_is_found_and_costs_only_the_one_that_returned_it() {
        let racer = |id: &str, algorithm| Racer::new(id.parse().unwrap(), algorithm);
        let mut racers = vec![racer("wrong@cpu1", Box::new(Wrong)), racer("brute@cpu1", brute())];
        let mut scene = sapwise_scenes::Scenario::Uniform.start(50, 1);
        let outcome = Race::new(1, 1000, 1).run(&mut racers, &mut scene, Duration::from_millis(1));
        assert_eq!(outcome.mismatches.len(), 1);
        assert!(outcome.mismatches[0].starts_with("wrong@cpu1"), "{:?}", outcome.mismatches);
        let timings = &outcome.point.timings;
        assert!(timings[0].samples_ns.is_empty() && timings[0].error.is_some());
        assert!(timings[1].samples_ns.len() >= FEWEST_FRAMES && timings[1].error.is_none());
    }

    /// Counts its frames.
    struct Counting(Arc<AtomicUsize>, bool);

    impl BroadPhase for Counting {
        fn find_pairs(&mut self, _: &[Aabb], pairs: &mut Pairs) -> Result<(), sapwise::Error> {
            self.0.fetch_add(1, Relaxed);
            pairs.clear();
            pairs.finish()
        }

        fn is_incremental(&self) -> bool {
            self.1
        }
    }

    #[test]
    fn an_incremental_algorithm_runs_some_frames_more_before_the_samples() {
        // One box has no pairs, so that finding none is right.
        let frames = [(); 2].map(|()| Arc::<AtomicUsize>::default());
        let mut racers = ["once@cpu1", "incremental@cpu1"].map(|id| {
            let incremental = id.starts_with("incremental");
            let counting = Counting(frames[usize::from(incremental)].clone(), incremental);
            Racer::new(id.parse().unwrap(), Box::new(counting))
        });
        let mut scene = sapwise_scenes::Scenario::Resting.start(1, 1);
        let outcome = Race::new(1, 1000, 1).run(&mut racers, &mut scene, Duration::ZERO);
        assert!(outcome.mismatches.is_empty(), "{:?}", outcome.mismatches);
        assert!((0.0..=0.06).contains(&outcome.point.load.moved));
        let [without, with] = frames.map(|f| f.load(Relaxed));
        assert_eq!(with - without, WARM_UP);
    }

    #[test]
    fn a_frame_in_which_all_jumps_is_one_of_many() {
        let load = |moved: f64| {
            let load = Load::of_objects(10).with_pairs(moved * 100.0).with_candidates(8.0, 6.0);
            load.with_moved(moved).with_moved_share(moved.floor())
        };
        let mean = mean(&[0.04, 0.04, 1.0, 0.04].map(load));
        assert!((mean.moved - 0.28).abs() < 1e-12 && (mean.pairs - 28.0).abs() < 1e-12, "{mean:?}");
        assert_eq!(mean.moved_share, 0.25);
        assert_eq!((mean.objects, mean.axis_candidates, mean.strip_candidates), (10, 8.0, 6.0));
    }

    #[test]
    fn too_many_pairs_end_the_race_with_an_error() {
        let mut racers = vec![Racer::new("brute@cpu1".parse().unwrap(), brute())];
        let mut scene = sapwise_scenes::Scenario::Uniform.start(500, 1);
        let outcome = Race::new(1, 3, 1).run(&mut racers, &mut scene, Duration::from_millis(1));
        assert!(outcome.point.timings[0].error.as_ref().unwrap().contains("limit of 3"));
    }
}
