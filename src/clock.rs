//! The clock by which frames are timed.

use std::time::Duration;

#[cfg(test)]
pub(crate) use counted::{Instant, tick};
#[cfg(all(not(test), target_family = "wasm", target_os = "unknown"))]
pub use given::set_clock;
#[cfg(all(not(test), target_family = "wasm", target_os = "unknown"))]
pub(crate) use given::{Instant, tick};
#[cfg(not(any(test, all(target_family = "wasm", target_os = "unknown"))))]
pub(crate) use std::time::Instant;

/// A frame is learned from if it takes at least this many ticks: rounding then changes its time by less than frames
/// differ anyway.
const FEWEST_TICKS: u32 = 4;

/// The longest tick of a clock by which algorithms compare the times of parts of a frame.
const FINE: Duration = Duration::from_micros(10);

/// Returns the time between two readings of the clock that differ; `None` if there is no clock.
#[cfg(not(any(test, all(target_family = "wasm", target_os = "unknown"))))]
pub(crate) const fn tick() -> Option<Duration> {
    Some(Duration::ZERO)
}

/// Returns whether there is a clock. If not, every time is zero.
pub(crate) fn ticks() -> bool {
    tick().is_some()
}

/// Returns whether the clock can time parts of a frame.
pub(crate) fn is_fine() -> bool {
    tick().is_some_and(|tick| tick <= FINE)
}

/// Returns the nanoseconds since then. By way of 64 bits, for which processors have an instruction.
pub(crate) fn elapsed_ns(since: Instant) -> f64 {
    since.elapsed().as_nanos() as u64 as f64
}

/// Returns the nanoseconds since then, at least 1; `None` if the clock is too coarse for that time.
pub(crate) fn measured_ns(since: Instant) -> Option<f64> {
    let (ns, tick) = (elapsed_ns(since), tick()?);
    (ns >= (FEWEST_TICKS * tick).as_nanos() as f64).then_some(ns.max(1.0))
}

/// Replaces the standard library's clock, which traps in WebAssembly without a system. A crate that asks a browser
/// for its clock needs imports that other hosts lack, so the program gives one.
#[cfg(all(not(test), target_family = "wasm", target_os = "unknown"))]
mod given {
    use super::Duration;
    use std::sync::OnceLock;

    static CLOCK: OnceLock<(fn() -> Duration, Duration)> = OnceLock::new();

    /// Gives the library a clock, from which [`Adaptive`](crate::Adaptive) learns: the time since any moment, and the
    /// least difference of two readings. Call it once, before anything else. Returns `false`, and changes nothing, if
    /// there is a clock already. Only on `wasm32-unknown-unknown`.
    pub fn set_clock(now: fn() -> Duration, tick: Duration) -> bool {
        CLOCK.set((now, tick)).is_ok()
    }

    #[derive(Debug, Clone, Copy)]
    pub(crate) struct Instant(Duration);

    impl Instant {
        pub(crate) fn now() -> Self {
            Self(CLOCK.get().map_or(Duration::ZERO, |(now, _)| now()))
        }

        pub(crate) fn elapsed(&self) -> Duration {
            Self::now().0.saturating_sub(self.0)
        }
    }

    pub(crate) fn tick() -> Option<Duration> {
        CLOCK.get().map(|&(_, tick)| tick)
    }
}

/// A clock for tests that replay recorded times: it shows what was [spent](counted::spend) while something
/// [runs](counted::run).
#[cfg(test)]
pub(crate) mod counted {
    use super::Duration;
    use std::cell::Cell;

    /// Nanoseconds of a decision, and of comparing boxes with those of the previous frame, between cold caches.
    /// Medians of `sapwise run` on the Granite Rapids host of `datasets/`: 5 µs with two methods on two threads (8 µs
    /// in the largest frames of `fragmentation`) and 1.5 to 3.9 µs.
    pub(crate) const DECISION_NS: f64 = 5_000.0;
    pub(crate) const LOOK_NS: f64 = 3_000.0;

    /// Nanoseconds of a sample of boxes, from the same runs: 7 µs at 100 boxes, 14 µs at 800, 26 µs at 3000.
    pub(crate) fn sample_ns(boxes: usize) -> f64 {
        6_000.0 + 20_000.0 * (boxes as f64 / 3000.0).min(1.0)
    }

    thread_local! {
        static NOW: Cell<Option<Duration>> = const { Cell::new(None) };
        static TICK: Cell<Duration> = const { Cell::new(Duration::ZERO) };
    }

    pub(crate) fn tick() -> Option<Duration> {
        Some(TICK.get())
    }

    /// Makes the clock of this thread as coarse as that of a browser.
    pub(crate) fn set_tick(tick: Duration) {
        TICK.set(tick);
    }

    #[derive(Debug, Clone, Copy)]
    pub(crate) enum Instant {
        Read(std::time::Instant),
        Counted(Duration),
    }

    impl Instant {
        pub(crate) fn now() -> Self {
            NOW.get().map_or_else(|| Self::Read(std::time::Instant::now()), Self::Counted)
        }

        pub(crate) fn elapsed(&self) -> Duration {
            match self {
                Self::Read(then) => then.elapsed(),
                Self::Counted(then) => NOW.get().unwrap_or_default() - *then,
            }
        }
    }

    /// Runs a function on this thread under a clock that starts at zero.
    pub(crate) fn run<T>(what: impl FnOnce() -> T) -> T {
        NOW.set(Some(Duration::ZERO));
        let result = what();
        NOW.set(None);
        result
    }

    /// Advances the clock by nanoseconds. No effect on a real clock.
    pub(crate) fn spend(ns: f64) {
        NOW.set(NOW.get().map(|now| now + Duration::from_nanos(ns as u64)));
    }
}
