//! Files that are written, joined and described: `canopy export`, `merge` and `info`.

use std::path::PathBuf;

use canopy::app::parse_positive;
use clap::Args;

/// Arguments of `canopy export`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  canopy export my-valley.ron --out valley.glb
  canopy export my-valley.ron --out middle.glb --within 250 --nodes
Each plant is one mesh. Its trees are instances (EXT_mesh_gpu_instancing), which Blender 3.6 and newer, three.js and others read, or with
--nodes a node each. +X is east, -Z north; heights are metres above the datum of the terrain.")]
pub struct Export {
    /// Scene file.
    pub scene: PathBuf,
    /// Binary glTF file to write (.glb).
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Write a node for each tree, for programs that do not know instances; at most 200000 trees.
    #[arg(long)]
    pub nodes: bool,
    /// Leave out the ground.
    #[arg(long)]
    pub no_ground: bool,
    /// Only what lies within this many metres of the centre, to the east, north, west and south.
    #[arg(long, value_name = "M", value_parser = parse_positive)]
    pub within: Option<f64>,
}

/// Arguments of `canopy merge`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  canopy merge part-1.film part-2.film part-3.film part-4.film --out truth.exr
  canopy merge machine-1 machine-2 --out truth            folders with films of a sequence; those of one name are one image
The parts are those of `canopy reference --part`. The image is that of one trace with all samples.")]
pub struct Merge {
    /// Films, or folders of films.
    #[arg(required = true)]
    pub parts: Vec<PathBuf>,
    /// Image to write: .exr for radiance in nits, .png as the renderer shows it, .film to merge it further; for folders a folder.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Write the images of folders as OpenEXR instead of PNG.
    #[arg(long)]
    pub exr: bool,
    /// Accept that samples are missing at the end.
    #[arg(long)]
    pub incomplete: bool,
}

/// Arguments of `canopy info`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  canopy info oak.glb
  canopy info assets/scenes/demo.ron")]
pub struct Info {
    /// A plant (.glb, .gltf), a terrain (.tif, .asc, .hgt, .png), an inventory (.csv) or a scene (.ron).
    pub file: PathBuf,
}
