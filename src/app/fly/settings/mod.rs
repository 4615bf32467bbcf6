//! The settings panel: edits what can be reflected, while it is seen. Its sections are the lighting of each species'
//! leaves, and every component of this crate on the camera and on the sun that has fields and derives `Reflect`; a new
//! setting appears by deriving it.
//!
//! `fields` turns a value into a list of fields and carries out edits; `species` has the lighting of the leaves, which
//! `rebake` bakes in the background; `draw` draws the panel. This file connects them.

mod draw;
pub(in crate::app) mod fields;
mod rebake;
mod species;

use std::{any::TypeId, collections::HashMap, time::Instant};

use bevy::{
    ecs::{
        change_detection::DetectChangesMut,
        entity::Entity,
        query::{Or, With},
        reflect::{AppTypeRegistry, ReflectComponent},
        resource::Resource,
        world::{Mut, World},
    },
    reflect::{ParsedPath, PartialReflect, TypeInfo, TypeRegistration, TypeRegistry},
};

use super::controls::PanelInput;
use crate::{
    assets::Stage,
    components::Sun,
    render::components::{CanopyCamera, CanopyStyle, Forest},
};
use fields::{Edit, Edited, Field};
use species::SpeciesLight;

pub use draw::settings_panel;

/// Components of these crates are shown.
const CRATE: &str = "canopy::";
/// Fields that have no effect in a flight, which has a clock of its own.
const HIDDEN: [&str; 1] = ["rate"];

/// The state of the panel.
#[derive(Resource)]
pub struct SettingsPanel {
    /// Whether the panel is shown and receives its keys.
    pub open: bool,
    /// Index of the selected section: the species, then the components.
    section: usize,
    /// Index of the selected field.
    line: usize,
    species: Vec<SpeciesLight>,
    components: Vec<ComponentSection>,
    /// The selected section for the scene file, if it is the style.
    style: Option<String>,
    /// The fields of the selected section in the last frame.
    fields: Vec<Field>,
    /// Edits of them that were not carried out yet.
    edits: Vec<(ParsedPath, Edit)>,
}

/// A component that can be edited.
struct ComponentSection {
    entity: Entity,
    type_id: TypeId,
    /// Short name of its type.
    name: &'static str,
    /// Its value when it was first seen.
    initial: Box<dyn PartialReflect>,
    left: HashMap<(String, String), Box<dyn PartialReflect>>,
}

impl SettingsPanel {
    /// A panel, closed, for a flight through `stage`.
    pub fn new(stage: &Stage) -> Self {
        Self {
            open: false,
            section: 0,
            line: 0,
            species: SpeciesLight::of_stage(stage),
            components: Vec::new(),
            style: None,
            fields: Vec::new(),
            edits: Vec::new(),
        }
    }

    /// Handles a key press. Returns the text to print for the user, if any.
    pub fn handle(&mut self, input: PanelInput) -> Option<String> {
        let edit = match input {
            PanelInput::Line(down) => {
                self.line = turned(self.line, self.fields.len(), down);
                return None;
            }
            PanelInput::Section(forward) => {
                self.turn(forward);
                return None;
            }
            PanelInput::Write => {
                return self.species.get(self.section).map(SpeciesLight::snippet).or_else(|| self.style.clone());
            }
            PanelInput::Value { up, fine } => Edit::Step { up, fine },
            PanelInput::Automatic => Edit::Automatic,
            PanelInput::Reset => Edit::Reset,
        };
        let path = self.fields.get(self.line)?.path.clone();
        self.edits.push((path, edit));
        None
    }

    /// Selects the next section, or the one before.
    fn turn(&mut self, forward: bool) {
        self.section = turned(self.section, self.species.len() + self.components.len(), forward);
        self.line = 0;
        self.fields.clear();
        self.edits.clear();
    }

    /// The lighting of the species that differ from the scene, for an image's notes.
    pub fn notes(&self) -> Option<String> {
        let changed = self.species.iter().filter_map(|light| Some(format!("{}: {}", light.name, light.changed()?)));
        let notes: Vec<_> = changed.collect();
        (!notes.is_empty()).then(|| notes.join("; "))
    }

    /// The selected component.
    fn component(&mut self) -> Option<&mut ComponentSection> {
        self.components.get_mut(self.section.checked_sub(self.species.len())?)
    }

    /// Finds the components that can be edited.
    fn find_components(&mut self, world: &mut World, registry: &TypeRegistry) {
        let mut query = world.query_filtered::<Entity, Or<(With<CanopyCamera>, With<Sun>)>>();
        let entities: Vec<Entity> = query.iter(world).collect();
        let mut found = Vec::new();
        for entity in entities {
            let Ok(entity) = world.get_entity(entity) else { continue };
            for (registration, component) in registry.iter_with_data::<ReflectComponent>() {
                let path = registration.type_info().type_path();
                if !path.starts_with(CRATE) || !has_fields(registration) {
                    continue;
                }
                let Some(value) = component.reflect(entity) else { continue };
                let id = world.components().get_id(registration.type_id());
                if !id.and_then(|id| world.components().get_info(id)).is_some_and(|info| info.mutable()) {
                    continue;
                }
                let (entity, type_id) = (entity.id(), registration.type_id());
                let known = self.components.iter().position(|old| (old.entity, old.type_id) == (entity, type_id));
                found.push(match known {
                    Some(known) => self.components.swap_remove(known),
                    None => ComponentSection {
                        entity,
                        type_id,
                        name: registration.type_info().type_path_table().short_path(),
                        initial: value.to_dynamic(),
                        left: HashMap::new(),
                    },
                });
            }
        }
        found.sort_by_key(|section| (section.entity, section.name));
        self.components = found;
    }

    /// Carries out the edits of the selected section, and lists its fields.
    fn refresh(&mut self, world: &mut World, registry: &TypeRegistry, now: Instant) {
        let edits = std::mem::take(&mut self.edits);
        self.style = None;
        if let Some(light) = self.species.get_mut(self.section) {
            light.request_values();
            let (fields, changed) = carry_out(&mut light.edited(registry), &edits);
            self.fields = fields;
            if changed {
                light.apply(now);
            }
        } else if let Some(section) = self.component() {
            let mut written = None;
            let component = registry.get_type_data::<ReflectComponent>(section.type_id);
            let entity = world.get_entity_mut(section.entity).ok();
            let value =
                component.zip(entity).and_then(|(component, entity)| component.reflect_mut(entity.into_mutable()));
            self.fields = value.map_or(Vec::new(), |mut value| {
                // Looking at a component does not change it.
                let value = if edits.is_empty() { value.bypass_change_detection() } else { &mut *value };
                let mut edited = Edited {
                    name: "value",
                    value: value.as_partial_reflect_mut(),
                    initial: &*section.initial,
                    automatic: None,
                    hidden: &HIDDEN,
                    left: &mut section.left,
                    registry,
                };
                let fields = carry_out(&mut edited, &edits).0;
                let style = value.as_any().downcast_ref::<CanopyStyle>();
                written = style.map(|style| format!("style: {},\n", style.style.to_ron()));
                fields
            });
            self.style = written;
        } else {
            self.fields.clear();
        }
        self.line = self.line.min(self.fields.len().saturating_sub(1));
    }
}

/// The next of `count` indices, or the one before, in a circle.
fn turned(index: usize, count: usize, forward: bool) -> usize {
    (index + if forward { 1 } else { count.saturating_sub(1) }).checked_rem(count).unwrap_or(0)
}

fn has_fields(registration: &TypeRegistration) -> bool {
    match registration.type_info() {
        TypeInfo::Struct(info) => info.field_len() > 0,
        TypeInfo::TupleStruct(info) => info.field_len() > 0,
        TypeInfo::Enum(_) => true,
        _ => false,
    }
}

/// Carries out `edits`. Returns the fields after them, and whether one has changed anything.
fn carry_out(edited: &mut Edited, edits: &[(ParsedPath, Edit)]) -> (Vec<Field>, bool) {
    let (mut fields, mut changed) = (edited.fields(), false);
    for (path, edit) in edits {
        if let Some(field) = fields.iter().find(|field| field.path == *path)
            && edited.edit(field, edit)
        {
            (fields, changed) = (edited.fields(), true);
        }
    }
    (fields, changed)
}

/// Carries out the edits of the panel, and shows in the forest what was baked.
pub fn update(world: &mut World) {
    let registry = world.resource::<AppTypeRegistry>().clone();
    world.resource_scope(|world, mut panel: Mut<SettingsPanel>| {
        let (panel, now) = (&mut *panel, Instant::now());
        if panel.open {
            let registry = registry.read();
            panel.find_components(world, &registry);
            panel.refresh(world, &registry, now);
        }
        let mut forests = world.query::<&mut Forest>();
        if let Some(mut forest) = forests.iter_mut(world).next() {
            panel.species.iter_mut().for_each(|light| light.update(&mut forest, now));
        }
    });
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{
        bake::BakedPlant,
        progress::Silent,
        render::components::{SunShadowSettings, ViewOptions},
        scene::{Lighting, Scene},
        style::{Style, Watercolour},
    };

    type Outcome = Result<(), Box<dyn std::error::Error>>;

    const SCENE: &str = "(
        terrain: Flat(size: 100),
        species: [
            (name: \"oak \\\"1\\\"\", plant: Grown(individuals: 2, triangles: 5000), lighting: Local),
            (name: \"ash\", plant: Grown(individuals: 1, triangles: 5000, seed: 9), lighting: Expressive(exponent: 2)),
        ],
        trees: Scattered(stems_per_hectare: 50),
        place: (latitude: 47.5, longitude: 9.2),
        quality: (cross_resolution: 64),
    )";

    /// A world that shows the scene, with an open panel.
    struct Flight {
        world: World,
        stage: Stage,
    }

    impl Flight {
        fn new(scene: &Scene) -> Result<Self, Box<dyn std::error::Error>> {
            let stage = Stage::build(scene, &mut Silent)?;
            let mut world = World::new();
            let registry = AppTypeRegistry::default();
            registry.write().register_derived_types();
            world.insert_resource(registry);
            world.insert_resource(SettingsPanel { open: true, ..SettingsPanel::new(&stage) });
            world.spawn((CanopyCamera, stage.style.clone()));
            world.spawn((Sun::default(), stage.shadow()));
            world.spawn(stage.ground());
            if let Some(forest) = stage.forest() {
                world.spawn(forest);
            }
            update(&mut world);
            Ok(Self { world, stage })
        }

        fn panel(&mut self) -> Mut<'_, SettingsPanel> {
            self.world.resource_mut()
        }

        fn press(&mut self, input: PanelInput) -> Option<String> {
            let text = self.panel().handle(input);
            update(&mut self.world);
            text
        }

        fn up(&mut self) {
            self.press(PanelInput::Value { up: true, fine: false });
        }

        /// Selects the field with a name.
        fn select(&mut self, label: &str) {
            let mut panel = self.panel();
            panel.line = panel.fields.iter().position(|field| field.label == label).expect(label);
        }

        /// Waits for all bakes; returns the plants that are shown in the end.
        fn settle(&mut self) -> Arc<Vec<BakedPlant>> {
            while self.panel().species.iter().any(SpeciesLight::is_busy) {
                update(&mut self.world);
                std::thread::yield_now();
            }
            self.world.query::<&Forest>().single(&self.world).expect("a forest").plants.clone()
        }
    }

    fn same_light(a: &[BakedPlant], b: &[BakedPlant]) -> bool {
        let same = |(a, b): (&BakedPlant, &BakedPlant)| {
            let same_cross = a.cross().zip(b.cross()).is_some_and(|(a, b)| Arc::ptr_eq(a, b));
            Arc::ptr_eq(&a.lighting, &b.lighting) && same_cross
        };
        a.len() == b.len() && a.iter().zip(b).all(same)
    }

    fn scene() -> Result<Scene, crate::scene::SceneError> {
        Scene::parse(SCENE, "light.ron".as_ref())
    }

    #[test]
    fn a_species_changes_alone_and_comes_back() -> Outcome {
        let mut flight = Flight::new(&scene()?)?;
        flight.up();
        let (lit, own) = (flight.settle(), flight.stage.plants.clone());
        assert!(same_light(&lit[2..], &own[2..]));
        for (lit, own) in lit.iter().zip(&own[..2]) {
            let (lit_cross, own_cross) = lit.cross().zip(own.cross()).ok_or("no crosses")?;
            assert!(lit.lighting.is_realigned() && lit_cross != own_cross);
            assert!(lit_cross.textures.color == own_cross.textures.color);
        }
        let state = flight.panel().species[0].state();
        assert!(state.starts_with("up to date; preview") && state.contains("billboards"), "{state}");
        assert_eq!(flight.panel().notes().as_deref(), Some("oak \"1\": Expressive()"));
        flight.press(PanelInput::Reset);
        assert!(same_light(&flight.settle(), &own) && flight.panel().notes().is_none());
        Ok(())
    }

    #[test]
    fn a_threshold_above_the_field_is_reported_and_keeps_the_leaves_normals() -> Outcome {
        let mut flight = Flight::new(&scene()?)?;
        flight.press(PanelInput::Section(true));
        assert!(same_light(&flight.settle(), &flight.stage.plants) && flight.panel().species[1].warnings().is_empty());
        update(&mut flight.world);
        flight.select("threshold");
        for _ in 0..60 {
            flight.up();
        }
        assert!(!flight.settle()[2].lighting.is_realigned());
        assert!(flight.panel().species[1].warnings().iter().any(|reason| reason.contains("threshold")));
        flight.press(PanelInput::Reset);
        assert!(flight.settle()[2].lighting.is_realigned() && flight.panel().species[1].warnings().is_empty());
        Ok(())
    }

    #[test]
    fn the_snippet_goes_into_a_scene_file() -> Outcome {
        let mut flight = Flight::new(&scene()?)?;
        flight.up();
        flight.select("generator share");
        flight.press(PanelInput::Value { up: false, fine: false });
        let written = flight.press(PanelInput::Write).ok_or("nothing written")?;
        assert_eq!(written, "// species \"oak \\\"1\\\"\"\nlighting: Expressive(share: 0.833),\n");
        let pasted = Scene::parse(&SCENE.replace("lighting: Local", &written), "pasted.ron".as_ref())?;
        let text = pasted.species[0].lighting.as_ref().map(Lighting::to_ron);
        assert_eq!(text, flight.panel().species[0].changed());
        Ok(())
    }

    #[test]
    fn a_style_that_was_turned_goes_into_a_scene_file() -> Outcome {
        let style = Style::Watercolour(Watercolour { palette: "sepia".to_owned(), ..Watercolour::default() });
        let mut flight = Flight::new(&Scene { trees: crate::scene::Trees::None, style, ..Scene::default() })?;
        let section = flight.panel().components.iter().position(|section| section.name == "CanopyStyle");
        flight.panel().section = section.ok_or("no section")?;
        update(&mut flight.world);
        flight.select("wetness");
        flight.up();
        flight.select("palette");
        flight.up();
        flight.select("paper");
        flight.up();
        let mut styles = flight.world.query::<&CanopyStyle>();
        let turned = styles.single(&flight.world)?.style.clone();
        assert_ne!(turned, flight.stage.style.style);
        assert_eq!((turned.palette(), turned.paper()), (Some("cool-to-warm"), Some("rough")));
        let written = flight.press(PanelInput::Write).ok_or("nothing written")?;
        let scene = Scene::parse(
            &format!("(terrain: Flat(size: 200), {written} trees: None, place: (latitude: 47.5, longitude: 9.2))"),
            "pasted.ron".as_ref(),
        )?;
        assert_eq!(scene.style, turned);
        Ok(())
    }

    #[test]
    fn components_of_camera_and_sun_are_sections_and_are_edited_where_they_are() -> Outcome {
        let mut flight = Flight::new(&Scene { trees: crate::scene::Trees::None, ..Scene::default() })?;
        let names: Vec<&str> = flight.panel().components.iter().map(|section| section.name).collect();
        for name in ["ViewOptions", "Sun", "SunShadowSettings", "SunRefresh"] {
            assert!(names.contains(&name), "{names:?}");
        }
        assert!(!names.contains(&"CanopyCamera"));
        let section = |name| names.iter().position(|other| *other == name);
        flight.panel().section = section("SunShadowSettings").ok_or("no section")?;
        update(&mut flight.world);
        flight.select("map size");
        assert_eq!(flight.press(PanelInput::Write), None);
        flight.up();
        let mut shadows = flight.world.query::<&SunShadowSettings>();
        assert_eq!(shadows.single(&flight.world)?.map_size, 4096);
        flight.press(PanelInput::Reset);
        assert_eq!(*shadows.single(&flight.world)?, flight.stage.shadow());
        flight.panel().section = section("ViewOptions").ok_or("no section")?;
        update(&mut flight.world);
        flight.world.clear_trackers();
        update(&mut flight.world);
        let mut view = flight.world.query_filtered::<&ViewOptions, bevy::ecs::query::Changed<ViewOptions>>();
        assert!(view.single(&flight.world).is_err(), "looking at a component does not change it");
        flight.up();
        assert!(view.single(&flight.world)?.tint_levels);
        // The flight has a clock of its own.
        flight.panel().section = section("Sun").ok_or("no section")?;
        update(&mut flight.world);
        let labels: Vec<String> = flight.panel().fields.iter().map(|field| field.label.clone()).collect();
        assert!(labels.contains(&"visibility".to_owned()) && !labels.contains(&"rate".to_owned()), "{labels:?}");
        Ok(())
    }
}
