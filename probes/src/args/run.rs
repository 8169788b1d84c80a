//! The options of `sapwise run`.

use super::known;
use crate::gpus::GpuChoice;
use crate::replay::CoRunner;
use clap::Args;
use sapwise_scenes::Scenario;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Runs a scenario, or a recorded stream of boxes, with the adaptive choice and with every fixed algorithm, and compares their times.
///
/// All of them run on the same frames in turn, so that a machine that slows down slows all of them, and start every repeat without what
/// they kept. Between two turns other work is done, as a program does between two frames. Times are medians over the repeats. They are compared with an oracle that runs the best algorithm of every frame, chosen on
/// one half of the repeats and timed on the other: the minimum of many noisy times would be less than any algorithm takes.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  sapwise run fragmentation
  sapwise run fragmentation --tuning report.json --plot run.svg    # a tuning that was measured on this machine
  sapwise run fragmentation --tuning elsewhere.json --after 300    # the tuning of another machine, corrected by learning
  sapwise run clustered --swing 50 --frames 600                    # the number of objects grows and shrinks
  sapwise run uniform --frames 900 --co-runner 450 --trace run.csv
  sapwise run clustered --objects 50000 --frames 100 --record clustered.npy --json
  sapwise run clustered.npy --no-learning              # the pure prediction, on a recorded stream")]
pub(crate) struct Run {
    /// The scenario; or a stream of your own frames: an .npy file of 32-bit floats of shape frames x n x 6, each row a box: min x y z, max x
    /// y z. Rows of NaN at the end of a frame are absent boxes.
    #[arg(value_name = "SCENARIO|BOXES.npy", value_parser = known::scenario_or(|text: &str| text.parse::<Scene>()))]
    pub(crate) scene: Scene,
    /// A tuning file, or a report to compute a tuning from. The tuning of another machine shows how learning corrects it. Without this option
    /// the tuning is predicted from this machine's hardware.
    #[arg(long, value_name = "T.json")]
    pub(crate) tuning: Option<PathBuf>,
    /// Do not correct the expected costs by the times of the frames.
    #[arg(long)]
    pub(crate) no_learning: bool,
    /// Never run another algorithm than the cheapest to learn what it costs.
    #[arg(long)]
    pub(crate) no_exploring: bool,
    /// Objects; in fragmentation the largest number of them. Without this option 20 000. A stream has its own.
    #[arg(long, value_name = "N", value_parser = known::whole(1..=10_000_000), allow_negative_numbers = true)]
    pub(crate) objects: Option<u32>,
    /// Let the number of objects grow from this one up to --objects and back over the frames.
    #[arg(long, value_name = "LEAST", value_parser = known::whole(1..=10_000_000), allow_negative_numbers = true)]
    pub(crate) swing: Option<u32>,
    /// Frames. Without this option 200, in fragmentation one cycle of 600, of a stream all.
    #[arg(long, value_name = "F", value_parser = known::whole(1..=1_000_000), allow_negative_numbers = true)]
    pub(crate) frames: Option<u32>,
    /// How often the whole simulation is run. With one, the oracle has the least time of every frame.
    #[arg(long, value_name = "R", default_value_t = 6, value_parser = known::whole(1..=1000), allow_negative_numbers = true)]
    pub(crate) repeats: u32,
    /// Seed of the scene and of the order in which algorithms run.
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Show the figures before this frame and from it on apart; several with commas between. Without this option 300, the frames that
    /// learning may take, and the frame of the co-runner.
    #[arg(long, value_name = "FRAME", value_delimiter = ',')]
    pub(crate) after: Vec<usize>,
    /// From this frame on run threads, one for each core or THREADS, that take three eighths of the CPU, so that everything takes about 1.6
    /// times as long. The slowdown that was reached is printed.
    #[arg(long, value_name = "FRAME[:THREADS]")]
    pub(crate) co_runner: Option<CoRunner>,
    #[command(flatten)]
    pub(crate) gpus: GpuChoice,
    /// Write the frames as a stream before they are run. `run` and `pairs` read it.
    #[arg(long, value_name = "S.npy")]
    pub(crate) record: Option<PathBuf>,
    /// Where a table goes with one row per frame: load, decision, expected and measured times, the time of every algorithm. A file that ends
    /// in .csv.
    #[arg(long, value_name = "T.csv")]
    pub(crate) trace: Option<PathBuf>,
    /// Where an SVG goes: the time of each frame by the adaptive choice and by every algorithm, and which one was chosen.
    #[arg(long, value_name = "P.svg")]
    pub(crate) plot: Option<PathBuf>,
    /// One JSON object on standard output instead of a table.
    #[arg(long)]
    pub(crate) json: bool,
}

/// What `run` runs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Scene {
    Scenario(Scenario),
    Stream(PathBuf),
}

impl FromStr for Scene {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let path = Path::new(text);
        match text.parse() {
            Ok(scenario) => Ok(Self::Scenario(scenario)),
            // A file that is missing or of another format is reported by the code that reads it.
            Err(_) if path.extension().is_some_and(|e| e == "npy") || path.exists() => {
                Ok(Self::Stream(path.to_owned()))
            }
            Err(why) => Err(format!("{why}; or name a file of boxes, as `--record S.npy` writes it")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_is_a_scenario_or_a_file() {
        let read = |text: &str| text.parse::<Scene>();
        assert_eq!(read("slab"), Ok(Scene::Scenario(Scenario::Slab)));
        assert_eq!(read("missing.npy"), Ok(Scene::Stream("missing.npy".into())));
        assert!(read("Cargo.toml").is_ok_and(|s| matches!(s, Scene::Stream(_))));
        let why = read("slap").unwrap_err();
        assert!(why.contains("no scenario") && why.contains("slab") && why.contains("name a file of boxes"), "{why}");
    }
}
