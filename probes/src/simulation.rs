//! The in-line simulation: one seeded scene, run by the adaptive module and by every fixed algorithm side by side.

use crate::interrupt;
use crate::progress::Progress;
use crate::turns::Turns;
use anyhow::{Context, bail};
use sapwise::{Adaptive, AlgorithmId, BroadPhase, Fields, Pairs, Registry, Scenario};
use std::time::Instant;

/// A fixed algorithm that takes this many times as long as the best at a frame is timed there once and not again: its total
/// is told, and it can't be the best at that frame.
const HOPELESS: f64 = 10.0;

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
    /// The same of each fixed algorithm.
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
}

impl Outcome {
    pub(crate) fn adaptive_ms(&self) -> f64 {
        total_ms(self.frames.iter().map(|f| f.adaptive_ns))
    }

    /// The total of an oracle that runs the best fixed algorithm of every frame and needs no time to choose it.
    pub(crate) fn oracle_ms(&self) -> f64 {
        total_ms(self.frames.iter().map(|f| f.fixed_ns.iter().copied().fold(f64::INFINITY, f64::min)))
    }

    pub(crate) fn fixed_ms(&self, k: usize) -> f64 {
        total_ms(self.frames.iter().map(|f| f.fixed_ns[k]))
    }

    /// Time of the adaptive module over that of the oracle, less one.
    pub(crate) fn regret(&self) -> f64 {
        self.adaptive_ms() / self.oracle_ms() - 1.0
    }

    /// Position and total of the fixed algorithm with the smallest total.
    pub(crate) fn best_fixed(&self) -> Option<(usize, f64)> {
        (0..self.fixed.len()).map(|k| (k, self.fixed_ms(k))).min_by(|a, b| a.1.total_cmp(&b.1))
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
}

impl Contestant {
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
    let fixed: Vec<AlgorithmId> = registry.available().into_iter().map(|(id, _)| id).collect();
    let mut adaptive = Adaptive::new(fields, registry)?;
    let mut contestants: Vec<Contestant> = fixed
        .iter()
        .map(|id| Ok(Contestant { algorithm: registry.create(id)?, ns: vec![Vec::new(); course.frames] }))
        .collect::<Result<_, sapwise::Error>>()?;
    let mut adaptive_ns: Vec<Vec<u64>> = vec![Vec::new(); course.frames];
    let mut frames: Vec<Frame> = Vec::with_capacity(course.frames);
    let mut pairs = Pairs::new();
    let mut turns = Turns::new(course.seed);
    let progress = Progress::new((course.repeats * course.frames) as u64);
    let mut done = 0;
    'repeats: for repeat in 0..course.repeats {
        progress.message(format!("{}: repeat {} of {}", course.scenario, repeat + 1, course.repeats));
        let mut scene = course.scenario.start(course.objects, course.seed);
        let mut chosen = Vec::with_capacity(course.frames);
        for (frame, own_ns) in adaptive_ns.iter_mut().enumerate() {
            if interrupt::requested() {
                break 'repeats;
            }
            let boxes = scene.boxes();
            let mut fingerprint = None;
            let best = contestants.iter().map(|c| c.median(frame)).fold(f64::INFINITY, f64::min);
            // The turn behind the last of the fixed ones is the adaptive module's.
            for k in turns.order(contestants.len() + 1) {
                let started = Instant::now();
                let (result, ns) = match contestants.get_mut(k) {
                    Some(c) if repeat > 0 && c.median(frame) > HOPELESS * best => continue,
                    Some(c) => (c.algorithm.find_pairs(boxes, &mut pairs), &mut c.ns[frame]),
                    None => (adaptive.find_pairs(boxes, &mut pairs), &mut *own_ns),
                };
                ns.push((started.elapsed().as_nanos() as u64).max(1));
                let name = || fixed.get(k).map_or("the adaptive module".to_owned(), AlgorithmId::to_string);
                result.with_context(|| format!("{} at frame {frame}", name()))?;
                if repeat == 0 {
                    let own = pairs.fingerprint();
                    if *fingerprint.get_or_insert(own) != own {
                        bail!("{} gives other pairs than the rest at frame {frame}; please report this", name());
                    }
                }
            }
            chosen.push(adaptive.last_decision().and_then(|d| fixed.iter().position(|id| id == d.algorithm)));
            if repeat == 0 {
                frames.push(Frame { objects: boxes.len(), adaptive_ns: 0.0, fixed_ns: Vec::new(), chosen: None });
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
    for (at, frame) in frames.iter_mut().enumerate() {
        let samples: Vec<f64> = adaptive_ns[at].iter().map(|&ns| ns as f64).collect();
        frame.adaptive_ns = sapwise::measure::statistics::median(&samples).unwrap_or(f64::INFINITY);
        frame.fixed_ns = contestants.iter().map(|c| c.median(at)).collect();
    }
    Ok(Outcome { fixed, frames, repeats: done, interrupted: interrupt::requested() })
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
        assert_eq!((outcome.frames.len(), outcome.repeats, outcome.fixed.len()), (300, 3, 3));
        assert!(outcome.oracle_ms() > 0.0 && outcome.oracle_ms() <= outcome.best_fixed().unwrap().1);
        assert!(outcome.switches() >= 1);
        for frame in &outcome.frames {
            assert!(frame.fixed_ns.iter().all(|ns| ns.is_finite()) && frame.adaptive_ns.is_finite());
            assert!(frame.chosen.is_some());
        }
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
        };
        assert_eq!((outcome.adaptive_ms(), outcome.oracle_ms()), (6.0, 5.0));
        assert!((outcome.regret() - 0.2).abs() < 1e-12);
        assert_eq!(outcome.best_fixed(), Some((1, 8.0)));
        assert_eq!(outcome.switches(), 1);
        assert_eq!(outcome.worst_frame(), 1.5);
    }
}
