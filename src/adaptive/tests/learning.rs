//! Courses on made-up machines: corrections, switches and trials of the policy. No clock is read.

use super::super::decision::{Choice, Reason};
use super::super::epoch::Epoch;
use super::super::policy::Policy;
use super::tuning;
use crate::algorithm::{FrameKind, FrameWork, Load};
use crate::{AlgorithmId, Tuning};
use std::ops::Range;
use std::sync::Arc;

/// Returns the true nanoseconds of a frame of an algorithm, by its position, the number of objects and the frame.
pub(super) type Truth = dyn Fn(usize, f64, usize) -> f64;

/// One frame of a course.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    chosen: usize,
    reason: Reason,
    predicted_ns: f64,
    /// Without noise.
    pub(super) real_ns: f64,
    /// The least expected cost of the candidate that ran and of the runner-up.
    cheapest_ns: f64,
    /// The least true cost of all candidates.
    best_ns: f64,
}

/// Pseudorandom numbers from 0 to 1.
pub(super) struct Chance(pub(super) u64);

impl Chance {
    pub(super) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Returns a number of an approximately normal distribution with the standard deviation 1.
    pub(super) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.next()).sum::<f64>() - 6.0
    }
}

fn policy(tuning: Tuning) -> Policy {
    let count = tuning.costs.len();
    Policy::new(tuning, &vec![None; count], &vec![true; count])
}

/// Frames between two decisions, as in short frames.
const APART: usize = 8;

/// Runs one decided frame.
fn ran(policy: &mut Policy, candidate: usize, ns: f64, work: Option<FrameWork>) {
    let mut epoch = policy.epoch(candidate);
    policy.ran(candidate, Some(ns), work, &mut epoch);
    epoch.frames += 1;
    policy.observe(candidate, &epoch, work);
}

/// Runs these frames of `objects` objects on a machine with these true costs, with a noise of 10 %.
pub(super) fn run(policy: &mut Policy, frames: Range<usize>, objects: u32, truth: &Truth) -> Vec<Frame> {
    run_told(policy, frames, objects, truth, &|_, _| None)
}

/// Does the same with the work of each frame, by the position of the algorithm and the frame.
fn run_told(
    policy: &mut Policy,
    frames: Range<usize>,
    objects: u32,
    truth: &Truth,
    work: &dyn Fn(usize, usize) -> Option<FrameWork>,
) -> Vec<Frame> {
    let count = policy.tuning.costs.len();
    let mut chance = Chance(17);
    let load = Load { objects, ..Load::default() };
    let mut running: Option<(Choice, Epoch, Option<FrameWork>)> = None;
    let mut woken = false;
    let frame = |at: usize| {
        let woke = std::mem::take(&mut woken);
        let rests = |epoch: &Epoch| (epoch.frames as usize) < APART || policy.tries() && !policy.ends_trial();
        let choice = match running.take() {
            Some((choice, epoch, work)) if !woke && rests(&epoch) => {
                running = Some((choice, epoch, work));
                choice
            }
            before => {
                if let Some((choice, epoch, work)) = before {
                    policy.observe(choice.chosen, &epoch, work);
                }
                let ended = if policy.ends_trial() { policy.end_trial() } else { None };
                let choice = ended.unwrap_or_else(|| policy.choose(&load).unwrap());
                running = Some((choice, policy.epoch(choice.chosen), None));
                choice
            }
        };
        let of = |k: usize| truth(k, f64::from(objects), at);
        let noisy_ns = of(choice.chosen) * (0.1 * chance.normal()).exp();
        let (_, epoch, last) = running.as_mut().unwrap();
        *last = work(choice.chosen, at);
        woken = { *epoch }.add(Some(noisy_ns), *last);
        policy.ran(choice.chosen, Some(noisy_ns), *last, epoch);
        epoch.frames += 1;
        let predicted_ns = choice.predicted_ns.unwrap();
        let cheapest_ns = choice.runner_up.map_or(predicted_ns, |(_, ns)| ns.min(predicted_ns));
        let best_ns = (0..count).map(of).fold(f64::INFINITY, f64::min);
        let real_ns = of(choice.chosen);
        Frame { chosen: choice.chosen, reason: choice.reason, predicted_ns, real_ns, cheapest_ns, best_ns }
    };
    let frames = frames.map(frame).collect();
    if let Some((choice, epoch, work)) = running {
        policy.observe(choice.chosen, &epoch, work);
    }
    frames
}

/// Returns the number of frames that ran a candidate.
fn count(frames: &[Frame], candidate: usize) -> usize {
    frames.iter().filter(|f| f.chosen == candidate).count()
}

/// Returns the time over that of the cheapest candidate of each frame, less 1.
fn regret(frames: &[Frame]) -> f64 {
    frames.iter().map(|f| f.real_ns).sum::<f64>() / frames.iter().map(|f| f.best_ns).sum::<f64>() - 1.0
}

#[test]
fn tuning_of_another_machine_are_corrected_by_the_frames_that_run() {
    // All cost three to four times their predictions, and the predicted cheapest is not the cheapest. The third is
    // never tried, because its prediction is 40 % higher.
    let wrong = tuning(&[("grid-sap@cpu1", 0.0, 100.0), ("sap@cpu1", 0.0, 110.0), ("brute@cpu1", 0.0, 140.0)]);
    let truth = |k: usize, n: f64, _: usize| n * [390.0, 330.0, 480.0][k];
    let mut policy = policy(wrong);
    let before = run(&mut policy, 0..300, 1000, &truth);
    assert_eq!(before[0].chosen, 0);
    let after = run(&mut policy, 300..900, 1000, &truth);
    let regret = regret(&after);
    assert!(regret < 0.03, "{regret}");
    // And the expectation is what a frame takes.
    let last = after.iter().rev().find(|f| f.reason == Reason::Stayed).unwrap();
    assert!((last.predicted_ns / truth(last.chosen, 1000.0, 0) - 1.0).abs() < 0.1, "{last:?}");
}

#[test]
fn a_frame_of_a_trial_that_fails_ends_the_trial() {
    let mut policy = policy(tuning(&[("grid-sap@cpu1", 0.0, 100.0), ("sap@cpu1", 0.0, 110.0)]));
    let load = Load::of_objects(1000);
    let explores = |policy: &mut Policy| policy.choose(&load).unwrap().reason == Reason::Explored;
    let began = (0..300).any(|_| {
        let explored = explores(&mut policy);
        if !explored {
            ran(&mut policy, 0, 1e5, None);
        }
        explored
    });
    assert!(began && explores(&mut policy));
    policy.failed();
    assert!(!explores(&mut policy));
}

#[test]
fn a_trial_ends_where_the_load_makes_it_hopeless() {
    // For 100 objects each takes about 12 us, for 20 000 the second takes six times as long.
    let mut policy = policy(tuning(&[("grid-sap@cpu1", 10_000.0, 20.0), ("brute@cpu1", 0.0, 125.0)]));
    let mut tries = |objects| {
        let choice = policy.choose(&Load::of_objects(objects)).unwrap();
        if !policy.tries() {
            ran(&mut policy, choice.chosen, 12_000.0, None);
        }
        policy.tries().then_some(choice.chosen)
    };
    let tried = (0..300).find_map(|_| tries(100));
    assert_eq!((tried, tries(100), tries(20_000)), (Some(1), Some(1), None));
}

#[test]
fn without_learning_wrong_tuning_stay_wrong() {
    let wrong = tuning(&[("grid-sap@cpu1", 0.0, 100.0), ("brute@cpu1", 0.0, 120.0)]);
    let truth = |k: usize, n: f64, _: usize| n * [300.0, 100.0][k];
    let mut policy = policy(wrong);
    policy.learns = false;
    assert!(run(&mut policy, 0..500, 1000, &truth).iter().all(|f| f.chosen == 0));
    assert!(!policy.has_learned());
}

#[test]
fn a_clock_that_throttles_moves_every_expectation_and_no_choice() {
    let right = tuning(&[("grid-sap@cpu1", 0.0, 100.0), ("brute@cpu1", 0.0, 130.0)]);
    let truth = |k: usize, n: f64, at: usize| n * [100.0, 130.0][k] * if at < 300 { 1.0 } else { 1.6 };
    let mut policy = policy(right);
    let frames = run(&mut policy, 0..600, 1000, &truth);
    assert!(frames.iter().all(|f| f.chosen == 0 || f.reason == Reason::Explored));
    let late = frames[500..].iter().filter(|f| f.chosen == 0);
    assert!(late.clone().all(|f| (f.predicted_ns / 160_000.0 - 1.0).abs() < 0.15), "{:?}", frames[599]);
    // The expected cost of the other has risen too, although it never ran.
    assert!(frames[590].cheapest_ns > 140_000.0);
}

#[test]
fn a_core_that_another_program_takes_is_left_and_found_again() {
    // Two threads are faster, but from frame 300 to 900 one frame in eight waits 4 ms for a core.
    let right = tuning_of_threads();
    let truth = |k: usize, n: f64, at: usize| {
        let waits = k == 1 && (300..900).contains(&at) && at.is_multiple_of(8);
        n * [100.0, 60.0][k] + if waits { 4e6 } else { 0.0 }
    };
    let mut policy = policy(right);
    let frames = run(&mut policy, 0..6000, 1000, &truth);
    let [before, during, after] = [0..300, 500..900, 5000..6000].map(|range| count(&frames[range], 1));
    assert!(before > 285, "{before} of 300 frames before");
    assert!(during < 40, "{during} of 400 frames beside the other program");
    assert!(after > 900, "{after} of 1000 frames after");
}

fn tuning_of_threads() -> Tuning {
    let mut tuning = tuning(&[("grid-sap@cpu1", 0.0, 100.0), ("grid-sap@cpu2", 0.0, 60.0)]);
    tuning.costs[1].algorithm = AlgorithmId::cpu("grid-sap", 2);
    tuning
}

#[test]
fn one_disturbed_frame_changes_no_choice() {
    let right = tuning(&[("grid-sap@cpu1", 0.0, 100.0), ("brute@cpu1", 0.0, 115.0)]);
    let truth = |k: usize, n: f64, at: usize| n * [100.0, 115.0][k] * if at % 150 == 149 { 50.0 } else { 1.0 };
    let frames = run(&mut policy(right), 0..900, 1000, &truth);
    let others = frames.iter().filter(|f| f.chosen != 0 && f.reason != Reason::Explored).count();
    // A trial that was lucky is followed by a few frames that set it right.
    assert!(others < 9, "{others} of 900");
}

#[test]
fn exploring_is_rare_bounded_and_can_be_turned_off() {
    let near = || {
        let costs: Vec<(String, f64)> = (0..8).map(|k| (format!("m{k}@cpu1"), 100.0 + 8.0 * f64::from(k))).collect();
        let costs: Vec<(&str, f64, f64)> = costs.iter().map(|(id, ns)| (id.as_str(), 0.0, *ns)).collect();
        tuning(&costs)
    };
    let truth = |k: usize, n: f64, at: usize| n * (100.0 + 8.0 * ((k + at / 500) % 8) as f64);
    let frames = run(&mut policy(near()), 0..4000, 1000, &truth);
    let explored: Vec<usize> = (0..frames.len()).filter(|&k| frames[k].reason == Reason::Explored).collect();
    assert!(explored.len() >= 5, "{explored:?}");
    // Two frames in a row are one trial.
    assert!(explored.windows(2).all(|w| w[1] - w[0] == 1 || w[1] - w[0] >= 8), "{explored:?}");
    let price: f64 = explored.iter().map(|&k| frames[k].predicted_ns - frames[k].cheapest_ns).sum();
    let spent: f64 = frames.iter().map(|f| f.cheapest_ns).sum();
    assert!(price <= 0.01 * spent, "{price} of {spent}");
    let mut quiet = policy(near());
    quiet.explores = false;
    assert!(run(&mut quiet, 0..4000, 1000, &truth).iter().all(|f| f.reason != Reason::Explored));
    // What is expected to cost over twice as much is not tried.
    let far = tuning(&[("grid-sap@cpu1", 0.0, 100.0), ("brute@cpu1", 0.0, 210.0)]);
    let truth = |k: usize, n: f64, _: usize| n * [100.0, 210.0][k];
    assert!(run(&mut policy(far), 0..4000, 1000, &truth).iter().all(|f| f.chosen == 0));
}

#[test]
fn load_that_flickers_about_a_crossover_causes_no_switch() {
    // 100 n and 50 n + 50 000 cross at 1000.
    let mut policy = policy(tuning(&[("grid-sap@cpu1", 0.0, 100.0), ("sap@cpu1", 50_000.0, 50.0)]));
    policy.learns = false;
    for k in 0..300 {
        let choice = policy.choose(&Load::of_objects([1010, 1000, 989][k % 3])).unwrap();
        ran(&mut policy, choice.chosen, 1e5, None);
        assert!(k == 0 || choice.reason != Reason::Switched, "frame {k}");
    }
}

/// Returns a policy whose first candidate is incremental, costs half of the second and falls back to it.
fn policy_with_incremental() -> Policy {
    let mut costs = tuning(&[("sap@cpu1", 0.0, 10.0), ("grid-sap@cpu1", 0.0, 20.0)]);
    costs.costs[0].curve = costs.costs[0].curve.clone().with_fallback(Arc::clone(&costs.costs[1].curve.work), 1.0);
    Policy::new(costs, &[Some(0), None], &[true; 2])
}

#[test]
fn what_rebuilds_too_often_is_left_and_taken_up_again() {
    // Up to frame 600 the first rebuilds in one frame of three, which the tuning does not predict.
    let mut policy = policy_with_incremental();
    let rebuilds = |at: usize| at < 600 && at.is_multiple_of(3);
    let truth = move |k: usize, n: f64, at: usize| n * [if rebuilds(at) { 90.0 } else { 10.0 }, 20.0][k];
    let kind = |at: usize| if rebuilds(at) { FrameKind::Rebuilt } else { FrameKind::Updated };
    let work = |k: usize, at: usize| (k == 0).then(|| FrameWork::new(kind(at), 1.0));
    let frames = run_told(&mut policy, 0..3000, 1000, &truth, &work);
    // (10 + 10 + 90) / 3 is more than 20. Rare trials check that.
    let [first, second, last] = [0..100, 200..600, 2500..3000].map(|range| count(&frames[range], 0));
    assert!(first > 0 && second < 260, "{second} of 400");
    assert!(last > 450, "{last} of 500");
}

/// Frames of an incremental algorithm alone can't show whether the machine is slower than predicted, or the savings in
/// this scene are smaller.
#[test]
fn what_keeps_work_and_spares_less_than_believed_is_left_in_the_end() {
    let mut policy = policy_with_incremental();
    let truth = |k: usize, n: f64, _: usize| n * [35.0, 20.0][k];
    let work = |k: usize, _: usize| (k == 0).then(|| FrameWork::new(FrameKind::Updated, 1.0));
    let frames = run_told(&mut policy, 0..10_000, 1000, &truth, &work);
    let kept = count(&frames[3000..], 0);
    assert!(kept < 350, "{kept} of 7000");
}

/// A frame on two threads that stops at a breakpoint for a second says nothing about later frames.
#[test]
fn one_long_frame_bans_no_number_of_threads() {
    let truth = |k: usize, n: f64, at: usize| n * [100.0, 60.0][k] + if at == 500 { 1.0e9 } else { 0.0 };
    let mut policy = policy(tuning_of_threads());
    let frames = run(&mut policy, 0..2000, 1000, &truth);
    assert!(count(&frames[400..500], 1) > 90);
    let away = count(&frames[501..], 0);
    assert!(away < 250, "on one thread for {away} of the 1500 frames after the long one");
}

#[test]
fn a_scene_that_makes_a_method_quadratic_is_left_to_another() {
    let costs = [("grid-sap@cpu1", 0.0, 50.0), ("bvh@cpu1", 0.0, 100.0)];
    // From frame 200 on the first costs a hundred times as much.
    let truth = |k: usize, n: f64, at: usize| n * [if at < 200 { 50.0 } else { 5000.0 }, 100.0][k];
    let frames = run(&mut policy(tuning(&costs)), 0..1200, 1000, &truth);
    assert!(count(&frames[..200], 0) > 190);
    let dear = count(&frames[200..], 0);
    assert!(dear <= 6, "{dear} frames spent on it");
}

#[test]
fn a_machine_that_becomes_four_times_as_slow_is_believed_within_a_hundred_frames() {
    let mut policy = policy(tuning(&[("sap@cpu1", 0.0, 20.0), ("grid-sap@cpu1", 0.0, 30.0)]));
    let truth = |k: usize, n: f64, at: usize| n * [20.0, 30.0][k] * if at < 200 { 1.0 } else { 4.0 };
    run(&mut policy, 0..300, 1000, &truth);
    let expected_ns = run(&mut policy, 300..301, 1000, &truth)[0].predicted_ns;
    assert!((0.8..1.2).contains(&(expected_ns / 80_000.0)), "{expected_ns}");
}
