//! Lighting textures of crosses: the transfer of the sky's light to a texel's leaves [Franzke 2005, 4.3.3, "Spherical
//! Harmonics Beleuchtungstextur"].
//!
//! The transfer of the vertices ([`crate::bake::lighting::transfer`]) is rasterised like their colour. The
//! first two bands of its coefficients are kept: the mean over all directions, and a vector. Like the normals, the
//! vector is in the plane's frame, so that a plane seen from behind only flips its third component. A leaf shows the
//! light on the side that faces the viewer plus, times its transmission `t`, the light on the other side. One texture
//! holds this sum over `1 + t`, with the luminance of `t`, so that the shader can apply the transmission of each
//! channel:
//!
//! ```text
//!  stored = (near + t far) / (1 + t)
//!  radiance under the sky = base colour (1 + t) (l_0 stored.w + L . stored.xyz)
//!                                          l_0, L: the sky's first coefficient and the vector of its second band
//! ```
//!
//! Cost: 4 bytes per texel plus a third for mips: 1.75 MB per plant at 256 texels, 0.44 in blocks. None for plants that are not lit by
//! transfer.
//!
//! Error against the model's own light in the same images (three bands, clamped at each vertex), luminance, skies of a
//! sun 60 to -4 degrees high, a broadleaf and a conifer, mips 0 to 4: 0.96 to 1.00 of the light and a relative RMSE of
//! 0.03 to 0.23; the ambient term and the mean normal, which this replaces, 0.88 to 0.98 and 0.06 to 0.33. Both sides
//! in a texture of their own are no better, and their plain mean is worse (0.93 to 0.96, 0.11 to 0.24).
//! `the_light_of_a_texture` below checks the order.

use glam::{Mat3, Vec3, Vec4};

use super::{Texel, signed_mips::signed_mips};
use crate::bake::lighting::{BakedLighting, transfer::INDIRECT_SUN_COEFFICIENTS};
use crate::math::MipChain;

/// The value of a byte of 255. An unoccluded side has a first coefficient of 0.282 and a vector of length 0.326.
pub const LIGHT_SCALE: f32 = 0.4;

/// The first two bands of the transfer of a vertex in the plant's frame: the vector, and in w the first coefficient.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::bake::levels) struct VertexLight {
    /// All light on its front and on its back.
    pub sides: [Vec4; 2],
    /// The light of the sun that other leaves scatter to either side.
    pub indirect_sun: Vec4,
}

/// That of each vertex of each part; `None` where a plant is not lit by transfer.
pub(in crate::bake::levels) fn vertex_light(lighting: &BakedLighting) -> Option<Vec<Vec<VertexLight>>> {
    let BakedLighting::Transfer(transfer) = lighting else { return None };
    let baked = transfer.packed.unpack();
    let (count, channels) = (baked.settings.coefficients().max(1), baked.settings.channels.count());
    let side = |coefficients: &[f32]| {
        let mean = |index: usize| -> f32 {
            let of = coefficients.get(index * channels..(index + 1) * channels).unwrap_or(&[]);
            of.iter().sum::<f32>() / channels as f32
        };
        two_bands(mean(0), [mean(1), mean(2), mean(3)])
    };
    let parts = baked.parts.iter().map(|part| {
        let back = part.back.chunks_exact(count).map(side).chain(std::iter::repeat(Vec4::ZERO));
        let (indirect, _) = part.indirect_sun.as_chunks::<INDIRECT_SUN_COEFFICIENTS>();
        let indirect = indirect.iter().map(|&[mean, a, b, c]| two_bands(mean, [a, b, c]));
        let front = part.front.chunks_exact(count).map(side);
        let vertices = front.zip(back).zip(indirect.chain(std::iter::repeat(Vec4::ZERO)));
        vertices.map(|((front, back), indirect_sun)| VertexLight { sides: [front, back], indirect_sun }).collect()
    });
    Some(parts.collect())
}

/// The second band as a vector: `light::sh` has the signs.
fn two_bands(mean: f32, [a, b, c]: [f32; 3]) -> Vec4 {
    Vec4::new(-a, b, -c, mean)
}

/// What a sample stores whose viewer sees `near`, with light of the share `transmission` from `far`.
pub(in crate::bake::levels) fn stored(near: Vec4, far: Vec4, transmission: f32, to_plane: &Mat3) -> Vec4 {
    let sum = (near + far * transmission) / (1.0 + transmission);
    let sum = (*to_plane * sum.truncate()).extend(sum.w);
    if sum.is_finite() { sum } else { Vec4::ZERO }
}

/// Mips of the light, a texture of `resolution`² texels (a power of two) on top. One of no plant at all is in the open.
pub(in crate::bake::levels) fn mips(texels: &[Texel], resolution: usize) -> MipChain {
    let values = texels.iter().map(|texel| (texel.light, texel.coverage)).collect();
    signed_mips(values, resolution, LIGHT_SCALE, Vec3::ZERO.extend(0.282))
}

#[cfg(test)]
mod tests {
    use std::f32::consts::PI;
    use std::sync::Arc;

    use super::super::{CrossSettings, planes, render_plane, signed_mips::code};
    use super::*;
    use crate::bake::lighting::LightingSettings;
    use crate::bake::lighting::transfer::{TransferSettings, share};
    use crate::light::{Atmosphere, AtmosphereParams, LightSettings, LightState, SunPosition, sh};
    use crate::math::luminance;
    use crate::plant::grow::{GrowParameters, grow};

    /// The texture is nearer to the light of the model's vertices in the same image than the ambient term with the mean
    /// normal.
    #[test]
    fn the_light_of_a_texture_is_nearer_than_by_the_ambient_term() {
        let plant = Arc::new(grow(&GrowParameters::broadleaf(), 1, 5000).unwrap());
        let bake = TransferSettings { rays: 64, ..TransferSettings::default() };
        let lighting = BakedLighting::bake(&plant, &LightingSettings::Transfer(bake));
        let BakedLighting::Transfer(transfer) = &lighting else { panic!("no transfer") };
        let baked = transfer.packed.unpack();
        let settings = CrossSettings { resolution: 64, supersampling: 2, ..CrossSettings::default() };
        let plane = &planes(&plant, 2)[0];
        let frame = plane.frame();
        let light = vertex_light(&lighting).unwrap();
        let texels = render_plane(&plant, &lighting, Some(&light), plane, &settings).texels;
        let codes = mips(&texels, 64);
        let air = Atmosphere::new(AtmosphereParams::with_visibility_km(60.0)).unwrap();
        for elevation in [40.0, 5.0, -4.0] {
            let sun = SunPosition::from_degrees(250.0, elevation).unwrap();
            let state = LightState::new(&air, sun, None, &LightSettings::default()).unwrap();
            let sky = state.surroundings().project(3);
            // The light of each vertex in place of its first coefficient: so the image shows the model.
            let lit = |side: &[f32]| Vec3::ZERO.extend(luminance(share(&sky, side)));
            let vertices = |part: usize| {
                let part = &baked.parts[part];
                let count = part.front.len() / baked.settings.coefficients();
                let sides = |i| [lit(part.front_of(i, &baked.settings)), lit(part.back_of(i, &baked.settings))];
                let vertex = |i| VertexLight { sides: sides(i), ..VertexLight::default() };
                (0..count).map(vertex).collect::<Vec<_>>()
            };
            let lit: Vec<Vec<VertexLight>> = (0..baked.parts.len()).map(vertices).collect();
            let truth = render_plane(&plant, &lighting, Some(&lit), plane, &settings).texels;
            let vector = frame.transpose() * Vec3::new(-luminance(sky[1]), luminance(sky[2]), -luminance(sky[3]));
            let (mut error, mut error_by_ambient, mut square) = (0.0, 0.0, 0.0);
            for (at, (texel, truth)) in texels.iter().zip(&truth).enumerate().filter(|(_, (t, _))| t.foliage > 0.0) {
                let code = |i: usize| (f32::from(codes.levels[0][4 * at + i]) - 128.0) / 127.0 * LIGHT_SCALE;
                let got = (luminance(sky[0]) * code(3) + vector.dot(Vec3::new(code(0), code(1), code(2)))).max(0.0);
                let wanted = truth.light.w / truth.coverage;
                let normal = frame * texel.normal.try_normalize().unwrap_or(Vec3::Z);
                let even = |normal| luminance(sh::irradiance(&state.sky_sh, normal)).max(0.0) / PI;
                // With as much light through a leaf as from its face.
                let by_ambient = texel.ambient / texel.coverage * 0.5 * (even(normal) + even(-normal));
                error += (got - wanted).powi(2) * texel.coverage;
                error_by_ambient += (by_ambient - wanted).powi(2) * texel.coverage;
                square += wanted * wanted * texel.coverage;
            }
            let [ours, theirs] = [error, error_by_ambient].map(|sum| (sum / square).sqrt());
            assert!(
                ours < 0.85 * theirs && ours < 0.25,
                "{elevation}: {ours} by the texture, {theirs} by the ambient term"
            );
        }
    }

    #[test]
    fn air_continues_the_plant_and_counts_for_nothing() {
        let mut texels = vec![Texel::default(); 16];
        texels[0] = Texel { coverage: 0.5, light: 0.5 * Vec4::new(0.2, -0.4, 0.0, 0.1), ..Texel::default() };
        texels[5] = Texel { coverage: 1.0, light: Vec4::new(0.2, -0.4, 0.0, 0.1), ..Texel::default() };
        let chain = mips(&texels, 4);
        assert_eq!(chain.levels.len(), 3);
        let code = |value| code(value, LIGHT_SCALE);
        let expected = [0.2, -0.4, 0.0, 0.1].map(code);
        assert!(chain.levels.iter().flat_map(|level| level.chunks_exact(4)).all(|texel| texel == expected));
        assert_eq!([0.4, -0.4, 9.0, f32::NAN].map(code), [255, 1, 255, 128]);
        let open = mips(&[Texel::default(); 4], 2);
        assert!(
            open.levels
                .iter()
                .flat_map(|level| level.chunks_exact(4))
                .all(|texel| texel == [128, 128, 128, code(0.282)])
        );
    }

    #[test]
    fn nothing_is_made_without_transfer() {
        assert!(vertex_light(&BakedLighting::Local).is_none());
    }
}
