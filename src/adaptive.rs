//! The in-line module: the cheapest algorithm for this frame, chosen before it runs.

mod decision;
mod epoch;
mod instances;
mod load_tracker;
mod pace;
mod part;
mod policy;
mod runner;
mod setup;
mod trial;
mod wait;
mod warming;

use crate::aabb::Aabb;
use crate::algorithm::AlgorithmId;
use crate::broad_phase::{BroadPhase, FrameKind, FrameWork};
use crate::clock;
use crate::error::Error;
use crate::load::Load;
use crate::pairs::Pairs;
use crate::registry::Registry;
use crate::tuning::{Source, Step, Tuning};
use runner::Runner;
use std::fmt;

pub use decision::{Decision, Reason};
pub use instances::Instances;
pub use setup::{Arrival, Background, Start};
pub use setup::{Origin, SaveError, Setup};

/// Sizes of the slice that learned tuning shows: four a decade from ten to a million, in quarters of a decade.
const SLICE: std::ops::RangeInclusive<u32> = 4..=24;

/// A broad phase that runs whichever algorithm is expected to be cheapest for each frame.
///
/// Every algorithm takes the same boxes and returns the same pairs, so a switch is invisible but for its speed. What
/// is expected comes from [`Tuning`] and, where these have cost curves, from the times of the frames that were run:
/// [`set_learning`](Self::set_learning).
///
/// ```
/// use sapwise::{Aabb, Adaptive, BroadPhase, Pairs, Registry, Tuning};
///
/// let registry = Registry::new();
/// let mut adaptive = Adaptive::new(Tuning::usual(&registry), &registry)?;
/// let mut pairs = Pairs::new();
/// adaptive.find_pairs(&[Aabb::cube([0.0; 3], 1.0); 2], &mut pairs)?; // every frame
/// assert_eq!(pairs.as_slice(), [(0, 1)]);
/// # Ok::<(), sapwise::Error>(())
/// ```
pub struct Adaptive {
    runner: Runner,
    /// How it came to its tuning.
    start: Start,
}

impl Adaptive {
    /// An adaptive broad phase over those algorithms of `tuning` that `registry` can make.
    ///
    /// An algorithm whose cost was found for another revision is left out, and so is one with more threads than the
    /// registry lists: its cost says nothing about this build or this machine. So are those that
    /// [`Tuning::for_running`] leaves out.
    ///
    /// # Errors
    /// [`Error::Unavailable`] or [`Error::UnknownAlgorithm`] when none can be made, [`Error::NoAlgorithm`] when none
    /// is named.
    pub fn new(tuning: Tuning, registry: &Registry) -> Result<Self, Error> {
        let tuning = tuning.for_running();
        let mut made = Instances::of(&tuning, registry);
        made.failure().map_or_else(|| Ok(Self::with(tuning, made)), Err)
    }

    /// Over instances that are there already.
    #[doc(hidden)]
    #[must_use]
    pub fn with(tuning: Tuning, made: Instances) -> Self {
        Self { runner: Runner::new(tuning, made), start: Start::default() }
    }

    /// Runs one algorithm always.
    ///
    /// # Errors
    /// As [`Registry::create`].
    pub fn only(algorithm: AlgorithmId, registry: &Registry) -> Result<Self, Error> {
        let steps = vec![Step { from_objects: 0, algorithm }];
        let tuning = Tuning::from_steps(steps).map_err(|_| Error::NoAlgorithm)?;
        Self::new(tuning, registry)
    }

    /// Whether the times of frames correct the expected costs. On unless it is turned off; what was learned until
    /// then stays in use.
    ///
    /// Tuning without cost curves have nothing to correct, and decide by the number of objects always. On
    /// `wasm32-unknown-unknown`, which has no clock, no frame is timed and nothing is learned, unless the program gives
    /// a clock by `sapwise::set_clock`. Frames of less than four ticks of that clock are not learned from.
    pub fn set_learning(&mut self, learns: bool) {
        self.runner.policy.learns = learns && clock::ticks();
    }

    /// Whether trials run: now and then another algorithm than the cheapest runs for 2 to 16 frames, to learn what it
    /// costs. A trial begins if it is expected to save five frames more in the next 300 than it costs. Trials may
    /// cost 0.5 % of the time, eight frames in advance, and on credit a seventeenth of what they are expected to save.
    /// On unless turned off; without [learning](Self::set_learning) none runs. On how many threads `pair-cache` is fast
    /// it tries by itself, for another 0.5 %.
    pub fn set_exploring(&mut self, explores: bool) {
        self.runner.policy.explores = explores;
    }

    /// The tuning that it began with.
    #[must_use]
    pub fn tuning(&self) -> &Tuning {
        &self.runner.policy.tuning
    }

    /// The tuning corrected by what was learned of the machine and of each algorithm, with the slice of scenes like
    /// the present one. What passes is left out: another program on a core, cores that moved apart, how much this
    /// scene spares incremental algorithms. Those that it began with where nothing was learned.
    #[must_use]
    pub fn learned(&self) -> Tuning {
        let tuning = &self.runner.policy.tuning;
        if !self.runner.policy.has_learned() {
            return tuning.clone();
        }
        let costs = self.runner.policy.learned_costs();
        let load = self.runner.tracker.load;
        let like = |quarter: u32| {
            let objects = 10.0_f64.powf(f64::from(quarter) / 4.0).round() as u32;
            load.rescaled(objects, load.pairs * f64::from(objects) / f64::from(load.objects.max(1)))
        };
        let loads: Vec<Load> = SLICE.map(like).collect();
        let learned = Tuning::from_costs(Source::Learned, "like the last frame", costs, &loads);
        Tuning {
            model: tuning.model.clone(),
            extrapolated: tuning.extrapolated,
            warnings: tuning.warnings.clone(),
            ..learned
        }
    }

    /// Makes every algorithm again from this registry: one that was lost and is back, or all of them on a pool of
    /// another size. What was learned stays, unless incremental algorithms came or went; what they kept from frame to
    /// frame is gone. A tuning that is still awaited from the background brings algorithms of the registry that they
    /// were asked with.
    ///
    /// # Errors
    /// As [`new`](Self::new); the algorithms of before stay then.
    pub fn revive(&mut self, registry: &Registry) -> Result<(), Error> {
        let mut made = Instances::of(&self.runner.policy.tuning, registry);
        if let Some(error) = made.failure() {
            return Err(error);
        }
        self.runner.remake(made);
        Ok(())
    }

    /// Takes the tuning from the background thread once it is there.
    pub(crate) fn take_over(&mut self) {
        let arrived = self.start.arrived();
        self.runner.awaits = self.start.background.is_some();
        if let Some((tuning, made)) = arrived {
            self.runner.replace(tuning, made);
        }
    }

    /// Where its tuning came from, what went wrong on the way and how long it took.
    #[must_use]
    pub fn setup(&self) -> &Setup {
        &self.start.setup
    }

    /// Writes what was learned to the cache, for the next start on this machine: call it at the end of a session.
    /// Returns `false` and writes nothing if the tuning of this machine has not arrived yet, could not be predicted,
    /// or follows from a measurement with an implausible value, which the [remarks](Setup::remarks) name.
    ///
    /// # Errors
    /// When there is no cache or its file can't be written.
    pub fn save(&self) -> Result<bool, SaveError> {
        self.start.save(|| self.learned())
    }

    /// Begins with what a start on this machine found.
    #[doc(hidden)]
    pub fn set_start(&mut self, start: Start) {
        self.runner.awaits = start.background.is_some();
        self.start = start;
    }

    /// What was decided for the last frame; `None` before the first. As a text it is a sentence that tells why.
    ///
    /// With the feature `tracing` every switch is an event with that text: target `sapwise::adaptive`, level DEBUG;
    /// trials have level TRACE.
    #[must_use]
    pub fn last_decision(&self) -> Option<Decision<'_>> {
        self.runner.last_decision()
    }

    /// Estimates the load of the next frame and decides, without running anything.
    pub fn decide(&mut self, boxes: &[Aabb]) -> Option<Decision<'_>> {
        self.take_over();
        self.runner.decide(boxes);
        self.last_decision()
    }
}

/// A clone has the same tuning, settings and cache file, and knows what the original has learned. It makes its
/// algorithms anew from the same registry, so it runs on the same helper threads and GPUs. While the original
/// [awaits](Origin::Awaited) its tuning, a clone gets the usual one for good. If no algorithm can be made, its frames
/// are errors.
impl Clone for Adaptive {
    fn clone(&self) -> Self {
        Self { runner: self.runner.twin(), start: self.start.twin() }
    }
}

impl BroadPhase for Adaptive {
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        if self.runner.is_open() {
            self.take_over();
        }
        self.runner.find_pairs(boxes, pairs)
    }

    fn prepare(&mut self, objects: usize) {
        self.runner.prepare(objects);
    }

    /// Whether any of its algorithms is incremental.
    fn is_incremental(&self) -> bool {
        self.runner.is_incremental()
    }

    /// Of an algorithm that keeps nothing every frame is from scratch.
    fn last_frame(&self) -> FrameWork {
        self.runner.work.unwrap_or(FrameWork::new(FrameKind::FromScratch, 1.0))
    }
}

impl fmt::Debug for Adaptive {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Adaptive").field("last_decision", &self.last_decision()).finish_non_exhaustive()
    }
}

#[cfg(test)]
pub(crate) mod tests;
