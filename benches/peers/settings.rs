//! The settings of a run, read from environment variables.

use sapwise_scenes::Scenario;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;

/// Scenarios that are measured only if they are named.
const LEFT_OUT: [Scenario; 2] = [Scenario::Brownian, Scenario::FreeFall];

const SIZES: [usize; 9] = [100, 300, 1_000, 3_000, 10_000, 30_000, 100_000, 300_000, 1_000_000];

/// What to measure, and for how long.
pub(crate) struct Settings {
    /// Whether to measure; otherwise everything runs for a few frames, as a test.
    pub(crate) full: bool,
    pub(crate) scenarios: Vec<Scenario>,
    /// Numbers of objects, ascending.
    pub(crate) sizes: Vec<usize>,
    pub(crate) threads: Vec<u32>,
    /// Time for the timed frames of a scenario at a size.
    pub(crate) time: Duration,
    /// Time for the slowest frames of a scenario at a size. Zero skips them.
    pub(crate) tail_time: Duration,
    /// Names of the contestants, with or without what follows `@` or ` (`; empty for all.
    pub(crate) contestants: Vec<String>,
    /// The folder for the results.
    pub(crate) results: Option<PathBuf>,
}

impl Settings {
    /// # Errors
    /// Names the variable that can't be read.
    pub(crate) fn from_environment() -> Result<Self, String> {
        let full = std::env::args().any(|argument| argument == "--bench");
        let mut sizes = list("SAPWISE_SIZES")?.unwrap_or_else(|| SIZES[..if full { SIZES.len() } else { 1 }].to_vec());
        sizes.sort_unstable();
        Ok(Self {
            full,
            scenarios: list("SAPWISE_SCENARIOS")?
                .unwrap_or_else(|| Scenario::ALL.into_iter().filter(|s| !LEFT_OUT.contains(s)).collect()),
            sizes,
            threads: list("SAPWISE_THREADS")?.unwrap_or_else(|| vec![1, 2]),
            time: seconds("SAPWISE_BENCH_SECONDS", 6.0)?,
            tail_time: seconds("SAPWISE_TAIL_SECONDS", 30.0)?,
            contestants: list("SAPWISE_CONTESTANTS")?.unwrap_or_default(),
            results: path("SAPWISE_RESULTS"),
        })
    }
}

/// Returns the values in a variable, separated by commas; at least one if it is set.
fn list<T: FromStr<Err: Display>>(name: &str) -> Result<Option<Vec<T>>, String> {
    let Ok(text) = std::env::var(name) else { return Ok(None) };
    let values = text.split(',').map(|word| word.trim().parse().map_err(|e| format!("{name}={text}: {e}")));
    values.collect::<Result<_, _>>().map(Some)
}

/// Returns the time in a variable, in seconds; `usual` if it is not set.
fn seconds(name: &str, usual: f64) -> Result<Duration, String> {
    let seconds = list(name)?.map_or(usual, |all: Vec<f64>| all[0]);
    Duration::try_from_secs_f64(seconds).map_err(|e| format!("{name}={seconds}: {e}"))
}

/// Returns the path in a variable, relative to the root of the workspace: cargo runs a benchmark in the folder of its
/// package.
fn path(name: &str) -> Option<PathBuf> {
    std::env::var_os(name).map(|path| Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path))
}
