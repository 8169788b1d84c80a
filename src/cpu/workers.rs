//! How a frame is spread over threads: phases of independent tasks, each with its own memory.

#[cfg(feature = "parallel")]
use crate::AlgorithmId;
use crate::cpu::Threads;
use crate::cpu::columns::{ColumnsMut, part};
use crate::{Aabb, Error, Pairs};
#[cfg(feature = "parallel")]
use std::sync::Arc;

/// The threads of one algorithm: the caller's own, or a pool.
#[derive(Debug)]
pub(crate) struct Workers {
    threads: usize,
    #[cfg(feature = "parallel")]
    pool: Option<Arc<rayon::ThreadPool>>,
}

/// Tasks for each thread: enough to even out tasks of unequal length, few enough to cost nothing.
const TASKS_PER_THREAD: usize = 8;

/// Boxes that one task of a filling phase writes at the least; below, a task costs more than it saves.
#[cfg(feature = "parallel")]
const SMALLEST_FILL: usize = 1024;

impl Workers {
    /// `threads` threads for the algorithm `method`.
    pub(crate) fn new(method: &'static str, threads: u32, pools: &Threads) -> Result<Self, Error> {
        #[cfg(not(feature = "parallel"))]
        let _ = (method, pools.pinned);
        Ok(Self {
            threads: threads as usize,
            #[cfg(feature = "parallel")]
            pool: if threads == 1 {
                None
            } else {
                let unavailable = |reason| Error::Unavailable { algorithm: AlgorithmId::cpu(method, threads), reason };
                Some(pools.pool(threads).map_err(unavailable)?)
            },
        })
    }

    pub(crate) fn threads(&self) -> usize {
        self.threads
    }

    /// Tasks into which a phase is best divided: one when there is one thread.
    pub(crate) fn tasks(&self) -> usize {
        if self.threads == 1 { 1 } else { self.threads * TASKS_PER_THREAD }
    }

    /// Runs a frame inside the pool. Phases outside of it would each pay for waking the pool from outside.
    pub(crate) fn run<R: Send>(&self, frame: impl FnOnce() -> R + Send) -> R {
        #[cfg(feature = "parallel")]
        if let Some(pool) = &self.pool {
            return pool.install(frame);
        }
        frame()
    }

    /// One phase: `work` on every task, side by side. Returns when all are done.
    pub(crate) fn each<T: Send>(&self, tasks: &mut [T], work: impl Fn(usize, &mut T) + Sync + Send) {
        #[cfg(feature = "parallel")]
        if self.pool.is_some() {
            use rayon::prelude::*;
            return tasks.par_iter_mut().with_max_len(1).enumerate().for_each(|(k, task)| work(k, task));
        }
        tasks.iter_mut().enumerate().for_each(|(k, task)| work(k, task));
    }

    /// One phase: `work` on every task and what belongs to it, side by side.
    pub(crate) fn each_with<T: Send, U: Send>(
        &self,
        tasks: &mut [T],
        with: &mut [U],
        work: impl Fn(usize, &mut T, &mut U) + Sync + Send,
    ) {
        #[cfg(feature = "parallel")]
        if self.pool.is_some() {
            use rayon::prelude::*;
            let all = tasks.par_iter_mut().zip(with).with_max_len(1).enumerate();
            return all.for_each(|(k, (task, with))| work(k, task, with));
        }
        tasks.iter_mut().zip(with).enumerate().for_each(|(k, (task, with))| work(k, task, with));
    }

    /// One phase: `work` on every task and what belongs to it in two more lists, side by side.
    pub(crate) fn each_three<T: Send, U: Send, V: Send>(
        &self,
        tasks: &mut [T],
        with: &mut [U],
        and: &mut [V],
        work: impl Fn(&mut T, &mut U, &mut V) + Sync + Send,
    ) {
        #[cfg(feature = "parallel")]
        if self.pool.is_some() {
            use rayon::prelude::*;
            let all = tasks.par_iter_mut().zip(with).zip(and).with_max_len(1);
            return all.for_each(|((task, with), and)| work(task, with, and));
        }
        tasks.iter_mut().zip(with).zip(and).for_each(|((task, with), and)| work(task, with, and));
    }

    /// One phase: `work` on every task and its part of two lists, which are given with the length of a part.
    pub(crate) fn each_share<T: Send, A: Send, B: Send>(
        &self,
        tasks: &mut [T],
        (a, a_len): (&mut [A], usize),
        (b, b_len): (&mut [B], usize),
        work: impl Fn(usize, &mut T, &mut [A], &mut [B]) + Sync + Send,
    ) {
        #[cfg(feature = "parallel")]
        if self.pool.is_some() {
            use rayon::prelude::*;
            let parts = a.par_chunks_mut(a_len).zip(b.par_chunks_mut(b_len));
            let all = tasks.par_iter_mut().zip(parts).with_max_len(1).enumerate();
            return all.for_each(|(k, (task, (a, b)))| work(k, task, a, b));
        }
        let parts = a.chunks_mut(a_len).zip(b.chunks_mut(b_len));
        tasks.iter_mut().zip(parts).enumerate().for_each(|(k, (task, (a, b)))| work(k, task, a, b));
    }

    /// One phase: `fill` on parts of the columns, with the position at which each part begins.
    pub(crate) fn fill(&self, columns: ColumnsMut<'_>, fill: impl Fn(usize, ColumnsMut<'_>) + Sync) {
        #[cfg(feature = "parallel")]
        if self.pool.is_some() {
            let size = (columns.len() / self.tasks()).max(SMALLEST_FILL);
            return split_fill(columns, 0, size, &fill);
        }
        fill(0, columns);
    }

    /// One phase: `make` for every input, at its position.
    pub(crate) fn map<I: Sync, T: Send>(&self, inputs: &[I], out: &mut [T], make: impl Fn(usize, &I) -> T + Sync + Send) {
        #[cfg(feature = "parallel")]
        if self.pool.is_some() {
            use rayon::prelude::*;
            let all = out.par_iter_mut().with_min_len(SMALLEST_FILL).zip(inputs).enumerate();
            return all.for_each(|(k, (o, i))| *o = make(k, i));
        }
        out.iter_mut().zip(inputs).enumerate().for_each(|(k, (o, i))| *o = make(k, i));
    }

    /// One phase: the error for the first invalid box, if there is one.
    pub(crate) fn check(&self, boxes: &[Aabb]) -> Result<(), Error> {
        #[cfg(feature = "parallel")]
        if self.pool.is_some() {
            use rayon::prelude::*;
            const CHUNK: usize = 16 * SMALLEST_FILL;
            let chunks = boxes.par_chunks(CHUNK).enumerate();
            return chunks.find_map_first(|(k, chunk)| Aabb::check(chunk, k * CHUNK).err()).map_or(Ok(()), Err);
        }
        Aabb::check(boxes, 0)
    }

    /// One phase: sorts.
    pub(crate) fn sort(&self, keys: &mut [u64]) {
        #[cfg(feature = "parallel")]
        if self.pool.is_some() {
            use rayon::prelude::*;
            return keys.par_sort_unstable();
        }
        keys.sort_unstable();
    }
}

#[cfg(feature = "parallel")]
fn split_fill(columns: ColumnsMut<'_>, first: usize, size: usize, fill: &(impl Fn(usize, ColumnsMut<'_>) + Sync)) {
    if columns.len() <= size {
        return fill(first, columns);
    }
    let middle = columns.len() / 2;
    let (left, right) = columns.split(middle);
    rayon::join(|| split_fill(left, first, size, fill), || split_fill(right, first + middle, size, fill));
}

/// The pairs that one task finds.
#[derive(Debug, Default)]
pub(crate) struct Outputs(Vec<Pairs>);

impl Outputs {
    /// As many lists as `workers` has tasks, each empty and under the caller's limit.
    fn ready(&mut self, workers: &Workers, pairs: &Pairs) {
        self.0.resize_with(workers.tasks(), Pairs::new);
        for list in &mut self.0 {
            list.clear();
            list.set_limit(pairs.limit());
        }
    }

    /// Lets `find` add to as many lists as `workers` has tasks, then joins them in order.
    ///
    /// With one thread the one list is the caller's.
    pub(crate) fn collect(
        &mut self,
        workers: &Workers,
        pairs: &mut Pairs,
        find: impl FnOnce(&mut [Pairs]) -> Result<(), Error>,
    ) -> Result<(), Error> {
        if workers.threads() == 1 {
            return find(std::slice::from_mut(pairs));
        }
        self.ready(workers, pairs);
        find(&mut self.0)?;
        self.0.iter().for_each(|list| pairs.append(list));
        Ok(())
    }

    /// One phase: `find` on equal parts of `0..rows`, each into a list of its own, then all lists joined in order.
    pub(crate) fn find_rows(
        &mut self,
        workers: &Workers,
        rows: usize,
        pairs: &mut Pairs,
        find: impl Fn(std::ops::Range<usize>, &mut Pairs) + Sync + Send,
    ) {
        self.find(workers, pairs, |k, parts, list| find(part(rows, k, parts), list));
    }

    /// As [`Outputs::find_rows`] over parts that `find` works out itself: it gets the number of the part and of all parts.
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
        debug_assert!(found.is_ok(), "nothing above fails");
    }
}
