//! The arguments with which a broad phase starts.

use crate::{PyTuning, exception, unusable};
use pyo3::exceptions::{PyOverflowError, PyTypeError};
use pyo3::prelude::*;
use sapwise::{Adaptive, Error, PairOrder, Pairs, Registry, Tuning};
use sapwise_tune::StartOptions;
use std::path::PathBuf;

/// What a caller asked for.
#[derive(Debug, Clone)]
pub(crate) struct Start {
    pub(crate) options: StartOptions,
    /// Whether leaving a `with` block saves what was learned.
    pub(crate) keeps: bool,
    pub(crate) learning: bool,
    pub(crate) exploring: bool,
    /// The most threads; `None`: all usable cores.
    pub(crate) threads: Option<u32>,
    /// Always this algorithm.
    pub(crate) algorithm: Option<String>,
    /// A tuning of the caller's.
    pub(crate) tuning: Option<Tuning>,
    pub(crate) ordered: bool,
    /// The most pairs, if the caller sets a limit.
    pub(crate) limit: Option<usize>,
}

impl Start {
    /// Takes the arguments that say where the tuning comes from. The others have their defaults.
    pub(crate) fn new(
        cache: Option<&Bound<'_, PyAny>>,
        measure: bool,
        background: bool,
        tuning: Option<&PyTuning>,
        algorithm: Option<String>,
    ) -> PyResult<Self> {
        let mut options = options(cache)?.background(background);
        if !measure {
            options = options.measure(None);
        }
        let no_cache = matches!(cache.map(|c| c.extract::<bool>()), Some(Ok(false)));
        Ok(Self {
            options,
            keeps: algorithm.is_none() && tuning.is_none() && !no_cache,
            learning: true,
            exploring: true,
            threads: None,
            algorithm,
            tuning: tuning.map(|of| of.tuning.clone()),
            ordered: true,
            limit: None,
        })
    }

    /// An adaptive broad phase. May take as long as the options let a measurement take.
    pub(crate) fn adaptive(&self) -> Result<Adaptive, Error> {
        let registry = || registry(self.threads);
        let mut adaptive = match (&self.algorithm, &self.tuning) {
            (Some(name), _) => only(name, self.threads)?,
            (None, Some(tuning)) => Adaptive::new(tuning.clone(), &registry())?,
            // Its thread looks for GPUs.
            (None, None) if self.threads.is_none() => sapwise_tune::for_this_machine(&self.options)?,
            (None, None) => sapwise_tune::for_this_machine(&self.options.clone().registry(registry().into()))?,
        };
        adaptive.set_learning(self.learning);
        adaptive.set_exploring(self.exploring);
        Ok(adaptive)
    }

    /// Makes an empty list of pairs with the caller's limit, or the default limit.
    pub(crate) fn pairs(&self) -> Pairs {
        pairs(order(self.ordered), self.limit)
    }

    /// Returns the caller's limit, or the default limit.
    pub(crate) fn most_pairs(&self) -> Option<usize> {
        self.limit.or_else(crate::memory::most_pairs)
    }
}

/// Returns the algorithms to choose from, on up to this many threads. `None`: one for each usable core.
pub(crate) fn registry(threads: Option<u32>) -> Registry {
    with_gpus(threads, false)
}

/// Adds the algorithms on GPUs, and on software adapters too if `software`.
#[cfg(feature = "gpu")]
fn with_gpus(threads: Option<u32>, software: bool) -> Registry {
    let mut registry = on_cpu(threads);
    let wanted = |kind| software || kind != sapwise_gpu::GpuKind::Software;
    sapwise_gpu::add_to(&mut registry, &gpus().choose(|gpu| wanted(gpu.kind)));
    registry
}

/// Returns the GPUs, which are found once in each process. The search holds the interpreter's lock, so that no other
/// thread forks meanwhile: the child would find this lock, the linker and the drivers in the middle of a search.
#[cfg(feature = "gpu")]
fn gpus() -> sapwise_gpu::Gpus {
    use sapwise_gpu::Gpus;
    use std::sync::{Mutex, PoisonError};
    /// With the process that found them. Locked only by a thread with the interpreter's lock.
    static FOUND: Mutex<Option<(u32, Gpus)>> = Mutex::new(None);
    let known = || {
        let mut found = FOUND.lock().unwrap_or_else(PoisonError::into_inner);
        let pid = std::process::id();
        if let Some((_, gpus)) = found.as_ref().filter(|(of, _)| *of == pid) {
            return gpus.clone();
        }
        let gpus = Gpus::find();
        // After a fork. Dropping them would wait for a driver that is not in this process.
        std::mem::forget(found.replace((pid, gpus.clone())));
        gpus
    };
    // None while the interpreter shuts down.
    Python::try_attach(|_| known()).unwrap_or_default()
}

#[cfg(not(feature = "gpu"))]
fn with_gpus(threads: Option<u32>, _: bool) -> Registry {
    on_cpu(threads)
}

fn on_cpu(threads: Option<u32>) -> Registry {
    threads.map_or_else(Registry::new, Registry::with_cores)
}

/// Makes an empty list of pairs. Without a limit, free memory limits it.
pub(crate) fn pairs(order: PairOrder, limit: Option<usize>) -> Pairs {
    let mut pairs = Pairs::with_order(order);
    pairs.set_limit(limit.or_else(crate::memory::most_pairs));
    pairs
}

/// Converts the argument `ordered`.
pub(crate) fn order(ordered: bool) -> PairOrder {
    if ordered { PairOrder::Canonical } else { PairOrder::Any }
}

/// Makes what always runs the algorithm of this name.
pub(crate) fn only(name: &str, threads: Option<u32>) -> Result<Adaptive, Error> {
    // A caller that names an algorithm may want a software adapter. An algorithm on the CPU need not wait for drivers.
    let registry = if name.contains("@cpu") { on_cpu(threads) } else { with_gpus(threads, true) };
    let parsed = name.parse().map_err(|_| {
        let known: Vec<String> = registry.available().iter().map(|entry| entry.id.to_string()).collect();
        let method = |id: &&String| id.split('@').next() == Some(name);
        let same: Vec<String> = known.iter().filter(method).cloned().collect();
        let hint = if same.is_empty() {
            format!("known here: {}", known.join(", "))
        } else {
            format!("name its threads too: {}", same.join(" or "))
        };
        Error::UnknownAlgorithm { text: name.to_owned(), hint }
    })?;
    Adaptive::only(parsed, &registry)
}

/// Converts the argument `limit`.
pub(crate) fn limit(given: &Bound<'_, PyAny>) -> PyResult<Option<usize>> {
    whole(given, "limit is", "; give 0 or more pairs, or None for what the memory allows")
}

/// Converts the argument `threads`.
pub(crate) fn threads(given: &Bound<'_, PyAny>) -> PyResult<Option<u32>> {
    let fix = "; give 1 or more, or None for all usable cores";
    match whole(given, "threads is", fix)? {
        Some(0) => Err(unusable(given.py(), format!("threads is 0{fix}"))),
        threads => Ok(threads.map(|threads| u32::try_from(threads).unwrap_or(u32::MAX))),
    }
}

/// Converts the argument `k`.
pub(crate) fn k(given: &Bound<'_, PyAny>) -> PyResult<usize> {
    whole(given, "k is", "; give 0 or more").map(Option::unwrap_or_default)
}

/// Converts a whole number. One that is negative or huge is an error of these words.
fn whole(given: &Bound<'_, PyAny>, what: &str, fix: &str) -> PyResult<Option<usize>> {
    given.extract::<Option<usize>>().map_err(|why| {
        if why.is_instance_of::<PyOverflowError>(given.py()) {
            return unusable(given.py(), format!("{what} {given}{fix}"));
        }
        PyTypeError::new_err(format!("{what} {given}{fix}"))
    })
}

/// Options with the cache that the caller wants: `None` for the user's folder, `False` for none, or a folder.
pub(crate) fn options(cache: Option<&Bound<'_, PyAny>>) -> PyResult<StartOptions> {
    let options = StartOptions::new();
    let Some(given) = cache else { return Ok(options) };
    match (given.extract::<bool>(), given.extract::<PathBuf>()) {
        (Ok(false), _) => Ok(options.cache(None)),
        (Ok(true), _) => Ok(options),
        (_, Ok(folder)) => Ok(options.cache(Some(folder))),
        _ => Err(unusable(given.py(), "cache is a folder, False for none, or None for the user's cache folder")),
    }
}

/// Makes an adaptive broad phase without the interpreter's lock. Checks for Ctrl-C before and after.
pub(crate) fn adaptive(py: Python<'_>, start: &Start) -> PyResult<Adaptive> {
    if start.algorithm.is_some() && start.tuning.is_some() {
        return Err(unusable(py, "algorithm and tuning exclude each other; give one of them"));
    }
    py.check_signals()?;
    let made = py.detach(|| start.adaptive());
    if let Err(interrupted) = py.check_signals() {
        // It waits until its measurement has ended.
        py.detach(|| drop(made));
        return Err(interrupted);
    }
    made.map_err(|error| exception(py, &error, ""))
}
