//! How finely a scene is drawn: each value trades run time and memory for error.

use bevy::reflect::Reflect;
use serde::Deserialize;

use super::check::Check;
use crate::bake::levels::{cross::MOST_UPRIGHTS, texture::Compression};
use crate::lod::{FadeBand, Levels, MAX_LEVELS, Representation};

/// The representations that a scene file can name.
const REPRESENTATIONS: [Representation; 5] = [
    Representation::MODEL,
    Representation::THINNED,
    Representation::SURFACE,
    Representation::CLOUD,
    Representation::CROSS,
];

/// One level of detail in a scene file: `(draw: "model", until: 60, fade: 20)`.
#[derive(Clone, Debug, PartialEq, Deserialize, Reflect)]
#[serde(deny_unknown_fields)]
pub struct QualityLevel {
    /// Name of the representation: `"model"`, `"thinned"`, `"surface"`, `"cloud"` or `"cross"`.
    pub draw: String,
    /// Distance in metres at which it begins to give way to the next level, 0 to 200000. Without effect in the last
    /// level.
    #[serde(default)]
    pub until: f64,
    /// Width in metres of the band over which it does, 0.1 to 1000. Default 20.
    #[serde(default = "default_fade")]
    pub fade: f64,
}

fn default_fade() -> f64 {
    20.0
}

/// Drawing quality: the few values that a user trades against run time.
///
/// The passes' own settings ([`Levels`], [`SunShadowSettings`](crate::render::components::SunShadowSettings), ...)
/// belong to different entities and have further values, which follow from these or are constants.
#[derive(Clone, Debug, PartialEq, Deserialize, Reflect)]
#[serde(deny_unknown_fields, default)]
pub struct Quality {
    /// Edge of one shadow cascade's depth map in texels, a power of two from 256 to 8192. Higher: sharper shadows,
    /// memory and redraw time grow with the square. Default 2048.
    pub shadow_map_size: u32,
    /// Number of shadow cascades, 1 to 4. More: sharper near shadows, each costs a map. Default 4.
    pub cascades: u32,
    /// Distance in metres up to which the sun casts shadows, 10 to 20000. Higher: farther, coarser. Default 800.
    pub shadow_distance: f64,
    /// Half width in metres of the soft edge of shadows on the ground, 0 to 20. Higher: softer. Default 0: an edge of three texels of
    /// the map.
    pub shadow_softness: f64,
    /// Distance in metres up to which trees 20 m high are drawn as full models, 0 to 5000. Higher: truer, slower.
    /// Default 60. Beyond are crosses. It counts for a field of view of 50°; others change at the same size in the
    /// picture ([`level_distance`](crate::lod::level_distance)).
    pub near_distance: f64,
    /// Instead of `near_distance`, 0 to 1000: how much more error crosses may have than full models, in any size of image
    /// ([`error_curve`](crate::lod::error_curve)). 0: none; 0.19: about as `near_distance: 80` at 1080 rows. Lower: truer,
    /// slower. Default: not used.
    pub tolerance: Option<f64>,
    /// Width in metres of the band behind `near_distance` in which models fade into crosses, 0.1 to 1000.
    /// Wider: softer change, more trees drawn twice. Default 20.
    pub fade_band: f64,
    /// Height in pixels below which trees are no longer drawn one by one: the ground shows them together, as the surface of the
    /// forest, 0 to 50. Higher: faster in forests of millions, coarser far away. 0: each tree is drawn, however small. In a style, pixels
    /// count that are as coarse as its Gaussian is wide. Default 2.
    pub surface_size: f64,
    /// The levels of detail from near to far, at most 8. Default: empty, which is `"model"` until `near_distance` and
    /// `"cross"` behind it; a list replaces both values.
    pub levels: Vec<QualityLevel>,
    /// Samples per pixel, 1 or 4. 4: smooth leaf edges, slower. Default 4.
    pub msaa: u32,
    /// Edge of a cross plane's texture in texels, 64 to 1024, rounded up to a power of two. Higher: sharper far trees,
    /// memory. Default 256.
    pub cross_resolution: u32,
    /// Upright planes of a cross, 1 to 8, each of which shows the tree from another side. More: outlines as the models have them,
    /// more memory, as many triangles. Default 4; fewer where a scene has so many plants that their textures have too many layers.
    pub cross_planes: u32,
    /// Which devices get block-compressed textures of crosses and clouds, which take a quarter to a third of the memory at a small
    /// error: `Never`, `WherePossible`, or `Automatic`, all that read such blocks but software drivers, which are slower with them.
    /// Default `Automatic`.
    pub texture_compression: Compression,
    /// Distance in metres beyond which no tree is drawn, 100 to 200000. Default 20000.
    pub view_distance: f64,
    /// Greatest error of the drawn terrain in pixels, 0.25 to 32. Lower: more triangles. Default 1.
    pub terrain_error: f64,
}

impl Default for Quality {
    fn default() -> Self {
        Self {
            shadow_map_size: 2048,
            cascades: 4,
            shadow_distance: 800.0,
            shadow_softness: 0.0,
            near_distance: 60.0,
            tolerance: None,
            fade_band: 20.0,
            surface_size: 2.0,
            levels: Vec::new(),
            msaa: 4,
            cross_resolution: 256,
            cross_planes: 4,
            texture_compression: Compression::Automatic,
            view_distance: 20_000.0,
            terrain_error: 1.0,
        }
    }
}

impl Quality {
    /// The levels of detail that it asks for. Names that no scene file can have are left out.
    pub fn lod_levels(&self) -> Levels {
        let band = |level: &QualityLevel| FadeBand::new(level.until as f32, level.fade as f32);
        let known = self.levels.iter().filter_map(|level| {
            let representation = REPRESENTATIONS.into_iter().find(|known| known.name() == level.draw)?;
            Some((representation, band(level)))
        });
        let mut levels: Option<(Levels, FadeBand)> = None;
        for (representation, fade) in known {
            levels = Some(match levels {
                None => (Levels::only(representation), fade),
                Some((nearer, before)) => (nearer.then(before, representation), fade),
            });
        }
        let levels = levels.map_or_else(
            || match self.tolerance {
                Some(tolerance) => Levels::by_error(tolerance as f32),
                None => Levels::model_and_cross(FadeBand::new(self.near_distance as f32, self.fade_band as f32)),
            },
            |(levels, _)| levels,
        );
        levels.to_size(self.surface_size as f32)
    }

    /// Distance in metres at which the nearest level is gone.
    pub fn nearest_level_end(&self) -> f64 {
        self.lod_levels().fade_out(0).map_or(self.view_distance, |fade| fade.end.into())
    }

    pub(super) fn check(&self, check: &mut Check) {
        if !self.shadow_map_size.is_power_of_two() || !(256..=8192).contains(&self.shadow_map_size) {
            check.problem(
                "quality.shadow_map_size",
                format!("is {}", self.shadow_map_size),
                "write 256, 512, 1024, 2048, 4096 or 8192",
            );
        }
        check.count("quality.cascades", self.cascades, 1..=4);
        check.number("quality.shadow_distance", self.shadow_distance, 10.0..=20_000.0, "m");
        check.number("quality.shadow_softness", self.shadow_softness, 0.0..=20.0, "m");
        check.number("quality.near_distance", self.near_distance, 0.0..=5_000.0, "m");
        check.number("quality.tolerance", self.tolerance.unwrap_or_default(), 0.0..=1_000.0, "");
        check.number("quality.fade_band", self.fade_band, 0.1..=1_000.0, "m");
        check.number("quality.surface_size", self.surface_size, 0.0..=50.0, "pixels");
        if self.levels.len() > MAX_LEVELS {
            let count = self.levels.len();
            check.problem("quality.levels", format!("has {count} levels"), format!("keep {MAX_LEVELS} at most"));
        }
        let mut nearer = 0.0;
        for (index, level) in self.levels.iter().enumerate() {
            let place = |field: &str| format!("quality.levels[{index}].{field}");
            if !REPRESENTATIONS.iter().any(|known| known.name() == level.draw) {
                let [others @ .., last] = REPRESENTATIONS.map(|known| format!("\"{}\"", known.name()));
                let names = format!("{} or {last}", others.join(", "));
                check.problem(&place("draw"), format!("is \"{}\"", level.draw), format!("write {names}"));
            }
            if index + 1 == self.levels.len() {
                break;
            }
            check.number(&place("until"), level.until, 0.0..=200_000.0, "m");
            check.number(&place("fade"), level.fade, 0.1..=1_000.0, "m");
            if level.until < nearer {
                check.problem(
                    &place("until"),
                    format!("is {} m, where the level before it ends at {nearer} m", level.until),
                    "list the levels from near to far, and leave each room for its fade",
                );
            }
            nearer = level.until + level.fade;
        }
        if self.msaa != 1 && self.msaa != 4 {
            check.problem("quality.msaa", format!("is {}", self.msaa), "write 1 (off) or 4");
        }
        check.count("quality.cross_resolution", self.cross_resolution, 64..=1024);
        check.count("quality.cross_planes", self.cross_planes, 1..=MOST_UPRIGHTS);
        check.number("quality.view_distance", self.view_distance, 100.0..=200_000.0, "m");
        check.number("quality.terrain_error", self.terrain_error, 0.25..=32.0, "pixels");
    }
}
