//! Values of a request that replace those of a scene file.

use super::{Lighting, Scene, Trees};
use crate::{
    bake::lighting::implicit::ImplicitSettings,
    style::{LineNormals, Style},
};

/// Values that replace a scene's own. The default replaces nothing.
#[derive(Clone, Debug, Default, PartialEq, bevy::reflect::Reflect)]
pub struct Overrides {
    /// The seed.
    pub seed: Option<u64>,
    /// Samples per pixel, 1 or 4.
    pub msaa: Option<u32>,
    /// Exposure value at ISO 100 to keep, -10 to 25.
    pub exposure: Option<f64>,
    /// The year of inventories of repeated surveys.
    pub year: Option<i32>,
    /// The variant or scenario of inventories with several.
    pub variant: Option<String>,
    /// Refuses inventories with rows that cannot be used, where the scene would leave them out.
    pub strict: bool,
    /// The lighting of all species. A species that already has this kind of lighting keeps its own values, except for
    /// how the sun lights it.
    #[reflect(ignore)]
    pub lighting: Option<Lighting>,
    /// The style of the pictures. A scene that has this style already keeps its own values.
    pub style: Option<Style>,
    /// The palette of the style, if it has one.
    pub palette: Option<String>,
    /// The paper of the style, if it has one.
    pub paper: Option<String>,
}

impl Overrides {
    /// `scene` with the values replaced.
    pub fn applied(&self, mut scene: Scene) -> Scene {
        self.apply(&mut scene);
        scene
    }

    /// Replaces the values in `scene`.
    pub fn apply(&self, scene: &mut Scene) {
        scene.seed = self.seed.unwrap_or(scene.seed);
        scene.quality.msaa = self.msaa.unwrap_or(scene.quality.msaa);
        scene.camera.exposure = self.exposure.or(scene.camera.exposure);
        if let Trees::Inventory(inventory) = &mut scene.trees {
            inventory.strict |= self.strict;
            inventory.year = self.year.or(inventory.year);
            if let Some(variant) = &self.variant {
                inventory.variant = Some(variant.clone());
            }
        }
        self.restyle(scene);
        let Some(lighting) = &self.lighting else {
            if scene.style.is_drawn() {
                light_for_style(scene);
            }
            return;
        };
        for species in &mut scene.species {
            let kind = |lighting: &Lighting| std::mem::discriminant(lighting);
            match (&mut species.lighting, lighting) {
                (Some(Lighting::Transfer(own)), Lighting::Transfer(given)) => own.sun = given.sun,
                (Some(own), given) if kind(own) == kind(given) => {}
                (own, given) => *own = Some(given.clone()),
            }
        }
    }

    /// What a user should know of the values that change nothing in `scene`, to which they were applied.
    pub fn warnings(&self, scene: &Scene) -> Vec<String> {
        let style = &scene.style;
        let unused = |given: &Option<String>, has: bool, what: &str, styles: &str| {
            let name = style.name();
            let text = || format!("the {what} has no effect: `{name}` has none; choose the style {styles}");
            (given.is_some() && !has).then(text)
        };
        let palette = unused(&self.palette, style.palette().is_some(), "palette", "watercolour, lines or toon");
        let paper = unused(&self.paper, style.paper().is_some(), "paper", "watercolour or lines");
        palette.into_iter().chain(paper).collect()
    }

    /// Replaces the style.
    fn restyle(&self, scene: &mut Scene) {
        let kind = |style: &Style| std::mem::discriminant(style);
        if let Some(style) = self.style.as_ref().filter(|style| kind(style) != kind(&scene.style)) {
            scene.style = style.clone();
        }
        if let (Some(palette), Some(own)) = (&self.palette, scene.style.palette_mut()) {
            own.clone_from(palette);
        }
        if let (Some(paper), Some(own)) = (&self.paper, scene.style.paper_mut()) {
            own.clone_from(paper);
        }
    }
}

/// Gives foliage the normals of its implicit surface, in which the styles see it [Luft 2006, 4.1; Luft 2007, section 4], or its own
/// for lines that are to show those.
fn light_for_style(scene: &mut Scene) {
    let own = match &scene.style {
        Style::Lines(lines) => lines.normals == LineNormals::Own,
        Style::Toon(toon) => toon.normals == LineNormals::Own,
        Style::Photograph | Style::Watercolour(_) => false,
    };
    for species in &mut scene.species {
        species.lighting = Some(match species.lighting.take() {
            _ if own => Lighting::Local,
            Some(Lighting::Expressive(settings)) => Lighting::Expressive(settings),
            _ => Lighting::Expressive(ImplicitSettings::default()),
        });
    }
}
