//! A tuning for this machine: from the cache, else measured and predicted.

mod cache;
mod options;
mod slice;

pub use options::StartOptions;

use crate::hardware::{GpuHardware, Hardware, Parameter, ParameterId};
use crate::measure;
use crate::model::Model;
use cache::CacheFile;
use sapwise::algorithm::Entry;
use sapwise::internals::{Arrival, Background, Instances, Origin, Start};
use sapwise::{Adaptive, Error, Registry, Tuning};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant, SystemTime};

/// Returns an adaptive broad phase with the tuning of this machine: from the cache, else predicted from hardware
/// parameters that it measures in two seconds and kept for the next start.
///
/// By default a background thread does this, and [`Tuning::usual`] decides until it is done. Dropping the broad
/// phase ends the thread and waits for it, two seconds at most. A measurement uses all cores and needs a quiet
/// machine.
///
/// A kept tuning holds for this machine, its drivers, this version of the library, its algorithms and the
/// built-in model; when one of them changes or the measurement is [too old](StartOptions::max_age), the next
/// start measures again. A cache that can't be read or written stops nothing: [`Adaptive::setup`] says so.
///
/// A program of many processes measures in one of them and hands the [tuning](Adaptive::tuning) to the others, which
/// pass it to [`Adaptive::new`]. Otherwise each process measures, and they disturb each other.
///
/// # Errors
/// [`Error::Unavailable`] or [`Error::UnknownAlgorithm`] when no algorithm of the usual tuning can be made.
pub fn for_this_machine(options: &StartOptions) -> Result<Adaptive, Error> {
    let began = Instant::now();
    if options.background {
        return in_background(options, began);
    }
    let registry = options.registry.clone().unwrap_or_else(|| Arc::new(usual_registry()));
    let (start, tuning) = arrive(options, &registry, began, Arc::default());
    let mut adaptive = match tuning {
        Some((tuning, made)) => Adaptive::with(tuning, made),
        None => Adaptive::new(Tuning::usual(&registry), &registry)?,
    };
    adaptive.set_start(start);
    Ok(adaptive)
}

/// Starts with the usual tuning and a thread that brings the predicted one.
fn in_background(options: &StartOptions, began: Instant) -> Result<Adaptive, Error> {
    // Without GPUs: loading their drivers takes tens of milliseconds.
    let registry = options.registry.clone().unwrap_or_else(|| Arc::new(Registry::new()));
    let mut adaptive = Adaptive::new(Tuning::usual(&registry), &registry)?;
    let stop = Arc::<AtomicBool>::default();
    let (options, told) = (options.clone(), Arc::clone(&stop));
    let run = move || {
        let registry = options.registry.clone().unwrap_or_else(|| Arc::new(usual_registry()));
        arrive(&options, &registry, began, told)
    };
    let thread = std::thread::Builder::new().name("sapwise-setup".to_owned()).spawn(run);
    let (origin, remarks) = match &thread {
        Ok(_) => (Origin::Awaited, Vec::new()),
        Err(e) => (Origin::Usual, vec![format!("no background thread can be started ({e}): the usual tuning stays")]),
    };
    let background = thread.ok().map(|thread| Background { thread: Some(thread), stop });
    let mut start = Start { background, ..Start::default() };
    (start.setup.origin, start.setup.remarks) = (origin, remarks);
    adaptive.set_start(start);
    Ok(adaptive)
}

/// The algorithms of a program that names none.
fn usual_registry() -> Registry {
    #[cfg_attr(not(feature = "gpu"), expect(unused_mut, reason = "there is nothing to add"))]
    let mut registry = Registry::new();
    #[cfg(feature = "gpu")]
    sapwise_gpu::add_to(
        &mut registry,
        &sapwise_gpu::Gpus::find().choose(|gpu| gpu.kind != sapwise_gpu::GpuKind::Software),
    );
    registry
}

/// Finds the tuning of this machine and makes its algorithms.
fn arrive(options: &StartOptions, registry: &Registry, began: Instant, stop: Arc<AtomicBool>) -> Arrival {
    let mut remarks = Vec::new();
    let found = find(options, registry, &stop, &mut remarks);
    let mut arrival = arrival(found, registry, remarks);
    arrival.0.setup.seconds = began.elapsed().as_secs_f64();
    arrival
}

/// Makes the algorithms of a tuning that was found.
fn arrival(found: Option<Found>, registry: &Registry, remarks: Vec<String>) -> Arrival {
    let mut start = Start::default();
    (start.setup.origin, start.setup.remarks) = (Origin::Usual, remarks);
    let Some(Found { tuning, origin, measured, file, sound }) = found else { return (start, None) };
    let tuning = tuning.for_running();
    let mut made = Instances::of(&tuning, registry);
    if let Some(e) = made.failure() {
        start.setup.remarks.push(format!("no algorithm of the predicted tuning can be made: {e:#}"));
        return (start, None);
    }
    start.setup.origin = origin;
    start.setup.file = file.as_ref().filter(|_| sound).map(|file| file.path.clone());
    start.save = file.map(|file| {
        let write =
            move |learned: &Tuning| if sound { file.write(learned, measured).map(|()| true) } else { Ok(false) };
        Arc::new(write) as _
    });
    (start, Some((tuning, made)))
}

/// A tuning of this machine.
struct Found {
    tuning: Tuning,
    origin: Origin,
    measured: SystemTime,
    /// Where it is kept, if there is a cache.
    file: Option<CacheFile>,
    /// Whether it may be kept: it follows from no impossible value.
    sound: bool,
}

/// Reads the cache, else measures and predicts. An old tuning is used if that brings nothing better.
fn find(
    options: &StartOptions,
    registry: &Registry,
    stop: &Arc<AtomicBool>,
    remarks: &mut Vec<String>,
) -> Option<Found> {
    let model = Model::built_in().map_err(|e| remarks.push(format!("the built-in model can't be read: {e}"))).ok()?;
    let file = options.cache.as_ref().map(|folder| CacheFile::new(folder, registry));
    let kept = file.as_ref().map_or(Ok(None), CacheFile::read).unwrap_or_else(|why| {
        remarks.push(why);
        None
    });
    let kept = kept.map(|(tuning, measured)| {
        let (origin, file) = (Origin::Cached, file.clone());
        Found { tuning, origin, measured, file, sound: true }
    });
    // A clock that was set back makes nothing old.
    let age = |kept: &Found| kept.measured.elapsed().unwrap_or_default();
    let Some(limit) = options.measure else {
        if kept.is_none() {
            remarks.push("no tuning of this machine is kept, and measuring is off".to_owned());
        }
        return kept;
    };
    if kept.as_ref().is_some_and(|kept| age(kept) <= options.max_age) {
        return kept;
    }
    let hardware = hardware(limit, registry, &model, stop, remarks);
    if stop.load(Ordering::Relaxed) {
        return None;
    }
    let predicted = predict(&model, hardware, &registry.available(), remarks);
    let Some((tuning, sound)) = predicted.filter(|(_, sound)| *sound || kept.is_none()) else { return kept };
    let measured = SystemTime::now();
    // A prediction from an impossible value is used, but not kept.
    if let Some(Err(e)) = file.as_ref().filter(|_| sound).map(|file| file.write(&tuning, measured)) {
        let cause = std::error::Error::source(&e).map_or(String::new(), |cause| format!(": {cause}"));
        remarks.push(format!("{e}{cause}"));
    }
    Some(Found { tuning, origin: Origin::Probed, measured, file, sound })
}

/// Predicts without the values and the GPUs that are impossible, and returns whether there was none of these.
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

/// Measures what the model reads, with the threads, the SIMD level and the GPUs of the registry.
fn hardware(
    limit: Duration,
    registry: &Registry,
    model: &Model,
    stop: &Arc<AtomicBool>,
    remarks: &mut Vec<String>,
) -> Hardware {
    let threads = registry.available().iter().map(|e| e.id.threads()).max();
    let stop = Some(Arc::clone(stop));
    let plan = measure::Options { threads, limit: Some(limit), stop, ..measure::Options::default() };
    let mut hardware = measure::hardware_for(&model.parameters(), &plan);
    let simd = registry.simd();
    if let Some(lanes) = hardware.parameters.iter_mut().find(|p| p.name == ParameterId::SimdLanes) {
        *lanes = Parameter::reported(ParameterId::SimdLanes, f64::from(simd.lanes()), "the SIMD level of the registry");
    }
    hardware.machine.simd = simd.to_string();
    #[cfg(feature = "gpu")]
    let gpus = registry.source::<sapwise_gpu::Gpus>().cloned().unwrap_or_default();
    #[cfg(feature = "gpu")]
    for index in gpus.identities().map(|g| g.index).take_while(|_| !plan.is_stopped()) {
        match measure::gpu(&gpus, index, &plan) {
            Ok(gpu) => hardware.gpus.push(gpu),
            Err(why) => remarks.push(format!("gpu{index} can't be measured: {why}")),
        }
    }
    #[cfg(not(feature = "gpu"))]
    let _ = remarks;
    hardware
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hardware::Machine;

    #[test]
    fn no_thread_is_pinned_unless_asked() {
        assert_eq!(usual_registry().helpers(), "free");
    }

    #[test]
    fn a_tuning_from_an_impossible_value_is_not_saved() {
        let (registry, folder) = (Registry::with_cores(1), tempfile::tempdir().unwrap());
        for sound in [false, true] {
            let file = CacheFile::new(folder.path(), &registry);
            let (tuning, path) = (Tuning::usual(&registry), file.path.clone());
            let file = Some(file);
            let found = Found { tuning, origin: Origin::Probed, measured: SystemTime::now(), file, sound };
            let (start, tuning) = arrival(Some(found), &registry, Vec::new());
            let (tuning, made) = tuning.unwrap();
            let mut adaptive = Adaptive::with(tuning, made);
            adaptive.set_start(start);
            assert_eq!((adaptive.save().unwrap(), path.exists()), (sound, sound));
            assert_eq!(adaptive.setup().file, sound.then_some(path));
        }
    }

    #[test]
    fn an_impossible_value_costs_only_what_needs_it() {
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
