//! The algorithms that this machine can run.

use crate::algorithm::MOST_THREADS;
use crate::cpu::{self, SimdLevel, Threads};
use crate::{AlgorithmId, Backend, BroadPhase, Error};
use std::fmt;

/// Makes an instance of an algorithm.
type Factory = Box<dyn Fn() -> Result<Box<dyn BroadPhase>, Error> + Send + Sync>;

/// All algorithms that are known, each with the reason when it can't run here.
///
/// Starts with ours and is open: what a user adds is swept, modelled and chosen like the rest.
pub struct Registry {
    entries: Vec<Entry>,
    factories: Vec<Option<Factory>>,
    threads: Threads,
    simd: SimdLevel,
    #[cfg(feature = "gpu")]
    gpus: crate::gpu::Gpus,
}

/// One algorithm of a registry.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// The algorithm.
    pub id: AlgorithmId,
    /// Counts up when its speed changes; timings of other revisions are stale.
    pub revision: u32,
    /// Why it can't run here, if it can't.
    pub unavailable: Option<String>,
}

impl Registry {
    /// Our algorithms on 1, 2, 4, ... and all usable cores of this machine.
    #[must_use]
    pub fn new() -> Self {
        Self::with_cores(usable_cores())
    }

    /// Our algorithms on 1, 2, 4, ... and `cores` threads.
    #[must_use]
    pub fn with_cores(cores: u32) -> Self {
        let mut registry = Self {
            entries: Vec::new(),
            factories: Vec::new(),
            threads: Threads::default(),
            simd: SimdLevel::in_use(),
            #[cfg(feature = "gpu")]
            gpus: crate::gpu::Gpus::none(),
        };
        for method in cpu::METHODS {
            for threads in thread_counts(cores) {
                registry.entries.push(Entry {
                    id: AlgorithmId::cpu(method.name, threads),
                    revision: method.revision,
                    unavailable: registry.threads.unavailable(threads),
                });
                registry.factories.push(None);
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
        let entry = Entry { id, revision, unavailable: None };
        let factory: Option<Factory> = Some(Box::new(factory));
        match self.entries.iter().position(|e| e.id == entry.id) {
            Some(at) => {
                self.entries[at] = entry;
                self.factories[at] = factory;
            }
            None => {
                self.entries.push(entry);
                self.factories.push(factory);
            }
        }
    }

    /// Adds our algorithms on these GPUs: on each of them, and on the first two, three and so on together. They take the place of
    /// GPUs that were added before.
    ///
    /// Nothing is opened before an algorithm is created.
    #[cfg(feature = "gpu")]
    pub fn add_gpus(&mut self, gpus: &crate::gpu::Gpus) {
        self.gpus = gpus.clone();
        // GPUs that were added before and are not among these go; what the user added stays.
        let stays = |k: usize| self.factories[k].is_some() || !matches!(self.entries[k].id.backend(), Backend::Gpu(_));
        let stays: Vec<bool> = (0..self.entries.len()).map(stays).collect();
        let (mut entry, mut factory) = (stays.iter(), stays.iter());
        self.entries.retain(|_| entry.next() == Some(&true));
        self.factories.retain(|_| factory.next() == Some(&true));
        for (id, revision) in crate::gpu::algorithms(gpus.identities()) {
            if !self.entries.iter().any(|e| e.id == id) {
                self.entries.push(Entry { id, revision, unavailable: None });
                self.factories.push(None);
            }
        }
    }

    /// Makes our algorithms use no higher SIMD level than this from now on.
    pub fn limit_simd(&mut self, level: SimdLevel) {
        self.simd = self.simd.min(level);
    }

    /// Binds each thread that helps the calling one, in the pools that are made from now on, to a core of its own. The
    /// calling thread is not bound, because what it starts would be bound with it; on Linux a helper moves to a free core when it
    /// finds the caller on its own.
    ///
    /// Some schedulers, those of virtual machines above all, wake two threads of a pool on one core and leave the other
    /// idle for milliseconds: on the machine of the first reports nothing under 3 ms gained from a second thread. The
    /// command measures and runs with pinned threads. It is off unless asked for, because a pinned thread can't move away
    /// from a core that another thread of the program keeps busy.
    pub fn pin_threads(&mut self) {
        self.threads.pinned = true;
    }

    /// Makes the threads of a program's own pool the helpers of our algorithms on several cores that are made from now on, in
    /// place of pools of ours. Algorithms on GPUs keep threads of their own, which wait for drivers.
    ///
    /// An algorithm on K threads has the calling thread and K - 1 of the pool, so the most is one more than the pool has; beyond that
    /// it is [unavailable](Entry::unavailable). Called from within the pool (`install`, `scope`, a job), a frame takes no more
    /// threads than the pool has. Each phase of a frame is a scope of rayon, with rayon's rules: it ends when the pool has come
    /// to its jobs, so a thread of the pool must not wait for the one that calls, and a caller that is one of them may run
    /// other jobs of the pool meanwhile. [Pinning](Self::pin_threads) does not apply: where the pool's threads run is the
    /// program's business. The version of rayon is [the one that this library exports](crate::rayon).
    ///
    /// ```
    /// use sapwise::{Registry, rayon};
    /// use std::sync::Arc;
    ///
    /// let pool = Arc::new(rayon::ThreadPoolBuilder::new().num_threads(3).build()?);
    /// let mut registry = Registry::with_cores(8);
    /// registry.use_pool(Arc::clone(&pool));
    /// let most = registry.available().iter().map(|(id, _)| id.threads()).max();
    /// assert_eq!(most, Some(4));
    /// # Ok::<(), rayon::ThreadPoolBuildError>(())
    /// ```
    #[cfg(feature = "parallel")]
    pub fn use_pool(&mut self, pool: std::sync::Arc<rayon::ThreadPool>) {
        self.threads = Threads::of(pool);
        let most = self.threads.most().unwrap_or(1);
        for method in cpu::METHODS {
            let wider = |e: &Entry| e.id.method() == method.name && matches!(*e.id.backend(), Backend::Cpu(k) if k > most);
            let id = AlgorithmId::cpu(method.name, most);
            if let Some(at) = self.entries.iter().position(wider).filter(|_| !self.entries.iter().any(|e| e.id == id)) {
                self.entries.insert(at, Entry { id, revision: method.revision, unavailable: None });
                self.factories.insert(at, None);
            }
        }
        for (entry, factory) in self.entries.iter_mut().zip(&self.factories) {
            if let (&Backend::Cpu(threads), None) = (entry.id.backend(), factory) {
                entry.unavailable = self.threads.unavailable(threads);
            }
        }
    }

    /// Every algorithm, ours first.
    #[must_use]
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// The algorithms that can run here, with their revisions.
    #[must_use]
    pub fn available(&self) -> Vec<(AlgorithmId, u32)> {
        self.entries.iter().filter(|e| e.unavailable.is_none()).map(|e| (e.id.clone(), e.revision)).collect()
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

    /// The GPUs that were added.
    #[cfg(all(feature = "measure-gpu", feature = "this-machine"))]
    pub(crate) fn gpus(&self) -> &crate::gpu::Gpus {
        &self.gpus
    }

    /// What the GPUs that were added say of themselves.
    #[cfg(feature = "this-machine")]
    pub(crate) fn gpu_identities(&self) -> Vec<crate::GpuIdentity> {
        #[cfg(feature = "gpu")]
        return self.gpus.identities().cloned().collect();
        #[cfg(not(feature = "gpu"))]
        Vec::new()
    }

    /// Why a cost of `revision` of an algorithm says nothing here, if it doesn't.
    pub(crate) fn mismatch(&self, id: &AlgorithmId, revision: u32) -> Option<Error> {
        let unavailable = |reason| Some(Error::Unavailable { algorithm: id.clone(), reason });
        let class = id.backend().class();
        let same = self.entries.iter().filter(|e| e.id.method() == id.method() && e.id.backend().class() == class);
        let most = same.clone().map(|e| e.id.threads()).max();
        match same.clone().find(|e| e.id == *id).or(same.clone().next()) {
            Some(known) if known.revision != revision => {
                unavailable(format!("its cost is of revision {revision}, this build has {}; predict again", known.revision))
            }
            Some(_) if most.is_some_and(|most| id.threads() > most) => {
                unavailable(format!("it has {} threads, more than this machine has cores", id.threads()))
            }
            _ => None,
        }
    }

    /// Makes an instance. Beside the listed ones, our methods can be had on any number of CPU threads and on any of the GPUs
    /// that were added.
    ///
    /// # Errors
    /// [`Error::UnknownAlgorithm`] and [`Error::Unavailable`].
    pub fn create(&self, id: &AlgorithmId) -> Result<Box<dyn BroadPhase>, Error> {
        if let Some(factory) = self.entries.iter().position(|e| e.id == *id).and_then(|at| self.factories[at].as_ref()) {
            return factory();
        }
        let method = cpu::METHODS.iter().find(|m| m.name == id.method());
        match (method, id.backend()) {
            (Some(method), &Backend::Cpu(threads)) => match self.threads.unavailable(threads) {
                None => (method.create)(threads, &self.threads, self.simd),
                Some(reason) => Err(Error::Unavailable { algorithm: id.clone(), reason }),
            },
            #[cfg(feature = "gpu")]
            (_, Backend::Gpu(_)) if crate::gpu::has_method(id.method()) => crate::gpu::OnGpus::create(id, &self.gpus),
            _ => {
                let known: Vec<String> = self.entries.iter().map(|e| e.id.to_string()).collect();
                Err(Error::UnknownAlgorithm { text: id.to_string(), hint: format!("known here: {}", known.join(", ")) })
            }
        }
    }

    /// One instance for all of `ids`, which takes what it keeps along from one number of threads to the next
    /// ([`BroadPhase::set_threads`]). `None` where they are not of one method of ours, on the CPU, that keeps something; then each
    /// is [created](Self::create) by itself.
    ///
    /// # Errors
    /// As [`create`](Self::create).
    pub fn create_for(&self, ids: &[&AlgorithmId]) -> Option<Result<Box<dyn BroadPhase>, Error>> {
        let first = ids.first()?;
        let create_for = cpu::METHODS.iter().find(|m| m.name == first.method())?.create_for?;
        let mut threads = Vec::with_capacity(ids.len());
        for id in ids {
            let replaced = || self.entries.iter().zip(&self.factories).any(|(e, f)| e.id == **id && f.is_some());
            match id.backend() {
                &Backend::Cpu(k)
                    if id.method() == first.method() && self.threads.unavailable(k).is_none() && !replaced() =>
                {
                    threads.push(k);
                }
                _ => return None,
            }
        }
        threads.sort_unstable();
        threads.dedup();
        Some(create_for(&threads, &self.threads, self.simd))
    }
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
mod tests {
    use super::*;
    use crate::{Aabb, Pairs};

    #[test]
    fn thread_counts_double_up_to_all() {
        assert_eq!(thread_counts(1).collect::<Vec<_>>(), [1]);
        assert_eq!(thread_counts(2).collect::<Vec<_>>(), [1, 2]);
        assert_eq!(thread_counts(6).collect::<Vec<_>>(), [1, 2, 4, 6]);
        assert_eq!(thread_counts(0).collect::<Vec<_>>(), [1]);
    }

    struct Nothing;

    impl BroadPhase for Nothing {
        fn find_pairs(&mut self, _: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
            pairs.clear();
            pairs.finish()
        }
    }

    #[test]
    fn a_user_adds_and_replaces_algorithms() {
        let mut registry = Registry::with_cores(1);
        let ours = registry.entries().len();
        let id: AlgorithmId = "my-tree@cpu1".parse().unwrap();
        registry.add(id.clone(), 7, || Ok(Box::new(Nothing)));
        registry.add(id.clone(), 8, || Ok(Box::new(Nothing)));
        assert_eq!(registry.entries().len(), ours + 1);
        assert_eq!(registry.entries()[ours].revision, 8);
        assert!(registry.create(&id).is_ok());
    }

    #[test]
    fn unknown_algorithms_are_refused_with_the_known_ones() {
        let registry = Registry::with_cores(1);
        let Err(error) = registry.create(&"octree@cpu1".parse().unwrap()) else { panic!("made an unknown algorithm") };
        assert!(error.to_string().contains("brute@cpu1"), "{error}");
        assert!(registry.create(&"brute@gpu0".parse().unwrap()).is_err());
        assert!(registry.create(&"octree@gpu0".parse().unwrap()).is_err());
    }
}
