//! Years and variants of an inventory side by side: one picture of several stages, from one camera and in one light.
//!
//! All panels have the same exposure, the mean of those that they would have alone, so that ground that is brighter after a
//! felling is brighter in the picture. A picture of a single panel is that of its stage: no caption, and its own exposure.
//!
//! Cost: ground and plants are built once and shared in memory. One renderer draws all panels; for each it brings the forest to the
//! device again, which holds one at a time.

mod choice;
mod sheet;

use std::{collections::HashSet, sync::Arc};

use chrono::{DateTime, Utc};

pub use self::choice::{BesideError, Choice};

use self::{choice::PanelChoice, sheet::Sheet};
use super::{AppError, Frame, RenderedImage, Renderer, fingerprint::fingerprint, interrupt, notes::notes};
use crate::{
    assets::Stage,
    components::Sun,
    light::{Atmosphere, AtmosphereParams, LightState},
    progress::Progress,
    render::exposure::{CameraExposure, StandTotals},
    scene::Scene,
};

/// The least and the greatest exposure that a sun can keep.
const EXPOSURES: (f64, f64) = (-10.0, 25.0);

/// The stages of a picture.
pub struct Panels {
    first: Stage,
    others: Vec<Stage>,
    size: (u32, u32),
    fingerprint: String,
    several: Option<Several>,
}

/// What several panels need beyond their stages.
struct Several {
    sheet: Sheet,
    captions: Vec<String>,
    totals: Vec<StandTotals>,
    air: Atmosphere,
    /// The light that was computed last.
    light: Option<(DateTime<Utc>, Arc<LightState>)>,
}

impl Panels {
    /// Builds `scene` once for each panel of `choice`, which is `size` pixels wide and high. The ground is built once, and so are
    /// the plants.
    ///
    /// # Errors
    /// [`BesideError::TooLarge`], [`AppError::Stage`], [`AppError::Interrupted`].
    pub fn build(
        scene: &Scene,
        choice: &Choice,
        size: (u32, u32),
        most_trees: Option<usize>,
        progress: &mut dyn Progress,
    ) -> Result<Self, AppError> {
        let count = choice.panels.len();
        let sheet = (count > 1).then(|| Sheet::new(size, count, choice.columns)).transpose()?;
        let captions: Vec<String> = choice.panels.iter().map(PanelChoice::caption).collect();
        let mut once = Once { inner: progress, said: HashSet::new() };
        let say = |caption: &String, progress: &mut Once| {
            if count > 1 {
                progress.note(&format!("panel {caption}:"));
            }
        };
        let mut panels = choice.panels.iter().map(|panel| panel.applied(scene)).zip(&captions);
        let first = match panels.next() {
            Some((scene, caption)) => {
                say(caption, &mut once);
                Stage::build_within(&scene, most_trees, &mut once)
            }
            None => Stage::build_within(scene, most_trees, &mut once),
        };
        let first = first.map_err(interrupt::building)?;
        let mut others = Vec::with_capacity(count.saturating_sub(1));
        for (scene, caption) in panels {
            say(caption, &mut once);
            others.push(first.build_beside(&scene, most_trees, &mut once).map_err(interrupt::building)?);
        }
        let stages = || std::iter::once(&first).chain(&others);
        let several = match sheet {
            None => None,
            Some(sheet) => Some(Several {
                sheet,
                captions,
                totals: stages().map(|stage| StandTotals::of(&stage.stand, &stage.plants)).collect(),
                air: air(&first)?,
                light: None,
            }),
        };
        // What sets the panels apart is in their captions.
        let fingerprint = fingerprint(&first.scene);
        Ok(Self { size, fingerprint, several, first, others })
    }

    /// The stage of the first panel. All have its ground, its place and its settings.
    pub fn first(&self) -> &Stage {
        &self.first
    }

    /// The stages of all panels.
    pub fn stages(&self) -> impl Iterator<Item = &Stage> {
        std::iter::once(&self.first).chain(&self.others)
    }

    /// Width and height of the pictures in pixels.
    pub fn size(&self) -> (u32, u32) {
        self.several.as_ref().map_or(self.size, |several| several.sheet.size())
    }

    /// The text of a picture. One of other settings, of other panels, or of a scene whose files have changed since has another.
    pub fn notes(&self, frame: &Frame) -> Vec<(&'static str, String)> {
        let mut notes = notes(&self.first, &frame.view, frame.instant);
        notes.extend(self.several.as_ref().map(|several| ("Panels", several.captions.join(" | "))));
        notes.push(("Fingerprint", self.fingerprint.clone()));
        notes
    }

    /// Draws a picture with `renderer`, which shows the first stage or one of the others. `explanation` gets the passes.
    ///
    /// # Errors
    /// [`AppError::Render`], [`AppError::Light`].
    pub fn draw(
        &mut self,
        renderer: &mut Renderer,
        frame: &Frame,
        explanation: &mut Vec<String>,
    ) -> Result<RenderedImage, AppError> {
        let Some(several) = &mut self.several else {
            let picture = renderer.draw(&self.first, &frame.view, frame.instant)?;
            explanation.extend(renderer.explain());
            return Ok(picture);
        };
        let stages = || std::iter::once(&self.first).chain(&self.others);
        let kept = several.exposure(stages(), frame)?;
        let mut pictures = Vec::with_capacity(several.captions.len());
        for (stage, caption) in stages().zip(&several.captions) {
            renderer.replace(stage);
            renderer.set_sun(Sun { fixed_ev100: Some(kept), ..stage.sun(frame.instant) });
            renderer.set_view(&frame.view);
            renderer.update()?;
            pictures.push((renderer.read()?, caption.as_str()));
            explanation.push(format!(" {caption}:"));
            explanation.extend(renderer.explain());
        }
        Ok(several.sheet.join(pictures.into_iter()))
    }
}

impl Several {
    /// The mean of the exposures (EV at ISO 100) that `stages` have in a frame. That of the first would show the others white
    /// where it stands in a wood that is felled in them.
    fn exposure<'a>(&mut self, stages: impl Iterator<Item = &'a Stage>, frame: &Frame) -> Result<f32, AppError> {
        let (mut sum, mut count) = (0.0, 0.0);
        for (stage, totals) in stages.zip(&self.totals) {
            let light = match &self.light {
                Some((of, light)) if *of == frame.instant => light.clone(),
                _ => Arc::new(stage.sun(frame.instant).light(&self.air)?),
            };
            self.light = Some((frame.instant, light.clone()));
            let there = CameraExposure::new(light, *totals).at(&stage.ground(), frame.view.position);
            (sum, count) = (sum + f64::from(there.ev100), count + 1.0);
        }
        let (least, greatest) = EXPOSURES;
        Ok((sum / count).clamp(least, greatest) as f32)
    }
}

fn air(stage: &Stage) -> Result<Atmosphere, AppError> {
    let visibility_km = stage.sun(stage.scene.place.time.utc()).visibility_km;
    Ok(Atmosphere::new(AtmosphereParams::with_visibility_km(visibility_km))?)
}

/// Says warnings once that several builds have in common.
struct Once<'a> {
    inner: &'a mut dyn Progress,
    said: HashSet<String>,
}

impl Progress for Once<'_> {
    fn begin(&mut self, what: &str, steps: u64) {
        self.inner.begin(what, steps);
    }

    fn advance(&mut self, steps: u64) {
        self.inner.advance(steps);
    }

    fn end(&mut self) {
        self.inner.end();
    }

    fn warn(&mut self, message: &str) {
        if self.said.insert(message.to_owned()) {
            self.inner.warn(message);
        }
    }

    fn note(&mut self, message: &str) {
        self.inner.note(message);
    }

    fn is_cancelled(&self) -> bool {
        self.inner.is_cancelled()
    }
}
