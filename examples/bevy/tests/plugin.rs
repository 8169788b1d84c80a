//! The plugin against the double loop, in every step of an app in which entities come, move and go.

use bevy_app::{App, FixedUpdate};
use bevy_ecs::prelude::*;
use bevy_math::{Quat, Vec3};
use bevy_time::{TimePlugin, TimeUpdateStrategy};
use bevy_transform::components::Transform;
use sapwise_example_bevy::{BoxCollider, OverlapBegun, OverlapEnded, Overlaps, SapwisePlugin, SapwiseSystems};
use std::collections::BTreeSet;
use std::process::Command;
use std::sync::Mutex;

type Set = BTreeSet<(Entity, Entity)>;

/// An app that runs `steps` fixed steps in every update.
fn app(steps: u32) -> App {
    let mut app = App::new();
    app.add_plugins((TimePlugin, SapwisePlugin)).insert_resource(TimeUpdateStrategy::FixedTimesteps(steps));
    // The first update starts the clock, and no step is due in it.
    app.update();
    app
}

fn cube(x: f32, y: f32, z: f32) -> (BoxCollider, Transform) {
    (BoxCollider { half: Vec3::splat(0.5) }, Transform::from_xyz(x, y, z))
}

fn ordered(a: Entity, b: Entity) -> (Entity, Entity) {
    (a.min(b), a.max(b))
}

/// Entities that neither turn nor grow: the double loop over their centres.
fn naive(world: &mut World) -> Set {
    let mut query = world.query::<(Entity, &BoxCollider, &Transform)>();
    let all: Vec<(Entity, Vec3, Vec3)> = query.iter(world).map(|(e, c, t)| (e, t.translation, c.half)).collect();
    let mut pairs = Set::new();
    for (k, (a, at, half)) in all.iter().enumerate() {
        for (b, other, reach) in &all[k + 1..] {
            if (at - half).cmple(other + reach).all() && (other - reach).cmple(at + half).all() {
                pairs.insert(ordered(*a, *b));
            }
        }
    }
    pairs
}

fn pairs(app: &App) -> Set {
    app.world().resource::<Overlaps>().pairs().iter().copied().collect()
}

#[derive(Resource)]
struct Random(u64);

impl Random {
    fn below(&mut self, most: f32) -> f32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 40) as f32 / (1_u64 << 24) as f32 * most
    }
}

/// What the messages told, one by one.
#[derive(Resource, Default)]
struct Told {
    begun: Vec<(Entity, Entity)>,
    ended: Vec<(Entity, Entity)>,
}

fn listen(mut told: ResMut<Told>, mut begun: MessageReader<OverlapBegun>, mut ended: MessageReader<OverlapEnded>) {
    told.begun = begun.read().map(|&OverlapBegun(a, b)| (a, b)).collect();
    told.ended = ended.read().map(|&OverlapEnded(a, b)| (a, b)).collect();
}

fn wander(mut random: ResMut<Random>, mut all: Query<&mut Transform>) {
    for mut transform in &mut all {
        let step = [(); 3].map(|()| random.below(0.1) - 0.05);
        transform.translation += Vec3::from(step);
    }
}

fn come_and_go(mut random: ResMut<Random>, mut commands: Commands, all: Query<Entity, With<BoxCollider>>) {
    for entity in &all {
        if random.below(1.0) < 0.03 {
            commands.entity(entity).despawn();
        }
    }
    for _ in 0..random.below(14.0) as usize {
        let at = [(); 3].map(|()| random.below(7.0));
        commands.spawn(cube(at[0], at[1], at[2]));
    }
}

#[test]
fn pairs_and_their_changes_are_those_of_the_double_loop_in_every_step() {
    let mut app = app(1);
    app.insert_resource(Random(0x5eed)).init_resource::<Told>();
    app.add_systems(FixedUpdate, (come_and_go, wander).chain().before(SapwiseSystems));
    app.add_systems(FixedUpdate, listen.after(SapwiseSystems));
    let (mut before, mut gone) = (Set::new(), 0);
    for step in 0..300 {
        app.update();
        let now = naive(app.world_mut());
        assert_eq!(pairs(&app), now, "step {step}");
        let told = app.world().resource::<Told>();
        let (begun, ended): (Set, Set) = (&now - &before, &before - &now);
        // Lists, so that a pair that is told twice is seen.
        assert!(told.begun.iter().eq(&begun), "step {step}: {:?}, not {begun:?}", told.begun);
        assert!(told.ended.iter().eq(&ended), "step {step}: {:?}, not {ended:?}", told.ended);
        gone += ended.iter().filter(|(a, b)| [a, b].iter().any(|&&e| app.world().get_entity(e).is_err())).count();
        before = now;
    }
    assert!(
        before.len() > 20 && gone > 100,
        "{} pairs at last, {gone} ended by entities that were despawned",
        before.len()
    );
}

#[test]
fn an_entity_that_is_despawned_ends_its_pairs_even_if_another_takes_its_place() {
    let mut app = app(1);
    app.init_resource::<Told>().add_systems(FixedUpdate, listen.after(SapwiseSystems));
    let stays = app.world_mut().spawn(cube(0.0, 0.0, 0.0)).id();
    let goes = app.world_mut().spawn(cube(0.4, 0.0, 0.0)).id();
    app.update();
    assert_eq!(app.world().resource::<Told>().begun, [ordered(stays, goes)]);
    app.world_mut().despawn(goes);
    let comes = app.world_mut().spawn(cube(0.4, 0.0, 0.0)).id();
    assert_ne!(comes, goes);
    app.update();
    let told = app.world().resource::<Told>();
    assert_eq!((&told.begun[..], &told.ended[..]), (&[ordered(stays, comes)][..], &[ordered(stays, goes)][..]));
}

#[test]
fn boxes_are_those_of_this_step_and_not_of_the_frame_before() {
    #[derive(Component)]
    struct Moves;
    // Three fixed steps in one frame, and Bevy brings the transforms up to date after the last of them only.
    let mut app = app(3);
    app.world_mut().spawn(cube(0.0, 0.0, 0.0));
    app.world_mut().spawn((cube(4.0, 0.0, 0.0), Moves));
    app.add_systems(
        FixedUpdate,
        (|mut all: Query<&mut Transform, With<Moves>>| all.iter_mut().for_each(|mut t| t.translation.x -= 1.0))
            .before(SapwiseSystems),
    );
    app.update();
    // At 1 they touch.
    assert_eq!(pairs(&app).len(), 1);
}

#[test]
fn a_box_turns_and_grows_and_goes_with_its_parent() {
    let mut app = app(1);
    let long = BoxCollider { half: Vec3::new(2.0, 0.1, 0.1) };
    let turned = Transform::from_rotation(Quat::from_rotation_z(std::f32::consts::FRAC_PI_2));
    let bar = app.world_mut().spawn((long, turned)).id();
    let above = app.world_mut().spawn(cube(0.0, 2.4, 0.0)).id();
    let beside = app.world_mut().spawn(cube(2.0, 0.0, 0.0)).id();
    app.update();
    assert_eq!(pairs(&app), Set::from([ordered(bar, above)]));
    // A child three edges to the right of a parent, which is moved and scaled.
    let parent = app.world_mut().spawn(Transform::from_xyz(10.0, 0.0, 0.0).with_scale(Vec3::splat(2.0))).id();
    let child = app.world_mut().spawn((cube(3.0, 0.0, 0.0), ChildOf(parent))).id();
    let there = app.world_mut().spawn(cube(17.4, 0.0, 0.0)).id();
    app.update();
    assert_eq!(pairs(&app), Set::from([ordered(bar, above), ordered(child, there)]));
    app.world_mut().entity_mut(parent).insert(Transform::from_xyz(-1.4, 0.0, 0.0));
    app.update();
    assert_eq!(pairs(&app), Set::from([ordered(bar, above), ordered(child, beside)]));
}

#[test]
fn an_invalid_box_is_an_error_that_names_the_entity() {
    static ERRORS: Mutex<Vec<String>> = Mutex::new(Vec::new());
    let mut app = app(1);
    app.set_error_handler(|error, _| ERRORS.lock().unwrap().push(error.to_string()));
    app.world_mut().spawn(cube(0.0, 0.0, 0.0));
    let bad = app.world_mut().spawn(cube(f32::NAN, 0.0, 0.0)).id();
    app.update();
    let errors = ERRORS.lock().unwrap();
    assert!(errors.len() == 1 && errors[0].contains(&bad.to_string()) && errors[0].contains("NaN"), "{errors:?}");
}

#[test]
fn the_app_counts_as_many_ended_overlaps_as_begun_ones_once_every_entity_is_gone() {
    let run = |steps| Command::new(env!("CARGO_BIN_EXE_sapwise-example-bevy")).arg(steps).output().unwrap();
    let done = run("200");
    assert!(done.status.success(), "{done:?}");
    let told = String::from_utf8(done.stdout).unwrap();
    let last: Vec<&str> = told.lines().last().unwrap().split_whitespace().collect();
    assert_eq!(last[..3], ["200", "0", "0"], "{told}");
    assert!(last[3] == last[4] && last[3].parse::<u32>().unwrap() > 1000, "{told}");
    assert_eq!(run("none").status.code(), Some(2));
}
