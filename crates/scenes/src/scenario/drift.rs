//! Objects that keep a velocity or are held by a point: `clustered`, `brownian`, `gravity`.

use super::rng::{Rng, cube_root, signed3};
use super::walk::{fly, reflect};
use sapwise::Aabb;

/// Half the edge of every object here.
const HALF: f32 = 0.5;

/// Unit cubes in Gaussian blobs, each walking about its place in its blob.
#[derive(Debug, Clone)]
pub(super) struct Clusters {
    /// The middles of the blobs; object `i` belongs to blob `i` modulo their number.
    homes: Vec<[f32; 3]>,
    /// The place of each object relative to the middle of its blob.
    offsets: Vec<[f32; 3]>,
    step: f32,
    /// Share of its offset by which an object is pulled back in a frame, which holds the blobs at their width.
    pull: f32,
}

impl Clusters {
    /// Blobs of about 1000 objects in the world of `uniform`; a step is up to `step` of an edge on each axis.
    pub(super) fn new(objects: usize, step: f32, rng: &mut Rng) -> Self {
        let blobs = ((objects + 500) / 1000).max(1);
        let wall = cube_root(objects as f64) as f32;
        // Three edges wide when there are 1000 objects; the width follows the number so that the density stays.
        let sigma = 3.0 * cube_root(objects.max(1) as f64 / (1000 * blobs) as f64) as f32;
        let homes = (0..blobs).map(|_| rng.signed3().map(|u| u * wall)).collect();
        let offsets = (0..objects).map(|_| rng.gauss3().map(|g| g * sigma)).collect();
        // A walk with steps of variance v, pulled back by p, settles at variance v / (2 p); a uniform step has v =
        // step^2 / 3.
        Self { homes, offsets, step, pull: step * step / (6.0 * sigma * sigma) }
    }

    /// Writes the boxes of all objects.
    pub(super) fn place(&self, boxes: &mut Vec<Aabb>) {
        boxes.clear();
        boxes.extend(self.offsets.iter().zip(self.homes.iter().cycle()).map(|(offset, home)| around(home, offset)));
    }

    /// Moves every object and rewrites its box.
    pub(super) fn advance(&mut self, rng: &mut Rng, boxes: &mut [Aabb]) {
        let homes = self.homes.iter().cycle();
        for ((offset, aabb), home) in self.offsets.iter_mut().zip(boxes).zip(homes) {
            let step = rng.signed3();
            for a in 0..3 {
                offset[a] += self.step * step[a] - self.pull * offset[a];
            }
            *aabb = around(home, offset);
        }
    }
}

#[inline]
fn around(home: &[f32; 3], offset: &[f32; 3]) -> Aabb {
    Aabb::cube([home[0] + offset[0], home[1] + offset[1], home[2] + offset[2]], HALF)
}

/// Unit cubes in the world of `uniform` that fly straight on and now and then turn.
#[derive(Debug, Clone)]
pub(super) struct Brownian {
    centres: Vec<[f32; 3]>,
    velocities: Vec<[f32; 3]>,
    wall: f32,
}

impl Brownian {
    /// Greatest speed on each axis, in edges per frame.
    const SPEED: f32 = 0.1;
    /// One object in this many draws a new velocity in a frame; a power of two.
    const CHANGE: u64 = 64;

    /// Objects at random places with random velocities.
    pub(super) fn new(objects: usize, rng: &mut Rng) -> Self {
        let wall = cube_root(objects as f64) as f32;
        let centres = (0..objects).map(|_| rng.signed3().map(|u| u * wall)).collect();
        let velocities = (0..objects).map(|_| rng.signed3().map(|u| u * Self::SPEED)).collect();
        Self { centres, velocities, wall }
    }

    /// Writes the boxes of all objects.
    pub(super) fn place(&self, boxes: &mut Vec<Aabb>) {
        cubes(&self.centres, boxes);
    }

    /// Moves every object and rewrites its box.
    pub(super) fn advance(&mut self, rng: &mut Rng, boxes: &mut [Aabb]) {
        let objects = self.centres.iter_mut().zip(&mut self.velocities).zip(boxes);
        // Ten draws of six bits decide for ten objects, so that most objects need no draw of their own.
        let (mut bits, mut left) = (0, 0);
        for ((centre, velocity), aabb) in objects {
            if left == 0 {
                (bits, left) = (rng.bits(), 10);
            }
            if bits % Self::CHANGE == 0 {
                *velocity = signed3(rng.bits()).map(|u| u * Self::SPEED);
            }
            (bits, left) = (bits / Self::CHANGE, left - 1);
            fly(centre, velocity, self.wall);
            *aabb = Aabb::cube(*centre, HALF);
        }
    }
}

/// Unit cubes that swirl about a point which moves.
///
/// Each is drawn to the point by a force that grows with the distance, slowed a little, and pushed at random by as
/// much as that takes away (a Langevin equation), so that the swarm neither collapses nor scatters.
#[derive(Debug, Clone)]
pub(super) struct Gravity {
    centres: Vec<[f32; 3]>,
    velocities: Vec<[f32; 3]>,
    point: [f32; 3],
    point_velocity: [f32; 3],
    /// Greatest distance of the point from the origin on each axis.
    wall: f32,
    /// Acceleration per distance, per frame squared.
    pull: f32,
    /// Share of its velocity that an object keeps in a frame.
    keep: f32,
    /// Greatest random push on each axis, in edges per frame.
    push: f32,
}

impl Gravity {
    /// Standard deviation of the objects' velocity on each axis, in edges per frame.
    const SPEED: f32 = 0.2;
    /// Greatest speed of the point on each axis, in edges per frame.
    const POINT_SPEED: f32 = 0.1;

    /// A swarm in balance about the origin.
    pub(super) fn new(objects: usize, rng: &mut Rng) -> Self {
        // Gaussian positions of deviation s give 0.09 n / s^3 pairs per object; this width makes it six.
        let sigma = 0.246 * cube_root(objects.max(1) as f64) as f32;
        let turn = Self::SPEED / sigma;
        let keep = 1.0 - turn / 5.0;
        Self {
            centres: (0..objects).map(|_| rng.gauss3().map(|g| g * sigma)).collect(),
            velocities: (0..objects).map(|_| rng.gauss3().map(|g| g * Self::SPEED)).collect(),
            point: [0.0; 3],
            point_velocity: rng.signed3().map(|u| u * Self::POINT_SPEED),
            wall: 3.0 * sigma,
            pull: turn * turn,
            keep,
            // A uniform push of up to p has variance p^2 / 3; keeping k of the velocity loses 1 - k^2 of its
            // variance.
            push: Self::SPEED * (3.0 * (1.0 - keep * keep)).sqrt(),
        }
    }

    /// Writes the boxes of all objects.
    pub(super) fn place(&self, boxes: &mut Vec<Aabb>) {
        cubes(&self.centres, boxes);
    }

    /// Moves the point, which sets off in a new direction every 64 frames, then every object, and rewrites its box.
    pub(super) fn advance(&mut self, frame: u64, rng: &mut Rng, boxes: &mut [Aabb]) {
        if frame.is_multiple_of(64) {
            self.point_velocity = rng.signed3().map(|u| u * Self::POINT_SPEED);
        }
        for a in 0..3 {
            self.point[a] = reflect(self.point[a] + self.point_velocity[a], self.wall);
        }
        for ((centre, velocity), aabb) in self.centres.iter_mut().zip(&mut self.velocities).zip(boxes) {
            let push = rng.signed3();
            for a in 0..3 {
                velocity[a] = self.keep * velocity[a] - self.pull * (centre[a] - self.point[a]) + self.push * push[a];
                centre[a] += velocity[a];
            }
            *aabb = Aabb::cube(*centre, HALF);
        }
    }
}

fn cubes(centres: &[[f32; 3]], boxes: &mut Vec<Aabb>) {
    boxes.clear();
    boxes.extend(centres.iter().map(|&centre| Aabb::cube(centre, HALF)));
}
