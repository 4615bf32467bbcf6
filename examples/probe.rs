//! The path tracer's radiance of simple scenes, for programs in other languages that compare it with something else
//! (`scripts/independent`).
//!
//! ```sh
//! cargo run --release --example probe -- render < request.json > radiance.f32
//! ```
//!
//! A request is read from the standard input as JSON ([`Request`]), the answer is written to the standard output:
//!
//! | command | answer |
//! |---|---|
//! | `render` | radiance in nits: little-endian f32, seeds × height × width × RGB, rows from the top |
//! | `sky` | the sky of the request's `daylight` as an image of 2048 × 1025 RGB: row 0 is the zenith, the last one the nadir; azimuths clockwise from north, at the middle of each column |
//! | `light` | the same light's sun and fog as JSON |
//! | `heights` | heights in metres of the hills that `ground.hills` stands for: f64, 641 × 641 over 640 m around the origin, row 0 in the north |
//!
//! All angles are in degrees; +X is east, +Y up, −Z north.

use std::error::Error;
use std::f64::consts::{PI, TAU};
use std::io::{Write, stdin, stdout};
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;

use canopy::light::{Atmosphere, AtmosphereParams, LightSettings, LightState, SunPosition};
use canopy::plant::gltf::{GltfOptions, load_plant};
use canopy::plant::{Gloss, Plant};
use canopy::reference::{
    Camera, Disc, Film, Fog, Ground, GroundColor, GroundShape, Instance, LeafModel, Light, Normals, PathTracer,
    ReferenceScene, Shot, TraceSettings,
};
use canopy::scene::Viewpoint;
use canopy::terrain::{HeightField, Surroundings, Terrain};
use glam::{DVec2, DVec3, Vec3};
use serde::Deserialize;

type Outcome<T> = Result<T, Box<dyn Error>>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Request {
    plants: Vec<PlantFile>,
    trees: Vec<Tree>,
    ground: Option<GroundRequest>,
    /// Even light from all directions, nits.
    even: f32,
    /// A point sun alone.
    sun: Option<PointSun>,
    /// Canopy's own sky with the sun at an azimuth and an elevation.
    daylight: Option<[f64; 2]>,
    /// Whether fog lies between camera and scene; it needs `daylight`.
    fog: bool,
    camera: CameraRequest,
    /// Interpolated normals on wood.
    round_wood: bool,
    samples: u32,
    first_seed: u64,
    seeds: u64,
}

impl Default for Request {
    fn default() -> Self {
        Self {
            plants: Vec::new(),
            trees: Vec::new(),
            ground: None,
            even: 0.0,
            sun: None,
            daylight: None,
            fog: false,
            camera: CameraRequest::default(),
            round_wood: false,
            samples: 64,
            first_seed: 1,
            seeds: 1,
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PlantFile {
    file: PathBuf,
    /// Specular reflectance and roughness of the leaves.
    gloss: [f32; 2],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Tree {
    plant: usize,
    position: [f64; 3],
    yaw: f64,
    scale: f32,
    tint: f32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct GroundRequest {
    albedo: [f32; 3],
    /// Smooth hills instead of a level plane at 0.
    hills: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PointSun {
    azimuth: f64,
    elevation: f64,
    illuminance: f32,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraRequest {
    position: [f64; 3],
    /// Counter-clockwise seen from above; 0 looks north.
    yaw: f64,
    pitch: f64,
    /// Vertical.
    field_of_view: f64,
    width: u32,
    height: u32,
}

fn main() -> Outcome<()> {
    let command = std::env::args().nth(1).unwrap_or_default();
    let request: Request = serde_json::from_reader(stdin().lock())?;
    let answer = match command.as_str() {
        "render" => render(&request)?,
        "sky" => sky(&request)?,
        "light" => light_terms(&request)?,
        "heights" => heights()?,
        _ => return Err("the command is render, sky, light or heights".into()),
    };
    stdout().lock().write_all(&answer)?;
    Ok(())
}

fn render(request: &Request) -> Outcome<Vec<u8>> {
    let plants = request.plants.iter().map(plant).collect::<Outcome<Vec<_>>>()?;
    let instance = |tree: &Tree| Instance {
        plant: tree.plant,
        position: tree.position.into(),
        yaw: tree.yaw.to_radians() as f32,
        scale: tree.scale,
        tint: tree.tint,
    };
    let instances: Vec<Instance> = request.trees.iter().map(instance).collect();
    let scene = ReferenceScene::new(&plants, &instances, request.ground.as_ref().map(ground).transpose()?)?
        .with_leaves(LeafModel::Species);
    let light = light(request)?;
    let CameraRequest { position, yaw, pitch, field_of_view, width, height } = request.camera;
    let view = Viewpoint {
        position: position.into(),
        yaw: yaw.to_radians(),
        pitch: pitch.to_radians(),
        field_of_view: field_of_view.to_radians(),
    };
    let fog = if request.fog { Some(Fog::new(&daylight(request)?, position[1])) } else { None };
    let shot = Shot { camera: Camera { view, size: (width, height), near: 0.0 }, fog };
    let normals = if request.round_wood { Normals::RoundWood } else { Normals::Flat };
    let mut bytes = Vec::new();
    for seed in request.first_seed..request.first_seed + request.seeds {
        let tracer = PathTracer::new(&scene, &light, TraceSettings { seed, normals, ..TraceSettings::default() })?;
        let mut film = Film::new(&shot)?;
        tracer.render(&shot, &mut film, request.samples, &mut |_| ControlFlow::Continue(()))?;
        bytes.extend(film.radiance().iter().flat_map(|pixel| rgb(*pixel)));
    }
    Ok(bytes)
}

fn plant(request: &PlantFile) -> Outcome<Arc<Plant>> {
    let (mut plant, warnings) = load_plant(&request.file, &GltfOptions::default())?;
    for warning in warnings {
        eprintln!("{}: {warning}", request.file.display());
    }
    let [reflectance, roughness] = request.gloss;
    plant.set_leaf_gloss(Gloss { reflectance, roughness });
    Ok(Arc::new(plant))
}

fn ground(request: &GroundRequest) -> Outcome<Ground> {
    let shape = if request.hills { GroundShape::Terrain(Arc::new(hills()?)) } else { GroundShape::Plane(0.0) };
    // As far as the plane that it is compared with.
    Ok(Ground { shape, color: GroundColor::Even(request.albedo.into()), max_distance: 5e4 })
}

fn hills() -> Outcome<Terrain> {
    let height = |i: usize| {
        let (x, z) = ((i % 65) as f32, (i / 65) as f32);
        100.0 + 25.0 * (x * 0.31).sin() * (z * 0.23).cos() + 3.0 * (x * 1.3 + z).sin()
    };
    let field = HeightField::new(65, 65, DVec2::splat(10.0), (0..65 * 65).map(height).collect())?;
    Ok(Terrain::new(field, None, Surroundings::Mirror))
}

fn heights() -> Outcome<Vec<u8>> {
    const POINTS: usize = 641;
    let hills = hills()?;
    let at = |i: usize| (i as f64 / (POINTS - 1) as f64 - 0.5) * 640.0;
    Ok((0..POINTS * POINTS).flat_map(|i| hills.height(at(i % POINTS), at(i / POINTS)).to_le_bytes()).collect())
}

fn daylight(request: &Request) -> Outcome<LightState> {
    let [azimuth, elevation] = request.daylight.ok_or("the request has no daylight")?;
    let atmosphere = Atmosphere::new(AtmosphereParams::default())?;
    let sun = SunPosition::from_degrees(azimuth, elevation)?;
    Ok(LightState::new(&atmosphere, sun, None, &LightSettings::default())?)
}

fn light(request: &Request) -> Outcome<Light> {
    if let Some(PointSun { azimuth, elevation, illuminance }) = request.sun {
        let (a, e) = (azimuth.to_radians(), elevation.to_radians());
        let direction = DVec3::new(e.cos() * a.sin(), e.sin(), -e.cos() * a.cos()).normalize().as_vec3();
        let key = Disc { direction, illuminance: Vec3::splat(illuminance), angular_radius: 0.0 };
        return Ok(Light { key: Some(key), ..Light::even(Vec3::ZERO) });
    }
    if request.daylight.is_some() {
        // The sky alone; its sun is compared as a point sun.
        let light = Light::of(&daylight(request)?, None).without_key();
        return Ok(Light { visible: Vec::new(), ..light });
    }
    Ok(Light::even(Vec3::splat(request.even)))
}

fn sky(request: &Request) -> Outcome<Vec<u8>> {
    const WIDTH: u32 = 2048;
    let view = daylight(request)?.sky_view;
    let radiance = |i: u32| {
        let (column, row) = (f64::from(i % WIDTH), f64::from(i / WIDTH));
        let (polar, azimuth) = (PI * row / f64::from(WIDTH / 2), TAU * (column + 0.5) / f64::from(WIDTH));
        let (sine, cosine) = polar.sin_cos();
        view.sample(DVec3::new(sine * azimuth.sin(), cosine, -sine * azimuth.cos()).as_vec3())
    };
    Ok((0..WIDTH * (WIDTH / 2 + 1)).flat_map(|i| rgb(radiance(i))).collect())
}

fn light_terms(request: &Request) -> Outcome<Vec<u8>> {
    let state = daylight(request)?;
    let terms = serde_json::json!({
        "key_illuminance": state.key_illuminance.to_array(),
        "extinction": state.fog.extinction.to_array(),
        "scale_height": state.fog.scale_height_m,
        "sky_harmonics": state.sky_sh.map(|coefficient| coefficient.to_array()),
    });
    Ok(terms.to_string().into_bytes())
}

fn rgb(color: Vec3) -> impl Iterator<Item = u8> {
    color.to_array().into_iter().flat_map(f32::to_le_bytes)
}
