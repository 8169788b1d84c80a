//! `sapwise pairs`: the broad phase on the user's own boxes.

use crate::algorithms::Algorithms;
use crate::args::Pairs as Arguments;
use crate::exit::{Outcome, WrongUsage};
use crate::progress::{Progress, Steps as _};
use crate::{gpus, interrupt, output, outputs, shell};
use anyhow::{Context, anyhow};
use sapwise::algorithm::usable_cores;
use sapwise::error::Unavailable;
use sapwise::{AlgorithmId, BroadPhase, Pairs, Registry};
use sapwise_lab::sweep::median;
use sapwise_lab::text::{count, grouped};
use sapwise_lab::write::write_atomically;
use sapwise_scenes::{Frames, write_pairs};
use sapwise_tune::hardware::with_unit;
use serde::Serialize;
use std::time::Instant;

/// The lowest limit on pairs that follows from the free memory: a small scene must always pass.
const FEWEST_PAIRS: usize = 1 << 20;

/// The answer for machines.
#[derive(Serialize)]
struct Answer {
    algorithm: String,
    objects: usize,
    frames: usize,
    /// Of each frame.
    pairs: Vec<u64>,
    median_ms: f64,
    /// Of each frame, repetition after repetition.
    samples_ms: Vec<f64>,
    /// Of the last frame.
    fingerprint: String,
}

pub(crate) fn run(arguments: &Arguments, algorithms: &Algorithms) -> anyhow::Result<Outcome> {
    outputs::check(std::slice::from_ref(&arguments.boxes), &arguments.out.iter().collect::<Vec<_>>())?;
    let mut registry = algorithms.registry(usable_cores());
    registry.pin_threads();
    let id = &arguments.algorithm;
    add_gpus(&mut registry, id)?;
    let frames = Frames::read(&arguments.boxes)?;
    interrupt::listen()?;
    let mut pairs = Pairs::new();
    pairs.set_limit(Some(arguments.limit.unwrap_or_else(|| memory_limit(id.threads()))));
    let mut algorithm = registry.create(id).map_err(|error| refused(id, &error))?;
    let (counts, samples_ns) = measure(arguments, &frames, &mut *algorithm, &mut pairs)?;
    let fingerprint = format!("{:016x}", pairs.fingerprint());
    if let Some(path) = &arguments.out {
        let mut sorted = pairs.as_slice().to_vec();
        sorted.sort_unstable();
        write_atomically(path, |out| Ok(write_pairs(out, &sorted)?))?;
    }
    let median_ns = median(&samples_ns).unwrap_or(0.0);
    let answer = Answer {
        algorithm: id.to_string(),
        objects: frames.objects(),
        frames: frames.len(),
        pairs: counts,
        median_ms: median_ns / 1e6,
        samples_ms: samples_ns.iter().map(|&ns| ns as f64 / 1e6).collect(),
        fingerprint,
    };
    output::answer(arguments.json, &answer, || text(&answer, median_ns) + &next_step(arguments, frames.len()))
}

/// Returns the pairs that fit into half of the free memory: a scene in which all boxes overlap then ends with an error,
/// not with the process killed.
fn memory_limit(threads: u32) -> usize {
    let Ok(mut system) = sysinfo::System::new() else { return FEWEST_PAIRS };
    system.refresh_memory();
    // A cgroup counts its page cache as used memory, though the system would free it.
    let ours = system.cgroup_limits().map_or(u64::MAX, |c| c.total_memory.saturating_sub(c.rss));
    let free = system.available_memory().min(ours);
    // Each thread has eight lists beside the common one, and the output is sorted in a copy.
    let lists = 8 * u64::from(threads) + 2;
    usize::try_from(free / 2 / 8 / lists).unwrap_or(usize::MAX).max(FEWEST_PAIRS)
}

/// Returns why an algorithm can't be created, without the library's advice for programs.
fn refused(id: &AlgorithmId, error: &sapwise::Error) -> WrongUsage {
    match error {
        sapwise::Error::Unavailable { reason: Unavailable::TooFewCores { threads, most }, .. } => WrongUsage(format!(
            "{id} can't run here: it has {threads} threads, and this process may use {}; `sapwise devices` lists what \
             can",
            count(*most as usize, "core")
        )),
        _ => WrongUsage(error.to_string()),
    }
}

/// Adds the algorithms on GPUs if `id` is one.
///
/// # Errors
/// When this machine lacks a GPU of `id`, or its drivers can't be loaded.
fn add_gpus(registry: &mut Registry, id: &AlgorithmId) -> anyhow::Result<()> {
    let indices = gpus::uses(id);
    if indices.is_empty() {
        return Ok(());
    }
    let seen = gpus::look()?;
    if let Some(why) = seen.lacks(indices) {
        return Err(WrongUsage(format!("{id} can't run here: {why}; `sapwise devices` lists what can")).into());
    }
    sapwise_gpu::add_to(registry, &seen.load().map_err(anyhow::Error::msg)?);
    Ok(())
}

/// Returns the number of pairs of each frame, and the nanoseconds of each frame of all repetitions. `pairs` keeps the
/// last frame.
fn measure(
    arguments: &Arguments,
    frames: &Frames,
    algorithm: &mut dyn BroadPhase,
    pairs: &mut Pairs,
) -> anyhow::Result<(Vec<u64>, Vec<u64>)> {
    let progress = Progress::new(frames.len() as u64 * u64::from(arguments.repeat));
    let (mut counts, mut samples) = (Vec::new(), Vec::new());
    for repetition in 0..arguments.repeat {
        for (k, boxes) in frames.iter().enumerate() {
            interrupt::check()?;
            let started = Instant::now();
            let result = algorithm.find_pairs(boxes, pairs);
            samples.push(started.elapsed().as_nanos() as u64);
            let result = match result {
                Err(sapwise::Error::TooManyPairs { limit }) if arguments.limit.is_none() => Err(anyhow!(
                    "more pairs than the {limit} that fit into half of the free memory; set another number with \
                     --limit, or thin out the scene"
                )),
                result => result.map_err(anyhow::Error::from),
            };
            result.with_context(|| format!("{}, frame {k}", arguments.boxes.display()))?;
            if repetition == 0 {
                counts.push(pairs.len() as u64);
            }
            progress.advance(1);
        }
    }
    Ok((counts, samples))
}

fn text(answer: &Answer, median_ns: f64) -> String {
    let Answer { algorithm, objects, frames, pairs, samples_ms, fingerprint, .. } = answer;
    let last = grouped(pairs.last().copied().unwrap_or(0));
    format!(
        "{algorithm}: {} {}, {}\n\
         pairs in the last frame: {last} (fingerprint {fingerprint})\n\
         median of {}: {}",
        grouped(*objects as u64),
        if *objects == 1 { "box" } else { "boxes" },
        count(*frames, "frame"),
        count(samples_ms.len(), "sample"),
        with_unit("_ns", median_ns)
    )
}

/// The next command to try.
fn next_step(arguments: &Arguments, frames: usize) -> String {
    let boxes = shell::path(&arguments.boxes);
    let written = arguments.out.as_ref().map(|path| format!("\nWritten to {}.", path.display())).unwrap_or_default();
    let next = match (&arguments.out, frames) {
        (_, 2..) => format!("run {boxes}"),
        (None, _) => shell::again(&["--out", "pairs.npy"]),
        (Some(_), _) => "devices".to_owned(),
    };
    format!("{written}\n{}", shell::next(&next))
}
