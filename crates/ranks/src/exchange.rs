//! What ranks need of each other: three collective operations on words of 64 bits.

/// Carries words between ranks. Every rank calls the same operations in the same order.
///
/// An implementation that can't go on, because another rank is gone, ends the job or panics with a message: no operation returns with words
/// that are not there, and none waits for ever.
pub trait Exchange {
    /// This rank, from 0.
    fn rank(&self) -> usize;

    /// How many ranks there are, at least 1.
    fn size(&self) -> usize;

    /// Replaces each value by the sum of its values on all ranks, wrapping around. All ranks come with equally many.
    ///
    /// Sums of integers don't depend on their order, so that all ranks go on with the same bits.
    fn sum(&mut self, values: &mut [u64]);

    /// Sends the `k`-th of `size()` equal parts of `send` to rank `k`, and receives the part for this rank from each.
    fn all_to_all(&mut self, send: &[u64], receive: &mut [u64]);

    /// The same with parts of their own lengths, one after another in the order of the ranks. Both ends know the lengths already.
    fn all_to_all_varcount(
        &mut self,
        send: &[u64],
        send_counts: &[usize],
        receive: &mut [u64],
        receive_counts: &[usize],
    );
}
