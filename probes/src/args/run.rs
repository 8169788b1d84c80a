//! The options of `sapwise run`.

use super::known;
use crate::gpus::GpuChoice;
use clap::Args;
use sapwise_scenes::Scenario;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Runs a scenario, or a recorded stream of boxes, with the adaptive choice and with every fixed algorithm.
///
/// At each frame all of them take turns in random order, with other work between two turns. Every repeat starts with
/// fresh algorithms; times are medians over the repeats. The adaptive choice is compared with the best single
/// algorithm and with an oracle that runs the best algorithm of every 32 frames.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  sapwise run fragmentation
  sapwise run fragmentation --tuning report.json --plot run.svg    # a tuning that was measured on this machine
  sapwise run fragmentation --tuning elsewhere.json --after 300    # of another machine, corrected by frames
  sapwise run clustered --swing 50 --frames 600 --trace run.csv    # the number of objects grows and shrinks
  sapwise run clustered --objects 50000 --frames 100 --record clustered.npy --json
  sapwise run clustered.npy --no-learning                          # the prediction alone, on a recorded stream")]
pub(crate) struct Run {
    /// The scenario; or a stream: an .npy file of 32-bit floats of shape frames x n x 6, each row a box: min x y z,
    /// max x y z. Rows of NaN at the end of a frame are absent boxes.
    #[arg(value_name = "SCENARIO|BOXES.npy", value_parser = known::Scenarios(|text: &str| text.parse::<Scene>()))]
    pub(crate) scene: Scene,
    /// A tuning file, or a report to compute a tuning from [default: predict from this machine's hardware].
    #[arg(long, value_name = "T.json")]
    pub(crate) tuning: Option<PathBuf>,
    /// Do not correct the expected costs by the times of the frames.
    #[arg(long)]
    pub(crate) no_learning: bool,
    /// Number of objects; in fragmentation the largest [default: 20000]. A stream has its own.
    #[arg(long, value_name = "N", value_parser = known::whole(1..=10_000_000), allow_negative_numbers = true)]
    pub(crate) objects: Option<u32>,
    /// Let the number of objects grow from this one to --objects and shrink back over the frames.
    #[arg(long, value_name = "LEAST", value_parser = known::whole(1..=10_000_000), allow_negative_numbers = true)]
    pub(crate) swing: Option<u32>,
    /// Number of frames [default: 200; in fragmentation one cycle of 600; all of a stream].
    #[arg(long, value_name = "F", value_parser = known::whole(1..=1_000_000), allow_negative_numbers = true)]
    pub(crate) frames: Option<u32>,
    /// How often all frames are run. With one repeat, noise favours the oracle.
    #[arg(
        long,
        value_name = "R",
        default_value_t = 6,
        value_parser = known::whole(1..=1000),
        allow_negative_numbers = true
    )]
    pub(crate) repeats: u32,
    /// Seed of the scene and of the order of turns.
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Show the frames before this one and from it on apart; several with commas between.
    #[arg(long, value_name = "FRAME", value_delimiter = ',')]
    pub(crate) after: Vec<usize>,
    #[command(flatten)]
    pub(crate) gpus: GpuChoice,
    /// Write the frames as a stream before they are run, for `run` and `pairs`.
    #[arg(long, value_name = "S.npy")]
    pub(crate) record: Option<PathBuf>,
    /// Write a table with one row a frame: load, choice, expected and measured times, and the time of every
    /// algorithm.
    #[arg(long, value_name = "T.csv")]
    pub(crate) trace: Option<PathBuf>,
    /// Draw the time of each frame by the choice and by every algorithm, and what was chosen, as SVG.
    #[arg(long, value_name = "P.svg")]
    pub(crate) plot: Option<PathBuf>,
    /// Print one JSON object instead of a table.
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
