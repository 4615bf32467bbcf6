//! Plants put together from meshes, one part for each material.

use std::f32::consts::TAU;
use std::sync::{Arc, OnceLock};

use glam::{Quat, Vec3};
use image::RgbaImage;

use super::blade::{BladeGrid, Pose};
use super::kinds;
use crate::math::compute_once;
use crate::plant::grow::textures::blade::{BladeStyle, BladeTextures, paint};
use crate::plant::grow::textures::masonry::Masonry;
use crate::plant::{Gloss, LeafTissue, Measured, PartKind, Plant, PlantMaterial, PlantMesh, PlantPart};

/// Kinds of leaves.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Blade {
    Single,
    Stamped(String),
    Rubber,
    Spider,
    Begonia,
    Fig,
}

/// What a part is made of.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Matter {
    Stone(Masonry),
    /// Stems and petioles: a plain linear colour.
    Stem(Vec3),
    /// Petals: a plain linear colour, through which light comes in the same colour.
    Petal(Vec3),
    Leaf(Blade),
}

/// Meshes by what they are made of.
#[derive(Debug, Default)]
pub(super) struct Assembly {
    parts: Vec<(Matter, PlantMesh)>,
}

impl Blade {
    fn style(&self) -> BladeStyle {
        match self {
            Self::Single => kinds::single_leaf(None),
            Self::Stamped(text) => kinds::single_leaf(Some(text)),
            Self::Rubber => kinds::rubber(),
            Self::Spider => kinds::spider(),
            Self::Begonia => kinds::begonia(),
            Self::Fig => kinds::fig(),
        }
    }

    /// The grid of a leaf of `columns` by `rows` cells.
    pub fn grid(&self, columns: usize, rows: usize) -> BladeGrid {
        BladeGrid::new(&self.style(), columns, rows)
    }

    /// The textures, painted once per process; those with letters each time.
    fn textures(&self) -> BladeTextures {
        static PAINTED: [OnceLock<BladeTextures>; 5] = [const { OnceLock::new() }; 5];
        let slot = match self {
            Self::Stamped(_) => return paint(&self.style()),
            Self::Single => 0,
            Self::Rubber => 1,
            Self::Spider => 2,
            Self::Begonia => 3,
            Self::Fig => 4,
        };
        compute_once(&PAINTED[slot], || paint(&self.style())).clone()
    }

    fn material(&self) -> PlantMaterial {
        let BladeTextures { front, normal, layers } = self.textures();
        let (max_thickness, gloss) = match self {
            Self::Rubber => (0.0007, Gloss { roughness: 0.24, ..Gloss::LEAF }),
            Self::Spider => (0.0004, Gloss { roughness: 0.32, ..Gloss::LEAF }),
            Self::Begonia => (0.0003, Gloss { roughness: 0.36, ..Gloss::LEAF }),
            Self::Fig => (0.0003, Gloss { roughness: 0.28, ..Gloss::LEAF }),
            Self::Single | Self::Stamped(_) => (0.0004, Gloss::LEAF),
        };
        // Letters are not in the colours, so the tissue has to darken them.
        let stamped = matches!(self, Self::Stamped(_));
        let absorption_range = if stamped { [300.0, 12_000.0] } else { LeafTissue::default().absorption_range };
        let measured = if stamped { Measured::Leaf } else { Measured::Texel };
        let through = layers.transmission.clone();
        let mut material = PlantMaterial {
            name: "leaf".into(),
            base_color_texture: Some(front),
            normal_texture: Some(normal),
            gloss,
            leaf_textures: layers,
            tissue: Some(LeafTissue { max_thickness, absorption_range, measured, ..LeafTissue::default() }),
            ..PlantMaterial::default()
        };
        if let Some(through) = through {
            material.set_transmission(through);
        }
        material
    }
}

impl Matter {
    fn part(self, mut mesh: PlantMesh) -> PlantPart {
        let (kind, material) = match &self {
            Self::Stone(stone) => {
                let repeats = 1.0 / stone.metres();
                mesh.uvs.iter_mut().for_each(|uv| *uv *= repeats);
                let material = PlantMaterial {
                    name: "stone".into(),
                    base_color_texture: Some(masonry(*stone)),
                    ..PlantMaterial::default()
                };
                (PartKind::Wood, material)
            }
            Self::Stem(color) => {
                let material = PlantMaterial { name: "stem".into(), base_color: *color, ..PlantMaterial::default() };
                (PartKind::Wood, material)
            }
            Self::Petal(color) => {
                let material = PlantMaterial {
                    name: "petal".into(),
                    base_color: *color,
                    transmission: Vec3::splat(0.7),
                    gloss: Gloss { reflectance: 0.02, roughness: 0.6 },
                    ..PlantMaterial::default()
                };
                (PartKind::Foliage, material)
            }
            Self::Leaf(blade) => (PartKind::Foliage, blade.material()),
        };
        PlantPart { kind, mesh, material }
    }
}

fn masonry(stone: Masonry) -> Arc<RgbaImage> {
    static PAINTED: [OnceLock<Arc<RgbaImage>>; 6] = [const { OnceLock::new() }; 6];
    let slot = Masonry::ALL.iter().position(|other| *other == stone).unwrap_or(0);
    compute_once(&PAINTED[slot], || Arc::new(stone.paint())).clone()
}

impl Assembly {
    /// The mesh of what is made of `matter`.
    pub fn mesh(&mut self, matter: &Matter) -> &mut PlantMesh {
        let at = match self.parts.iter().position(|(other, _)| other == matter) {
            Some(at) => at,
            None => {
                self.parts.push((matter.clone(), PlantMesh::default()));
                self.parts.len() - 1
            }
        };
        &mut self.parts[at].1
    }

    /// The mesh of what is made of `stone`.
    pub fn stone(&mut self, stone: Masonry) -> &mut PlantMesh {
        self.mesh(&Matter::Stone(stone))
    }

    /// Adds a leaf.
    pub fn leaf(&mut self, blade: &Blade, grid: &BladeGrid, pose: &Pose) {
        grid.add(self.mesh(&Matter::Leaf(blade.clone())), pose);
    }

    /// Adds another assembly, scaled, rotated by `yaw` about the vertical and moved.
    pub fn add(&mut self, other: &Self, position: Vec3, yaw: f32, scale: f32) {
        let turn = Quat::from_rotation_y(yaw % TAU);
        for (matter, from) in &other.parts {
            let to = self.mesh(matter);
            let first = to.positions.len() as u32;
            to.positions.extend(from.positions.iter().map(|&point| position + turn * (point * scale)));
            to.normals.extend(from.normals.iter().map(|&normal| (turn * normal).normalize_or(normal)));
            to.uvs.extend_from_slice(&from.uvs);
            to.triangles.extend(from.triangles.iter().map(|corners| corners.map(|corner| corner + first)));
        }
    }

    /// The plant. Opaque parts come first.
    pub fn finish(self, name: &str) -> Plant {
        let mut parts: Vec<PlantPart> = self.parts.into_iter().map(|(matter, mesh)| matter.part(mesh)).collect();
        parts.sort_by_key(|part| part.kind == PartKind::Foliage);
        Plant { name: name.to_owned(), parts }
    }
}
