//! The algorithms that this machine can run.

#[cfg(feature = "parallel")]
use crate::algorithm::Backend;
use crate::algorithm::{BackendClass, MOST_THREADS};
use crate::cpu::{self, Made, Method, Simd, SimdLevel, Threads, Workers};
use crate::entry::Entry;
use crate::{AlgorithmId, BroadPhase, Error, Unavailable};
use std::any::{Any, TypeId};
use std::fmt;
use std::sync::Arc;

/// Makes an instance of a user's algorithm.
type Factory = Arc<dyn Fn() -> Made + Send + Sync>;

/// All known algorithms, each with the reason if it can't run here.
///
/// A registry starts with the built-in algorithms. Those that a user adds are swept, modelled and chosen like the
/// rest.
///
/// ```
/// use sapwise::{Aabb, BroadPhase, Pairs, Registry};
///
/// let registry = Registry::new();
/// let mut bvh = registry.create(&"bvh@cpu1".parse().unwrap())?;
/// let mut pairs = Pairs::new();
/// bvh.find_pairs(&[Aabb::cube([0.0; 3], 1.0); 2], &mut pairs)?;
/// assert_eq!(pairs.len(), 1);
/// # Ok::<(), sapwise::Error>(())
/// ```
///
/// A clone lists the same algorithms, and makes them on the same helper threads and GPUs.
#[derive(Clone)]
pub struct Registry {
    entries: Vec<Entry>,
    makers: Vec<Maker>,
    threads: Threads,
    /// The most threads of a built-in algorithm.
    cores: u32,
    simd: SimdLevel,
    sources: Vec<Arc<dyn AlgorithmSource>>,
}

/// Lists algorithms and makes them, for a package that brings many of them, such as those on GPUs.
pub trait AlgorithmSource: Any + Send + Sync {
    /// Returns the algorithms that a registry lists.
    fn entries(&self) -> Vec<Entry>;

    /// Makes an algorithm, listed or not; `None` if it is not one of this source.
    fn create(&self, id: &AlgorithmId) -> Option<Result<Box<dyn BroadPhase>, Error>>;
}

/// Makes the algorithm of an entry.
#[derive(Clone)]
enum Maker {
    BuiltIn,
    /// The source of this type.
    Source(TypeId),
    User(Factory),
}

impl Registry {
    /// Makes a registry of the built-in algorithms on 1, 2, 4, ... and all usable cores of this machine.
    pub fn new() -> Self {
        Self::with_cores(usable_cores())
    }

    /// Makes a registry of the built-in algorithms on 1, 2, 4, ... and `cores` threads. Any number up to `cores` can
    /// be [created](Self::create). `cores` may exceed the cores of this machine, for tests.
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
                let unavailable = registry.threads.unavailable(threads, registry.cores);
                let entry = Entry::new(AlgorithmId::cpu(method.name, threads), method.revision);
                registry.set(Entry { unavailable, ..entry }, Maker::BuiltIn);
            }
        }
        registry
    }

    /// Adds a user's algorithm, or replaces the one with the same id. An incremental one that is named `pair-cache` is
    /// taken to fit its threads to a frame, as the built-in one does.
    pub fn add(
        &mut self,
        id: AlgorithmId,
        revision: u32,
        factory: impl Fn() -> Result<Box<dyn BroadPhase>, Error> + Send + Sync + 'static,
    ) {
        self.set(Entry::new(id, revision), Maker::User(Arc::new(factory)));
    }

    /// Replaces the entry with the same id, or appends it.
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

    /// Adds the algorithms of a source, except those whose ids are listed already. It replaces an earlier source of
    /// the same type.
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
        self.sources.push(Arc::new(source));
    }

    /// Returns the source of a type that was added.
    pub fn source<S: AlgorithmSource>(&self) -> Option<&S> {
        self.sources.iter().find_map(|s| (&**s as &dyn Any).downcast_ref())
    }

    /// Limits the SIMD level of the built-in algorithms that are created from now on.
    pub fn limit_simd(&mut self, level: SimdLevel) {
        self.simd = self.simd.min(level);
    }

    /// Pins each helper thread of algorithms created from now on to its own CPU: one to each physical core before any
    /// has two. Each process and each pool begins at another core.
    ///
    /// The calling thread is not pinned, because threads that it starts would inherit that. On Linux a helper moves to
    /// a free CPU when it finds the caller on its own core. Under the CPU quota of a cgroup no thread is pinned: the
    /// quota is for any CPU, and a pinned thread could not leave those that other containers use.
    ///
    /// Use this in a program that has the machine to itself. Some schedulers, above all those of virtual machines,
    /// wake two threads of a pool on one core and leave another idle for milliseconds. The command measures and runs
    /// with pinned threads. It is off by default, also in `sapwise_tune::for_this_machine`, because a pinned thread
    /// can't leave a core that another thread of the program keeps busy.
    pub fn pin_threads(&mut self) {
        self.threads.pinned = true;
    }

    /// Makes algorithms that are created from now on decide by counted work, and not by the clock: then they do the
    /// same work in every run. For tests that count.
    #[doc(hidden)]
    pub fn ignore_clock(&mut self) {
        self.threads.untimed = true;
    }

    /// Makes the threads of a program's own pool the helpers of built-in algorithms that are created from now on, in
    /// place of own pools. Algorithms on GPUs keep their own threads, which wait for drivers.
    ///
    /// An algorithm on K threads uses the calling thread and K - 1 of the pool, so the most is one more than the pool
    /// has. A larger number is [unavailable](Entry::unavailable). Called from within the pool (`install`, `scope`, a
    /// job), a frame uses at most the threads of the pool.
    ///
    /// Threads of the pool are invited and not awaited: free ones help, and the caller does the rest. Beside a busy
    /// pool a frame takes as long as on one thread. A caller in a pool runs no other job meanwhile, so it may hold a
    /// lock that such jobs want. [Pinning](Self::pin_threads) does not apply. The pool is of [the version of
    /// rayon](crate::rayon1) that this library exports.
    ///
    /// ```
    /// use sapwise::{rayon1 as rayon, Registry};
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
        let untimed = self.threads.untimed;
        self.threads = Threads::of(pool);
        self.threads.untimed = untimed;
        let most = self.threads.most().unwrap_or(1);
        for method in cpu::METHODS {
            let wider =
                |e: &Entry| e.id.method() == method.name && matches!(*e.id.backend(), Backend::Cpu(k) if k > most);
            let id = AlgorithmId::cpu(method.name, most);
            if let Some(at) = self.entries.iter().position(wider).filter(|_| self.position(&id).is_none()) {
                self.entries.insert(at, Entry::new(id, method.revision));
                self.makers.insert(at, Maker::BuiltIn);
            }
        }
        for (entry, maker) in self.entries.iter_mut().zip(&self.makers) {
            if let (&Backend::Cpu(threads), Maker::BuiltIn) = (entry.id.backend(), maker) {
                entry.unavailable = self.threads.unavailable(threads, self.cores);
            }
        }
    }

    /// Returns the most threads that an algorithm created from now on can have.
    pub(crate) fn most_workers(&self, method: &'static str) -> Workers {
        let most = (1..=self.cores).rev().find(|&k| self.threads.unavailable(k, self.cores).is_none());
        Workers::new(method, most.unwrap_or(1), &self.threads)
    }

    /// Returns every algorithm, the built-in ones first.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// Returns the algorithms that can run here.
    pub fn available(&self) -> Vec<Entry> {
        self.entries.iter().filter(|e| e.unavailable.is_none()).cloned().collect()
    }

    /// Returns the SIMD level of the built-in algorithms.
    #[doc(hidden)]
    pub fn simd(&self) -> SimdLevel {
        self.simd
    }

    /// Returns the kind of helper threads, in a word.
    #[doc(hidden)]
    #[cfg(feature = "parallel")]
    pub fn helpers(&self) -> &'static str {
        self.threads.kind()
    }

    /// Returns why a cost for this revision of an algorithm does not apply here, or `None` if it does.
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

    /// Makes an instance of an algorithm: a listed one, a built-in one on any number of CPU threads up to the most
    /// that is listed, or one that a [source](Self::add_source) makes without listing it.
    ///
    /// # Errors
    /// [`Error::UnknownAlgorithm`]. [`Error::Unavailable`], for example if a file from a larger machine names more
    /// threads than this one has cores.
    pub fn create(&self, id: &AlgorithmId) -> Result<Box<dyn BroadPhase>, Error> {
        if let Some(Maker::User(make)) = self.position(id).map(|at| &self.makers[at]) {
            return make();
        }
        if let Some(method) = built_in(id) {
            return match self.threads.unavailable(id.threads(), self.cores) {
                Some(reason) => Err(Error::Unavailable { algorithm: id.clone(), reason }),
                None => (method.create)(id.threads(), &self.threads, Simd::at_most(self.simd)),
            };
        }
        self.sources.iter().find_map(|source| source.create(id)).unwrap_or_else(|| {
            let known: Vec<String> = self.entries.iter().map(|e| e.id.to_string()).collect();
            Err(Error::UnknownAlgorithm { text: id.to_string(), hint: format!("known here: {}", known.join(", ")) })
        })
    }
}

/// Returns the built-in method of an algorithm on the CPU.
pub(crate) fn built_in(id: &AlgorithmId) -> Option<&'static Method> {
    cpu::METHODS.iter().find(|m| m.name == id.method() && id.backend().class() == BackendClass::Cpu)
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

/// Returns the number of threads that may run at once on this machine, with affinity and cgroup quota respected; 1 if
/// the system does not report it.
pub fn usable_cores() -> u32 {
    std::thread::available_parallelism().map_or(1, |n| u32::try_from(n.get()).unwrap_or(u32::MAX))
}

/// Returns 1, 2, 4, ... below `cores`, then `cores`.
pub(crate) fn thread_counts(cores: u32) -> impl Iterator<Item = u32> {
    let cores = cores.clamp(1, MOST_THREADS);
    std::iter::successors(Some(1_u32), |k| k.checked_mul(2)).take_while(move |&k| k < cores).chain([cores])
}

#[cfg(test)]
mod tests;
