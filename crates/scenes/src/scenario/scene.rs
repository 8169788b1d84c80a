//! A scene in one of its frames.

use super::Scenario;
use super::drift::{Brownian, Clusters, Gravity};
use super::fall::Fall;
use super::fragmentation::Fragmentation;
use super::rng::Rng;
use super::roam::Roam;
use super::walk::Walk;
use sapwise::Aabb;

/// Greatest step on each axis in a frame, in edges, of slow objects.
const STEP: f32 = 0.05;

/// A scene in one of its frames.
///
/// ```
/// use sapwise_scenes::Scenario;
///
/// let mut scene = Scenario::Gravity.start(500, 1);
/// let before = scene.boxes().to_vec();
/// scene.advance();
/// assert_ne!(scene.boxes(), before);
/// ```
#[derive(Debug, Clone)]
pub struct Scene {
    scenario: Scenario,
    objects: usize,
    frame: u64,
    boxes: Vec<Aabb>,
    rng: Rng,
    motion: Motion,
}

/// The motion of the objects with its state.
#[derive(Debug, Clone)]
enum Motion {
    Walk(Walk),
    Clusters(Clusters),
    Brownian(Brownian),
    Gravity(Gravity),
    Fall(Fall),
    Fragmentation(Box<Fragmentation>),
    Roam(Roam),
}

impl Scene {
    /// The scene at frame 0.
    pub(super) fn start(scenario: Scenario, objects: usize, seed: u64) -> Self {
        let mut rng = Rng::new(seed);
        let mut boxes = Vec::with_capacity(objects);
        let mut motion = match scenario {
            Scenario::Uniform => Motion::Walk(Walk::uniform(objects, STEP, 1, &mut rng)),
            Scenario::Fast => Motion::Walk(Walk::uniform(objects, 2.0, 1, &mut rng)),
            Scenario::Clustered => Motion::Clusters(Clusters::new(objects, STEP, &mut rng)),
            Scenario::Slab => Motion::Walk(Walk::slab(objects, STEP, &mut rng)),
            Scenario::Mixed => Motion::Walk(Walk::mixed(objects, STEP, &mut rng)),
            Scenario::Resting => Motion::Walk(Walk::uniform(objects, STEP, 20, &mut rng)),
            Scenario::Brownian => Motion::Brownian(Brownian::new(objects, &mut rng)),
            Scenario::FreeFall => Motion::Fall(Fall::new(objects)),
            Scenario::Gravity => Motion::Gravity(Gravity::new(objects, &mut rng)),
            Scenario::Fragmentation => Motion::Fragmentation(Box::new(Fragmentation::new(objects))),
            Scenario::Parked => Motion::Roam(Roam::parked(objects, &mut rng)),
            Scenario::Stations => Motion::Roam(Roam::stations(objects, &mut rng)),
            Scenario::Layers => Motion::Roam(Roam::layers(objects, &mut rng)),
            Scenario::Plates => Motion::Roam(Roam::plates(objects, &mut rng)),
            Scenario::Rods => Motion::Roam(Roam::rods(objects, &mut rng)),
            Scenario::StaticWorld => Motion::Roam(Roam::static_world(objects, &mut rng)),
            Scenario::Asleep => Motion::Roam(Roam::asleep(objects, &mut rng)),
            Scenario::Tower => Motion::Roam(Roam::tower(objects, &mut rng)),
            Scenario::Aliased => Motion::Roam(Roam::aliased(objects, &mut rng)),
            Scenario::Teleport => Motion::Roam(Roam::teleport(objects, &mut rng)),
            Scenario::Churn => Motion::Walk(Walk::churn(objects, STEP, &mut rng)),
            Scenario::Sheets => Motion::Roam(Roam::sheets(objects, &mut rng)),
            Scenario::LongRods => Motion::Roam(Roam::long_rods(objects, &mut rng)),
            Scenario::Beams => Motion::Roam(Roam::beams(objects, &mut rng)),
            Scenario::City => Motion::Roam(Roam::city(objects, &mut rng)),
        };
        match &mut motion {
            Motion::Walk(m) => m.place(&mut boxes),
            Motion::Clusters(m) => m.place(&mut boxes),
            Motion::Brownian(m) => m.place(&mut boxes),
            Motion::Gravity(m) => m.place(&mut boxes),
            Motion::Fall(m) => m.drop(&mut rng, &mut boxes),
            Motion::Fragmentation(m) => m.advance(0, &mut rng, &mut boxes),
            Motion::Roam(m) => m.place(&mut boxes),
        }
        Self { scenario, objects, frame: 0, boxes, rng, motion }
    }

    /// Returns the boxes of this frame in the order of the objects. All are valid and finite.
    pub fn boxes(&self) -> &[Aabb] {
        &self.boxes
    }

    /// Goes on to the next frame. Allocates nothing.
    ///
    /// An object keeps its index from frame to frame, except in [`Scenario::Fragmentation`], where objects come and
    /// go at the end of the list, and in [`Scenario::Churn`].
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
            Motion::Roam(m) => m.advance(self.frame, rng, boxes),
        }
    }

    /// Returns the number of the frame, 0 at the start.
    pub fn frame(&self) -> u64 {
        self.frame
    }

    /// Returns the kind of scene.
    pub fn scenario(&self) -> Scenario {
        self.scenario
    }

    /// Returns the largest number of boxes in any frame.
    pub fn peak_objects(&self) -> usize {
        self.objects
    }

    /// Whether the object with this index never moves, like the ground of [`Scenario::StaticWorld`]. `false` beyond
    /// the end of the list.
    pub fn is_fixed(&self, index: usize) -> bool {
        match &self.motion {
            Motion::Walk(m) => m.is_fixed(index),
            Motion::Roam(m) => m.is_fixed(index),
            _ => false,
        }
    }
}
