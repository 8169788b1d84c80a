//! Prints the triad bandwidth of this machine: best and median GB/s of one thread, then of all threads, on one line.
//!
//! With `--array-mebibytes` prints instead how large each array is, so that another program can be run on the same.
//! Used by `tools/compare-stream.sh`.

use std::process::ExitCode;

use sapwise::measure::{Options, statistics, triad};

fn main() -> ExitCode {
    let triad = match triad(&Options::default()) {
        Ok(triad) => triad,
        Err(why) => {
            eprintln!("measure_bandwidth: {why}");
            return ExitCode::FAILURE;
        }
    };
    if std::env::args().any(|argument| argument == "--array-mebibytes") {
        println!("{}", triad.array_bytes >> 20);
        return ExitCode::SUCCESS;
    }
    let figures: Vec<String> = [&triad.one_thread, &triad.all_threads]
        .into_iter()
        .flat_map(|samples| [statistics::quantile(samples, 1.0), statistics::median(samples)])
        .map(|figure| format!("{:.3}", figure.unwrap_or(f64::NAN)))
        .collect();
    println!("{}", figures.join(" "));
    ExitCode::SUCCESS
}
