//! The exchange over MPI.

use crate::wait::{all_within, end, within};
use mpi::Count;
use mpi::collective::SystemOperation;
use mpi::topology::{Rank, SimpleCommunicator};
use mpi::traits::{Communicator, CommunicatorCollectives, Destination, Source};
use sapwise_ranks::Exchange;
use std::time::Duration;

/// The ranks of an MPI communicator.
///
/// Operations are immediate ones that are polled until a time limit. So a rank that no longer answers ends the job
/// with a message, and nobody waits forever.
pub struct MpiExchange {
    /// A duplicate, so that messages of the program are never taken for ours.
    communicator: SimpleCommunicator,
    wait_limit: Duration,
    /// The own values while their sums replace them.
    addends: Vec<u64>,
}

impl MpiExchange {
    /// The default limit on waiting. It includes what other ranks do between two frames.
    pub const WAIT_LIMIT: Duration = Duration::from_secs(600);

    /// The ranks of a communicator, which it duplicates: a collective operation.
    pub fn new(communicator: &impl Communicator) -> Self {
        Self { communicator: communicator.duplicate(), wait_limit: Self::WAIT_LIMIT, addends: Vec::new() }
    }

    /// The same with another limit on waiting: the time from the begin of an operation on this rank until all ranks
    /// have joined.
    #[must_use]
    pub fn with_wait_limit(self, wait_limit: Duration) -> Self {
        Self { wait_limit, ..self }
    }

    /// Ends the job if a part is longer than MPI can count, 16 GiB. The other ranks may already be in the operation.
    fn check(&self, counts: &[usize]) {
        if let Some(words) = counts.iter().find(|&&count| Count::try_from(count).is_err()) {
            let bytes = words * size_of::<u64>();
            end(&self.communicator, &format!("{bytes} bytes are more than one message holds; use more ranks"));
        }
    }
}

impl<C: Communicator> From<&C> for MpiExchange {
    fn from(communicator: &C) -> Self {
        Self::new(communicator)
    }
}

impl Exchange for MpiExchange {
    fn rank(&self) -> usize {
        self.communicator.rank() as usize
    }

    fn size(&self) -> usize {
        self.communicator.size() as usize
    }

    fn sum(&mut self, values: &mut [u64]) {
        self.addends.clear();
        self.addends.extend_from_slice(values);
        let (communicator, addends) = (&self.communicator, &self.addends[..]);
        mpi::request::scope(|scope| {
            let request = communicator.immediate_all_reduce_into(scope, addends, values, SystemOperation::sum());
            within(self.wait_limit, communicator, "the sums", request);
        });
    }

    fn all_to_all(&mut self, send: &[u64], receive: &mut [u64]) {
        mpi::request::scope(|scope| {
            let request = self.communicator.immediate_all_to_all_into(scope, send, receive);
            within(self.wait_limit, &self.communicator, "the counts", request);
        });
    }

    fn all_to_all_varcount(
        &mut self,
        send: &[u64],
        send_counts: &[usize],
        receive: &mut [u64],
        receive_counts: &[usize],
    ) {
        self.check(send_counts);
        self.check(receive_counts);
        let own = self.rank();
        // Messages only between ranks that have something for each other: most are not neighbours. `MPI_Ialltoallv`
        // sends to all, and after empty parts the next operation of Open MPI 4.1.4 never ended.
        let (mut sends, mut receives, mut kept) = (Vec::new(), Vec::new(), (&send[..0], &mut [][..]));
        let (mut to_send, mut to_receive) = (send, receive);
        for (rank, (&sent, &received)) in send_counts.iter().zip(receive_counts).enumerate() {
            let (part, rest) = to_send.split_at(sent);
            let (place, others) = to_receive.split_at_mut(received);
            (to_send, to_receive) = (rest, others);
            if rank == own {
                kept = (part, place);
            } else {
                sends.extend((sent > 0).then_some((rank, part)));
                receives.extend((received > 0).then_some((rank, place)));
            }
        }
        kept.1.copy_from_slice(kept.0);
        let process = |rank: usize| self.communicator.process_at_rank(rank as Rank);
        mpi::request::multiple_scope(sends.len() + receives.len(), |scope, requests| {
            for (rank, place) in receives {
                requests.add(process(rank).immediate_receive_into(scope, place));
            }
            for (rank, part) in sends {
                requests.add(process(rank).immediate_send(scope, part));
            }
            all_within(self.wait_limit, &self.communicator, "boxes or pairs", requests);
        });
    }
}
