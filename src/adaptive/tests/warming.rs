//! No frame waits for the preparation of an algorithm.

use super::*;
use crate::clock::Instant;
use std::sync::{Arc, Condvar, Mutex};
use std::time::Duration;

/// Limit of waits that would last for ever after a fault.
const LONG: Duration = Duration::from_secs(60);

/// Holds the preparation of an algorithm until it is opened.
#[derive(Default)]
struct Gate {
    /// Number of preparations that began, and whether they may end.
    state: Mutex<(u32, bool)>,
    changed: Condvar,
}

impl Gate {
    fn pass(&self) {
        let mut state = self.state.lock().unwrap();
        state.0 += 1;
        self.changed.notify_all();
        let (state, _) = self.changed.wait_timeout_while(state, LONG, |s| !s.1).unwrap();
        assert!(state.1, "nobody has let it go");
    }

    fn wait_until_asked(&self) {
        let (state, _) = self.changed.wait_timeout_while(self.state.lock().unwrap(), LONG, |s| s.0 == 0).unwrap();
        assert!(state.0 > 0, "it was never to get ready");
    }

    fn open(&self) {
        self.state.lock().unwrap().1 = true;
        self.changed.notify_all();
    }
}

/// Returns a choice between `slow@gpu0` and one other.
fn beside(other: &str, costs: [(f64, f64); 2]) -> (Adaptive, Arc<Gate>) {
    let gate = Arc::<Gate>::default();
    let mut registry = Registry::with_cores(1);
    let made = Arc::clone(&gate);
    registry.add("slow@gpu0".parse().unwrap(), 1, move || {
        let gate = Arc::clone(&made);
        Ok(Box::new(MadeUp(|| Ok(()), move || gate.pass())))
    });
    registry.add("fragile@gpu1".parse().unwrap(), 1, || fragile(3));
    let [(call, object), (slow_call, slow_object)] = costs;
    (fixed_of(tuning(&[(other, call, object), ("slow@gpu0", slow_call, slow_object)]), &registry), gate)
}

#[test]
fn frames_go_on_while_the_runner_up_waits_for_its_driver_and_it_is_chosen_once_it_is_ready() {
    // 10 n = 500 + 5 n at n = 100.
    let (mut adaptive, gate) = beside("brute@cpu1", [(0.0, 10.0), (500.0, 5.0)]);
    for _ in 0..3 {
        assert_eq!(chosen(&mut adaptive, 90).0, "brute@cpu1");
    }
    gate.wait_until_asked();
    // Now it would be cheaper, and is away.
    for _ in 0..200 {
        assert_eq!(chosen(&mut adaptive, 128).0, "brute@cpu1");
    }
    gate.open();
    let began = Instant::now();
    while chosen(&mut adaptive, 128).0 != "slow@gpu0" {
        assert!(began.elapsed() < LONG, "it was not chosen when it was ready");
    }
    assert_eq!(gate.state.lock().unwrap().0, 1, "it was to get ready once");
}

#[test]
fn where_nothing_else_can_run_the_frame_waits_for_it() {
    let (mut adaptive, gate) = beside("fragile@gpu1", [(1.0, 0.0), (1.2, 0.0)]);
    assert_eq!(chosen(&mut adaptive, 30).0, "fragile@gpu1");
    assert_eq!(chosen(&mut adaptive, 30).0, "fragile@gpu1");
    gate.wait_until_asked();
    assert_eq!(chosen(&mut adaptive, 30).0, "fragile@gpu1");
    std::thread::scope(|scope| {
        scope.spawn(|| gate.open());
        assert_eq!(chosen(&mut adaptive, 30), ("slow@gpu0".to_owned(), Reason::FellBack));
    });
}

#[test]
fn what_gets_ready_ends_with_the_module() {
    let (mut adaptive, gate) = beside("brute@cpu1", [(0.0, 10.0), (0.0, 11.0)]);
    // The first frame is decided by the number of objects; the second is the first with a runner-up.
    (0..2).for_each(|_| _ = chosen(&mut adaptive, 90));
    gate.wait_until_asked();
    let held = Arc::strong_count(&gate);
    std::thread::scope(|scope| {
        scope.spawn(|| gate.open());
        drop(adaptive);
    });
    assert!(Arc::strong_count(&gate) < held, "the thread holds its algorithm still");
}

#[test]
fn one_that_panics_while_it_gets_ready_is_never_chosen() {
    let mut registry = Registry::with_cores(1);
    registry.add("panics@gpu0".parse().unwrap(), 1, || Ok(Box::new(MadeUp(|| Ok(()), || panic!("of the test")))));
    let mut adaptive = fixed_of(tuning(&[("brute@cpu1", 0.0, 10.0), ("panics@gpu0", 500.0, 5.0)]), &registry);
    (0..2).for_each(|_| _ = chosen(&mut adaptive, 90));
    // Waits for it, and goes on without it.
    adaptive.prepare(90);
    for _ in 0..100 {
        assert_eq!(chosen(&mut adaptive, 128).0, "brute@cpu1");
    }
}

#[test]
fn what_is_settled_on_is_here_when_a_trial_of_another_one_ends() {
    let (gate, open) = (Arc::<Gate>::default(), Arc::<Gate>::default());
    open.open();
    let mut registry = Registry::with_cores(1);
    for (id, ns, gate) in [("settled@gpu0", 1e6, &gate), ("near@cpu1", 1.2e6, &open)] {
        let gate = Arc::clone(gate);
        registry.add(id.parse().unwrap(), 1, move || {
            let gate = Arc::clone(&gate);
            Ok(Box::new(MadeUp(spends(ns), move || gate.pass())))
        });
    }
    let tuning = tuning(&[("settled@gpu0", 1e6, 0.0), ("near@cpu1", 1.2e6, 0.0)]);
    let mut adaptive = Adaptive::new(tuning, &registry).unwrap();
    let frames: Vec<_> = clock::counted::run(|| (100..400).map(|n| chosen(&mut adaptive, n)).collect());
    gate.open();
    assert!(frames.iter().any(|(_, reason)| *reason == Reason::Explored));
    // The incumbent is not prepared for more boxes during a trial: it would be away when the trial ends.
    assert_eq!(gate.state.lock().unwrap().0, 0);
    assert!(frames.iter().all(|(_, reason)| *reason != Reason::FellBack));
}
