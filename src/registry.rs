//! The algorithms that this machine can run.

use crate::algorithm::{AlgorithmId, Backend, MOST_THREADS, ParseIdError};
use crate::broad_phase::BroadPhase;
use crate::cpu::{self, Create, Method, Simd, SimdLevel, Threads};
use crate::entry::Entry;
use crate::error::{Error, Unavailable};
use std::any::{Any, TypeId};
use std::fmt;
use std::sync::Arc;

/// Makes an instance of an algorithm.
type Factory = Box<dyn Fn() -> Result<Box<dyn BroadPhase>, Error> + Send + Sync>;
/// Makes an instance of an algorithm that runs on any of some numbers of threads, ascending.
type FamilyFactory = Arc<dyn Fn(&[u32]) -> Result<Box<dyn BroadPhase>, Error> + Send + Sync>;

/// All algorithms that are known, each with the reason when it can't run here.
///
/// Starts with ours and is open: what a user adds is swept, modelled and chosen like the rest.
pub struct Registry {
    entries: Vec<Entry>,
    makers: Vec<Maker>,
    threads: Threads,
    /// The most threads that an algorithm of ours may have.
    cores: u32,
    simd: SimdLevel,
    sources: Vec<Box<dyn AlgorithmSource>>,
}

/// Lists algorithms and makes them, for a package that brings many of them, such as those on GPUs.
pub trait AlgorithmSource: Any + Send + Sync {
    /// Returns the algorithms that a registry lists.
    fn entries(&self) -> Vec<Entry>;

    /// Makes an algorithm, listed or not; `None` if it is not one of this source.
    fn create(&self, id: &AlgorithmId) -> Option<Result<Box<dyn BroadPhase>, Error>>;
}

/// What makes the algorithm of an entry.
enum Maker {
    Ours,
    /// The source of this type.
    Source(TypeId),
    One(Factory),
    Family(FamilyFactory),
}

impl Registry {
    /// Our algorithms on 1, 2, 4, ... and all usable cores of this machine.
    #[must_use]
    pub fn new() -> Self {
        Self::with_cores(usable_cores())
    }

    /// Our algorithms on 1, 2, 4, ... and `cores` threads. They can be had on any number up to `cores`, which may be more than the machine
    /// has: that is for tests.
    #[must_use]
    pub fn with_cores(cores: u32) -> Self {
        let mut registry = Self {
            entries: Vec::new(),
            makers: Vec::new(),
            threads: Threads::default(),
            cores: cores.clamp(1, MOST_THREADS),
            simd: SimdLevel::in_use(),
            sources: Vec::new(),
        };
        for method in cpu::METHODS {
            for threads in thread_counts(cores) {
                let unavailable = registry.unavailable(threads);
                let entry = Entry::new(AlgorithmId::cpu(method.name, threads), method.revision);
                registry.set(Entry { unavailable, ..entry }, Maker::Ours);
            }
        }
        registry
    }

    /// Adds an algorithm of the user's, or replaces the one with the same id.
    pub fn add(
        &mut self,
        id: AlgorithmId,
        revision: u32,
        factory: impl Fn() -> Result<Box<dyn BroadPhase>, Error> + Send + Sync + 'static,
    ) {
        self.set(Entry::new(id, revision), Maker::One(Box::new(factory)));
    }

    /// Adds an [incremental](crate::Incremental) algorithm of the user's that runs on any of these numbers of threads of the CPU and
    /// takes along what it keeps from one to the next, or replaces those with the same ids.
    ///
    /// `factory` gets the numbers of threads that are wanted, ascending; what it makes takes each of them in
    /// [`Incremental::set_threads`](crate::Incremental::set_threads), and begins with the least.
    ///
    /// # Errors
    /// As [`AlgorithmId::new`]; nothing was added then.
    pub fn add_family(
        &mut self,
        method: &str,
        threads: &[u32],
        revision: u32,
        factory: impl Fn(&[u32]) -> Result<Box<dyn BroadPhase>, Error> + Send + Sync + 'static,
    ) -> Result<(), ParseIdError> {
        let ids = threads.iter().map(|&k| AlgorithmId::new(method, Backend::Cpu(k))).collect::<Result<Vec<_>, _>>()?;
        let factory: FamilyFactory = Arc::new(factory);
        ids.into_iter().for_each(|id| self.set(Entry::new(id, revision), Maker::Family(Arc::clone(&factory))));
        Ok(())
    }

    /// Puts an entry in the place of the one with the same id, or behind all.
    fn set(&mut self, entry: Entry, maker: Maker) {
        match self.position(&entry.id) {
            Some(at) => (self.entries[at], self.makers[at]) = (entry, maker),
            None => {
                self.entries.push(entry);
                self.makers.push(maker);
            }
        }
    }

    fn position(&self, id: &AlgorithmId) -> Option<usize> {
        self.entries.iter().position(|e| e.id == *id)
    }

    /// Adds the algorithms of a source, except those whose ids are listed already. It replaces an earlier source of the same type.
    pub fn add_source<S: AlgorithmSource>(&mut self, source: S) {
        let is_old = |maker: &Maker| matches!(maker, Maker::Source(of) if *of == TypeId::of::<S>());
        let mut makers = self.makers.iter();
        self.entries.retain(|_| !makers.next().is_some_and(is_old));
        self.makers.retain(|maker| !is_old(maker));
        self.sources.retain(|old| !(&**old as &dyn Any).is::<S>());
        for entry in source.entries() {
            if self.position(&entry.id).is_none() {
                self.set(entry, Maker::Source(TypeId::of::<S>()));
            }
        }
        self.sources.push(Box::new(source));
    }

    /// Returns the source of a type that was added.
    #[must_use]
    pub fn source<S: AlgorithmSource>(&self) -> Option<&S> {
        self.sources.iter().find_map(|s| (&**s as &dyn Any).downcast_ref())
    }

    /// Makes our algorithms use no higher SIMD level than this from now on.
    pub fn limit_simd(&mut self, level: SimdLevel) {
        self.simd = self.simd.min(level);
    }

    /// Binds each thread that helps the calling one, in the pools that are made from now on, to a CPU of its own: one for each physical
    /// core before any has two, on Linux, beginning at another core in each process and with other CPUs for each pool of a process where
    /// there are enough. The calling thread is not bound, because what it starts would be bound with it; on Linux a helper moves to a free CPU
    /// when it finds the caller on its own core. Where a cgroup limits the time on the CPUs no thread is bound: the quota is for any of
    /// them, and a bound thread could not move away from those that other containers use.
    ///
    /// For a program that has the machine to itself. Some schedulers, those of virtual machines above all, wake two threads of a pool on one
    /// core and leave the other idle for milliseconds: on the machine of the first reports nothing under 3 ms gained from a second thread. The
    /// command measures and runs with pinned threads. It is off unless asked for, `Adaptive::for_this_machine` included, because a pinned
    /// thread can't move away from a core that another thread of the program keeps busy.
    pub fn pin_threads(&mut self) {
        self.threads.pinned = true;
    }

    /// Makes the threads of a program's own pool the helpers of our algorithms on several cores that are made from now on, in
    /// place of pools of ours. Algorithms on GPUs keep threads of their own, which wait for drivers.
    ///
    /// An algorithm on K threads has the calling thread and K - 1 of the pool, so the most is one more than the pool has; beyond that
    /// it is [unavailable](Entry::unavailable). Called from within the pool (`install`, `scope`, a job), a frame takes no more
    /// threads than the pool has. The pool's threads are invited and not waited for: those that are free help, the caller does what is left,
    /// and a frame beside a pool that is busy with other jobs takes as long as on one thread. A caller that is a thread of a pool runs none of
    /// its other jobs meanwhile, so it may hold a lock that they want. [Pinning](Self::pin_threads) does not apply: where the pool's threads run is the
    /// program's business. The pool is of [the version of rayon](crate::rayon1) that this library exports.
    ///
    /// ```
    /// use sapwise::{Registry, rayon1 as rayon};
    /// use std::sync::Arc;
    ///
    /// let pool = Arc::new(rayon::ThreadPoolBuilder::new().num_threads(3).build()?);
    /// let mut registry = Registry::with_cores(8);
    /// registry.use_pool(Arc::clone(&pool));
    /// let most = registry.available().iter().map(|e| e.id.threads()).max();
    /// assert_eq!(most, Some(4));
    /// # Ok::<(), rayon::ThreadPoolBuildError>(())
    /// ```
    #[cfg(feature = "parallel")]
    pub fn use_pool(&mut self, pool: Arc<rayon::ThreadPool>) {
        self.threads = Threads::of(pool);
        let most = self.threads.most().unwrap_or(1);
        for method in cpu::METHODS {
            let wider =
                |e: &Entry| e.id.method() == method.name && matches!(*e.id.backend(), Backend::Cpu(k) if k > most);
            let id = AlgorithmId::cpu(method.name, most);
            if let Some(at) = self.entries.iter().position(wider).filter(|_| self.position(&id).is_none()) {
                self.entries.insert(at, Entry::new(id, method.revision));
                self.makers.insert(at, Maker::Ours);
            }
        }
        for (entry, maker) in self.entries.iter_mut().zip(&self.makers) {
            if let (&Backend::Cpu(threads), Maker::Ours) = (entry.id.backend(), maker) {
                entry.unavailable = unavailable(&self.threads, self.cores, threads);
            }
        }
    }

    /// Why an algorithm of ours can't have `threads` threads, if it can't.
    fn unavailable(&self, threads: u32) -> Option<Unavailable> {
        unavailable(&self.threads, self.cores, threads)
    }

    /// Every algorithm, ours first.
    #[must_use]
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// The algorithms that can run here.
    #[must_use]
    pub fn available(&self) -> Vec<Entry> {
        self.entries.iter().filter(|e| e.unavailable.is_none()).cloned().collect()
    }

    /// The SIMD level that algorithms use.
    #[cfg(feature = "this-machine")]
    pub(crate) fn simd(&self) -> SimdLevel {
        self.simd
    }

    /// Which threads help the calling one, in a word.
    #[cfg(feature = "this-machine")]
    pub(crate) fn helpers(&self) -> &'static str {
        self.threads.kind()
    }

    /// Why a cost of `revision` of an algorithm says nothing here, if it doesn't.
    pub(crate) fn mismatch(&self, id: &AlgorithmId, revision: u32) -> Option<Error> {
        let unavailable = |reason| Some(Error::Unavailable { algorithm: id.clone(), reason });
        let class = id.backend().class();
        let same = self.entries.iter().filter(|e| e.id.method() == id.method() && e.id.backend().class() == class);
        let most = same.clone().map(|e| e.id.threads()).max();
        match same.clone().find(|e| e.id == *id).or(same.clone().next()) {
            Some(known) if known.revision != revision => {
                unavailable(Unavailable::OtherRevision { cost: revision, build: known.revision })
            }
            Some(_) if most.is_some_and(|most| id.threads() > most) => {
                unavailable(Unavailable::TooFewCores { threads: id.threads(), most: most.unwrap_or(1) })
            }
            _ => None,
        }
    }

    /// Makes an instance. Beside the listed ones, our methods can be had on any number of CPU threads up to the most that is listed, and
    /// what a [source](Self::add_source) makes without listing it.
    ///
    /// # Errors
    /// [`Error::UnknownAlgorithm`] and [`Error::Unavailable`]: a file from a larger machine names threads that this one has no cores for.
    pub fn create(&self, id: &AlgorithmId) -> Result<Box<dyn BroadPhase>, Error> {
        match self.position(id).map(|at| &self.makers[at]) {
            Some(Maker::One(factory)) => return factory(),
            Some(Maker::Family(factory)) => return factory(&[id.threads()]),
            Some(Maker::Ours | Maker::Source(_)) | None => {}
        }
        match (ours(id), id.backend()) {
            (Some(method), &Backend::Cpu(threads)) => match self.unavailable(threads) {
                None => match method.create {
                    Create::OneWidth(create) => create(threads, &self.threads, Simd::at_most(self.simd)),
                    Create::AnyWidth(create) => create(&[threads], &self.threads, Simd::at_most(self.simd)),
                },
                Some(reason) => Err(Error::Unavailable { algorithm: id.clone(), reason }),
            },
            _ => self.sources.iter().find_map(|source| source.create(id)).unwrap_or_else(|| {
                let known: Vec<String> = self.entries.iter().map(|e| e.id.to_string()).collect();
                Err(Error::UnknownAlgorithm { text: id.to_string(), hint: format!("known here: {}", known.join(", ")) })
            }),
        }
    }

    /// One instance for all of `ids`, which takes along what it keeps from one number of threads to the next by
    /// [`Incremental::set_threads`](crate::Incremental::set_threads). `None` where they are not one incremental method on several
    /// numbers of threads, ours or [added as a family](Self::add_family); then each is [created](Self::create) by itself.
    ///
    /// # Errors
    /// As [`create`](Self::create).
    pub fn create_family(&self, ids: &[&AlgorithmId]) -> Result<Option<Box<dyn BroadPhase>>, Error> {
        let Some((first, rest)) = ids.split_first() else { return Ok(None) };
        let Some(family) = self.family(first) else { return Ok(None) };
        if !rest.iter().all(|id| id.method() == first.method() && self.family(id).is_some_and(|f| f.is(&family))) {
            return Ok(None);
        }
        let mut threads: Vec<u32> = ids.iter().map(|id| id.threads()).collect();
        threads.sort_unstable();
        threads.dedup();
        match family {
            Family::Ours(create) => create(&threads, &self.threads, Simd::at_most(self.simd)),
            Family::Users(factory) => factory(&threads),
        }
        .map(Some)
    }

    /// The family of an algorithm that can run here, if it has one.
    fn family(&self, id: &AlgorithmId) -> Option<Family<'_>> {
        let &Backend::Cpu(threads) = id.backend() else { return None };
        match self.position(id).map(|at| &self.makers[at]) {
            Some(Maker::One(_) | Maker::Source(_)) => None,
            Some(Maker::Family(factory)) => Some(Family::Users(factory)),
            Some(Maker::Ours) | None => match ours(id)?.create {
                Create::AnyWidth(create) if self.unavailable(threads).is_none() => Some(Family::Ours(create)),
                _ => None,
            },
        }
    }
}

/// What makes one instance for several numbers of threads.
enum Family<'a> {
    Ours(fn(&[u32], &Threads, Simd) -> cpu::Made),
    Users(&'a FamilyFactory),
}

impl Family<'_> {
    /// Whether two algorithms of one method are of the same family.
    fn is(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Ours(_), Self::Ours(_)) => true,
            (Self::Users(a), Self::Users(b)) => Arc::ptr_eq(a, b),
            _ => false,
        }
    }
}

/// Why an algorithm of ours can't have that many of `pool` in a registry of `cores` cores, if it can't.
fn unavailable(pool: &Threads, cores: u32, threads: u32) -> Option<Unavailable> {
    pool.unavailable(threads).or_else(|| (threads > cores).then_some(Unavailable::TooFewCores { threads, most: cores }))
}

/// The method of ours of this name on the CPU.
fn ours(id: &AlgorithmId) -> Option<&'static Method> {
    cpu::METHODS.iter().find(|m| m.name == id.method())
}

impl Default for Registry {
    fn default() -> Self {
        Self::new()
    }
}

impl fmt::Debug for Registry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Registry").field("entries", &self.entries).finish_non_exhaustive()
    }
}

/// Threads that may run at once on this machine: affinity and cgroup quota respected; 1 when that can't be told.
#[must_use]
pub fn usable_cores() -> u32 {
    std::thread::available_parallelism().map_or(1, |n| u32::try_from(n.get()).unwrap_or(u32::MAX))
}

/// 1, 2, 4, ... below `cores`, then `cores`.
fn thread_counts(cores: u32) -> impl Iterator<Item = u32> {
    let cores = cores.clamp(1, MOST_THREADS);
    std::iter::successors(Some(1_u32), |k| k.checked_mul(2)).take_while(move |&k| k < cores).chain([cores])
}

#[cfg(test)]
mod tests;
