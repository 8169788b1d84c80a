//! What it costs to split work over all usable cores and wait for it, and how far apart two of them are.
//!
//! Measured through the very phase by which the algorithms on several cores spread their work: the calling thread works, helpers
//! of a pool join in, each bound to a core of its own. Bodies of known length are run, and their length is taken off.

use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use super::{Options, foreign_load};
use crate::cpu::{Threads, Workers};
use crate::hardware::{Parameter, parameter};
use crate::statistics::median;

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

/// Round trips of a cache line behind one time, and times behind one sample.
const ROUND_TRIPS: u32 = 50;
const TIMES: u32 = 15;

/// After this two threads that answer each other give up: they share a core, and each waits for the other's turn to end.
const PATIENCE: Duration = Duration::from_millis(2);

const NAMES: [&str; 3] = [parameter::FORK_JOIN_WARM_NS, parameter::FORK_JOIN_COLD_NS, parameter::CORE_TO_CORE_NS];

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
        let distance = core_to_core_ns(&workers);
        let phases: Vec<f64> = (0..PHASES).map(|_| phase_ns(&workers, SHORT)).collect();
        // The caller works on, as in a program whose next frame it is: only the helpers go to sleep.
        spin(IDLE);
        let cold = phase_ns(&workers, LONG);
        vec![(median(&phases).unwrap_or(f64::NAN) - short).max(0.0), (cold - long).max(0.0), distance]
    });
    let helpers = threads - 1;
    let methods = [
        format!(
            "phase of {threads} bodies of 20 us, one on the calling thread and the others on {helpers} awake helpers, minus one body; \
             a sample is the median of {PHASES}"
        ),
        "the same with bodies of 300 us, after the helpers were idle for 2 ms while the calling thread worked".to_owned(),
        "a cache line handed to and fro between the calling thread and a helper, one way".to_owned(),
    ];
    figures
        .into_iter()
        .zip(NAMES)
        .zip(methods)
        .map(|((figure, name), method)| figure.into_parameter(name, &method))
        .collect()
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

/// A number that has its cache line to itself, and the neighbour that some cores fetch with it.
#[derive(Default)]
#[repr(align(128))]
struct Line(AtomicU32);

/// Nanoseconds that a cache line takes from one core to another; not a number where both threads share one.
///
/// It tells apart what nothing else does: on one host the two cores of a guest lay in one group that shares a cache (38 ns) or in
/// two (165 ns), for some seconds each. The bandwidth of both was 53 GB/s or 90, accordingly, and a warm phase took 425 ns or 1900.
fn core_to_core_ns(workers: &Workers) -> f64 {
    let line = Line::default();
    let mut times = [Vec::new(), Vec::new()];
    workers.each(&mut times, |side, times| *times = hand_over(&line, side as u32));
    // Both sides time the same round trips. The first of them begin before the other thread has come.
    let whole = times.into_iter().next().filter(|times| times.len() == TIMES as usize);
    whole.and_then(|times| median(&times)).unwrap_or(f64::NAN)
}

/// Counts the line up whenever it is this side's turn: one side at even numbers, the other at odd ones. The times of one way.
fn hand_over(line: &Line, side: u32) -> Vec<f64> {
    let mut times = Vec::new();
    for time in 0..TIMES {
        let start = Instant::now();
        for trip in 0..ROUND_TRIPS {
            let turn = 2 * (time * ROUND_TRIPS + trip) + side;
            let mut looks = 0_u32;
            // Without a pause, which takes longer than the way on some cores.
            while line.0.load(Ordering::Acquire) != turn {
                looks = looks.wrapping_add(1);
                if looks.is_multiple_of(4096) && start.elapsed() > PATIENCE {
                    return times;
                }
            }
            line.0.store(turn + 1, Ordering::Release);
        }
        times.push(start.elapsed().as_nanos() as f64 / f64::from(2 * ROUND_TRIPS));
    }
    times
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
        let parameters = measure(&Options { threads: Some(1), brief: true });
        assert_eq!(parameters.len(), 3);
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

    #[test]
    fn a_line_goes_to_and_fro_as_often_as_it_should() {
        let line = Line::default();
        let (here, there) = std::thread::scope(|scope| {
            let there = scope.spawn(|| hand_over(&line, 1));
            (hand_over(&line, 0), there.join().unwrap())
        });
        // On a loaded machine both may give up; who has finished has seen every turn.
        if here.len() == TIMES as usize && there.len() == TIMES as usize {
            assert_eq!(line.0.load(Ordering::Relaxed), 2 * ROUND_TRIPS * TIMES);
            assert!(here.iter().chain(&there).all(|&ns| ns > 0.0));
        }
        // Nobody answers: no time, and no waiting for ever.
        assert!(hand_over(&Line::default(), 1).is_empty());
    }
}
