//! Seeded scenes that evolve frame by frame. Tests, benches and probes share them.

mod drift;
mod fall;
mod fragmentation;
mod rng;
mod walk;

use std::fmt;
use std::str::FromStr;

use drift::{Brownian, Clusters, Gravity};
use fall::Fall;
use fragmentation::Fragmentation;
use rng::Rng;
use sapwise::Aabb;
use walk::{Walk, reflect};

/// A kind of scene.
///
/// Lengths are in edges of the usual object, a unit cube. A *pair per object* is the number of overlapping pairs over the
/// number of objects. The bands given hold every frame seen with 1000, 2000 and 60 000 objects over several seeds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Scenario {
    /// Unit cubes spread evenly over a cube-shaped world of edge 2 n^(1/3), each moving by up to 5 % of its edge per axis and
    /// frame. 0.4 to 0.55 pairs per object: each object touches one other.
    Uniform,
    /// As [`Scenario::Uniform`], each moving by up to two edges per axis and frame, so that no frame helps with the next. 0.4 to
    /// 0.55 pairs per object.
    Fast,
    /// Gaussian blobs of about 1000 unit cubes and deviation 3 in the world of [`Scenario::Uniform`], moving as there while held
    /// to their blob. 2.9 to 4.2 pairs per object. Fewer than 500 objects make one narrower blob of the same density.
    Clustered,
    /// As [`Scenario::Uniform`] and just as dense, in a flat world eight edges high on z. 0.4 to 0.55 pairs per object.
    Slab,
    /// Cubes with edges log-uniform from 0.1 to 10, each moving by up to 5 % of its own edge; and at the head of the list one
    /// fixed cube as large as the world for every 100 objects, up to four. 0.8 to 1.3 pairs per object, and one more for
    /// each of the large cubes.
    Mixed,
    /// As [`Scenario::Uniform`], but only every twentieth object moves: for 30 frames those whose index is 0 modulo 20, then
    /// for 30 frames those whose index is 1, and so on. 0.4 to 0.55 pairs per object.
    Resting,
    /// After Broadmark's scene of that name: unit cubes in the world of [`Scenario::Uniform`] that fly straight on at up to 0.1
    /// edges per axis and frame; one in 64 takes a new direction in each frame. 0.38 to 0.55 pairs per object.
    Brownian,
    /// After Broadmark's scene of that name: unit cubes fall at 9.81 m/s^2 (edge 1 m, 60 frames a second) onto a pile of columns up
    /// to 16 high, come to rest by frame 140, and are dropped again in frame 240. 0.05 to 0.15 pairs per object in the
    /// air, 1.1 to 1.3 at rest. No contact is solved: each object has its own place of rest.
    FreeFall,
    /// After Broadmark's scene of that name: a swarm of unit cubes swirls about a point that moves; all objects move. 5 to 7 pairs
    /// per object, and nearly three times that in the middle.
    Gravity,
    /// After Figure 1 of Avril, Gouranton and Arnaldi (ISVRI 2011): ten cubes shatter in bursts and are cleared away, so that their
    /// number runs from ten to the peak and back in [`Scenario::FRAGMENTATION_FRAMES`], with plateaus and jumps, through most
    /// of its range several times both ways; then all begins again. 0.15 to 2.6 pairs per object while there are
    /// 100 or more, 0.6 to 1.1 on average. The cubes' volumes always add up to about the same.
    Fragmentation,
}

impl Scenario {
    /// Every scenario.
    pub const ALL: [Self; 10] = [
        Self::Uniform,
        Self::Fast,
        Self::Clustered,
        Self::Slab,
        Self::Mixed,
        Self::Resting,
        Self::Brownian,
        Self::FreeFall,
        Self::Gravity,
        Self::Fragmentation,
    ];

    /// Frames in one cycle of [`Scenario::Fragmentation`], after which the numbers of objects repeat.
    pub const FRAGMENTATION_FRAMES: u64 = 600;

    /// The name that [`FromStr`] reads.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Uniform => "uniform",
            Self::Fast => "fast",
            Self::Clustered => "clustered",
            Self::Slab => "slab",
            Self::Mixed => "mixed",
            Self::Resting => "resting",
            Self::Brownian => "brownian",
            Self::FreeFall => "free-fall",
            Self::Gravity => "gravity",
            Self::Fragmentation => "fragmentation",
        }
    }

    /// What happens in the scene, in one line without a full stop.
    #[must_use]
    pub const fn description(self) -> &'static str {
        match self {
            Self::Uniform => "unit cubes spread evenly, each moving by up to 5 % of its edge per frame",
            Self::Fast => "as uniform, each moving by up to two edges per frame",
            Self::Clustered => "Gaussian blobs of about 1000 unit cubes",
            Self::Slab => "as uniform, in a flat world eight edges high",
            Self::Mixed => "cubes with edges from 0.1 to 10, and up to four as large as the world",
            Self::Resting => "as uniform, with 5 % of the objects moving",
            Self::Brownian => "unit cubes flying straight on, a few of them turning in each frame",
            Self::FreeFall => "unit cubes falling onto a pile, coming to rest and dropped again",
            Self::Gravity => "a dense swarm of unit cubes swirling about a point that moves",
            Self::Fragmentation => "cubes shattering and cleared away: from ten to the peak and back in 600 frames",
        }
    }

    /// The scene at frame 0 with `objects` objects; for [`Scenario::Fragmentation`] that is the peak and ten stand at first.
    ///
    /// The same scenario, number of objects and seed give the same bits in every frame and on every platform. All memory
    /// that the scene will ever need is allocated here: up to 52 bytes per object.
    #[must_use]
    pub fn start(self, objects: usize, seed: u64) -> Scene {
        let mut rng = Rng::new(seed);
        let mut boxes = Vec::with_capacity(objects);
        let mut motion = match self {
            Self::Uniform => Motion::Walk(Walk::uniform(objects, STEP, 1, &mut rng)),
            Self::Fast => Motion::Walk(Walk::uniform(objects, 2.0, 1, &mut rng)),
            Self::Clustered => Motion::Clusters(Clusters::new(objects, STEP, &mut rng)),
            Self::Slab => Motion::Walk(Walk::slab(objects, STEP, &mut rng)),
            Self::Mixed => Motion::Walk(Walk::mixed(objects, STEP, &mut rng)),
            Self::Resting => Motion::Walk(Walk::uniform(objects, STEP, 20, &mut rng)),
            Self::Brownian => Motion::Brownian(Brownian::new(objects, &mut rng)),
            Self::FreeFall => Motion::Fall(Fall::new(objects)),
            Self::Gravity => Motion::Gravity(Gravity::new(objects, &mut rng)),
            Self::Fragmentation => Motion::Fragmentation(Box::new(Fragmentation::new(objects))),
        };
        match &mut motion {
            Motion::Walk(m) => m.place(&mut boxes),
            Motion::Clusters(m) => m.place(&mut boxes),
            Motion::Brownian(m) => m.place(&mut boxes),
            Motion::Gravity(m) => m.place(&mut boxes),
            Motion::Fall(m) => m.drop(&mut rng, &mut boxes),
            Motion::Fragmentation(m) => m.advance(0, &mut rng, &mut boxes),
        }
        Scene { scenario: self, objects, frame: 0, boxes, rng, motion }
    }
}

impl fmt::Display for Scenario {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Scenario {
    type Err = UnknownScenario;

    fn from_str(text: &str) -> Result<Self, UnknownScenario> {
        Self::ALL.into_iter().find(|s| s.name() == text).ok_or_else(|| UnknownScenario { text: text.to_owned() })
    }
}

/// A text names no [`Scenario`]. Its message lists the names.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{text:?} is no scenario; use one of {}", Scenario::ALL.map(Scenario::name).join(", "))]
pub struct UnknownScenario {
    text: String,
}

/// Greatest step on each axis in a frame, in edges, where objects move slowly.
const STEP: f32 = 0.05;

/// A scene in one of its frames.
#[derive(Debug, Clone)]
pub struct Scene {
    scenario: Scenario,
    objects: usize,
    frame: u64,
    boxes: Vec<Aabb>,
    rng: Rng,
    motion: Motion,
}

/// What moves the objects, by the state that it needs.
#[derive(Debug, Clone)]
enum Motion {
    Walk(Walk),
    Clusters(Clusters),
    Brownian(Brownian),
    Gravity(Gravity),
    Fall(Fall),
    Fragmentation(Box<Fragmentation>),
}

impl Scene {
    /// The boxes of this frame, in the order of the objects. All are valid and finite.
    #[must_use]
    pub fn boxes(&self) -> &[Aabb] {
        &self.boxes
    }

    /// Goes on to the next frame. Allocates nothing.
    ///
    /// An object keeps its index from frame to frame, except in [`Scenario::Fragmentation`], where objects come and go at
    /// the end of the list.
    pub fn advance(&mut self) {
        self.frame += 1;
        let (rng, boxes) = (&mut self.rng, &mut self.boxes);
        match &mut self.motion {
            Motion::Walk(m) => m.advance(self.frame, rng, boxes),
            Motion::Clusters(m) => m.advance(rng, boxes),
            Motion::Brownian(m) => m.advance(rng, boxes),
            Motion::Gravity(m) => m.advance(self.frame, rng, boxes),
            Motion::Fall(m) => m.advance(self.frame, rng, boxes),
            Motion::Fragmentation(m) => m.advance(self.frame, rng, boxes),
        }
    }

    /// How often the scene was advanced.
    #[must_use]
    pub fn frame(&self) -> u64 {
        self.frame
    }

    /// The kind of scene.
    #[must_use]
    pub fn scenario(&self) -> Scenario {
        self.scenario
    }

    /// The largest number of boxes that any frame has.
    #[must_use]
    pub fn peak_objects(&self) -> usize {
        self.objects
    }
}
