//! The in-line module: before each frame it chooses the algorithm that it expects to be cheapest.

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

/// Sizes of the slice in a learned tuning, in quarters of a decade: from ten to a million objects.
const SLICE: std::ops::RangeInclusive<u32> = 4..=24;

/// A broad phase that runs whichever algorithm is expected to be cheapest for each frame.
///
/// Every algorithm takes the same boxes and returns the same pairs, so a switch changes the speed alone. The expected
/// costs come from a [`Tuning`]. If it has cost curves, the times of frames correct them; see
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
    /// The origin of the tuning, and its cache.
    start: Start,
}

impl Adaptive {
    /// Makes a choice among those algorithms of `tuning` that `registry` can make.
    ///
    /// Leaves out algorithms whose cost is for another revision or for more threads than the registry lists: such a
    /// cost does not apply to this build or machine. Also leaves out those that [`Tuning::for_running`] replaces.
    ///
    /// # Errors
    /// [`Error::Unavailable`] or [`Error::UnknownAlgorithm`] when none can be made, [`Error::NoAlgorithm`] when none
    /// is named.
    pub fn new(tuning: Tuning, registry: &Registry) -> Result<Self, Error> {
        let tuning = tuning.for_running();
        let mut made = Instances::of(&tuning, registry);
        made.failure().map_or_else(|| Ok(Self::with(tuning, made)), Err)
    }

    /// Makes a choice among existing instances.
    #[doc(hidden)]
    #[must_use]
    pub fn with(tuning: Tuning, made: Instances) -> Self {
        Self { runner: Runner::new(tuning, made), start: Start::default() }
    }

    /// Makes a choice of one algorithm, which runs every frame.
    ///
    /// # Errors
    /// As [`Registry::create`].
    pub fn only(algorithm: AlgorithmId, registry: &Registry) -> Result<Self, Error> {
        let steps = vec![Step { from_objects: 0, algorithm }];
        let tuning = Tuning::from_steps(steps).map_err(|_| Error::NoAlgorithm)?;
        Self::new(tuning, registry)
    }

    /// Sets whether the times of frames correct the expected costs. The default is on. Turned off, corrections learned
    /// earlier stay in use.
    ///
    /// A tuning without cost curves has nothing to correct: it always decides by the number of objects.
    /// `wasm32-unknown-unknown` has no clock, so nothing is learned there unless the program gives one with
    /// `sapwise::set_clock`. Frames shorter than four ticks of that clock do not count.
    pub fn set_learning(&mut self, learns: bool) {
        self.runner.policy.learns = learns && clock::ticks();
    }

    /// Sets whether trials run. The default is on; without [learning](Self::set_learning) none runs.
    ///
    /// A trial runs another algorithm than the cheapest for 2 to 16 frames, to measure its cost. It begins
    /// if the expected saving over the next 300 frames exceeds its price by five frames. The exploration budget is
    /// 0.5 % of the time, up to eight frames in advance, and on credit a seventeenth of the expected saving.
    /// `pair-cache` tries numbers of threads by itself, for another 0.5 %.
    pub fn set_exploring(&mut self, explores: bool) {
        self.runner.policy.explores = explores;
    }

    /// Returns the tuning without corrections.
    #[must_use]
    pub fn tuning(&self) -> &Tuning {
        &self.runner.policy.tuning
    }

    /// Returns the tuning with the corrections learned for the machine and for each algorithm, along a slice of scenes
    /// like the present one. Passing effects are left out: another program on a core, cores that moved apart, the
    /// savings of incremental algorithms in this scene. If nothing was learned, returns the original tuning.
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

    /// Makes every algorithm anew from this registry: for a lost GPU that is back, or a pool of another size.
    ///
    /// Learned corrections stay, unless incremental algorithms came or went. State that algorithms kept from frame to
    /// frame is lost. A tuning that still arrives from the background uses the registry it was requested with.
    ///
    /// # Errors
    /// As [`new`](Self::new). Then the previous algorithms stay.
    pub fn revive(&mut self, registry: &Registry) -> Result<(), Error> {
        let mut made = Instances::of(&self.runner.policy.tuning, registry);
        if let Some(error) = made.failure() {
            return Err(error);
        }
        self.runner.remake(made);
        Ok(())
    }

    /// Takes the tuning from the background thread if it is ready.
    pub(crate) fn take_over(&mut self) {
        let arrived = self.start.arrived();
        self.runner.awaits = self.start.background.is_some();
        if let Some((tuning, made)) = arrived {
            self.runner.replace(tuning, made);
        }
    }

    /// Returns the origin of the tuning, the remarks on what went wrong, and the seconds that it took.
    #[must_use]
    pub fn setup(&self) -> &Setup {
        &self.start.setup
    }

    /// Writes the [learned](Self::learned) tuning to the cache, for the next start on this machine. Call it at the end
    /// of a session.
    ///
    /// Returns `false` and writes nothing if the tuning of this machine has not arrived yet, could not be predicted,
    /// or follows from a measurement with an implausible value, which the [remarks](Setup::remarks) name.
    ///
    /// # Errors
    /// There is no cache, or its file can't be written.
    pub fn save(&self) -> Result<bool, SaveError> {
        self.start.save(|| self.learned())
    }

    /// Sets the result of a start on this machine.
    #[doc(hidden)]
    pub fn set_start(&mut self, start: Start) {
        self.runner.awaits = start.background.is_some();
        self.start = start;
    }

    /// Returns the decision for the last frame, `None` before the first. Its text is a sentence with the reason.
    ///
    /// With the feature `tracing` every switch is an event with that text: target `sapwise::adaptive`, level DEBUG;
    /// trials have level TRACE.
    #[must_use]
    pub fn last_decision(&self) -> Option<Decision<'_>> {
        self.runner.last_decision()
    }

    /// Estimates the load of the next frame and decides, without running an algorithm.
    pub fn decide(&mut self, boxes: &[Aabb]) -> Option<Decision<'_>> {
        self.take_over();
        self.runner.decide(boxes);
        self.last_decision()
    }
}

/// A clone has the same tuning, settings, cache file and learned corrections. It makes its algorithms anew from the
/// same registry, so it runs on the same helper threads and GPUs. A clone of an original that still
/// [awaits](Origin::Awaited) its tuning keeps the usual one for good. If no algorithm can be made, its frames are
/// errors.
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

    /// Returns whether any of its algorithms is incremental.
    fn is_incremental(&self) -> bool {
        self.runner.is_incremental()
    }

    /// Returns the work of the last frame: from scratch, if the algorithm that ran is not incremental.
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
