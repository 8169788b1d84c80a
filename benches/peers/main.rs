//! Our algorithms on the CPU beside those of other crates, on the same boxes in turn.
//!
//! ```sh
//! cargo bench -p sapwise-bench --bench peers
//! SAPWISE_RESULTS=results cargo bench -p sapwise-bench --bench peers   # writes peers.csv into the folder
//! ```
//!
//! | variable | meaning |
//! |---|---|
//! | `SAPWISE_SCENARIOS` | scenarios, separated by commas |
//! | `SAPWISE_SIZES` | numbers of objects |
//! | `SAPWISE_THREADS` | `1`, `2` or `1,2` |
//! | `SAPWISE_CONTESTANTS` | who takes part: `adaptive,bvh,parry3d refit`; `bvh` is `bvh@cpu1` and `bvh@cpu2` |
//! | `SAPWISE_BENCH_SECONDS` | time for the timed frames of a scenario at a size `[default: 6]` |
//! | `SAPWISE_TAIL_SECONDS` | time for the slowest frames of a scenario at a size, 0 for none `[default: 30]` |
//! | `SAPWISE_RESULTS` | folder for `peers.csv`, which alone has the slowest frames |
//!
//! Method and bias stand at the head of `BENCHMARKS.md`. Prints a line for each scenario and size as soon as it is
//! measured. Criterion times its candidates one after the other, which is why it is not used here. Without `--bench`,
//! which `cargo bench` passes, only the smallest size is run for a few frames, to see that all is well. Exit status 1
//! when a contestant failed or found other pairs than the rest.

mod contestants;
mod ground;
mod machine;
mod naive;
mod obvhs_tree;
mod parry;
mod point;
mod race;
mod rtree;
mod settings;
mod table;
mod tails;

use contestants::{Contestant, ours, peers};
use point::Point;
use sapwise::Registry;
use sapwise::internals::pinned_pool;
use sapwise_scenes::Scenario;
use settings::Settings;
use std::io::Write;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

/// Fewest objects on two threads: below, no second thread gains anything.
const FEWEST_FOR_TWO: usize = 1_000;

/// Runs a race and prints its result.
fn measured(
    make: &dyn Fn() -> Result<Vec<Contestant>, String>,
    scenario: Scenario,
    objects: usize,
    settings: &Settings,
) -> Result<Point, String> {
    let start = Instant::now();
    let told = |e| format!("{scenario} at {objects} objects: {e}");
    let point = race::race(make, scenario, objects, settings).map_err(told)?;
    println!("{}, {:.1} s", table::line(&point), start.elapsed().as_secs_f64());
    // An interrupted run keeps what it has printed. A failure means that nobody reads any more.
    let _ = std::io::stdout().flush();
    Ok(point)
}

/// Returns the contestants with these names; all if there is no name.
fn chosen(mut all: Vec<Contestant>, names: &[String]) -> Result<Vec<Contestant>, String> {
    let is = |c: &Contestant, name: &String| c.name == *name || c.short_name() == name;
    if let Some(name) = names.iter().find(|name| !all.iter().any(|c| is(c, name))) {
        let known: Vec<&str> = all.iter().map(Contestant::short_name).collect();
        return Err(format!("SAPWISE_CONTESTANTS: nobody is called {name:?}; use some of {}", known.join(", ")));
    }
    all.retain(|c| names.is_empty() || names.iter().any(|name| is(c, name)));
    Ok(all)
}

/// Measures all scenarios on one thread, or `uniform` on several threads, and appends the points to `compared`. Calls
/// `keep` after each scenario.
fn compare(
    threads: u32,
    settings: &Settings,
    compared: &mut Vec<(u32, Vec<Point>)>,
    keep: impl Fn(&[(u32, Vec<Point>)]) -> Result<(), String>,
) -> Result<(), String> {
    println!("\nthreads: {threads}");
    let mut registry = Registry::with_cores(threads);
    registry.pin_threads();
    let tuning = machine::tuning(&registry, threads, settings)?;
    // Each thread is bound to a core, like those of the registry.
    let pool = || pinned_pool(threads).map(Arc::new).map_err(|e| e.to_string());
    let pool = if threads > 1 { Some(pool()?) } else { None };
    compared.push((threads, Vec::new()));
    let everyone = |scenario| {
        let mut all = ours(&registry, &tuning).map_err(|e| e.to_string())?;
        all.extend(peers(pool.as_ref(), scenario));
        chosen(all, &settings.contestants)
    };
    for &scenario in settings.scenarios.iter().filter(|s| threads == 1 || **s == Scenario::Uniform) {
        let mut gone: Vec<String> = Vec::new();
        for &objects in settings.sizes.iter().filter(|n| threads == 1 || **n >= FEWEST_FOR_TWO || !settings.full) {
            let make = || {
                let mut all = everyone(scenario)?;
                all.retain(|c| !gone.contains(&c.name));
                Ok(all)
            };
            let point = measured(&make, scenario, objects, settings)?;
            gone.extend(point.left.iter().cloned());
            if let Some((_, points)) = compared.last_mut() {
                points.push(point);
            }
        }
        keep(compared)?;
    }
    Ok(())
}

fn bench() -> Result<(), String> {
    let settings = Settings::from_environment()?;
    let keep = |compared: &[(u32, Vec<Point>)]| {
        let Some(folder) = &settings.results else { return Ok(()) };
        let path = folder.join("peers.csv");
        std::fs::write(&path, table::csv(compared)).map_err(|e| format!("{}: {e}", path.display()))
    };
    let mut compared = Vec::new();
    for &threads in &settings.threads {
        compare(threads, &settings, &mut compared, keep)?;
    }
    Ok(())
}

fn main() -> ExitCode {
    match bench() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
