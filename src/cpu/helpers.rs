//! The threads that help the calling one, and where they run.

use crate::error::Unavailable;
use core_affinity::CoreId;
use std::cell::Cell;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// A pool whose threads leave the calling thread's core to it, or one that a program gave.
#[derive(Debug)]
pub(crate) struct Helpers {
    pool: Arc<rayon::ThreadPool>,
    seats: Option<Seats>,
    /// Whether the caller may be a thread of the pool itself, as it may be of a pool that the program gave.
    may_call: bool,
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
    /// [`Unavailable::ThreadsRefused`].
    pub(crate) fn new(count: u32, pinned: bool) -> Result<Self, Unavailable> {
        let mut cores = if pinned { core_affinity::get_core_ids().unwrap_or_default() } else { Vec::new() };
        cores.truncate(count as usize + 1);
        let seats = (cores.len() > count as usize).then(|| Seats {
            cores,
            free: AtomicUsize::new(0),
            caller: AtomicUsize::new(usize::MAX),
        });
        Ok(Self { pool: Arc::new(build_pool(count, 1, pinned)?), seats, may_call: false })
    }

    /// The threads of a program's pool, which may run on any core.
    pub(crate) fn of(pool: Arc<rayon::ThreadPool>) -> Self {
        Self { pool, seats: None, may_call: true }
    }

    /// Runs `helper` on `count` helpers and `caller` here, which is told how many those are. Returns when all are done.
    ///
    /// A caller that is one of them can't help itself: then there is one less to help.
    pub(crate) fn run(&self, count: usize, helper: impl Fn() + Sync, caller: impl FnOnce(usize) + Send) {
        if let Some(seats) = &self.seats {
            seats.caller.store(current_core(), Relaxed);
        }
        let count = if self.may_call && self.pool.current_thread_index().is_some() {
            count.min(self.pool.current_num_threads() - 1)
        } else {
            count
        };
        self.pool.in_place_scope(|scope| {
            for _ in 0..count {
                scope.spawn(|_| {
                    self.make_way();
                    helper();
                });
            }
            caller(count);
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

/// A pool of `threads` threads, each bound to a core of its own, from core number `first` on, where that is wanted and there
/// are enough.
///
/// # Errors
/// [`Unavailable::ThreadsRefused`].
pub(crate) fn build_pool(threads: u32, first: usize, pinned: bool) -> Result<rayon::ThreadPool, Unavailable> {
    let cores = if pinned { core_affinity::get_core_ids().unwrap_or_default() } else { Vec::new() };
    let bind = move |k: usize| {
        if let Some(&core) = cores.get(first + k).filter(|_| cores.len() >= first + threads as usize) {
            // A refusal leaves the thread to the scheduler, as without pinning.
            core_affinity::set_for_current(core);
        }
    };
    let named = move |k| format!("sapwise-{threads}-{k}");
    let builder = rayon::ThreadPoolBuilder::new().num_threads(threads as usize).thread_name(named).start_handler(bind);
    builder.build().map_err(|e| Unavailable::ThreadsRefused { threads, message: e.to_string() })
}

/// The core on which this thread runs now; a number that no core has where the system does not tell.
fn current_core() -> usize {
    #[cfg(target_os = "linux")]
    return rustix::thread::sched_getcpu();
    #[cfg(not(target_os = "linux"))]
    usize::MAX
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::{Barrier, Mutex};
    use std::thread::{ThreadId, current};

    /// The threads that help when `threads` are asked for, and how many the caller was told.
    fn helping(helpers: &Helpers, threads: usize) -> (Vec<ThreadId>, usize) {
        let (seen, told) = (Mutex::new(Vec::new()), AtomicUsize::new(usize::MAX));
        let note = || seen.lock().unwrap().push(current().id());
        helpers.run(threads, note, |count| told.store(count, Relaxed));
        (seen.into_inner().unwrap(), told.into_inner())
    }

    #[test]
    fn a_programs_threads_help_and_a_caller_among_them_does_not_help_itself() {
        for size in [1, 2, 4] {
            let pool = Arc::new(build_pool(size, 0, false).unwrap());
            let size = size as usize;
            let own = pool.broadcast(|_| current().id());
            let helpers = Helpers::of(Arc::clone(&pool));
            let (seen, told) = helping(&helpers, size);
            assert!(seen.len() == size && told == size && seen.iter().all(|id| own.contains(id)));
            let (seen, told) = pool.install(|| helping(&helpers, size));
            assert!(seen.len() == size - 1 && told == size - 1 && seen.iter().all(|id| own.contains(id)));
        }
    }

    /// Were one helper less started, none of them would get past the barrier.
    #[test]
    fn all_helpers_work_at_the_same_time() {
        let pool = Arc::new(build_pool(3, 0, false).unwrap());
        let helpers = Helpers::of(Arc::clone(&pool));
        let all = Barrier::new(4);
        helpers.run(3, || _ = all.wait(), |_| _ = all.wait());
        let others = Barrier::new(3);
        pool.install(|| helpers.run(3, || _ = others.wait(), |_| _ = others.wait()));
    }
}
