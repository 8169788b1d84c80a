//! Algorithms whose every answer is compared with the oracle.

use crate::oracle::Answer;
use crate::scene::Scene;
use crate::source::Source;
use sapwise::algorithm::SimdLevel;
use sapwise::{Adaptive, AlgorithmId, BroadPhase, Pairs, Registry, Tuning};
use sapwise_tune::{Hardware, Model};
use std::sync::LazyLock;

/// Threads of the widest algorithm.
const CORES: u32 = 3;

/// A registry for each SIMD level of this machine, kept because its pools of threads are expensive.
static REGISTRIES: LazyLock<Vec<Registry>> = LazyLock::new(|| {
    let at_most = |level| {
        let mut registry = Registry::with_cores(CORES);
        registry.limit_simd(level);
        registry
    };
    SimdLevel::ALL.into_iter().filter(|&level| level <= SimdLevel::detected()).map(at_most).collect()
});

/// A tuning with a cost for each algorithm, so that the choice learns and explores.
static PREDICTED: LazyLock<Tuning> = LazyLock::new(|| {
    let entries = REGISTRIES[0].available();
    let prediction = Model::built_in().unwrap().predict(&hardware(), &entries).unwrap();
    prediction.tuning("uniform", &[])
});

/// Returns the hardware parameters of some machine.
///
/// # Panics
/// The report in the tests is damaged.
pub fn hardware() -> Hardware {
    sapwise_lab::report::read(include_str!("../../crates/lab/tests/fixtures/report-3.json")).unwrap().value.hardware
}

/// Algorithms with their names.
pub struct Checked(Vec<(String, Box<dyn BroadPhase>)>);

impl Checked {
    /// Makes all methods at the SIMD level and on the number of threads that the input names, sometimes with an
    /// `Adaptive` over all of them.
    ///
    /// # Panics
    /// An available algorithm can't be made.
    pub fn of(source: &mut Source<'_>) -> Self {
        let registry = &REGISTRIES[usize::from(source.byte()) % REGISTRIES.len()];
        let kind = source.byte();
        let ids: Vec<AlgorithmId> = registry.available().into_iter().map(|e| e.id).collect();
        let threads = [1, 1, 2, CORES][usize::from(kind % 4)];
        let mut all: Vec<(String, Box<dyn BroadPhase>)> = Vec::new();
        for id in ids.iter().filter(|id| id.threads() == threads) {
            all.push((id.to_string(), registry.create(id).unwrap()));
        }
        if kind & 4 != 0 {
            let usual = kind & 8 != 0;
            let tuning = if usual { Tuning::usual(registry) } else { PREDICTED.clone() };
            all.push(("adaptive".to_owned(), Box::new(Adaptive::new(tuning, registry).unwrap())));
        }
        Self(all)
    }

    /// Runs a frame with each. Returns the pairs, unless the answer is an error.
    ///
    /// # Panics
    /// An answer is wrong.
    pub fn frame(&mut self, scene: &mut Scene) -> Option<Pairs> {
        let right = scene.answer();
        let mut room = scene.room();
        for (name, algorithm) in &mut self.0 {
            // Spoils the list: the previous algorithm left the right answer in it.
            room.clear();
            room.push(u32::MAX - 1, u32::MAX);
            let found = algorithm.find_pairs(scene.boxes(), &mut room);
            check(name, &right, found, &room);
        }
        right.pairs.is_ok().then_some(room)
    }
}

/// Compares an answer with the right one.
///
/// # Panics
/// The answer is wrong.
pub fn check(name: &str, right: &Answer, found: Result<(), sapwise::Error>, room: &Pairs) {
    match (&right.pairs, found) {
        (Ok(pairs), Ok(())) => {
            let mut found = room.as_slice().to_vec();
            if room.order() == sapwise::PairOrder::Any {
                found.sort_unstable();
            }
            assert!(found == *pairs, "{name}: {} pairs, not {}", found.len(), pairs.len());
            assert!((pairs.len() as u64..=right.overlapping).contains(&room.overlapping()), "{name}: overlapping");
        }
        (Err(expected), Err(error)) => assert_eq!(*expected, error, "{name}"),
        (expected, found) => panic!("{name}: {found:?}, not {:?}", expected.as_ref().map(Vec::len)),
    }
}
