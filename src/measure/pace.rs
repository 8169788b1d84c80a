//! How fast a measurement goes beside a program that runs, and how it is told to end.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Work between two rests, a sample more or less.
const SLICE: Duration = Duration::from_millis(2);

/// How long a rest is, in times of the work before it: a tenth of the time is worked.
const REST: u32 = 9;

/// What the thread that measures and the one that waits for it share.
#[derive(Debug, Default)]
pub(crate) struct Pace {
    wish: Mutex<Wish>,
    changed: Condvar,
    /// How long was rested since [`begin`](Self::begin).
    rested_ns: AtomicU64,
}

#[derive(Debug, Default)]
struct Wish {
    gentle: bool,
    stop: bool,
}

impl Pace {
    fn wish(&self) -> MutexGuard<'_, Wish> {
        self.wish.lock().unwrap_or_else(PoisonError::into_inner)
    }

    #[cfg(feature = "this-machine")]
    /// From now on only a tenth of the time is worked.
    pub(crate) fn go_gently(&self) {
        self.wish().gentle = true;
    }

    #[cfg(feature = "this-machine")]
    /// Ends the measurement with the sample that is being taken.
    pub(crate) fn stop(&self) {
        self.wish().stop = true;
        self.changed.notify_all();
    }

    pub(crate) fn is_stopped(&self) -> bool {
        self.wish().stop
    }

    /// Another time of work begins.
    pub(super) fn begin(&self) {
        self.rested_ns.store(0, Relaxed);
    }

    /// What of the time since [`begin`](Self::begin) was worked.
    pub(super) fn worked(&self, since: Instant) -> Duration {
        since.elapsed().saturating_sub(Duration::from_nanos(self.rested_ns.load(Relaxed)))
    }

    /// Rests after work, where that is wished and there was enough. Returns what of the work is still to be rested for, and how long was
    /// rested.
    pub(super) fn rest(&self, worked: Duration) -> (Duration, Duration) {
        let mut wish = self.wish();
        if worked < SLICE || !wish.gentle {
            return (worked, Duration::ZERO);
        }
        let began = Instant::now();
        while !wish.stop && began.elapsed() < worked * REST {
            let left = (worked * REST).saturating_sub(began.elapsed());
            wish = self.changed.wait_timeout(wish, left).unwrap_or_else(PoisonError::into_inner).0;
        }
        let rested = began.elapsed();
        self.rested_ns.fetch_add(u64::try_from(rested.as_nanos()).unwrap_or(u64::MAX), Relaxed);
        (Duration::ZERO, rested)
    }
}

/// One is only ever the same as itself.
impl PartialEq for Pace {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self, other)
    }
}

impl Eq for Pace {}

#[cfg(all(test, feature = "this-machine"))]
mod tests {
    use super::*;
    use std::sync::Arc;

    #[test]
    fn a_tenth_of_the_time_is_worked_once_that_is_wished() {
        let pace = Pace::default();
        assert_eq!(pace.rest(Duration::from_secs(1)), (Duration::from_secs(1), Duration::ZERO));
        pace.go_gently();
        assert_eq!(pace.rest(Duration::from_millis(1)), (Duration::from_millis(1), Duration::ZERO));
        let began = Instant::now();
        let (left, rested) = pace.rest(Duration::from_millis(3));
        assert!(left.is_zero() && rested >= Duration::from_millis(27) && began.elapsed() >= rested);
        assert!(pace.worked(began) < began.elapsed());
    }

    #[test]
    fn a_rest_ends_when_the_measurement_is_stopped() {
        let pace = Arc::new(Pace::default());
        pace.go_gently();
        let rests = std::thread::spawn({
            let pace = Arc::clone(&pace);
            move || pace.rest(Duration::from_secs(1_000_000))
        });
        pace.stop();
        rests.join().unwrap();
        assert!(pace.is_stopped());
    }
}
