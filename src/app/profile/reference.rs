//! The images that errors are counted from.

use std::path::{Path, PathBuf};

use image::ImageReader;

use super::{error::ProfileError, stages::Stages, views::ProfileView};
use crate::{
    app::{
        AppError, CompareError, Frame, RenderedImage, Renderer, adapter,
        reference::{Model, TraceJob, Truth},
    },
    assets::Stage,
    bake::BakedPlant,
    lod::level_distance::{NOMINAL_FIELD_OF_VIEW, NOMINAL_HEIGHT},
    measure::Picture,
    progress::Progress,
    scene::{QualityLevel, Scene},
};

/// The most triangles of a whole forest that the reference `full` draws in each frame, whatever their size.
const MOST_TRIANGLES: usize = 100_000_000;
/// Height in pixels of the smallest trees that it draws as full models in larger forests. Crosses of that size are as near to a
/// supersampled full model as full models with the usual samples are (docs/measurements/levels-of-detail.md).
const LEAST_PIXELS: f32 = 20.0;

/// What errors are counted from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ReferenceKind {
    /// Nothing: errors are not measured.
    None,
    /// The renderer itself with full models, supersampled: what levels of detail cost, not what is wrong with the light.
    Full {
        /// Samples along a pixel's side, on top of the four of MSAA.
        supersampling: u32,
    },
    /// The path tracer.
    Traced {
        /// Samples per pixel.
        samples: u32,
    },
    /// Images of a folder, `0000.png` and so on.
    Folder(PathBuf),
}

impl ReferenceKind {
    /// Its name in reports.
    pub fn name(&self) -> String {
        match self {
            Self::None => "none".to_owned(),
            Self::Full { .. } => "full".to_owned(),
            Self::Traced { .. } => "traced".to_owned(),
            Self::Folder(folder) => folder.display().to_string(),
        }
    }

    /// The folder in a report that has the images.
    pub fn folder_name(&self) -> String {
        match self {
            Self::Full { .. } | Self::Traced { .. } => format!("reference-{}", self.name()),
            Self::None | Self::Folder(_) => "reference".to_owned(),
        }
    }

    /// How it is made.
    pub fn details(&self) -> String {
        match self {
            Self::None => String::new(),
            Self::Full { supersampling } => format!(
                "full models at any distance (in a forest of more than {} million triangles: to where a tree of {NOMINAL_HEIGHT} m \
                 is {LEAST_PIXELS} pixels high), terrain error 0.25 pixels, {supersampling}x{supersampling} times 4 samples a \
                 pixel; the rest as the scene says",
                MOST_TRIANGLES / 1_000_000
            ),
            Self::Traced { samples } => format!("path tracer, {samples} samples a pixel"),
            Self::Folder(_) => "given images".to_owned(),
        }
    }
}

/// The reference of a view.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reference {
    /// Its image.
    pub file: PathBuf,
    /// The same from the first half of its samples, which tells how noisy it is.
    pub half: Option<PathBuf>,
}

impl Reference {
    fn whole(file: PathBuf) -> Option<Self> {
        Some(Self { file, half: None })
    }
}

/// The scene that `full` draws.
pub fn full_scene(scene: &Scene) -> Scene {
    let mut full = scene.clone();
    full.quality.levels = vec![QualityLevel { draw: "model".to_owned(), until: 0.0, fade: 20.0 }];
    full.quality.surface_size = 0.0;
    full.quality.msaa = 4;
    full.quality.terrain_error = 0.25;
    full
}

/// Triangles of all trees of `stage` as full models.
fn triangles(stage: &Stage) -> usize {
    let of_plant = |baked: &BakedPlant| baked.plant.parts.iter().map(|part| part.mesh.triangles.len()).sum();
    let plants: Vec<usize> = stage.plants.iter().map(of_plant).collect();
    stage.stand.trees.iter().filter_map(|tree| plants.get(usize::from(tree.variant()))).sum()
}

/// Full models of trees of at least [`LEAST_PIXELS`] in an image of `rows` rows, and crosses beyond.
fn largest_full(rows: u32) -> Vec<QualityLevel> {
    let focal_pixels = 0.5 * rows as f32 / (0.5 * NOMINAL_FIELD_OF_VIEW).tan();
    let until = NOMINAL_HEIGHT * focal_pixels / LEAST_PIXELS;
    let level = |draw: &str, until: f32| QualityLevel { draw: draw.to_owned(), until: until.into(), fade: 20.0 };
    vec![level("model", until), level("cross", 0.0)]
}

/// Makes the references of `views` in `folder`, or finds them there; returns the file of each view, none without a
/// reference.
///
/// # Errors
/// [`AppError`].
pub fn make(
    kind: &ReferenceKind,
    scene: &Scene,
    stages: &mut Stages,
    views: &[ProfileView],
    asked: &Asked,
    progress: &mut dyn Progress,
) -> Result<Vec<Option<Reference>>, AppError> {
    match kind {
        ReferenceKind::None => Ok(vec![None; views.len()]),
        ReferenceKind::Folder(given) => {
            Ok(given_files(given, views, asked.size)?.into_iter().map(Reference::whole).collect())
        }
        ReferenceKind::Full { supersampling } => draw_full(*supersampling, scene, stages, views, asked, progress),
        ReferenceKind::Traced { samples } => trace_all(*samples, scene, views, asked, progress),
    }
}

/// What all references need.
pub struct Asked<'a> {
    /// Where they are kept.
    pub folder: &'a Path,
    /// Width and height in pixels.
    pub size: (u32, u32),
    /// Part of the adapter's name.
    pub adapter: Option<&'a str>,
    /// What tells the scene with its files from others.
    pub fingerprint: &'a str,
}

/// The files of a given folder, one for each view, of `size` (width and height in pixels).
///
/// # Errors
/// [`ProfileError::Missing`], [`ProfileError::ReferenceSize`], [`CompareError::Read`].
pub fn given_files(given: &Path, views: &[ProfileView], size: (u32, u32)) -> Result<Vec<PathBuf>, AppError> {
    let file = |view: &ProfileView| {
        let candidates = ["png", "jpg"].map(|ending| given.join(format!("{}.{ending}", view.name)));
        candidates.into_iter().find(|file| file.is_file())
    };
    let missing: Vec<String> = views.iter().filter(|view| file(view).is_none()).map(|view| view.name.clone()).collect();
    if !missing.is_empty() {
        let (folder, total) = (given.to_owned(), views.len());
        return Err(ProfileError::Missing { folder, missing, total }.into());
    }
    let found: Vec<PathBuf> = views.iter().filter_map(file).collect();
    for path in &found {
        let failed = |why: String| CompareError::Read { path: path.clone(), why };
        let reader = ImageReader::open(path).and_then(ImageReader::with_guessed_format);
        let reader = reader.map_err(|error| failed(error.to_string()))?;
        let own = reader.into_dimensions().map_err(|error| failed(error.to_string()))?;
        if own != size {
            return Err(ProfileError::ReferenceSize { path: path.clone(), found: own, wanted: size }.into());
        }
    }
    Ok(found)
}

fn draw_full(
    supersampling: u32,
    scene: &Scene,
    stages: &mut Stages,
    views: &[ProfileView],
    asked: &Asked,
    progress: &mut dyn Progress,
) -> Result<Vec<Option<Reference>>, AppError> {
    let size = (asked.size.0.saturating_mul(supersampling), asked.size.1.saturating_mul(supersampling));
    let settings = adapter::settings(asked.adapter)?;
    adapter::check_size(&settings, size)?;
    let file = |view: &ProfileView| asked.folder.join(format!("{}.png", view.name));
    let notes = |view: &ProfileView| {
        vec![
            ("Software", format!("Canopy {}", env!("CARGO_PKG_VERSION"))),
            ("Reference", ReferenceKind::Full { supersampling }.details()),
            ("Fingerprint", format!("{} {:?} {}", asked.fingerprint, view.view, view.instant.to_rfc3339())),
        ]
    };
    let missing: Vec<&ProfileView> =
        views.iter().filter(|view| !RenderedImage::is_stored(&file(view), asked.size, &notes(view))).collect();
    if !missing.is_empty() {
        let mut full = full_scene(scene);
        let mut stage = stages.stage(&full, progress)?;
        if triangles(&stage) > MOST_TRIANGLES {
            full.quality.levels = largest_full(asked.size.1);
            stage = stages.stage(&full, progress)?;
        }
        progress.begin("Reference: full models", missing.len() as u64);
        let mut renderer = Renderer::new(size, asked.adapter, 4)?;
        renderer.replace(&stage);
        for view in missing {
            if progress.is_cancelled() {
                return Err(AppError::Interrupted(
                    "the reference was still being drawn; the same command goes on with it".to_owned(),
                ));
            }
            let image = renderer.draw(&stage, &view.view, view.instant)?;
            reduced(&image, supersampling)?.save(&file(view), &notes(view))?;
            progress.advance(1);
        }
        progress.end();
    }
    Ok(views.iter().map(|view| Reference::whole(file(view))).collect())
}

/// The means of `times`² pixels in linear light.
fn reduced(image: &RenderedImage, times: u32) -> Result<RenderedImage, AppError> {
    let failed = |why: String| AppError::Render(format!("the reference could not be reduced: {why}"));
    let picture = Picture::from_srgb8(image.width as usize, image.height as usize, &image.pixels);
    let picture = picture.map_err(|error| failed(error.to_string()))?;
    let small = picture.averaged(times as usize).ok_or_else(|| failed("it is too small".to_owned()))?;
    Ok(RenderedImage { width: small.width as u32, height: small.height as u32, pixels: small.to_srgb8() })
}

fn trace_all(
    samples: u32,
    scene: &Scene,
    views: &[ProfileView],
    asked: &Asked,
    progress: &mut dyn Progress,
) -> Result<Vec<Option<Reference>>, AppError> {
    let truth = Truth::build(scene, Model::whole(), progress)?;
    let mut files = Vec::with_capacity(views.len());
    for (number, view) in views.iter().enumerate() {
        progress.note(&format!("reference {} of {}: tracing {samples} samples a pixel", number + 1, views.len()));
        // An earlier trace of the same scene, light and camera is its cache.
        let mut trace = |name: String, samples: u32| {
            let frame = Frame { file: asked.folder.join(name), view: view.view, instant: view.instant };
            let whole = TraceJob { frame: &frame, size: asked.size, samples: 0..samples, total: samples, resume: true };
            truth.trace(&whole, progress).map(|()| frame.file)
        };
        let half = if samples > 1 { Some(trace(format!("{}-half.png", view.name), samples / 2)?) } else { None };
        let whole = format!("{}.png", view.name);
        if let Some(half) = &half {
            go_on_from(half, &asked.folder.join(&whole))?;
        }
        let file = trace(whole, samples)?;
        // Of an odd number of samples the first half is smaller, and tells nothing.
        files.push(Some(Reference { file, half: half.filter(|_| samples.is_multiple_of(2)) }));
    }
    Ok(files)
}

/// Lets the trace of `whole` begin with the samples of `half`, unless it has some of its own. If those are of another scene,
/// the trace finds out by itself.
fn go_on_from(half: &Path, whole: &Path) -> Result<(), AppError> {
    let [from, to] = [half, whole].map(|image| image.with_extension("checkpoint"));
    if from.exists() && !to.exists() {
        std::fs::copy(&from, &to).map_err(|source| AppError::Write { path: to.clone(), source })?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::Views;

    /// A size that did not fit was once found when the report in the folder had been overwritten.
    #[test]
    fn given_images_are_of_the_size_of_the_frames() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let file = folder.path().join("0000.png");
        image::RgbImage::new(64, 36).save(&file)?;
        let views = Views::Flight { frames: 1, fps: None, from: None, at: None }.of(&Scene::default(), &|_, _| 0.0)?;
        assert_eq!(given_files(folder.path(), &views, (64, 36))?, std::slice::from_ref(&file));
        let message = |size| given_files(folder.path(), &views, size).err().map(|error| error.to_string());
        assert!(message((32, 18)).is_some_and(|text| text.contains("0000.png has 64x36 pixels, not 32x18")));
        std::fs::write(&file, "no image")?;
        assert!(message((64, 36)).is_some_and(|text| text.contains("images are PNG, JPEG or OpenEXR files")));
        std::fs::remove_file(&file)?;
        assert!(message((64, 36)).is_some_and(|text| text.contains("lacks 1 of the 1 reference frames: 0000")));
        Ok(())
    }

    #[test]
    fn full_models_of_a_large_forest_end_where_trees_have_few_pixels() {
        let levels = largest_full(720);
        // A tree of 20 m, 20 pixels high: as many metres away as the focal length has pixels.
        assert!(
            (levels[0].until - 772.0).abs() < 1.0 && levels[0].draw == "model" && levels[1].draw == "cross",
            "{levels:?}"
        );
        assert!((2.0 * levels[0].until - largest_full(1440)[0].until).abs() < 1e-2);
    }
}
