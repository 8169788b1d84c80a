//! From nothing to tuning of this machine: the cache, else a measurement and a prediction.

use super::Adaptive;
use super::cache::{Entry, Key};
use super::candidates::Made;
use super::options::Options;
use super::uniform;
use crate::hardware::ParameterId;
use crate::{AlgorithmId, Error, GpuHardware, Hardware, Model, Parameter, Registry, Tuning, measure};
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

/// How an [`Adaptive`] came to its tuning.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct Setup {
    /// Where the tuning came from.
    pub origin: Origin,
    /// What went otherwise than it should have, in words: an unreadable cache, a GPU that can't be measured. Nothing of it keeps frames
    /// from being run.
    pub remarks: Vec<String>,
    /// From the call of the constructor until the algorithms of the tuning was ready, in seconds.
    pub seconds: f64,
    /// The file of the cache, where there is one to be.
    pub file: Option<PathBuf>,
}

/// Where the tuning of an [`Adaptive`] came from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Origin {
    /// The program gave them: [`Adaptive::new`].
    #[default]
    Given,
    /// They are on their way; the usual tuning decides meanwhile. Looked for at every frame.
    Awaited,
    /// From the cache.
    Cached,
    /// From a measurement of the hardware and a prediction.
    Probed,
    /// [`Tuning::usual`] for good, since there was no prediction: the remarks say why.
    Usual,
}

/// Why [`Adaptive::save`] has stored nothing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SaveError(String);

impl fmt::Display for SaveError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for SaveError {}

/// What an [`Adaptive`] keeps of its start.
#[derive(Debug, Default)]
pub(super) struct Start {
    setup: Setup,
    /// The place in the cache of tuning that holds for this machine.
    entry: Option<Entry>,
    awaited: Option<Arc<Handover>>,
}

/// Where the thread in the background leaves what it has made.
#[derive(Debug, Default)]
struct Handover {
    /// The slot is filled and will not be touched by that thread again.
    ready: AtomicBool,
    slot: Mutex<Option<Arrival>>,
}

/// What becomes of the usual tuning.
struct Arrival {
    setup: Setup,
    entry: Option<Entry>,
    /// `None`: the usual ones stay.
    tuning: Option<(Tuning, Made)>,
}

impl fmt::Debug for Arrival {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Arrival").field("setup", &self.setup).finish_non_exhaustive()
    }
}

impl Adaptive {
    /// An adaptive broad phase with the tuning of this machine: those that an earlier start has kept, else predicted from
    /// its hardware parameters, which are measured in at most two seconds, and kept for the next start.
    ///
    /// In the background, which is the default, it returns at once, with [`Tuning::usual`] for the first frames; see
    /// [`Options::background`]. The thread that measures ends by itself, whether this is dropped before or not. What is kept
    /// holds for this machine, its drivers, this version of the library, its algorithms and the model; a change of any of
    /// them measures anew. A cache that can't be read or written keeps nothing from working: [`setup`](Self::setup) tells.
    ///
    /// Uses no network and no global state.
    ///
    /// # Errors
    /// [`Error::Unavailable`] or [`Error::UnknownAlgorithm`] when not even one algorithm of the usual tuning can be made.
    pub fn for_this_machine(options: &Options) -> Result<Self, Error> {
        let began = Instant::now();
        let mut adaptive = if options.background {
            in_background(options, began)?
        } else {
            let registry = options.registry.clone().unwrap_or_else(|| Arc::new(usual_registry(true)));
            let arrival = arrive(options, &registry, began, || true);
            // Only where there is no prediction: to make algorithms takes memory, and on GPUs time.
            let Arrival { setup, entry, tuning } = arrival;
            let mut adaptive = match tuning {
                Some((tuning, made)) => Self::with(tuning, made),
                None => Self::new(Tuning::usual(&registry), &registry)?,
            };
            adaptive.start = Start { setup, entry, awaited: None };
            adaptive
        };
        adaptive.set_learning(options.learning);
        adaptive.set_exploring(options.exploring);
        Ok(adaptive)
    }

    /// Where its tuning came from, what went wrong on the way and how long it took.
    #[must_use]
    pub fn setup(&self) -> &Setup {
        &self.start.setup
    }

    /// Keeps what was learned in the cache, for the next start of a program on this machine: call it at the end of a session.
    ///
    /// # Errors
    /// When there is no cache to keep it in, or it can't be written.
    pub fn save(&self) -> Result<(), SaveError> {
        let Some(entry) = &self.start.entry else {
            return Err(SaveError(
                match self.start.setup.origin {
                    Origin::Given => {
                        "the tuning was given by the program; write `Adaptive::learned` to a file with `json::write_tuning`"
                    }
                    Origin::Awaited => "the tuning of this machine are not there yet; save at the end of the session",
                    Origin::Usual => "nothing was predicted that could have been corrected; `Adaptive::setup` says why",
                    Origin::Cached | Origin::Probed => {
                        "there is no cache to keep it in; `Adaptive::setup` and the options say why"
                    }
                }
                .to_owned(),
            ));
        };
        entry.write(self.learned()).map_err(SaveError)
    }

    /// Takes what the thread in the background has made, once it is there. One look at a flag until then, and nothing after.
    pub(super) fn take_over(&mut self) {
        let Some(handover) = self.start.awaited.take_if(|h| h.ready.load(Ordering::Acquire)) else { return };
        // That thread let go of the lock before it set the flag.
        let Some(arrival) = handover.slot.lock().unwrap_or_else(PoisonError::into_inner).take() else { return };
        self.start.setup = arrival.setup;
        self.start.entry = arrival.entry;
        if let Some((tuning, made)) = arrival.tuning {
            self.adopt(tuning, made);
        }
    }
}

/// Usual tuning at once, and a thread that fills the handover.
fn in_background(options: &Options, began: Instant) -> Result<Adaptive, Error> {
    let mut adaptive = match &options.registry {
        Some(registry) => Adaptive::new(Tuning::usual(registry), registry)?,
        None => {
            // Without the GPUs, whose drivers take tens of milliseconds to load.
            let registry = usual_registry(false);
            Adaptive::new(Tuning::usual(&registry), &registry)?
        }
    };
    let handover = Arc::new(Handover::default());
    let (options, filled) = (options.clone(), Arc::clone(&handover));
    let run = move || {
        let made = catch_unwind(AssertUnwindSafe(|| {
            let registry = options.registry.clone().unwrap_or_else(|| Arc::new(usual_registry(true)));
            // The other owner is the broad phase that waits.
            arrive(&options, &registry, began, || Arc::strong_count(&filled) > 1)
        }));
        let arrival = made.unwrap_or_else(|_| {
            let remarks = vec!["the thread in the background panicked: the usual tuning stays".to_owned()];
            Arrival { setup: Setup { remarks, ..usual(began) }, entry: None, tuning: None }
        });
        *filled.slot.lock().unwrap_or_else(PoisonError::into_inner) = Some(arrival);
        filled.ready.store(true, Ordering::Release);
    };
    adaptive.start = match std::thread::Builder::new().name("sapwise-setup".to_owned()).spawn(run) {
        Ok(_) => {
            let setup = Setup { origin: Origin::Awaited, ..Setup::default() };
            Start { setup, entry: None, awaited: Some(handover) }
        }
        Err(e) => {
            let remarks = vec![format!("no thread can be started in the background ({e}): the usual tuning stays")];
            Start { setup: Setup { remarks, ..usual(began) }, ..Start::default() }
        }
    };
    Ok(adaptive)
}

/// The algorithms of a program that names none.
fn usual_registry(with_gpus: bool) -> Registry {
    let mut registry = Registry::new();
    registry.pin_threads();
    #[cfg(feature = "measure-gpu")]
    if with_gpus {
        registry.add_gpus(&crate::gpu::Gpus::find().choose(|gpu| gpu.kind != crate::GpuKind::Software));
    }
    #[cfg(not(feature = "measure-gpu"))]
    let _ = with_gpus;
    registry
}

fn usual(began: Instant) -> Setup {
    Setup { origin: Origin::Usual, seconds: began.elapsed().as_secs_f64(), ..Setup::default() }
}

/// Tuning of this machine with their algorithms, which are made only where they are still wanted.
fn arrive(options: &Options, registry: &Registry, began: Instant, wanted: impl Fn() -> bool) -> Arrival {
    let mut remarks = Vec::new();
    let found = find(options, registry, &mut remarks);
    let made = found.filter(|_| wanted()).and_then(|(tuning, origin, entry)| {
        let made = Made::of(&tuning, registry);
        if !made.instances.is_empty() {
            return Some((tuning, made, origin, entry));
        }
        remarks.extend(made.failure.map(|e| format!("none of the algorithms that were predicted can be made: {e}")));
        None
    });
    let Some((tuning, made, origin, entry)) = made else {
        return Arrival { setup: Setup { remarks, ..usual(began) }, entry: None, tuning: None };
    };
    let file = entry.as_ref().map(|e| e.file().to_owned());
    let setup = Setup { origin, remarks, seconds: began.elapsed().as_secs_f64(), file };
    Arrival { setup, entry, tuning: Some((tuning, made)) }
}

/// Tuning from the cache, else from a prediction, and their place in the cache. `None` where nothing can be predicted.
fn find(options: &Options, registry: &Registry, remarks: &mut Vec<String>) -> Option<(Tuning, Origin, Option<Entry>)> {
    let built_in = if options.model.is_none() { Model::built_in().map(Some) } else { Ok(None) };
    let built_in = built_in.map_err(|e| remarks.push(format!("the built-in model can't be read: {e}"))).ok()?;
    let model = options.model.as_ref().or(built_in.as_ref())?;
    let key = Key::new(registry, model).map_err(|e| remarks.push(format!("the model can't be written: {e}"))).ok()?;
    let entry = Entry::new(&options.cache, key).unwrap_or_else(|why| {
        remarks.push(why);
        None
    });
    match entry.as_ref().map(Entry::read) {
        Some(Ok(Some(tuning))) => return Some((tuning, Origin::Cached, entry)),
        Some(Err(why)) => remarks.push(why),
        Some(Ok(None)) | None => {}
    }
    let hardware = hardware(options, registry, model, remarks);
    let (tuning, sound) = predict(model, hardware, &registry.available(), remarks)?;
    // Another process may have been quicker, and may even have learned: what it has kept stays.
    if let Some(entry) = entry.as_ref().filter(|e| sound && !matches!(e.read(), Ok(Some(_)))) {
        remarks.extend(entry.write(tuning.clone()).err());
    }
    // Nor may what is learned upon them take the place of a sound measurement.
    Some((tuning, Origin::Probed, entry.filter(|_| sound)))
}

/// Tuning from hardware, without the figures and the GPUs that can't be: what needs one of them is left out. Also whether there was none.
fn predict(
    model: &Model,
    mut hardware: Hardware,
    algorithms: &[(AlgorithmId, u32)],
    remarks: &mut Vec<String>,
) -> Option<(Tuning, bool)> {
    let mut dropped = hardware.drop_implausible();
    dropped.extend(hardware.gpus.iter().filter_map(GpuHardware::implausible));
    let sound = dropped.is_empty();
    remarks.extend(dropped.into_iter().map(|why| format!("{why}; it is left out, and the next start measures again")));
    let prediction = model.predict(&hardware, algorithms).map_err(|why| remarks.push(why.to_string())).ok()?;
    let mut tuning = prediction.tuning("uniform", &uniform::loads());
    tuning.warnings.extend(hardware.disturbed());
    Some((tuning, sound))
}

/// Measures what the model reads, of the machine as the registry uses it.
fn hardware(options: &Options, registry: &Registry, model: &Model, remarks: &mut Vec<String>) -> Hardware {
    let threads = registry.available().iter().map(|(id, _)| id.threads()).max();
    let plan = measure::Options { threads, limit: Some(options.probe_limit), ..measure::Options::default() };
    let mut hardware = measure::hardware_for(&model.parameters(), &plan);
    let simd = registry.simd();
    if let Some(lanes) = hardware.parameters.iter_mut().find(|p| p.name == ParameterId::SimdLanes) {
        *lanes = Parameter::reported(ParameterId::SimdLanes, f64::from(simd.lanes()), "the SIMD level of the registry");
    }
    hardware.machine.simd = simd.to_string();
    #[cfg(feature = "measure-gpu")]
    for index in registry.gpus().identities().map(|g| g.index) {
        match measure::gpu(registry.gpus(), index, &plan) {
            Ok(gpu) => hardware.gpus.push(gpu),
            Err(why) => remarks.push(format!("gpu{index} can't be measured: {why}")),
        }
    }
    #[cfg(not(feature = "measure-gpu"))]
    let _ = remarks;
    hardware
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Machine;

    #[test]
    fn a_figure_that_can_not_be_costs_what_needs_it_and_no_more() {
        let model = Model::built_in().unwrap();
        let figure = |name: &&str| match *name {
            ParameterId::CacheLlcBytes => Parameter::reported(name, 33_554_432.0, "test"),
            ParameterId::ForkJoinColdNs => Parameter::reported(name, 5000.0, "test"),
            ParameterId::UsableCores | ParameterId::ScalingAllThreadsRatio => Parameter::reported(name, 2.0, "test"),
            _ => Parameter::reported(name, 4.0, "test"),
        };
        let parameters = model.parameters().iter().map(figure).collect();
        let hardware = Hardware { machine: Machine::default(), parameters, gpus: Vec::new(), gpu_groups: Vec::new() };
        let algorithms = Registry::with_cores(2).available();
        let mut remarks = Vec::new();
        let (tuning, sound) = predict(&model, hardware.clone(), &algorithms, &mut remarks).unwrap();
        assert_eq!((tuning.costs.len(), sound, remarks.len()), (algorithms.len(), true, 0));
        let mut broken = hardware;
        broken.parameters.iter_mut().filter(|p| p.name == ParameterId::ForkJoinColdNs).for_each(|p| p.value = Some(0.0));
        let (tuning, sound) = predict(&model, broken, &algorithms, &mut remarks).unwrap();
        assert!(tuning.costs.iter().all(|c| c.algorithm.threads() == 1) && !sound);
        assert_eq!(tuning.costs.len(), algorithms.len() / 2);
        assert!(remarks.len() == 1 && remarks[0].contains("fork_join_cold_ns is 0"), "{remarks:?}");
    }
}
