//! Messages to other ranks, collected in any order and packed in the order of the ranks.

use crate::exchange::Exchange;

/// Messages of `N` words.
#[derive(Debug, Clone)]
pub(crate) struct Outbox<const N: usize> {
    messages: Vec<(u32, [u64; N])>,
    /// Messages for each rank.
    pub(crate) counts: Vec<usize>,
    /// Position of the next message for each rank.
    next: Vec<usize>,
    words: Vec<u64>,
}

impl<const N: usize> Outbox<N> {
    pub(crate) fn new(ranks: usize) -> Self {
        Self { messages: Vec::new(), counts: vec![0; ranks], next: Vec::new(), words: Vec::new() }
    }

    pub(crate) fn clear(&mut self) {
        self.messages.clear();
        self.counts.fill(0);
    }

    #[inline]
    pub(crate) fn push(&mut self, rank: usize, message: [u64; N]) {
        self.counts[rank] += 1;
        self.messages.push((rank as u32, message));
    }

    pub(crate) fn len(&self) -> usize {
        self.messages.len()
    }

    /// Sends the messages, and receives `counts` messages from the ranks.
    pub(crate) fn exchange(&mut self, exchange: &mut impl Exchange, counts: &[usize], received: &mut Vec<u64>) {
        self.pack();
        let words = |counts: &[usize]| counts.iter().map(|count| count * N).collect::<Vec<usize>>();
        received.resize(counts.iter().sum::<usize>() * N, 0);
        exchange.all_to_all_varcount(&self.words, &words(&self.counts), received, &words(counts));
    }

    /// Puts the words of all messages in the order of the ranks; those for one rank in the order of `push`.
    fn pack(&mut self) {
        self.next.clear();
        let mut at = 0;
        for count in &self.counts {
            self.next.push(at);
            at += count * N;
        }
        self.words.resize(at, 0);
        for (rank, message) in &self.messages {
            let next = &mut self.next[*rank as usize];
            self.words[*next..*next + N].copy_from_slice(message);
            *next += N;
        }
    }

    /// Bytes of memory.
    pub(crate) fn bytes(&self) -> usize {
        self.messages.capacity() * size_of::<(u32, [u64; N])>() + self.words.capacity() * 8
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_packed_by_rank_and_keep_their_order() {
        let mut outbox = Outbox::<2>::new(3);
        for round in 0..2 {
            outbox.clear();
            for (rank, word) in [(2, 1), (0, 2), (2, 3), (0, 4)] {
                outbox.push(rank, [word, word + 10 * round]);
            }
            assert_eq!((&outbox.counts[..], outbox.len()), (&[2, 0, 2][..], 4));
            outbox.pack();
            assert_eq!(outbox.words, [2, 4, 1, 3].map(|w| [w, w + 10 * round]).concat());
        }
    }
}
