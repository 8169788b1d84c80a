//! Spreads a frame over threads: phases of independent tasks, each with its own memory.

#[cfg(feature = "parallel")]
use crate::AlgorithmId;
#[cfg(feature = "parallel")]
use crate::cpu::helpers::Helpers;
use crate::cpu::{Columns, ColumnsMut, Threads};
use crate::{Aabb, Error};
#[cfg(feature = "parallel")]
use std::sync::Arc;
use std::sync::{Mutex, PoisonError};

/// The threads of one algorithm: the calling one, and its helpers from a pool.
#[derive(Debug)]
pub struct Workers {
    threads: usize,
    tasks: usize,
    /// The method and its helpers.
    #[cfg(feature = "parallel")]
    helpers: Option<(&'static str, Arc<Helpers>)>,
}

/// A frame in progress. Dropping it sends the helpers away.
#[must_use]
#[derive(Debug)]
pub struct Frame {
    #[cfg(feature = "parallel")]
    helpers: Option<Arc<Helpers>>,
}

#[cfg(feature = "parallel")]
impl Drop for Frame {
    fn drop(&mut self) {
        if let Some(helpers) = &self.helpers {
            helpers.end_frame();
        }
    }
}

/// Tasks for each thread: enough to even out tasks of unequal length, few enough to cost nothing.
const TASKS_PER_THREAD: usize = 8;

/// Boxes that make it worth waking one more thread. With 1800 boxes of `grid-sap` a second thread saved half of the
/// time on one machine of `datasets/`, and nothing on another.
const BOXES_PER_THREAD: usize = 1024;

/// Fewest boxes of a task: half of [`BOXES_PER_THREAD`], so that two tasks of unequal length even out.
const SMALLEST_TASK: usize = BOXES_PER_THREAD / 2;

/// Fewest boxes that a task of a filling phase writes: a smaller task costs more than it saves.
const SMALLEST_FILL: usize = 1024;

impl Workers {
    /// Takes `threads` threads for the algorithm `method`. The helpers start with the first frame.
    pub fn new(method: &'static str, threads: u32, pools: &Threads) -> Self {
        #[cfg(not(feature = "parallel"))]
        let _ = (method, pools);
        Self {
            threads: threads as usize,
            tasks: if threads == 1 { 1 } else { threads as usize * TASKS_PER_THREAD },
            #[cfg(feature = "parallel")]
            helpers: (threads > 1).then(|| (method, pools.helpers(threads - 1))),
        }
    }

    /// Returns the calling thread alone.
    pub fn one() -> Self {
        Self {
            threads: 1,
            tasks: 1,
            #[cfg(feature = "parallel")]
            helpers: None,
        }
    }

    /// Returns the number of threads, the calling one included.
    pub fn threads(&self) -> usize {
        self.threads
    }

    /// Returns the best number of tasks of a phase: one if there is one thread.
    pub fn tasks(&self) -> usize {
        self.tasks
    }

    /// Returns the part of these threads that a frame of `boxes` boxes keeps busy, with the tasks for them. A method
    /// that takes more or less time for a box than `grid-sap` passes the number of boxes for which `grid-sap` takes as
    /// long.
    pub fn fit(&self, boxes: usize) -> Self {
        let fit = self.at_most((boxes / BOXES_PER_THREAD).max(1));
        Self { tasks: fit.tasks.min((boxes / SMALLEST_TASK).max(1)), ..fit }
    }

    /// Returns at most `threads` of these threads, with the tasks for them.
    pub fn at_most(&self, threads: usize) -> Self {
        let threads = self.threads.min(threads);
        Self {
            threads,
            tasks: if threads == 1 { 1 } else { (threads * TASKS_PER_THREAD).min(self.tasks) },
            #[cfg(feature = "parallel")]
            helpers: self.helpers.clone().filter(|_| threads > 1),
        }
    }

    /// Starts the helpers, unless they run.
    ///
    /// # Errors
    /// [`Error::Unavailable`] if the system refuses the threads.
    pub fn start(&self) -> Result<(), Error> {
        #[cfg(feature = "parallel")]
        if let Some((method, helpers)) = &self.helpers {
            let algorithm = || AlgorithmId::cpu(method, helpers.count + 1);
            helpers.start().map_err(|reason| Error::Unavailable { algorithm: algorithm(), reason })?;
        }
        Ok(())
    }

    /// Begins a frame: helpers come now, and stay from phase to phase until the returned guard is dropped.
    ///
    /// # Errors
    /// As [`start`](Self::start).
    pub fn frame(&self) -> Result<Frame, Error> {
        self.start()?;
        #[cfg(feature = "parallel")]
        if let Some((_, helpers)) = &self.helpers {
            helpers.begin_frame(self.threads - 1);
        }
        Ok(Frame {
            #[cfg(feature = "parallel")]
            helpers: self.helpers.as_ref().map(|(_, helpers)| Arc::clone(helpers)),
        })
    }

    /// Runs one phase: hands out the tasks one by one to the caller and its helpers. Returns when all are done.
    ///
    /// The caller works instead of sleeping: waking a thread takes tens of microseconds, which a frame would pay
    /// twice.
    pub fn each_of<I: Iterator<Item: Send> + Send>(&self, tasks: I, work: impl Fn(I::Item) + Sync) {
        #[cfg(feature = "parallel")]
        // A single task needs no help.
        if let (Some((_, helpers)), most @ 2..) = (&self.helpers, tasks.size_hint().1.unwrap_or(usize::MAX)) {
            let queue = Mutex::new(tasks);
            let next = || queue.lock().unwrap_or_else(PoisonError::into_inner).next();
            return helpers.run((self.threads - 1).min(most - 1), &|| std::iter::from_fn(next).for_each(&work));
        }
        tasks.for_each(work);
    }

    /// Runs one phase: `work` on every task.
    pub fn each<T: Send>(&self, tasks: &mut [T], work: impl Fn(usize, &mut T) + Sync) {
        self.each_of(tasks.iter_mut().enumerate(), |(k, task)| work(k, task));
    }

    /// Runs one phase of tasks that may fail. All are worked on; returns the error of the first that failed.
    pub(crate) fn try_each_of<I: Iterator<Item: Send> + Send>(
        &self,
        tasks: I,
        work: impl Fn(I::Item) -> Result<(), Error> + Sync,
    ) -> Result<(), Error> {
        let first: Mutex<Option<(usize, Error)>> = Mutex::new(None);
        self.each_of(tasks.enumerate(), |(k, task)| {
            if let Err(error) = work(task) {
                let mut first = first.lock().unwrap_or_else(PoisonError::into_inner);
                if first.as_ref().is_none_or(|(known, _)| k < *known) {
                    *first = Some((k, error));
                }
            }
        });
        first.into_inner().unwrap_or_else(PoisonError::into_inner).map_or(Ok(()), |(_, error)| Err(error))
    }

    /// Runs one phase: `fill` on parts of the columns, each with its first position.
    pub(crate) fn fill(&self, columns: &mut Columns, fill: impl Fn(usize, ColumnsMut<'_>) + Sync) {
        let size = self.part_of(columns.len());
        self.each_of(columns.parts(size).zip((0..).step_by(size)), |(part, first)| fill(first, part));
    }

    /// Runs one phase: writes `make` of every input, with its position, to `out`.
    pub fn map<I: Sync, T: Send>(&self, inputs: &[I], out: &mut [T], make: impl Fn(usize, &I) -> T + Sync) {
        let size = self.part_of(inputs.len());
        self.each_of(out.chunks_mut(size).zip(inputs.chunks(size)).enumerate(), |(k, (out, inputs))| {
            out.iter_mut().zip(inputs).zip(k * size..).for_each(|((o, i), at)| *o = make(at, i));
        });
    }

    /// Returns the length of a part of a list of `len` elements.
    fn part_of(&self, len: usize) -> usize {
        if self.threads == 1 { len.max(1) } else { (len / self.tasks()).max(SMALLEST_FILL) }
    }

    /// Runs one phase: returns the error for the first invalid box, if there is one.
    pub(crate) fn check(&self, boxes: &[Aabb]) -> Result<(), Error> {
        let size = self.part_of(boxes.len());
        self.try_each_of(boxes.chunks(size).zip((0..).step_by(size)), |(part, first)| Aabb::check(part, first))
    }
}

#[cfg(all(test, feature = "parallel"))]
mod tests {
    use super::*;
    use crate::cpu::{METHODS, Simd, SimdLevel};
    use crate::{Pairs, mix};
    use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
    use std::sync::mpsc;

    /// Returns 127 helpers that are busy until the returned gates are dropped, so that invitations can be counted.
    fn busy_helpers() -> (Threads, Arc<Helpers>, Vec<mpsc::Sender<()>>) {
        let pool = Arc::new(rayon::ThreadPoolBuilder::new().num_threads(127).build().unwrap());
        let gates = (0..127).map(|_| {
            let (open, gate) = mpsc::channel::<()>();
            pool.spawn(move || _ = gate.recv());
            open
        });
        let gates = gates.collect();
        let threads = Threads::of(pool);
        let helpers = threads.helpers(127);
        (threads, helpers, gates)
    }

    #[test]
    fn threads_and_tasks_follow_the_work() {
        let wide = Workers::new("test", 128, &Threads::default());
        for (boxes, threads, tasks) in [
            (0, 1, 1),
            (2047, 1, 1),
            (2048, 2, 4),
            (3000, 2, 5),
            (10_000, 9, 19),
            (131_072, 128, 256),
            (600_000, 128, 1024),
            (usize::MAX, 128, 1024),
        ] {
            let fit = wide.fit(boxes);
            assert_eq!(
                (fit.threads(), fit.tasks(), fit.helpers.is_some()),
                (threads, tasks, threads > 1),
                "{boxes} boxes"
            );
            let narrow = Workers::new("test", 2, &Threads::default()).fit(boxes);
            assert_eq!((narrow.threads(), narrow.tasks()), (threads.min(2), tasks.min(16)), "{boxes} boxes");
        }
        assert_eq!((wide.threads(), wide.tasks()), (128, 1024));
    }

    #[test]
    fn helpers_invited_are_at_most_the_tasks() {
        let (threads, helpers, _gates) = busy_helpers();
        let wide = Workers::new("test", 128, &threads);
        let done = AtomicUsize::new(0);
        let run = |tasks: usize| {
            wide.each_of(0..tasks, |_| _ = done.fetch_add(1, Relaxed));
            (done.swap(0, Relaxed), helpers.coming())
        };
        assert_eq!([run(1), run(2), run(5), run(1000)], [(1, 0), (2, 1), (5, 4), (1000, 127)]);
    }

    #[test]
    fn small_frame_of_many_threads_invites_few_helpers() {
        let scene = |count: u64| -> Vec<Aabb> {
            let at = |k: u64| (mix(k) >> 40) as f32 / 1_048_576.0;
            (0..count).map(|k| Aabb::cube([at(3 * k), at(3 * k + 1), at(3 * k + 2)], 0.1)).collect()
        };
        for method in METHODS {
            let (name, simd) = (method.name, Simd::at_most(SimdLevel::in_use()));
            let (threads, helpers, _gates) = busy_helpers();
            let mut algorithm = (method.create)(128, &threads, simd).unwrap();
            let mut pairs = Pairs::new();
            algorithm.find_pairs(&scene(1000), &mut pairs).unwrap();
            assert_eq!(helpers.coming(), 0, "{name}: 1000 boxes");
            algorithm.find_pairs(&scene(3000), &mut pairs).unwrap();
            // Brute force takes as long for them as `grid-sap` for 9000.
            assert_eq!(helpers.coming(), if name == "brute" { 7 } else { 1 }, "{name}: 3000 boxes");
        }
    }
}
