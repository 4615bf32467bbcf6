//! Coefficients as bytes for the GPU and the cache.
//!
//! ```text
//! vertex = side [side] padding to 4 bytes            front, and for foliage back
//! side, Float32 or Float16:  bands² × channels numbers, as in TransferPart
//! side, Snorm8:              channels × f16  c_0, one a channel
//!                            (bands² - 1) × channels × i8   127 c_i / (c_0 scale_l), rounded
//! ```
//!
//! A transfer function is not negative, so by the addition theorem the coefficients of its band l are at most
//! sqrt(2 l + 1) c_0 long, and fitted ones not much longer: eight bits relative to c_0 are spent on what can occur, in
//! the dark inside of a crown as in the light. `scale_l` is the largest ratio among the part's sides that get at least
//! a 64th of the light of the brightest; what exceeds it in darker ones is clamped.
//!
//! Errors, for light of the coefficients l: Float16 at most 2^-11 of each coefficient (2^-25 below 6e-5); Snorm8 at
//! most `|c_0| sum_l scale_l / 254 sum_m |l_lm|` and 2^-11 of c_0's share. `benches/transfer.rs` has what that
//! comes to under skies.

use half::f16;

use super::{TransferBake, TransferPart, TransferSettings};
use crate::light::sh::MAX_BANDS;

/// How a coefficient is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TransferFormat {
    /// As computed, 4 bytes each.
    Float32,
    /// 2 bytes each.
    Float16,
    /// 2 bytes for the first of each channel and 1 byte for the others.
    Snorm8,
}

/// A plant's transfer as bytes.
#[derive(Clone, Debug, PartialEq)]
pub struct PackedTransfer {
    /// The settings it was baked with.
    pub settings: TransferSettings,
    /// How its coefficients are stored.
    pub format: TransferFormat,
    /// One a part, in the plant's order.
    pub parts: Vec<PackedPart>,
}

/// One part's transfer as bytes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PackedPart {
    /// 1 for wood, 2 for foliage.
    pub sides: usize,
    /// From one vertex to the next, bytes; a multiple of 4.
    pub vertex_bytes: usize,
    /// [`TransferFormat::Snorm8`]: what 127 stands for in each band, relative to c_0. Zero in the first band.
    pub scale: [f32; MAX_BANDS],
    /// Vertex by vertex.
    pub bytes: Vec<u8>,
}

impl TransferFormat {
    /// Bytes of one side of one vertex.
    pub fn side_bytes(self, settings: &TransferSettings) -> usize {
        let count = settings.coefficients();
        match self {
            Self::Float32 => 4 * count,
            Self::Float16 => 2 * count,
            Self::Snorm8 => count + settings.channels.count(),
        }
    }

    /// Bytes of one vertex with this many sides, padding included.
    pub fn vertex_bytes(self, settings: &TransferSettings, sides: usize) -> usize {
        (sides * self.side_bytes(settings)).next_multiple_of(4)
    }
}

impl TransferBake {
    /// The coefficients as bytes.
    pub fn pack(&self, format: TransferFormat) -> PackedTransfer {
        let parts = self.parts.iter().map(|part| pack_part(part, &self.settings, format)).collect();
        PackedTransfer { settings: self.settings, format, parts }
    }
}

impl PackedTransfer {
    /// The coefficients that the bytes stand for. Bytes that are missing count as zeros; never NaN.
    pub fn unpack(&self) -> TransferBake {
        let count = self.settings.coefficients();
        let side_bytes = self.format.side_bytes(&self.settings);
        let unpack = |part: &PackedPart| {
            let mut out = TransferPart::default();
            let vertices = part.bytes.len().checked_div(part.vertex_bytes).unwrap_or(0);
            for vertex in 0..vertices {
                let bytes = &part.bytes[vertex * part.vertex_bytes..];
                for (side, target) in [&mut out.front, &mut out.back].into_iter().take(part.sides).enumerate() {
                    let start = target.len();
                    target.resize(start + count, 0.0);
                    if let Some(bytes) = bytes.get(side * side_bytes..(side + 1) * side_bytes) {
                        self.decode(bytes, &part.scale, &mut target[start..]);
                    }
                }
            }
            out
        };
        TransferBake { settings: self.settings, parts: self.parts.iter().map(unpack).collect() }
    }

    /// One side's coefficients from its bytes.
    fn decode(&self, bytes: &[u8], scale: &[f32; MAX_BANDS], out: &mut [f32]) {
        let finite = |value: f32| if value.is_finite() { value } else { 0.0 };
        match self.format {
            TransferFormat::Float32 => {
                for (value, bytes) in out.iter_mut().zip(bytes.chunks_exact(4)) {
                    *value = finite(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]));
                }
            }
            TransferFormat::Float16 => {
                for (value, bytes) in out.iter_mut().zip(bytes.chunks_exact(2)) {
                    *value = finite(f16::from_le_bytes([bytes[0], bytes[1]]).to_f32());
                }
            }
            TransferFormat::Snorm8 => {
                let channels = self.settings.channels.count();
                let (first, rest) = bytes.split_at(2 * channels);
                for channel in 0..channels {
                    let c0 = finite(f16::from_le_bytes([first[2 * channel], first[2 * channel + 1]]).to_f32());
                    out[channel] = c0;
                    for i in 1..out.len() / channels {
                        let code = f32::from(rest[(i - 1) * channels + channel] as i8).max(-127.0);
                        out[i * channels + channel] = finite(code / 127.0 * scale[i.isqrt()] * c0);
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
        for side in [&part.front, &part.back].into_iter().take(sides) {
            if let Some(values) = side.get(vertex * count..(vertex + 1) * count) {
                encode(values, format, &scale, channels, &mut bytes);
            }
        }
        bytes.resize((vertex + 1) * vertex_bytes, 0);
    }
    PackedPart { sides, vertex_bytes, scale, bytes }
}

fn encode(values: &[f32], format: TransferFormat, scale: &[f32; MAX_BANDS], channels: usize, bytes: &mut Vec<u8>) {
    match format {
        TransferFormat::Float32 => values.iter().for_each(|value| bytes.extend(value.to_le_bytes())),
        TransferFormat::Float16 => values.iter().for_each(|value| bytes.extend(f16::from_f32(*value).to_le_bytes())),
        TransferFormat::Snorm8 => {
            let first: Vec<f16> = values[..channels].iter().map(|value| f16::from_f32(value.max(0.0))).collect();
            first.iter().for_each(|value| bytes.extend(value.to_le_bytes()));
            for (i, values) in values.chunks_exact(channels).enumerate().skip(1) {
                for (value, first) in values.iter().zip(&first) {
                    // A cast turns what is not a number (no light at all) into zero.
                    let code = 127.0 * value / (first.to_f32() * scale[i.isqrt()]);
                    bytes.push((code.clamp(-127.0, 127.0).round() as i8) as u8);
                }
            }
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
        for channels in [Channels::One, Channels::Rgb] {
            let bake = bake(channels);
            assert_eq!(bake.pack(TransferFormat::Float32).unpack(), bake);
            for (format, bytes) in [(TransferFormat::Float16, 36), (TransferFormat::Snorm8, 20)] {
                let packed = bake.pack(format);
                assert_eq!(packed.parts[0].vertex_bytes, (bytes * channels.count()).next_multiple_of(4));
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
        let mut bake = bake(Channels::One);
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
