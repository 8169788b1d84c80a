//! The phases under a model checker: random schedules, which switch threads at any atomic, lock or round of spinning.
//! The caller of a phase spins for so few rounds here that it sleeps in many of them.

use super::*;
use shuttle::sync::{Barrier, atomic::AtomicBool};
use shuttle::{check_random, thread};

/// Rounds in which helpers linger: none, about as long as a phase, and until the frame ends. With the last, helpers
/// that miss the end never return.
const ROUNDS: [u32; 3] = [0, 20, u32::MAX];

const HELPERS: usize = 2;

/// The phases, and everyone who was invited to them.
#[derive(Default)]
struct Team {
    phases: Phases,
    invited: Mutex<Vec<thread::JoinHandle<()>>>,
}

impl Team {
    /// Checks `callers` threads with a frame each under many schedules. All helpers leave after the frames.
    fn check(callers: usize, frame: fn(&Phases, &dyn Fn())) {
        for rounds in ROUNDS {
            let run = move || {
                let team = Arc::new(Self::default());
                let call = |_| {
                    let team = Arc::clone(&team);
                    thread::spawn(move || {
                        let invite = || {
                            let helps = Arc::clone(&team);
                            let helper = thread::spawn(move || helps.phases.join(rounds));
                            lock(&team.invited).push(helper);
                        };
                        team.phases.begin_frame(HELPERS, invite);
                        frame(&team.phases, &invite);
                        team.phases.end_frame();
                    })
                };
                let callers: Vec<_> = (0..callers).map(call).collect();
                callers.into_iter().for_each(|caller| caller.join().unwrap());
                std::mem::take(&mut *lock(&team.invited)).into_iter().for_each(|helper| helper.join().unwrap());
                let list = team.phases.list();
                assert_eq!((list.coming, list.open.len(), list.frames), (0, 0, 0));
            };
            check_random(run, 2000);
        }
    }
}

/// Runs a phase of some tasks, the last of which may panic.
fn run_tasks(phases: &Phases, invite: &dyn Fn(), panics: bool) {
    let next = AtomicUsize::new(0);
    let done = [const { AtomicUsize::new(0) }; 4];
    // Stands for the closure, which is gone when `run` returns. Shared, so that a late helper can find that out.
    let open = Arc::new(AtomicBool::new(true));
    let work = || {
        let open = Arc::clone(&open);
        loop {
            let task = next.fetch_add(1, Ordering::SeqCst);
            assert!(open.load(Ordering::SeqCst), "a helper works on a closed phase");
            if task >= done.len() {
                return;
            }
            done[task].fetch_add(1, Ordering::SeqCst);
            assert!(!panics || task + 1 < done.len(), "the last task panics");
        }
    };
    let end = catch_unwind(AssertUnwindSafe(|| phases.run(HELPERS, HELPERS, &work, invite)));
    open.store(false, Ordering::SeqCst);
    let panic = end.err().map(|panic| *panic.downcast::<&str>().unwrap());
    assert_eq!(panic, panics.then_some("the last task panics"));
    assert!(done.iter().all(|done| done.load(Ordering::SeqCst) == 1), "every task is done once");
}

#[test]
fn every_task_of_every_phase_is_done_once() {
    Team::check(1, |phases, invite| (0..3).for_each(|_| run_tasks(phases, invite, false)));
}

#[test]
fn panic_reaches_the_caller_and_helpers_stay() {
    Team::check(1, |phases, invite| (0..3).for_each(|k| run_tasks(phases, invite, k != 2)));
}

#[test]
fn callers_share_helpers() {
    Team::check(2, |phases, invite| (0..2).for_each(|_| run_tasks(phases, invite, false)));
}

/// Each phase waits for all helpers: it deadlocks if one is counted on and does not come.
#[test]
fn helpers_that_are_counted_on_come() {
    Team::check(1, |phases, invite| {
        for _ in 0..3 {
            let all = Barrier::new(HELPERS + 1);
            phases.run(HELPERS, HELPERS, &|| _ = all.wait(), invite);
        }
    });
}
