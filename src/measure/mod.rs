//! Measures the hardware parameters of this machine in process, in about three seconds on two cores.
//!
//! One file per family of parameters. Samples are taken in windows; a window in which other programs took more than 5 % of the
//! CPU is thrown away and repeated while time is left (Linux; elsewhere foreign load is not known). Every loop has a
//! time limit, so a slow or loaded machine takes fewer samples, not a longer run.

mod arithmetic;
mod cache_sizes;
mod caches;
mod clock;
mod core_to_core;
mod foreign_load;
mod fork_join;
#[cfg(feature = "measure-gpu")]
mod gpu;
mod identity;
mod memory;
mod scaling;
mod topology;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use rayon::ThreadPool;

use crate::hardware::{Hardware, Machine, Parameter, ParameterId};
use crate::named::named;
use foreign_load::Plan;

pub use core_to_core::core_to_core_ns;
pub use foreign_load::Watch;
#[cfg(feature = "measure-gpu")]
pub use gpu::{gpu, gpu_group};
#[cfg(feature = "this-machine")]
pub(crate) use identity::fnv1a;

named! {
    /// A group of parameters that are measured together, in the order of measurement.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    #[non_exhaustive]
    pub enum Family("family of hardware parameters") {
        /// Usable cores, physical cores, SIMD lanes.
        Topology = "topology",
        /// The reported and the measured clock.
        Clock = "clock",
        /// Cache sizes, and load latencies over working sets.
        Caches = "caches",
        /// Memory size and triad bandwidths.
        Memory = "memory",
        /// Time until one core sees what another one wrote.
        CoreToCore = "core_to_core",
        /// Cost of a fork and join, warm and cold.
        ForkJoin = "fork_join",
        /// Work of several threads over work of one.
        Scaling = "scaling",
        /// Multiply-adds of one thread and of all.
        Arithmetic = "arithmetic",
    }
}

impl Family {
    /// The parameters of this family, so that a caller whose child process died can say which are missing.
    #[must_use]
    pub fn parameters(self) -> Vec<ParameterId> {
        use ParameterId as P;
        match self {
            Self::Topology => vec![P::UsableCores, P::PhysicalCores, P::SimdLanes],
            Self::Clock => vec![P::ClockReportedGhz, P::ClockMeasuredGhz],
            Self::Caches => {
                let sizes = [P::CacheL1dBytes, P::CacheL2Bytes, P::CacheLlcBytes];
                sizes.into_iter().chain(P::LATENCIES.map(|l| l.1)).collect()
            }
            Self::Memory => vec![P::MemoryBytes, P::BandwidthOneThreadGbPerS, P::BandwidthAllThreadsGbPerS],
            Self::CoreToCore => vec![P::CoreToCoreNs],
            Self::ForkJoin => vec![P::ForkJoinWarmNs, P::ForkJoinColdNs],
            Self::Scaling => vec![P::ScalingTwoThreadsRatio, P::ScalingAllThreadsRatio],
            Self::Arithmetic => vec![P::ArithmeticOneThreadGflopPerS, P::ArithmeticAllThreadsGflopPerS],
        }
    }
}

/// Why a parameter is missing that no cost model reads.
const UNDER_LIMIT: &str = "left out of a run with a limit of time";

/// What to measure with.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub struct Options {
    /// Use no more threads than this; `None` uses every core that affinity and quota leave. 0 is taken as 1.
    pub threads: Option<u32>,
    /// Stops after a few samples of small working sets. For tests: the figures are not fit for a report.
    pub brief: bool,
    /// Takes no longer than this, a sample more or less, for a program that starts and has no time for a report: for one
    /// family, for all together, or for one GPU, as the function that is called measures. Load latencies and what no cost model
    /// reads of a GPU are left out then. `None` takes as long as a report needs.
    pub limit: Option<Duration>,
    /// Ends the measurement with the sample that is being taken, once it is set.
    pub(crate) stop: Option<Arc<AtomicBool>>,
}

impl Options {
    /// The same with at most so many threads; `None` uses every core.
    #[must_use]
    pub fn with_threads(self, threads: Option<u32>) -> Self {
        Self { threads, ..self }
    }

    /// The same, brief or not.
    #[must_use]
    pub fn brief(self, brief: bool) -> Self {
        Self { brief, ..self }
    }

    /// The same within a time.
    #[must_use]
    pub fn with_limit(self, limit: Duration) -> Self {
        Self { limit: Some(limit), ..self }
    }

    /// Whether the caller wants no more.
    pub(crate) fn is_stopped(&self) -> bool {
        is_set(self.stop.as_ref())
    }

    fn plan(&self, samples: usize, limit_ms: u64) -> Plan {
        let (samples, ms) = if self.brief { (4, limit_ms / 20) } else { (samples, limit_ms) };
        let limit = Duration::from_millis(ms);
        Plan { samples, limit: self.limit.map_or(limit, |at_most| limit.min(at_most)), stop: self.stop.clone() }
    }

    /// The same with an equal share of the time that is left, where there is a limit, for each of `parts` parts.
    fn share(&self, began: Instant, parts: usize) -> Self {
        let left =
            |limit: Duration| limit.saturating_sub(began.elapsed()) / u32::try_from(parts).unwrap_or(u32::MAX).max(1);
        Self { limit: self.limit.map(left), ..self.clone() }
    }

    /// Threads that may run at once, at least 1.
    fn usable_cores(&self) -> usize {
        let available = std::thread::available_parallelism().map_or(1, usize::from);
        let wanted = self.threads.map_or(available, |threads| threads as usize);
        available.min(wanted).max(1)
    }
}

fn is_set(stop: Option<&Arc<AtomicBool>>) -> bool {
    stop.is_some_and(|stop| stop.load(Ordering::Relaxed))
}

/// Measures one family: each name of [`Family::parameters`] once, measured, reported or missing with a reason.
///
/// A caller that wants to survive a crash runs each family in a child process and puts the answers together with [`assemble`].
#[must_use]
pub fn family(family: Family, options: &Options) -> Vec<Parameter> {
    match family {
        Family::Topology => topology::measure(options),
        Family::Clock => clock::measure(options),
        Family::Caches => caches::measure(options),
        Family::Memory => memory::measure(options),
        Family::CoreToCore => core_to_core::measure(options),
        Family::ForkJoin => fork_join::measure(options),
        Family::Scaling => scaling::measure(options),
        Family::Arithmetic => arithmetic::measure(options),
    }
}

/// What this machine says of itself, with a hash of CPU vendor, family, model, stepping and last-level cache as its id.
#[must_use]
pub fn machine() -> Machine {
    identity::machine()
}

/// Measures every family in this process.
#[must_use]
pub fn hardware(options: &Options) -> Hardware {
    families(Family::ALL.to_vec(), options)
}

/// Measures those families in this process that hold one of these parameters; those of the others are missing.
///
/// [`Model::parameters`](crate::Model::parameters) has those that a prediction needs.
#[must_use]
pub fn hardware_for(parameters: &[ParameterId], options: &Options) -> Hardware {
    let holds = |family: &Family| family.parameters().iter().any(|id| parameters.contains(id));
    families(Family::ALL.into_iter().filter(holds).collect(), options)
}

fn families(mut wanted: Vec<Family>, options: &Options) -> Hardware {
    let began = Instant::now();
    if options.limit.is_some() {
        // To fill its arrays takes a time that can't be shortened, and what the others leave of theirs it gets.
        wanted.sort_by_key(|&family| family == Family::Memory);
    }
    let (count, mut measured) = (wanted.len(), Vec::new());
    for (k, of) in wanted.into_iter().enumerate().take_while(|_| !options.is_stopped()) {
        measured.extend(family(of, &options.share(began, count - k)));
    }
    assemble(machine(), measured)
}

/// Puts parameters, in any order, into the order of a report: each of [`ParameterId::ALL`] once.
///
/// The first of several parameters with one name is kept. A name that is absent becomes missing, and an unknown name is dropped.
#[must_use]
pub fn assemble(machine: Machine, measured: Vec<Parameter>) -> Hardware {
    let find = |id: ParameterId| {
        let found = Parameter::find(&measured, id).cloned();
        found.unwrap_or_else(|| Parameter::missing(id, "not measured"))
    };
    Hardware::new(machine, ParameterId::ALL.into_iter().map(find).collect())
}

/// A pool of its own, so that the figures don't depend on what the caller's global pool does meanwhile.
///
/// The error is a sentence for [`Parameter::missing`]: a limit on processes can refuse the threads.
fn pool(threads: usize) -> Result<ThreadPool, String> {
    crate::cpu::seated_pool(u32::try_from(threads).unwrap_or(u32::MAX)).map_err(|e| e.to_string())
}

/// What `threads` threads of the pool do together: the sum of their rates.
fn together(pool: &ThreadPool, threads: usize, rate: impl Fn() -> f64 + Sync) -> f64 {
    // Each thread divides by its own time: they don't wake at once.
    pool.broadcast(|worker| if worker.index() < threads { rate() } else { 0.0 }).iter().sum()
}
