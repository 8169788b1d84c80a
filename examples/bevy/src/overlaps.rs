//! The overlaps of one fixed step, and what changed since the one before.

use bevy_ecs::prelude::*;
use sapwise::{Aabb, Adaptive, BroadPhase, Changes, Error, Pairs, Registry, Tuning};

/// The entities that overlap, as of the last fixed step.
#[derive(Resource)]
pub struct Overlaps {
    broad_phase: Adaptive,
    entities: Vec<Entity>,
    boxes: Vec<Aabb>,
    pairs: Pairs,
    changes: Changes<Entity>,
}

impl FromWorld for Overlaps {
    /// Over all cores, with the borders that are written down in Sapwise. An app that has measured or predicted the
    /// borders of the machine at hand inserts its own with [`Overlaps::new`] before it adds the plugin.
    fn from_world(_: &mut World) -> Self {
        let registry = Registry::new();
        let adaptive = Adaptive::new(Tuning::usual(&registry), &registry);
        Self::new(adaptive.expect("the usual tuning names an algorithm that runs everywhere"))
    }
}

impl Overlaps {
    /// No overlaps yet, to be found by this broad phase.
    #[must_use]
    pub fn new(broad_phase: Adaptive) -> Self {
        Self { broad_phase, entities: Vec::new(), boxes: Vec::new(), pairs: Pairs::new(), changes: Changes::new() }
    }

    /// All pairs of entities that overlap, each with the lower one first, sorted.
    #[must_use]
    pub fn pairs(&self) -> &[(Entity, Entity)] {
        self.changes.pairs()
    }

    /// The pairs that overlap now and did not in the step before, sorted.
    #[must_use]
    pub fn begun(&self) -> &[(Entity, Entity)] {
        self.changes.begun()
    }

    /// The pairs that overlapped in the step before and don't now, sorted. Those of an entity that is gone are among
    /// them.
    #[must_use]
    pub fn ended(&self) -> &[(Entity, Entity)] {
        self.changes.ended()
    }

    /// The algorithm that found them; `None` before the first step.
    #[must_use]
    pub fn algorithm(&self) -> Option<String> {
        self.broad_phase.last_decision().map(|d| d.algorithm.to_string())
    }

    /// The broad phase, for what it tells and for what it is told.
    pub fn adaptive(&mut self) -> &mut Adaptive {
        &mut self.broad_phase
    }

    pub(crate) fn find(&mut self, colliders: impl Iterator<Item = (Entity, Aabb)>) -> Result<(), BevyError> {
        self.entities.clear();
        self.boxes.clear();
        for (entity, b) in colliders {
            self.entities.push(entity);
            self.boxes.push(b);
        }
        match self.broad_phase.find_pairs(&self.boxes, &mut self.pairs) {
            Ok(()) => {}
            Err(error @ Error::InvalidBox { index, .. }) => {
                return Err(format!("entity {}: {error}", self.entities[index]).into());
            }
            Err(error) => return Err(error.into()),
        }
        self.changes.update(&self.pairs, &self.entities)?;
        Ok(())
    }
}
