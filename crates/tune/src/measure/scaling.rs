//! Work of several threads over work of one.
//!
//! Hyper-threads, shared power and a quota all show as less than one core's work a thread.

use std::hint::black_box;
use std::time::{Duration, Instant};

use rayon::ThreadPool;

use super::{Options, pool};
use crate::hardware::{Parameter, ParameterId};

/// Floats that a thread works on: 8 KiB, within every first-level cache, so that cores are compared and not memory.
const FLOATS: usize = 2048;

/// Passes between two readings of the clock.
const PASSES: u32 = 64;

const NAMES: [ParameterId; 2] = [ParameterId::ScalingTwoThreadsRatio, ParameterId::ScalingAllThreadsRatio];

pub(super) fn measure(options: &Options) -> Result<Vec<Parameter>, String> {
    let threads = options.usable_cores();
    if threads == 1 {
        let why = "one usable core";
        return Ok(vec![Parameter::missing(NAMES[0], why), Parameter::reported(NAMES[1], 1.0, why)]);
    }
    let pool = pool(threads)?;
    let time = Duration::from_millis(if options.brief { 1 } else { 8 });
    let work_rate = |threads| together(&pool, threads, || passes_per_ns(time));
    // Untimed: the clock rises, and the workers touch the pages of their stacks.
    work_rate(threads);
    let method = |n: usize| format!("passes over 8 KiB a thread in the same time, {n} threads over one");
    let named = [(NAMES[0], method(2)), (NAMES[1], method(threads))];
    options.plan(8, 650).measure(named, || {
        let one = work_rate(1);
        let two = work_rate(2);
        let all = if threads == 2 { two } else { work_rate(threads) };
        Ok([two / one, all / one])
    })
}

/// The sum of the rates of `threads` threads of the pool. Each thread divides by its own time, because they don't
/// wake at once.
fn together(pool: &ThreadPool, threads: usize, rate: impl Fn() -> f64 + Sync) -> f64 {
    pool.broadcast(|worker| if worker.index() < threads { rate() } else { 0.0 }).iter().sum()
}

fn passes_per_ns(time: Duration) -> f64 {
    let mut floats = [1.0_f32; FLOATS];
    let start = Instant::now();
    let mut passes = 0_u64;
    loop {
        for _ in 0..PASSES {
            // Stays near the fixed point of one: denormal values would be slower.
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
    fn every_requested_thread_works() {
        let pool = pool(3).unwrap();
        for threads in 1..=3 {
            assert_eq!(together(&pool, threads, || 2.0), 2.0 * threads as f64);
        }
        assert!(passes_per_ns(Duration::ZERO) > 0.0);
    }
}
