//! The clock by which frames are timed.

#[cfg(test)]
pub(crate) use counted::Instant;
#[cfg(not(any(test, all(target_family = "wasm", target_os = "unknown"))))]
pub(crate) use std::time::Instant;

/// Whether there is one. Without it all that is timed takes no time, which must not be learned from.
pub(crate) const TICKS: bool = !cfg!(all(target_family = "wasm", target_os = "unknown"));

/// In place of the standard library's, which traps where WebAssembly runs without a system: the module has no clock but what its host hands
/// it, and a crate that asks a browser for one brings imports that other hosts lack.
#[cfg(all(not(test), target_family = "wasm", target_os = "unknown"))]
#[derive(Debug, Clone, Copy)]
pub(crate) struct Instant;

#[cfg(all(not(test), target_family = "wasm", target_os = "unknown"))]
impl Instant {
    pub(crate) fn now() -> Self {
        Self
    }

    #[expect(clippy::unused_self, reason = "as of the clock in the standard library")]
    pub(crate) fn elapsed(&self) -> std::time::Duration {
        std::time::Duration::ZERO
    }
}

/// For tests that replay recorded times: a clock that shows what was [spent](counted::spend) while something [runs](counted::run) under it.
#[cfg(test)]
pub(crate) mod counted {
    use std::cell::Cell;
    use std::time::Duration;

    /// What a decision takes between two frames of a program, which needs the caches for itself, and to compare boxes with those of the frame before, in
    /// nanoseconds: about the means of five runs of `sapwise run` on the Zen 5 host of `datasets/`, 11 to 17 us (34 in the shortest) and 0.6 to 1.7 us.
    pub(crate) const DECISION_NS: f64 = 14_000.0;
    pub(crate) const LOOK_NS: f64 = 2_000.0;

    /// What a sample of so many boxes takes, in the same way: 4 us in the mean over frames of `fragmentation` with 12 to 2000 boxes, 19 to 24 of 3000 and more.
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

    /// Runs something on this thread under a clock that starts at nought.
    pub(crate) fn run<T>(what: impl FnOnce() -> T) -> T {
        NOW.set(Some(Duration::ZERO));
        let result = what();
        NOW.set(None);
        result
    }

    /// So many nanoseconds have passed. Without effect on a real clock.
    pub(crate) fn spend(ns: f64) {
        NOW.set(NOW.get().map(|now| now + Duration::from_nanos(ns as u64)));
    }
}
