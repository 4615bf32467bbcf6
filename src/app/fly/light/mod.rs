//! The light of the leaves, turned while looking: a panel whose lines are the values of an implicit surface's light, for one
//! species of the scene at a time.
//!
//! `tuning` says what can be turned; `baker` bakes beside the flight; `show` draws the panel. Here is what holds them together.
//! A turn bakes a preview first, which changes the full models' vertices; then everything in full; then the pictures of the
//! crosses, which until then keep the light they had. Nothing of it goes into the cache of bakes.

mod baker;
mod show;
mod tuning;

use std::sync::Arc;

use bevy::ecs::{
    resource::Resource,
    system::{Query, ResMut},
};

use super::{controls::Turn, session::Session};
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
use baker::{Baker, Content, News, Order};
use tuning::{Line, Tuning};

pub use show::light_panel;

/// What is turned, and what is shown of it.
#[derive(Resource)]
pub struct LightPanel {
    /// Whether the panel is shown and has the arrow keys.
    pub open: bool,
    /// Number of the species that is turned.
    chosen: usize,
    /// Number of the line that is turned, among those that its species has now.
    line: usize,
    species: Vec<Turned>,
    /// The plants in the scene's own light.
    plants: Arc<Vec<BakedPlant>>,
    cross: CrossSettings,
    baker: Baker,
    /// Species that are to be shown in their scene's light again.
    restored: Vec<usize>,
}

/// A species and what became of it.
struct Turned {
    name: String,
    /// First and last but one of its variants.
    variants: std::ops::Range<usize>,
    tuning: Tuning,
    /// What the last bake of its first individual went by.
    values: Option<ImplicitParameters>,
    /// Why an individual has its leaves' own normals.
    no_surface: Vec<Option<String>>,
    /// Seconds from the key to the frame that uploads its preview, light in full and crosses, each of all individuals.
    times: [Option<f64>; 3],
}

impl LightPanel {
    /// A panel, closed, for the species of `stage`.
    pub fn new(stage: &Stage) -> Self {
        // What is lit together with its neighbours is no plant's own light.
        let alone = stage.scene.species.iter().zip(&stage.variants).filter(|(species, _)| !species.is_lit_together());
        let species = alone.map(|(species, variants)| {
            let variants = usize::from(variants.start)..usize::from(variants.end);
            Turned {
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
            chosen: 0,
            line: 0,
            species: species.collect(),
            plants: stage.plants.clone(),
            cross: plants::bake_settings(&stage.scene.quality, LightingSettings::Local).cross,
            baker: Baker::default(),
            restored: Vec::new(),
        }
    }

    /// Opens or closes the panel; `false` where the scene has no species that can be turned.
    pub fn toggle(&mut self) -> bool {
        let something = !self.species.is_empty();
        self.open = !self.open && something;
        self.ask_for_values();
        something
    }

    /// Does what a key asks for; a text is what to write for the user.
    pub fn turn(&mut self, turn: Turn) -> Option<String> {
        let number = self.chosen;
        let count = self.species.len();
        let species = self.species.get_mut(number)?;
        let lines = species.tuning.lines();
        let line = lines.get(self.line).copied().unwrap_or(Line::Light);
        let changed = match turn {
            Turn::Line(down) => {
                let step = if down { 1 } else { lines.len() - 1 };
                self.line = (self.line + step) % lines.len();
                false
            }
            Turn::Species(forward) => {
                self.chosen = (number + if forward { 1 } else { count - 1 }) % count;
                self.line = 0;
                self.ask_for_values();
                false
            }
            Turn::Value { up, fine } => species.tuning.turn(line, up, fine, species.values.as_ref()),
            Turn::Reset => species.tuning.reset(line),
            Turn::Write => return Some(snippet(&species.name, &species.tuning.lighting())),
        };
        if changed {
            self.apply(number);
        }
        None
    }

    /// The light of the species that are not in their scene's own, for a picture's notes.
    pub fn notes(&self) -> Option<String> {
        let turned = self.species.iter().filter(|species| species.tuning.is_turned());
        let notes: Vec<_> =
            turned.map(|species| format!("{}: {}", species.name, species.tuning.lighting().to_ron())).collect();
        (!notes.is_empty()).then(|| notes.join("; "))
    }

    /// Orders the light that a species has now.
    fn apply(&mut self, number: usize) {
        let Some(species) = self.species.get_mut(number) else { return };
        species.times = [None; 3];
        if species.tuning.is_turned() {
            self.order(number, Some(self.cross));
        } else {
            // The scene's own light is still there.
            self.baker.cancel(number);
            self.restored.push(number);
            let own = self.plants.get(species.variants.clone()).unwrap_or_default();
            species.no_surface = own.iter().map(|plant| plant.lighting.warning()).collect();
            species.values = None;
            self.ask_for_values();
        }
    }

    /// Orders what an open panel does not know yet of the chosen species.
    fn ask_for_values(&mut self) {
        let unknown = self.species.get(self.chosen).is_some_and(|species| species.values.is_none());
        // A bake that is under way will tell.
        if self.open && unknown && self.baker.progress(self.chosen).is_none() {
            self.order(self.chosen, None);
        }
    }

    fn order(&mut self, number: usize, cross: Option<CrossSettings>) {
        let Some(species) = self.species.get(number) else { return };
        let Some(expressive) = species.tuning.expressive() else { return };
        let settings = ImplicitSettings { together: false, ..*expressive };
        let plants = self.plants.get(species.variants.clone()).unwrap_or_default();
        let plants = plants.iter().map(|plant| plant.plant.clone()).collect();
        self.baker.order(Order { species: number, plants, settings, cross });
    }

    /// `shown` with everything that was baked or taken back since the last call; `None` where nothing was.
    fn follow(&mut self, shown: &[BakedPlant]) -> Option<Vec<BakedPlant>> {
        let (restored, news) = (std::mem::take(&mut self.restored), self.baker.news());
        if restored.is_empty() && news.is_empty() {
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
        for News { species, individual, ordered, content } in news {
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
                    if let Some(told) = species.no_surface.get_mut(individual) {
                        *told = no_surface.map(|reason| reason.to_string());
                    }
                    if preview { 0 } else { 1 }
                }
                Content::Cross(cross) => {
                    plant.set_level(BakedLevel::Cross(cross));
                    2
                }
            };
            if individual + 1 == species.variants.len() {
                let seconds = ordered.map(|ordered| ordered.elapsed().as_secs_f64());
                species.times[stage] = seconds.or(species.times[stage]);
            }
        }
        Some(plants)
    }
}

/// A species' light, ready to be pasted into its entry of a scene file.
fn snippet(name: &str, lighting: &Lighting) -> String {
    // A line break in a name must not end the comment.
    format!("// species {name:?}\nlighting: {},\n", lighting.to_ron())
}

/// Brings the forest in step with what was baked.
pub fn follow_light(mut panel: ResMut<LightPanel>, mut session: ResMut<Session>, mut forests: Query<&mut Forest>) {
    let Some(plants) = panel.follow(&session.stage.plants) else { return };
    let plants = Arc::new(plants);
    for mut forest in &mut forests {
        forest.plants = plants.clone();
    }
    session.stage.plants = plants;
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

    /// Lets everything be baked that was ordered; the plants that are shown in the end.
    fn settle(panel: &mut LightPanel, mut shown: Vec<BakedPlant>) -> Vec<BakedPlant> {
        loop {
            panel.baker.wait();
            let busy = (0..panel.species.len()).any(|species| panel.baker.progress(species).is_some());
            if let Some(plants) = panel.follow(&shown) {
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
        panel.turn(Turn::Value { up: true, fine: false });
        let lit = settle(&mut panel, stage.plants.to_vec());
        assert!(same_light(&lit[2..], &stage.plants[2..]));
        for (lit, own) in lit.iter().zip(&stage.plants[..2]) {
            let (lit_cross, own_cross) = lit.cross().zip(own.cross()).ok_or("no crosses")?;
            assert!(lit.lighting.is_realigned() && lit_cross != own_cross);
            assert!(lit_cross.textures.color == own_cross.textures.color);
        }
        assert!(panel.species[0].times.iter().all(Option::is_some) && panel.species[0].values.is_some());
        assert_eq!(panel.notes().as_deref(), Some("oak \"1\": Expressive()"));
        panel.turn(Turn::Reset);
        assert!(same_light(&settle(&mut panel, lit), &stage.plants) && panel.notes().is_none());
        Ok(())
    }

    #[test]
    fn a_threshold_above_the_field_is_told_and_keeps_the_leaves_normals() -> Outcome {
        let stage = stage()?;
        let mut panel = LightPanel::new(&stage);
        panel.toggle();
        panel.turn(Turn::Species(true));
        let shown = settle(&mut panel, stage.plants.to_vec());
        assert!(
            same_light(&shown, &stage.plants) && panel.species[1].values.is_some_and(|values| values.exponent == 2.0)
        );
        panel.turn(Turn::Line(true));
        panel.turn(Turn::Line(true));
        for _ in 0..60 {
            panel.turn(Turn::Value { up: true, fine: false });
        }
        let shown = settle(&mut panel, shown);
        assert!(!shown[2].lighting.is_realigned());
        assert!(panel.species[1].no_surface[0].as_ref().is_some_and(|told| told.contains("threshold")));
        panel.turn(Turn::Reset);
        assert!(settle(&mut panel, shown)[2].lighting.is_realigned() && panel.species[1].no_surface[0].is_none());
        Ok(())
    }

    #[test]
    fn the_snippet_goes_into_a_scene_file() -> Outcome {
        let stage = stage()?;
        let mut panel = LightPanel::new(&stage);
        panel.toggle();
        panel.turn(Turn::Value { up: true, fine: false });
        panel.turn(Turn::Line(false));
        panel.turn(Turn::Value { up: false, fine: false });
        let written = panel.turn(Turn::Write).ok_or("nothing written")?;
        assert_eq!(written, "// species \"oak \\\"1\\\"\"\nlighting: Expressive(share: 0.833),\n");
        let scene = Scene::parse(&SCENE.replace("lighting: Local", &written), "pasted.ron".as_ref())?;
        assert_eq!(scene.species[0].lighting.as_ref(), Some(&panel.species[0].tuning.lighting()));
        Ok(())
    }

    #[test]
    fn a_scene_without_species_has_nothing_to_turn() -> Outcome {
        let stage = Stage::build(&Scene::default(), &mut Silent)?;
        let mut panel = LightPanel::new(&stage);
        assert!(!panel.toggle() && !panel.open && panel.turn(Turn::Reset).is_none());
        Ok(())
    }
}
