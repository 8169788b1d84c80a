//! What it costs to split work over all usable cores and wait for it.
//!
//! Bodies of known length are forked, and their length is taken off. Empty bodies are mostly not stolen, so that a join of
//! them costs 129 ns with a dispersion of 91 %; with bodies of 20 us it is 1.6 us and steady.

use std::time::{Duration, Instant};

use super::{Options, foreign_load, pool, statistics};
use crate::hardware::{Parameter, parameter};

/// Body of a warm join: many times the cost of a steal.
const SHORT: Duration = Duration::from_micros(20);

/// Body of a cold fork, and of those that wake the workers for a warm join.
///
/// Waking a virtual CPU took longer than 20 us on one machine. With bodies as short as that the first worker had run them all
/// before the second was awake, the second went back to sleep, and the join measured 20 us instead of a steal.
const LONG: Duration = Duration::from_micros(300);

/// How long the workers are left alone before a cold fork: rayon's have gone to sleep by then.
const IDLE: Duration = Duration::from_millis(2);

/// Joins behind one warm sample.
const JOINS: u32 = 16;

pub(super) fn measure(options: &Options) -> Vec<Parameter> {
    let threads = options.usable_cores();
    let missing = |why: &str| {
        [parameter::FORK_JOIN_WARM_NS, parameter::FORK_JOIN_COLD_NS].map(|name| Parameter::missing(name, why)).to_vec()
    };
    if threads == 1 {
        return missing("one usable core");
    }
    let pool = match pool(threads) {
        Ok(pool) => pool,
        Err(why) => return missing(&why),
    };
    let (short, long) = (body_ns(SHORT), body_ns(LONG));
    let figures = foreign_load::collect(options.plan(40, 500), || {
        std::thread::sleep(IDLE);
        let start = Instant::now();
        pool.install(|| fork(threads, LONG));
        let cold = start.elapsed();
        let warm = pool.install(|| {
            wake(threads);
            let start = Instant::now();
            for _ in 0..JOINS {
                fork(threads, SHORT);
            }
            start.elapsed() / JOINS
        });
        [(warm, short), (cold, long)].map(|(time, body)| (time.as_nanos() as f64 - body).max(0.0)).to_vec()
    });
    let methods = [
        (
            parameter::FORK_JOIN_WARM_NS,
            format!("rayon join of {threads} bodies of 20 us by awake workers inside the pool, minus one body"),
        ),
        (
            parameter::FORK_JOIN_COLD_NS,
            format!("install and rayon join of {threads} bodies of 300 us after 2 ms of idleness, minus one body"),
        ),
    ];
    figures.into_iter().zip(methods).map(|(figure, (name, method))| figure.into_parameter(name, &method)).collect()
}

/// Runs `bodies` bodies of one length, forked in halves.
fn fork(bodies: usize, length: Duration) {
    if bodies > 1 {
        rayon::join(|| fork(bodies / 2, length), || fork(bodies - bodies / 2, length));
    } else {
        spin(length);
    }
}

/// Forks until the bodies have run at the same time, so that every worker is awake and on a core of its own.
///
/// The kernel of one virtual machine kept a woken thread on the waker's core for up to 3 ms although the other was idle:
/// without this every other sample there was the serial time. Gives up after a few times: the samples then say what the
/// machine does.
fn wake(threads: usize) {
    for _ in 0..16 {
        let start = Instant::now();
        fork(threads, LONG);
        if start.elapsed() < LONG + LONG / 2 {
            return;
        }
    }
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
    statistics::median(&samples).unwrap_or(length.as_nanos() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_on_one_core() {
        let parameters = measure(&Options { threads: Some(1), brief: true });
        assert_eq!(parameters.len(), 2);
        assert!(parameters.iter().all(|p| p.value.is_none() && p.source == "one usable core"));
    }

    #[test]
    fn body_is_at_least_its_nominal_length() {
        assert!(body_ns(SHORT) >= SHORT.as_nanos() as f64);
    }
}
