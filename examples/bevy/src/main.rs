//! A headless Bevy app: entities are spawned in bursts, drift in a box and are despawned; begun and ended overlaps
//! are counted.

use bevy_app::{App, AppExit, FixedUpdate, ScheduleRunnerPlugin, TaskPoolPlugin};
use bevy_ecs::prelude::*;
use bevy_math::Vec3;
use bevy_time::{TimePlugin, TimeUpdateStrategy};
use bevy_transform::components::Transform;
use sapwise_example_bevy::{BoxCollider, OverlapBegun, OverlapEnded, Overlaps, SapwisePlugin, SapwiseSystems};
use std::process::ExitCode;
use std::time::Duration;

/// Fixed steps after which the app ends, unless a number is given.
const STEPS: u64 = 600;

/// Half edge of the world, in edges of an entity.
const WORLD: f32 = 9.0;

/// Most entities at once.
const MOST: usize = 2000;

/// Steps of a burst of spawning and of the despawning that follows, together.
const CYCLE: u64 = 200;

#[derive(Component)]
struct Velocity(Vec3);

#[derive(Resource)]
struct Course {
    steps: u64,
    step: u64,
    random: u64,
    begun: usize,
    ended: usize,
}

impl Course {
    /// From -1 to 1: Marsaglia's xorshift.
    fn signed(&mut self) -> f32 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 7;
        self.random ^= self.random << 17;
        (self.random >> 40) as f32 / (1_u64 << 23) as f32 - 1.0
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed())
    }
}

/// Twenty entities come in each step of the first half of a cycle, and twenty go in each of the second.
fn spawn_and_despawn(mut commands: Commands, mut course: ResMut<Course>, all: Query<Entity, With<BoxCollider>>) {
    let grows = course.step % CYCLE < CYCLE / 2;
    course.step += 1;
    if !grows {
        all.iter().take(20).for_each(|entity| commands.entity(entity).despawn());
        return;
    }
    for _ in 0..20.min(MOST - all.iter().len()) {
        let (at, velocity) = (course.vector() * WORLD, course.vector() * 0.04);
        let collider = BoxCollider { half: Vec3::splat(0.5) };
        commands.spawn((collider, Transform::from_translation(at), Velocity(velocity)));
    }
}

fn drift(mut all: Query<(&mut Transform, &mut Velocity)>) {
    for (mut transform, mut velocity) in &mut all {
        transform.translation += velocity.0;
        let outside = transform.translation.abs().cmpgt(Vec3::splat(WORLD));
        velocity.0 = Vec3::select(outside, -transform.translation.signum() * velocity.0.abs(), velocity.0);
    }
}

fn report(
    mut course: ResMut<Course>,
    overlaps: Res<Overlaps>,
    mut begun: MessageReader<OverlapBegun>,
    mut ended: MessageReader<OverlapEnded>,
    all: Query<&BoxCollider>,
    mut exit: MessageWriter<AppExit>,
) {
    course.begun += begun.read().count();
    course.ended += ended.read().count();
    let last = course.step == course.steps;
    if course.step.is_multiple_of(50) || last {
        let algorithm = overlaps.algorithm().unwrap_or_default();
        let Course { step, begun, ended, .. } = *course;
        let (entities, pairs) = (all.iter().len(), overlaps.pairs().len());
        println!("{step:>6} {entities:>9} {pairs:>9} {begun:>9} {ended:>9}  {algorithm}");
    }
    if last {
        exit.write(AppExit::Success);
    }
}

fn main() -> ExitCode {
    let steps = match std::env::args().nth(1).map(|text| text.parse()) {
        None => STEPS,
        Some(Ok(steps)) if steps > 0 => steps,
        Some(_) => {
            eprintln!(
                "usage: cargo run --release -p sapwise-example-bevy -- [STEPS]\n\nSTEPS is a number above 0; {STEPS} \
                 unless given"
            );
            return ExitCode::from(2);
        }
    };
    println!("{:>6} {:>9} {:>9} {:>9} {:>9}  algorithm", "step", "entities", "pairs", "begun", "ended");
    let exit = App::new()
        .add_plugins((
            TaskPoolPlugin::default(),
            TimePlugin,
            ScheduleRunnerPlugin::run_loop(Duration::ZERO),
            SapwisePlugin,
        ))
        // One fixed step for each turn of the loop, however long that takes.
        .insert_resource(TimeUpdateStrategy::FixedTimesteps(1))
        .insert_resource(Course { steps, step: 0, random: 0x5eed, begun: 0, ended: 0 })
        .add_systems(FixedUpdate, (spawn_and_despawn, drift).chain().before(SapwiseSystems))
        .add_systems(FixedUpdate, report.after(SapwiseSystems))
        .run();
    if exit.is_success() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
