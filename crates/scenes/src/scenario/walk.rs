//! Objects that take a random step each frame: `uniform`, `fast`, `slab`, `mixed`, `resting`, `churn`.

use super::rng::{Powers, Rng, cube_root};
use sapwise::Aabb;

/// Frames for which the same objects of `resting` stay awake.
const AWAKE_FRAMES: u64 = 30;

/// Cubes that step by up to a share of their own edge on each axis, between walls that reflect their centres.
#[derive(Debug, Clone)]
pub(super) struct Walk {
    centres: Vec<[f32; 3]>,
    halves: Vec<f32>,
    /// Greatest distance of a centre from the origin on each axis.
    walls: [f32; 3],
    /// Greatest step on each axis, in half edges.
    step: f32,
    /// Objects at the head of the list that never move.
    fixed: usize,
    /// In a frame, one object in this many moves.
    sparsity: usize,
    /// Number of objects that are replaced in a frame, all of one size.
    replaced: usize,
}

impl Walk {
    /// Unit cubes in a cube-shaped world of edge 2 n^(1/3), which step by up to `step` of their edge.
    pub(super) fn uniform(objects: usize, step: f32, sparsity: usize, rng: &mut Rng) -> Self {
        let wall = cube_root(objects as f64) as f32;
        Self::unit_cubes(objects, [wall; 3], step, sparsity, rng)
    }

    /// [`Walk::uniform`], with one object in 100 replaced in each frame.
    pub(super) fn churn(objects: usize, step: f32, rng: &mut Rng) -> Self {
        Self { replaced: objects.div_ceil(100), ..Self::uniform(objects, step, 1, rng) }
    }

    /// Unit cubes with the density of [`Walk::uniform`], one in eight units of volume, in a world eight edges high.
    pub(super) fn slab(objects: usize, step: f32, rng: &mut Rng) -> Self {
        let wall = ((objects as f64).sqrt() * 0.5) as f32;
        Self::unit_cubes(objects, [wall, wall, 4.0], step, 1, rng)
    }

    /// Cubes with edges log-uniform from 0.1 to 10, and at the head of the list up to four fixed ones as large as the
    /// world.
    pub(super) fn mixed(objects: usize, step: f32, rng: &mut Rng) -> Self {
        // Two such cubes overlap in a volume of 285 on average; 1.5 pairs per object need a world of 95 per object.
        let wall = (cube_root(95.0 * objects as f64) * 0.5) as f32;
        let fixed = (objects / 100).min(4);
        let edges = Powers::new(100.0);
        let mut walk = Self::with_halves(objects, [wall; 3], step, rng, |rng| (edges.of(rng.unit()) * 0.05) as f32);
        for (centre, half) in walk.centres.iter_mut().zip(&mut walk.halves).take(fixed) {
            // Off the middle by a tenth, so that no two share their bounds.
            *centre = centre.map(|c| c * 0.1);
            *half = wall;
        }
        walk.fixed = fixed;
        walk
    }

    fn unit_cubes(objects: usize, walls: [f32; 3], step: f32, sparsity: usize, rng: &mut Rng) -> Self {
        Self { sparsity, ..Self::with_halves(objects, walls, step, rng, |_| 0.5) }
    }

    fn with_halves(objects: usize, walls: [f32; 3], step: f32, rng: &mut Rng, half: impl Fn(&mut Rng) -> f32) -> Self {
        let mut walk = Self {
            centres: Vec::with_capacity(objects),
            halves: Vec::with_capacity(objects),
            walls,
            step: step * 2.0,
            fixed: 0,
            sparsity: 1,
            replaced: 0,
        };
        for _ in 0..objects {
            let centre = rng.within(walls);
            walk.centres.push(centre);
            walk.halves.push(half(rng));
        }
        walk
    }

    /// Writes the boxes of all objects.
    pub(super) fn place(&self, boxes: &mut Vec<Aabb>) {
        boxes.clear();
        boxes.extend(self.centres.iter().zip(&self.halves).map(|(&centre, &half)| Aabb::cube(centre, half)));
    }

    /// Whether the object with this index never moves.
    pub(super) fn is_fixed(&self, index: usize) -> bool {
        index < self.fixed
    }

    /// Steps into `frame` and rewrites the boxes of the objects that moved.
    pub(super) fn advance(&mut self, frame: u64, rng: &mut Rng, boxes: &mut [Aabb]) {
        for _ in 0..self.replaced {
            let leaves = rng.below(self.centres.len());
            self.centres.swap_remove(leaves);
        }
        for _ in 0..self.replaced {
            let centre = rng.within(self.walls);
            self.centres.push(centre);
        }
        let phase = (frame / AWAKE_FRAMES % self.sparsity as u64) as usize;
        let objects = self.centres.iter_mut().zip(&self.halves).zip(boxes);
        for ((centre, &half), aabb) in objects.skip(self.fixed.max(phase)).step_by(self.sparsity) {
            let step = rng.signed3();
            for a in 0..3 {
                centre[a] = reflect(centre[a] + step[a] * (self.step * half), self.walls[a]);
            }
            *aabb = Aabb::cube(*centre, half);
        }
    }
}

/// Moves a centre by its velocity, which turns around on each axis at a wall.
#[inline]
pub(super) fn fly(centre: &mut [f32; 3], velocity: &mut [f32; 3], wall: f32) {
    for a in 0..3 {
        let ahead = centre[a] + velocity[a];
        if ahead.abs() > wall {
            velocity[a] = -velocity[a];
        }
        centre[a] = reflect(ahead, wall);
    }
}

/// Reflects a coordinate at the walls at -`wall` and `wall`. One that is beyond by more than the world ends at a
/// wall.
#[inline]
pub(super) fn reflect(at: f32, wall: f32) -> f32 {
    if at > wall {
        (2.0 * wall - at).max(-wall)
    } else if at < -wall {
        (-2.0 * wall - at).min(wall)
    } else {
        at
    }
}
