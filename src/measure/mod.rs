//! Measures the hardware parameters of this machine in process, in about three seconds on two cores.
//!
//! One file per family of parameters. Samples are taken in windows; a window in which other programs took more than 5 % of the
//! CPU is thrown away and repeated while time is left (Linux; elsewhere foreign load is not known). Every loop has a
//! time limit, so a slow or loaded machine gives fewer samples, not a longer run.

mod arithmetic;
mod caches;
mod cgroup;
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

use std::fmt;
use std::str::FromStr;
use std::time::{Duration, Instant};

use rayon::ThreadPool;

use crate::hardware::{Hardware, Machine, Parameter, parameter};
use foreign_load::Plan;

pub use core_to_core::core_to_core_ns;
pub use foreign_load::Watch;
#[cfg(feature = "measure-gpu")]
pub use gpu::{gpu, gpu_group};
#[cfg(feature = "this-machine")]
pub(crate) use identity::fnv1a;

/// A group of parameters that are measured together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Family {
    /// Usable cores, physical cores, SIMD lanes.
    Topology,
    /// The reported and the measured clock.
    Clock,
    /// Cache sizes, and load latencies over working sets.
    Caches,
    /// Memory size and triad bandwidths.
    Memory,
    /// Time until one core sees what another one wrote.
    CoreToCore,
    /// Cost of a fork and join, warm and cold.
    ForkJoin,
    /// Work of several threads over work of one.
    Scaling,
    /// Multiply-adds of one thread and of all.
    Arithmetic,
}

impl Family {
    /// Every family, in the order of measurement.
    pub const ALL: [Self; 8] = [
        Self::Topology,
        Self::Clock,
        Self::Caches,
        Self::Memory,
        Self::CoreToCore,
        Self::ForkJoin,
        Self::Scaling,
        Self::Arithmetic,
    ];

    /// The name, as [`FromStr`] reads it: `topology`, `clock`, `caches`, `memory`, `core_to_core`, `fork_join`, `scaling` or
    /// `arithmetic`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Topology => "topology",
            Self::Clock => "clock",
            Self::Caches => "caches",
            Self::Memory => "memory",
            Self::CoreToCore => "core_to_core",
            Self::ForkJoin => "fork_join",
            Self::Scaling => "scaling",
            Self::Arithmetic => "arithmetic",
        }
    }

    /// Names of the parameters of this family, so that a caller whose child process died can say which are missing.
    #[must_use]
    pub fn parameters(self) -> Vec<String> {
        use parameter as p;
        let owned = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        match self {
            Self::Topology => owned(&[p::USABLE_CORES, p::PHYSICAL_CORES, p::SIMD_LANES]),
            Self::Clock => owned(&[p::CLOCK_REPORTED_GHZ, p::CLOCK_MEASURED_GHZ]),
            Self::Caches => {
                let mut names = owned(&[p::CACHE_L1D_BYTES, p::CACHE_L2_BYTES, p::CACHE_LLC_BYTES]);
                names.extend(p::LATENCY_WORKING_SETS_KIB.map(p::latency_name));
                names
            }
            Self::Memory => owned(&[p::MEMORY_BYTES, p::BANDWIDTH_ONE_THREAD_GB_PER_S, p::BANDWIDTH_ALL_THREADS_GB_PER_S]),
            Self::CoreToCore => owned(&[p::CORE_TO_CORE_NS]),
            Self::ForkJoin => owned(&[p::FORK_JOIN_WARM_NS, p::FORK_JOIN_COLD_NS]),
            Self::Scaling => owned(&[p::SCALING_TWO_THREADS_RATIO, p::SCALING_ALL_THREADS_RATIO]),
            Self::Arithmetic => owned(&[p::ARITHMETIC_ONE_THREAD_GFLOP_PER_S, p::ARITHMETIC_ALL_THREADS_GFLOP_PER_S]),
        }
    }
}

impl fmt::Display for Family {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Family {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|family| family.name() == text).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            format!("{text}: no such family of hardware parameters; use one of {names}")
        })
    }
}

/// Why a parameter is missing that no cost model reads.
const UNDER_LIMIT: &str = "left out of a run with a limit of time";

/// What to measure with.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Options {
    /// Use no more threads than this; `None` uses every core that affinity and quota leave. 0 is taken as 1.
    pub threads: Option<u32>,
    /// Stops after a few samples of small working sets. For tests: the figures are not fit for a report.
    pub brief: bool,
    /// Takes no longer than this, a sample more or less, for a program that starts and has no time for a report: for one
    /// family, for all together, or for one GPU, as the function that is called measures. Load latencies and what no cost model
    /// reads of a GPU are left out then. `None` takes as long as a report needs.
    pub limit: Option<Duration>,
}

impl Options {
    fn plan(&self, samples: usize, limit_ms: u64) -> Plan {
        let (samples, ms) = if self.brief { (4, limit_ms / 20) } else { (samples, limit_ms) };
        let limit = Duration::from_millis(ms);
        Plan { samples, limit: self.limit.map_or(limit, |at_most| limit.min(at_most)) }
    }

    /// The same with an equal share of the time that is left, where there is a limit, for each of `parts` parts.
    fn share(&self, began: Instant, parts: usize) -> Self {
        let left = |limit: Duration| limit.saturating_sub(began.elapsed()) / u32::try_from(parts).unwrap_or(u32::MAX).max(1);
        Self { limit: self.limit.map(left), ..self.clone() }
    }

    /// Threads that may run at once, at least 1.
    fn usable_cores(&self) -> usize {
        let available = std::thread::available_parallelism().map_or(1, usize::from);
        let wanted = self.threads.map_or(available, |threads| threads as usize);
        available.min(wanted).max(1)
    }
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
/// [`Model::parameters`](crate::Model::parameters) has the names that a prediction needs.
#[must_use]
pub fn hardware_for(parameters: &[&str], options: &Options) -> Hardware {
    let holds = |family: &Family| family.parameters().iter().any(|name| parameters.contains(&name.as_str()));
    families(Family::ALL.into_iter().filter(holds).collect(), options)
}

fn families(mut wanted: Vec<Family>, options: &Options) -> Hardware {
    let began = Instant::now();
    if options.limit.is_some() {
        // To fill its arrays takes a time that can't be shortened, and what the others leave of theirs it gets.
        wanted.sort_by_key(|&family| family == Family::Memory);
    }
    let count = wanted.len();
    let measured = wanted.into_iter().enumerate().flat_map(|(k, f)| family(f, &options.share(began, count - k)));
    assemble(machine(), measured.collect())
}

/// Puts parameters, in any order, into the order of a report: every name of [`parameter::all_names`] once.
///
/// The first of several parameters with one name is kept. A name that is absent becomes missing, and an unknown name is dropped.
#[must_use]
pub fn assemble(machine: Machine, measured: Vec<Parameter>) -> Hardware {
    let find = |name: String| {
        let found = measured.iter().find(|p| p.name == name).cloned();
        found.unwrap_or_else(|| Parameter::missing(&name, "not measured"))
    };
    Hardware {
        machine,
        parameters: parameter::all_names().into_iter().map(find).collect(),
        gpus: Vec::new(),
        gpu_groups: Vec::new(),
    }
}

/// A pool of its own, so that the figures don't depend on what the caller's global pool does meanwhile.
///
/// The error is a sentence for [`Parameter::missing`]: a limit on processes can refuse the threads.
fn pool(threads: usize) -> Result<ThreadPool, String> {
    crate::cpu::build_pool(u32::try_from(threads).unwrap_or(u32::MAX), 0, true)
}

/// What `threads` threads of the pool do together: the sum of their rates.
fn together(pool: &ThreadPool, threads: usize, rate: impl Fn() -> f64 + Sync) -> f64 {
    // Each thread divides by its own time: they don't wake at once.
    pool.broadcast(|worker| if worker.index() < threads { rate() } else { 0.0 }).iter().sum()
}
