//! What it costs to split work over all usable cores and wait for it.
//!
//! Measured through the very phase by which the algorithms on several cores spread their work: the calling thread works, helpers
//! of a pool join in, each bound to a core of its own. Bodies of known length are run, and their length is taken off.

use std::time::{Duration, Instant};

use super::{Options, foreign_load};
use crate::cpu::{Threads, Workers};
use crate::hardware::{Parameter, ParameterId};
use crate::stats::median;

/// Body of a warm phase: many times the cost of a start.
const SHORT: Duration = Duration::from_micros(20);

/// Body of a cold phase, and of those that wake the helpers for a warm one.
///
/// Waking a virtual CPU took longer than 20 us on one machine. With bodies as short as that the caller had run them all
/// before the helper was awake, and the phase measured 20 us instead of a start.
const LONG: Duration = Duration::from_micros(300);

/// How long the helpers are left alone before a cold phase: they have gone to sleep by then.
const IDLE: Duration = Duration::from_millis(2);

/// Warm phases behind one sample.
const PHASES: u32 = 16;

const NAMES: [ParameterId; 2] = [ParameterId::ForkJoinWarmNs, ParameterId::ForkJoinColdNs];

pub(super) fn measure(options: &Options) -> Vec<Parameter> {
    let threads = options.usable_cores();
    let missing = |why: &str| NAMES.map(|name| Parameter::missing(name, why)).to_vec();
    if threads == 1 {
        return missing("one usable core");
    }
    let workers = match workers(threads) {
        Ok(workers) => workers,
        Err(why) => return missing(&why),
    };
    let (short, long) = (body_ns(SHORT), body_ns(LONG));
    let figures = foreign_load::collect(options.plan(40, 500), || {
        wake(&workers);
        let phases: Vec<f64> = (0..PHASES).map(|_| phase_ns(&workers, SHORT)).collect();
        // The caller works on, as in a program whose next frame it is: only the helpers go to sleep.
        spin(IDLE);
        let cold = phase_ns(&workers, LONG);
        vec![(median(&phases).unwrap_or(f64::NAN) - short).max(0.0), (cold - long).max(0.0)]
    });
    let helpers = threads - 1;
    let methods = [
        format!(
            "phase of {threads} bodies of 20 us, one on the calling thread and the others on {helpers} awake helpers, minus one body; \
             a sample is the median of {PHASES}"
        ),
        "the same with bodies of 300 us, after the helpers were idle for 2 ms while the calling thread worked"
            .to_owned(),
    ];
    foreign_load::into_parameters(figures, NAMES.into_iter().zip(methods))
}

/// A caller and helpers as the algorithms have them, with the helpers bound as in a sweep.
fn workers(threads: usize) -> Result<Workers, String> {
    let threads = u32::try_from(threads).unwrap_or(u32::MAX);
    Workers::new("fork_join", threads, &Threads::pinned()).map_err(|e| e.to_string())
}

/// Nanoseconds of one phase with a body of this length for each thread.
fn phase_ns(workers: &Workers, body: Duration) -> f64 {
    let start = Instant::now();
    workers.each_of(0..workers.threads(), |_| spin(body));
    start.elapsed().as_nanos() as f64
}

/// Runs phases until the bodies have run at the same time, so that every helper is awake and on a core of its own.
///
/// The kernel of one virtual machine kept a woken thread on the waker's core for up to 3 ms although the other was idle:
/// without this every other sample there was the serial time. Gives up after a few times: the samples then say what the
/// machine does.
fn wake(workers: &Workers) {
    let enough = (LONG + LONG / 2).as_nanos() as f64;
    let _ = (0..16).any(|_| phase_ns(workers, LONG) < enough);
}

/// Runs by the wall clock and not by work, so that the body is as long on a core that clocks down.
fn spin(length: Duration) {
    let start = Instant::now();
    while start.elapsed() < length {
        std::hint::spin_loop();
    }
}

/// The true length of a body: reading the clock takes time of its own.
fn body_ns(length: Duration) -> f64 {
    let samples: Vec<f64> = (0..25)
        .map(|_| {
            let start = Instant::now();
            spin(length);
            start.elapsed().as_nanos() as f64
        })
        .collect();
    median(&samples).unwrap_or(length.as_nanos() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_on_one_core() {
        let parameters = measure(&Options::default().with_threads(Some(1)).brief(true));
        assert_eq!(parameters.len(), 2);
        assert!(parameters.iter().all(|p| p.value.is_none() && p.source == "one usable core"));
    }

    #[test]
    fn body_is_at_least_its_nominal_length() {
        assert!(body_ns(SHORT) >= SHORT.as_nanos() as f64);
    }

    #[test]
    fn a_phase_is_at_least_as_long_as_its_body() {
        let workers = workers(3).unwrap();
        wake(&workers);
        assert!(phase_ns(&workers, SHORT) >= SHORT.as_nanos() as f64);
    }
}
