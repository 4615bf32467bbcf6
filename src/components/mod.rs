//! What a Bevy program spawns, beside the [renderer's own components](crate::render::components): scenes, the sun, the origin.

mod daylight;
mod origin;
mod scene;
mod sets;
mod sun;

pub use daylight::FollowsDaylight;
pub use origin::{FloatingOrigin, OriginPlugin};
pub use scene::{CanopyScene, LoadedScene, SceneFailed, ScenePlugin, SceneProgress, SceneReady, SceneState, Shown};
pub use sets::CanopySystems;
pub use sun::{DrawnSun, Sun, SunError, SunPlugin, SunRefresh};
