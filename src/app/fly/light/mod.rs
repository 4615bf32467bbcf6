//! The light panel: adjusts the lighting of the leaves during the flight. Its lines are the settings of the lighting by
//! an implicit surface, for one species of the scene at a time.
//!
//! `tuning` defines what can be adjusted; `baker` bakes in the background; `show` draws the panel. This file connects
//! them. An adjustment first bakes a preview, which changes the full models' vertices; then everything at full quality;
//! then the textures of the crossed billboards, which keep the old lighting until then. None of it goes into the cache
//! of bakes.

mod baker;
mod show;
mod tuning;

use std::sync::Arc;

use bevy::ecs::{
    resource::Resource,
    system::{Query, ResMut},
};

use super::controls::PanelInput;
use crate::{
    assets::{Stage, plants},
    bake::{
        BakedLevel, BakedPlant,
        levels::cross::CrossSettings,
        lighting::{
            LightingSettings,
            implicit::{ImplicitParameters, ImplicitSettings},
        },
    },
    render::components::Forest,
    scene::{Lighting, Transfer},
};
use baker::{BakeRequest, BakeResult, Baker, Content};
use tuning::{Line, Tuning};

pub use show::light_panel;

/// The state of the light panel.
#[derive(Resource)]
pub struct LightPanel {
    /// Whether the panel is shown and receives the arrow keys.
    pub open: bool,
    /// Index of the selected species.
    selected: usize,
    /// Index of the selected line among the current lines of the species.
    line: usize,
    species: Vec<SpeciesTuning>,
    /// The plants with the scene's own lighting.
    plants: Arc<Vec<BakedPlant>>,
    cross: CrossSettings,
    baker: Baker,
    /// Species that get their scene's lighting back.
    restored: Vec<usize>,
}

/// A species and the results of its bakes.
struct SpeciesTuning {
    name: String,
    /// Indices of its variants.
    variants: std::ops::Range<usize>,
    tuning: Tuning,
    /// Parameters of the last bake of its first individual.
    values: Option<ImplicitParameters>,
    /// Per individual: why it uses its leaves' own normals, if it does.
    no_surface: Vec<Option<String>>,
    /// Seconds from the key press to the upload of the preview, the full lighting and the crossed billboards of all
    /// individuals.
    times: [Option<f64>; 3],
}

impl LightPanel {
    /// A panel, closed, for the species of `stage`.
    pub fn new(stage: &Stage) -> Self {
        // The lighting of plants that are lit together with their neighbours cannot be baked per plant.
        let alone = stage.scene.species.iter().zip(&stage.variants).filter(|(species, _)| !species.is_lit_together());
        let species = alone.map(|(species, variants)| {
            let variants = usize::from(variants.start)..usize::from(variants.end);
            SpeciesTuning {
                name: species.name.clone(),
                tuning: Tuning::new(species.lighting.clone().unwrap_or(Lighting::Transfer(Transfer::default()))),
                values: None,
                no_surface: variants.clone().map(|variant| stage.plants.get(variant)?.lighting.warning()).collect(),
                times: [None; 3],
                variants,
            }
        });
        Self {
            open: false,
            selected: 0,
            line: 0,
            species: species.collect(),
            plants: stage.plants.clone(),
            cross: plants::bake_settings(&stage.scene.quality, LightingSettings::Local).cross,
            baker: Baker::default(),
            restored: Vec::new(),
        }
    }

    /// Opens or closes the panel; `false` if the scene has no species whose lighting can be adjusted.
    pub fn toggle(&mut self) -> bool {
        let something = !self.species.is_empty();
        self.open = !self.open && something;
        self.request_values();
        something
    }

    /// Handles a key press. Returns the text to print for the user, if any.
    pub fn handle(&mut self, input: PanelInput) -> Option<String> {
        let number = self.selected;
        let count = self.species.len();
        let species = self.species.get_mut(number)?;
        let lines = species.tuning.lines();
        let line = lines.get(self.line).copied().unwrap_or(Line::Light);
        let changed = match input {
            PanelInput::Line(down) => {
                let step = if down { 1 } else { lines.len() - 1 };
                self.line = (self.line + step) % lines.len();
                false
            }
            PanelInput::Species(forward) => {
                self.selected = (number + if forward { 1 } else { count - 1 }) % count;
                self.line = 0;
                self.request_values();
                false
            }
            PanelInput::Value { up, fine } => species.tuning.adjust(line, up, fine, species.values.as_ref()),
            PanelInput::Reset => species.tuning.reset(line),
            PanelInput::Write => return Some(snippet(&species.name, &species.tuning.lighting())),
        };
        if changed {
            self.apply(number);
        }
        None
    }

    /// The lighting of the species that differ from the scene, for an image's notes.
    pub fn notes(&self) -> Option<String> {
        let changed = self.species.iter().filter(|species| species.tuning.is_changed());
        let notes: Vec<_> =
            changed.map(|species| format!("{}: {}", species.name, species.tuning.lighting().to_ron())).collect();
        (!notes.is_empty()).then(|| notes.join("; "))
    }

    /// Requests bakes of the current lighting of a species.
    fn apply(&mut self, number: usize) {
        let Some(species) = self.species.get_mut(number) else { return };
        species.times = [None; 3];
        if species.tuning.is_changed() {
            self.request(number, Some(self.cross));
        } else {
            // The bakes of the scene's own lighting are still there.
            self.baker.cancel(number);
            self.restored.push(number);
            let own = self.plants.get(species.variants.clone()).unwrap_or_default();
            species.no_surface = own.iter().map(|plant| plant.lighting.warning()).collect();
            species.values = None;
            self.request_values();
        }
    }

    /// Requests the automatic values of the selected species, if the panel is open and they are not known yet.
    fn request_values(&mut self) {
        let unknown = self.species.get(self.selected).is_some_and(|species| species.values.is_none());
        // A running bake will return them.
        if self.open && unknown && self.baker.progress(self.selected).is_none() {
            self.request(self.selected, None);
        }
    }

    fn request(&mut self, number: usize, cross: Option<CrossSettings>) {
        let Some(species) = self.species.get(number) else { return };
        let Some(expressive) = species.tuning.expressive() else { return };
        let settings = ImplicitSettings { together: false, ..*expressive };
        let plants = self.plants.get(species.variants.clone()).unwrap_or_default();
        let plants = plants.iter().map(|plant| plant.plant.clone()).collect();
        self.baker.request(BakeRequest { species: number, plants, settings, cross });
    }

    /// `shown` with everything that was baked or restored since the last call; `None` if nothing was.
    fn take_bakes(&mut self, shown: &[BakedPlant]) -> Option<Vec<BakedPlant>> {
        let (restored, results) = (std::mem::take(&mut self.restored), self.baker.results());
        if restored.is_empty() && results.is_empty() {
            return None;
        }
        let mut plants = shown.to_vec();
        for species in restored.iter().filter_map(|number| self.species.get(*number)) {
            if let (Some(shown), Some(own)) =
                (plants.get_mut(species.variants.clone()), self.plants.get(species.variants.clone()))
            {
                shown.clone_from_slice(own);
            }
        }
        for BakeResult { species, individual, requested, content } in results {
            let Some(species) = self.species.get_mut(species) else { continue };
            let Some(plant) = plants.get_mut(species.variants.start + individual) else { continue };
            let stage = match content {
                Content::Values(values) => {
                    species.values = Some(values);
                    continue;
                }
                Content::Light { preview, lighting, values, no_surface } => {
                    plant.lighting = lighting;
                    species.values = if individual == 0 { Some(values) } else { species.values };
                    if let Some(slot) = species.no_surface.get_mut(individual) {
                        *slot = no_surface.map(|reason| reason.to_string());
                    }
                    if preview { 0 } else { 1 }
                }
                Content::Cross(cross) => {
                    plant.set_level(BakedLevel::Cross(cross));
                    2
                }
            };
            if individual + 1 == species.variants.len() {
                let seconds = requested.map(|requested| requested.elapsed().as_secs_f64());
                species.times[stage] = seconds.or(species.times[stage]);
            }
        }
        Some(plants)
    }
}

/// A species' lighting, ready to be pasted into its entry in a scene file.
fn snippet(name: &str, lighting: &Lighting) -> String {
    // A line break in a name must not end the comment.
    format!("// species {name:?}\nlighting: {},\n", lighting.to_ron())
}

/// Applies finished bakes to the forest.
pub fn apply_bakes(mut panel: ResMut<LightPanel>, mut forests: Query<&mut Forest>) {
    for mut forest in &mut forests {
        if let Some(plants) = panel.take_bakes(&forest.plants) {
            forest.plants = Arc::new(plants);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{progress::Silent, scene::Scene};

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

    fn stage() -> Result<Stage, Box<dyn std::error::Error>> {
        Ok(Stage::build(&Scene::parse(SCENE, "light.ron".as_ref())?, &mut Silent)?)
    }

    /// Waits for all requested bakes; returns the plants that are shown in the end.
    fn settle(panel: &mut LightPanel, mut shown: Vec<BakedPlant>) -> Vec<BakedPlant> {
        loop {
            panel.baker.wait();
            let busy = (0..panel.species.len()).any(|species| panel.baker.progress(species).is_some());
            if let Some(plants) = panel.take_bakes(&shown) {
                shown = plants;
            } else if !busy {
                return shown;
            }
        }
    }

    fn same_light(a: &[BakedPlant], b: &[BakedPlant]) -> bool {
        let same = |(a, b): (&BakedPlant, &BakedPlant)| {
            let same_cross = a.cross().zip(b.cross()).is_some_and(|(a, b)| Arc::ptr_eq(a, b));
            Arc::ptr_eq(&a.lighting, &b.lighting) && same_cross
        };
        a.iter().zip(b).all(same)
    }

    #[test]
    fn a_species_changes_alone_and_comes_back() -> Outcome {
        let stage = stage()?;
        let mut panel = LightPanel::new(&stage);
        assert!(panel.toggle());
        panel.handle(PanelInput::Value { up: true, fine: false });
        let lit = settle(&mut panel, stage.plants.to_vec());
        assert!(same_light(&lit[2..], &stage.plants[2..]));
        for (lit, own) in lit.iter().zip(&stage.plants[..2]) {
            let (lit_cross, own_cross) = lit.cross().zip(own.cross()).ok_or("no crosses")?;
            assert!(lit.lighting.is_realigned() && lit_cross != own_cross);
            assert!(lit_cross.textures.color == own_cross.textures.color);
        }
        assert!(panel.species[0].times.iter().all(Option::is_some) && panel.species[0].values.is_some());
        assert_eq!(panel.notes().as_deref(), Some("oak \"1\": Expressive()"));
        panel.handle(PanelInput::Reset);
        assert!(same_light(&settle(&mut panel, lit), &stage.plants) && panel.notes().is_none());
        Ok(())
    }

    #[test]
    fn a_threshold_above_the_field_is_reported_and_keeps_the_leaves_normals() -> Outcome {
        let stage = stage()?;
        let mut panel = LightPanel::new(&stage);
        panel.toggle();
        panel.handle(PanelInput::Species(true));
        let shown = settle(&mut panel, stage.plants.to_vec());
        assert!(
            same_light(&shown, &stage.plants) && panel.species[1].values.is_some_and(|values| values.exponent == 2.0)
        );
        panel.handle(PanelInput::Line(true));
        panel.handle(PanelInput::Line(true));
        for _ in 0..60 {
            panel.handle(PanelInput::Value { up: true, fine: false });
        }
        let shown = settle(&mut panel, shown);
        assert!(!shown[2].lighting.is_realigned());
        assert!(panel.species[1].no_surface[0].as_ref().is_some_and(|reason| reason.contains("threshold")));
        panel.handle(PanelInput::Reset);
        assert!(settle(&mut panel, shown)[2].lighting.is_realigned() && panel.species[1].no_surface[0].is_none());
        Ok(())
    }

    #[test]
    fn the_snippet_goes_into_a_scene_file() -> Outcome {
        let stage = stage()?;
        let mut panel = LightPanel::new(&stage);
        panel.toggle();
        panel.handle(PanelInput::Value { up: true, fine: false });
        panel.handle(PanelInput::Line(false));
        panel.handle(PanelInput::Value { up: false, fine: false });
        let written = panel.handle(PanelInput::Write).ok_or("nothing written")?;
        assert_eq!(written, "// species \"oak \\\"1\\\"\"\nlighting: Expressive(share: 0.833),\n");
        let scene = Scene::parse(&SCENE.replace("lighting: Local", &written), "pasted.ron".as_ref())?;
        assert_eq!(scene.species[0].lighting.as_ref(), Some(&panel.species[0].tuning.lighting()));
        Ok(())
    }

    #[test]
    fn a_scene_without_species_has_nothing_to_adjust() -> Outcome {
        let stage = Stage::build(&Scene::default(), &mut Silent)?;
        let mut panel = LightPanel::new(&stage);
        assert!(!panel.toggle() && !panel.open && panel.handle(PanelInput::Reset).is_none());
        Ok(())
    }
}
