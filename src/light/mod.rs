//! Sun and moon positions, the light of the sky, and the camera exposure that suits it.
//!
//! ```text
//! instant, location -> SunPosition, Moon --.
//!                                           +-> LightState: sky texture, SH of the surroundings, key light,
//! AtmosphereParams -> Atmosphere ----------'               exposure, night sight, fog, moon and stars
//! ```
//!
//! [`Atmosphere`] is built once (a quarter of a second), [`LightState`] when the sun has moved (some 25 ms); a frame
//! only reads it. Nothing here knows of an App or a GPU. Units are lux and nits, colours linear Rec. 709, +X east, +Y
//! up, -Z north.

pub mod atmosphere;
mod error;
pub mod exposure;
mod hidden_sky;
pub mod moon;
pub mod night;
pub mod own_crown;
pub mod sh;
mod slope;
pub mod stand;
mod state;
pub mod sun;
mod surroundings;

pub use atmosphere::{Atmosphere, AtmosphereParams, SkyView};
pub use error::LightError;
pub(crate) use error::check_range;
pub use exposure::{ExposureSettings, ScotopicTint, exposure_from_ev100};
pub use hidden_sky::{HiddenLight, HiddenSky};
pub use moon::{Moon, MoonSetting};
pub use night::{NightSky, StarField};
pub use sh::Sh9Rgb;
pub use slope::slope_factor;
pub use stand::{StandLight, StandTrees};
pub use state::{FogParams, KeyLight, LightSettings, LightState, MoonDisc, NightTerms};
pub use sun::{Observer, SunPosition};
pub use surroundings::Surroundings;
