//! Work that a caller shares with helpers who may come late, or never.
//!
//! A phase borrows from the caller's stack, but a job of a pool must own its data. The scopes of rayon bridge that by
//! waiting for every job, and while they wait they run other jobs of the caller's pool, any of which may want a lock
//! that the caller holds. Here a job is an invitation and owns no part of a phase: a helper gets the closure from the
//! list of open phases, under its lock, and is counted from then on. When nothing is left to do, the caller takes its
//! phase off the list and waits for the counted helpers only.
//!
//! A frame is several phases. Waking a thread takes longer than many of them, so helpers linger between the phases of
//! a frame: they spin, for a bounded time, until the next phase opens or the frame ends.
//!
//! This needs `unsafe`: a closure that borrows stands in a shared list. Safe code has only scopes, which wait for jobs
//! that never ran.

// The model checker runs the tests with its own threads.
#[cfg(all(test, shuttle))]
use shuttle::{hint, sync};
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::PoisonError;
#[cfg(not(all(test, shuttle)))]
use std::{hint, sync};
use sync::atomic::{AtomicUsize, Ordering};
use sync::{Arc, Condvar, Mutex, MutexGuard};

/// Work of caller and helpers: each calls it once, and it returns when nothing is left to do.
type Work<'a> = &'a (dyn Fn() + Sync);

/// Rounds in which the caller spins for its helpers before it sleeps: about 20 µs. Waking it takes longer than most
/// tasks have left by then.
const SPINS: u32 = if cfg!(all(test, shuttle)) { 2 } else { 1000 };

/// In [`Latch::state`]: the caller sleeps.
const ASLEEP: usize = 1;
/// In [`Latch::state`]: one helper.
const HELPER: usize = 2;

/// The open phases, and the helpers on their way.
#[derive(Default)]
pub(crate) struct Phases {
    list: Mutex<List>,
    /// Changes, under the lock of the list, when a phase opens and when a frame ends. Helpers that linger watch it.
    news: AtomicUsize,
}

#[derive(Default)]
struct List {
    open: Vec<Open>,
    /// Latches of phases that are over, for reuse: a frame allocates none.
    spare: Vec<Arc<Latch>>,
    /// Helpers that will look for a phase: those who linger, and one for each invitation that is not taken yet. An
    /// invitation names no phase, so an old one serves a new phase.
    coming: usize,
    /// Frames that are open, and the number of those that have ended.
    frames: usize,
    ended: usize,
}

/// A phase that can be joined.
struct Open {
    /// Valid while this stands in the list, and while `latch` counts a helper.
    work: Work<'static>,
    /// Helpers that may still join.
    vacant: usize,
    latch: Arc<Latch>,
}

/// The latch on which the caller of a phase waits for its helpers.
#[derive(Default)]
struct Latch {
    /// [`ASLEEP`], and [`HELPER`] times the helpers that have joined and not left.
    state: AtomicUsize,
    /// The first panic of a helper.
    panic: Mutex<Option<Box<dyn Any + Send>>>,
    left: Condvar,
}

impl Phases {
    /// Begins a frame and invites up to `helpers` helpers, who linger until it ends. `invite` makes one
    /// [come](Self::join) at some time, or never.
    pub(crate) fn begin_frame(&self, helpers: usize, invite: impl Fn()) {
        let missing = {
            let mut list = self.list();
            list.frames += 1;
            list.missing(helpers)
        };
        (0..missing).for_each(|_| invite());
    }

    /// Ends a frame: helpers that linger leave.
    pub(crate) fn end_frame(&self) {
        let mut list = self.list();
        list.frames -= 1;
        list.ended = list.ended.wrapping_add(1);
        self.news.fetch_add(1, Ordering::Relaxed);
    }

    /// Runs `work` here and on up to `helpers` helpers that come while it lasts. `invite` makes one [come](Self::join)
    /// at some time, or never; at most `most` are on their way at once. Returns when nobody works on it any more.
    ///
    /// # Panics
    /// With the panic of `work` here, else with the first one on a helper.
    pub(crate) fn run(&self, helpers: usize, most: usize, work: Work<'_>, invite: impl Fn()) {
        let latch = self.list().spare.pop().unwrap_or_default();
        // Made first: nothing leaves this function, not even a panic, before the phase is closed.
        let phase = Joinable { phases: self, latch: &latch };
        // SAFETY: only the lifetime changes. The reference stands in the list until `phase` is dropped, which is
        // within this function, where `work` lives. A helper copies it from the list under the lock, and is counted in
        // the latch under that same lock; it counts itself off after its last use. Dropping `phase` takes the
        // reference off the list and returns when none is counted.
        let work_for_helpers = unsafe { std::mem::transmute::<Work<'_>, Work<'static>>(work) };
        let missing = {
            let mut list = self.list();
            list.open.push(Open { work: work_for_helpers, vacant: helpers, latch: Arc::clone(&latch) });
            self.news.fetch_add(1, Ordering::Relaxed);
            let vacant = list.open.iter().map(|open| open.vacant).sum::<usize>();
            list.missing(vacant.min(most))
        };
        (0..missing).for_each(|_| invite());
        work();
        drop(phase);
        let panic = lock(&latch.panic).take();
        self.list().spare.push(latch);
        if let Some(panic) = panic {
            resume_unwind(panic);
        }
    }

    /// Works on one phase after the other: each time on the one that has been open the longest and lacks helpers.
    /// Lingers for at most `rounds` rounds if there is none, but only in a frame, and only until one ends. Call this
    /// once for each invitation.
    pub(crate) fn join(&self, rounds: u32) {
        let mut list = self.list();
        let (in_frame, ended) = (list.frames > 0, list.ended);
        let mut patient = true;
        loop {
            if let Some((work, latch)) = list.enter() {
                drop(list);
                latch.catch_panic(work);
                list = self.list();
                // Before it leaves the phase: then the caller need not invite another one to the next phase.
                list.coming += 1;
                patient = true;
                latch.leave();
            } else if patient && in_frame && list.ended == ended {
                let seen = self.news.load(Ordering::Relaxed);
                drop(list);
                patient = (0..rounds).any(|_| {
                    hint::spin_loop();
                    self.news.load(Ordering::Relaxed) != seen
                });
                list = self.list();
            } else {
                // Under the lock under which it has found no phase: whoever opens one now does not count on it.
                list.coming -= 1;
                return;
            }
        }
    }

    fn list(&self) -> MutexGuard<'_, List> {
        lock(&self.list)
    }

    /// Returns the invitations that no helper has taken yet, and the helpers that linger.
    #[cfg(test)]
    pub(crate) fn coming(&self) -> usize {
        self.list().coming
    }
}

impl List {
    /// Returns the helpers to invite so that `wanted` are coming, and counts them.
    fn missing(&mut self, wanted: usize) -> usize {
        let missing = wanted.saturating_sub(self.coming);
        self.coming += missing;
        missing
    }

    /// Counts a coming helper in with the phase that has been open the longest and lacks helpers, if there is one.
    fn enter(&mut self) -> Option<(Work<'static>, Arc<Latch>)> {
        let open = self.open.iter_mut().find(|open| open.vacant > 0)?;
        open.vacant -= 1;
        open.latch.state.fetch_add(HELPER, Ordering::Relaxed);
        self.coming -= 1;
        Some((open.work, Arc::clone(&open.latch)))
    }
}

/// An open phase. Dropping it closes the phase and waits for its helpers.
struct Joinable<'a> {
    phases: &'a Phases,
    latch: &'a Arc<Latch>,
}

impl Drop for Joinable<'_> {
    fn drop(&mut self) {
        self.phases.list().open.retain(|open| !Arc::ptr_eq(&open.latch, self.latch));
        self.latch.wait();
    }
}

impl Latch {
    /// Calls `work`, and keeps the first panic. The caller of the phase goes on, and resumes the panic at the end.
    fn catch_panic(&self, work: Work<'_>) {
        let mut end = catch_unwind(AssertUnwindSafe(work));
        if end.is_err() {
            let mut first = lock(&self.panic);
            if first.is_none() {
                *first = std::mem::replace(&mut end, Ok(())).err();
            }
        }
    }

    /// Counts a helper off. The last one wakes the caller if it sleeps.
    fn leave(&self) {
        if self.state.fetch_sub(HELPER, Ordering::AcqRel) == HELPER | ASLEEP {
            // Take and release the lock: then the caller either looks at the state again, or sleeps and can be woken.
            drop(lock(&self.panic));
            self.left.notify_one();
        }
    }

    /// Returns when no helper is counted.
    fn wait(&self) {
        for _ in 0..SPINS {
            if self.state.load(Ordering::Acquire) == 0 {
                return;
            }
            hint::spin_loop();
        }
        self.state.fetch_or(ASLEEP, Ordering::AcqRel);
        let mut held = lock(&self.panic);
        while self.state.load(Ordering::Acquire) != ASLEEP {
            held = self.left.wait(held).unwrap_or_else(PoisonError::into_inner);
        }
        self.state.store(0, Ordering::Relaxed);
    }
}

/// Locks. A poisoned mutex is fine: nothing panics while it holds one, and a panic would leave nothing half-done.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl std::fmt::Debug for Phases {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Phases").finish_non_exhaustive()
    }
}

#[cfg(all(test, shuttle))]
mod shuttle_tests;

#[cfg(all(test, not(shuttle)))]
mod tests {
    use super::*;

    #[test]
    fn absent_helpers_are_neither_awaited_nor_invited_twice() {
        let (phases, asked, worked) = (Phases::default(), AtomicUsize::new(0), AtomicUsize::new(0));
        let work = || _ = worked.fetch_add(1, Ordering::Relaxed);
        for _ in 0..100 {
            phases.run(3, 2, &work, || _ = asked.fetch_add(1, Ordering::Relaxed));
        }
        assert_eq!((asked.load(Ordering::Relaxed), phases.coming(), worked.load(Ordering::Relaxed)), (2, 2, 100));
        // They come now, and find nothing.
        phases.join(0);
        phases.join(0);
        assert_eq!((phases.coming(), worked.load(Ordering::Relaxed)), (0, 100));
    }
}
