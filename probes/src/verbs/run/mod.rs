//! `sapwise run`: the adaptive choice on a stream of frames, beside every fixed algorithm.

mod text;
mod tuning;

use crate::algorithms::Algorithms;
use crate::args::{Run, Scene};
use crate::exit::{Outcome, WrongUsage};
use crate::outputs::check_ending;
use crate::replay::{FrameSource, ReplaySettings, Swing, replay, too_wide, write_trace};
use crate::terminal::Terminal;
use crate::{interrupt, output, outputs};
use anyhow::{Context, bail};
use sapwise::algorithm::usable_cores;
use sapwise_lab::text::count;
use sapwise_lab::write::write_text;
use sapwise_scenes::{Frames, Scenario};
use std::ops::Range;
use std::path::{Path, PathBuf};
use text::Answer;

/// Objects of a scenario without `--objects`.
const OBJECTS: u32 = 20_000;
/// Frames of a scenario without `--frames`. Fragmentation has its cycle instead.
const FRAMES: usize = 200;

pub(crate) fn run(arguments: &Run, algorithms: &Algorithms) -> anyhow::Result<Outcome> {
    let mut registry = algorithms.registry(usable_cores());
    registry.pin_threads();
    arguments.trace.as_deref().map_or(Ok(()), |path| check_ending("--trace", path, "csv"))?;
    arguments.plot.as_deref().map_or(Ok(()), |path| check_ending("--plot", path, "svg"))?;
    check_outputs(arguments)?;
    let mut settings = settings(arguments)?;
    let parts = parts(&arguments.after, settings.frames)?;
    let read = arguments.tuning.as_deref().map(|path| tuning::read(path, &registry, &arguments.gpus)).transpose()?;
    // Until here Ctrl-C ends the program, even when it waits for a pipe.
    interrupt::listen()?;
    if let Some(path) = &arguments.record {
        settings.source.record(path, settings.frames)?;
    }
    let recorded = |error: anyhow::Error| match &arguments.record {
        Some(path) => error.context(format!("{} holds the whole recording", path.display())),
        None => error,
    };
    let origin = read.map_or_else(|| tuning::predicted(arguments, algorithms), Ok);
    // Checked before the error of the prediction: an interrupted one may complain about missing measurements.
    interrupt::check().map_err(recorded)?;
    let mut origin = origin?;
    let gpu_warnings = tuning::add_gpus(&mut registry, &origin.tuning, &arguments.gpus)?;
    origin.tuning.warnings.extend(gpu_warnings);
    // Steps have no costs to correct.
    settings.learning &= !origin.tuning.costs.is_empty();
    let hint = "none of the algorithms of the tuning runs here; leave out --tuning to predict for this machine";
    let mut outcome = replay(&settings, &origin.tuning, &registry).map_err(|error| match error.downcast_ref() {
        Some(sapwise::Error::Unavailable { .. } | sapwise::Error::UnknownAlgorithm { .. }) => error.context(hint),
        _ => recorded(error),
    })?;
    origin.tuning.warnings.append(&mut outcome.notes);
    let answer = Answer {
        settings: &settings,
        outcome: &outcome,
        origin: &origin,
        too_wide: too_wide(&origin.tuning, &registry),
        whole: outcome.part(0..settings.frames),
        parts: parts.into_iter().map(|range| outcome.part(range)).collect(),
    };
    if let Some(path) = &arguments.trace {
        write_trace(path, &outcome)?;
    }
    if let Some(path) = &arguments.plot {
        write_text(path, &outcome.picture(settings.source.name(), answer.caption()).svg()?)?;
    }
    let text = || answer.text(arguments, Terminal::of_standard_output());
    let done = output::answer(arguments.json, &answer.json()?, text)?;
    Ok(if outcome.interrupted { Outcome::Failed } else { done })
}

/// Refuses outputs that can't be written, before the run.
///
/// # Errors
/// Names the file.
fn check_outputs(arguments: &Run) -> anyhow::Result<()> {
    let mut read: Vec<PathBuf> = arguments.tuning.iter().cloned().collect();
    if let Scene::Stream(path) = &arguments.scene {
        read.push(path.clone());
    }
    let outputs = [&arguments.record, &arguments.trace, &arguments.plot];
    let outputs: Vec<&PathBuf> = outputs.into_iter().flatten().collect();
    outputs::check(&read, &outputs)
}

/// Returns the settings of the replay.
///
/// # Errors
/// When the stream can't be read, has no frames or an unsound one, or gets options that only a scenario has.
fn settings(arguments: &Run) -> anyhow::Result<ReplaySettings> {
    let asked = arguments.frames.map(|frames| frames as usize);
    let (source, frames) = match &arguments.scene {
        Scene::Scenario(scenario) => {
            let objects = arguments.objects.unwrap_or(OBJECTS) as usize;
            let usual =
                if *scenario == Scenario::Fragmentation { Scenario::FRAGMENTATION_FRAMES as usize } else { FRAMES };
            let frames = asked.unwrap_or(usual);
            if let Some(least) = arguments.swing.filter(|&least| least as usize > objects) {
                let objects = count(objects, "object");
                bail!(WrongUsage(format!("--swing {least}: more than the {objects}; raise --objects")));
            }
            let swing = arguments.swing.map(|least| Swing { least: least as usize, frames });
            (FrameSource::Scene { scenario: *scenario, objects, seed: arguments.seed, swing }, frames)
        }
        Scene::Stream(path) => {
            let given = [arguments.objects.is_some(), arguments.swing.is_some(), arguments.record.is_some()];
            if let Some((option, _)) = ["--objects", "--swing", "--record"].iter().zip(given).find(|(_, given)| *given)
            {
                bail!(WrongUsage(format!("{option}: {} is a stream, whose boxes are recorded", path.display())));
            }
            let frames = read_stream(path)?;
            let own = frames.len();
            if let Some(asked) = asked.filter(|&asked| asked > own) {
                let why = format!("--frames {asked}: {} has {}; ask for no more", path.display(), count(own, "frame"));
                bail!(WrongUsage(why));
            }
            let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
            (FrameSource::Stream { name, frames }, asked.unwrap_or(own))
        }
    };
    Ok(ReplaySettings {
        source,
        frames,
        repeats: arguments.repeats as usize,
        seed: arguments.seed,
        learning: !arguments.no_learning,
    })
}

fn read_stream(path: &Path) -> anyhow::Result<Frames> {
    let frames = Frames::read(path)?;
    frames.check().with_context(|| format!("{} can't be run", path.display()))?;
    if frames.is_empty() {
        bail!("{} has no frames; `sapwise run SCENARIO --record S.npy` shows how a stream looks", path.display());
    }
    Ok(frames)
}

/// The frames between those of `--after`; none without that option.
///
/// # Errors
/// When one of them lies outside of the run.
fn parts(after: &[usize], frames: usize) -> Result<Vec<Range<usize>>, WrongUsage> {
    if let Some(wrong) = after.iter().find(|after| !(1..frames).contains(after)) {
        let last = frames - 1;
        return Err(WrongUsage(format!("--after {wrong}: give a frame from 1 to {last}, or more --frames")));
    }
    let mut ends = [after, &[0, frames]].concat();
    ends.sort_unstable();
    ends.dedup();
    let parts = ends.windows(2).map(|w| w[0]..w[1]);
    Ok(if after.is_empty() { Vec::new() } else { parts.collect() })
}
