//! The field that both sides draw: trees, ground, light, and the way of the camera.

use std::{ops::Range, path::Path, sync::Arc};

use canopy::{
    bake::{BakeSettings, BakedPlant, bake_plant, cache::Cache},
    components::Sun,
    light::{
        LightState,
        atmosphere::{Atmosphere, AtmosphereParams},
    },
    plant::{
        gltf::{GltfOptions, load_plant},
        grow::{GrowParameters, grow},
    },
    scatter::{
        Area, CoverMap, PackedStand, PlacementRules, PlantSize, Sequence, SizeRule, SpeciesRule, cover_map,
        packed::DEFAULT_CELL_SIZE, place_trees,
    },
    scene::Viewpoint,
    terrain::{HeightField, Surroundings, Terrain},
};
use chrono::{DateTime, NaiveTime, TimeDelta, Utc};
use glam::{DVec2, DVec3};

/// Trees a hectare: 28,200 on a square kilometre.
const STEMS_PER_HECTARE: f64 = 282.0;
/// Height in metres of a tree that comes from a file.
const TREE_HEIGHT: f32 = 18.0;
/// Triangles of the tree that is grown where no file is given: as many as oak-medium has.
const GROWN_TRIANGLES: usize = 13_806;
/// Metres of the camera above the crowns of trees of scale 1.
const ABOVE_CROWNS: f64 = 10.0;
/// Metres that the camera moves in a frame: 180 km/h at 60 frames a second would be 0.8; here frames are slower.
const STEP: f64 = 3.0;
/// Minutes that the sun moves in a frame where it moves: every cascade's rounded direction steps.
const MINUTES_A_FRAME: i64 = 5;
/// 2026-06-21 08:30 UTC, at 48° N 11° E: the sun stands in the south-east, 47° high.
const MORNING: i64 = 1_782_030_600;
/// Metres around the camera to which the ground reaches on both sides.
pub const GROUND_REACH: f64 = 4000.0;

/// How both sides draw it.
#[derive(Clone, Copy, Debug)]
pub struct Look {
    /// Image size in pixels.
    pub size: (u32, u32),
    /// Metres on the ground plane to which trees are full models; infinite: all are, and cast as such.
    pub near: f32,
    /// Width of the fade in metres.
    pub band: f32,
    /// Number of cascades, 0 for no shadow.
    pub cascades: usize,
    /// Metres that the shadow reaches.
    pub shadow_distance: f64,
    /// Texels along a side of a map.
    pub shadow_size: u32,
    /// Whether the ground is drawn.
    pub ground: bool,
    /// Whether trees are drawn.
    pub trees: bool,
    /// Samples per pixel of our side.
    pub samples: u32,
    /// Whether our crosses are shaded once a pixel, after their depth.
    pub depth_first: bool,
}

impl Default for Look {
    /// That of the benchmark `peer` where its arguments say nothing else, on our side alone.
    fn default() -> Self {
        Self {
            size: (640, 360),
            near: 30.0,
            band: 10.0,
            cascades: 4,
            shadow_distance: 800.0,
            shadow_size: 2048,
            ground: true,
            trees: true,
            samples: 1,
            depth_first: true,
        }
    }
}

impl Look {
    /// The same with every tree as its full model.
    pub fn full(self) -> Self {
        Self { near: f32::INFINITY, ..self }
    }

    /// Whether every tree is its full model.
    pub fn is_full(&self) -> bool {
        self.near.is_infinite()
    }
}

/// What both sides draw.
pub struct Field {
    /// The tree.
    pub plant: Arc<BakedPlant>,
    /// Where trees stand; both sides take place, yaw and scale from here, so that rounding is the same.
    pub stand: Arc<PackedStand>,
    /// Share of ground under crowns.
    pub cover: Arc<CoverMap>,
    /// Level ground.
    pub terrain: Arc<Terrain>,
    /// How it is drawn.
    pub look: Look,
    side: f64,
    atmosphere: Atmosphere,
}

/// The tree at `path`, or the usual ones.
pub fn plant(path: Option<&Path>) -> anyhow::Result<Arc<BakedPlant>> {
    let usual = std::env::var_os("CANOPY_DATA").map(|folder| Path::new(&folder).join("trees/oak-medium.glb"));
    let path = path.map(Path::to_owned).or(usual.filter(|file| file.is_file()));
    let plant = match path {
        Some(path) => load_plant(&path, &GltfOptions { height: Some(TREE_HEIGHT), ..GltfOptions::default() })?.0,
        None => grow(&GrowParameters::broadleaf(), 1, GROWN_TRIANGLES)?,
    };
    let (baked, _) = bake_plant(Arc::new(plant), &BakeSettings::default(), Cache::of_user().as_ref());
    Ok(Arc::new(baked))
}

impl Field {
    /// A square field with `trees` trees on Halton points.
    pub fn new(plant: &Arc<BakedPlant>, trees: u32, look: Look) -> anyhow::Result<Self> {
        let hectares = f64::from(trees) / STEMS_PER_HECTARE;
        let side = 100.0 * hectares.sqrt();
        let field = HeightField::new(2, 2, DVec2::splat(side), vec![0.0; 4])?;
        let terrain = Terrain::new(field, None, Surroundings::Mirror);
        let rules = PlacementRules {
            stems_per_hectare: STEMS_PER_HECTARE,
            sequence: Sequence::Halton,
            seed: 1,
            min_distance_m: 0.0,
            slope_limit: 1.5,
            height_range_m: None,
            area: Area::centered(DVec2::ZERO, DVec2::splat(side)),
            clearings: None,
            species: vec![SpeciesRule { size: SizeRule::Scale { min: 0.8, max: 1.2 }, ..SpeciesRule::default() }],
        };
        let mut stand = place_trees(&rules, &terrain)?.stand;
        for tree in &mut stand.trees {
            // Stock materials have no tint of their own a tree.
            tree.tint = 0.0;
        }
        let size = plant.plant.bounds().map_or(glam::Vec3::ONE, |bounds| bounds.size());
        let bounds = plant.size();
        let stand = PackedStand::new(&stand, DEFAULT_CELL_SIZE, &[bounds])?;
        let crown = PlantSize { radius: 0.8 * 0.5 * size.x.max(size.z), ..bounds };
        let cover = cover_map(&stand, &[crown], 8.0, None)?;
        Ok(Self {
            plant: plant.clone(),
            stand: Arc::new(stand),
            cover: Arc::new(cover),
            terrain: Arc::new(terrain),
            look,
            side,
            atmosphere: Atmosphere::new(AtmosphereParams::with_visibility_km(Sun::default().visibility_km))?,
        })
    }

    /// The same field with every tree as its full model.
    pub fn full(&self) -> anyhow::Result<Self> {
        Self::new(&self.plant, self.stand.trees.len() as u32, self.look.full())
    }

    /// The band in which full models give way to crosses, metres from the camera to a tree's foot in space: the
    /// camera's height is everywhere the same.
    pub fn band_in_space(&self) -> Range<f32> {
        let slant = |distance: f32| distance.hypot(self.camera_height() as f32);
        slant(self.look.near)..slant(self.look.near + self.look.band)
    }

    /// Metres of the camera above the ground.
    pub fn camera_height(&self) -> f64 {
        f64::from(self.plant.plant.height()) + ABOVE_CROWNS
    }

    /// The camera in frame `frame`: from the middle of the southern edge northwards over the field, swaying.
    pub fn view(&self, frame: usize) -> Viewpoint {
        let frame = frame as f64;
        Viewpoint {
            position: DVec3::new(0.0, self.camera_height(), 0.42 * self.side - STEP * frame),
            yaw: 0.2 * (0.25 * frame).sin(),
            pitch: -0.2,
            field_of_view: 50f64.to_radians(),
        }
    }

    /// Place, air and time of frame `frame`.
    pub fn sky(&self, frame: usize, moving: bool) -> Sun {
        let morning = DateTime::<Utc>::from_timestamp(MORNING, 0).unwrap_or_default();
        let minutes = if moving { MINUTES_A_FRAME * (frame as i64 + 1) } else { 0 };
        Sun { instant: morning + TimeDelta::minutes(minutes), ..Sun::default() }
    }

    /// Place, air and time `hours` after midnight UTC of the same day.
    pub fn sky_at(&self, hours: f64) -> Sun {
        let morning = DateTime::<Utc>::from_timestamp(MORNING, 0).unwrap_or_default();
        let midnight = morning.date_naive().and_time(NaiveTime::MIN).and_utc();
        Sun { instant: midnight + TimeDelta::seconds((3600.0 * hours) as i64), ..Sun::default() }
    }

    /// The light of a time, which ours computes itself and stock is given.
    pub fn light(&self, sky: &Sun) -> anyhow::Result<LightState> {
        Ok(sky.light(&self.atmosphere)?)
    }
}
