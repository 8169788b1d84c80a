//! The collective operations that ranks need.

/// Carries words between ranks. Every rank calls the same operations in the same order.
///
/// If another rank is gone, an implementation ends the job or panics with a message. No operation returns words that
/// it did not receive, and none waits forever.
pub trait Exchange {
    /// This rank, from 0.
    fn rank(&self) -> usize;

    /// The number of ranks, at least 1.
    fn size(&self) -> usize;

    /// Replaces each value by its wrapping sum over all ranks, which pass equally many. Sums of integers don't depend
    /// on their order, so all ranks get the same bits.
    fn sum(&mut self, values: &mut [u64]);

    /// Sends the `k`-th of `size()` equal parts of `send` to rank `k`, and receives the part for this rank from each.
    fn all_to_all(&mut self, send: &[u64], receive: &mut [u64]);

    /// The same with parts of different lengths, in the order of the ranks. Both ends know the lengths.
    fn all_to_all_varcount(
        &mut self,
        send: &[u64],
        send_counts: &[usize],
        receive: &mut [u64],
        receive_counts: &[usize],
    );
}
