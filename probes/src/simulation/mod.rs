//! The in-line simulation: one seeded scene, run by the adaptive module and by every fixed algorithm side by side.

use crate::interrupt;
use crate::progress::Progress;
use crate::turns::Turns;
use anyhow::{Context, bail};
use sapwise::measure::Watch;
use sapwise::{Adaptive, AlgorithmId, BroadPhase, Fields, Pairs, Registry, Scenario};
use std::time::Instant;

/// A fixed algorithm of which even the fastest of two samples at a frame takes this many times as long as the best there is
/// not timed at that frame again: its total is told, and it can't be the best. One sample alone may have been a cold one.
const HOPELESS: f64 = 10.0;

/// A fixed algorithm leaves the course at the first frame that takes it longer than this ...
const TOO_LONG_NS: f64 = 1e9;
/// ... and this many times as long as the best: a total that takes hours tells no more than the frame does.
const TOO_SLOW: f64 = 100.0;

/// What to simulate.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Course {
    pub(crate) scenario: Scenario,
    pub(crate) objects: usize,
    pub(crate) frames: usize,
    pub(crate) repeats: usize,
    pub(crate) seed: u64,
}

/// One frame of the outcome.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Frame {
    pub(crate) objects: usize,
    /// Median over the repeats, nanoseconds, choice included.
    pub(crate) adaptive_ns: f64,
    /// The same of each fixed algorithm; infinite where it had left the course.
    pub(crate) fixed_ns: Vec<f64>,
    /// What the adaptive module ran in the last repeat: a position among the fixed ones.
    pub(crate) chosen: Option<usize>,
}

/// The outcome: medians over the repeats, frame by frame.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Outcome {
    pub(crate) fixed: Vec<AlgorithmId>,
    pub(crate) frames: Vec<Frame>,
    /// Repeats that all frames have; the last may have been cut short by Ctrl-C and is then left out.
    pub(crate) repeats: usize,
    pub(crate) interrupted: bool,
    /// Median over the frames of the share of the CPU that other programs took. `None` where that can't be told, as in a course
    /// of milliseconds.
    pub(crate) foreign_load: Option<f64>,
    /// Fixed algorithms that could not run, or not to the end, and why.
    pub(crate) notes: Vec<String>,
}

impl Outcome {
    pub(crate) fn adaptive_ms(&self) -> f64 {
        total_ms(self.frames.iter().map(|f| f.adaptive_ns))
    }

    /// The total of an oracle that runs the best fixed algorithm of every frame and needs no time to choose it.
    pub(crate) fn oracle_ms(&self) -> f64 {
        total_ms(self.frames.iter().map(|f| f.fixed_ns.iter().copied().fold(f64::INFINITY, f64::min)))
    }

    /// The total of a fixed algorithm; `None` when it left the course.
    pub(crate) fn fixed_ms(&self, k: usize) -> Option<f64> {
        Some(total_ms(self.frames.iter().map(|f| f.fixed_ns[k]))).filter(|ms| ms.is_finite())
    }

    /// The last frame of a fixed algorithm that left the course, and its total until then.
    pub(crate) fn left(&self, k: usize) -> Option<(usize, f64)> {
        let run = self.frames.iter().take_while(|f| f.fixed_ns[k].is_finite()).count();
        let until_then = || total_ms(self.frames[..run].iter().map(|f| f.fixed_ns[k]));
        (run < self.frames.len()).then(|| (run.saturating_sub(1), until_then()))
    }

    /// Time of the adaptive module over that of the oracle, less one.
    pub(crate) fn regret(&self) -> f64 {
        self.adaptive_ms() / self.oracle_ms() - 1.0
    }

    /// Position and total of the fixed algorithm with the smallest total.
    pub(crate) fn best_fixed(&self) -> Option<(usize, f64)> {
        (0..self.fixed.len()).filter_map(|k| Some((k, self.fixed_ms(k)?))).min_by(|a, b| a.1.total_cmp(&b.1))
    }

    pub(crate) fn switches(&self) -> usize {
        self.frames.windows(2).filter(|w| w[0].chosen != w[1].chosen).count()
    }

    /// Time of the slowest frame relative to the oracle's same frame.
    pub(crate) fn worst_frame(&self) -> f64 {
        let ratio = |f: &Frame| f.adaptive_ns / f.fixed_ns.iter().copied().fold(f64::INFINITY, f64::min);
        self.frames.iter().map(ratio).fold(0.0, f64::max)
    }
}

fn total_ms(ns: impl Iterator<Item = f64>) -> f64 {
    ns.sum::<f64>() / 1e6
}

/// A contestant and its times, one list for each frame.
struct Contestant {
    algorithm: Box<dyn BroadPhase>,
    ns: Vec<Vec<u64>>,
    /// It has left the course.
    left: bool,
}

impl Contestant {
    fn new(algorithm: Box<dyn BroadPhase>, frames: usize) -> Self {
        Self { algorithm, ns: vec![Vec::new(); frames], left: false }
    }

    /// Infinite without samples.
    fn fastest(&self, frame: usize) -> f64 {
        self.ns[frame].iter().min().map_or(f64::INFINITY, |&ns| ns as f64)
    }

    /// Whether another sample at this frame would tell nothing.
    fn is_hopeless(&self, frame: usize, best: f64) -> bool {
        self.left || self.ns[frame].len() >= 2 && self.fastest(frame) > HOPELESS * best
    }

    fn median(&self, frame: usize) -> f64 {
        let samples: Vec<f64> = self.ns[frame].iter().map(|&ns| ns as f64).collect();
        sapwise::measure::statistics::median(&samples).unwrap_or(f64::INFINITY)
    }
}

/// Runs the course: in each repeat the same frames again, and at each frame every contestant, in random order: a
/// parallel algorithm leaves threads and caches behind that the next one feels.
///
/// The pairs of all contestants are compared in the first repeat, outside the timed part.
///
/// # Errors
/// When no algorithm of the fields can run, when contestants disagree about the pairs, or on Ctrl-C before one repeat is done.
pub(crate) fn simulate(course: &Course, fields: Fields, registry: &Registry) -> anyhow::Result<Outcome> {
    let mut fixed: Vec<AlgorithmId> = Vec::new();
    let mut contestants: Vec<Contestant> = Vec::new();
    let mut notes: Vec<String> = Vec::new();
    for (id, _) in registry.available() {
        match registry.create(&id) {
            Ok(algorithm) => {
                contestants.push(Contestant::new(algorithm, course.frames));
                fixed.push(id);
            }
            // A driver may refuse at any time, and so may what a user added; the course goes on without it.
            Err(error) => notes.push(format!("{id} is left out: {error}")),
        }
    }
    // Fields may name a number of threads that the registry doesn't list but can make.
    for id in fields.algorithms() {
        if !fixed.contains(id)
            && let Ok(algorithm) = registry.create(id)
        {
            fixed.push(id.clone());
            contestants.push(Contestant::new(algorithm, course.frames));
        }
    }
    let mut adaptive = Adaptive::new(fields, registry)?;
    let mut adaptive_ns: Vec<Vec<u64>> = vec![Vec::new(); course.frames];
    let mut frames: Vec<Frame> = Vec::with_capacity(course.frames);
    let mut pairs = Pairs::new();
    let mut turns = Turns::new(course.seed);
    let progress = Progress::new((course.repeats * course.frames) as u64);
    let mut done = 0;
    // One for each frame of a window that was long enough to tell.
    let mut loads: Vec<f64> = Vec::new();
    let (mut watch, mut watched) = (Watch::begin(), 0);
    // Turns and frames of the samples that the repeat under way has added.
    let mut under_way: Vec<(usize, usize)> = Vec::new();
    'repeats: for repeat in 0..course.repeats {
        progress.message(format!("{}: repeat {} of {}", course.scenario, repeat + 1, course.repeats));
        let mut scene = course.scenario.start(course.objects, course.seed);
        let mut chosen = Vec::with_capacity(course.frames);
        under_way.clear();
        for (frame, own_ns) in adaptive_ns.iter_mut().enumerate() {
            if interrupt::requested() {
                break 'repeats;
            }
            let boxes = scene.boxes();
            let mut answers: Vec<(usize, u64)> = Vec::new();
            let best = best(&contestants, frame);
            // The turn behind the last of the fixed ones is the adaptive module's.
            for k in turns.order(contestants.len() + 1) {
                let started = Instant::now();
                let (result, ns) = match contestants.get_mut(k) {
                    Some(c) if c.is_hopeless(frame, best) => continue,
                    Some(c) => (c.algorithm.find_pairs(boxes, &mut pairs), &mut c.ns[frame]),
                    None => (adaptive.find_pairs(boxes, &mut pairs), &mut *own_ns),
                };
                ns.push((started.elapsed().as_nanos() as u64).max(1));
                under_way.push((k, frame));
                match (result, contestants.get_mut(k)) {
                    (Err(error @ sapwise::Error::Unavailable { .. }), Some(contestant)) => {
                        // It is at fault and not the boxes: a GPU that was lost. The adaptive module goes on without it too.
                        notes.push(format!("{error}, at frame {frame}"));
                        contestant.ns[frame].clear();
                        contestant.left = true;
                        under_way.pop();
                        continue;
                    }
                    (result, _) => result.with_context(|| format!("{} at frame {frame}", name(&fixed, k)))?,
                }
                if repeat == 0 {
                    answers.push((k, pairs.fingerprint()));
                }
            }
            // Whose turn came first says nothing about who is right; ours come first in the list, a user's after them.
            answers.sort_unstable();
            if let Some(&(first, right)) = answers.first()
                && let Some(&(other, _)) = answers.iter().find(|answer| answer.1 != right)
            {
                bail!(
                    "{} gives other pairs than {} at frame {frame}; correct it if it is yours, else please report this",
                    name(&fixed, other),
                    name(&fixed, first)
                );
            }
            chosen.push(adaptive.last_decision().and_then(|d| fixed.iter().position(|id| id == d.algorithm)));
            // Later repeats go through the same frames, so that nobody leaves in them who did not in the first.
            if repeat == 0 {
                leave(&mut contestants, frame);
                frames.push(Frame { objects: boxes.len(), adaptive_ns: 0.0, fixed_ns: Vec::new(), chosen: None });
            }
            watched += 1;
            if watch.is_long_enough() {
                loads.extend(watch.foreign_load().into_iter().flat_map(|load| std::iter::repeat_n(load, watched)));
                (watch, watched) = (Watch::begin(), 0);
            }
            scene.advance();
            progress.advance(1);
        }
        frames.iter_mut().zip(chosen).for_each(|(f, c)| f.chosen = c);
        done = repeat + 1;
    }
    if done == 0 {
        bail!("interrupted before every frame was run once; there is nothing to tell");
    }
    if done < course.repeats {
        for (k, frame) in under_way {
            contestants.get_mut(k).map_or(&mut adaptive_ns, |c| &mut c.ns)[frame].pop();
        }
    }
    for (at, frame) in frames.iter_mut().enumerate() {
        let samples: Vec<f64> = adaptive_ns[at].iter().map(|&ns| ns as f64).collect();
        frame.adaptive_ns = sapwise::measure::statistics::median(&samples).unwrap_or(f64::INFINITY);
        frame.fixed_ns = contestants.iter().map(|c| c.median(at)).collect();
    }
    let foreign_load = sapwise::measure::statistics::median(&loads);
    Ok(Outcome { fixed, frames, repeats: done, interrupted: done < course.repeats, foreign_load, notes })
}

/// Who has a turn: one of the fixed algorithms, or the adaptive module behind the last of them.
fn name(fixed: &[AlgorithmId], turn: usize) -> String {
    fixed.get(turn).map_or("the adaptive module".to_owned(), AlgorithmId::to_string)
}

/// The fastest sample of any fixed algorithm at a frame.
fn best(contestants: &[Contestant], frame: usize) -> f64 {
    contestants.iter().map(|c| c.fastest(frame)).fold(f64::INFINITY, f64::min)
}

/// Lets those leave the course for whom this frame took too long.
fn leave(contestants: &mut [Contestant], frame: usize) {
    let best = best(contestants, frame);
    for contestant in contestants.iter_mut().filter(|c| !c.left) {
        let ns = contestant.fastest(frame);
        contestant.left = ns > TOO_LONG_NS && ns > TOO_SLOW * best;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sapwise::Step;

    #[test]
    fn a_course_gives_every_total_and_the_choice_of_every_frame() {
        let registry = Registry::with_cores(1);
        let step = |from_objects, id: &str| Step { from_objects, algorithm: id.parse().unwrap() };
        let fields = Fields::from_steps(vec![step(0, "brute@cpu1"), step(100, "strips@cpu1")]).unwrap();
        let course = Course { scenario: Scenario::Fragmentation, objects: 800, frames: 300, repeats: 3, seed: 1 };
        let outcome = simulate(&course, fields, &registry).unwrap();
        assert_eq!((outcome.frames.len(), outcome.repeats, outcome.fixed.len()), (300, 3, registry.available().len()));
        assert!(outcome.oracle_ms() > 0.0 && outcome.oracle_ms() <= outcome.best_fixed().unwrap().1);
        assert!(outcome.switches() >= 1);
        assert!(outcome.foreign_load.is_none_or(|load| (0.0..=1.0).contains(&load)));
        for frame in &outcome.frames {
            assert!(frame.fixed_ns.iter().all(|ns| ns.is_finite()) && frame.adaptive_ns.is_finite());
            assert!(frame.chosen.is_some());
        }
    }

    #[test]
    fn of_two_that_disagree_the_one_that_a_user_added_is_named() {
        struct NoPairs;
        impl BroadPhase for NoPairs {
            fn find_pairs(&mut self, _: &[sapwise::Aabb], pairs: &mut Pairs) -> Result<(), sapwise::Error> {
                pairs.clear();
                pairs.finish()
            }
        }
        let mut registry = Registry::with_cores(1);
        registry.add("mine@cpu1".parse().unwrap(), 1, || Ok(Box::new(NoPairs)));
        // Each seed has another order of turns.
        for seed in 1..=8 {
            let fields =
                Fields::from_steps(vec![Step { from_objects: 0, algorithm: "brute@cpu1".parse().unwrap() }]).unwrap();
            let course = Course { scenario: Scenario::Uniform, objects: 2000, frames: 1, repeats: 1, seed };
            let Err(error) = simulate(&course, fields, &registry) else { panic!("took no pairs for an answer") };
            assert!(error.to_string().starts_with("mine@cpu1 gives other pairs than brute@cpu1"), "{error}");
        }
    }

    #[test]
    fn an_algorithm_that_only_the_fields_name_is_among_the_fixed() {
        let registry = Registry::with_cores(4);
        let id: AlgorithmId = "strips@cpu3".parse().unwrap();
        if registry.create(&id).is_err() {
            return;
        }
        let fields = Fields::from_steps(vec![Step { from_objects: 0, algorithm: id.clone() }]).unwrap();
        let course = Course { scenario: Scenario::Uniform, objects: 50, frames: 2, repeats: 1, seed: 1 };
        let outcome = simulate(&course, fields, &registry).unwrap();
        assert_eq!(outcome.fixed.last(), Some(&id));
        assert!(outcome.frames.iter().all(|f| f.chosen.is_some()));
    }

    #[test]
    fn whoever_is_hopeless_leaves_the_course_and_one_cold_sample_is_no_proof() {
        struct Nothing;
        impl BroadPhase for Nothing {
            fn find_pairs(&mut self, _: &[sapwise::Aabb], _: &mut Pairs) -> Result<(), sapwise::Error> {
                Ok(())
            }
        }
        let times = |ns: &[u64]| Contestant { algorithm: Box::new(Nothing), ns: vec![ns.to_vec()], left: false };
        let mut all = [times(&[10_000_000]), times(&[900_000_000]), times(&[1_100_000_000])];
        leave(&mut all, 0);
        assert_eq!(all.map(|c| c.left), [false, false, true]);
        assert!(!times(&[500]).is_hopeless(0, 10.0));
        assert!(!times(&[500, 90]).is_hopeless(0, 10.0));
        assert!(times(&[500, 110]).is_hopeless(0, 10.0));
    }

    #[test]
    fn who_left_has_no_total_and_counts_nowhere() {
        let frame = |a, b| Frame { objects: 10, adaptive_ns: 1e6, fixed_ns: vec![a, b], chosen: Some(0) };
        let outcome = Outcome {
            fixed: vec!["strips@cpu1".parse().unwrap(), "brute@cpu1".parse().unwrap()],
            frames: vec![frame(1e6, 2e9), frame(1e6, f64::INFINITY)],
            repeats: 1,
            interrupted: false,
            foreign_load: None,
            notes: Vec::new(),
        };
        assert_eq!((outcome.fixed_ms(0), outcome.fixed_ms(1)), (Some(2.0), None));
        assert_eq!((outcome.left(0), outcome.left(1)), (None, Some((0, 2000.0))));
        assert_eq!((outcome.oracle_ms(), outcome.best_fixed()), (2.0, Some((0, 2.0))));
    }

    #[test]
    fn figures_follow_from_the_frames() {
        let frame =
            |adaptive_ns, a, b, chosen| Frame { objects: 10, adaptive_ns, fixed_ns: vec![a, b], chosen: Some(chosen) };
        let outcome = Outcome {
            fixed: vec!["brute@cpu1".parse().unwrap(), "strips@cpu1".parse().unwrap()],
            frames: vec![frame(1e6, 1e6, 4e6, 0), frame(3e6, 5e6, 2e6, 1), frame(2e6, 5e6, 2e6, 1)],
            repeats: 1,
            interrupted: false,
            foreign_load: None,
            notes: Vec::new(),
        };
        assert_eq!((outcome.adaptive_ms(), outcome.oracle_ms()), (6.0, 5.0));
        assert!((outcome.regret() - 0.2).abs() < 1e-12);
        assert_eq!(outcome.best_fixed(), Some((1, 8.0)));
        assert_eq!(outcome.switches(), 1);
        assert_eq!(outcome.worst_frame(), 1.5);
    }
}
