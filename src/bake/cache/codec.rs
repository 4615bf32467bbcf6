//! The file format of a baked plant or texture: a head of fixed size and a payload. That of a plant has its lighting and
//! levels as `serde` and `postcard` write them, that of a texture the bytes of its mip levels (`texture.rs`). All numbers
//! of the head are little-endian.
//!
//! ```text
//!   offset  size  content
//!        0     8  magic "CANOPYBK"
//!        8     4  version
//!       12    32  key: hash of what it was made from
//!       44     8  length of the payload
//!       52    32  BLAKE3 of bytes 0..52 and the payload
//!       84        payload
//! ```
//!
//! A new level of detail is a new variant of [`BakedLevel`], at the end.

use std::borrow::Cow;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::CacheKey;
use crate::bake::baked::BakedPlant;
use crate::bake::levels::{BAKED, BakedLevel};
use crate::bake::lighting::BakedLighting;
use crate::plant::Plant;

/// Version of the format *and* of the bakes: to be raised whenever either gives other bytes for the same input, as a new version of
/// the crate `dds` may.
pub(super) const VERSION: u32 = 22;

const MAGIC: [u8; 8] = *b"CANOPYBK";
const HEAD: usize = 52;
const PAYLOAD: usize = HEAD + 32;

/// What is kept of a baked plant; borrowed to be written, owned when read.
#[derive(Serialize, Deserialize)]
struct Payload<'a> {
    lighting: Cow<'a, BakedLighting>,
    levels: Cow<'a, [BakedLevel]>,
}

/// The file of a baked plant; the plant itself is not in it. `None` where the payload cannot be written as bytes.
pub(super) fn encode(baked: &BakedPlant, key: &[u8; 32]) -> Option<Vec<u8>> {
    let payload = Payload { lighting: Cow::Borrowed(&baked.lighting), levels: Cow::Borrowed(&baked.levels) };
    postcard::to_stdvec(&payload).ok().map(|payload| sealed(&payload, key))
}

/// The file with this payload.
pub(super) fn sealed(payload: &[u8], key: &[u8; 32]) -> Vec<u8> {
    let mut file = Vec::with_capacity(PAYLOAD + payload.len());
    file.extend_from_slice(&MAGIC);
    file.extend_from_slice(&VERSION.to_le_bytes());
    file.extend_from_slice(key);
    file.extend_from_slice(&(payload.len() as u64).to_le_bytes());
    let checksum = checksum(&file, payload);
    file.extend_from_slice(&checksum);
    file.extend_from_slice(payload);
    file
}

/// The payload of a file that should have been sealed under `key`. `None` if anything is wrong with it.
pub(super) fn opened<'a>(file: &'a [u8], key: &[u8; 32]) -> Option<&'a [u8]> {
    let (head, rest) = file.split_at_checked(HEAD)?;
    let (sum, payload) = rest.split_at_checked(PAYLOAD - HEAD)?;
    let agrees = head[..8] == MAGIC
        && head[8..12] == VERSION.to_le_bytes()
        && head[12..44] == *key
        && head[44..] == (payload.len() as u64).to_le_bytes()
        && *sum == checksum(head, payload);
    agrees.then_some(payload)
}

/// Reads a file that should hold `plant` baked under `key`, without the textures, which have their own files. `None` if
/// anything is wrong with it.
pub(super) fn decode(file: &[u8], key: &CacheKey, plant: &Arc<Plant>) -> Option<BakedPlant> {
    let payload = opened(file, &key.hash)?;
    let (Payload { lighting, levels }, rest) = postcard::take_from_bytes(payload).ok()?;
    let lighting: BakedLighting = lighting.into_owned();
    if !rest.is_empty() || !lighting.fits(plant) {
        return None;
    }
    // A file that lacks a level, or has one twice, was not written here.
    let has = |representation| levels.iter().filter(|level| level.representation() == representation).count();
    let wanted = |representation| usize::from(key.representations.contains(representation));
    if BAKED.iter().any(|&representation| has(representation) != wanted(representation)) {
        return None;
    }
    let levels = levels.into_owned();
    let fits = levels.iter().all(|level| level.fits(plant, &lighting));
    let (plant, lighting, textures) = (Arc::clone(plant), Arc::new(lighting), Arc::default());
    fits.then_some(BakedPlant { plant, lighting, levels, textures })
}

fn checksum(head: &[u8], payload: &[u8]) -> [u8; 32] {
    *blake3::Hasher::new().update(head).update(payload).finalize().as_bytes()
}

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec3};

    use super::*;
    use crate::bake::levels::LevelSet;
    use crate::bake::levels::cross::{Cross, CrossPlane, CrossTextures};
    use crate::bake::levels::texture::{BlockEncoding, LevelTexture};
    use crate::bake::lighting::ExpressiveLighting;
    use crate::bake::lighting::TransferLighting;
    use crate::bake::lighting::implicit::{AmbientField, NoSurface};
    use crate::bake::lighting::transfer::{TransferBake, TransferFormat, TransferPart, TransferSettings};
    use crate::lod::Representation;
    use crate::math::MipChain;
    use crate::plant::{PartKind, PlantMaterial, PlantMesh, PlantPart};

    fn small() -> BakedPlant {
        let mesh = PlantMesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            normals: vec![Vec3::Z; 3],
            uvs: vec![Vec2::ZERO, Vec2::X, Vec2::Y],
            triangles: vec![[0, 1, 2]],
        };
        let part = PlantPart { kind: PartKind::Foliage, mesh: mesh.clone(), material: PlantMaterial::default() };
        let chain = MipChain { width: 4, height: 4, levels: vec![(0..64).collect(), vec![7; 16], vec![1, 2, 3, 4]] };
        let whole = LevelTexture::compressed(chain.clone(), BlockEncoding::Whole);
        let pairs = LevelTexture::compressed(chain, BlockEncoding::Pairs);
        let plane = CrossPlane { center: Vec3::ONE, u: Vec3::X, v: Vec3::Y, normal: Vec3::Z };
        BakedPlant {
            plant: Arc::new(Plant { name: "small".into(), parts: vec![part] }),
            lighting: Arc::new(BakedLighting::Expressive(ExpressiveLighting {
                normals: vec![vec![Vec3::X, Vec3::Y, Vec3::Z]],
                ambient: vec![vec![0.0, 0.5, 1.0]],
                no_surface: Some(NoSurface::Threshold { threshold: 2.0, greatest: 1.5 }),
                ambient_field: AmbientField::Published,
                together: true,
            })),
            levels: vec![
                BakedLevel::ShadowProxy(Arc::new(vec![mesh])),
                BakedLevel::Cross(Arc::new(Cross {
                    planes: vec![plane; 2],
                    textures: CrossTextures {
                        color: vec![whole.clone(); 2],
                        properties: vec![whole; 2],
                        sun: vec![pairs; 4],
                        light: Vec::new(),
                    },
                    transmission: Vec3::new(0.1, 0.2, 0.3),
                    isotropic_fraction: [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 1.0],
                })),
            ],
            textures: Arc::default(),
        }
    }

    fn key() -> CacheKey {
        CacheKey { hash: [7; 32], representations: LevelSet::default() }
    }

    /// The same with radiance transfer.
    fn transferred() -> BakedPlant {
        let mut baked = small();
        let settings = TransferSettings::default();
        let side: Vec<f32> = (0..3 * settings.coefficients()).map(|i| 0.2 - 0.001 * i as f32).collect();
        let part = TransferPart { front: side.clone(), back: side, indirect_sun: vec![0.1; 12] };
        let packed = TransferBake { settings, parts: vec![part] }.pack(TransferFormat::Snorm8);
        let mut cross = (**baked.cross().unwrap()).clone();
        cross.textures.light = cross.textures.color.clone();
        baked.set_level(BakedLevel::Cross(Arc::new(cross)));
        baked.lighting = Arc::new(BakedLighting::Transfer(TransferLighting::new(packed)));
        baked
    }

    /// A baked plant with each kind of lighting.
    fn all() -> [BakedPlant; 3] {
        let plain = BakedPlant { lighting: Arc::new(BakedLighting::Local), ..small() };
        [small(), transferred(), plain]
    }

    fn written(baked: &BakedPlant) -> Vec<u8> {
        encode(baked, &key().hash).unwrap()
    }

    #[test]
    fn what_is_written_is_read() {
        for baked in all() {
            let read = decode(&written(&baked), &key(), &baked.plant).unwrap();
            assert_eq!(read.lighting, baked.lighting);
            assert_eq!(read.levels, baked.levels);
        }
    }

    #[test]
    fn a_file_cut_or_changed_at_any_byte_counts_as_absent() {
        let baked = small();
        let file = written(&baked);
        for length in 0..file.len() {
            assert!(decode(&file[..length], &key(), &baked.plant).is_none(), "cut at {length}");
        }
        let mut longer = file.clone();
        longer.push(0);
        assert!(decode(&longer, &key(), &baked.plant).is_none());
        for at in 0..file.len() {
            let mut changed = file.clone();
            changed[at] ^= 0x10;
            assert!(decode(&changed, &key(), &baked.plant).is_none(), "changed at {at}");
        }
        assert!(decode(&file, &CacheKey { hash: [8; 32], ..key() }, &baked.plant).is_none(), "another key");
    }

    /// A payload that was damaged before its checksum was made must not panic or ask for absurd memory either.
    #[test]
    fn a_broken_payload_with_a_good_checksum_is_survived() {
        for baked in all() {
            let file = written(&baked);
            let payload = &file[PAYLOAD..];
            assert!(decode(&sealed(payload, &key().hash), &key(), &baked.plant).is_some());
            for at in 0..payload.len() {
                assert!(decode(&sealed(&payload[..at], &key().hash), &key(), &baked.plant).is_none());
                for wrong in [0xff, 0x80, 0x00] {
                    let mut changed = payload.to_vec();
                    changed[at] = wrong;
                    if let Some(read) = decode(&sealed(&changed, &key().hash), &key(), &baked.plant) {
                        assert!(read.lighting.ambient(0).iter().all(|k| k.is_finite()));
                        assert!(read.shadow_proxy().unwrap().iter().all(PlantMesh::is_whole));
                        let of_transfer = matches!(*read.lighting, BakedLighting::Transfer(_));
                        assert!(read.cross().unwrap().is_whole(of_transfer));
                    }
                }
            }
        }
    }

    #[test]
    fn a_level_twice_or_missing_counts_as_a_damaged_file() {
        let baked = small();
        let file = |levels: Vec<BakedLevel>| {
            let payload = Payload { lighting: Cow::Borrowed(&baked.lighting), levels: Cow::Owned(levels) };
            sealed(&postcard::to_stdvec(&payload).unwrap(), &key().hash)
        };
        let (proxy, cross) = (|| baked.levels[0].clone(), || baked.levels[1].clone());
        assert!(decode(&file(vec![cross(), proxy()]), &key(), &baked.plant).is_some(), "in any order");
        for levels in [vec![], vec![cross()], vec![proxy()], vec![proxy(), cross(), proxy()]] {
            assert!(decode(&file(levels), &key(), &baked.plant).is_none());
        }
        // What is not asked for need not be there, and must not.
        let crosses_alone = CacheKey { representations: [Representation::CROSS].into(), ..key() };
        assert!(decode(&file(vec![cross()]), &crosses_alone, &baked.plant).is_some());
        assert!(decode(&file(vec![cross(), proxy()]), &crosses_alone, &baked.plant).is_none());
    }

    #[test]
    fn another_plants_file_does_not_fit() {
        let baked = small();
        let other = Arc::new(Plant::default());
        assert!(decode(&written(&baked), &key(), &other).is_none());
    }
}
