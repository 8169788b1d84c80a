//! How much more work several threads do than one.
//!
//! Tells what topology can't: hyper-threads, shared power and a quota all show as less than one core's work a thread.

use std::hint::black_box;
use std::time::{Duration, Instant};

use super::{Options, foreign_load, pool, together};
use crate::hardware::{Parameter, ParameterId};

/// Floats that a thread works on: 8 KiB, within every first-level cache, so that only the cores are compared and not the memory.
const FLOATS: usize = 2048;

/// Passes between two looks at the clock.
const PASSES: u32 = 64;

pub(super) fn measure(options: &Options) -> Vec<Parameter> {
    let threads = options.usable_cores();
    let (two, all) = (ParameterId::ScalingTwoThreadsRatio, ParameterId::ScalingAllThreadsRatio);
    if threads == 1 {
        return vec![Parameter::missing(two, "one usable core"), Parameter::reported(all, 1.0, "one usable core")];
    }
    let pool = match pool(threads) {
        Ok(pool) => pool,
        Err(why) => return [two, all].map(|name| Parameter::missing(name, &why)).to_vec(),
    };
    let time = Duration::from_millis(if options.brief { 1 } else { 8 });
    // The clock rises and the pages of the workers' stacks are touched in a run that does not count.
    let work_rate = |threads| together(&pool, threads, || passes_per_ns(time));
    work_rate(threads);
    let figures = foreign_load::collect(options.plan(8, 650), || {
        let one = work_rate(1);
        let two = work_rate(2);
        let all = if threads == 2 { two } else { work_rate(threads) };
        vec![two / one, all / one]
    });
    let method = |n: usize| format!("passes over 8 KiB a thread in the same time, {n} threads over one");
    let methods = [(two, method(2)), (all, method(threads))];
    foreign_load::into_parameters(figures, methods)
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
        let parameters = measure(&Options::default().with_threads(Some(1)).brief(true));
        assert_eq!((parameters[0].value, parameters[1].value), (None, Some(1.0)));
    }

    #[test]
    fn every_thread_asked_for_works() {
        let pool = pool(3).unwrap();
        for threads in 1..=3 {
            assert_eq!(together(&pool, threads, || 2.0), 2.0 * threads as f64);
        }
        assert!(passes_per_ns(Duration::ZERO) > 0.0);
    }
}
