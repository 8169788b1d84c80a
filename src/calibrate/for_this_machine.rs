//! From nothing to tuning of this machine: the cache, else a measurement and a prediction.

use super::cache::{CacheFile, Key};
use super::options::StartOptions;
use super::{slice, tunings};
use crate::adaptive::{Adaptive, Arrival, Awaited, Handover, Instances, Keeper, Origin, Setup, Start};
use crate::entry::Entry;
use crate::error::Error;
use crate::hardware::{GpuHardware, Hardware, Measurement, Parameter, ParameterId};
use crate::measure;
use crate::model::Model;
use crate::registry::Registry;
use crate::tuning::Tuning;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// How long to wait for another process that measures, beside the time that this one would measure for.
const MOST_WAIT: Duration = Duration::from_secs(10);

/// The same in the background, where the usual tuning decides meanwhile: longer than a measurement that leaves most of the time to its
/// program.
const MOST_WAIT_IN_BACKGROUND: Duration = Duration::from_secs(120);

impl Adaptive {
    /// An adaptive broad phase with the tuning of this machine: the one that an earlier start has kept, else predicted from
    /// its hardware parameters, which are measured in at most two seconds, and kept for the next start.
    ///
    /// In the background, which is the default, it returns at once, with [`Tuning::usual`] for the first frames; see
    /// [`StartOptions::background`]. The thread that measures takes a tenth of the time, and ends when this is dropped, which waits for it
    /// for two seconds at most; what it has measured by then the next start goes on from. Of processes that start together one
    /// measures, and the others take what it keeps. What is kept holds for this machine, its drivers, this version of the library, its algorithms and the model; after a change of any of
    /// them the next start measures again. So it does after 30 days, and where other programs disturbed the measurement or frames took over twice
    /// or less than half the time predicted, though no more than twice in a month; in the background what was kept decides meanwhile. A cache that can't be read or written keeps nothing from working: [`setup`](Self::setup) tells.
    ///
    /// Uses no network and no global state.
    ///
    /// # Errors
    /// [`Error::Unavailable`] or [`Error::UnknownAlgorithm`] when not even one algorithm of the usual tuning can be made.
    pub fn for_this_machine(options: &StartOptions) -> Result<Self, Error> {
        let began = Instant::now();
        let mut adaptive = if options.background {
            in_background(options, began)?
        } else {
            let registry = options.registry.clone().unwrap_or_else(|| Arc::new(usual_registry(true)));
            let arrival = arrive(options, &registry, began, &Arc::default(), MOST_WAIT + options.probe_limit, None);
            // Only where there is no prediction: to make algorithms takes memory, and on GPUs time.
            let Arrival { setup, keeper, tuning } = arrival;
            let mut adaptive = match tuning {
                Some((tuning, made)) => Self::with(tuning, made),
                None => Self::new(Tuning::usual(&registry), &registry)?,
            };
            adaptive.set_start(Start { setup, keeper, awaited: None });
            adaptive
        };
        adaptive.set_learning(options.learning);
        adaptive.set_exploring(options.exploring);
        Ok(adaptive)
    }
}

/// Usual tuning at once, and a thread that fills the handover.
fn in_background(options: &StartOptions, began: Instant) -> Result<Adaptive, Error> {
    let mut adaptive = match &options.registry {
        Some(registry) => Adaptive::new(Tuning::usual(registry), registry)?,
        None => {
            // Without the GPUs, whose drivers take tens of milliseconds to load.
            let registry = usual_registry(false);
            Adaptive::new(Tuning::usual(&registry), &registry)?
        }
    };
    let (handover, pace) = (Arc::new(Handover::default()), Arc::new(AtomicBool::default()));
    let wait_at_most = options.wait_at_most;
    let (options, filled, own_pace) = (options.clone(), Arc::clone(&handover), Arc::clone(&pace));
    let run = move || {
        let made = catch_unwind(AssertUnwindSafe(|| {
            let registry = options.registry.clone().unwrap_or_else(|| Arc::new(usual_registry(true)));
            arrive(&options, &registry, began, &own_pace, MOST_WAIT_IN_BACKGROUND, Some(&filled))
        }));
        // Before it is told that nothing is left to do.
        drop(options);
        let arrival = made.unwrap_or_else(|_| {
            let remarks = vec!["the thread in the background panicked: the usual tuning stays".to_owned()];
            Arrival { setup: Setup { remarks, ..usual(began) }, keeper: None, tuning: None }
        });
        filled.leave_last(arrival);
    };
    adaptive.set_start(match std::thread::Builder::new().name("sapwise-setup".to_owned()).spawn(run) {
        Ok(thread) => {
            let setup = Setup { origin: Origin::Awaited, ..Setup::default() };
            let awaited = Awaited { handover, pace, thread: Some(thread) };
            awaited.wait(wait_at_most);
            Start { setup, keeper: None, awaited: Some(awaited) }
        }
        Err(e) => {
            let remarks = vec![format!("no thread can be started in the background ({e}): the usual tuning stays")];
            Start { setup: Setup { remarks, ..usual(began) }, ..Start::default() }
        }
    });
    if wait_at_most > Duration::ZERO {
        adaptive.take_over();
    }
    Ok(adaptive)
}

/// The algorithms of a program that names none.
fn usual_registry(with_gpus: bool) -> Registry {
    #[cfg_attr(not(feature = "measure-gpu"), expect(unused_mut, reason = "there is nothing to add"))]
    let mut registry = Registry::new();
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

/// Tuning of this machine, and what there is to tell of it.
struct Found {
    tuning: Tuning,
    origin: Origin,
    measured: Measurement,
    file: Option<CacheFile>,
}

impl Found {
    /// With its algorithms.
    fn arrive(self, registry: &Registry, began: Instant, remarks: &mut Vec<String>) -> Option<Arrival> {
        let mut made = Instances::of(&self.tuning, registry);
        if let Some(e) = made.failure() {
            remarks.push(format!("none of the algorithms that were predicted can be made: {e:#}"));
            return None;
        }
        let setup = Setup {
            origin: self.origin,
            remarks: remarks.clone(),
            seconds: began.elapsed().as_secs_f64(),
            file: self.file.as_ref().map(|f| f.path().to_owned()),
            measured: Some(self.measured),
        };
        let keeper = self.file.map(|f| Box::new(f) as Box<dyn Keeper>);
        Some(Arrival { setup, keeper, tuning: Some((self.tuning, made)) })
    }
}

/// Tuning of this machine with their algorithms, which are made only where they are still wanted. `patience` is for another process that
/// measures already. What was kept and is measured again is left in the `handover` until then, where there is one.
fn arrive(
    options: &StartOptions,
    registry: &Registry,
    began: Instant,
    pace: &Arc<AtomicBool>,
    patience: Duration,
    handover: Option<&Handover>,
) -> Arrival {
    let mut remarks = Vec::new();
    let meanwhile = |found: Found, remarks: &mut Vec<String>| {
        let Some(handover) = handover.filter(|_| !pace.load(Ordering::Relaxed)) else { return false };
        found.arrive(registry, began, remarks).map(|arrival| handover.leave(arrival)).is_some()
    };
    let found =
        find(options, registry, pace, patience, &mut remarks, meanwhile).filter(|_| !pace.load(Ordering::Relaxed));
    let arrival = found.and_then(|found| found.arrive(registry, began, &mut remarks));
    arrival.unwrap_or_else(|| Arrival { setup: Setup { remarks, ..usual(began) }, keeper: None, tuning: None })
}

/// Tuning from the cache, else from a prediction, and its file in the cache. `None` where nothing can be predicted, or what measured was
/// stopped. What was kept and is measured again is given to `meanwhile`, which tells whether it has any use for that, and is found where the
/// measurement fails and nobody has it yet.
fn find(
    options: &StartOptions,
    registry: &Registry,
    pace: &Arc<AtomicBool>,
    patience: Duration,
    remarks: &mut Vec<String>,
    meanwhile: impl Fn(Found, &mut Vec<String>) -> bool,
) -> Option<Found> {
    let built_in = if options.model.is_none() { Model::built_in().map(Some) } else { Ok(None) };
    let built_in = built_in.map_err(|e| remarks.push(format!("the built-in model can't be read: {e}"))).ok()?;
    let model = options.model.as_ref().or(built_in.as_ref())?;
    let key = Key::new(registry, model).map_err(|e| remarks.push(format!("the model can't be written: {e}"))).ok()?;
    let file = CacheFile::new(&options.cache, key).unwrap_or_else(|why| {
        remarks.push(why);
        None
    });
    let cached = |(tuning, measured): (Tuning, Measurement)| {
        let file = file.clone().map(|f| f.of(measured.clone()));
        Found { tuning, origin: Origin::Cached, measured, file }
    };
    let before = match file.as_ref().map(CacheFile::read) {
        Some(Ok(kept)) => kept,
        Some(Err(why)) => {
            remarks.push(why);
            None
        }
        None => None,
    };
    let doubt = before.as_ref().map(|kept| kept.1.doubt());
    if let (Some(kept), Some(None)) = (&before, &doubt) {
        return Some(cached(kept.clone()));
    }
    // What frames have contradicted is not taken a second time.
    if let Some(folder) = &options.tunings
        && !before.as_ref().is_some_and(|kept| kept.1.is_contradicted())
    {
        match tunings::of_this_machine(folder, registry) {
            Ok(Some(tuning)) => {
                let measured = Measurement::now(Vec::new(), None);
                let file = file.map(|f| f.of(measured.clone()));
                return Some(Found { tuning, origin: Origin::Shipped, measured, file });
            }
            Ok(None) => {}
            Err(why) => remarks.push(why),
        }
    }
    if !options.measure {
        if before.is_none() {
            remarks.push(
                "nothing is kept of this machine, and it was not to be measured: the usual tuning stays".to_owned(),
            );
        }
        return before.map(cached);
    }
    let mut in_use = false;
    if let (Some(kept), Some(Some(why))) = (&before, doubt) {
        remarks.push(format!("the hardware is measured again: {why}"));
        in_use = meanwhile(cached(kept.clone()), remarks);
    }
    // Processes that start together measure once, and don't disturb each other.
    let turn = file.as_ref().and_then(|f| f.wait_for_turn(patience, || pace.load(Ordering::Relaxed)));
    let trusted = |file: &CacheFile| file.read().ok().flatten().filter(|kept| kept.1.doubt().is_none());
    if let Some(kept) = file.as_ref().and_then(trusted) {
        return Some(cached(kept));
    }
    let hardware = hardware(options, registry, model, pace, remarks);
    if pace.load(Ordering::Relaxed) {
        return None;
    }
    file.iter().for_each(CacheFile::forget_unfinished);
    let measured = Measurement::now(hardware.disturbed(), before.as_ref().map(|kept| &kept.1));
    let predicted = predict(model, hardware, &registry.available(), remarks);
    // Figures that can't be cost algorithms: rather what was kept than that.
    let Some((tuning, sound)) = predicted.filter(|(_, sound)| *sound || before.is_none()) else {
        return before.filter(|_| !in_use).map(cached);
    };
    let file = file.map(|f| f.of(measured.clone()));
    // Another process may have been quicker, and may even have learned: what it has kept stays.
    if let Some(file) = file.as_ref().filter(|f| sound && trusted(f).is_none()) {
        remarks.extend(file.keep(tuning.clone(), 1.0).err().map(with_cause));
    }
    drop(turn);
    // Nor may what is learned upon them take the place of a sound measurement.
    Some(Found { tuning, origin: Origin::Probed, measured, file: file.filter(|_| sound) })
}

/// Tuning from hardware, without the figures and the GPUs that can't be: what needs one of them is left out. Also whether there was none.
fn predict(
    model: &Model,
    mut hardware: Hardware,
    algorithms: &[Entry],
    remarks: &mut Vec<String>,
) -> Option<(Tuning, bool)> {
    let mut dropped = hardware.drop_implausible();
    dropped.extend(hardware.gpus.iter().filter_map(GpuHardware::implausible));
    let sound = dropped.is_empty();
    remarks.extend(dropped.into_iter().map(|why| format!("{why}; it is left out, and the next start measures again")));
    let prediction = model.predict(&hardware, algorithms).map_err(|why| remarks.push(why.to_string())).ok()?;
    let mut tuning = prediction.tuning(slice::SCENARIO, &slice::loads());
    tuning.warnings.extend(hardware.disturbed());
    Some((tuning, sound))
}

/// Measures what the model reads, of the machine as the registry uses it.
///
/// What a start measured that was stopped is taken from the cache, and what this one measures is kept there until it has a tuning.
fn hardware(
    options: &StartOptions,
    registry: &Registry,
    model: &Model,
    pace: &Arc<AtomicBool>,
    remarks: &mut Vec<String>,
) -> Hardware {
    let threads = registry.available().iter().map(|e| e.id.threads()).max();
    let (limit, stop) = (Some(options.probe_limit), Some(Arc::clone(pace)));
    let plan = measure::Options { threads, limit, stop, ..measure::Options::default() };
    let mut hardware = measure::hardware_for(&model.parameters(), &plan);
    let simd = registry.simd();
    if let Some(lanes) = hardware.parameters.iter_mut().find(|p| p.name == ParameterId::SimdLanes) {
        *lanes = Parameter::reported(ParameterId::SimdLanes, f64::from(simd.lanes()), "the SIMD level of the registry");
    }
    hardware.machine.simd = simd.to_string();
    #[cfg(feature = "measure-gpu")]
    let gpus = registry.source::<crate::gpu::Gpus>().cloned().unwrap_or_default();
    #[cfg(feature = "measure-gpu")]
    for index in gpus.identities().map(|g| g.index) {
        if plan.is_stopped() {
            break;
        }
        match measure::gpu(&gpus, index, &plan) {
            Ok(gpu) => hardware.gpus.push(gpu),
            Err(why) => remarks.push(format!("gpu{index} can't be measured: {why}")),
        }
    }
    #[cfg(not(feature = "measure-gpu"))]
    let _ = remarks;
    hardware
}

/// An error with what caused it, in one line.
fn with_cause(error: impl std::error::Error) -> String {
    error.source().map_or_else(|| error.to_string(), |source| format!("{error}: {source}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hardware::Machine;

    #[test]
    fn no_thread_is_pinned_unless_asked() {
        assert_eq!(usual_registry(false).helpers(), "free");
    }

    #[test]
    fn a_figure_that_can_not_be_costs_what_needs_it_and_no_more() {
        let model = Model::built_in().unwrap();
        let figure = |&name: &ParameterId| match name {
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
        let broken = |name: &ParameterId| {
            let (mut broken, mut remarks) = (hardware.clone(), Vec::new());
            broken.parameters.iter_mut().filter(|p| p.name == *name).for_each(|p| p.value = Some(0.0));
            let (tuning, sound) = predict(&model, broken, &algorithms, &mut remarks)?;
            (tuning.costs.len() < algorithms.len()).then_some((*name, tuning, sound, remarks))
        };
        let (name, tuning, sound, remarks) =
            model.parameters().iter().find_map(broken).expect("some methods need what others do not");
        assert!(!sound && !tuning.costs.is_empty());
        assert!(remarks.len() == 1 && remarks[0].contains(&format!("{name} is 0")), "{remarks:?}");
    }
}
