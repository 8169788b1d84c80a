//! Seeded scenes that evolve frame by frame.

mod drift;
mod fall;
mod fragmentation;
mod rng;
mod roam;
mod scene;
mod walk;

use sapwise::named;

pub use scene::Scene;

named! {
    /// A kind of scene.
    ///
    /// Lengths are in edges of a unit cube. *Pairs per object* are overlapping pairs over objects; each range covers
    /// every frame with 1000, 2000 and 60 000 objects and several seeds.
    ///
    /// The scenes from [`Scenario::Parked`] on have few pairs and are hard all the same: each makes a common shortcut
    /// quadratic. Those from [`Scenario::Churn`] on are for tests and benchmarks; the usual plan of a probe has none.
    ///
    /// ```
    /// use sapwise_scenes::Scenario;
    ///
    /// let scenario: Scenario = "free-fall".parse()?;
    /// assert_eq!(scenario.start(1000, 1).boxes().len(), 1000);
    /// # Ok::<(), sapwise::error::UnknownName>(())
    /// ```
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
    #[non_exhaustive]
    pub enum Scenario(
        "scenario; use one of uniform, fast, clustered, slab, mixed, resting, brownian, free-fall, gravity, \
         fragmentation, parked, stations, layers, plates, rods, static-world, asleep, tower, aliased, teleport, \
         churn, sheets, long-rods, beams, city"
    ) {
        /// Unit cubes spread evenly over a cube-shaped world of edge 2 n^(1/3). Each moves by up to 5 % of its edge
        /// per axis and frame. 0.4 to 0.55 pairs per object: each object touches one other.
        Uniform = "uniform",
        /// [`Scenario::Uniform`] with steps of up to two edges per axis and frame, so that no frame helps with the
        /// next. 0.4 to 0.55 pairs per object.
        Fast = "fast",
        /// Gaussian blobs of about 1000 unit cubes with deviation 3 in the world of [`Scenario::Uniform`]. Each cube
        /// moves as there and is held to its blob. 2.9 to 4.2 pairs per object. Fewer than 500 objects make one
        /// narrower blob of the same density.
        Clustered = "clustered",
        /// [`Scenario::Uniform`] at the same density in a flat world, eight edges high on z. 0.4 to 0.55 pairs per
        /// object.
        Slab = "slab",
        /// Cubes with edges log-uniform from 0.1 to 10, each moving by up to 5 % of its own edge. For every 100
        /// objects, up to four times, the head of the list holds a fixed cube as large as the world. 0.8 to 1.3 pairs
        /// per object, and one more for each of those.
        Mixed = "mixed",
        /// [`Scenario::Uniform`] with every twentieth object moving: for 30 frames those with index 0 modulo 20, for
        /// the next 30 frames those with index 1, and so on. 0.4 to 0.55 pairs per object.
        Resting = "resting",
        /// After Broadmark's scene of that name: unit cubes in the world of [`Scenario::Uniform`] fly straight on at
        /// up to 0.1 edges per axis and frame. One in 64 takes a new direction in each frame. 0.38 to 0.55 pairs per
        /// object.
        Brownian = "brownian",
        /// After Broadmark's scene of that name: unit cubes fall at 9.81 m/s² (edge 1 m, 60 frames a second) onto
        /// columns of up to 16 cubes. They come to rest by frame 140 and are dropped again in frame 240. 0.05 to 0.15
        /// pairs per object in the air, 1.1 to 1.3 at rest. No contact is solved: each object has its own place of
        /// rest.
        FreeFall = "free-fall",
        /// After Broadmark's scene of that name: a swarm of unit cubes swirls about a point that moves. 5 to 7 pairs
        /// per object, and nearly three times that in the middle.
        Gravity = "gravity",
        /// After Figure 1 of Avril, Gouranton and Arnaldi (ISVRI 2011): ten cubes shatter in bursts and are cleared
        /// away. Over [`Scenario::FRAGMENTATION_FRAMES`] their number runs from ten to the peak and back, with
        /// plateaus and jumps, and crosses most of its range several times in both directions; then it repeats. 0.15
        /// to 2.6 pairs per object while there are 100 or more, 0.6 to 1.1 on average. The volumes of the cubes always
        /// add up to about the same.
        Fragmentation = "fragmentation",
        /// The world of [`Scenario::Teleport`] without its jumps. One object in fifty, anywhere in the list, is pooled
        /// ten thousand world edges away on each axis, as games pool unused objects: still, on a lattice. 0.06 to 0.13
        /// pairs per object.
        Parked = "parked",
        /// Two worlds of half of the objects each, a thousand of their edges apart along a diagonal, each as dense as
        /// that of [`Scenario::Teleport`] and moving like it. The list mixes both at random. 0.07 to 0.12 pairs per
        /// object.
        Stations = "stations",
        /// About n^(1/2) floors of about n^(1/4) by n^(1/4) flat boxes of 1 by 1 by 0.1, a quarter of an edge apart.
        /// Each box walks in its own field by up to 0.005 edges per axis and frame. No pairs; on x and y together each
        /// box overlaps half as many boxes as there are floors.
        Layers = "layers",
        /// Unit cubes as sparse as those of [`Scenario::Teleport`], moving like them in up to eight storeys. Between
        /// storeys lie packs of plates as wide as the world, one object in 33; all packs together are as high as all
        /// storeys, and no two plates overlap. 0.07 to 0.13 pairs per object. Above 60 000 objects 0.01 to 0.02 of
        /// them are between a plate and a cube that reaches a tenth of an edge into a pack.
        Plates = "plates",
        /// Unit cubes and, one object in ten, rods of 1 by 1 by 30 along random axes, moving like
        /// [`Scenario::Uniform`]. 0.06 to 0.12 pairs per object.
        Rods = "rods",
        /// Nineteen objects in twenty are the ground and never move ([`Scene::is_fixed`]): boxes of 2.2 by 2.2 by 2 on
        /// a hilly lattice of pitch 1. Each overlaps 24 others, 10 to 11 pairs per object. The twentieth is a unit
        /// cube that moves like [`Scenario::Uniform`] above and in the ground: 0.01 to 0.12 pairs per object have a
        /// moving member.
        StaticWorld = "static-world",
        /// The world of [`Scenario::Teleport`] without its jumps. One object in fifty, anywhere in the list, lies 4
        /// 000 000 edges below on y and stays there. 0.06 to 0.13 pairs per object.
        Asleep = "asleep",
        /// Unit cubes on one line along z, 0.75 edges apart and in random order in the list. Each walks about its
        /// place by up to a tenth of an edge and overlaps the cubes above and below; on x and y all overlap. One pair
        /// per object.
        Tower = "tower",
        /// The world of [`Scenario::Teleport`] without its jumps. Up to 256 objects are far apart, within five hundred
        /// world edges on each axis: the middle ones of as many equal parts of the list, a power of two, where an
        /// evenly spaced sample looks. With 2^17 objects they have the indices 256 modulo 512. 0.06 to 0.13 pairs per
        /// object.
        Aliased = "aliased",
        /// Unit cubes in a cube-shaped world of edge 2 (5 n)^(1/3), moving like [`Scenario::Uniform`]. In every 30th
        /// frame all jump to new random places. 0.06 to 0.13 pairs per object.
        Teleport = "teleport",
        /// [`Scenario::Uniform`], and in each frame one object in 100, at least one, leaves and another comes
        /// elsewhere. The last object of the list takes the place of the one that leaves, and new ones are appended,
        /// as in the dense array of an engine. 0.4 to 0.55 pairs per object.
        Churn = "churn",
        /// Sheets as wide as the world, a cube of edge 2 n^(1/3), at random heights. Every other one has no thickness,
        /// the rest a fifth of the mean gap. Each moves along z by up to a quarter of the mean gap a frame. 0.07 to
        /// 0.14 pairs per object.
        Sheets = "sheets",
        /// Rods as long as the world, a cube of edge 2 n^(1/3), each along a random axis. They are 2.25 n^(-2/3)
        /// thick, so that pairs per object do not grow with n, and move sideways by up to a quarter of their thickness
        /// per axis and frame. 0.65 to 0.85 pairs per object.
        LongRods = "long-rods",
        /// Unit cubes and, one object in ten, the bounds of a beam in a random direction: lengths log-uniform from 1
        /// to 100, a fifth of an edge thick. All move like [`Scenario::Uniform`]. 0.1 to 0.4 pairs per object.
        Beams = "beams",
        /// A city of fixed buildings ([`Scene::is_fixed`]) on a lattice of pitch 2: 1.2 to 2.6 edges wide, 1 to 20
        /// high. Up to 2000 unit cubes, at most one object in 20, move like [`Scenario::Uniform`] between and in them.
        /// 0.75 to 1.15 pairs per object. At most 0.08 have a moving member, fewer above 40 000 objects.
        City = "city",
    }
}

impl Scenario {
    /// The hard scenarios of a probe: few pairs, and something that makes a common shortcut quadratic.
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

    /// Starts the scene at frame 0 with `objects` objects. For [`Scenario::Fragmentation`] that is the peak, and ten
    /// stand at first.
    ///
    /// The same scenario, number of objects and seed give the same bits in every frame on every platform. The scene
    /// allocates all its memory here: up to 52 bytes per object.
    pub fn start(self, objects: usize, seed: u64) -> Scene {
        Scene::start(self, objects, seed)
    }
}
