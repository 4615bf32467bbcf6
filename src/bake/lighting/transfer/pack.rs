//! Coefficients as bytes for the GPU and the cache.
//!
//! ```text
//! Float32, Float16:  vertex = front, and for foliage back; each bands² × channels numbers, as in
//!                    TransferPart; padding to 4 bytes
//! Snorm8:            vertex = means, codes
//!   means            one f16 a side and channel, c_0; padding to 4 bytes
//!   codes            for each side and channel (bands² - 1) × i8, 127 c_i / (c_0 scale_l), rounded; padding to 4 bytes
//! ```
//!
//! Codes begin at whole words, so that a shader unpacks four of them at once.
//!
//! A transfer function is not negative, so by the addition theorem the coefficients of its band l are at most
//! sqrt(2 l + 1) c_0 long, and fitted ones not much longer: eight bits relative to c_0 cover exactly the possible
//! range, in the dark interior of a crown as in the light. `scale_l` is the largest ratio among the part's sides that
//! get at least a 64th of the light of the brightest; larger ratios of darker sides are clamped.
//!
//! Errors, for light of the coefficients l: Float16 at most 2^-11 of each coefficient (2^-25 below 6e-5); Snorm8 at
//! most `|c_0| sum_l scale_l / 254 sum_m |l_lm|` and 2^-11 of c_0's share. `benches/transfer.rs` has what that
//! comes to under skies.

use half::f16;
use serde::{Deserialize, Serialize};

use super::{INDIRECT_SUN_COEFFICIENTS, TransferBake, TransferPart, TransferSettings};
use crate::light::sh::MAX_BANDS;

/// How a coefficient is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum TransferFormat {
    /// As computed, 4 bytes each.
    Float32,
    /// 2 bytes each.
    Float16,
    /// 2 bytes for the first of each channel and 1 byte for the others.
    Snorm8,
}

/// A plant's transfer as bytes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PackedTransfer {
    /// The settings of the bake.
    pub settings: TransferSettings,
    /// How its coefficients are stored.
    pub format: TransferFormat,
    /// One per part, in the plant's order.
    pub parts: Vec<PackedPart>,
}

/// One part's transfer as bytes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PackedPart {
    /// 1 for wood, 2 for foliage.
    pub sides: usize,
    /// Stride between vertices in bytes, a multiple of 4.
    pub vertex_bytes: usize,
    /// [`TransferFormat::Snorm8`]: what 127 stands for in each band, relative to c_0. Zero in the first band.
    pub scale: [f32; MAX_BANDS],
    /// Vertex by vertex.
    #[serde(with = "serde_bytes")]
    pub bytes: Vec<u8>,
    /// What 127 stands for in `indirect_sun`.
    pub indirect_sun_scale: f32,
    /// [`TransferPart::indirect_sun`], a signed byte each, in any format.
    #[serde(with = "serde_bytes")]
    pub indirect_sun: Vec<u8>,
}

impl TransferFormat {
    /// Bytes of one vertex with this many sides, padding included.
    pub fn vertex_bytes(self, settings: &TransferSettings, sides: usize) -> usize {
        let numbers = sides * settings.coefficients();
        match self {
            Self::Float32 => 4 * numbers,
            Self::Float16 => (2 * numbers).next_multiple_of(4),
            Self::Snorm8 => {
                let lists = sides * settings.channels.count();
                4 * (mean_words(settings, sides) + lists * code_words(settings))
            }
        }
    }
}

/// [`TransferFormat::Snorm8`]: words of 4 bytes that the means of a vertex with this many sides take.
pub fn mean_words(settings: &TransferSettings, sides: usize) -> usize {
    (sides * settings.channels.count()).div_ceil(2)
}

/// [`TransferFormat::Snorm8`]: words of 4 bytes that the codes of one side and channel take.
pub fn code_words(settings: &TransferSettings) -> usize {
    (settings.coefficients() / settings.channels.count()).saturating_sub(1).div_ceil(4)
}

impl TransferBake {
    /// The coefficients as bytes.
    pub fn pack(&self, format: TransferFormat) -> PackedTransfer {
        let parts = self.parts.iter().map(|part| pack_part(part, &self.settings, format)).collect();
        PackedTransfer { settings: self.settings, format, parts }
    }
}

impl PackedTransfer {
    /// Whether the settings are in their ranges, all parts have whole vertices of them, and all scales are finite.
    pub fn is_whole(&self) -> bool {
        self.settings == self.settings.sanitized()
            && self.parts.iter().all(|part| {
                (1..=2).contains(&part.sides)
                    && part.vertex_bytes == self.format.vertex_bytes(&self.settings, part.sides)
                    && part.bytes.len().is_multiple_of(part.vertex_bytes)
                    && part.scale.iter().chain([&part.indirect_sun_scale]).all(|scale| scale.is_finite())
            })
    }

    /// The coefficients that the bytes stand for. Bytes that are missing count as zeros; never NaN.
    pub fn unpack(&self) -> TransferBake {
        let count = self.settings.coefficients();
        let unpack = |part: &PackedPart| {
            let mut out = TransferPart::default();
            let vertices = part.bytes.len().checked_div(part.vertex_bytes).unwrap_or(0);
            for vertex in 0..vertices {
                let bytes = &part.bytes[vertex * part.vertex_bytes..(vertex + 1) * part.vertex_bytes];
                for (side, target) in [&mut out.front, &mut out.back].into_iter().take(part.sides).enumerate() {
                    let start = target.len();
                    target.resize(start + count, 0.0);
                    self.decode(bytes, part, side, &mut target[start..]);
                }
            }
            let code = |code: &u8| f32::from((*code as i8).max(-127)) / 127.0 * part.indirect_sun_scale;
            out.indirect_sun = part.indirect_sun.iter().map(code).collect();
            out.indirect_sun.resize(vertices * INDIRECT_SUN_COEFFICIENTS, 0.0);
            out
        };
        TransferBake { settings: self.settings, parts: self.parts.iter().map(unpack).collect() }
    }

    /// One side's coefficients from the bytes of its vertex.
    fn decode(&self, bytes: &[u8], part: &PackedPart, side: usize, out: &mut [f32]) {
        let finite = |value: f32| if value.is_finite() { value } else { 0.0 };
        let half = |at: usize| {
            let bytes = bytes.get(2 * at..2 * at + 2).map_or([0; 2], |bytes| [bytes[0], bytes[1]]);
            finite(f16::from_le_bytes(bytes).to_f32())
        };
        let first = side * out.len();
        match self.format {
            TransferFormat::Float32 => {
                let side = bytes.get(4 * first..).unwrap_or_default();
                for (value, bytes) in out.iter_mut().zip(side.chunks_exact(4)) {
                    *value = finite(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]));
                }
            }
            TransferFormat::Float16 => out.iter_mut().enumerate().for_each(|(i, value)| *value = half(first + i)),
            TransferFormat::Snorm8 => {
                let channels = self.settings.channels.count();
                let (means, words) = (mean_words(&self.settings, part.sides), code_words(&self.settings));
                for channel in 0..channels {
                    let list = side * channels + channel;
                    let c0 = half(list);
                    out[channel] = c0;
                    let codes = bytes.get(4 * (means + list * words)..).unwrap_or_default();
                    for (i, code) in (1..out.len() / channels).zip(codes) {
                        let code = f32::from(*code as i8).max(-127.0);
                        out[i * channels + channel] = finite(code / 127.0 * part.scale[i.isqrt()] * c0);
                    }
                }
            }
        }
    }
}

fn pack_part(part: &TransferPart, settings: &TransferSettings, format: TransferFormat) -> PackedPart {
    let (count, channels) = (settings.coefficients(), settings.channels.count());
    let sides = 1 + usize::from(!part.back.is_empty());
    let vertex_bytes = format.vertex_bytes(settings, sides);
    let vertices = part.front.len() / count;
    let scale = if format == TransferFormat::Snorm8 { scales(part, count, channels) } else { [0.0; MAX_BANDS] };
    let mut bytes = Vec::with_capacity(vertices * vertex_bytes);
    for vertex in 0..vertices {
        let values = |side: &'_ Vec<f32>| side.get(vertex * count..(vertex + 1) * count).map(<[f32]>::to_vec);
        let of_sides: Vec<Vec<f32>> = [&part.front, &part.back]
            .into_iter()
            .take(sides)
            .map(|side| values(side).unwrap_or(vec![0.0; count]))
            .collect();
        match format {
            TransferFormat::Float32 => bytes.extend(of_sides.iter().flatten().flat_map(|value| value.to_le_bytes())),
            TransferFormat::Float16 => {
                bytes.extend(of_sides.iter().flatten().flat_map(|value| f16::from_f32(*value).to_le_bytes()));
            }
            TransferFormat::Snorm8 => encode(&of_sides, settings, &scale, &mut bytes),
        }
        bytes.resize((vertex + 1) * vertex_bytes, 0);
    }
    let greatest = part.indirect_sun.iter().fold(0.0f32, |max, value| max.max(value.abs()));
    let code = |value: &f32| ((127.0 * value / greatest).clamp(-127.0, 127.0).round() as i8) as u8;
    let indirect_sun = part.indirect_sun.iter().map(code).collect();
    PackedPart { sides, vertex_bytes, scale, bytes, indirect_sun_scale: greatest, indirect_sun }
}

/// Appends a vertex.
fn encode(sides: &[Vec<f32>], settings: &TransferSettings, scale: &[f32; MAX_BANDS], bytes: &mut Vec<u8>) {
    let channels = settings.channels.count();
    let start = bytes.len();
    let mean = |side: &[f32], channel: usize| f16::from_f32(side[channel].max(0.0));
    for side in sides {
        bytes.extend((0..channels).flat_map(|channel| mean(side, channel).to_le_bytes()));
    }
    bytes.resize(start + 4 * mean_words(settings, sides.len()), 0);
    for side in sides {
        for channel in 0..channels {
            let end = bytes.len() + 4 * code_words(settings);
            let c0 = mean(side, channel).to_f32();
            for (i, value) in side[channel..].iter().step_by(channels).enumerate().skip(1) {
                // A cast turns what is not a number (no light at all) into zero.
                let code = 127.0 * value / (c0 * scale[i.isqrt()]);
                bytes.push((code.clamp(-127.0, 127.0).round() as i8) as u8);
            }
            bytes.resize(end, 0);
        }
    }
}

/// The largest ratio to c_0 in each band, of sides that are not nearly dark.
fn scales(part: &TransferPart, count: usize, channels: usize) -> [f32; MAX_BANDS] {
    let sides = || part.front.chunks_exact(count).chain(part.back.chunks_exact(count));
    let brightest = sides().flat_map(|values| &values[..channels]).fold(0.0f32, |max, value| max.max(*value));
    let mut scale = [0.0f32; MAX_BANDS];
    for values in sides() {
        for (i, value) in values.iter().enumerate().skip(channels) {
            let first = values[i % channels];
            let ratio = (value / first).abs();
            if first > 0.0 && first >= brightest / 64.0 && ratio.is_finite() {
                let band = (i / channels).isqrt();
                scale[band] = scale[band].max(ratio);
            }
        }
    }
    scale
}

#[cfg(test)]
mod tests {
    use super::super::Channels;
    use super::*;

    fn bake(channels: Channels) -> TransferBake {
        let settings = TransferSettings { bands: 3, channels, ..Default::default() };
        let count = settings.coefficients();
        let mut part = TransferPart::default();
        for vertex in 0..200 {
            for side in [&mut part.front, &mut part.back] {
                let level = 0.28 * 0.96f32.powi(vertex);
                side.extend((0..count).map(|i| {
                    let wave = ((vertex * 31 + i as i32 * 17) as f32).sin();
                    if i < channels.count() { level } else { 1.1 * level * wave }
                }));
            }
        }
        TransferBake { settings, parts: vec![part] }
    }

    #[test]
    fn errors_are_within_their_bounds() {
        for channels in [Channels::Luminance, Channels::Rgb] {
            let bake = bake(channels);
            let exact = bake.pack(TransferFormat::Float32).unpack();
            assert_eq!((&exact.parts[0].front, &exact.parts[0].back), (&bake.parts[0].front, &bake.parts[0].back));
            for (format, bytes) in [(TransferFormat::Float16, 36), (TransferFormat::Snorm8, 20)] {
                let packed = bake.pack(format);
                assert_eq!(packed.parts[0].vertex_bytes, bytes * channels.count());
                let (back, count) = (packed.unpack(), bake.settings.coefficients());
                let pairs = |p: &TransferPart| [p.front.clone(), p.back.clone()].concat();
                let (want, got) = (pairs(&bake.parts[0]), pairs(&back.parts[0]));
                for (i, (want, got)) in want.iter().zip(&got).enumerate() {
                    let first = i / count * count;
                    let c0 = pairs(&bake.parts[0])[first];
                    let bound = match format {
                        TransferFormat::Snorm8 if i - first >= channels.count() => {
                            let scale = packed.parts[0].scale[((i - first) / channels.count()).isqrt()];
                            c0 * (scale / 254.0 + scale / 1024.0)
                        }
                        _ => want.abs() / 2048.0 + 3e-8,
                    };
                    assert!((want - got).abs() <= bound, "{format:?} {i}: {want} {got}");
                }
            }
        }
    }

    #[test]
    fn darkness_and_missing_bytes_are_zeros() {
        let mut bake = bake(Channels::Luminance);
        bake.parts[0].front[..9].fill(0.0);
        bake.parts[0].front[9] = -1e-9;
        let mut packed = bake.pack(TransferFormat::Snorm8);
        let got = packed.unpack();
        assert!(got.parts[0].front[..18].iter().all(|v| *v == 0.0));
        packed.parts[0].bytes.truncate(17);
        packed.parts[0].bytes.fill(0xff);
        assert!(packed.unpack().parts[0].front.iter().all(|v| v.is_finite()));
        packed.parts[0].vertex_bytes = 0;
        assert!(packed.unpack().parts[0].front.is_empty());
    }
}
