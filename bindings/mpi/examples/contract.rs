//! The tests that `tools/mpi.sh` runs over several numbers of ranks.
//!
//! ```sh
//! mpirun -np 4 target/debug/examples/contract scenarios    # every scenario and the edge cases
//! mpirun -np 4 target/debug/examples/contract hang         # endless frames, with a limit of two seconds on waiting
//! ```

#[path = "../../../crates/ranks/tests/harness/mod.rs"]
mod harness;

use harness::{Owners, distributed, edge_cases, play};
use mpi::Threading;
use mpi::traits::Communicator;
use sapwise_mpi::{Distributed, MpiExchange};
use sapwise_scenes::Scenario;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

const OWNERS: [Owners; 4] = [Owners::Random, Owners::Parts, Owners::One, Owners::Even];
const FRAMES: u64 = 200;

fn main() {
    let (universe, threading) =
        mpi::initialize_with_threading(Threading::Funneled).expect("MPI was initialised before");
    assert!(threading >= Threading::Funneled, "this MPI allows no threads");
    let world = universe.world();
    let what = std::env::args().nth(1);
    let done = catch_unwind(AssertUnwindSafe(|| match what.as_deref() {
        Some("scenarios") => scenarios(&world),
        Some("hang") => hang(&world),
        _ => panic!("usage: contract scenarios|hang"),
    }));
    // Otherwise this rank and the others would wait for each other at the end of MPI.
    if done.is_err() {
        world.abort(3);
    }
}

fn scenarios(world: &impl Communicator) {
    let began = Instant::now();
    let mut ranks: Distributed = distributed::<MpiExchange>(world);
    edge_cases(&mut ranks);
    ranks.set_cut_every(Some(1));
    edge_cases(&mut ranks);
    let mut pairs = 0;
    for (k, scenario) in Scenario::ALL.into_iter().enumerate() {
        // Every other scenario cuts when times say so, which is rare in tests.
        ranks.set_cut_every((k % 2 == 0).then_some(7));
        let owners = if k % 2 == 1 { Owners::Random } else { OWNERS[k / 2 % 4] };
        pairs += play(&mut ranks, scenario, 400, FRAMES, owners);
    }
    assert!(pairs > 0, "rank {} got no pair at all", world.rank());
    if world.rank() == 0 {
        let (ranks, seconds) = (world.size(), began.elapsed().as_secs_f64());
        println!(
            "mpi: {ranks} ranks: {} scenarios of {FRAMES} frames and the edge cases as one process, in {seconds:.1} s",
            Scenario::ALL.len()
        );
    }
}

fn hang(world: &impl Communicator) {
    let exchange = MpiExchange::new(world).with_wait_limit(Duration::from_secs(2));
    let mut ranks: Distributed = distributed::<MpiExchange>(exchange);
    println!("rank {} is process {}", world.rank(), std::process::id());
    play(&mut ranks, Scenario::Uniform, 200, u64::MAX, Owners::Random);
}
