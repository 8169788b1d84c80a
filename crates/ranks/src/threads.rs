//! Ranks that are threads of one process.

use crate::exchange::Exchange;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// A rank panics when it has waited this long for the others: one of them has ended.
const WAIT_LIMIT: Duration = Duration::from_secs(120);

/// One of several ranks that are threads of this process, for tests and to try the protocol without MPI.
pub struct Threads {
    rank: usize,
    shared: Arc<Shared>,
}

/// What the ranks share.
struct Shared {
    size: usize,
    /// The words of each rank, with the begin of the part for each other rank.
    offers: Vec<Mutex<(Vec<u64>, Vec<usize>)>>,
    gate: Mutex<Gate>,
    changed: Condvar,
}

/// Where ranks wait for each other.
#[derive(Default)]
struct Gate {
    arrived: usize,
    rounds: u64,
    broken: bool,
}

/// Ignores poisoning: the panic itself ends the run.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Threads {
    /// Runs `work` on one thread for each rank and returns the results in the order of the ranks.
    ///
    /// # Panics
    /// When `work` does, and for 0 ranks.
    pub fn run<T: Send>(ranks: usize, work: impl Fn(Self) -> T + Sync) -> Vec<T> {
        assert!(ranks > 0, "there is no rank to run on");
        let shared = Arc::new(Shared {
            size: ranks,
            offers: (0..ranks).map(|_| Mutex::default()).collect(),
            gate: Mutex::default(),
            changed: Condvar::new(),
        });
        std::thread::scope(|scope| {
            let start = |rank| {
                let (own, work) = (Self { rank, shared: Arc::clone(&shared) }, &work);
                scope.spawn(move || work(own))
            };
            let threads: Vec<_> = (0..ranks).map(start).collect();
            let join =
                |t: std::thread::ScopedJoinHandle<'_, T>| t.join().unwrap_or_else(|p| std::panic::resume_unwind(p));
            threads.into_iter().map(join).collect()
        })
    }

    /// Returns once every rank has called it.
    fn meet(&self) {
        let shared = &*self.shared;
        let mut gate = lock(&shared.gate);
        gate.arrived += 1;
        if gate.arrived == shared.size {
            gate.arrived = 0;
            gate.rounds += 1;
            shared.changed.notify_all();
            return;
        }
        let round = gate.rounds;
        while gate.rounds == round && !gate.broken {
            let (next, waited) = shared.changed.wait_timeout(gate, WAIT_LIMIT).unwrap_or_else(PoisonError::into_inner);
            gate = next;
            gate.broken |= waited.timed_out() && gate.rounds == round;
        }
        let broken = gate.broken;
        drop(gate);
        assert!(!broken, "rank {}: another rank has ended or does not answer", self.rank);
    }
}

impl Drop for Threads {
    fn drop(&mut self) {
        if std::thread::panicking() {
            lock(&self.shared.gate).broken = true;
            self.shared.changed.notify_all();
        }
    }
}

impl Exchange for Threads {
    fn rank(&self) -> usize {
        self.rank
    }

    fn size(&self) -> usize {
        self.shared.size
    }

    fn sum(&mut self, values: &mut [u64]) {
        values.clone_into(&mut lock(&self.shared.offers[self.rank]).0);
        self.meet();
        values.fill(0);
        for offer in &self.shared.offers {
            let offer = lock(offer);
            assert_eq!(offer.0.len(), values.len(), "ranks come with different numbers of values");
            values.iter_mut().zip(&offer.0).for_each(|(sum, v)| *sum = sum.wrapping_add(*v));
        }
        self.meet();
    }

    fn all_to_all(&mut self, send: &[u64], receive: &mut [u64]) {
        let counts = vec![send.len() / self.size(); self.size()];
        self.all_to_all_varcount(send, &counts, receive, &counts);
    }

    fn all_to_all_varcount(
        &mut self,
        send: &[u64],
        send_counts: &[usize],
        receive: &mut [u64],
        receive_counts: &[usize],
    ) {
        let offer = (send.to_vec(), crate::outbox::starts(send_counts));
        *lock(&self.shared.offers[self.rank]) = offer;
        self.meet();
        let mut at = 0;
        for (offer, &count) in self.shared.offers.iter().zip(receive_counts) {
            let offer = lock(offer);
            let part = offer.1[self.rank]..offer.1[self.rank + 1];
            assert_eq!(part.len(), count, "a rank sends another number of words than is awaited");
            receive[at..at + count].copy_from_slice(&offer.0[part]);
            at += count;
        }
        self.meet();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_reach_their_ranks_and_sums_are_everywhere() {
        let found = Threads::run(3, |mut ranks| {
            let own = ranks.rank() as u64;
            let mut received = [0; 3];
            ranks.all_to_all(&[10 * own, 10 * own + 1, 10 * own + 2], &mut received);
            let mut sums = [own, u64::MAX];
            ranks.sum(&mut sums);
            (received, sums)
        });
        for (rank, (received, sums)) in found.into_iter().enumerate() {
            let rank = rank as u64;
            assert_eq!((received, sums), ([rank, 10 + rank, 20 + rank], [3, u64::MAX - 2]));
        }
    }

    #[test]
    #[should_panic(expected = "rank 1 ends")]
    fn a_rank_that_panics_ends_the_others() {
        Threads::run(2, |mut ranks| {
            assert!(ranks.rank() != 1, "rank 1 ends");
            // Caught, because the panic of the other rank caused it and must be the one that is seen.
            let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| ranks.sum(&mut [1])));
            assert!(outcome.is_err());
        });
    }
}
