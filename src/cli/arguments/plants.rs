//! Plants and their leaves: `canopy bake` and `leaf`.

use std::path::PathBuf;

use canopy::app::{LeafKind, parse_leaf_kind, parse_positive};
use clap::Args;

/// Arguments of `canopy bake`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  canopy bake oak.glb --out oak-levels.png
  canopy bake oak.glb --out oak-200.png --planes 200 --lighting local
  canopy bake my-valley.ron           bakes all plants of a scene, so that later calls find them in the cache
The sheet shows each level from four sides and from above, and its triangles, memory, deviation and error.")]
pub struct Bake {
    /// The plant (.glb, .gltf), or a scene (.ron), whose plants are baked into the cache.
    pub plant: PathBuf,
    /// PNG file to write; required for a plant, none for a scene.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Planes of the billboard cloud, 1 to 1000. More are nearer to the plant, and slower.
    #[arg(long, value_name = "NUMBER", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub planes: u32,
}

/// Arguments of `canopy leaf`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  canopy leaf oak-leaf.png --out oak-leaf                  derives back, transmission, thickness, absorption and bump
  canopy leaf front.png --back back.png --transmission through.png --out leaf
  canopy leaf ficus.glb --material leaf --out ficus-leaf --kind leathery
The folder gets the six textures (PNG), leaf.gltf, a plant of one leaf that uses them, and sheet.png.")]
pub struct Leaf {
    /// Image of the front, with the outline in its alpha (.png, .jpg, .webp), or a plant (.glb, .gltf).
    pub file: PathBuf,
    /// Folder to write to.
    #[arg(long, value_name = "FOLDER")]
    pub out: PathBuf,
    /// Material of a plant whose leaf is meant [default: the first of foliage].
    #[arg(long, value_name = "NAME")]
    pub material: Option<String>,
    /// Image of the back [default: the plant's, or guessed from the front].
    #[arg(long, value_name = "FILE")]
    pub back: Option<PathBuf>,
    /// Image of the light that comes through, such as a scan with a transparency unit [default: the plant's, or derived from the
    /// front].
    #[arg(long, value_name = "FILE")]
    pub transmission: Option<PathBuf>,
    /// Image of the thickness, white is thickest [default: the plant's, or derived from the transmission].
    #[arg(long, value_name = "FILE")]
    pub thickness: Option<PathBuf>,
    /// Image of the absorption, white absorbs most [default: the plant's, or derived from the transmission].
    #[arg(long, value_name = "FILE")]
    pub absorption: Option<PathBuf>,
    /// Tangent-space normal map, OpenGL convention [default: the plant's, or derived from the front].
    #[arg(long, value_name = "FILE")]
    pub bump: Option<PathBuf>,
    /// Kind of leaf, which decides how much light comes through where nothing else does: thin, young, leathery, needle, dead,
    /// autumn-yellow, autumn-red.
    #[arg(long, value_name = "KIND", default_value = "thin", value_parser = parse_leaf_kind)]
    pub kind: LeafKind,
    /// Greatest thickness in millimetres [default: the plant's, or 0.3].
    #[arg(long, value_name = "MM", value_parser = parse_positive)]
    pub max_thickness: Option<f64>,
    /// Width of the leaf in metres.
    #[arg(long, value_name = "M", default_value_t = 0.1, value_parser = parse_positive)]
    pub width: f64,
    /// Take slow changes out of the thickness: standard deviation of the blur as a fraction of the texture's longer side.
    #[arg(long, value_name = "FRACTION", value_parser = parse_positive)]
    pub high_pass: Option<f64>,
    /// Derive the absorption as the thesis prints it: bright absorbs.
    #[arg(long)]
    pub published: bool,
    /// Samples per pixel of the sheet.
    #[arg(long, value_name = "NUMBER", default_value_t = 32, value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub spp: u32,
}
