//! Runs the simulation and compares the broad phases in every frame; see the library of this package.

use sapwise::Registry;
use sapwise_example_rapier3d::{Comparison, Counts, Recording, Settings, World};
use std::collections::BTreeMap;
use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::PathBuf;
use std::process::ExitCode;

const USAGE: &str = "\
Bodies that fall, collide and break into pieces in rapier3d; a Space of Sapwise follows their boxes, and
its pairs are compared with those of rapier's own broad phase in every frame.

usage: cargo run --release -p sapwise-example-rapier3d -- [OPTIONS]

  --frames N     frames of a sixtieth of a second; 600 unless told otherwise
  --bodies N     the most bodies at once; 1000 unless told otherwise
  --seed N       of places, velocities and bursts; 1 unless told otherwise
  --record FILE  writes the boxes of all frames as frames x boxes x 6 float32 (.npy), for `sapwise run FILE` and
                 `sapwise pairs FILE`; a frame with fewer boxes than the fullest ends in rows of NaN
  --quiet        prints the last line only

example: cargo run --release -p sapwise-example-rapier3d -- --frames 300 --bodies 100 --record stream.npy";

/// Frames from one line of the output to the next.
const LINE_EVERY: usize = 60;

struct Options {
    frames: usize,
    settings: Settings,
    record: Option<PathBuf>,
    quiet: bool,
}

/// The options, or `None` where help was asked for.
fn options(mut arguments: impl Iterator<Item = String>) -> Result<Option<Options>, String> {
    let settings = Settings { bodies: 1000, seed: 1 };
    let mut options = Options { frames: 600, settings, record: None, quiet: false };
    while let Some(option) = arguments.next() {
        let mut value = || arguments.next().ok_or_else(|| format!("{option} needs a value"));
        let number = |text: String| text.parse::<u64>().map_err(|e| format!("{text:?} is no number: {e}"));
        match option.as_str() {
            "--frames" => options.frames = number(value()?)? as usize,
            "--bodies" => options.settings.bodies = number(value()?)? as usize,
            "--seed" => options.settings.seed = number(value()?)?,
            "--record" => options.record = Some(value()?.into()),
            "--quiet" => options.quiet = true,
            "--help" | "-h" => return Ok(None),
            other => return Err(format!("there is no option {other}")),
        }
    }
    Ok(Some(options))
}

fn run(options: &Options) -> Result<(), Box<dyn Error>> {
    let mut world = World::new(options.settings);
    let mut comparison = Comparison::new(&Registry::new())?;
    let mut recording = Recording::default();
    let mut ran: BTreeMap<String, usize> = BTreeMap::new();
    let (mut least, mut most, mut pairs) = (usize::MAX, 0, 0);
    if !options.quiet {
        let [frame, bodies, boxes, pairs] = ["frame", "bodies", "boxes", "pairs"];
        println!(
            "{frame:>6} {bodies:>7} {boxes:>7} {pairs:>7} {:>7} {:>7} {:>9}  algorithm",
            "begun", "ended", "rapier's"
        );
    }
    for frame in 0..options.frames {
        world.prepare_step();
        comparison.before_step(world.physics())?;
        world.step();
        let counts = comparison.after_step(world.physics())?;
        (least, most) = (least.min(counts.boxes), most.max(counts.boxes));
        pairs += counts.rapier;
        let algorithm = comparison.last_decision().map_or(String::new(), |d| d.algorithm.to_string());
        if !options.quiet && frame % LINE_EVERY == 0 {
            let bodies = world.bodies();
            let Counts { boxes, found, begun, ended, rapier, .. } = counts;
            println!("{frame:>6} {bodies:>7} {boxes:>7} {found:>7} {begun:>7} {ended:>7} {rapier:>9}  {algorithm}");
        }
        *ran.entry(algorithm).or_default() += 1;
        if options.record.is_some() {
            recording.push(&comparison.boxes(world.physics()));
        }
    }
    if let Some(path) = &options.record {
        let mut out = BufWriter::new(File::create(path).map_err(|e| format!("can't write {}: {e}", path.display()))?);
        recording.write_npy(&mut out)?;
        out.flush()?;
    }
    let ran: Vec<String> = ran.iter().map(|(algorithm, frames)| format!("{algorithm} in {frames}")).collect();
    println!(
        "{} frames of {least} to {most} boxes: the same {pairs} pairs as rapier's broad phase, found by {}",
        options.frames,
        ran.join(", ")
    );
    Ok(())
}

fn main() -> ExitCode {
    let options = match options(std::env::args().skip(1)) {
        Ok(Some(options)) if options.frames > 0 => options,
        Ok(Some(_)) => {
            eprintln!("error: no frame to run; --frames takes 1 or more");
            return ExitCode::from(2);
        }
        Ok(None) => {
            println!("{USAGE}");
            return ExitCode::SUCCESS;
        }
        Err(error) => {
            eprintln!("error: {error}\n\n{USAGE}");
            return ExitCode::from(2);
        }
    };
    match run(&options) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
