use crate::*;
use avian3d::collider_tree::ColliderTreeSystems;
use bevy::app::PluginGroupBuilder;
use bevy::ecs::system::SystemParam;
use scenes::{empty, scenes};

#[path = "../benches/scenes.rs"]
mod scenes;

/// The share of the bodies of each scene, and the steps. Unoptimised, all of them would take tens of minutes.
const SHARE: usize = if cfg!(debug_assertions) { 10 } else { 1 };
const STEPS: usize = if cfg!(debug_assertions) { 300 } else { 600 };

/// Meets nothing, by a hook.
#[derive(Component)]
struct Ghost;

#[derive(SystemParam)]
struct Hooks<'w, 's>(Query<'w, 's, (), With<Ghost>>);

impl CollisionHooks for Hooks<'_, '_> {
    fn filter_pairs(&self, one: Entity, other: Entity, _: &mut Commands) -> bool {
        !self.0.contains(one) && !self.0.contains(other)
    }
}

/// The contact graph that this broad phase made of the one that avian's then had.
#[derive(Resource, Default)]
struct Shadow(ContactGraph);

/// Returns all that a broad phase writes of each pair. The order of two sensors may differ: avian looks from both.
fn pairs(graph: &ContactGraph) -> Vec<impl Ord + std::fmt::Debug> {
    let pair = |pair: &ContactPair| {
        let edge = graph.get_edge_by_id(pair.contact_id).unwrap();
        let mut colliders = [(pair.collider1, pair.body1), (pair.collider2, pair.body2)];
        assert_eq!((edge.body1, edge.body2), (pair.body1, pair.body2));
        if !pair.generates_constraints() {
            colliders.sort_unstable();
        }
        (colliders, edge.flags.bits(), pair.flags.bits())
    };
    let mut pairs: Vec<_> = graph.iter_active().chain(graph.iter_sleeping()).map(pair).collect();
    pairs.sort_unstable();
    pairs
}

/// Returns avian with its own broad phase. Each step fails unless this one finds the same pairs.
fn shadowed() -> PluginGroupBuilder {
    PhysicsPlugins::default().with_collision_hooks::<Hooks>().build().add(shadow)
}

fn shadow(app: &mut App) {
    let before = |world: &mut World| {
        let graph = world.resource::<ContactGraph>().clone();
        world.run_system_cached::<(), _, _>(collect::<Hooks>).unwrap();
        let found = std::mem::replace(&mut *world.resource_mut::<ContactGraph>(), graph);
        world.insert_resource(Shadow(found));
    };
    let after = |graph: Res<ContactGraph>, shadow: Res<Shadow>| assert_eq!(pairs(&shadow.0), pairs(&graph));
    app.insert_resource(BroadPhase::new(Space::new())).init_resource::<Shadow>().add_observer(note);
    let before = before.after(ColliderTreeSystems::UpdateAabbs).before(BroadPhaseSystems::CollectCollisions);
    let systems = (before.in_set(PhysicsStepSystems::BroadPhase), after.in_set(BroadPhaseSystems::Last));
    app.add_systems(PhysicsSchedule, systems.ambiguous_with_all());
}

fn steps(app: &mut App, count: usize) {
    (0..count).for_each(|_| app.update());
}

/// A ball of radius 1 at the origin, with more components.
fn ball(app: &mut App, more: impl Bundle) -> Entity {
    app.world_mut().spawn((Collider::sphere(1.0), Transform::default(), more)).id()
}

fn meet(app: &App, one: Entity, other: Entity) -> bool {
    app.world().resource::<ContactGraph>().contains(one, other)
}

/// Moves a collider and makes a step.
fn shift(app: &mut App, collider: Entity, by: f32) {
    app.world_mut().get_mut::<Position>(collider).unwrap().0.x += by;
    app.update();
}

/// Moves a collider just out of its enlarged box, and makes a step.
fn nudge(app: &mut App, collider: Entity) {
    shift(app, collider, 0.2);
}

/// avian with a shadow, and with the plugin in the place of its own.
fn both() -> [App; 2] {
    let other = PhysicsPlugins::default().with_collision_hooks::<Hooks>().build();
    let other = other.disable::<BvhBroadPhasePlugin<Hooks>>().add(SapwiseBroadPhasePlugin::<Hooks>::default());
    [shadowed(), other].map(empty)
}

fn without_gravity() -> [App; 2] {
    both().map(|mut app| {
        app.insert_resource(Gravity::ZERO);
        app
    })
}

#[test]
fn same_pairs_in_every_step_of_five_scenes() {
    for scene in scenes(SHARE) {
        let mut app = scene.app(shadowed());
        steps(&mut app, STEPS);
        let pairs = app.world().resource::<ContactGraph>().edges.edge_count();
        assert!(pairs > scene.movers / 4, "{}: only {pairs} pairs", scene.name);
    }
}

#[test]
fn scenes_settle_as_with_the_other_broad_phase() {
    for scene in scenes(SHARE) {
        let own = PhysicsPlugins::default().build();
        let other = PhysicsPlugins::default().build().disable::<BvhBroadPhasePlugin>();
        let apps = [own, other.add(SapwiseBroadPhasePlugin::<()>::default())].map(|physics| scene.app(physics));
        // Mean height and speed, and the lowest place, of what moves.
        let [avian, sapwise] = apps.map(|mut app| {
            steps(&mut app, STEPS);
            let mut bodies = app.world_mut().query::<(&Position, &LinearVelocity, &RigidBody)>();
            let movers = bodies.iter(app.world()).filter(|(.., body)| body.is_dynamic());
            let movers: Vec<_> = movers.map(|(at, velocity, _)| (at.y, velocity.length())).collect();
            let mean = |of: fn(&(f32, f32)) -> f32| movers.iter().map(of).sum::<f32>() / movers.len() as f32;
            [mean(|m| m.0), mean(|m| m.1), movers.iter().map(|m| m.0).fold(f32::MAX, f32::min)]
        });
        let close = |a: f32, b: f32| (a - b).abs() < 0.05 * a.abs() + 0.05;
        let same = avian.iter().zip(&sapwise).all(|(&a, &b)| close(a, b));
        assert!(same, "{}: {avian:?} and {sapwise:?}", scene.name);
    }
}

#[test]
fn layers_decide() {
    for mut app in without_gravity() {
        let [a, b] = [1, 2].map(|layer| ball(&mut app, (RigidBody::Dynamic, CollisionLayers::new(layer, layer))));
        app.update();
        assert!(!meet(&app, a, b));
        app.world_mut().entity_mut(b).insert(CollisionLayers::new(1, 1));
        app.update();
        // avian looks when one of them moves.
        assert!(!meet(&app, a, b));
        nudge(&mut app, a);
        assert!(meet(&app, a, b));
    }
}

#[test]
fn sensors_meet_static_colliders_and_push_nothing() {
    for mut app in without_gravity() {
        let [wall, still, moving] = [
            ball(&mut app, RigidBody::Static),
            ball(&mut app, (RigidBody::Static, Sensor)),
            ball(&mut app, (RigidBody::Dynamic, Sensor)),
        ];
        let other = ball(&mut app, RigidBody::Static);
        app.update();
        assert!(!meet(&app, wall, other));
        for (one, other) in [(wall, still), (wall, moving), (still, moving)] {
            let (_, pair) = app.world().resource::<ContactGraph>().get(one, other).unwrap();
            assert!(!pair.generates_constraints());
        }
        // Static colliders are no pairs of the space.
        assert!(app.world().resource::<BroadPhase>().refused.is_empty());
        // avian looks for what a static sensor meets when that moves.
        shift(&mut app, wall, 50.0);
        shift(&mut app, wall, -50.0);
        assert!(!meet(&app, wall, still));
        nudge(&mut app, still);
        assert!(meet(&app, wall, still));
    }
}

#[test]
fn sleeping_bodies_cost_no_update_and_wake() {
    for mut app in both() {
        let ground = app.world_mut().spawn((RigidBody::Static, Collider::cuboid(9.0, 1.0, 9.0))).id();
        let collider = Collider::cuboid(1.0, 1.0, 1.0);
        let cube = app.world_mut().spawn((RigidBody::Dynamic, collider, Transform::from_xyz(0.0, 1.0, 0.0))).id();
        steps(&mut app, 200);
        assert!(app.world().entity(cube).contains::<Sleeping>() && meet(&app, ground, cube));
        // Queries find a body from the next update on.
        let far = sapwise::Aabb::cube([1000.0; 3], 1.0);
        app.world_mut().resource_mut::<BroadPhase>().mirror.space.insert(far, sapwise::Body::default()).unwrap();
        let found = |app: &App| {
            let mut found = 0;
            app.world().resource::<BroadPhase>().mirror.space.all().query_box(&far, |_| found += 1).unwrap();
            found
        };
        steps(&mut app, 10);
        assert_eq!(found(&app), 0);
        let other = ball(&mut app, (RigidBody::Dynamic, LinearVelocity::ZERO));
        app.world_mut().get_mut::<Position>(other).unwrap().0.y = 2.5;
        steps(&mut app, 60);
        assert!(found(&app) == 1 && meet(&app, cube, other));
        assert!(!app.world().entity(cube).contains::<Sleeping>());
    }
}

#[test]
fn hooks_are_asked_again_when_a_collider_moves() {
    for mut app in without_gravity() {
        let ghost = ball(&mut app, (RigidBody::Dynamic, Ghost, ActiveCollisionHooks::FILTER_PAIRS));
        let other = ball(&mut app, RigidBody::Dynamic);
        app.update();
        assert!(!meet(&app, ghost, other));
        app.world_mut().entity_mut(ghost).remove::<Ghost>();
        app.update();
        assert!(!meet(&app, ghost, other));
        nudge(&mut app, other);
        assert!(meet(&app, ghost, other));
    }
}

#[test]
fn joints_and_parts_of_a_body_do_not_meet() {
    for mut app in without_gravity() {
        let [a, b] = [0, 1].map(|_| ball(&mut app, RigidBody::Dynamic));
        let joint = app.world_mut().spawn((FixedJoint::new(a, b), JointCollisionDisabled)).id();
        let part = ball(&mut app, ChildOf(a));
        let [alone, lonely] = [0, 1].map(|_| ball(&mut app, ()));
        steps(&mut app, 3);
        assert!(!meet(&app, a, b) && !meet(&app, a, part) && !meet(&app, alone, lonely));
        assert!(meet(&app, a, alone) && meet(&app, part, lonely));
        app.world_mut().despawn(joint);
        nudge(&mut app, a);
        assert!(meet(&app, a, b));
    }
}

#[test]
fn pairs_that_someone_removed_come_again() {
    for mut app in without_gravity() {
        let [a, b, c] = [0, 1, 2].map(|_| ball(&mut app, RigidBody::Dynamic));
        app.update();
        // Within one step, so that the trees show the same collider in the same place.
        app.world_mut().entity_mut(a).insert(ColliderDisabled).remove::<ColliderDisabled>();
        app.update();
        assert!(meet(&app, a, b) && meet(&app, a, c));
        app.world_mut().entity_mut(a).insert(RigidBody::Static);
        app.world_mut().entity_mut(b).insert(ColliderDisabled);
        app.world_mut().despawn(c);
        let d = ball(&mut app, RigidBody::Kinematic);
        app.update();
        assert!(meet(&app, a, d) && !meet(&app, a, b));
        app.world_mut().entity_mut(b).remove::<ColliderDisabled>();
        app.update();
        assert!(meet(&app, a, b) && meet(&app, b, d));
    }
}
