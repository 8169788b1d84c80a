//! The simulation: cubes that fall, collide, break into eight and are cleared away.

use rapier3d::prelude::*;
use sapwise_scenes::Random;
use std::collections::{HashSet, VecDeque};

/// Steps in which the number of bodies runs from few to many and back.
const CYCLE: u64 = 300;

/// Step of a cycle from which on the oldest bodies are cleared away.
const CLEARED_FROM: u64 = 230;

/// Whole cubes that are dropped in a cycle.
const WHOLE: usize = 10;

/// Half edge of a whole cube in metres.
const HALF: f32 = 1.0;

/// Half edge of the pit into which they fall.
const PIT: f32 = 6.0;

/// Height of its walls.
const WALL: f32 = 40.0;

/// A contact that changes the velocity of a body by this much in one step, in metres per second, breaks it.
const HARD: f32 = 3.0;

/// Steps from one burst to the next, in each of which one body in four breaks without being hit.
const BURST: u64 = 45;

/// Half edge of a piece over that of its octant: pieces that fill all of it would start in contact with each other.
const SHRUNK: f32 = 0.96;

/// Speed at which pieces fly apart, in metres per second.
const APART: f32 = 1.5;

/// Share of the smallest pieces that are debris: they collide with everything but each other, as games have it.
const DEBRIS: f32 = 0.5;

/// Settings of a simulation. The same settings give the same boxes in every step, on one machine and build.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// The most bodies at once, those that never move left out.
    pub bodies: usize,
    /// Seed of all places, velocities and bursts.
    pub seed: u64,
}

/// The simulation between two steps.
pub struct World {
    physics: PhysicsWorld,
    settings: Settings,
    random: Random,
    /// The bodies that move, oldest first.
    cubes: VecDeque<Cube>,
    /// How often a whole cube breaks into its smallest pieces.
    generations: u32,
    step: u64,
}

#[derive(Clone, Copy)]
struct Cube {
    body: RigidBodyHandle,
    half: f32,
    /// 0: whole.
    generation: u32,
}

impl World {
    /// An empty pit; the first step drops cubes into it.
    pub fn new(settings: Settings) -> Self {
        let mut physics = PhysicsWorld::new();
        let slab = |x: f32, y: f32, z: f32| ColliderBuilder::cuboid(x, y, z).restitution(0.2);
        let mut fixed =
            |at: Vector, slab: ColliderBuilder| physics.insert(RigidBodyBuilder::fixed().translation(at), slab);
        fixed(Vector::new(0.0, -0.5, 0.0), slab(PIT + 1.0, 0.5, PIT + 1.0));
        for side in [-1.0, 1.0] {
            let away = side * (PIT + 0.5);
            fixed(Vector::new(away, WALL / 2.0, 0.0), slab(0.5, WALL / 2.0, PIT + 1.0));
            fixed(Vector::new(0.0, WALL / 2.0, away), slab(PIT + 1.0, WALL / 2.0, 0.5));
        }
        // As few generations as give all the bodies that there may be.
        let most = |generations: &u32| WHOLE << (3 * generations) >= settings.bodies;
        let generations = (1..8).find(most).unwrap_or(8);
        Self { physics, settings, random: Random::new(settings.seed), cubes: VecDeque::new(), generations, step: 0 }
    }

    /// Returns the state of rapier.
    pub fn physics(&self) -> &PhysicsWorld {
        &self.physics
    }

    /// Returns the number of bodies that move.
    pub fn bodies(&self) -> usize {
        self.cubes.len()
    }

    /// Does what the program does between two steps: drops whole cubes, breaks those that were hit hard or whose turn
    /// it is, and removes the oldest.
    pub fn prepare_step(&mut self) {
        let at = self.step % CYCLE;
        let burst = at % BURST == BURST - 1;
        if at >= CLEARED_FROM {
            let cleared = (self.cubes.len() / 12).max(1);
            self.clear_to(self.cubes.len() - cleared.min(self.cubes.len()));
        } else {
            let hard = self.hit_hard();
            let mut broken = Vec::new();
            let mut room = (self.settings.bodies - self.cubes.len()) / 7;
            self.cubes.retain(|cube| {
                let due = hard.contains(&cube.body) || burst && within(&mut self.random, 0.0, 1.0) < 0.25;
                let breaks = due && room > 0 && cube.generation < self.generations;
                room -= usize::from(breaks);
                if breaks {
                    broken.push(*cube);
                }
                !breaks
            });
            for cube in broken {
                self.shatter(cube);
            }
        }
        if at == 0 {
            self.drop_whole();
        }
    }

    /// Makes one step of rapier, of a sixtieth of a second.
    pub fn step(&mut self) {
        self.physics.step();
        self.step += 1;
    }

    /// Returns the bodies whose velocity a contact of the last step changed by more than [`HARD`].
    fn hit_hard(&self) -> HashSet<RigidBodyHandle> {
        let mut hard = HashSet::new();
        for pair in self.physics.narrow_phase.contact_pairs() {
            let impulse = pair.total_impulse_magnitude();
            for collider in [pair.collider1, pair.collider2] {
                let Some(body) = self.physics.colliders.get(collider).and_then(Collider::parent) else { continue };
                if self.physics.bodies.get(body).is_some_and(|b| b.is_dynamic() && impulse > HARD * b.mass()) {
                    hard.insert(body);
                }
            }
        }
        hard
    }

    /// Drops whole cubes into the pit, each a body of eight colliders: its octants, which touch each other.
    fn drop_whole(&mut self) {
        let count = WHOLE.min(self.settings.bodies);
        self.clear_to(self.settings.bodies - count);
        for k in 0..count {
            let side = PIT - 2.0 * HALF;
            let x = within(&mut self.random, -side, side);
            let z = within(&mut self.random, -side, side);
            let turn = [(); 3].map(|()| within(&mut self.random, -1.0, 1.0));
            let body = RigidBodyBuilder::dynamic()
                .translation(Vector::new(x, 4.0 + 3.5 * HALF * k as f32, z))
                .rotation(Vector::from(turn))
                .angvel(Vector::from(turn));
            let body = self.physics.insert_body(body);
            for octant in octants() {
                let half = HALF / 2.0;
                let collider = ColliderBuilder::cuboid(half, half, half).translation(octant * half).restitution(0.2);
                self.physics.insert_collider(collider, Some(body));
            }
            self.cubes.push_back(Cube { body, half: HALF, generation: 0 });
        }
    }

    /// Replaces a cube by eight pieces. It is no longer among `cubes`.
    fn shatter(&mut self, cube: Cube) {
        let Some(whole) = self.physics.remove_body(cube.body) else { return };
        let half = cube.half / 2.0;
        for octant in octants() {
            let arm = *whole.rotation() * (octant * half);
            let velocity = whole.linvel()
                + whole.angvel().cross(arm)
                + arm.normalize() * (APART * within(&mut self.random, 0.5, 1.5));
            let body = RigidBodyBuilder::dynamic()
                .pose(Pose::from_parts(whole.translation() + arm, *whole.rotation()))
                .linvel(velocity)
                .angvel(whole.angvel());
            let edge = half * SHRUNK;
            let smallest = cube.generation + 1 == self.generations;
            let groups = if smallest && within(&mut self.random, 0.0, 1.0) < DEBRIS {
                InteractionGroups::new(Group::GROUP_2, !Group::GROUP_2, InteractionTestMode::And)
            } else {
                InteractionGroups::all()
            };
            let collider = ColliderBuilder::cuboid(edge, edge, edge).restitution(0.2).collision_groups(groups);
            let (body, _) = self.physics.insert(body, collider);
            self.cubes.push_back(Cube { body, half: edge, generation: cube.generation + 1 });
        }
    }

    /// Removes the oldest until there are no more than `count`.
    fn clear_to(&mut self, count: usize) {
        while self.cubes.len() > count {
            if let Some(cube) = self.cubes.pop_front() {
                self.physics.remove_body(cube.body);
            }
        }
    }
}

/// Returns the corners of a cube of half edge 1 around the origin.
fn octants() -> impl Iterator<Item = Vector> {
    let side = |corner: u8, bit: u8| if corner >> bit & 1 == 1 { 1.0 } else { -1.0 };
    (0..8).map(move |corner| Vector::new(side(corner, 0), side(corner, 1), side(corner, 2)))
}

/// Draws uniformly from `low` to `high`.
fn within(random: &mut Random, low: f32, high: f32) -> f32 {
    low + (high - low) * ((random.bits() >> 40) as f32 / (1_u64 << 24) as f32)
}
