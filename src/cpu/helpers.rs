//! The threads that help the calling one, and where they run.

use crate::cpu::phases::Phases;
use crate::cpu::seats::Seats;
use crate::error::Unavailable;
use std::sync::Arc;

/// A pool of ours, or one that a program gave.
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
    /// Where the helpers are bound, and one seat more for the caller.
    seats: Option<Arc<Seats>>,
}

impl Helpers {
    /// `count` helpers, each bound to a CPU of its own where that is wanted, allowed, and there is one more CPU than that.
    ///
    /// # Errors
    /// [`Unavailable::ThreadsRefused`].
    pub(crate) fn new(count: u32, pinned: bool) -> Result<Self, Unavailable> {
        let seats = if pinned { Seats::take(count as usize + 1).map(Arc::new) } else { None };
        Ok(Self::over(Arc::new(build_pool(count, seats.clone(), 1)?), seats, false))
    }

    /// The threads of a program's pool, which may run on any core.
    pub(crate) fn of(pool: Arc<rayon::ThreadPool>) -> Self {
        Self::over(pool, None, true)
    }

    fn over(pool: Arc<rayon::ThreadPool>, seats: Option<Arc<Seats>>, may_call: bool) -> Self {
        Self { pool, shared: Arc::new(Shared { phases: Phases::default(), seats }), may_call }
    }

    /// Runs `work` here and on up to `count` helpers, those that come while it lasts. Returns when no one works on it any more.
    ///
    /// A caller that is one of them can't help itself: then there is one less to help. It runs no other job of its pool meanwhile.
    pub(crate) fn run(&self, count: usize, work: &(dyn Fn() + Sync)) {
        if let Some(seats) = &self.shared.seats {
            seats.follow_caller();
        }
        let most = self.pool.current_num_threads();
        let most = if self.may_call && self.pool.current_thread_index().is_some() { most - 1 } else { most };
        self.shared.phases.run(count.min(most), most, work, || {
            let shared = Arc::clone(&self.shared);
            self.pool.spawn(move || {
                if let Some(seats) = &shared.seats {
                    seats.make_way();
                }
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

/// A pool of `threads` threads, each bound to a CPU of its own where there are enough and [that is allowed](crate::cpu::seats::may_bind).
///
/// # Errors
/// [`Unavailable::ThreadsRefused`].
#[cfg(feature = "measure")]
pub(crate) fn seated_pool(threads: u32) -> Result<rayon::ThreadPool, Unavailable> {
    build_pool(threads, Seats::take(threads as usize).map(Arc::new), 0)
}

/// A pool of `threads` threads, of which number k has seat `first` + k.
fn build_pool(threads: u32, seats: Option<Arc<Seats>>, first: usize) -> Result<rayon::ThreadPool, Unavailable> {
    let bind = move |k: usize| {
        if let Some(seats) = &seats {
            seats.bind(first + k);
        }
    };
    let named = move |k| format!("sapwise-{threads}-{k}");
    let builder = rayon::ThreadPoolBuilder::new().num_threads(threads as usize).thread_name(named).start_handler(bind);
    builder.build().map_err(|e| Unavailable::ThreadsRefused { threads, message: e.to_string() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed};
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
            let pool = Arc::new(build_pool(size, None, 0).unwrap());
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
        let pool = Arc::new(build_pool(2, None, 0).unwrap());
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
        let pool = Arc::new(build_pool(1, None, 0).unwrap());
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

    /// Each is bound before it works, and says where it works.
    #[cfg(target_os = "linux")]
    #[test]
    fn helpers_are_bound_where_that_is_wanted_allowed_and_possible() {
        for pinned in [false, true] {
            let helpers = Helpers::new(1, pinned).unwrap();
            let usable = core_affinity::get_core_ids().unwrap().len();
            let bound = Mutex::new(Vec::new());
            let (all, caller) = (Barrier::new(2), current().id());
            helpers.run(1, &|| {
                all.wait();
                if current().id() != caller {
                    bound.lock().unwrap().push(core_affinity::get_core_ids().unwrap().len());
                }
            });
            let one = pinned && crate::cpu::seats::may_bind() && usable > 1;
            assert_eq!(bound.into_inner().unwrap(), [if one { 1 } else { usable }]);
        }
    }
}
