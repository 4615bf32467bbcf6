//! A Bevy world whose origin stays near the camera.

use bevy::{
    app::{App, Plugin, PostUpdate},
    ecs::{
        component::Component,
        entity::Entity,
        hierarchy::ChildOf,
        query::Without,
        reflect::ReflectComponent,
        schedule::IntoScheduleConfigs,
        system::{Query, ResMut},
    },
    prelude::ReflectDefault,
    reflect::Reflect,
    transform::{TransformSystems, components::Transform},
};
use glam::Vec3;

use super::sets::CanopySystems;
use crate::render::components::{CanopyOrigin, Forest, Ground};

/// On a camera: keeps the Bevy world's origin near it, so that f32 transforms stay precise however far it travels.
///
/// When the camera is farther than `step` metres from the origin on any axis, [`CanopyOrigin`] moves by whole steps,
/// and all entities without a parent move the other way, so that nothing moves in the scene. [`Forest`]s and
/// [`Ground`]s stay: their transforms are relative to the scene's origin.
#[derive(Component, Clone, Copy, Debug, PartialEq, Reflect)]
#[reflect(Component, Default)]
pub struct FloatingOrigin {
    /// Metres; a power of two keeps transforms exact. Values that are not above 0 switch it off.
    pub step: f32,
}

impl Default for FloatingOrigin {
    fn default() -> Self {
        Self { step: 1024.0 }
    }
}

/// Moves the origin after the camera.
pub struct OriginPlugin;

impl Plugin for OriginPlugin {
    fn build(&self, app: &mut App) {
        app.register_type::<FloatingOrigin>()
            .add_systems(PostUpdate, move_origin.in_set(CanopySystems::Origin).before(TransformSystems::Propagate));
    }
}

fn move_origin(
    mut origin: ResMut<CanopyOrigin>,
    cameras: Query<(Entity, &FloatingOrigin)>,
    mut roots: Query<&mut Transform, (Without<ChildOf>, Without<Forest>, Without<Ground>)>,
) {
    let Some((camera, floating)) = cameras.iter().min_by_key(|(entity, _)| *entity) else { return };
    let Ok(transform) = roots.get(camera) else { return };
    let shift = whole_steps(transform.translation, floating.step);
    if shift == Vec3::ZERO {
        return;
    }
    origin.0 += shift.as_dvec3();
    for mut transform in &mut roots {
        transform.translation -= shift;
    }
}

/// The whole steps in `position`, per axis; 0 if it is not a number.
fn whole_steps(position: Vec3, step: f32) -> Vec3 {
    if !(step > 0.0 && step.is_finite()) {
        return Vec3::ZERO;
    }
    // Round towards zero, so that the origin does not jump back and forth at the border between two steps.
    let steps = (position / step).trunc() * step;
    if steps.is_finite() { steps } else { Vec3::ZERO }
}

#[cfg(test)]
mod tests {
    use bevy::transform::TransformPlugin;
    use glam::DVec3;

    use super::*;

    #[test]
    fn the_scene_stays_where_it_is_while_the_origin_follows_the_camera() {
        let mut app = App::new();
        app.add_plugins((TransformPlugin, OriginPlugin)).init_resource::<CanopyOrigin>();
        let at = |x: f32, z: f32| Transform::from_xyz(x, 7.0, z);
        let camera = app.world_mut().spawn((FloatingOrigin::default(), at(0.0, 0.0))).id();
        let thing = app.world_mut().spawn(at(100.0, -50.0)).id();
        let child = app.world_mut().spawn((at(1.0, 2.0), ChildOf(thing))).id();
        let position = |app: &App, entity| {
            let transform = app.world().get::<Transform>(entity).expect("a transform").translation;
            app.world().resource::<CanopyOrigin>().0 + transform.as_dvec3()
        };
        // 300 km in steps of 375 m: f32 would be off by centimetres there.
        for _ in 0..800 {
            app.world_mut().get_mut::<Transform>(camera).expect("a transform").translation.x += 375.0;
            app.update();
            let transform = app.world().get::<Transform>(camera).expect("a transform");
            assert!(transform.translation.abs().max_element() < 1024.0);
        }
        assert_eq!(position(&app, camera), DVec3::new(300_000.0, 7.0, 0.0));
        assert_eq!(position(&app, thing), DVec3::new(100.0, 7.0, -50.0));
        assert_eq!(app.world().get::<Transform>(child), Some(&at(1.0, 2.0)), "children follow their parents");
    }

    #[test]
    fn nonsense_moves_nothing() {
        for (position, step) in [(Vec3::NAN, 1024.0), (Vec3::INFINITY, 1024.0), (Vec3::ONE, 0.0), (Vec3::ONE, f32::NAN)]
        {
            assert_eq!(whole_steps(position, step), Vec3::ZERO);
        }
    }
}
