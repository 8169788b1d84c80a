//! Another program that takes a part of the CPU from a frame on, made by ourselves.

use crate::contention::Threads;
use std::fmt;
use std::hint::black_box;
use std::str::FromStr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Share of its core that a thread takes: what is left to others takes 1 / (1 - 0.375) = 1.6 times as long. More than half is not
/// to be had beside a program that always has something to do.
pub(crate) const SHARE: f64 = 0.375;
/// How long it leaves the core to others at a time. Schedulers that switch on a tick of milliseconds make it coarser.
const REST: Duration = Duration::from_micros(200);
/// Between two readings of the clock that are farther apart than this another thread had the core.
const AWAY: Duration = Duration::from_micros(20);
/// What it took longer ago than this doesn't count, so that a time in which it got nothing is not made up for at a stretch.
const MEMORY: Duration = Duration::from_millis(100);

/// Steps of the loop that is timed beside the frames: some 200 us.
const STEPS: u64 = 200_000;

/// From which frame on, and on how many threads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct CoRunner {
    pub(crate) from_frame: usize,
    /// `None`: one for each core.
    pub(crate) threads: Option<u32>,
}

impl FromStr for CoRunner {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (frame, threads) = text.split_once(':').map_or((text, None), |(frame, threads)| (frame, Some(threads)));
        let threads = threads.map(|t| t.parse().ok().filter(|t| (1..=4096).contains(t)).ok_or(t)).transpose();
        match (frame.parse(), threads) {
            (Ok(from_frame), Ok(threads)) => Ok(Self { from_frame, threads }),
            _ => Err(format!("{text:?} is not FRAME or FRAME:THREADS, such as 300 or 300:1, with 1 to 4096 threads")),
        }
    }
}

impl fmt::Display for CoRunner {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let threads = self.threads.map_or(String::new(), |threads| format!(":{threads}"));
        write!(f, "{}{threads}", self.from_frame)
    }
}

impl CoRunner {
    /// Starts the threads, each on a core of its own as long as there are some. They end when the returned value is dropped.
    ///
    /// # Errors
    /// When the system refuses one.
    pub(super) fn start(self) -> std::io::Result<Threads> {
        let mut threads = Threads::default();
        let cores = core_affinity::get_core_ids().unwrap_or_default();
        for k in 0..self.threads() as usize {
            threads.spawn(format!("co-runner-{k}"), cores.get(k % cores.len().max(1)).copied(), |stop| {
                take(stop, SHARE);
            })?;
        }
        Ok(threads)
    }

    pub(crate) fn threads(self) -> u32 {
        self.threads.unwrap_or_else(sapwise::usable_cores)
    }
}

/// Takes that share of the core's time until it is told to stop, and returns the share that it got.
///
/// Its own time is that between readings of the clock that follow close upon each other, which needs no call of the system.
fn take(stop: &AtomicBool, share: f64) -> f64 {
    let began = Instant::now();
    let mut total = Duration::ZERO;
    let (mut window, mut taken, mut last) = (began, Duration::ZERO, began);
    while !stop.load(Ordering::Relaxed) {
        let now = Instant::now();
        let step = now - last;
        last = now;
        if step < AWAY {
            taken += step;
            total += step;
        }
        if now - window > MEMORY {
            (window, taken) = (now, Duration::ZERO);
        } else if taken > (now - window).mul_f64(share) {
            std::thread::sleep(REST);
            last = Instant::now();
        }
    }
    total.as_secs_f64() / began.elapsed().as_secs_f64()
}

/// Nanoseconds that a loop of arithmetic takes on the calling thread.
pub(super) fn time_a_loop() -> f64 {
    let began = Instant::now();
    let mut x = 1_u64;
    for k in 0..STEPS {
        x = black_box(x.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(k));
    }
    black_box(x);
    began.elapsed().as_nanos() as f64
}

/// By how much a loop of arithmetic took longer from the frame on at which the co-runner began.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Slowdown {
    pub(crate) co_runner: CoRunner,
    /// Mean time after over mean time before of a loop that ran beside the frames. `None` where there was no frame before.
    ///
    /// Means and not medians: a scheduler takes the core away for milliseconds at a time, so that most short frames are as fast as
    /// before and some wait.
    pub(crate) of_a_loop: Option<f64>,
}

impl Slowdown {
    /// `loops` are the times of the loop with the frames beside which it ran.
    pub(super) fn new(co_runner: CoRunner, loops: &[(usize, f64)]) -> Self {
        let mean = |after: bool| {
            let times: Vec<f64> =
                loops.iter().filter(|l| (l.0 >= co_runner.from_frame) == after).map(|l| l.1).collect();
            (!times.is_empty()).then(|| times.iter().sum::<f64>() / times.len() as f64)
        };
        Self { co_runner, of_a_loop: mean(true).zip(mean(false)).map(|(after, before)| after / before) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_and_threads_are_read() {
        let read = |text: &str| text.parse::<CoRunner>();
        assert_eq!(read("300"), Ok(CoRunner { from_frame: 300, threads: None }));
        assert_eq!(read("0:2"), Ok(CoRunner { from_frame: 0, threads: Some(2) }));
        for wrong in ["", ":", "300:", "300:0", "300:x", "-1", "300:1:1", "1.6"] {
            assert!(read(wrong).is_err_and(|e| e.contains("FRAME:THREADS")), "{wrong}");
        }
        for text in ["300", "0:2"] {
            assert_eq!(read(text).unwrap().to_string(), text);
        }
    }

    #[test]
    fn no_more_than_the_share_is_taken_and_it_ends() {
        let stop = AtomicBool::new(false);
        let got = std::thread::scope(|scope| {
            let thread = scope.spawn(|| take(&stop, 0.25));
            std::thread::sleep(Duration::from_millis(300));
            stop.store(true, Ordering::Relaxed);
            thread.join().unwrap()
        });
        // How much less depends on what else runs on the machine.
        assert!(got > 0.0 && got < 0.3, "{got}");
    }

    #[test]
    fn the_slowdown_compares_the_frames_before_with_those_after() {
        let slowdown = |from_frame| {
            let loops = [(0, 100.0), (1, 100.0), (3, 150.0), (4, 190.0)];
            Slowdown::new(CoRunner { from_frame, threads: None }, &loops).of_a_loop
        };
        assert_eq!((slowdown(3), slowdown(0)), (Some(1.7), None));
    }
}
