//! The turns of the adaptive choice and of every fixed algorithm at the same frames.

use super::frame_source::FrameSource;
use super::other_work::OtherWork;
use super::outcome::{Choice, Outcome, frames};
use super::samples::Samples;
use crate::interrupt;
use crate::progress::{Progress, Steps as _};
use anyhow::{Context, bail};
use sapwise::{Aabb, Adaptive, AlgorithmId, BroadPhase, Error, Pairs, Reason, Registry, Tuning};
use sapwise_scenes::Random;
use sapwise_tune::measure::Watch;
use sapwise_tune::stats::median;
use std::time::Instant;

/// An algorithm is not timed again at a frame when even the faster of two samples there is this many times the best:
/// its total is printed, and it can't be the best. A single sample may have found cold caches.
const HOPELESS: f64 = 10.0;

/// After a frame that took an algorithm longer than this, it is not timed at frames with at least that number of
/// objects ...
const TOO_LONG_NS: f64 = 1e9;
/// ... if the frame also took this many times as long as the best.
const TOO_SLOW: f64 = 100.0;

/// The settings of a replay.
#[derive(Debug)]
pub(crate) struct ReplaySettings {
    pub(crate) source: FrameSource,
    pub(crate) frames: usize,
    pub(crate) repeats: usize,
    /// Seed of the order of turns.
    pub(crate) seed: u64,
    /// Whether the adaptive choice corrects the tuning by the times of frames.
    pub(crate) learning: bool,
}

/// Replays the frames: in each repeat the same frames again, and at each frame every contestant in random order,
/// because a parallel algorithm leaves threads and caches behind that the next one feels.
///
/// Every repeat starts with fresh algorithms and the given tuning, so that the repeats are alike frame by frame. The
/// first one compares the pairs of all contestants, outside the timed part.
///
/// # Errors
/// When no algorithm of the tuning can run, when contestants disagree about the pairs, or on Ctrl-C in the first
/// repeat.
pub(crate) fn replay(settings: &ReplaySettings, tuning: &Tuning, registry: &Registry) -> anyhow::Result<Outcome> {
    let mut race = Race::new(settings, tuning, registry);
    let progress = Progress::new((settings.repeats * settings.frames) as u64);
    let (mut watch, mut loads) = (Watch::begin(), Vec::new());
    for repeat in 0..settings.repeats {
        progress.message(&format!("{}: repeat {} of {}", settings.source.name(), repeat + 1, settings.repeats));
        let mut adaptive = race.begin(repeat, settings, tuning, registry)?;
        let mut choices = Vec::with_capacity(settings.frames);
        let mut cursor = settings.source.start();
        for frame in 0..settings.frames {
            if interrupt::requested() && repeat == 0 {
                bail!("interrupted before every frame was run once; there are no times");
            }
            if interrupt::requested() {
                return Ok(race.outcome(settings, &loads));
            }
            race.turns(repeat, frame, cursor.boxes(), &mut adaptive)?;
            choices.push(race.choice(&adaptive));
            if watch.is_long_enough() {
                loads.extend(watch.foreign_load());
                watch = Watch::begin();
            }
            cursor.advance();
            progress.advance(1);
        }
        race.choices.push(choices);
    }
    Ok(race.outcome(settings, &loads))
}

/// Returns the algorithms of a tuning with more threads than the registry lists: the adaptive choice leaves them out.
/// If the tuning has steps only, it runs them anyway, and the list is empty.
pub(crate) fn too_wide<'a>(tuning: &'a Tuning, registry: &Registry) -> Vec<&'a AlgorithmId> {
    let most = registry.entries().iter().map(|e| e.id.threads()).max().unwrap_or(1);
    tuning.algorithms().into_iter().filter(|id| !tuning.costs.is_empty() && id.threads() > most).collect()
}

/// A fixed algorithm and its times.
struct Contestant {
    id: AlgorithmId,
    /// `None` once it failed.
    algorithm: Option<Box<dyn BroadPhase>>,
    /// One entry a frame.
    samples: Vec<Samples>,
    /// It is not timed at frames with this many objects or more.
    too_many: usize,
}

impl Contestant {
    fn new(id: AlgorithmId, frames: usize, registry: &Registry) -> Result<Self, Error> {
        let algorithm = Some(registry.create(&id)?);
        Ok(Self { id, algorithm, samples: vec![Samples::default(); frames], too_many: usize::MAX })
    }

    /// Returns whether another sample at this frame would change nothing. `best` is the fastest sample of all
    /// contestants there.
    fn is_skipped(&self, frame: usize, objects: usize, best: f64) -> bool {
        let samples = &self.samples[frame];
        let hopeless = samples.len() >= 2 && samples.fastest() > HOPELESS * best;
        self.algorithm.is_none() || objects >= self.too_many || hopeless
    }

    /// Notes whether a frame of this many objects took too long.
    fn judge(&mut self, frame: usize, objects: usize, best: f64) {
        let ns = self.samples[frame].fastest();
        if ns.is_finite() && ns > TOO_LONG_NS && ns > TOO_SLOW * best {
            self.too_many = self.too_many.min(objects);
        }
    }
}

/// The contestants and their times.
struct Race {
    contestants: Vec<Contestant>,
    adaptive: Vec<Samples>,
    objects: Vec<usize>,
    /// One list for each complete repeat.
    choices: Vec<Vec<Choice>>,
    notes: Vec<String>,
    shuffle: Random,
    other_work: OtherWork,
    pairs: Pairs,
}

impl Race {
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
        // A tuning may name a number of threads that the registry doesn't list but can make.
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
            choices: Vec::new(),
            notes,
            shuffle: Random::new(settings.seed),
            other_work: OtherWork::new(),
            pairs: Pairs::new(),
        }
    }

    /// Makes every algorithm anew, and returns the adaptive choice of a repeat.
    fn begin(
        &mut self,
        repeat: usize,
        settings: &ReplaySettings,
        tuning: &Tuning,
        registry: &Registry,
    ) -> anyhow::Result<Adaptive> {
        for contestant in self.contestants.iter_mut().filter(|c| repeat > 0 && c.algorithm.is_some()) {
            // Dropped before the next one is made: a GPU may not have room for both.
            contestant.algorithm = None;
            match registry.create(&contestant.id) {
                Ok(algorithm) => contestant.algorithm = Some(algorithm),
                Err(error) => {
                    self.notes.push(format!("{} is left out from repeat {} on: {error}", contestant.id, repeat + 1));
                }
            }
        }
        let mut adaptive = Adaptive::new(tuning.clone(), registry)?;
        adaptive.set_learning(settings.learning);
        Ok(adaptive)
    }

    /// The fastest sample of any fixed algorithm at a frame.
    fn best(&self, frame: usize) -> f64 {
        self.contestants.iter().map(|c| c.samples[frame].fastest()).fold(f64::INFINITY, f64::min)
    }

    /// Every contestant's turn at a frame.
    fn turns(&mut self, repeat: usize, frame: usize, boxes: &[Aabb], adaptive: &mut Adaptive) -> anyhow::Result<()> {
        let best_before = self.best(frame);
        let mut answers: Vec<(usize, u64)> = Vec::new();
        // The turn after the last of the fixed algorithms is the adaptive choice's.
        for k in self.shuffle.shuffled(self.contestants.len() + 1) {
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
                // A GPU was lost: the algorithm is at fault and not the boxes, and the others continue.
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
        self.objects[frame] = boxes.len();
        let best = self.best(frame);
        self.contestants.iter_mut().for_each(|c| c.judge(frame, boxes.len(), best));
        Ok(())
    }

    /// Refuses answers that differ.
    fn compare(&self, mut answers: Vec<(usize, u64)>, frame: usize) -> anyhow::Result<()> {
        // Our algorithms come before a user's in the list, so that the user's is named as the one that differs.
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

    fn choice(&self, adaptive: &Adaptive) -> Choice {
        let decision = adaptive.last_decision();
        Choice {
            chosen: decision.and_then(|d| self.contestants.iter().position(|c| c.id == *d.algorithm)),
            reason: decision.map_or(Reason::FellBack, |d| d.reason),
            load: decision.map(|d| d.load).unwrap_or_default(),
            predicted_ns: decision.and_then(|d| d.predicted_ns),
            measured_ns: decision.and_then(|d| d.measured_ns),
            runner_up: decision.and_then(|d| d.runner_up).map(|(id, ns)| (id.clone(), ns)),
        }
    }

    /// Returns the name of the contestant of a turn.
    fn name(&self, turn: usize) -> String {
        self.contestants.get(turn).map_or("the adaptive choice".to_owned(), |c| c.id.to_string())
    }

    fn outcome(mut self, settings: &ReplaySettings, loads: &[f64]) -> Outcome {
        // A repeat that Ctrl-C cut short does not count.
        let repeats = self.choices.len();
        let complete = |samples: &Samples| samples.of(|repeat| repeat < repeats);
        let adaptive: Vec<Samples> = self.adaptive.iter().map(complete).collect();
        let of_frame = |at: usize| self.contestants.iter().map(|c| complete(&c.samples[at])).collect();
        let fixed: Vec<Vec<Samples>> = (0..settings.frames).map(of_frame).collect();
        Outcome {
            frames: frames(&self.objects, &adaptive, &fixed, &self.choices),
            choices: self.choices.pop().unwrap_or_default(),
            fixed: self.contestants.into_iter().map(|c| c.id).collect(),
            repeats,
            interrupted: repeats < settings.repeats,
            foreign_load: median(loads),
            notes: self.notes,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn timed(ns: &[f64]) -> Contestant {
        let mut contestant = Contestant::new("brute@cpu1".parse().unwrap(), 1, &Registry::with_cores(1)).unwrap();
        ns.iter().enumerate().for_each(|(repeat, &ns)| contestant.samples[0].push(repeat, ns));
        contestant
    }

    #[test]
    fn a_hopeless_one_is_not_timed_again_and_one_cold_sample_is_no_proof() {
        assert!(!timed(&[500.0]).is_skipped(0, 9, 10.0));
        assert!(!timed(&[500.0, 90.0]).is_skipped(0, 9, 10.0));
        assert!(timed(&[500.0, 110.0]).is_skipped(0, 9, 10.0));
    }

    #[test]
    fn too_long_a_frame_is_the_last_with_as_many_objects() {
        let skipped = |ns: f64, best: f64| {
            let mut contestant = timed(&[ns]);
            contestant.judge(0, 1000, best);
            [999, 1000].map(|objects| contestant.is_skipped(0, objects, best))
        };
        assert_eq!(skipped(900e6, 10e6), [false, false]);
        assert_eq!(skipped(1.1e9, 10e6), [false, true]);
        // As slow, but not far behind the best.
        assert_eq!(skipped(1.1e9, 100e6), [false, false]);
    }
}
