//! The exposures at which HDR-FLIP looks at a scene [Andersson et al. 2021, section 4].

use glam::Vec3;

use super::super::Picture;

/// The ACES curve's numerator and denominator, in powers of the light from 2 down to 0; 0.6 takes back its own exposure.
const NUMERATOR: [f32; 3] = [0.36 * 2.51, 0.6 * 0.03, 0.0];
const DENOMINATOR: [f32; 3] = [0.36 * 2.43, 0.6 * 0.59, 0.14];
/// What counts as bright on the display.
const BRIGHT: f32 = 0.85;
/// The most exposures that are looked at; a reference that is black but for a few pixels asks for more.
const MOST: f32 = 32.0;

/// Exposed light through the ACES curve, 0 to 1.
pub fn tone_mapped(light: Vec3) -> Vec3 {
    let polynomial = |[a, b, c]: [f32; 3]| light * light * a + light * b + c;
    let mapped = polynomial(NUMERATOR) / polynomial(DENOMINATOR);
    // So bright that its square is no number: white.
    Vec3::select(light.cmpgt(Vec3::splat(1e15)), Vec3::ONE, mapped.clamp(Vec3::ZERO, Vec3::ONE))
}

/// Exposures in stops: from that at which the brightest pixel of `reference` is bright to that at which its median is, in
/// steps of at most a stop.
pub fn exposures(reference: &Picture) -> Vec<f32> {
    let [a, b, c] = [0, 1, 2].map(|power| NUMERATOR[power] - BRIGHT * DENOMINATOR[power]);
    let middle = -0.5 * b / a;
    let bright = middle + (middle * middle - c / a).sqrt();
    let mut luminances: Vec<f32> = reference.luminance().into_iter().map(|value| value as f32).collect();
    luminances.sort_by(f32::total_cmp);
    let highest = luminances.last().copied().unwrap_or(0.0);
    let half = luminances.len() / 2;
    let median = match luminances.get(half.saturating_sub(1)..=half) {
        Some([below, above]) => 0.5 * (below + above),
        _ => highest,
    };
    if highest <= 0.0 {
        return vec![0.0];
    }
    let start = (bright / highest).log2();
    // Half of the reference is black: as if its median were as dark as is looked at.
    let stop = if median > 0.0 { (bright / median).log2() } else { f32::INFINITY };
    let stop = stop.min(start + MOST - 1.0);
    let count = (stop - start).ceil().max(2.0);
    (0..count as u32).map(|step| start + step as f32 * (stop - start) / (count - 1.0)).collect()
}
