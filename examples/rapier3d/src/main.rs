//! Runs the simulation and compares the broad phases in every frame; see the library of this package.

use clap::Parser;
use sapwise::{Aabb, Registry};
use sapwise_example_rapier3d::{Comparison, Counts, Settings, World};
use sapwise_scenes::FrameWriter;
use std::collections::BTreeMap;
use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::PathBuf;

/// Bodies that fall, collide and break into pieces in rapier3d; a Space of Sapwise follows their boxes, and its pairs
/// are compared with those of rapier's own broad phase in every frame.
#[derive(Parser)]
struct Options {
    /// Frames of a sixtieth of a second.
    #[arg(long, default_value_t = 600, value_parser = clap::value_parser!(u32).range(1..))]
    frames: u32,
    /// The most bodies at once.
    #[arg(long, default_value_t = 1000)]
    bodies: usize,
    /// Seed of places, velocities and bursts.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Write the boxes of all frames to this .npy file, for `sapwise run` and `sapwise pairs`.
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
}

/// Frames from one line of the output to the next.
const LINE_EVERY: u32 = 60;

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::parse();
    let mut world = World::new(Settings { bodies: options.bodies, seed: options.seed });
    let mut comparison = Comparison::new(&Registry::new())?;
    let mut recorded: Vec<Vec<Aabb>> = Vec::new();
    let mut ran: BTreeMap<String, usize> = BTreeMap::new();
    let (mut least, mut most, mut pairs) = (usize::MAX, 0, 0);
    println!(" frame  bodies   boxes   pairs   begun   ended  rapier's  algorithm");
    for frame in 0..options.frames {
        world.prepare_step();
        comparison.before_step(world.physics())?;
        world.step();
        let counts = comparison.after_step(world.physics())?;
        (least, most) = (least.min(counts.boxes), most.max(counts.boxes));
        pairs += counts.rapier;
        let algorithm = comparison.last_decision().map_or(String::new(), |d| d.algorithm.to_string());
        if frame % LINE_EVERY == 0 {
            let bodies = world.bodies();
            let Counts { boxes, found, begun, ended, rapier, .. } = counts;
            println!("{frame:>6} {bodies:>7} {boxes:>7} {found:>7} {begun:>7} {ended:>7} {rapier:>9}  {algorithm}");
        }
        *ran.entry(algorithm).or_default() += 1;
        if options.record.is_some() {
            recorded.push(comparison.boxes(world.physics()));
        }
    }
    if let Some(path) = &options.record {
        let file = File::create(path).map_err(|e| format!("can't write {}: {e}", path.display()))?;
        let mut out = FrameWriter::new(BufWriter::new(file), recorded.len(), most)?;
        recorded.iter().try_for_each(|boxes| out.write(boxes))?;
        out.finish()?.flush()?;
    }
    let ran: Vec<String> = ran.iter().map(|(algorithm, frames)| format!("{algorithm} in {frames}")).collect();
    println!(
        "{} frames of {least} to {most} boxes: the same {pairs} pairs as rapier's broad phase, found by {}",
        options.frames,
        ran.join(", ")
    );
    Ok(())
}
