//! Ranks that are threads of one process.

use crate::exchange::Exchange;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

/// A rank panics when it has waited this long for another one.
const WAIT_LIMIT: Duration = Duration::from_secs(120);

/// One of several ranks that are threads of this process, for tests and to try the protocol without MPI.
pub struct Threads {
    rank: usize,
    /// Channels to and from each rank, this one too. A closed one shows that the rank has ended.
    to: Vec<Sender<Vec<u64>>>,
    from: Vec<Receiver<Vec<u64>>>,
}

impl Threads {
    /// Runs `work` on one thread for each rank and returns the results in the order of the ranks.
    ///
    /// # Panics
    /// When `work` does, and for 0 ranks.
    pub fn run<T: Send>(ranks: usize, work: impl Fn(Self) -> T + Sync) -> Vec<T> {
        assert!(ranks > 0, "there is no rank to run on");
        let mut all: Vec<Self> = (0..ranks).map(|rank| Self { rank, to: Vec::new(), from: Vec::new() }).collect();
        for from in 0..ranks {
            for to in 0..ranks {
                let (sender, receiver) = channel();
                all[from].to.push(sender);
                all[to].from.push(receiver);
            }
        }
        let work = &work;
        std::thread::scope(|scope| {
            let threads: Vec<_> = all.into_iter().map(|own| scope.spawn(move || work(own))).collect();
            let join =
                |t: std::thread::ScopedJoinHandle<'_, T>| t.join().unwrap_or_else(|p| std::panic::resume_unwind(p));
            threads.into_iter().map(join).collect()
        })
    }
}

impl Exchange for Threads {
    fn rank(&self) -> usize {
        self.rank
    }

    fn size(&self) -> usize {
        self.to.len()
    }

    fn sum(&mut self, values: &mut [u64]) {
        let send = values.repeat(self.size());
        let mut received = vec![0; send.len()];
        self.all_to_all(&send, &mut received);
        let count = values.len();
        values.fill(0);
        for (i, word) in received.into_iter().enumerate() {
            values[i % count] = values[i % count].wrapping_add(word);
        }
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
        let mut at = 0;
        for (to, &count) in self.to.iter().zip(send_counts) {
            // Fails when that rank has ended; receiving from it then fails too.
            let _ = to.send(send[at..at + count].to_vec());
            at += count;
        }
        at = 0;
        for (from, &count) in self.from.iter().zip(receive_counts) {
            let part = from.recv_timeout(WAIT_LIMIT);
            let part = part.unwrap_or_else(|_| panic!("rank {}: another rank has ended or does not answer", self.rank));
            assert_eq!(part.len(), count, "a rank sends another number of words than is awaited");
            receive[at..at + count].copy_from_slice(&part);
            at += count;
        }
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
