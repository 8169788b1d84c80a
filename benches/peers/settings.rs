//! What is measured, from the environment.

use sapwise_scenes::Scenario;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;

/// Measured beside the hard ones.
const SCENARIOS: [Scenario; 8] = [
    Scenario::Uniform,
    Scenario::Fast,
    Scenario::Clustered,
    Scenario::Slab,
    Scenario::Mixed,
    Scenario::Resting,
    Scenario::Gravity,
    Scenario::Fragmentation,
];

const SIZES: [usize; 9] = [100, 300, 1_000, 3_000, 10_000, 30_000, 100_000, 300_000, 1_000_000];

/// What is measured and for how long.
pub(crate) struct Settings {
    /// Whether figures are wanted; else everything runs for a few frames, to see that all is well.
    pub(crate) full: bool,
    pub(crate) scenarios: Vec<Scenario>,
    /// Numbers of objects, ascending.
    pub(crate) sizes: Vec<usize>,
    pub(crate) threads: Vec<u32>,
    /// Time for the timed frames of a scenario at a size.
    pub(crate) time: Duration,
    /// The folder that the results go into.
    pub(crate) results: Option<PathBuf>,
}

impl Settings {
    /// # Errors
    /// Names the variable that can't be read.
    pub(crate) fn from_environment() -> Result<Self, String> {
        let full = std::env::args().any(|argument| argument == "--bench");
        let seconds: f64 = list("SAPWISE_BENCH_SECONDS")?.map_or(6.0, |all: Vec<f64>| all[0]);
        let mut sizes = list("SAPWISE_SIZES")?.unwrap_or_else(|| SIZES[..if full { SIZES.len() } else { 1 }].to_vec());
        sizes.sort_unstable();
        Ok(Self {
            full,
            scenarios: list("SAPWISE_SCENARIOS")?
                .unwrap_or_else(|| SCENARIOS.into_iter().chain(Scenario::HARD).collect()),
            sizes,
            threads: list("SAPWISE_THREADS")?.unwrap_or_else(|| vec![1, 2]),
            time: Duration::try_from_secs_f64(seconds).map_err(|e| format!("SAPWISE_BENCH_SECONDS: {e}"))?,
            results: path("SAPWISE_RESULTS"),
        })
    }
}

/// The values in a variable, separated by commas; at least one where it is set.
fn list<T: FromStr<Err: Display>>(name: &str) -> Result<Option<Vec<T>>, String> {
    let Ok(text) = std::env::var(name) else { return Ok(None) };
    let values = text.split(',').map(|word| word.trim().parse().map_err(|e| format!("{name}={text}: {e}")));
    values.collect::<Result<_, _>>().map(Some)
}

/// The path in a variable, from the root of the workspace: cargo runs a benchmark in the folder of its package.
fn path(name: &str) -> Option<PathBuf> {
    std::env::var_os(name).map(|path| Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path))
}
