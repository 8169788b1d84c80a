//! The replay itself: the adaptive choice and every fixed algorithm take turns at the same frames.

use super::co_runner::{Slowdown, time_a_loop};
use super::contestant::{Contestant, best};
use super::frame::{Frame, Taken, Told};
use super::oracle::Oracle;
use super::other_work::OtherWork;
use super::outcome::Outcome;
use super::samples::Samples;
use super::settings::ReplaySettings;
use crate::interrupt;
use crate::progress::Progress;
use anyhow::{Context, bail};
use sapwise::measure::Watch;
use sapwise::stats::median;
use sapwise::{Aabb, Adaptive, AlgorithmId, BroadPhase, Error, Pairs, Reason, Registry, Tuning};
use sapwise_scenes::Random;
use std::time::Instant;

/// Replays the frames: in each repeat the same frames again, and at each frame every contestant, in random order: a parallel algorithm leaves
/// threads and caches behind that the next one feels.
///
/// All of them start each repeat again without what they kept, the adaptive choice from this tuning, so that frame by frame the repeats are alike: what it
/// has learned by a frame, it has learned from the frames before.
///
/// The pairs of all contestants are compared in the first repeat, outside the timed part.
///
/// # Errors
/// When no algorithm of the tuning can run, when contestants disagree about the pairs, or on Ctrl-C before one repeat is done.
pub(crate) fn replay(settings: &ReplaySettings, tuning: &Tuning, registry: &Registry) -> anyhow::Result<Outcome> {
    let mut replay = Replay::new(settings, tuning, registry);
    let progress = Progress::new((settings.repeats * settings.frames) as u64);
    let mut watch = Watched::begin();
    let mut done = 0;
    'repeats: for repeat in 0..settings.repeats {
        progress.message(format!("{}: repeat {} of {}", settings.source.name(), repeat + 1, settings.repeats));
        let mut adaptive = replay.begin(repeat, tuning, registry)?;
        let mut cursor = settings.source.start();
        let mut co_runner = None;
        for frame in 0..settings.frames {
            if interrupt::requested() {
                break 'repeats;
            }
            if let Some(own) = settings.co_runner {
                if co_runner.is_none() && frame >= own.from_frame {
                    co_runner = Some(own.start().context("the co-runner can't be started")?);
                }
                replay.loops.push((frame, time_a_loop()));
            }
            replay.run(repeat, frame, cursor.boxes(), &mut adaptive)?;
            watch.frame();
            cursor.advance();
            progress.advance(1);
        }
        replay.end();
        done = repeat + 1;
    }
    if done == 0 {
        bail!("interrupted before every frame was run once; there are no figures");
    }
    Ok(replay.outcome(settings, done, watch.foreign_load()))
}

/// Algorithms of the tuning with more threads than the registry lists, as those of a larger machine have: the adaptive choice leaves them
/// out. Where the tuning is steps it runs them all the same.
pub(crate) fn too_wide<'a>(tuning: &'a Tuning, registry: &Registry) -> Vec<&'a AlgorithmId> {
    let most = registry.entries().iter().map(|e| e.id.threads()).max().unwrap_or(1);
    tuning.algorithms().into_iter().filter(|id| !tuning.costs.is_empty() && id.threads() > most).collect()
}

/// The contestants and what they have done so far.
struct Replay {
    contestants: Vec<Contestant>,
    adaptive: Vec<Samples>,
    objects: Vec<usize>,
    /// What the adaptive choice ran in the repeat under way, and in each one that is complete.
    taken: Vec<Taken>,
    repeats: Vec<Vec<Taken>>,
    /// The same in its own words, of the repeat under way and of the last complete one.
    telling: Vec<Told>,
    told: Vec<Told>,
    /// Times of the loop beside the frames.
    loops: Vec<(usize, f64)>,
    notes: Vec<String>,
    shuffle: Random,
    other_work: OtherWork,
    pairs: Pairs,
    learning: bool,
    exploring: bool,
}

impl Replay {
    fn new(settings: &ReplaySettings, tuning: &Tuning, registry: &Registry) -> Self {
        let mut contestants: Vec<Contestant> = Vec::new();
        let mut notes: Vec<String> = Vec::new();
        for id in registry.available().into_iter().map(|e| e.id) {
            match Contestant::new(id.clone(), settings.frames, registry) {
                Ok(contestant) => contestants.push(contestant),
                // A driver may refuse at any time, and so may a user's algorithm; the replay continues without it.
                Err(error) => notes.push(format!("{id} is left out: {error}")),
            }
        }
        // Tuning may name a number of threads that the registry doesn't list but can make.
        let too_wide = too_wide(tuning, registry);
        for id in tuning.algorithms() {
            if !contestants.iter().any(|c| c.id == *id)
                && !too_wide.contains(&id)
                && let Ok(contestant) = Contestant::new(id.clone(), settings.frames, registry)
            {
                contestants.push(contestant);
            }
        }
        Self {
            contestants,
            adaptive: vec![Samples::default(); settings.frames],
            objects: vec![0; settings.frames],
            taken: Vec::new(),
            repeats: Vec::new(),
            telling: Vec::new(),
            told: Vec::new(),
            loops: Vec::new(),
            notes,
            shuffle: Random::new(settings.seed),
            other_work: OtherWork::new(),
            pairs: Pairs::new(),
            learning: settings.learning,
            exploring: settings.exploring,
        }
    }

    /// The adaptive choice of a repeat, with every contestant as fresh as it is.
    fn begin(&mut self, repeat: usize, tuning: &Tuning, registry: &Registry) -> anyhow::Result<Adaptive> {
        for contestant in self.contestants.iter_mut().filter(|_| repeat > 0) {
            if let Err(error) = contestant.renew(registry) {
                self.notes.push(format!("{} is left out from repeat {} on: {error}", contestant.id, repeat + 1));
            }
        }
        self.taken.clear();
        self.telling.clear();
        let mut adaptive = Adaptive::new(tuning.clone(), registry)?;
        adaptive.set_learning(self.learning);
        adaptive.set_exploring(self.exploring);
        Ok(adaptive)
    }

    /// Every contestant's turn at a frame.
    fn run(&mut self, repeat: usize, frame: usize, boxes: &[Aabb], adaptive: &mut Adaptive) -> anyhow::Result<()> {
        let count = self.contestants.len();
        let best_before = best(&self.contestants, frame);
        let mut answers: Vec<(usize, u64)> = Vec::new();
        // The turn behind the last of the fixed ones is the adaptive choice's.
        for k in self.shuffle.shuffled(count + 1) {
            if self.contestants.get(k).is_some_and(|c| c.is_skipped(frame, boxes.len(), best_before)) {
                continue;
            }
            self.other_work.run();
            let started = Instant::now();
            let result = match self.contestants.get_mut(k).and_then(|c| c.algorithm.as_mut()) {
                Some(algorithm) => algorithm.find_pairs(boxes, &mut self.pairs),
                None => adaptive.find_pairs(boxes, &mut self.pairs),
            };
            let ns = (started.elapsed().as_nanos() as f64).max(1.0);
            if let (Err(error @ Error::Unavailable { .. }), Some(contestant)) = (&result, self.contestants.get_mut(k)) {
                // The algorithm is at fault and not the boxes: a GPU that was lost. The adaptive choice continues without it too.
                self.notes.push(format!("{error}, at frame {frame}"));
                contestant.algorithm = None;
                continue;
            }
            result.with_context(|| format!("{} at frame {frame}", self.name(k)))?;
            self.contestants.get_mut(k).map_or(&mut self.adaptive, |c| &mut c.samples)[frame].push(repeat, ns);
            if repeat == 0 {
                answers.push((k, self.pairs.fingerprint()));
            }
        }
        self.compare(answers, frame)?;
        self.listen(adaptive);
        self.objects[frame] = boxes.len();
        let best = best(&self.contestants, frame);
        self.contestants.iter_mut().for_each(|c| c.judge(frame, boxes.len(), best));
        Ok(())
    }

    /// Refuses answers that differ.
    fn compare(&self, mut answers: Vec<(usize, u64)>, frame: usize) -> anyhow::Result<()> {
        // Whose turn came first says nothing about who is right; ours come first in the list, a user's after them.
        answers.sort_unstable();
        if let Some(&(first, right)) = answers.first()
            && let Some(&(other, _)) = answers.iter().find(|answer| answer.1 != right)
        {
            bail!(
                "{} returns other pairs than {} at frame {frame}; correct it if it is yours, else please report this",
                self.name(other),
                self.name(first)
            );
        }
        Ok(())
    }

    /// Notes what the adaptive choice decided.
    fn listen(&mut self, adaptive: &Adaptive) {
        let decision = adaptive.last_decision();
        let chosen = decision.and_then(|d| self.contestants.iter().position(|c| c.id == *d.algorithm));
        let explored = decision.is_some_and(|d| d.reason == Reason::Explored);
        self.taken.push(Taken { chosen, explored });
        self.telling.push(Told {
            reason: decision.map_or(Reason::FellBack, |d| d.reason),
            load: decision.map(|d| d.load).unwrap_or_default(),
            predicted_ns: decision.and_then(|d| d.predicted_ns),
            measured_ns: decision.and_then(|d| d.measured_ns),
            runner_up: decision.and_then(|d| d.runner_up).map(|(id, ns)| (id.clone(), ns)),
        });
    }

    /// The repeat is complete.
    fn end(&mut self) {
        self.repeats.push(std::mem::take(&mut self.taken));
        self.told = std::mem::take(&mut self.telling);
    }

    /// Who has a turn: one of the fixed algorithms, or the adaptive choice behind the last of them.
    fn name(&self, turn: usize) -> String {
        self.contestants.get(turn).map_or("the adaptive choice".to_owned(), |c| c.id.to_string())
    }

    fn outcome(mut self, settings: &ReplaySettings, done: usize, foreign_load: Option<f64>) -> Outcome {
        let frame = |at: usize| {
            let own = |samples: &mut Samples| {
                samples.cut(done);
                std::mem::take(samples)
            };
            let fixed = self.contestants.iter_mut().map(|c| own(&mut c.samples[at])).collect();
            let before = |repeat: &Vec<Taken>| at.checked_sub(1).map(|at| repeat[at]);
            let taken: Vec<(Taken, Option<Taken>)> = self.repeats.iter().map(|r| (r[at], before(r))).collect();
            Frame::new(self.objects[at], own(&mut self.adaptive[at]), fixed, &taken)
        };
        let frames: Vec<Frame> = (0..settings.frames).map(frame).collect();
        let slowdown = |own| Slowdown::new(own, &self.loops);
        Outcome {
            slowdown: settings.co_runner.map(slowdown),
            fixed: self.contestants.into_iter().map(|c| c.id).collect(),
            oracle: Oracle::new(&frames),
            windows: Oracle::of_windows(&frames),
            frames,
            repeats: self.repeats,
            told: self.told,
            interrupted: done < settings.repeats,
            foreign_load,
            notes: self.notes,
        }
    }
}

/// The share of the CPU that other programs take, frame by frame.
struct Watched {
    watch: Watch,
    /// Frames since it began.
    frames: usize,
    /// One for each frame of a window that was long enough to tell.
    loads: Vec<f64>,
}

impl Watched {
    fn begin() -> Self {
        Self { watch: Watch::begin(), frames: 0, loads: Vec::new() }
    }

    /// A frame has run.
    fn frame(&mut self) {
        self.frames += 1;
        if self.watch.is_long_enough() {
            let load = self.watch.foreign_load();
            self.loads.extend(load.into_iter().flat_map(|load| std::iter::repeat_n(load, self.frames)));
            (self.watch, self.frames) = (Watch::begin(), 0);
        }
    }

    fn foreign_load(&self) -> Option<f64> {
        median(&self.loads)
    }
}
