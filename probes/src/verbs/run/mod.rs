//! `sapwise run`: the adaptive choice on a stream of frames, beside every fixed algorithm.

mod answer;
mod text;
mod tuning;

use crate::algorithms::Algorithms;
use crate::args::{Run, Scene};
use crate::exit::{Outcome, WrongUsage};
use crate::outputs::check_picture;
use crate::replay::{FrameSource, ReplaySettings, Swing, check_trace, picture, replay, too_wide, write_trace};
use crate::terminal::Terminal;
use crate::{interrupt, output, outputs};
use anyhow::{Context, bail};
use sapwise::usable_cores;
use sapwise_lab::text::count;
use sapwise_lab::write::write_text;
use sapwise_scenes::{Frames, Scenario};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Objects of a scenario where nothing is said.
const OBJECTS: u32 = 20_000;
/// Frames of a scenario where nothing is said, but for fragmentation, whose cycle they are.
const FRAMES: usize = 200;
/// Frames that learning may take before the figures count: five seconds of a game.
const LEARNED_BY: usize = 300;

pub(crate) fn run(arguments: &Run, algorithms: &Algorithms) -> anyhow::Result<Outcome> {
    let mut registry = algorithms.registry(usable_cores());
    registry.pin_threads();
    arguments.trace.as_deref().map_or(Ok(()), check_trace)?;
    arguments.plot.as_deref().map_or(Ok(()), check_picture)?;
    check_outputs(arguments)?;
    let mut settings = settings(arguments)?;
    let cuts = cuts(arguments, settings.frames)?;
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
    // First: a prediction that was interrupted may complain of what was not measured.
    interrupt::check().map_err(recorded)?;
    let mut origin = origin?;
    let gpu_warnings = tuning::add_gpus(&mut registry, &origin.tuning, &arguments.gpus)?;
    origin.tuning.warnings.extend(gpu_warnings);
    // Steps have no costs to correct.
    settings.learning &= !origin.tuning.costs.is_empty();
    settings.exploring &= settings.learning;
    let hint = "none of the algorithms of the tuning runs here; leave out --tuning to predict for this machine";
    let mut outcome = replay(&settings, &origin.tuning, &registry).map_err(|error| match error.downcast_ref() {
        Some(sapwise::Error::Unavailable { .. } | sapwise::Error::UnknownAlgorithm { .. }) => error.context(hint),
        _ => recorded(error),
    })?;
    origin.tuning.warnings.append(&mut outcome.notes);
    let segments: Vec<_> = segments(&cuts, settings.frames).into_iter().map(|range| outcome.part(range)).collect();
    let answer = answer::Answer::new(&settings, &outcome, &origin, too_wide(&origin.tuning, &registry), &segments);
    if let Some(path) = &arguments.trace {
        write_trace(path, &outcome)?;
    }
    if let Some(path) = &arguments.plot {
        write_text(path, &picture(&settings, &outcome, text::caption(arguments, &answer, &origin)).svg()?)?;
    }
    if arguments.json {
        output::print_json(&answer)?;
    } else {
        output::print(&text::text(arguments, &answer, &origin, Terminal::of_standard_output()))?;
    }
    Ok(if outcome.interrupted { Outcome::Failed } else { Outcome::Done })
}

/// Refuses what can't be written: after the run its figures would be lost with the file.
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

/// What to replay.
///
/// # Errors
/// When the stream can't be read, holds what no algorithm takes, or is asked for what only a scenario has.
fn settings(arguments: &Run) -> anyhow::Result<ReplaySettings> {
    let asked = arguments.frames.map(|frames| frames as usize);
    let (source, frames) = match &arguments.scene {
        Scene::Scenario(scenario) => {
            let objects = arguments.objects.unwrap_or(OBJECTS) as usize;
            let usual =
                if *scenario == Scenario::Fragmentation { Scenario::FRAGMENTATION_FRAMES as usize } else { FRAMES };
            let frames = asked.unwrap_or(usual);
            if let Some(least) = arguments.swing.filter(|&least| least as usize > objects) {
                return Err(WrongUsage(format!(
                    "--swing {least}: more than the {}; raise --objects",
                    count(objects, "object")
                ))
                .into());
            }
            let swing = arguments.swing.map(|least| Swing { least: least as usize, frames });
            (FrameSource::Scene { scenario: *scenario, objects, seed: arguments.seed, swing }, frames)
        }
        Scene::Stream(path) => {
            let wrong = |what: &str| {
                Err(WrongUsage(format!("{what}: {} is a stream, whose boxes are recorded", path.display())))
            };
            if arguments.objects.is_some() {
                wrong("--objects")?;
            }
            if arguments.swing.is_some() {
                wrong("--swing")?;
            }
            if arguments.record.is_some() {
                wrong("--record")?;
            }
            let frames = read_stream(path)?;
            let own = frames.len();
            if let Some(asked) = asked.filter(|&asked| asked > own) {
                let why = format!("--frames {asked}: {} has {}; ask for no more", path.display(), count(own, "frame"));
                return Err(WrongUsage(why).into());
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
        exploring: !arguments.no_exploring,
        co_runner: arguments.co_runner,
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

/// The frames at which a segment ends and another begins, ascending.
///
/// # Errors
/// When one lies outside of the run.
fn cuts(arguments: &Run, frames: usize) -> Result<Vec<usize>, WrongUsage> {
    let within = |option: &str, frame: usize, first: usize| {
        if (first..frames).contains(&frame) {
            return Ok(());
        }
        let last = frames - 1;
        Err(WrongUsage(format!("{option} {frame}: give a frame from {first} to {last}, or more --frames")))
    };
    arguments.after.iter().try_for_each(|&frame| within("--after", frame, 1))?;
    let from = arguments.co_runner.map(|c| c.from_frame);
    from.map_or(Ok(()), |frame| within("--co-runner", frame, 0))?;
    let mut cuts = arguments.after.clone();
    if cuts.is_empty() && !arguments.no_learning {
        cuts.push(from.unwrap_or(0) + LEARNED_BY);
    }
    cuts.extend(from);
    cuts.retain(|cut| (1..frames).contains(cut));
    cuts.sort_unstable();
    cuts.dedup();
    Ok(cuts)
}

/// The segments between the cuts; none where there is no cut.
fn segments(cuts: &[usize], frames: usize) -> Vec<Range<usize>> {
    if cuts.is_empty() {
        return Vec::new();
    }
    let ends = cuts.iter().copied().chain([frames]);
    [0].iter().chain(cuts).copied().zip(ends).map(|(from, to)| from..to).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    fn arguments(words: &[&str]) -> Run {
        let words = ["sapwise", "run", "uniform"].iter().chain(words);
        match crate::args::Arguments::parse_from(words).verb {
            crate::args::Verb::Run(run) => run,
            _ => panic!("another verb"),
        }
    }

    #[test]
    fn segments_lie_between_the_cuts() {
        let cuts = |words: &[&str], frames| cuts(&arguments(words), frames).unwrap();
        assert_eq!(cuts(&[], 200), [0; 0]);
        assert_eq!(cuts(&[], 301), [300]);
        assert_eq!(cuts(&["--no-learning"], 900), [0; 0]);
        assert_eq!(cuts(&["--after", "50,20", "--after", "50"], 200), [20, 50]);
        assert_eq!(cuts(&["--co-runner", "450"], 900), [450, 750]);
        assert_eq!(cuts(&["--co-runner", "0"], 900), [300]);
        assert_eq!(cuts(&["--co-runner", "450:1", "--after", "100", "--no-learning"], 900), [100, 450]);
        assert_eq!(segments(&[20, 50], 200), [0..20, 20..50, 50..200]);
        assert!(segments(&[], 200).is_empty());
    }

    #[test]
    fn frames_beyond_the_end_are_refused() {
        for words in [["--after", "200"], ["--after", "0"], ["--co-runner", "200"]] {
            let why = cuts(&arguments(&words), 200).unwrap_err().to_string();
            assert!(why.contains(words[0]) && why.contains("to 199"), "{why}");
        }
    }
}
