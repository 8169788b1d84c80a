//! Seeded scenes that evolve frame by frame. Tests, benches and probes share them.

mod drift;
mod fall;
mod fragmentation;
mod rng;
mod roam;
mod scene;
mod walk;

use std::fmt;
use std::str::FromStr;

pub use scene::Scene;

/// A kind of scene.
///
/// Lengths are in edges of the usual object, a unit cube. A *pair per object* is the number of overlapping pairs over the
/// number of objects. The bands given hold every frame seen with 1000, 2000 and 60 000 objects over several seeds.
///
/// From [`Scenario::Parked`] on the scenes have few pairs and are hard all the same: each has something that makes a usual shortcut quadratic.
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
    /// As [`Scenario::Teleport`] without its jumps, but one object in fifty, anywhere in the list, is pooled ten thousand world edges
    /// away on each axis, as games do with what is not in play: spread there on a lattice, and still. 0.06 to 0.13 pairs per object.
    Parked,
    /// Two worlds of equal halves of the objects, a thousand of their edges apart along a diagonal, each as dense as the one of
    /// [`Scenario::Teleport`] and moving as it. Which object is where has no order. 0.07 to 0.12 pairs per object.
    Stations,
    /// About n^(1/2) floors of about n^(1/4) by n^(1/4) flat boxes of 1 by 1 by 0.1, a quarter of an edge apart, each walking in a field of its
    /// own by up to 0.005 edges per axis and frame. No pair; on x and y together each box overlaps about half as many as there are floors.
    Layers,
    /// Unit cubes as sparse as those of [`Scenario::Teleport`] and moving as they do in up to eight storeys, and between storeys packs of plates
    /// as wide as the world, one object in 33, which all packs together are as high as all storeys; no two plates overlap. 0.07 to
    /// 0.13 pairs per object, 0.01 to 0.02 of them with more than 60 000 objects between a plate and a cube that reaches a tenth
    /// of an edge into a pack, else pairs of cubes.
    Plates,
    /// Unit cubes and, one object in ten, rods of 1 by 1 by 30 along random axes, moving as those of [`Scenario::Uniform`]. 0.06 to 0.12 pairs
    /// per object.
    Rods,
    /// Nineteen objects in twenty are the ground and never move, which [`Scene::is_fixed`] tells: boxes of 2.2 by 2.2 by 2 on a hilly lattice
    /// of pitch 1, each overlapping 24 others, 10 to 11 pairs per object. The twentieth is a unit cube that moves as those of
    /// [`Scenario::Uniform`] above and in the ground: 0.01 to 0.12 pairs per object have a member that moves.
    StaticWorld,
    /// As [`Scenario::Teleport`] without its jumps, but one object in fifty, anywhere in the list, lies 4 000 000 edges below on y and stays there.
    /// 0.06 to 0.13 pairs per object.
    Asleep,
    /// Unit cubes on one line along z, 0.75 edges apart, in no order in the list, each walking about its place by up to a tenth of an edge:
    /// each overlaps the next one above and below, and all overlap on x and y. One pair per object.
    Tower,
    /// As [`Scenario::Teleport`] without its jumps, but up to 256 objects are far apart, within five hundred world edges on each axis: the middle
    /// ones of as many equal parts of the list, a power of two, which is where an evenly spaced sample of as many looks. With 2^17 objects they
    /// have the indices 256 modulo 512. 0.06 to 0.13 pairs per object.
    Aliased,
    /// Unit cubes in a cube-shaped world of edge 2 (5 n)^(1/3), moving as those of [`Scenario::Uniform`], and in every 30th frame all at once to new
    /// random places. 0.06 to 0.13 pairs per object.
    Teleport,
}

impl Scenario {
    /// Every scenario.
    pub const ALL: [Self; 20] = [
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
        Self::Parked,
        Self::Stations,
        Self::Layers,
        Self::Plates,
        Self::Rods,
        Self::StaticWorld,
        Self::Asleep,
        Self::Tower,
        Self::Aliased,
        Self::Teleport,
    ];

    /// Those with few pairs, each with something that makes a usual shortcut quadratic.
    pub const HARD: [Self; 10] = [
        Self::Parked,
        Self::Stations,
        Self::Layers,
        Self::Plates,
        Self::Rods,
        Self::StaticWorld,
        Self::Asleep,
        Self::Tower,
        Self::Aliased,
        Self::Teleport,
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
            Self::Parked => "parked",
            Self::Stations => "stations",
            Self::Layers => "layers",
            Self::Plates => "plates",
            Self::Rods => "rods",
            Self::StaticWorld => "static-world",
            Self::Asleep => "asleep",
            Self::Tower => "tower",
            Self::Aliased => "aliased",
            Self::Teleport => "teleport",
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
            Self::Parked => "unit cubes, one in fifty of them pooled ten thousand worlds away",
            Self::Stations => "two worlds of unit cubes, a thousand of their edges apart",
            Self::Layers => "thin floors of flat boxes, none of which touches another",
            Self::Plates => "unit cubes between packs of plates as wide as the world",
            Self::Rods => "unit cubes and rods of length 30 along random axes",
            Self::StaticWorld => {
                "a hilly ground of overlapping boxes that never move, and one object in twenty that does"
            }
            Self::Asleep => "unit cubes, one in fifty of them four million edges below",
            Self::Tower => "unit cubes stacked on one line",
            Self::Aliased => "unit cubes, and far ones wherever an evenly spaced sample looks",
            Self::Teleport => "unit cubes that all jump to new places in every 30th frame",
        }
    }

    /// The scene at frame 0 with `objects` objects; for [`Scenario::Fragmentation`] that is the peak and ten stand at first.
    ///
    /// The same scenario, number of objects and seed give the same bits in every frame and on every platform. All memory
    /// that the scene will ever need is allocated here: up to 52 bytes per object.
    #[must_use]
    pub fn start(self, objects: usize, seed: u64) -> Scene {
        Scene::start(self, objects, seed)
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
