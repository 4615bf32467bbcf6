//! The file format of a baked plant. All numbers are little-endian.
//!
//! ```text
//!   offset  size  content
//!        0     8  magic "CANOPYBK"
//!        8     4  version
//!       12    32  key: hash of what it was made from
//!       44     8  length of the payload
//!       52    32  BLAKE3 of bytes 0..52 and the payload
//!       84        payload: lighting, shadow proxy, planes, textures, transmission, spread; lists go with their length (u32)
//! ```

use std::sync::Arc;

use glam::{Vec2, Vec3};

use crate::bake::BakedPlant;
use crate::bake::billboard::{Cross, CrossPlane, CrossTextures, SPREAD_LEVELS};
use crate::bake::implicit::NoSurface;
use crate::bake::lighting::{BakedLighting, ExpressiveLighting, TransferLighting};
use crate::bake::transfer::{
    Channels, Interior, PackedPart, PackedTransfer, Projection, TransferFormat, TransferSettings,
};
use crate::light::sh::MAX_BANDS;
use crate::plant::texture::MipChain;
use crate::plant::{Plant, PlantMesh};

/// Version of the format *and* of the bakes: to be raised whenever either gives other bytes for the same input.
pub(super) const VERSION: u32 = 10;

const MAGIC: [u8; 8] = *b"CANOPYBK";
const HEAD: usize = 52;
const PAYLOAD: usize = HEAD + 32;

/// What a file says of the lighting that it holds.
const LOCAL: u32 = 0;
const EXPRESSIVE: u32 = 1;
const TRANSFER: u32 = 2;

/// The file of a baked plant; the plant itself is not in it.
pub(super) fn encode(baked: &BakedPlant, key: &[u8; 32]) -> Vec<u8> {
    let mut out = Writer(Vec::new());
    out.lighting(&baked.lighting);
    out.list(&baked.shadow_proxy, |out, mesh| {
        out.list(&mesh.positions, |out, p| out.vector(*p));
        out.list(&mesh.normals, |out, n| out.vector(*n));
        out.list(&mesh.uvs, |out, uv| uv.to_array().into_iter().for_each(|value| out.float(value)));
        out.list(&mesh.triangles, |out, triangle| triangle.iter().for_each(|corner| out.count(*corner)));
    });
    out.list(&baked.cross.planes, |out, plane| {
        [plane.center, plane.u, plane.v, plane.normal].iter().for_each(|vector| out.vector(*vector));
    });
    let textures = &baked.cross.textures;
    for chains in [&textures.color, &textures.properties, &textures.light] {
        out.list(chains, |out, chain| {
            out.count(chain.width);
            out.count(chain.height);
            out.list(&chain.levels, |out, level| {
                out.count(level.len() as u32);
                out.0.extend_from_slice(level);
            });
        });
    }
    out.vector(baked.cross.transmission);
    baked.cross.spread.iter().for_each(|share| out.float(*share));

    let payload = out.0;
    let mut file = Vec::with_capacity(PAYLOAD + payload.len());
    file.extend_from_slice(&MAGIC);
    file.extend_from_slice(&VERSION.to_le_bytes());
    file.extend_from_slice(key);
    file.extend_from_slice(&(payload.len() as u64).to_le_bytes());
    let checksum = checksum(&file, &payload);
    file.extend_from_slice(&checksum);
    file.extend_from_slice(&payload);
    file
}

/// Reads a file that should hold `plant` baked under `key`. `None` where anything at all is not as it must be.
pub(super) fn decode(file: &[u8], key: &[u8; 32], plant: &Arc<Plant>) -> Option<BakedPlant> {
    let (head, rest) = file.split_at_checked(HEAD)?;
    let (sum, payload) = rest.split_at_checked(PAYLOAD - HEAD)?;
    let agrees = head[..8] == MAGIC
        && head[8..12] == VERSION.to_le_bytes()
        && head[12..44] == *key
        && head[44..] == (payload.len() as u64).to_le_bytes()
        && *sum == checksum(head, payload);
    if !agrees {
        return None;
    }
    let mut reader = Reader(payload);
    let lighting = reader.lighting()?;
    let shadow_proxy = reader.list(Reader::mesh)?;
    let planes = reader
        .list(|r| Some(CrossPlane { center: r.vector()?, u: r.vector()?, v: r.vector()?, normal: r.vector()? }))?;
    let textures = CrossTextures {
        color: reader.list(Reader::chain)?,
        properties: reader.list(Reader::chain)?,
        light: reader.list(Reader::chain)?,
    };
    let transmission = reader.vector()?;
    let mut spread = [0.0; SPREAD_LEVELS];
    for share in &mut spread {
        *share = reader.float().filter(|share| (0.0..=1.0).contains(share))?;
    }
    let fits = reader.0.is_empty()
        && lighting.fits(plant)
        && shadow_proxy.len() == plant.parts.len()
        && textures.color.len() == planes.len()
        && textures.properties.len() == planes.len()
        && textures.light.len() == if matches!(lighting, BakedLighting::Transfer(_)) { planes.len() } else { 0 };
    let cross = Arc::new(Cross { planes, textures, transmission, spread });
    let (lighting, shadow_proxy) = (Arc::new(lighting), Arc::new(shadow_proxy));
    fits.then(|| BakedPlant { plant: Arc::clone(plant), lighting, shadow_proxy, cross })
}

fn checksum(head: &[u8], payload: &[u8]) -> [u8; 32] {
    *blake3::Hasher::new().update(head).update(payload).finalize().as_bytes()
}

struct Writer(Vec<u8>);

impl Writer {
    fn count(&mut self, value: u32) {
        self.0.extend_from_slice(&value.to_le_bytes());
    }

    fn float(&mut self, value: f32) {
        self.0.extend_from_slice(&value.to_le_bytes());
    }

    fn lighting(&mut self, lighting: &BakedLighting) {
        match lighting {
            BakedLighting::Local => self.count(LOCAL),
            BakedLighting::Expressive(expressive) => {
                self.count(EXPRESSIVE);
                self.list(&expressive.normals, |out, normals| out.list(normals, |out, normal| out.vector(*normal)));
                self.list(&expressive.ambient, |out, values| out.list(values, |out, value| out.float(*value)));
                let (tag, first, second) = match expressive.no_surface {
                    None => (0, 0.0, 0.0),
                    Some(NoSurface::NoField) => (1, 0.0, 0.0),
                    Some(NoSurface::Threshold { threshold, greatest }) => (2, threshold, greatest),
                    Some(NoSurface::BelowResolution { cell }) => (3, cell, 0.0),
                };
                self.count(tag);
                self.float(first);
                self.float(second);
            }
            BakedLighting::Transfer(TransferLighting { packed, .. }) => {
                self.count(TRANSFER);
                let settings = &packed.settings;
                self.count(u32::from(settings.bands));
                self.count(settings.channels.count() as u32);
                self.count(settings.rays);
                self.count(match settings.projection {
                    Projection::Quadrature => 0,
                    Projection::Fit => 1,
                });
                let (kind, number) = match settings.interior {
                    Interior::Straight(leaves) => (0, leaves),
                    Interior::Diffuse(bounces) => (1, bounces),
                };
                self.count(kind);
                self.count(u32::from(number));
                self.list(&packed.parts, |out, part| {
                    out.count(part.sides as u32);
                    part.scale.iter().for_each(|scale| out.float(*scale));
                    out.count(part.bytes.len() as u32);
                    out.0.extend_from_slice(&part.bytes);
                    out.float(part.scattered_scale);
                    out.count(part.scattered.len() as u32);
                    out.0.extend_from_slice(&part.scattered);
                });
            }
        }
    }

    fn vector(&mut self, vector: Vec3) {
        vector.to_array().into_iter().for_each(|value| self.float(value));
    }

    fn list<T>(&mut self, items: &[T], mut write: impl FnMut(&mut Self, &T)) {
        self.count(items.len() as u32);
        items.iter().for_each(|item| write(self, item));
    }
}

struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn bytes(&mut self, count: usize) -> Option<&[u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    fn count(&mut self) -> Option<u32> {
        self.bytes(4)?.try_into().ok().map(u32::from_le_bytes)
    }

    /// A finite number.
    fn float(&mut self) -> Option<f32> {
        self.bytes(4)?.try_into().ok().map(f32::from_le_bytes).filter(|value| value.is_finite())
    }

    fn vector(&mut self) -> Option<Vec3> {
        Some(Vec3::new(self.float()?, self.float()?, self.float()?))
    }

    fn list<T>(&mut self, mut read: impl FnMut(&mut Self) -> Option<T>) -> Option<Vec<T>> {
        let count = self.count()? as usize;
        // An item takes four bytes at least, so a wrong length cannot ask for more memory than the file justifies.
        let mut items = Vec::with_capacity(count.min(self.0.len() / 4));
        for _ in 0..count {
            items.push(read(self)?);
        }
        Some(items)
    }

    fn lighting(&mut self) -> Option<BakedLighting> {
        match self.count()? {
            LOCAL => Some(BakedLighting::Local),
            EXPRESSIVE => {
                let normals = self.list(|r| r.list(Self::vector))?;
                let ambient = self.list(|r| r.list(|r| r.float().filter(|k| (0.0..=1.0).contains(k))))?;
                let (tag, first, second) = (self.count()?, self.float()?, self.float()?);
                let no_surface = match tag {
                    0 => None,
                    1 => Some(NoSurface::NoField),
                    2 => Some(NoSurface::Threshold { threshold: first, greatest: second }),
                    3 => Some(NoSurface::BelowResolution { cell: first }),
                    _ => return None,
                };
                Some(BakedLighting::Expressive(ExpressiveLighting { normals, ambient, no_surface }))
            }
            TRANSFER => self.transfer().map(|packed| BakedLighting::Transfer(TransferLighting::new(packed))),
            _ => None,
        }
    }

    fn transfer(&mut self) -> Option<PackedTransfer> {
        let settings = TransferSettings {
            bands: self.count()?.try_into().ok()?,
            channels: match self.count()? {
                1 => Channels::One,
                3 => Channels::Rgb,
                _ => return None,
            },
            rays: self.count()?,
            projection: match self.count()? {
                0 => Projection::Quadrature,
                1 => Projection::Fit,
                _ => return None,
            },
            interior: match (self.count()?, self.count()?.try_into().ok()?) {
                (0, leaves) => Interior::Straight(leaves),
                (1, bounces) => Interior::Diffuse(bounces),
                _ => return None,
            },
        };
        if settings != settings.in_range() {
            return None;
        }
        let format = TransferFormat::Snorm8;
        let parts = self.list(|r| {
            let sides = (r.count()? as usize).clamp(1, 2);
            let mut scale = [0.0; MAX_BANDS];
            for value in &mut scale {
                *value = r.float()?;
            }
            let length = r.count()? as usize;
            let bytes = r.bytes(length)?.to_vec();
            let scattered_scale = r.float()?;
            let length = r.count()? as usize;
            let scattered = r.bytes(length)?.to_vec();
            let vertex_bytes = format.vertex_bytes(&settings, sides);
            Some(PackedPart { sides, vertex_bytes, scale, bytes, scattered_scale, scattered })
        })?;
        Some(PackedTransfer { settings, format, parts })
    }

    fn mesh(&mut self) -> Option<PlantMesh> {
        let mesh = PlantMesh {
            positions: self.list(Self::vector)?,
            normals: self.list(Self::vector)?,
            uvs: self.list(|r| Some(Vec2::new(r.float()?, r.float()?)))?,
            triangles: self.list(|r| Some([r.count()?, r.count()?, r.count()?]))?,
        };
        let vertices = mesh.positions.len();
        let whole = mesh.normals.len() == vertices
            && mesh.uvs.len() == vertices
            && mesh.triangles.iter().flatten().all(|&corner| (corner as usize) < vertices);
        whole.then_some(mesh)
    }

    fn chain(&mut self) -> Option<MipChain> {
        let (width, height) = (self.count()?, self.count()?);
        let levels = self.list(|r| {
            let length = r.count()? as usize;
            r.bytes(length).map(<[u8]>::to_vec)
        })?;
        let chain = MipChain { width, height, levels };
        let whole = chain.levels.iter().enumerate().all(|(index, level)| {
            let (width, height) = chain.level_size(index);
            level.len() as u64 == u64::from(width) * u64::from(height) * 4
        });
        whole.then_some(chain)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{PartKind, PlantMaterial, PlantPart};

    fn small() -> BakedPlant {
        let mesh = PlantMesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            normals: vec![Vec3::Z; 3],
            uvs: vec![Vec2::ZERO, Vec2::X, Vec2::Y],
            triangles: vec![[0, 1, 2]],
        };
        let part = PlantPart { kind: PartKind::Foliage, mesh: mesh.clone(), material: PlantMaterial::default() };
        let chain = MipChain { width: 2, height: 2, levels: vec![(0..16).collect(), vec![1, 2, 3, 4]] };
        let plane = CrossPlane { center: Vec3::ONE, u: Vec3::X, v: Vec3::Y, normal: Vec3::Z };
        BakedPlant {
            plant: Arc::new(Plant { name: "small".into(), parts: vec![part] }),
            lighting: Arc::new(BakedLighting::Expressive(ExpressiveLighting {
                normals: vec![vec![Vec3::X, Vec3::Y, Vec3::Z]],
                ambient: vec![vec![0.0, 0.5, 1.0]],
                no_surface: Some(NoSurface::Threshold { threshold: 2.0, greatest: 1.5 }),
            })),
            shadow_proxy: Arc::new(vec![mesh]),
            cross: Arc::new(Cross {
                planes: vec![plane],
                textures: CrossTextures { color: vec![chain.clone()], properties: vec![chain], light: Vec::new() },
                transmission: Vec3::new(0.1, 0.2, 0.3),
                spread: [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 1.0],
            }),
        }
    }

    const KEY: [u8; 32] = [7; 32];

    #[test]
    fn what_is_written_is_read() {
        let baked = small();
        let read = decode(&encode(&baked, &KEY), &KEY, &baked.plant).unwrap();
        assert_eq!(read.lighting, baked.lighting);
        assert_eq!(read.shadow_proxy, baked.shadow_proxy);
        assert_eq!(read.cross, baked.cross);
    }

    #[test]
    fn a_file_cut_or_changed_at_any_byte_counts_as_absent() {
        let baked = small();
        let file = encode(&baked, &KEY);
        for length in 0..file.len() {
            assert!(decode(&file[..length], &KEY, &baked.plant).is_none(), "cut at {length}");
        }
        let mut longer = file.clone();
        longer.push(0);
        assert!(decode(&longer, &KEY, &baked.plant).is_none());
        for at in 0..file.len() {
            let mut changed = file.clone();
            changed[at] ^= 0x10;
            assert!(decode(&changed, &KEY, &baked.plant).is_none(), "changed at {at}");
        }
        assert!(decode(&file, &[8; 32], &baked.plant).is_none(), "another key");
    }

    /// A payload that was damaged before its checksum was made must not panic or ask for absurd memory either.
    #[test]
    fn a_broken_payload_with_a_good_checksum_is_survived() {
        let baked = small();
        let file = encode(&baked, &KEY);
        let sealed = |payload: &[u8]| {
            let mut head = file[..44].to_vec();
            head.extend((payload.len() as u64).to_le_bytes());
            let sum = checksum(&head, payload);
            [&head, &sum[..], payload].concat()
        };
        let payload = &file[PAYLOAD..];
        assert!(decode(&sealed(payload), &KEY, &baked.plant).is_some());
        for at in 0..payload.len() {
            assert!(decode(&sealed(&payload[..at]), &KEY, &baked.plant).is_none());
            let mut changed = payload.to_vec();
            changed[at] = 0xff;
            if let Some(read) = decode(&sealed(&changed), &KEY, &baked.plant) {
                assert!(read.lighting.ambient(0).iter().all(|k| k.is_finite()));
            }
        }
    }

    #[test]
    fn another_plants_file_does_not_fit() {
        let baked = small();
        let other = Arc::new(Plant::default());
        assert!(decode(&encode(&baked, &KEY), &KEY, &other).is_none());
    }
}
