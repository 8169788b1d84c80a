//! The algorithms of the command: ours, and those that a user's program adds.

use crate::revisions;
use sapwise::{AlgorithmId, Backend, BackendClass, BroadPhase, Error, Registry};
use std::sync::Arc;

/// Makes an instance of a user's algorithm on that many threads.
type Make = Arc<dyn Fn(u32) -> Result<Box<dyn BroadPhase>, Error> + Send + Sync>;

/// What a registry of the command holds beside the algorithms on GPUs.
///
/// It is handed from the start of the command to every verb that runs algorithms or names them, and is the one place where they make
/// a [`Registry`]: one made elsewhere would know nothing of the user's. It is no global, so that two tests of one process can have
/// different ones.
#[derive(Default)]
pub(crate) struct Algorithms {
    users: Vec<User>,
}

/// A user's algorithm.
struct User {
    method: String,
    revision: u32,
    /// Whether it runs on the thread counts that ours run on, or on one thread only.
    parallel: bool,
    make: Make,
}

impl Algorithms {
    /// Adds a user's algorithm.
    ///
    /// # Errors
    /// A sentence, when the name is no method name, is that of a method of ours, or was given before.
    pub(crate) fn add(
        &mut self,
        method: &str,
        revision: u32,
        parallel: bool,
        make: impl Fn(u32) -> Result<Box<dyn BroadPhase>, Error> + Send + Sync + 'static,
    ) -> Result<(), String> {
        AlgorithmId::new(method, Backend::Cpu(1)).map_err(|e| e.to_string())?;
        // Timings and models are told apart by the name, so a second algorithm under it would pass for the first.
        let ours = Registry::with_cores(1);
        if [BackendClass::Cpu, BackendClass::Gpu].iter().any(|&class| revisions::is_known((class, method), &ours)) {
            return Err(format!("{method:?} is the name of a method of Sapwise; give your algorithm another name"));
        }
        if self.users.iter().any(|u| u.method == method) {
            return Err(format!("two algorithms are called {method:?}; give one of them another name"));
        }
        self.users.push(User { method: method.to_owned(), revision, parallel, make: Arc::new(make) });
        Ok(())
    }

    /// Ours on 1, 2, 4, ... and `cores` threads, then the user's.
    pub(crate) fn registry(&self, cores: u32) -> Registry {
        let mut registry = Registry::with_cores(cores);
        let mut counts: Vec<u32> = registry.available().iter().map(|(id, _)| id.threads()).collect();
        counts.sort_unstable();
        counts.dedup();
        for user in &self.users {
            for &threads in counts.iter().filter(|&&k| k == 1 || user.parallel) {
                // The name was accepted on one thread, and the counts are those of ids.
                let Ok(id) = AlgorithmId::new(&user.method, Backend::Cpu(threads)) else { continue };
                let make = Arc::clone(&user.make);
                registry.add(id, user.revision, move || make(threads));
            }
        }
        registry
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sapwise::{Aabb, Pairs};

    struct Nothing;

    impl BroadPhase for Nothing {
        fn find_pairs(&mut self, _: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
            pairs.clear();
            pairs.finish()
        }
    }

    fn nothing(_: u32) -> Result<Box<dyn BroadPhase>, Error> {
        Ok(Box::new(Nothing))
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
            let told = algorithms.add(name, 1, false, nothing).unwrap_err();
            assert!(told.contains(why), "{name}: {told}");
        }
        algorithms.add("tree", 1, false, nothing).unwrap();
        assert!(algorithms.add("tree", 2, true, nothing).unwrap_err().contains("two algorithms"));
    }

    #[test]
    fn a_serial_one_is_listed_once_and_a_parallel_one_as_often_as_ours() {
        let mut algorithms = Algorithms::default();
        algorithms.add("tree", 3, false, nothing).unwrap();
        algorithms.add("grid", 4, true, nothing).unwrap();
        let registry = algorithms.registry(6);
        let counts = |method: &str| -> Vec<(u32, u32)> {
            let all = registry.available().into_iter();
            all.filter(|(id, _)| id.method() == method).map(|(id, revision)| (id.threads(), revision)).collect()
        };
        assert_eq!(counts("tree"), [(1, 3)]);
        assert_eq!(counts("grid"), [(1, 4), (2, 4), (4, 4), (6, 4)]);
        assert_eq!(counts("brute").len(), 4);
        assert!(registry.create(&"grid@cpu4".parse().unwrap()).is_ok());
    }

    #[test]
    fn an_instance_is_made_for_its_number_of_threads() {
        let mut algorithms = Algorithms::default();
        let only_four = |threads: u32| match threads {
            4 => nothing(threads),
            _ => Err(Error::OutOfMemory { what: "threads", elements: threads as usize }),
        };
        algorithms.add("grid", 1, true, only_four).unwrap();
        let registry = algorithms.registry(4);
        assert!(registry.create(&"grid@cpu4".parse().unwrap()).is_ok());
        let Err(error) = registry.create(&"grid@cpu2".parse().unwrap()) else { panic!("made for another count") };
        assert!(error.to_string().contains("no memory for 2 threads"), "{error}");
    }
}
