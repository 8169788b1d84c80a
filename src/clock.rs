//! The clock by which frames are timed.

#[cfg(test)]
pub(crate) use counted::Instant;
#[cfg(not(any(test, all(target_family = "wasm", target_os = "unknown"))))]
pub(crate) use std::time::Instant;

/// Whether the clock runs. If not, every time is zero and nothing may be learned from it.
pub(crate) const TICKS: bool = !cfg!(all(target_family = "wasm", target_os = "unknown"));

/// Replaces the standard library's clock, which traps in WebAssembly without a system. A crate that asks a browser
/// for its clock needs imports that other hosts lack.
#[cfg(all(not(test), target_family = "wasm", target_os = "unknown"))]
#[derive(Debug, Clone, Copy)]
pub(crate) struct Instant;

#[cfg(all(not(test), target_family = "wasm", target_os = "unknown"))]
impl Instant {
    pub(crate) fn now() -> Self {
        Self
    }

    #[expect(clippy::unused_self, reason = "same signature as in the standard library")]
    pub(crate) fn elapsed(&self) -> std::time::Duration {
        std::time::Duration::ZERO
    }
}

/// A clock for tests that replay recorded times: it shows what was [spent](counted::spend) while something
/// [runs](counted::run).
#[cfg(test)]
pub(crate) mod counted {
    use std::cell::Cell;
    use std::time::Duration;

    /// Nanoseconds of a decision, and of comparing boxes with those of the previous frame, while the program uses the
    /// caches. Means of five runs of `sapwise run` on the Zen 5 host of `datasets/`: 11 to 17 µs (34 µs in the
    /// shortest run) and 0.6 to 1.7 µs.
    pub(crate) const DECISION_NS: f64 = 14_000.0;
    pub(crate) const LOOK_NS: f64 = 2_000.0;

    /// Nanoseconds of a sample of boxes, from the same runs: 4 µs on average in frames of `fragmentation` with 12 to
    /// 2000 boxes, 19 to 24 µs from 3000 boxes on.
    pub(crate) fn sample_ns(boxes: usize) -> f64 {
        5_000.0 + 15_000.0 * (boxes as f64 / 3000.0).min(1.0)
    }

    thread_local!(static NOW: Cell<Option<Duration>> = const { Cell::new(None) });

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
