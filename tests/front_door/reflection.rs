//! What an editor sees: every component is registered, and its values are reached by paths.

use bevy::{
    ecs::reflect::{AppTypeRegistry, ReflectComponent, ReflectResource},
    prelude::*,
    reflect::{GetPath, GetTypeRegistration, Reflect, TypePath, TypeRegistry},
};
use canopy::{
    assets::CanopyAssetPlugin,
    components::{
        FloatingOrigin, FollowsDaylight, ForestPlugin, OriginPlugin, ScenePlugin, SunPlugin, TerrainSettings,
    },
    prelude::*,
    render::components::{CanopyOrigin, CanopyStyle, CastsCanopyShadow, ComponentsPlugin, Forest, Ground},
};

/// An app that knows only the types that Canopy's plugins register.
fn program() -> App {
    let mut app = App::empty();
    app.init_resource::<AppTypeRegistry>().init_resource::<Time<Virtual>>();
    app.add_plugins((
        AssetPlugin::default(),
        CanopyAssetPlugin,
        ComponentsPlugin,
        SunPlugin,
        OriginPlugin,
        ScenePlugin,
        ForestPlugin,
    ));
    app
}

/// The reflected component of an entity.
fn component<C: Component + TypePath>(registry: &TypeRegistry) -> &ReflectComponent {
    let name = C::type_path();
    let registration = registry.get(std::any::TypeId::of::<C>()).unwrap_or_else(|| panic!("{name} is not registered"));
    registration.data::<ReflectComponent>().unwrap_or_else(|| panic!("{name} is no reflected component"))
}

/// Reads the value at `path` of an entity's component `C`, and replaces it by `new`.
#[track_caller]
fn replace<C: Component + TypePath, V: Reflect + Clone>(app: &mut App, entity: Entity, path: &str, new: V) -> V {
    let registry = app.world().resource::<AppTypeRegistry>().clone();
    let registry = registry.read();
    let mut target = app.world_mut().entity_mut(entity);
    let mut reflected = component::<C>(&registry).reflect_mut(&mut target).expect("the component");
    let value = reflected.path_mut::<V>(path).unwrap_or_else(|error| panic!("{path}: {error}"));
    std::mem::replace(value, new)
}

#[test]
fn every_component_is_registered_with_its_parts() {
    let app = program();
    let registry = app.world().resource::<AppTypeRegistry>().read();
    component::<CanopyCamera>(&registry);
    component::<CanopyScene>(&registry);
    component::<CanopyStyle>(&registry);
    component::<CastsCanopyShadow>(&registry);
    component::<FloatingOrigin>(&registry);
    component::<FollowsDaylight>(&registry);
    component::<Forest3d>(&registry);
    component::<Forest>(&registry);
    component::<ForestSettings>(&registry);
    component::<Ground>(&registry);
    component::<LoadedScene>(&registry);
    component::<SceneProgress>(&registry);
    component::<Sun>(&registry);
    component::<SunRefresh>(&registry);
    component::<SunShadowSettings>(&registry);
    component::<Terrain3d>(&registry);
    component::<TerrainSettings>(&registry);
    component::<ViewOptions>(&registry);
    let origin = registry.get(std::any::TypeId::of::<CanopyOrigin>()).expect("a registered resource");
    assert!(origin.data::<ReflectResource>().is_some());
    // The types of their fields, which an editor needs too.
    for name in ["Levels", "FadeBand", "Representation", "ForestTrees", "ScatteredTrees", "InventoryTrees", "Shown"] {
        assert!(registry.get_with_short_type_path(name).is_some(), "{name} is not registered");
    }
    // A control: what nobody registers is not there.
    assert!(registry.get(std::any::TypeId::of::<Other>()).is_none());
    assert_eq!(Other::get_type_registration().type_id(), std::any::TypeId::of::<Other>());
}

#[derive(Reflect)]
struct Other;

#[test]
fn nested_values_are_read_and_set_by_their_paths() {
    let mut app = program();
    let forest = Forest3d::scatter(300.0).of(Handle::default(), 2.0);
    let entity = app.world_mut().spawn((forest, ForestSettings::default(), Sun::default())).id();
    let levels = ForestSettings::default().levels;
    let start = levels.fade_out(0).expect("two levels").start;

    assert_eq!(replace::<ForestSettings, f32>(&mut app, entity, ".levels.fades[0].start", 12.5), start);
    let shown = app.world().get::<ForestSettings>(entity).expect("the settings");
    assert_eq!(shown.levels.fade_out(0).map(|fade| fade.start), Some(12.5));
    assert_eq!(replace::<ForestSettings, f32>(&mut app, entity, ".view_distance", 99.0), shown_distance());

    assert_eq!(replace::<Forest3d, f64>(&mut app, entity, ".trees.0.stems_per_hectare", 40.0), 300.0);
    assert_eq!(replace::<Forest3d, f64>(&mut app, entity, ".species[0].weight", 1.0), 2.0);
    let expected = Forest3d::scatter(40.0).of(Handle::default(), 1.0);
    assert_eq!(app.world().get::<Forest3d>(entity), Some(&expected));

    assert_eq!(replace::<Sun, f64>(&mut app, entity, ".observer.latitude_deg", -36.0), 48.0);
    assert_eq!(replace::<SunShadowSettings, usize>(&mut app, entity, ".cascades", 2), 4);
}

fn shown_distance() -> f32 {
    ForestSettings::default().view_distance
}

#[test]
fn a_scene_and_its_overrides_are_set_by_their_paths() {
    let mut app = program();
    let entity = app.world_mut().spawn(CanopyScene::new("valley.ron")).id();
    let file = replace::<CanopyScene, std::path::PathBuf>(&mut app, entity, ".source.0", "hills.ron".into());
    assert_eq!(file.to_str(), Some("valley.ron"));
    assert_eq!(replace::<CanopyScene, Option<u64>>(&mut app, entity, ".overrides.seed", Some(7)), None);
    let scene = app.world().get::<CanopyScene>(entity).expect("the scene");
    assert_eq!((scene.source.to_string().as_str(), scene.overrides.seed), ("hills.ron", Some(7)));
}

#[test]
fn a_reflected_component_is_copied_to_another_entity() {
    let mut app = program();
    let registry = app.world().resource::<AppTypeRegistry>().clone();
    let registry = registry.read();
    let forest = Forest3d::scatter(120.0).of(Handle::default(), 2.0).seed(9);
    let first = app.world_mut().spawn(forest.clone()).id();
    let second = app.world_mut().spawn_empty().id();
    let source = component::<Forest3d>(&registry).reflect(app.world().entity(first)).expect("the component");
    let copy = source.to_dynamic();
    let world = app.world_mut();
    component::<Forest3d>(&registry).insert(&mut world.entity_mut(second), copy.as_ref(), &registry);
    assert_eq!(world.get::<Forest3d>(second), Some(&forest));
}
