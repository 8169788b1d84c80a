//! How much more work several threads do than one.
//!
//! Tells what topology can't: hyper-threads, shared power and a quota all show as less than one core's work a thread.

use std::hint::black_box;
use std::time::{Duration, Instant};

use rayon::ThreadPool;

use super::{Options, foreign_load, pool};
use crate::hardware::{Parameter, parameter};

/// Floats that a thread works on: 8 KiB, within every first-level cache, so that only the cores are compared and not the memory.
const FLOATS: usize = 2048;

/// Passes between two looks at the clock.
const PASSES: u32 = 64;

pub(super) fn measure(options: &Options) -> Vec<Parameter> {
    let threads = options.usable_cores();
    let (two, all) = (parameter::SCALING_TWO_THREADS_RATIO, parameter::SCALING_ALL_THREADS_RATIO);
    if threads == 1 {
        return vec![Parameter::missing(two, "one usable core"), Parameter::reported(all, 1.0, "one usable core")];
    }
    let pool = match pool(threads) {
        Ok(pool) => pool,
        Err(why) => return [two, all].map(|name| Parameter::missing(name, &why)).to_vec(),
    };
    let time = Duration::from_millis(if options.brief { 1 } else { 8 });
    // The clock rises and the pages of the workers' stacks are touched in a run that does not count.
    work_rate(&pool, threads, time);
    let figures = foreign_load::collect(options.plan(8, 650), || {
        let one = work_rate(&pool, 1, time);
        let two = work_rate(&pool, 2, time);
        let all = if threads == 2 { two } else { work_rate(&pool, threads, time) };
        vec![two / one, all / one]
    });
    let method = |n: usize| format!("passes over 8 KiB a thread in the same time, {n} threads over one");
    let methods = [(two, method(2)), (all, method(threads))];
    figures.into_iter().zip(methods).map(|(figure, (name, method))| figure.into_parameter(name, &method)).collect()
}

/// Passes a nanosecond that `threads` threads of the pool do together.
fn work_rate(pool: &ThreadPool, threads: usize, time: Duration) -> f64 {
    // Each thread divides by its own time: they don't wake at once.
    pool.broadcast(|worker| if worker.index() < threads { passes_per_ns(time) } else { 0.0 }).iter().sum()
}

fn passes_per_ns(time: Duration) -> f64 {
    let mut floats = [1.0_f32; FLOATS];
    let start = Instant::now();
    let mut passes = 0_u64;
    loop {
        for _ in 0..PASSES {
            // Values near a fixed point of one: never denormal, which would be slower by a factor of its own.
            for x in &mut floats {
                *x = *x * 0.5 + 0.5;
            }
            // Without this the passes would be merged or dropped.
            black_box(&mut floats);
        }
        passes += u64::from(PASSES);
        let elapsed = start.elapsed();
        if elapsed >= time {
            return passes as f64 / elapsed.as_nanos() as f64;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_core() {
        let parameters = measure(&Options { threads: Some(1), brief: true });
        assert_eq!((parameters[0].value, parameters[1].value), (None, Some(1.0)));
    }

    #[test]
    fn every_thread_asked_for_works() {
        let pool = pool(3).unwrap();
        assert!(work_rate(&pool, 3, Duration::from_micros(10)) > 0.0);
        assert!(passes_per_ns(Duration::ZERO) > 0.0);
    }
}
