//! The threads that help the calling one.

use crate::Unavailable;
use crate::cpu::phases::Phases;
use crate::cpu::placement::CpuPlacement;
use std::sync::{Arc, OnceLock};

/// Rounds of spinning in which a helper waits for the next phase of a frame: about 60 µs. With 10 000 boxes the serial
/// work between two phases of `pair-cache` took 10 to 12 µs.
const LINGER: u32 = 2000;

/// Helpers: own ones, which start when the first frame wants them, or the threads of the program's pool.
#[derive(Debug)]
pub(crate) struct Helpers {
    /// The number of helpers.
    pub(crate) count: u32,
    /// Whether each own one is pinned to its own CPU if that is allowed, and if there is one CPU more than helpers.
    pinned: bool,
    /// The running helpers; unset before the start.
    team: OnceLock<Team>,
    /// Whether to do as if the system refused them.
    #[cfg(test)]
    pub(crate) refused: std::sync::atomic::AtomicBool,
}

/// A pool of helpers that runs.
#[derive(Debug)]
struct Team {
    pool: Arc<rayon::ThreadPool>,
    shared: Arc<Shared>,
    /// Whether the caller may itself be a thread of the pool, as with the program's pool.
    may_call: bool,
}

/// The part of a [`Team`] that an invited helper holds: it may come after the rest is gone.
#[derive(Debug)]
struct Shared {
    phases: Phases,
    /// CPUs of the helpers, and one more for the caller.
    placement: Option<Arc<CpuPlacement>>,
}

impl Helpers {
    /// Makes `count` helpers, without starting them.
    pub(crate) fn new(count: u32, pinned: bool) -> Self {
        Self {
            count,
            pinned,
            team: OnceLock::new(),
            #[cfg(test)]
            refused: false.into(),
        }
    }

    /// Takes the threads of a program's pool, which may run on any core.
    pub(crate) fn of(pool: Arc<rayon::ThreadPool>) -> Self {
        let count = u32::try_from(pool.current_num_threads()).unwrap_or(u32::MAX);
        Self { team: OnceLock::from(Team::over(pool, None, true)), ..Self::new(count, false) }
    }

    /// Starts the helpers, unless they run.
    ///
    /// # Errors
    /// [`Unavailable::ThreadsRefused`]. The next call asks the system again.
    pub(crate) fn start(&self) -> Result<(), Unavailable> {
        #[cfg(test)]
        if self.refused.load(std::sync::atomic::Ordering::Relaxed) {
            return Err(Unavailable::ThreadsRefused { threads: self.count, message: "a test".to_owned() });
        }
        if self.team.get().is_none() {
            let cpus = self.count as usize + 1;
            let placement = if self.pinned { CpuPlacement::choose(cpus).map(Arc::new) } else { None };
            let pool = Arc::new(build_pool(self.count, placement.clone(), 1)?);
            // If two callers start helpers at once, those of one are dropped.
            let _ = self.team.set(Team::over(pool, placement, false));
        }
        Ok(())
    }

    fn team(&self) -> Option<&Team> {
        self.start().ok().and_then(|()| self.team.get())
    }

    /// Begins a frame with up to `count` helpers, who stay between its phases until [`end_frame`](Self::end_frame).
    pub(crate) fn begin_frame(&self, count: usize) {
        if let Some(team) = self.team() {
            team.follow_caller();
            team.shared.phases.begin_frame(count.min(team.most()), || team.invite());
        }
    }

    /// Ends a frame.
    pub(crate) fn end_frame(&self) {
        if let Some(team) = self.team.get() {
            team.shared.phases.end_frame();
        }
    }

    /// Runs `work` here and on up to `count` helpers that come while it lasts. Returns when nobody works on it any
    /// more. The caller runs no other job of its pool meanwhile. Without helpers it does all.
    pub(crate) fn run(&self, count: usize, work: &(dyn Fn() + Sync)) {
        let Some(team) = self.team() else { return work() };
        team.follow_caller();
        let most = team.most();
        team.shared.phases.run(count.min(most), most, work, || team.invite());
    }

    /// Returns the invitations that no helper has taken yet, and the helpers that linger.
    #[cfg(test)]
    pub(crate) fn coming(&self) -> usize {
        self.team().unwrap().shared.phases.coming()
    }
}

impl Team {
    fn over(pool: Arc<rayon::ThreadPool>, placement: Option<Arc<CpuPlacement>>, may_call: bool) -> Self {
        Self { pool, shared: Arc::new(Shared { phases: Phases::default(), placement }), may_call }
    }

    /// Records the CPU of the caller, for helpers that come now and for those whose invitation is not taken yet.
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
            // With one thread less, all would wait here for ever; with one more, that one would.
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
            let helpers = Helpers::new(1, pinned);
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
