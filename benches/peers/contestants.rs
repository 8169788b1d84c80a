//! Who takes part.

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

/// One that takes part.
pub(crate) struct Contestant {
    pub(crate) name: String,
    pub(crate) side: Side,
    /// Whether it keeps something from frame to frame, and so has to go through the frames before the timed ones.
    pub(crate) keeps: bool,
    /// The largest number of objects that it is asked for.
    pub(crate) most: usize,
    /// Hopeless frames in a row, up to the last one.
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

    /// The same with a tree for the boxes that are declared fixed.
    fn grounded<G: Ground + 'static>(
        name: &str,
        keeps: bool,
        most: usize,
        algorithm: impl BroadPhase + 'static,
    ) -> Self {
        Self::peer(name, keeps, most, Grounded::<G, _>::new(algorithm))
    }

    /// The name without the number of threads.
    pub(crate) fn short_name(&self) -> &str {
        self.name.split(['@', '(']).next().unwrap_or_default().trim_end()
    }

    /// A method of ours. Those whose time grows faster than the number of objects leave where they are far behind.
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
    /// Whatever keeps it from finding the pairs.
    pub(crate) fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        self.algorithm.find_pairs(boxes, pairs)
    }
}

/// Ours: the adaptive one over this tuning, and every method that the registry lists.
///
/// # Errors
/// When one of them can't be made.
pub(crate) fn ours(registry: &Registry, tuning: &Tuning) -> Result<Vec<Contestant>, Error> {
    let adaptive = Box::new(Adaptive::new(tuning.clone(), registry)?);
    let mut all = vec![Contestant::new("adaptive", Side::Adaptive, true, usize::MAX, adaptive)];
    for id in registry.available().into_iter().map(|e| e.id) {
        all.push(Contestant::fixed(&id, registry)?);
    }
    Ok(all)
}

/// The peers on one thread; with a pool those of them that are fastest there, beside all that have a parallel form.
pub(crate) fn peers(pool: Option<&Arc<ThreadPool>>, scenario: Scenario) -> Vec<Contestant> {
    let all = usize::MAX;
    // Trees that take long for many boxes that move. In `city` few do.
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
        // Without a tree for fixed boxes: `city` runs on one thread.
        Some(pool) => peers.extend([
            Contestant::peer("parry3d refit (2 threads)", true, all, Parry::new(Upkeep::Refit, Some(pool))),
            Contestant::peer("parry3d optimise (2 threads)", true, all, Parry::new(Upkeep::Optimise, Some(pool))),
            Contestant::peer("parry3d rebuild (2 threads)", false, all, Parry::new(Upkeep::Rebuild, Some(pool))),
            Contestant::peer("obvhs rebuild (2 threads)", false, most, Obvhs::rebuilding(Some(pool))),
        ]),
    }
    peers
}
