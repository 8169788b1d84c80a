//! The overlaps of one fixed step, and what changed since the one before.

use bevy_ecs::prelude::*;
use sapwise::{Aabb, Adaptive, BroadPhase, Error, Fields, Pair, Pairs, Registry};
use std::sync::{Mutex, PoisonError};

/// The entities that overlap, as of the last fixed step.
#[derive(Resource)]
pub struct Overlaps {
    /// An algorithm need not be `Sync`, which a resource must be. Behind `ResMut` the lock is never waited for.
    broad_phase: Mutex<Adaptive>,
    entities: Vec<Entity>,
    boxes: Vec<Aabb>,
    found: Pairs,
    /// Sorted, and so are the other three.
    pairs: Vec<(Entity, Entity)>,
    before: Vec<(Entity, Entity)>,
    began: Vec<(Entity, Entity)>,
    ended: Vec<(Entity, Entity)>,
}

impl FromWorld for Overlaps {
    /// Over all cores, with the borders that are written down in Sapwise. An app that has measured or predicted the borders of the
    /// machine at hand inserts its own with [`Overlaps::new`] before it adds the plugin.
    fn from_world(_: &mut World) -> Self {
        let registry = Registry::new();
        let adaptive = Adaptive::new(Fields::usual(&registry), &registry);
        Self::new(adaptive.expect("the usual fields name an algorithm that runs everywhere"))
    }
}

impl Overlaps {
    /// No overlaps yet, to be found by this broad phase.
    #[must_use]
    pub fn new(broad_phase: Adaptive) -> Self {
        Self {
            broad_phase: Mutex::new(broad_phase),
            entities: Vec::new(),
            boxes: Vec::new(),
            found: Pairs::new(),
            pairs: Vec::new(),
            before: Vec::new(),
            began: Vec::new(),
            ended: Vec::new(),
        }
    }

    /// All pairs of entities that overlap, each with the lower one first, sorted.
    #[must_use]
    pub fn pairs(&self) -> &[(Entity, Entity)] {
        &self.pairs
    }

    /// The pairs that overlap now and did not in the step before, sorted.
    #[must_use]
    pub fn began(&self) -> &[(Entity, Entity)] {
        &self.began
    }

    /// The pairs that overlapped in the step before and don't now, sorted. Those of an entity that is gone are among them.
    #[must_use]
    pub fn ended(&self) -> &[(Entity, Entity)] {
        &self.ended
    }

    /// The algorithm that found them; `None` before the first step.
    #[must_use]
    pub fn algorithm(&mut self) -> Option<String> {
        self.adaptive().last_decision().map(|d| d.algorithm.to_string())
    }

    /// The broad phase, for what it tells and for what it is told.
    pub fn adaptive(&mut self) -> &mut Adaptive {
        self.broad_phase.get_mut().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn find(&mut self, colliders: impl Iterator<Item = (Entity, Aabb)>) -> Result<(), BevyError> {
        self.entities.clear();
        self.boxes.clear();
        for (entity, b) in colliders {
            self.entities.push(entity);
            self.boxes.push(b);
        }
        let broad_phase = self.broad_phase.get_mut().unwrap_or_else(PoisonError::into_inner);
        match broad_phase.find_pairs(&self.boxes, &mut self.found) {
            Ok(()) => {}
            Err(error @ Error::InvalidBox { index, .. }) => {
                return Err(format!("entity {}: {error}", self.entities[index]).into());
            }
            Err(error) => return Err(error.into()),
        }
        std::mem::swap(&mut self.pairs, &mut self.before);
        let entities = &self.entities;
        let named = |&(i, j): &Pair| (entities[i as usize], entities[j as usize]);
        self.pairs.clear();
        self.pairs.extend(self.found.iter().map(named).map(|(a, b)| (a.min(b), a.max(b))));
        self.pairs.sort_unstable();
        let lacks = |list: &[(Entity, Entity)], pair: &(Entity, Entity)| list.binary_search(pair).is_err();
        self.began.clear();
        self.began.extend(self.pairs.iter().filter(|&pair| lacks(&self.before, pair)));
        self.ended.clear();
        self.ended.extend(self.before.iter().filter(|&pair| lacks(&self.pairs, pair)));
        Ok(())
    }
}
