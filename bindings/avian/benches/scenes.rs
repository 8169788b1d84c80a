//! Five scenes of avian, without a window.

use avian3d::prelude::*;
use bevy::app::PluginGroupBuilder;
use bevy::prelude::*;
use bevy::time::TimeUpdateStrategy;

/// A scene, with its number of bodies that move.
#[derive(Clone, Copy)]
pub(crate) struct Scene {
    pub(crate) name: &'static str,
    pub(crate) movers: usize,
    spawn: fn(&mut World, usize),
}

/// The scenes with this share of their bodies, 1 for all.
pub(crate) fn scenes(share: usize) -> [Scene; 5] {
    [
        Scene { name: "pile", movers: 1000 / share, spawn: pile },
        Scene { name: "pyramid", movers: 1275 / share, spawn: pyramid },
        Scene { name: "cubes", movers: 10_000 / share, spawn: cubes },
        Scene { name: "level", movers: 500 / share, spawn: level },
        Scene { name: "mortal", movers: 2000 / share, spawn: mortal },
    ]
}

impl Scene {
    pub(crate) fn app(&self, physics: PluginGroupBuilder) -> App {
        let mut app = empty(physics);
        (self.spawn)(app.world_mut(), self.movers);
        app
    }
}

/// Makes an app in which each update is one step.
pub(crate) fn empty(physics: PluginGroupBuilder) -> App {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, TransformPlugin, physics));
    app.insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
    app.finish();
    app.cleanup();
    // The first update makes no step.
    app.update();
    app
}

/// A number from -1 to 1.
fn random(k: usize) -> f32 {
    let mixed = (k as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let mixed = (mixed ^ mixed >> 31).wrapping_mul(0x94D0_49BB_1331_11EB);
    (mixed >> 40) as f32 / (1 << 23) as f32 - 1.0
}

fn spawn_static(world: &mut World, at: Vec3, edges: Vec3) {
    let collider = Collider::cuboid(edges.x, edges.y, edges.z);
    world.spawn((RigidBody::Static, collider, Transform::from_translation(at)));
}

/// The upper face is at height 0.
fn floor(world: &mut World) {
    spawn_static(world, Vec3::new(0.0, -0.5, 0.0), Vec3::new(1000.0, 1.0, 1000.0));
}

fn cube(at: Vec3) -> impl Bundle {
    (RigidBody::Dynamic, Collider::cuboid(1.0, 1.0, 1.0), Transform::from_translation(at))
}

/// The place of cube `k` of many above each other, `edge * edge` in a layer.
fn stacked(k: usize, edge: usize, distance: f32) -> Vec3 {
    let at = |k: usize| (k as f32 - (edge - 1) as f32 / 2.0) * distance;
    Vec3::new(at(k % edge), 1.0 + (k / (edge * edge)) as f32 * distance, at(k / edge % edge))
}

/// Cubes that fall onto a heap, which is as wide as high. The direction in which a tower topples would depend on
/// rounding: two runs of avian's own differ if a cube is moved by 0.00001.
fn pile(world: &mut World, count: usize) {
    floor(world);
    let edge = (count as f32).cbrt().round() as usize;
    for k in 0..count {
        let aside = Vec3::new(random(2 * k), 0.0, random(2 * k + 1)) * 0.4;
        world.spawn(cube(stacked(k, edge, 1.2) + aside));
    }
}

/// A wall in the shape of a triangle.
fn pyramid(world: &mut World, count: usize) {
    floor(world);
    let base = ((2.0 * count as f32).sqrt() as usize).max(1);
    for row in 0..base {
        for k in 0..base - row {
            let x = (k as f32 - (base - row) as f32 / 2.0) * 1.01;
            world.spawn(cube(Vec3::new(x, row as f32 + 0.5, 0.0)));
        }
    }
}

/// Cubes in a lattice that fall.
fn cubes(world: &mut World, count: usize) {
    floor(world);
    let edge = (count as f32).cbrt() as usize + 1;
    for k in 0..count {
        world.spawn(cube(stacked(k, edge, 2.0)));
    }
}

/// A hilly level of 40 static colliders for each ball that strolls in it.
fn level(world: &mut World, balls: usize) {
    let edge = ((40 * balls) as f32).sqrt() as usize;
    let height = |x: f32, z: f32| 2.0 * ((x * 0.2).sin() + (z * 0.15).cos());
    let at = |k: usize| k as f32 - edge as f32 / 2.0;
    for (i, j) in (0..edge * edge).map(|k| (k % edge, k / edge)) {
        let is_rim = [i, j].iter().any(|&k| k == 0 || k == edge - 1);
        let y = if is_rim { 40.0 } else { 1.0 };
        spawn_static(world, Vec3::new(at(i), height(at(i), at(j)), at(j)), Vec3::new(1.0, y, 1.0));
    }
    for k in 0..balls {
        let (x, z) = (random(2 * k) * at(edge) * 0.9, random(2 * k + 1) * at(edge) * 0.9);
        let place = Transform::from_xyz(x, height(x, z) + 2.0, z);
        world.spawn((RigidBody::Dynamic, Collider::sphere(0.4), place));
    }
    let mut step = 0;
    let stroll = move |balls: Query<(&RigidBody, &mut LinearVelocity)>| {
        for (k, (_, mut velocity)) in balls.into_iter().filter(|(body, _)| body.is_dynamic()).enumerate() {
            // Each in its own step, once a second.
            if (step + k) % 64 == 0 {
                velocity.0 += Vec3::new(random(k + step), 0.3, random(k + step + 1)) * 6.0;
            }
        }
        step += 1;
    };
    world.schedule_scope(Update, |_, schedule| {
        schedule.add_systems(stroll);
    });
}

/// The age of a body, in steps.
#[derive(Component)]
struct Born(usize);

/// Cubes rain for half the time that they live.
fn mortal(world: &mut World, count: usize) {
    floor(world);
    let life = 200;
    let mut step = 0;
    let rain = move |mut commands: Commands, bodies: Query<(Entity, &Born)>| {
        bodies.iter().filter(|(_, born)| born.0 + life == step).for_each(|(body, _)| commands.entity(body).despawn());
        for k in 0..count.div_ceil(life) {
            let k = step * count.div_ceil(life) + k;
            let at = Vec3::new(random(3 * k) * 15.0, 12.0 + random(3 * k + 1), random(3 * k + 2) * 15.0);
            commands.spawn((cube(at), Born(step)));
        }
        step += 1;
    };
    world.schedule_scope(Update, |_, schedule| {
        schedule.add_systems(rain);
    });
}
