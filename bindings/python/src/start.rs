//! The arguments with which a broad phase starts.

use crate::error::{exception, failed, unusable};
use pyo3::prelude::*;
use sapwise::{Adaptive, Error, PairOrder, Pairs, Registry, Tuning};
use sapwise_tune::StartOptions;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

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
    pub(crate) order: PairOrder,
    /// The most pairs, where the caller says so.
    pub(crate) limit: Option<usize>,
}

impl Start {
    /// The algorithms to choose from.
    fn registry(&self) -> Arc<Registry> {
        Arc::new(self.threads.map_or_else(Registry::new, Registry::with_cores))
    }

    /// An adaptive broad phase. May take as long as the options let a measurement take.
    pub(crate) fn adaptive(&self) -> Result<Adaptive, Error> {
        let registry = self.registry();
        let mut adaptive = match (&self.algorithm, &self.tuning) {
            (Some(name), _) => {
                let parsed = name.parse().map_err(|why: sapwise::error::ParseIdError| Error::UnknownAlgorithm {
                    text: name.clone(),
                    hint: format!("{why}; known here: {}", known(&registry)),
                })?;
                Adaptive::only(parsed, &registry)?
            }
            (None, Some(tuning)) => Adaptive::new(tuning.clone(), &registry)?,
            (None, None) => sapwise_tune::for_this_machine(&self.options.clone().registry(registry))?,
        };
        adaptive.set_learning(self.learning);
        adaptive.set_exploring(self.exploring);
        Ok(adaptive)
    }

    /// Makes an empty list of pairs with the caller's limit, or the default limit.
    pub(crate) fn pairs(&self) -> Pairs {
        pairs(self.order, self.limit)
    }
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

fn known(registry: &Registry) -> String {
    let names: Vec<String> = registry.available().iter().map(|entry| entry.id.to_string()).collect();
    names.join(", ")
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

/// Converts an argument in seconds.
pub(crate) fn seconds(py: Python<'_>, name: &str, seconds: f64) -> PyResult<Duration> {
    Duration::try_from_secs_f64(seconds)
        .map_err(|_| unusable(py, format!("{name} is {seconds}; give seconds, 0 or more and finite")))
}

/// Makes an adaptive broad phase without the interpreter's lock. Checks for Ctrl-C before and after.
pub(crate) fn adaptive(py: Python<'_>, start: &Start) -> PyResult<Adaptive> {
    py.check_signals()?;
    let made = py.detach(|| start.adaptive());
    py.check_signals()?;
    made.map_err(|error| match error {
        Error::Unavailable { .. } => failed(py, error.to_string()),
        _ => exception(py, &error, ""),
    })
}
