//! Measures the hardware parameters of this machine in process, in about three seconds on two cores.
//!
//! One file measures one family of parameters. Samples are taken in windows. A window in which other programs took
//! more than 5 % of the CPU is discarded and repeated while time is left; foreign load is known on Linux only. Every
//! loop has a time limit, so a slow or loaded machine takes fewer samples instead of more time.

mod cache_sizes;
mod caches;
mod clock;
mod core_to_core;
mod foreign_load;
mod fork_join;
#[cfg(feature = "gpu")]
mod gpu;
mod identity;
mod memory;
mod samples;
mod scaling;
mod topology;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use rayon::ThreadPool;

use crate::hardware::{Hardware, Parameter, ParameterId, Statistic};
use samples::Plan;
use sapwise::named;

pub use core_to_core::core_to_core_ns;
pub use foreign_load::Watch;
#[cfg(feature = "gpu")]
pub use gpu::{gpu, gpu_group};
pub(crate) use identity::fnv1a;
pub use identity::machine;

named! {
    /// A group of parameters that are measured together, in the order of measurement.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    #[non_exhaustive]
    pub enum Family("family of hardware parameters") {
        /// Usable cores, physical cores, SIMD lanes.
        Topology = "topology",
        /// Reported and measured clock.
        Clock = "clock",
        /// Cache sizes, and load latencies over working sets.
        Caches = "caches",
        /// Memory size and triad bandwidths.
        Memory = "memory",
        /// Time until one core sees what another core wrote.
        CoreToCore = "core_to_core",
        /// Cost of a fork and join, warm and cold.
        ForkJoin = "fork_join",
        /// Work of several threads over work of one.
        Scaling = "scaling",
    }
}

impl Family {
    /// Returns the parameters of this family, for a caller whose child process died.
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
        }
    }
}

/// How to measure.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub struct Options {
    /// Most threads; `None` uses every core that affinity and quota allow. 0 counts as 1.
    pub threads: Option<u32>,
    /// Stops after a few samples of small working sets. For tests: the values are not fit for a report.
    pub brief: bool,
    /// Upper bound on the time, give or take one sample, of the function that is called: for one family, for all of
    /// them, or for one GPU. What no cost model reads is left out if it takes time. `None` takes as long as a report
    /// needs.
    pub limit: Option<Duration>,
    /// Ends the measurement with the current sample once it is set.
    pub(crate) stop: Option<Arc<AtomicBool>>,
}

impl Options {
    /// Sets the most threads; `None` uses every core.
    #[must_use]
    pub fn with_threads(self, threads: Option<u32>) -> Self {
        Self { threads, ..self }
    }

    /// Sets whether to be brief.
    #[must_use]
    pub fn brief(self, brief: bool) -> Self {
        Self { brief, ..self }
    }

    /// Sets the time limit.
    #[must_use]
    pub fn with_limit(self, limit: Duration) -> Self {
        Self { limit: Some(limit), ..self }
    }

    pub(crate) fn is_stopped(&self) -> bool {
        self.stop.as_ref().is_some_and(|stop| stop.load(Ordering::Relaxed))
    }

    fn plan(&self, samples: usize, limit_ms: u64) -> Plan<'_> {
        let (samples, ms) = if self.brief { (4, limit_ms / 20) } else { (samples, limit_ms) };
        let limit = Duration::from_millis(ms);
        let limit = self.limit.map_or(limit, |at_most| limit.min(at_most));
        Plan { samples, limit, statistic: Statistic::Median, options: self }
    }

    /// Gives one of `parts` parts an equal share of the time that is left, if there is a limit.
    fn share(&self, began: Instant, parts: usize) -> Self {
        let parts = u32::try_from(parts).unwrap_or(u32::MAX).max(1);
        Self { limit: self.limit.map(|limit| limit.saturating_sub(began.elapsed()) / parts), ..self.clone() }
    }

    /// Threads that may run at once, at least 1.
    fn usable_cores(&self) -> usize {
        let available = std::thread::available_parallelism().map_or(1, usize::from);
        let wanted = self.threads.map_or(available, |threads| threads as usize);
        available.min(wanted).max(1)
    }
}

/// Measures one family. Returns each of [`Family::parameters`] once: measured, reported or missing with a reason.
///
/// A caller that wants to survive a crash runs each family in a child process and combines the answers with
/// [`assemble`].
pub fn family(family: Family, options: &Options) -> Vec<Parameter> {
    let measured = match family {
        Family::Topology => Ok(topology::measure(options)),
        Family::Clock => clock::measure(options),
        Family::Caches => Ok(caches::measure(options)),
        Family::Memory => Ok(memory::measure(options)),
        Family::CoreToCore => core_to_core::measure(options),
        Family::ForkJoin => fork_join::measure(options),
        Family::Scaling => scaling::measure(options),
    };
    measured.unwrap_or_else(|why| missing(&family.parameters(), &why))
}

/// Measures every family in this process.
pub fn hardware(options: &Options) -> Hardware {
    hardware_for(&ParameterId::ALL, options)
}

/// Measures the families that hold any of these parameters; the others are missing.
///
/// [`Model::parameters`](crate::Model::parameters) lists what a prediction needs.
pub fn hardware_for(parameters: &[ParameterId], options: &Options) -> Hardware {
    let began = Instant::now();
    let holds = |family: &Family| family.parameters().iter().any(|id| parameters.contains(id));
    let mut families: Vec<Family> = Family::ALL.into_iter().filter(holds).collect();
    if options.limit.is_some() {
        // Filling its arrays takes a fixed time. As the last family it gets the time that the others leave.
        families.sort_by_key(|&family| family == Family::Memory);
    }
    let mut measured = Vec::new();
    for (k, &of) in families.iter().enumerate() {
        let found = family(of, &options.share(began, families.len() - k));
        // The interrupted family has too few samples.
        if options.is_stopped() {
            break;
        }
        measured.extend(found);
    }
    assemble(machine(), measured)
}

/// Puts parameters into the order of a report: each of [`ParameterId::ALL`] once.
///
/// Of several parameters with one name it keeps the first. Absent parameters become missing; unknown names are dropped.
pub fn assemble(machine: crate::hardware::Machine, measured: Vec<Parameter>) -> Hardware {
    Hardware::new(machine, in_order(&ParameterId::ALL, &measured, "not measured"))
}

/// Each of these once: as measured, or missing with a reason.
fn in_order(ids: &[impl AsRef<str>], measured: &[Parameter], absent: &str) -> Vec<Parameter> {
    let find = |id: &_| Parameter::find(measured, id).cloned().unwrap_or_else(|| Parameter::missing(id, absent));
    ids.iter().map(find).collect()
}

/// Marks several parameters missing for one reason.
fn missing(ids: &[impl AsRef<str>], why: &str) -> Vec<Parameter> {
    ids.iter().map(|id| Parameter::missing(id, why)).collect()
}

/// Starts a pool of bound threads, so that the caller's global pool has no influence. A limit on processes can refuse
/// the threads.
fn pool(threads: usize) -> Result<ThreadPool, String> {
    sapwise::internals::pinned_pool(u32::try_from(threads).unwrap_or(u32::MAX)).map_err(|e| e.to_string())
}

/// Allocates equal elements; `None` without the memory.
fn filled<T: Clone>(count: usize, value: T) -> Option<Vec<T>> {
    let mut elements = Vec::new();
    elements.try_reserve_exact(count).ok()?;
    elements.resize(count, value);
    Some(elements)
}
