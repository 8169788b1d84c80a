//! Frames whose times were recorded on real machines, run through the policy: what its choices lose. No clock is read.

use super::super::policy::Policy;
use super::learning::Chance;
use super::recorded::{COLD, FORGOTTEN, FROM_NOTHING, Kinds, Recorded, Spot};
use crate::stats::mean;
use crate::{FrameKind, FrameWork, Tuning};

/// Frames of one load.
type Stretch<'a> = (&'a Spot, usize);

/// What disturbs the frames: by number of threads and frame, a factor and nanoseconds.
type Disturbance<'a> = dyn Fn(u32, usize) -> (f64, f64) + 'a;

/// What a course cost.
#[derive(Debug, Clone)]
struct Spent {
    /// Nanoseconds of each frame, of the one chosen.
    ns: Vec<f64>,
    chosen: Vec<usize>,
    /// Of each algorithm run always, and of the best of each stretch: by the means.
    alone_ns: Vec<f64>,
    oracle_ns: f64,
}

impl Spent {
    fn total_ns(&self) -> f64 {
        self.ns.iter().sum()
    }

    /// Over the best single algorithm.
    fn over_single(&self) -> f64 {
        self.total_ns() / self.alone_ns.iter().copied().fold(f64::INFINITY, f64::min) - 1.0
    }

    /// Over the best of each stretch.
    fn over_oracle(&self) -> f64 {
        self.total_ns() / self.oracle_ns - 1.0
    }
}

fn run(machine: &Recorded, tuning: Tuning, course: &[Stretch<'_>], seed: u64, disturbed: &Disturbance<'_>) -> Spent {
    let ids = &machine.ids;
    let kept: Vec<Option<usize>> = ids.iter().map(|id| (id.method() == "pair-cache").then_some(0)).collect();
    let bvh = ids.iter().position(|id| id.to_string() == "bvh@cpu1").unwrap();
    let mut policy = Policy::new(tuning, &kept, vec![true; ids.len()]);
    let mut chance = Chance(seed);
    (0..20).for_each(|_| _ = chance.next());
    let (mut before, mut kept_last, mut frame) = (None, None::<usize>, 0);
    let mut spent = Spent { ns: Vec::new(), chosen: Vec::new(), alone_ns: vec![0.0; ids.len()], oracle_ns: 0.0 };
    for (spot, frames) in course {
        let turn = (chance.next() * 1e6) as usize;
        let kinds: Vec<Kinds> = spot.ns.iter().map(|ns| Kinds::of(ns)).collect();
        for at in 0..*frames {
            policy.moves(spot.load.moved);
            let chosen = policy.choose(&spot.load).unwrap().chosen;
            let samples = &spot.ns[chosen];
            let incremental = kept[chosen].is_some();
            let place = if incremental { turn + at } else { (chance.next() * 1e6) as usize };
            let mut ns = samples[place % samples.len()];
            let mut work = None;
            if incremental {
                let begins = kept_last.is_none_or(|last| frame - last > FORGOTTEN);
                work = Some(kinds[chosen].work(ns));
                if begins {
                    ns = ns.max(FROM_NOTHING * spot.mean_ns(bvh));
                    work = Some(FrameWork::new(FrameKind::Rebuilt, ns / spot.mean_ns(chosen)));
                }
                kept_last = Some(frame);
            } else if before != Some(chosen) {
                ns *= COLD;
            }
            let disturb = |ns: f64, k: usize| {
                let (factor, more) = disturbed(ids[k].threads(), frame);
                ns * factor + more
            };
            let ns = disturb(ns, chosen);
            policy.ran(chosen, ns, work);
            before = Some(chosen);
            spent.ns.push(ns);
            spent.chosen.push(chosen);
            let means: Vec<f64> = (0..ids.len()).map(|k| disturb(spot.mean_ns(k), k)).collect();
            spent.alone_ns.iter_mut().zip(&means).for_each(|(sum, ns)| *sum += ns);
            spent.oracle_ns += means.iter().copied().fold(f64::INFINITY, f64::min);
            frame += 1;
        }
    }
    spent
}

fn undisturbed(_: u32, _: usize) -> (f64, f64) {
    (1.0, 0.0)
}

/// Up and down again between two numbers of objects, a stretch of so many frames for each quarter of an octave.
fn swing<'a>(machine: &'a Recorded, scenario: &str, [low, high]: [f64; 2], frames: usize) -> Vec<Stretch<'a>> {
    let steps = ((high / low).log2() * 2.0).ceil() as usize;
    let at = |k: usize| (machine.spot(scenario, low * (high / low).powf(k as f64 / steps as f64)), frames);
    (0..=steps).chain((0..steps).rev()).map(at).collect()
}

const XEON: &str = "intel-xeon-2c-full--2026-11-23";
const ZEN3: &str = "amd-epyc-zen3-2c-full--2026-11-22";
const SCENARIOS: [&str; 7] = ["uniform", "clustered", "slab", "mixed", "fast", "gravity", "fragmentation"];

/// Scenes that stay as they are, scenes that grow and shrink, and streams of our own: levels that load, bursts, fights that start and end, chases,
/// and objects that are pooled and returned.
fn courses(machine: &Recorded) -> Vec<Vec<Stretch<'_>>> {
    let steady =
        SCENARIOS.iter().flat_map(|s| [100.0, 800.0, 3000.0, 20_000.0].map(|n| vec![(machine.spot(s, n), 1500)]));
    let swings = SCENARIOS.iter().map(|s| swing(machine, s, [30.0, 30_000.0], 30));
    let turns = [300.0, 1000.0, 5000.0].into_iter().flat_map(|n| {
        let between = |scenarios: [&str; 2]| (0..6).map(|k| (machine.spot(scenarios[k % 2], n), 250)).collect();
        let pooled = (0..30).map(|k| (machine.spot("mixed", [n, 2.0 * n][k % 2]), 50)).collect();
        [between(["uniform", "gravity"]), between(["clustered", "fast"]), pooled]
    });
    let loads = SCENARIOS.map(|s| vec![(machine.spot(s, 50.0), 200), (machine.spot(s, 10_000.0), 600)]);
    let bursts =
        SCENARIOS.map(|s| (0..12).map(|k| (machine.spot(s, [300.0, 20_000.0][k % 2]), [60, 30][k % 2])).collect());
    steady.chain(swings).chain(turns).chain(loads).chain(bursts).collect()
}

/// The tuning of another machine, for the algorithms of this one.
fn of_another(machine: &Recorded, other: &Recorded) -> Tuning {
    let mut tuning = other.predicted();
    tuning.costs.retain(|c| machine.ids.contains(&c.algorithm));
    // By their positions algorithms are told apart below.
    assert!(tuning.costs.iter().map(|c| &c.algorithm).eq(&machine.ids));
    tuning
}

/// The promise is no more than 3 % over the best single algorithm. It holds on average, and not yet in every run.
#[test]
fn over_recorded_runs_the_choice_costs_little_more_than_the_best_single_algorithm() {
    let machines = [XEON, ZEN3].map(Recorded::of);
    for (k, machine) in machines.iter().enumerate() {
        let tunings = [machine.measured(), machine.predicted(), of_another(machine, &machines[1 - k])];
        for (tuning, what) in tunings.iter().zip(["measured", "predicted", "of another machine"]) {
            let spent: Vec<Spent> = courses(machine)
                .iter()
                .flat_map(|course| (0..8).map(|seed| run(machine, tuning.clone(), course, seed, &undisturbed)))
                .collect();
            let mut over: Vec<f64> = spent.iter().map(Spent::over_single).collect();
            over.sort_by(f64::total_cmp);
            let share = over.partition_point(|o| *o <= 0.03) as f64 / over.len() as f64;
            let told = format!(
                "{what}, {} runs: mean {:.4}, within 3 % {share:.3}, 95th percentile {:.3}, worst {:.3}, over the oracle {:.4}",
                over.len(),
                mean(&over),
                over[over.len() * 95 / 100],
                over[over.len() - 1],
                mean(&spent.iter().map(Spent::over_oracle).collect::<Vec<_>>())
            );
            println!("{told}");
            assert!(mean(&over) < 0.025 && share > 0.78, "{told}");
        }
    }
}

/// A second, or ten, at a breakpoint: within 120 frames the choices are those of a run without it.
#[test]
fn after_a_stall_the_choices_are_what_they_were() {
    for file in [XEON, ZEN3] {
        let machine = Recorded::of(file);
        let mut lost = Vec::new();
        for course in courses(&machine).iter().filter(|c| c.len() == 1) {
            let spot = course[0].0;
            let means: Vec<f64> = (0..machine.ids.len()).map(|k| spot.mean_ns(k)).collect();
            for (seed, stall_ns) in (0..8).flat_map(|seed| [(seed, 1e9), (seed, 1e10)]) {
                let stalled = move |_: u32, at: usize| (1.0, if at == 500 { stall_ns } else { 0.0 });
                let after = |disturbed: &dyn Fn(u32, usize) -> (f64, f64)| -> f64 {
                    let spent = run(&machine, machine.measured(), course, seed, disturbed);
                    mean(&spent.chosen[620..].iter().map(|&k| means[k]).collect::<Vec<_>>())
                };
                lost.push(after(&stalled) / after(&undisturbed) - 1.0);
            }
        }
        lost.sort_by(f64::total_cmp);
        let told = format!(
            "{file}: mean {:.4}, 95th percentile {:.3} of {}",
            mean(&lost),
            lost[lost.len() * 95 / 100],
            lost.len()
        );
        println!("{told}");
        assert!(mean(&lost).abs() < 0.01 && lost[lost.len() * 95 / 100] < 0.05, "{told}");
    }
}

/// Of choices in scenes of at least so many objects: their loss over the best of each frame from 300 frames after a disturbance began on, and from 300
/// frames after it ended on; and what it would be in the first of these if they were still those of before. It disturbs what runs on two threads, from
/// frame 500 to 1100.
fn lost_beside(disturbed: (f64, f64), least_objects: u32) -> [f64; 3] {
    let mut lost = [Vec::new(), Vec::new(), Vec::new()];
    for file in [XEON, ZEN3] {
        let machine = Recorded::of(file);
        let shared =
            |threads: u32, at: usize| if threads > 1 && (500..1100).contains(&at) { disturbed } else { (1.0, 0.0) };
        for course in courses(&machine).iter().filter(|c| c.len() == 1 && c[0].0.load.objects >= least_objects) {
            let means: Vec<f64> = (0..machine.ids.len()).map(|k| course[0].0.mean_ns(k)).collect();
            let ns = |k: usize, at: usize| {
                let (factor, more_ns) = shared(machine.ids[k].threads(), at);
                means[k] * factor + more_ns
            };
            for seed in 0..4 {
                let spent = run(&machine, machine.measured(), &[(course[0].0, 2000)], seed, &shared);
                let over = |frames: std::ops::Range<usize>, chosen: &dyn Fn(usize) -> usize| {
                    let least = |at: usize| (0..means.len()).map(|k| ns(k, at)).fold(f64::INFINITY, f64::min);
                    let best: f64 = frames.clone().map(least).sum();
                    frames.map(|at| ns(chosen(at), at)).sum::<f64>() / best - 1.0
                };
                lost[0].push(over(800..1100, &|at| spent.chosen[at]));
                lost[1].push(over(1400..2000, &|at| spent.chosen[at]));
                lost[2].push(over(800..1100, &|at| spent.chosen[at - 600]));
            }
        }
    }
    let lost = lost.map(|lost| mean(&lost));
    println!("{disturbed:?} on two threads: beside it {:.4}, after it {:.4}, unmoved {:.4}", lost[0], lost[1], lost[2]);
    lost
}

#[test]
fn beside_another_program_the_number_of_threads_is_left_in_most_scenes() {
    let [beside, after, unmoved] = lost_beside((1.6, 0.0), 0);
    assert!(beside < 0.05 && after < 0.03 && unmoved > 0.06);
}

/// A line that went from core to core in 15 ns takes 220 after a move on the Zen 3 host. A frame that waits for a hundred and fifty of them takes 30 us more.
#[test]
fn where_a_host_moves_cores_apart_and_back_the_choice_follows_without_being_told() {
    let [apart, together, unmoved] = lost_beside((1.0, 30_000.0), 2048);
    assert!(apart < 0.015 && unmoved > 0.015 && together < 0.02);
}
