//! Cubes that shatter and are cleared away, so that their number runs from ten to the peak and back: `fragmentation`.
//!
//! After Figure 1 of Avril, Gouranton and Arnaldi, "Dynamic Adaptation of Broad Phase Collision Detection
//! Algorithms", ISVRI 2011: few cubes, which a user splits or deletes at will, so that the number of objects runs
//! from few to thousands.

use super::Scenario;
use super::rng::{Powers, Rng, cube_root};
use super::walk::{fly, reflect};
use sapwise::Aabb;

/// Cubes at the beginning of a cycle, or the peak if that is lower.
const START: usize = 10;

/// The number of objects through a cycle: a frame, and the logarithm of the number as a share of the way from start
/// to peak.
///
/// Between two entries the share is a straight line. Entries in consecutive frames are bursts and mass deletions.
const COURSE: [(u64, f32); 27] = [
    (0, 0.0),
    (20, 0.0),
    (80, 0.35),
    (110, 0.35),
    (111, 0.6),
    (140, 0.6),
    (160, 0.0),
    (180, 0.0),
    (181, 0.45),
    (210, 0.45),
    (240, 0.8),
    (260, 0.8),
    (261, 1.0),
    (290, 1.0),
    (291, 0.5),
    (320, 0.5),
    (321, 1.0),
    (350, 1.0),
    (400, 0.65),
    (401, 0.9),
    (420, 0.9),
    (450, 0.4),
    (471, 0.75),
    (500, 0.75),
    (501, 0.25),
    (570, 0.0),
    (Scenario::FRAGMENTATION_FRAMES, 0.0),
];

/// Volume of the world over the sum of the cubes' volumes. Pieces at random places have 4 / 2.5 pairs each, less at
/// the walls.
const VOLUME: f64 = 2.5;
/// Gap between the pieces of one cube as they fly apart, as a share of their edge.
const GAP: f32 = 0.1;
/// Greatest displacement of a piece from its octant on each axis, in half edges of the piece.
const JITTER: f32 = 0.2;
/// Speed of a piece away from the middle of its cube on each axis, in half edges per frame; up to twice this.
const SPEED: f32 = 0.1;
/// Share of the velocity of a cube that its pieces keep.
const INHERITED: f32 = 0.5;

#[derive(Debug, Clone, Copy)]
struct Cube {
    centre: [f32; 3],
    half: f32,
    velocity: [f32; 3],
}

/// Cubes of any size whose volumes add up to about the same, however many there are.
#[derive(Debug, Clone)]
pub(super) struct Fragmentation {
    cubes: Vec<Cube>,
    wall: f32,
    start: usize,
    peak: usize,
    /// Powers of peak over start.
    growth: Powers,
    /// The cube that is split or grown next. It goes round, so that sizes stay alike.
    cursor: usize,
    /// One over the cube root of 0 to 8 pieces, which is their edge over that of their cube.
    edges: [f32; 9],
}

impl Fragmentation {
    /// A world for `peak` cubes of edge 1, and no cubes yet.
    pub(super) fn new(peak: usize) -> Self {
        let start = START.min(peak);
        Self {
            cubes: Vec::with_capacity(peak),
            wall: (cube_root(VOLUME * peak as f64) * 0.5) as f32,
            start,
            peak,
            growth: Powers::new(peak.max(1) as f64 / start.max(1) as f64),
            cursor: 0,
            edges: [1_u32, 1, 2, 3, 4, 5, 6, 7, 8].map(|pieces| (1.0 / cube_root(f64::from(pieces))) as f32),
        }
    }

    /// Moves all cubes, or begins a cycle; splits or merges cubes until their number is the target of `frame`; writes
    /// the boxes.
    pub(super) fn advance(&mut self, frame: u64, rng: &mut Rng, boxes: &mut Vec<Aabb>) {
        let frame = frame % Scenario::FRAGMENTATION_FRAMES;
        if frame == 0 {
            self.begin(rng);
        }
        self.cubes.iter_mut().for_each(|cube| fly(&mut cube.centre, &mut cube.velocity, self.wall));
        let target = self.target(frame);
        while self.cubes.len() < target {
            self.split((target - self.cubes.len() + 1).min(8), rng);
        }
        while self.cubes.len() > target {
            self.merge((self.cubes.len() - target).min(7));
        }
        boxes.clear();
        boxes.extend(self.cubes.iter().map(|cube| Aabb::cube(cube.centre, cube.half)));
    }

    /// Returns the number of cubes in a frame of the cycle.
    fn target(&self, frame: u64) -> usize {
        let at = COURSE.partition_point(|&(f, _)| f <= frame).clamp(1, COURSE.len() - 1);
        let ((f0, u0), (f1, u1)) = (COURSE[at - 1], COURSE[at]);
        let share = u0 + (u1 - u0) * ((frame - f0) as f32 / (f1 - f0) as f32);
        let target = (self.start as f64 * self.growth.of(share) + 0.5) as usize;
        target.clamp(self.start, self.peak)
    }

    /// Places the first cubes. Each cycle does so anew, so that rounding in volumes and velocities never adds up.
    fn begin(&mut self, rng: &mut Rng) {
        self.cubes.clear();
        self.cursor = 0;
        let half = (0.5 * cube_root(self.peak as f64 / self.start.max(1) as f64)) as f32;
        for _ in 0..self.start {
            let centre = rng.signed3().map(|u| u * self.wall);
            let half = half * (0.8 + 0.4 * rng.unit());
            self.cubes.push(Cube { centre, half, velocity: rng.signed3().map(|u| u * half * SPEED) });
        }
    }

    /// Shatters the next cube into `pieces`, 2 to 8, that have its volume and fly apart along its diagonals.
    fn split(&mut self, pieces: usize, rng: &mut Rng) {
        let at = self.next(self.cubes.len());
        let parent = self.cubes[at];
        let half = parent.half * self.edges[pieces];
        for k in 0..pieces {
            let mut piece = Cube { half, ..parent };
            for (a, jitter) in rng.signed3().into_iter().enumerate() {
                let side = if k >> a & 1 == 1 { 1.0 } else { -1.0 };
                let away = parent.centre[a] + side * parent.half * 0.5 * (1.0 + GAP) + jitter * half * JITTER;
                piece.centre[a] = reflect(away, self.wall);
                piece.velocity[a] = INHERITED * parent.velocity[a] + side * half * SPEED * (1.5 + 0.5 * jitter);
            }
            if k == 0 { self.cubes[at] = piece } else { self.cubes.push(piece) }
        }
    }

    /// Deletes the last `pieces` cubes, 1 to 7, and grows the next one by their volume.
    fn merge(&mut self, pieces: usize) {
        let left = self.cubes.len() - pieces;
        let at = self.next(left);
        let volume = |Cube { half, .. }: Cube| f64::from(half) * f64::from(half) * f64::from(half);
        let removed: f64 = self.cubes.drain(left..).map(volume).sum();
        self.cubes[at].half = cube_root(removed + volume(self.cubes[at])) as f32;
    }

    /// Returns the index at the cursor, which goes round the first `objects`, and advances the cursor.
    fn next(&mut self, objects: usize) -> usize {
        let at = if self.cursor < objects { self.cursor } else { 0 };
        self.cursor = at + 1;
        at
    }
}
