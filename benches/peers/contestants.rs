//! The contestants: our algorithms and those of other crates.

use crate::ground::{Ground, Grounded};
use crate::naive::Naive;
use crate::obvhs_tree::{Moving, Obvhs};
use crate::parry::{Leaving, Margin, Parry, Upkeep};
use crate::rtree::{Packed, Rtree};
use obvhs::bvh2::Bvh2;
use parry3d::partitioning::Bvh;
use rayon::ThreadPool;
use sapwise::{Aabb, Adaptive, AlgorithmId, BroadPhase, Error, Pairs, Registry, Tuning};
use sapwise_scenes::Scenario;
use std::sync::Arc;

/// A side of the comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    /// Our adaptive choice.
    Adaptive,
    /// A method of ours that always runs.
    Fixed,
    /// Another crate, or the double loop.
    Peer,
}

/// An algorithm in the race.
pub(crate) struct Contestant {
    pub(crate) name: String,
    pub(crate) side: Side,
    /// Whether it keeps state from frame to frame, and therefore must run the frames before the timed ones.
    pub(crate) keeps: bool,
    /// The largest number of objects at which it races.
    pub(crate) most: usize,
    /// Consecutive hopeless frames, up to the last one.
    pub(crate) hopeless_frames: u32,
    algorithm: Box<dyn BroadPhase>,
}

impl Contestant {
    fn new(name: &str, side: Side, keeps: bool, most: usize, algorithm: Box<dyn BroadPhase>) -> Self {
        Self { name: name.to_owned(), side, keeps, most, hopeless_frames: 0, algorithm }
    }

    fn peer(name: &str, keeps: bool, most: usize, algorithm: impl BroadPhase + 'static) -> Self {
        Self::new(name, Side::Peer, keeps, most, Box::new(algorithm))
    }

    /// Makes a peer with a separate tree for the boxes that are declared fixed.
    fn grounded<G: Ground + 'static>(
        name: &str,
        keeps: bool,
        most: usize,
        algorithm: impl BroadPhase + 'static,
    ) -> Self {
        Self::peer(name, keeps, most, Grounded::<G, _>::new(algorithm))
    }

    /// Returns the name without the number of threads.
    pub(crate) fn short_name(&self) -> &str {
        self.name.split(['@', '(']).next().unwrap_or_default().trim_end()
    }

    /// Makes a method of ours. One whose time grows faster than the number of objects races only at sizes at which it
    /// is not far behind.
    fn fixed(id: &AlgorithmId, registry: &Registry) -> Result<Self, Error> {
        let most = match id.method() {
            "brute" => 3_000,
            "sap" => 100_000,
            _ => usize::MAX,
        };
        let algorithm = registry.create(id)?;
        let keeps = algorithm.is_incremental();
        Ok(Self::new(&id.to_string(), Side::Fixed, keeps, most, algorithm))
    }

    /// # Errors
    /// Those of the algorithm.
    pub(crate) fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        self.algorithm.find_pairs(boxes, pairs)
    }
}

/// Makes our contestants: the adaptive one over this tuning, and every method that the registry lists.
///
/// # Errors
/// If one of them can't be made.
pub(crate) fn ours(registry: &Registry, tuning: &Tuning) -> Result<Vec<Contestant>, Error> {
    let adaptive = Box::new(Adaptive::new(tuning.clone(), registry)?);
    let mut all = vec![Contestant::new("adaptive", Side::Adaptive, true, usize::MAX, adaptive)];
    for id in registry.available().into_iter().map(|e| e.id) {
        all.push(Contestant::fixed(&id, registry)?);
    }
    Ok(all)
}

/// Makes the peers. Without a pool: all, on one thread. With a pool: those that are fastest on one thread, and all
/// that have a parallel form.
pub(crate) fn peers(pool: Option<&Arc<ThreadPool>>, scenario: Scenario) -> Vec<Contestant> {
    let all = usize::MAX;
    // These trees take long for many moving boxes. In `city` few move.
    let most = if scenario == Scenario::City { all } else { 100_000 };
    let mut peers = vec![
        Contestant::grounded::<Bvh>("parry3d refit", true, all, Parry::new(Upkeep::Refit, None)),
        Contestant::grounded::<Bvh>("parry3d optimise", true, all, Parry::new(Upkeep::Optimise, None)),
        Contestant::grounded::<Bvh>("parry3d margin", true, all, Margin::new(Leaving::Stays)),
        Contestant::grounded::<Bvh>("parry3d reinsert", true, all, Margin::new(Leaving::Reinserted)),
    ];
    match pool {
        None => peers.extend([
            Contestant::grounded::<Bvh>("parry3d rebuild", false, all, Parry::new(Upkeep::Rebuild, None)),
            Contestant::grounded::<Bvh2>("obvhs rebuild", false, most, Obvhs::rebuilding(None)),
            Contestant::grounded::<Bvh2>("obvhs refit", true, most, Obvhs::refitting()),
            Contestant::grounded::<Bvh2>("obvhs move", true, most, Moving::new()),
            Contestant::grounded::<Rtree>("rstar", false, most, Packed),
            Contestant::peer("double loop", false, 3_000, Naive),
        ]),
        // They need no tree for fixed boxes: `city` runs on one thread only.
        Some(pool) => peers.extend([
            Contestant::peer("parry3d refit (2 threads)", true, all, Parry::new(Upkeep::Refit, Some(pool))),
            Contestant::peer("parry3d optimise (2 threads)", true, all, Parry::new(Upkeep::Optimise, Some(pool))),
            Contestant::peer("parry3d rebuild (2 threads)", false, all, Parry::new(Upkeep::Rebuild, Some(pool))),
            Contestant::peer("obvhs rebuild (2 threads)", false, most, Obvhs::rebuilding(Some(pool))),
        ]),
    }
    peers
}
