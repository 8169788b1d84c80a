//! The pairs that the tasks of a frame find.

use crate::cpu::{Workers, split};
use crate::{Error, Pairs};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// Fewest pairs that all threads join: fewer are copied in less time than a phase takes.
const SMALLEST_JOIN: usize = 16_384;

/// See the module.
#[derive(Debug, Default)]
pub(crate) struct Outputs {
    /// One list for each task.
    lists: Vec<Pairs>,
    /// Whether a list has exceeded the limit in this frame.
    any_over: Arc<AtomicBool>,
}

impl Outputs {
    /// Lets `find` fill one list for each task of `workers`, then joins them in order. The lists begin empty, under the
    /// caller's limit and filter. With one thread the one list is the caller's.
    pub(crate) fn collect(
        &mut self,
        workers: &Workers,
        pairs: &mut Pairs,
        find: impl FnOnce(&mut [Pairs]) -> Result<(), Error>,
    ) -> Result<(), Error> {
        if workers.threads() == 1 {
            return find(std::slice::from_mut(pairs));
        }
        // Lists of more tasks stay for later frames.
        self.lists.resize_with(self.lists.len().max(workers.tasks()), Pairs::new);
        let lists = &mut self.lists[..workers.tasks()];
        self.any_over.store(false, Relaxed);
        lists.iter_mut().for_each(|list| list.begin_part(pairs, &self.any_over));
        let found = find(lists);
        if found.is_ok() {
            Self::join(lists, workers, pairs);
        }
        lists.iter_mut().for_each(Pairs::end_part);
        found
    }

    /// Copies all lists behind each other, in one phase if that pays.
    fn join(lists: &[Pairs], workers: &Workers, pairs: &mut Pairs) {
        let total: usize = lists.iter().map(Pairs::len).sum();
        let complete = lists.iter().all(Pairs::is_complete);
        if let Some(room) = pairs.room(total).filter(|_| complete && total >= SMALLEST_JOIN) {
            let parts = split(room, lists.iter().map(Pairs::len)).zip(lists);
            workers.each_of(parts, |(to, list)| to.copy_from_slice(list.as_slice()));
            pairs.extend_by_parts(lists);
        } else {
            lists.iter().for_each(|list| pairs.append(list));
        }
    }

    /// Runs one phase: `find` on every part, each into its own list, then joins the lists in order. `find` gets the
    /// number of the part and the number of parts.
    pub(crate) fn find(
        &mut self,
        workers: &Workers,
        pairs: &mut Pairs,
        find: impl Fn(usize, usize, &mut Pairs) + Sync + Send,
    ) {
        let found = self.collect(workers, pairs, |lists| {
            let parts = lists.len();
            workers.each(lists, |k, list| find(k, parts, list));
            Ok(())
        });
        debug_assert!(found.is_ok(), "the closure returns Ok");
    }
}
