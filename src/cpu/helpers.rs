//! The threads that help the calling one, and where they run.

use crate::cpu::threads::build_pool;
use core_affinity::CoreId;
use std::cell::Cell;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// A pool whose threads leave the calling thread's core to it.
#[derive(Debug)]
pub(crate) struct Helpers {
    pool: rayon::ThreadPool,
    seats: Option<Seats>,
}

/// Cores for the helpers and one more. A scheduler that wakes a bound helper on the core of the caller would have them take turns
/// there while another core idles.
#[derive(Debug)]
struct Seats {
    cores: Vec<CoreId>,
    /// The core to which no helper is bound, as a position in `cores`.
    free: AtomicUsize,
    /// The core on which the caller last ran, as the system counts them.
    caller: AtomicUsize,
}

thread_local! {
    /// The core to which this helper is bound, as a position in [`Seats::cores`].
    static SEAT: Cell<Option<usize>> = const { Cell::new(None) };
}

impl Helpers {
    /// `count` helpers, each bound to a core of its own where that is wanted and there is one more core than that.
    ///
    /// # Errors
    /// The reason, when the system refuses the threads.
    pub(crate) fn new(count: u32, pinned: bool) -> Result<Self, String> {
        let mut cores = if pinned { core_affinity::get_core_ids().unwrap_or_default() } else { Vec::new() };
        cores.truncate(count as usize + 1);
        let seats = (cores.len() > count as usize).then(|| Seats {
            cores,
            free: AtomicUsize::new(0),
            caller: AtomicUsize::new(usize::MAX),
        });
        Ok(Self { pool: build_pool(count, 1, pinned)?, seats })
    }

    /// Runs `caller` here and `helper` on `count` helpers. Returns when all are done.
    pub(crate) fn run(&self, count: usize, helper: impl Fn() + Sync, caller: impl FnOnce() + Send) {
        if let Some(seats) = &self.seats {
            seats.caller.store(current_core(), Relaxed);
        }
        self.pool.in_place_scope(|scope| {
            for _ in 0..count {
                scope.spawn(|_| {
                    self.make_way();
                    helper();
                });
            }
            caller();
        });
    }

    /// Moves this helper to the free core if it is bound to that of the caller.
    fn make_way(&self) {
        let (Some(seats), Some(index)) = (&self.seats, rayon::current_thread_index()) else { return };
        // The pool bound helper k to core k + 1.
        let seat = SEAT.get().unwrap_or(index + 1);
        if seats.cores[seat].id == seats.caller.load(Relaxed) {
            let free = seats.free.swap(seat, Relaxed);
            core_affinity::set_for_current(seats.cores[free]);
            SEAT.set(Some(free));
        }
    }
}

/// The core on which this thread runs now; a number that no core has where the system does not tell.
fn current_core() -> usize {
    #[cfg(target_os = "linux")]
    return rustix::thread::sched_getcpu();
    #[cfg(not(target_os = "linux"))]
    usize::MAX
}
