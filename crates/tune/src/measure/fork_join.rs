//! Cost of splitting work over all usable cores and waiting for it.
//!
//! Measured through the same phase by which the algorithms on several cores split their work: the calling thread
//! works, and helpers join in, each bound to a core of its own. The bodies have a known length, which is subtracted.

use std::time::{Duration, Instant};

use super::Options;
use crate::hardware::{Parameter, ParameterId};
use crate::stats::median;
use sapwise::internals::{Threads, Workers};

/// Body of a warm phase: many times the cost of a start.
const SHORT: Duration = Duration::from_micros(20);

/// Body of a cold phase, and of the phases that wake the helpers.
///
/// On one machine a virtual CPU took longer than 20 µs to wake. With bodies that short the caller had run them all
/// before the helper was awake, and the phase measured 20 µs instead of a start.
const LONG: Duration = Duration::from_micros(300);

/// Idle time of the helpers before a cold phase. By then they sleep.
const IDLE: Duration = Duration::from_millis(2);

/// Warm phases behind one sample.
const PHASES: u32 = 16;

pub(super) fn measure(options: &Options) -> Result<Vec<Parameter>, String> {
    let threads = options.usable_cores();
    if threads == 1 {
        return Err("one usable core".to_owned());
    }
    let workers = workers(threads)?;
    let warm = format!(
        "phase of {threads} bodies of 20 µs, one on the calling thread and the others on {} awake helpers, minus one \
         body; a sample is the median of {PHASES}",
        threads - 1
    );
    let cold = "the same with bodies of 300 µs, after the helpers were idle for 2 ms while the calling thread worked";
    let named = [(ParameterId::ForkJoinWarmNs, warm), (ParameterId::ForkJoinColdNs, cold.to_owned())];
    let (short, long) = (body_ns(SHORT), body_ns(LONG));
    options.plan(40, 500).measure(named, || {
        wake(&workers);
        let phases: Vec<f64> = (0..PHASES).map(|_| phase_ns(&workers, SHORT)).collect();
        // The caller works on, like a program whose next frame it is: only the helpers go to sleep.
        spin(IDLE);
        let cold = phase_ns(&workers, LONG);
        Ok([(median(&phases).unwrap_or(f64::NAN) - short).max(0.0), (cold - long).max(0.0)])
    })
}

/// A caller and bound helpers, as in a sweep.
fn workers(threads: usize) -> Result<Workers, String> {
    let threads = u32::try_from(threads).unwrap_or(u32::MAX);
    let workers = Workers::new("fork_join", threads, &Threads::pinned());
    workers.start().map_err(|e| e.to_string())?;
    Ok(workers)
}

/// Nanoseconds of one phase with a body of this length for each thread.
fn phase_ns(workers: &Workers, body: Duration) -> f64 {
    let start = Instant::now();
    workers.each_of(0..workers.threads(), |_| spin(body));
    start.elapsed().as_nanos() as f64
}

/// Runs phases until the bodies ran at the same time, so that every helper is awake and on its own core.
///
/// The kernel of one virtual machine kept a woken thread on the waker's core for up to 3 ms although the other core
/// was idle, and every other sample was the serial time. Gives up after a few phases: the samples then show what the
/// machine does.
fn wake(workers: &Workers) {
    let enough = (LONG + LONG / 2).as_nanos() as f64;
    let _ = (0..16).any(|_| phase_ns(workers, LONG) < enough);
}

/// Runs by the wall clock, so that the body is equally long on a core that clocks down.
fn spin(length: Duration) {
    let start = Instant::now();
    while start.elapsed() < length {
        std::hint::spin_loop();
    }
}

/// The true length of a body, which includes reading the clock.
fn body_ns(length: Duration) -> f64 {
    let sample = || {
        let start = Instant::now();
        spin(length);
        start.elapsed().as_nanos() as f64
    };
    let samples: Vec<f64> = (0..25).map(|_| sample()).collect();
    median(&samples).unwrap_or(length.as_nanos() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_phase_is_at_least_as_long_as_its_body() {
        let workers = workers(3).unwrap();
        wake(&workers);
        assert!(phase_ns(&workers, SHORT) >= SHORT.as_nanos() as f64);
        assert!(body_ns(SHORT) >= SHORT.as_nanos() as f64);
    }
}
