//! The threads that help the calling one, and where they run.

use crate::cpu::phases::Phases;
use crate::error::Unavailable;
use core_affinity::CoreId;
use std::cell::Cell;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// A pool whose threads leave the calling thread's core to it, or one that a program gave.
#[derive(Debug)]
pub(crate) struct Helpers {
    pool: Arc<rayon::ThreadPool>,
    shared: Arc<Shared>,
    /// Whether the caller may be a thread of the pool itself, as it may be of a pool that the program gave.
    may_call: bool,
}

/// What a helper that was invited finds when it comes, which may be after all else of this is gone.
#[derive(Debug)]
struct Shared {
    phases: Phases,
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
    /// [`Unavailable::ThreadsRefused`].
    pub(crate) fn new(count: u32, pinned: bool) -> Result<Self, Unavailable> {
        let mut cores = if pinned { core_affinity::get_core_ids().unwrap_or_default() } else { Vec::new() };
        cores.truncate(count as usize + 1);
        let seats = (cores.len() > count as usize).then(|| Seats {
            cores,
            free: AtomicUsize::new(0),
            caller: AtomicUsize::new(usize::MAX),
        });
        Ok(Self::over(Arc::new(build_pool(count, 1, pinned)?), seats, false))
    }

    /// The threads of a program's pool, which may run on any core.
    pub(crate) fn of(pool: Arc<rayon::ThreadPool>) -> Self {
        Self::over(pool, None, true)
    }

    fn over(pool: Arc<rayon::ThreadPool>, seats: Option<Seats>, may_call: bool) -> Self {
        Self { pool, shared: Arc::new(Shared { phases: Phases::default(), seats }), may_call }
    }

    /// Runs `work` here and on up to `count` helpers, those that come while it lasts. Returns when no one works on it any more.
    ///
    /// A caller that is one of them can't help itself: then there is one less to help. It runs no other job of its pool meanwhile.
    pub(crate) fn run(&self, count: usize, work: &(dyn Fn() + Sync)) {
        if let Some(seats) = &self.shared.seats {
            seats.caller.store(current_core(), Relaxed);
        }
        let most = self.pool.current_num_threads();
        let most = if self.may_call && self.pool.current_thread_index().is_some() { most - 1 } else { most };
        self.shared.phases.run(count.min(most), most, work, || {
            let shared = Arc::clone(&self.shared);
            self.pool.spawn(move || {
                shared.make_way();
                shared.phases.join();
            });
        });
    }

    /// Invitations that no helper has come upon yet.
    #[cfg(test)]
    pub(crate) fn invited(&self) -> usize {
        self.shared.phases.invited()
    }
}

impl Shared {
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
    use std::sync::atomic::AtomicBool;
    use std::sync::{Barrier, Mutex, mpsc};
    use std::thread::{ThreadId, current};

    /// The threads that work where `threads` helpers are wanted and `all` are there at once, the caller among them.
    fn working(helpers: &Helpers, threads: usize, all: usize) -> Vec<ThreadId> {
        let (seen, all) = (Mutex::new(Vec::new()), Barrier::new(all));
        helpers.run(threads, &|| {
            seen.lock().unwrap().push(current().id());
            // Were it one less, no one would get past this; were it one more, that one would be left behind.
            all.wait();
        });
        seen.into_inner().unwrap()
    }

    #[test]
    fn a_programs_threads_help_and_a_caller_among_them_does_not_help_itself() {
        for size in [1, 2, 4] {
            let pool = Arc::new(build_pool(size, 0, false).unwrap());
            let size = size as usize;
            let own = pool.broadcast(|_| current().id());
            let helpers = Helpers::of(Arc::clone(&pool));
            let seen = working(&helpers, size, size + 1);
            assert!(seen.len() == size + 1 && seen.iter().filter(|id| own.contains(id)).count() == size);
            let seen = pool.install(|| working(&helpers, size, size));
            assert!(seen.len() == size && seen.iter().all(|id| own.contains(id)));
        }
    }

    /// As many invitations as the pool has threads wait in its queue, however many frames call meanwhile.
    #[test]
    fn a_busy_pool_is_neither_waited_for_nor_flooded() {
        let pool = Arc::new(build_pool(2, 0, false).unwrap());
        let helpers = Helpers::of(Arc::clone(&pool));
        let (came, here) = mpsc::channel();
        let gates: Vec<_> = (0..2)
            .map(|_| {
                let (came, (open, gate)) = (came.clone(), mpsc::channel::<()>());
                pool.spawn(move || {
                    came.send(()).unwrap();
                    let _ = gate.recv();
                });
                open
            })
            .collect();
        (0..2).for_each(|_| here.recv().unwrap());
        let worked = AtomicUsize::new(0);
        for _ in 0..1000 {
            helpers.run(2, &|| _ = worked.fetch_add(1, Relaxed));
        }
        assert_eq!((worked.load(Relaxed), helpers.invited()), (1000, 2));
        drop(gates);
        // The old invitations serve a phase that comes later.
        assert_eq!(working(&helpers, 2, 3).len(), 3);
    }

    #[test]
    fn a_panic_in_the_programs_pool_reaches_the_caller() {
        let pool = Arc::new(build_pool(1, 0, false).unwrap());
        let helpers = Helpers::of(Arc::clone(&pool));
        let (both, done) = (Barrier::new(2), AtomicBool::new(false));
        let caller = current().id();
        let run = || {
            helpers.run(1, &|| {
                both.wait();
                assert!(current().id() == caller, "a helper panics");
                done.store(true, Relaxed);
            });
        };
        let caught = std::panic::catch_unwind(std::panic::AssertUnwindSafe(run)).unwrap_err();
        assert_eq!((caught.downcast_ref(), done.into_inner()), (Some(&"a helper panics"), true));
        // The pool's thread is none the worse.
        assert_eq!(working(&helpers, 1, 2).len(), 2);
    }
}
