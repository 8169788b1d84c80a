//! The threads that help the calling one.

use crate::cpu::phases::Phases;
use crate::cpu::placement::CpuPlacement;
use crate::error::Unavailable;
use std::sync::Arc;

/// Rounds of spinning in which a helper waits for the next phase of a frame: about 60 µs. With 10 000 boxes the serial
/// work between two phases of `pair-cache` took 10 to 12 µs.
const LINGER: u32 = 2000;

/// A pool of helpers: ours, or the program's.
#[derive(Debug)]
pub(crate) struct Helpers {
    pool: Arc<rayon::ThreadPool>,
    shared: Arc<Shared>,
    /// Whether the caller may itself be a thread of the pool, as with the program's pool.
    may_call: bool,
}

/// The part of [`Helpers`] that an invited helper holds: it may come after the rest is gone.
#[derive(Debug)]
struct Shared {
    phases: Phases,
    /// CPUs of the helpers, and one more for the caller.
    placement: Option<Arc<CpuPlacement>>,
}

impl Helpers {
    /// Makes `count` helpers. Pins each to its own CPU if that is wanted and allowed, and if there is one CPU more than
    /// helpers.
    ///
    /// # Errors
    /// [`Unavailable::ThreadsRefused`].
    pub(crate) fn new(count: u32, pinned: bool) -> Result<Self, Unavailable> {
        let placement = if pinned { CpuPlacement::choose(count as usize + 1).map(Arc::new) } else { None };
        Ok(Self::over(Arc::new(build_pool(count, placement.clone(), 1)?), placement, false))
    }

    /// Takes the threads of a program's pool, which may run on any core.
    pub(crate) fn of(pool: Arc<rayon::ThreadPool>) -> Self {
        Self::over(pool, None, true)
    }

    fn over(pool: Arc<rayon::ThreadPool>, placement: Option<Arc<CpuPlacement>>, may_call: bool) -> Self {
        Self { pool, shared: Arc::new(Shared { phases: Phases::default(), placement }), may_call }
    }

    /// Begins a frame with up to `count` helpers, who stay between its phases until [`end_frame`](Self::end_frame).
    pub(crate) fn begin_frame(&self, count: usize) {
        self.follow_caller();
        self.shared.phases.begin_frame(count.min(self.most()), || self.invite());
    }

    /// Ends a frame.
    pub(crate) fn end_frame(&self) {
        self.shared.phases.end_frame();
    }

    /// Runs `work` here and on up to `count` helpers that come while it lasts. Returns when nobody works on it any
    /// more. The caller runs no other job of its pool meanwhile.
    pub(crate) fn run(&self, count: usize, work: &(dyn Fn() + Sync)) {
        self.follow_caller();
        let most = self.most();
        self.shared.phases.run(count.min(most), most, work, || self.invite());
    }

    /// Notes where the caller runs, for helpers that come now and for those whose invitation is not taken yet.
    fn follow_caller(&self) {
        if let Some(placement) = &self.shared.placement {
            placement.follow_caller();
        }
    }

    /// Returns the most helpers of the calling thread. One that is a thread of the pool can't help itself.
    fn most(&self) -> usize {
        self.pool.current_num_threads() - usize::from(self.may_call && self.pool.current_thread_index().is_some())
    }

    fn invite(&self) {
        let shared = Arc::clone(&self.shared);
        self.pool.spawn(move || {
            if let Some(placement) = &shared.placement {
                placement.make_way();
            }
            shared.phases.join(LINGER);
        });
    }

    /// Returns the invitations that no helper has taken yet, and the helpers that linger.
    #[cfg(test)]
    pub(crate) fn coming(&self) -> usize {
        self.shared.phases.coming()
    }
}

/// Makes a pool of `threads` threads. Pins each to its own CPU if there are enough and that is
/// allowed.
///
/// # Errors
/// [`Unavailable::ThreadsRefused`].
pub fn pinned_pool(threads: u32) -> Result<rayon::ThreadPool, Unavailable> {
    build_pool(threads, CpuPlacement::choose(threads as usize).map(Arc::new), 0)
}

/// Makes a pool of `threads` threads, of which number k has position `first` + k of the placement.
fn build_pool(
    threads: u32,
    placement: Option<Arc<CpuPlacement>>,
    first: usize,
) -> Result<rayon::ThreadPool, Unavailable> {
    let pin = move |k: usize| {
        if let Some(placement) = &placement {
            placement.pin(first + k);
        }
    };
    let named = move |k| format!("sapwise-{threads}-{k}");
    let builder = rayon::ThreadPoolBuilder::new().num_threads(threads as usize).thread_name(named).start_handler(pin);
    builder.build().map_err(|e| Unavailable::ThreadsRefused { threads, message: e.to_string() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::{Barrier, Mutex};
    use std::thread::{ThreadId, current};

    /// Returns the threads that work if `threads` helpers are wanted, `all` of them at once, the caller among them.
    fn working(helpers: &Helpers, threads: usize, all: usize) -> Vec<ThreadId> {
        let (seen, all) = (Mutex::new(Vec::new()), Barrier::new(all));
        helpers.run(threads, &|| {
            seen.lock().unwrap().push(current().id());
            // With one thread less, nobody would get past this; with one more, that one would be left behind.
            all.wait();
        });
        seen.into_inner().unwrap()
    }

    #[test]
    fn threads_of_a_program_help_a_caller_among_them() {
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

    #[cfg(target_os = "linux")]
    #[test]
    fn helpers_are_pinned_if_wanted_allowed_and_possible() {
        for pinned in [false, true] {
            let helpers = Helpers::new(1, pinned).unwrap();
            let usable = core_affinity::get_core_ids().unwrap().len();
            let cpus = Mutex::new(Vec::new());
            let (all, caller) = (Barrier::new(2), current().id());
            helpers.run(1, &|| {
                all.wait();
                if current().id() != caller {
                    cpus.lock().unwrap().push(core_affinity::get_core_ids().unwrap().len());
                }
            });
            let one = pinned && crate::cpu::placement::may_pin() && usable > 1;
            assert_eq!(cpus.into_inner().unwrap(), [if one { 1 } else { usable }]);
        }
    }
}
