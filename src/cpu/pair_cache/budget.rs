//! The most pairs that the lists of a frame keep together.

use crate::pairs::Pairs;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// What all lists may hold. A list that is filled takes its part of what the others have left; those that are filled
/// at the same time may exceed the budget by one such part each.
#[derive(Debug)]
pub(super) struct Budget {
    most: usize,
    most_of_list: usize,
    held: AtomicUsize,
}

impl Budget {
    /// Makes the budget of `most` pairs for the lists of `tasks` tasks, which hold `held` pairs. A list may take four
    /// equal shares of a task, because a dense place may lie in its part.
    pub(super) fn new(most: usize, tasks: usize, held: usize) -> Self {
        Self { most, most_of_list: (most / tasks).saturating_mul(4).min(most), held: AtomicUsize::new(held) }
    }

    /// Calls `fill` for a list that may grow by what is left. The list is incomplete if it wanted more.
    #[inline]
    pub(super) fn fill<T>(&self, list: &mut Pairs, fill: impl FnOnce(&mut Pairs) -> T) -> T {
        let before = list.len();
        let left = self.most.saturating_sub(self.held.load(Relaxed));
        list.set_limit(Some(before + left.min(self.most_of_list)));
        let result = fill(list);
        // Modulo 2^n, because a list may shrink.
        self.held.fetch_add(list.len().wrapping_sub(before), Relaxed);
        result
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_hold_what_is_left() {
        let budget = Budget::new(100, 8, 30);
        let mut lists = [20, 60, 60].map(|wanted| (wanted, Pairs::new()));
        let fill = |(wanted, list): &mut (u32, Pairs)| {
            budget.fill(list, |list| (0..*wanted).for_each(|k| list.push(k, k + 1)));
            (list.len(), list.is_complete())
        };
        // 48 are four shares of 12, and 2 are left.
        assert_eq!(lists.each_mut().map(fill), [(20, true), (48, false), (2, false)]);
        budget.fill(&mut lists[1].1, Pairs::clear);
        assert_eq!(fill(&mut (60, Pairs::new())), (48, false));
    }
}
