//! The saved form of a space: its bodies, and the state that the next update compares with. Trees are rebuilt.

use super::active::Patience;
use super::body::Body;
use super::handle::Handle;
use super::slots::At;
use super::update::{handles, key, slots};
use super::{IDLE, Space};
use crate::Aabb;
use serde::de::{Deserialize, Deserializer, Error};
use serde::ser::{Serialize, Serializer};

/// A space between two calls.
#[derive(serde::Serialize, serde::Deserialize)]
struct Snapshot {
    slots: Vec<Slot>,
    /// The slots without a body. The last one is used first.
    free: Vec<u32>,
    /// Pairs of slots at the last update, the lower slot first. First the pairs of two resting bodies, in the order of
    /// [`Space::pairs`]; then all others, ascending.
    pairs: Vec<(u32, u32)>,
    begun: Vec<(Handle, Handle)>,
    ended: Vec<(Handle, Handle)>,
    /// The limit of [`Space::set_limit`].
    limit: Option<usize>,
}

#[derive(serde::Serialize, serde::Deserialize)]
struct Slot {
    /// The generation of the body in the slot; if the slot is free, that of the next one.
    generation: u32,
    held: Option<Held>,
}

/// A body in its slot.
#[derive(serde::Serialize, serde::Deserialize)]
struct Held {
    aabb: Aabb,
    body: Body,
    stage: Stage,
    /// The box at the last update, if something was done to the body since.
    previous: Option<Aabb>,
    /// Whether the body was removed since the last update.
    removed: bool,
}

/// The state of a body after the last update.
#[derive(Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
enum Stage {
    /// Inserted since.
    New,
    /// The number of updates until it may rest, and its [`Patience::wait`].
    Active(u64, u64),
    Resting,
}

impl Snapshot {
    fn of(space: &Space) -> Self {
        let Space { active, links, before, .. } = space;
        let (now, mut previous) = (&space.slots, space.slots.clone());
        previous.exchange_replaced();
        let held = |slot: u32| {
            let known = previous.boxes[slot as usize];
            let (stage, known) = match now.at(slot) {
                At::Free => return None,
                At::New => (Stage::New, None),
                At::Active(at) => {
                    let Patience { until, wait } = active.patience[at as usize];
                    (Stage::Active(until.saturating_sub(space.update), wait), Some(active.boxes[at as usize]))
                }
                At::Resting => (Stage::Resting, Some(known)),
            };
            Some(Held {
                aabb: now.boxes[slot as usize],
                body: *now.body(slot),
                stage,
                previous: known.filter(|_| now.is_changed(slot)),
                removed: !now.is_taken(slot),
            })
        };
        let slot = |slot| Slot { generation: now.handle(slot).generation(), held: held(slot) };
        let resting = space.pairs[..links.len()].iter().map(|(a, b)| (a.slot(), b.slot()));
        Self {
            slots: (0..now.boxes.len() as u32).map(slot).collect(),
            free: now.free.clone(),
            pairs: resting.chain(before.iter().copied().map(slots)).collect(),
            begun: space.begun.clone(),
            ended: space.ended.clone(),
            limit: active.pairs.limit(),
        }
    }

    /// Returns the space, or a description of the defect.
    fn restore(self) -> Result<Space, String> {
        let mut space = Space::new();
        space.set_limit(self.limit);
        space.reserve(self.slots.len()).map_err(|error| error.to_string())?;
        for slot in &self.slots {
            space.slots.push(slot.generation);
        }
        space.slots.free = self.free()?;
        if let Some(slot) = self.slots.iter().position(|slot| slot.generation == 0) {
            return Err(format!("slot {slot} has the generation 0; the first is 1"));
        }
        let held = || (0..).zip(&self.slots).filter_map(|(slot, of)| Some((slot, of.held.as_ref()?)));
        for (slot, held) in held() {
            if let Some(defect) = held.aabb.defect().or_else(|| held.previous?.defect()) {
                return Err(format!("the box of the body in slot {slot} {defect}"));
            }
            if held.stage != Stage::New {
                space.slots.occupy(slot, held.previous.unwrap_or(held.aabb), held.body);
            }
            match held.stage {
                Stage::New => {}
                Stage::Active(until, wait) => {
                    let [until, wait] = [until, wait].map(|updates| updates.min(IDLE));
                    space.activate(slot, Patience { until, wait }, None);
                }
                Stage::Resting => space.slots.set_at(slot, At::Resting),
            }
        }
        // Until here it is the space at the last update, with no changes since.
        let changes = space.slots.take_changes();
        for &slot in &changes {
            space.slots.take_done(slot);
        }
        space.slots.give_back(changes);
        for (slot, held) in held() {
            if held.stage == Stage::New {
                space.slots.occupy(slot, held.aabb, held.body);
            } else if held.previous.is_some() {
                space.slots.set(slot, held.aabb);
                space.slots.set_body(slot, held.body);
            }
            if held.removed {
                space.slots.remove(slot);
            }
        }
        space.resting.begin(&mut space.slots);
        space.rests = space.resting.len() > 0;
        self.restore_pairs(&mut space)?;
        (space.begun, space.ended) = (self.begun, self.ended);
        Ok(space)
    }

    /// Returns the slots without a body, each of which must be there once.
    fn free(&self) -> Result<Vec<u32>, String> {
        let mut missing: Vec<bool> = self.slots.iter().map(|slot| slot.held.is_none()).collect();
        for &slot in &self.free {
            if !missing.get_mut(slot as usize).is_some_and(std::mem::take) {
                return Err(format!("free slot {slot} has a body, is beyond the last slot, or is free twice"));
            }
        }
        let forgotten = missing.iter().position(|&missing| missing);
        forgotten.map_or_else(|| Ok(self.free.clone()), |slot| Err(format!("slot {slot} has no body and is not free")))
    }

    fn restore_pairs(&self, space: &mut Space) -> Result<(), String> {
        let Space { slots, links, before, pairs, .. } = space;
        let has_body = |slot: u32| self.slots.get(slot as usize).is_some_and(|of| of.held.is_some());
        for &(a, b) in &self.pairs {
            if a >= b || !has_body(a) || !has_body(b) {
                return Err(format!("pair ({a}, {b}) is not of two slots with bodies, the lower one first"));
            }
            if slots.at(a) == At::Resting && slots.at(b) == At::Resting {
                links.add((slots.handle(a), slots.handle(b)), pairs);
            } else {
                before.push(key(a, b));
            }
        }
        let mut sorted = self.pairs.clone();
        sorted.sort_unstable();
        if let Some(twice) = sorted.windows(2).find(|two| two[0] == two[1]) {
            return Err(format!("pair {:?} is there twice", twice[0]));
        }
        if !before.is_sorted() {
            return Err("the pairs of bodies that don't rest do not ascend".to_owned());
        }
        pairs.extend(before.iter().map(|&key| handles(slots, key)));
        Ok(())
    }
}

/// Saves the bodies with their handles, the three lists of pairs and the limit. A restored space goes on as the
/// original would: the same calls give the same lists.
///
/// The tuning, the algorithms and their threads are not saved, because they belong to a machine and a program: a
/// restored space searches as [`Space::new`] does. Restore into a space that searches as you want with
/// [`clone_from`](Space#impl-Clone-for-Space):
///
/// ```
/// use sapwise::{Aabb, Adaptive, Body, Registry, Space, Tuning};
///
/// let registry = Registry::with_cores(1);
/// let mut space = Space::with(Adaptive::new(Tuning::usual(&registry), &registry)?);
/// let body = space.insert(Aabb::cube([0.0; 3], 1.0), Body::default())?;
/// space.update()?;
/// let saved = serde_json::to_string(&space)?;
/// space.remove(body)?;
///
/// let restored: Space = serde_json::from_str(&saved)?;
/// space.clone_from(&restored); // `space` still runs on one thread
/// assert!(space.contains(body));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
impl Serialize for Space {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        Snapshot::of(self).serialize(to)
    }
}

/// A malformed snapshot is an error that says what is wrong with it.
impl<'de> Deserialize<'de> for Space {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        Snapshot::deserialize(from)?.restore().map_err(D::Error::custom)
    }
}
