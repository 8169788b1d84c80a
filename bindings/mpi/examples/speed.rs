//! Times frames over ranks: medians over frames, with the lower and the upper quartile.
//!
//! ```sh
//! mpirun -np 1 target/release/examples/speed alone      # one rank and no MPI
//! mpirun -np 2 target/release/examples/speed unequal    # cuts by cost and equal cuts; the last rank is slow
//! ```

use mpi::Threading;
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, CommunicatorCollectives, Destination, Source};
use sapwise::algorithm::SimdLevel;
use sapwise::{Aabb, Adaptive, BroadPhase, Pairs, Registry, Tuning};
use sapwise_mpi::{Distributed, MpiExchange, RankPairs};
use sapwise_ranks::Exchange;
use sapwise_scenes::Scenario;
use std::time::{Duration, Instant};

const OBJECTS: usize = 100_000;
const ROUNDS: usize = 15;
const FRAMES: usize = 20;

fn main() {
    let (universe, _) = mpi::initialize_with_threading(Threading::Funneled).expect("MPI was initialised before");
    let world = universe.world();
    match std::env::args().nth(1).as_deref() {
        Some("alone") => alone(&world),
        Some("unequal") => unequal(&world),
        _ => panic!("usage: speed alone|unequal"),
    }
}

/// Lower quartile, median and upper quartile.
fn quartiles(values: &mut [f64]) -> [f64; 3] {
    values.sort_by(f64::total_cmp);
    [1, 2, 3].map(|k| values[k * (values.len() - 1) / 4])
}

fn told(name: &str, values: &mut [f64]) {
    let [low, median, high] = quartiles(values).map(|ns| ns / 1e6);
    println!("{name:24} {median:8.3} ms ({low:.3} to {high:.3}), n = {}", values.len());
}

fn alone(world: &impl Communicator) {
    let registry = Registry::with_cores(1);
    let id = std::env::args().nth(2).unwrap_or("grid-sap@cpu1".to_owned()).parse().expect("no algorithm");
    let steps = vec![sapwise::tuning::Step::new(0, id)];
    let tuning = || Tuning::from_steps(steps.clone()).expect("one step is a tuning");
    let mut ranks = Distributed::new(world, &registry, tuning()).expect("no broad phase");
    let mut plain = Adaptive::new(tuning(), &registry).expect("no broad phase");
    let mut scene = Scenario::Uniform.start(OBJECTS, 1);
    let ids: Vec<u64> = (0..OBJECTS as u64).map(|k| k << 32 | 7).collect();
    let (mut pairs, mut of_rank) = (Pairs::new(), RankPairs::new());
    let (mut without, mut with, mut ratios) = (Vec::new(), Vec::new(), Vec::new());
    for round in 0..ROUNDS * FRAMES {
        scene.advance();
        let time = |work: &mut dyn FnMut()| {
            let began = Instant::now();
            work();
            began.elapsed().as_nanos() as f64
        };
        let mut both = [0.0; 2];
        // Each first in every other frame.
        for k in [round % 2, 1 - round % 2] {
            both[k] = match k {
                0 => time(&mut || plain.find_pairs(scene.boxes(), &mut pairs).expect("no pairs")),
                _ => time(&mut || ranks.find_pairs(scene.boxes(), &ids, &mut of_rank).expect("no pairs")),
            };
        }
        assert_eq!(pairs.len(), of_rank.len());
        if round >= FRAMES {
            without.push(both[0]);
            with.push(both[1]);
            ratios.push(both[1] / both[0]);
        }
    }
    told("no MPI", &mut without);
    told("one rank", &mut with);
    let [low, median, high] = quartiles(&mut ratios);
    println!("one rank over no MPI: {median:.4} ({low:.4} to {high:.4})");
}

/// Returns the number of every rank.
fn all(world: &impl Communicator, own: f64) -> Vec<f64> {
    let mut values = vec![0.0; world.size() as usize];
    world.all_gather_into(&own, &mut values[..]);
    values
}

/// Ranks that search one after another, as if each had the machine for itself. On too few cores concurrent ranks
/// would all be equally slow.
struct Turns {
    exchange: MpiExchange,
    world: SimpleCommunicator,
    /// Counts sends: a frame sends boxes, searches, then sends pairs.
    sent: u64,
    searching: bool,
}

impl Exchange for Turns {
    fn rank(&self) -> usize {
        self.exchange.rank()
    }

    fn size(&self) -> usize {
        self.exchange.size()
    }

    fn sum(&mut self, values: &mut [u64]) {
        self.exchange.sum(values);
    }

    fn all_to_all(&mut self, send: &[u64], receive: &mut [u64]) {
        let next = self.rank() as i32 + 1;
        if std::mem::take(&mut self.searching) && next < self.world.size() {
            self.world.process_at_rank(next).send(&0_u64);
        }
        self.exchange.all_to_all(send, receive);
    }

    fn all_to_all_varcount(
        &mut self,
        send: &[u64],
        send_counts: &[usize],
        receive: &mut [u64],
        receive_counts: &[usize],
    ) {
        self.exchange.all_to_all_varcount(send, send_counts, receive, receive_counts);
        self.sent += 1;
        if self.sent.is_multiple_of(2) {
            return;
        }
        // Nobody begins to search while another rank still exchanges.
        self.exchange.sum(&mut [0]);
        self.searching = true;
        if let Some(before) = self.rank().checked_sub(1) {
            let before = self.world.process_at_rank(before as i32);
            // A blocking receive would occupy a core that another rank needs.
            while before.immediate_probe().is_none() {
                std::thread::sleep(Duration::from_micros(100));
            }
            before.receive::<u64>();
        }
    }
}

fn unequal(world: &impl Communicator) {
    let (rank, size) = (world.rank() as usize, world.size() as usize);
    let slow = rank == size - 1;
    // The last rank has one thread and the portable kernels, the others have two threads.
    let threads = if slow { 1 } else { 2 };
    let mut registry = Registry::with_cores(threads);
    if slow {
        registry.limit_simd(SimdLevel::Portable);
    }
    let objects: usize = std::env::args().nth(2).map_or(200_000, |text| text.parse().expect("no number"));
    let id = |threads: u32| format!("grid-sap@cpu{threads}").parse().expect("no algorithm");
    // Without costs in the tuning: the times of the first frames show the speed of each rank.
    let make = || {
        let steps = vec![sapwise::tuning::Step::new(0, id(threads))];
        let exchange = Turns { exchange: MpiExchange::new(world), world: world.duplicate(), sent: 0, searching: false };
        let tuning = Tuning::from_steps(steps).expect("one step is a tuning");
        sapwise_ranks::Distributed::<Turns>::new(exchange, &registry, tuning).expect("no broad phase")
    };
    // One that cuts when times say so, and one that cuts once, before any frame was timed.
    let mut both = [make(), make()];
    both[1].set_cut_every(Some(u64::MAX));
    let mut scene = Scenario::Uniform.start(objects, 1);
    let mut times = [Vec::new(), Vec::new()];
    let mut pairs = RankPairs::new();
    for frame in 0..(ROUNDS + 3) * FRAMES {
        let (own, ids): (Vec<Aabb>, Vec<u64>) =
            (0..objects).skip(rank).step_by(size).map(|k| (scene.boxes()[k], k as u64)).unzip();
        for (ranks, times) in both.iter_mut().zip(&mut times) {
            ranks.find_pairs(&own, &ids, &mut pairs).expect("no pairs");
            if frame >= 3 * FRAMES {
                times.push((
                    all(world, ranks.last_frame().search_ns as f64),
                    all(world, ranks.last_frame().boxes_searched as f64),
                ));
            }
        }
        scene.advance();
    }
    if rank > 0 {
        return;
    }
    for (name, times) in ["cuts by measured speed", "equal cuts"].into_iter().zip(times) {
        let mut slowest: Vec<f64> = times.iter().map(|(ns, _)| ns.iter().copied().fold(0.0, f64::max)).collect();
        told(&format!("{name}: slowest"), &mut slowest);
        // All boxes over the boxes that all ranks search in a nanosecond.
        let ideal = |(ns, boxes): &(Vec<f64>, Vec<f64>)| {
            boxes.iter().sum::<f64>() / boxes.iter().zip(ns).map(|(b, t)| b / t).sum::<f64>()
        };
        let over = times.iter().map(|t| t.0.iter().copied().fold(0.0, f64::max) / ideal(t));
        let [low, median, high] = quartiles(&mut over.collect::<Vec<_>>());
        let shares: Vec<f64> =
            times.last().map_or(Vec::new(), |(_, boxes)| boxes.iter().map(|b| b / boxes.iter().sum::<f64>()).collect());
        println!("{name}: slowest over balanced {median:.3} ({low:.3} to {high:.3}); shares of the boxes {shares:.3?}");
    }
}
