//! A plugin that an author of a Bevy app would write around Sapwise: which entities overlap, and which have begun and
//! ceased to.
//!
//! ```
//! use bevy_app::{App, Startup};
//! use bevy_ecs::prelude::*;
//! use bevy_math::Vec3;
//! use bevy_time::{TimePlugin, TimeUpdateStrategy};
//! use bevy_transform::components::Transform;
//! use sapwise_example_bevy::{BoxCollider, Overlaps, SapwisePlugin};
//!
//! let mut app = App::new();
//! app.add_plugins((TimePlugin, SapwisePlugin)).insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
//! app.add_systems(Startup, |mut commands: Commands| {
//!     for x in [0.0, 0.9, 5.0] {
//!         commands.spawn((BoxCollider { half: Vec3::splat(0.5) }, Transform::from_xyz(x, 0.0, 0.0)));
//!     }
//! });
//! // The first update starts the clock; the second has a fixed step.
//! app.update();
//! app.update();
//! assert_eq!(app.world().resource::<Overlaps>().pairs().len(), 1);
//! ```

mod overlaps;

use bevy_app::{App, FixedUpdate, Plugin};
use bevy_ecs::prelude::*;
use bevy_math::{Vec3, Vec3A};
use bevy_transform::components::{GlobalTransform, Transform};
use bevy_transform::plugins::TransformPlugin;
use bevy_transform::systems::{mark_dirty_trees, propagate_parent_transforms, sync_simple_transforms};
use sapwise::Aabb;

pub use overlaps::Overlaps;

/// A box around the origin of an entity, which its transform moves, turns and scales.
#[derive(Component, Debug, Clone, Copy, PartialEq)]
#[require(Transform)]
pub struct BoxCollider {
    /// Half its extent along each axis of the entity.
    pub half: Vec3,
}

/// Two entities whose boxes overlap now and did not in the fixed step before; the lower one first.
#[derive(Message, Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct OverlapBegun(pub Entity, pub Entity);

/// Two entities whose boxes overlapped in the fixed step before and don't now, or of which one is gone; the lower one
/// first.
#[derive(Message, Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct OverlapEnded(pub Entity, pub Entity);

/// The systems that find overlaps, in [`FixedUpdate`]. What moves entities there runs before, what reads [`Overlaps`]
/// after.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct SapwiseSystems;

/// Finds the entities with a [`BoxCollider`] that overlap, touching included, once in each fixed step.
///
/// It needs `TimePlugin`, as everything in [`FixedUpdate`] does, and brings [`TransformPlugin`].
#[derive(Debug, Clone, Copy, Default)]
pub struct SapwisePlugin;

impl Plugin for SapwisePlugin {
    fn build(&self, app: &mut App) {
        if !app.is_plugin_added::<TransformPlugin>() {
            app.add_plugins(TransformPlugin);
        }
        // Bevy brings `GlobalTransform` up to date after all fixed steps of a frame: without these three systems the
        // boxes would be those of the frame before.
        let systems = (mark_dirty_trees, propagate_parent_transforms, sync_simple_transforms, find_overlaps);
        app.init_resource::<Overlaps>()
            .add_message::<OverlapBegun>()
            .add_message::<OverlapEnded>()
            .add_systems(FixedUpdate, systems.chain().in_set(SapwiseSystems));
    }
}

/// The box along the axes of the world around a collider.
#[must_use]
pub fn world_box(collider: &BoxCollider, transform: &GlobalTransform) -> Aabb {
    let affine = transform.affine();
    let axes = affine.matrix3;
    // Each axis of the box reaches as far as its half extent, whichever way it points.
    let half: Vec3A = axes.x_axis.abs() * collider.half.x.abs()
        + axes.y_axis.abs() * collider.half.y.abs()
        + axes.z_axis.abs() * collider.half.z.abs();
    let centre = affine.translation;
    Aabb::new((centre - half).to_array(), (centre + half).to_array())
}

fn find_overlaps(
    colliders: Query<(Entity, &BoxCollider, &GlobalTransform)>,
    mut overlaps: ResMut<Overlaps>,
    mut begun: MessageWriter<OverlapBegun>,
    mut ended: MessageWriter<OverlapEnded>,
) -> Result<(), BevyError> {
    overlaps.find(colliders.iter().map(|(entity, collider, transform)| (entity, world_box(collider, transform))))?;
    begun.write_batch(overlaps.begun().iter().map(|&(a, b)| OverlapBegun(a, b)));
    ended.write_batch(overlaps.ended().iter().map(|&(a, b)| OverlapEnded(a, b)));
    Ok(())
}
