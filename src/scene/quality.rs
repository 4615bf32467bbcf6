//! How finely a scene is drawn: each value trades run time and memory for error.

use serde::Deserialize;

use super::check::Check;

/// Drawing quality.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Quality {
    /// Edge of one shadow cascade's depth map in texels, a power of two from 256 to 8192. Higher: sharper shadows,
    /// memory and redraw time grow with the square. Default 2048.
    pub shadow_map_size: u32,
    /// Number of shadow cascades, 1 to 4. More: sharper near shadows, each costs a map. Default 4.
    pub cascades: u32,
    /// Distance in metres up to which the sun casts shadows, 10 to 20000. Higher: farther, coarser. Default 800.
    pub shadow_distance: f64,
    /// Distance in metres up to which trees are drawn as full models, 0 to 5000. Higher: truer, slower. Default 60.
    /// Beyond are crosses, which are lit with constants of their own, set by eye (bulge, shadow of the own crown, bias) and,
    /// with radiance transfer, the hot spot fitted to traced dense stands of oaks and of grown trees: the stands that
    /// `docs/measurements/near-trees-against-ground-truth.md` judges crosses by.
    pub near_distance: f64,
    /// Width in metres of the band behind `near_distance` in which models fade into crosses, 0.1 to 1000.
    /// Wider: softer change, more trees drawn twice. Default 20.
    pub fade_band: f64,
    /// Samples per pixel, 1 or 4. 4: smooth leaf edges, slower. Default 4.
    pub msaa: u32,
    /// Edge of a cross plane's picture in texels, 64 to 1024, rounded up to a power of two. Higher: sharper far trees, memory.
    /// Default 256.
    pub cross_resolution: u32,
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
            near_distance: 60.0,
            fade_band: 20.0,
            msaa: 4,
            cross_resolution: 256,
            view_distance: 20_000.0,
            terrain_error: 1.0,
        }
    }
}

impl Quality {
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
        check.number("quality.near_distance", self.near_distance, 0.0..=5_000.0, "m");
        check.number("quality.fade_band", self.fade_band, 0.1..=1_000.0, "m");
        if self.msaa != 1 && self.msaa != 4 {
            check.problem("quality.msaa", format!("is {}", self.msaa), "write 1 (off) or 4");
        }
        check.count("quality.cross_resolution", self.cross_resolution, 64..=1024);
        check.number("quality.view_distance", self.view_distance, 100.0..=200_000.0, "m");
        check.number("quality.terrain_error", self.terrain_error, 0.25..=32.0, "pixels");
    }
}
