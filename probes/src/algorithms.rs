//! The algorithms of the command: those of the library, and those that a user's program adds.

use crate::revisions;
use sapwise::algorithm::{Backend, BackendClass};
use sapwise::tuning::Term;
use sapwise::{AlgorithmId, BroadPhase, Error, Registry};
use sapwise_tune::model::Scale;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Creates an instance of a user's algorithm on a number of threads.
type Factory = Arc<dyn Fn(u32) -> Result<Box<dyn BroadPhase>, Error> + Send + Sync>;

/// An algorithm that a user's program adds to the command.
///
/// `method` is 1 to 32 of `a-z`, `0-9`, `-` and `_`, begins with a letter, and is no name of the library's. Increase
/// `revision` whenever the speed changes: reports and models of other revisions are stale then. Each process that
/// runs the algorithm calls the factory; an error leaves the algorithm out with a remark. An algorithm with kernels
/// of several vector widths should ask [`SimdLevel::in_use`](sapwise::algorithm::SimdLevel::in_use), so that
/// `SAPWISE_SIMD` restricts it too.
#[derive(Clone)]
pub struct UserAlgorithm {
    method: String,
    revision: u32,
    /// Whether it runs on the thread counts of the library's algorithms, or on one thread only.
    parallel: bool,
    terms: Vec<(Term, Scale)>,
    factory: Factory,
}

impl UserAlgorithm {
    /// Creates an algorithm that runs on the calling thread alone, as `method@cpu1`.
    pub fn on_one_thread(
        method: &str,
        revision: u32,
        factory: impl Fn() -> Result<Box<dyn BroadPhase>, Error> + Send + Sync + 'static,
    ) -> Self {
        Self::new(method, revision, false, Arc::new(move |_| factory()))
    }

    /// Creates an algorithm that runs on several threads. The factory gets their number, the calling thread included:
    /// 1, 2, 4, ... and all that the machine has or `--threads` allows. The command pins the library's threads to
    /// cores, not those of a user's algorithm.
    pub fn on_threads(
        method: &str,
        revision: u32,
        factory: impl Fn(u32) -> Result<Box<dyn BroadPhase>, Error> + Send + Sync + 'static,
    ) -> Self {
        Self::new(method, revision, true, Arc::new(factory))
    }

    fn new(method: &str, revision: u32, parallel: bool, factory: Factory) -> Self {
        Self { method: method.to_owned(), revision, parallel, terms: Vec::new(), factory }
    }

    /// Sets the terms of the time of a frame: a count of the load, and the hardware parameter that it scales with.
    /// `train` fits a unit for each. Without this the terms are calls, objects, sorting, all pairs, candidates on an
    /// axis and pairs.
    ///
    /// `probes/examples/own_algorithm.rs` declares a sort of `log2 n` steps for each object.
    #[must_use]
    pub fn terms(mut self, terms: &[(Term, Scale)]) -> Self {
        self.terms = terms.to_vec();
        self
    }
}

/// The algorithms on the CPU that the command knows.
///
/// Every verb gets it from the start of the command, and makes each [`Registry`] with it: one made elsewhere would
/// lack the user's. It is no global, so that two tests of one process can have different ones.
#[derive(Default)]
pub(crate) struct Algorithms {
    users: Vec<UserAlgorithm>,
}

impl Algorithms {
    /// Adds a user's algorithm.
    ///
    /// # Errors
    /// A sentence, when the name is no method name, is that of a method of ours, or was added before.
    pub(crate) fn add(&mut self, algorithm: UserAlgorithm) -> Result<(), String> {
        let method = &algorithm.method;
        AlgorithmId::new(method, Backend::Cpu(1)).map_err(|e| e.to_string())?;
        // Timings and models know an algorithm by its name only.
        let ours = Registry::with_cores(1);
        if [BackendClass::Cpu, BackendClass::Gpu].iter().any(|&class| revisions::is_known((class, method), &ours)) {
            return Err(format!("{method:?} is the name of a method of Sapwise; give your algorithm another name"));
        }
        if self.users.iter().any(|u| u.method == *method) {
            return Err(format!("two algorithms are called {method:?}; give one of them another name"));
        }
        self.users.push(algorithm);
        Ok(())
    }

    /// Returns the terms that a user declared for a method; none for the library's.
    pub(crate) fn terms(&self, id: &AlgorithmId) -> &[(Term, Scale)] {
        let own = self.users.iter().find(|u| u.method == id.method() && id.backend().class() == BackendClass::Cpu);
        own.map_or(&[], |u| &u.terms)
    }

    /// Returns the methods of the user, each with its revision.
    pub(crate) fn users(&self) -> impl Iterator<Item = (&str, u32)> {
        self.users.iter().map(|u| (u.method.as_str(), u.revision))
    }

    /// Makes a registry with the library's algorithms on 1, 2, 4, ... and `cores` threads, then the user's.
    pub(crate) fn registry(&self, cores: u32) -> Registry {
        let mut registry = Registry::with_cores(cores);
        let counts: BTreeSet<u32> = registry.available().iter().map(|e| e.id.threads()).collect();
        for user in &self.users {
            for &threads in counts.iter().filter(|&&k| k == 1 || user.parallel) {
                // The name was accepted on one thread, and the counts are those of ids.
                let Ok(id) = AlgorithmId::new(&user.method, Backend::Cpu(threads)) else { continue };
                let factory = Arc::clone(&user.factory);
                registry.add(id, user.revision, move || factory(threads));
            }
        }
        registry
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use sapwise::{Aabb, Pairs};

    /// Finds no pairs.
    pub(crate) struct Nothing;

    impl BroadPhase for Nothing {
        fn find_pairs(&mut self, _: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
            pairs.clear();
            pairs.finish()
        }
    }

    fn nothing(_: u32) -> Result<Box<dyn BroadPhase>, Error> {
        Ok(Box::new(Nothing))
    }

    fn serial(method: &str, revision: u32) -> UserAlgorithm {
        UserAlgorithm::on_one_thread(method, revision, || nothing(1))
    }

    #[test]
    fn names_of_ours_names_given_twice_and_what_is_no_name_are_refused() {
        let mut algorithms = Algorithms::default();
        for (name, why) in [
            ("brute", "is the name of a method of Sapwise"),
            ("pair-cache", "is the name of a method of Sapwise"),
            ("My Tree", "is no method name"),
            ("tree@cpu1", "is no method name"),
            ("", "is no method name"),
        ] {
            let told = algorithms.add(serial(name, 1)).unwrap_err();
            assert!(told.contains(why), "{name}: {told}");
        }
        algorithms.add(serial("tree", 1)).unwrap();
        assert!(algorithms.add(UserAlgorithm::on_threads("tree", 2, nothing)).unwrap_err().contains("two algorithms"));
    }

    #[test]
    fn a_serial_one_is_listed_once_and_a_parallel_one_as_often_as_ours() {
        let mut algorithms = Algorithms::default();
        algorithms.add(serial("tree", 3)).unwrap();
        algorithms.add(UserAlgorithm::on_threads("grid", 4, nothing)).unwrap();
        let registry = algorithms.registry(6);
        let counts = |method: &str| -> Vec<(u32, u32)> {
            let all = registry.available().into_iter();
            all.filter(|e| e.id.method() == method).map(|e| (e.id.threads(), e.revision)).collect()
        };
        assert_eq!(counts("tree"), [(1, 3)]);
        assert_eq!(counts("grid"), [(1, 4), (2, 4), (4, 4), (6, 4)]);
        assert_eq!(counts("brute").len(), 4);
        assert!(registry.create(&"grid@cpu4".parse().unwrap()).is_ok());
    }

    #[test]
    fn terms_are_those_of_the_method_on_any_number_of_threads() {
        let mut algorithms = Algorithms::default();
        let terms = [(Term::Call, Scale::Cycle), (Term::Pairs, Scale::Lane)];
        algorithms.add(UserAlgorithm::on_threads("grid", 1, nothing).terms(&terms)).unwrap();
        algorithms.add(serial("tree", 1)).unwrap();
        let of = |id: &str| algorithms.terms(&id.parse().unwrap());
        assert_eq!(of("grid@cpu4"), terms);
        assert!(["tree@cpu1", "brute@cpu1", "grid@gpu0"].iter().all(|id| of(id).is_empty()));
    }
}
