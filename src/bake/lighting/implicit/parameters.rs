//! Settings of the implicit-surface bake, and the automatic values of ρ, τ, k_a_min, d_min and n for those left `None`.
//!
//! [Luft 2007, 3.1] sets ρ and τ by hand and finds that adequate values follow from the model's size. Here:
//!
//! - ρ: a tenth of the plant's longest extent, but at least three times the mean distance of its leaves, so that a
//!   sparse plant does not fall into single leaves;
//! - τ: a share of the median of F at the leaves, so that the surface keeps close to the crown whatever its density;
//! - the ambient field's first radius: a hundredth of the longest extent;
//! - k_a_min, d_min and n: constants of each [`AmbientField`], as both are in units that mean the same for any plant. They
//!   were fitted to the traced visibility of ten plants (grown broadleaves, conifers and a bush, scanned oak, pine and
//!   aspen), which `benches/implicit.rs` prints beside what they give: its errors are those on the plants of the fit.

use std::ops::RangeInclusive;

use bevy::reflect::{Reflect, std_traits::ReflectDefault};
use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::density::DensityField;
use super::generators::{Generator, Weighting, even_share};
use super::partition::Aabb;
use crate::math::Range;

/// ρ as a share of the plant's longest extent.
const RADIUS_SHARE: f32 = 0.1;
/// ρ in mean distances between leaves, at least.
const RADIUS_SPACINGS: f32 = 3.0;
/// First radius of the ambient field as a share of the plant's longest extent.
const AMBIENT_SHARE: f32 = 0.01;
/// τ as a share of the median of F at the leaves.
const THRESHOLD_SHARE: f32 = 0.25;
/// Leaves that are asked for the density.
const SAMPLES: usize = 4096;

/// What the ambient term is a function of, and with it how k_a lights the leaves: as published, or with constants that are
/// fitted to the path tracer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Reflect)]
pub enum AmbientField {
    /// F - τ of the field with the radius ρ, as published: the surface of the normals is where the crown begins to
    /// darken. What lies beyond ρ casts no shade. The plant is then lit by eq. 1 alone: k_a on the ambient light and on
    /// nothing else, without a floor; diffuse and specular light by the realigned normal, times the shadow map; no light
    /// comes through leaves. k_a_min = 0.2, d_min = 5 and n = 6 where nothing is set are fitted: see [`Depth`](Self::Depth).
    Published,
    /// The mean number of leaves along a ray ([`DepthField`](super::depth_field::DepthField)): the same bumps, for radii that
    /// double from the ambient radius to the plant's extent, wood counted as well. Nearer to what is seen from a leaf,
    /// whatever the plant, and independent of ρ and τ, which belong to the normals then: those want a smooth crown, and
    /// light wants every gap.
    ///
    /// Lit with constants of our own (`shaders/forest/instance.wgsl`): the light of other leaves is 0.13 of the ambient light
    /// that k_a takes away, the direct light is times min(0.35 + 2 k_a, 1.1) for leaves that the shadow map is too coarse for,
    /// leaves pass on light from behind, and their gloss is alike in all directions. 0.13 is fitted to the path tracer on a grown
    /// broadleaf and conifer and a scanned oak, pine and aspen; the factor on the direct light is a guess that the same plants
    /// bear out (`docs/measurements/expressive-against-ground-truth.md`). k_a_min = 0, d_min = 8 and n = 4 are fitted to traced
    /// visibility of ten plants (`docs/measurements/implicit-surfaces.md`). Both reports judge the constants on the plants of
    /// the fit; other plants may be farther from the truth.
    #[default]
    Depth,
}

/// k_a_min, d_min and n of eq. 4 where nothing is set.
struct Curve {
    least: f32,
    core: f32,
    exponent: f32,
}

impl AmbientField {
    /// Foliage is clumped, so it transmits more light than exp(-depth): at first k_a falls by n / d_min per leaf.
    fn curve(self) -> Curve {
        match self {
            Self::Published => Curve { least: 0.2, core: 5.0, exponent: 6.0 },
            Self::Depth => Curve { least: 0.0, core: 8.0, exponent: 4.0 },
        }
    }
}

/// Where the normals of the foliage come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Reflect)]
pub enum NormalSource {
    /// The nearest vertex of the surface, as published. Jumps between lobes of the crown. In a scene file: `Nearest`.
    #[default]
    #[serde(rename = "Nearest")]
    NearestVertex,
    /// The gradient of the density field: smooth. In a scene file: `Smooth`.
    #[serde(rename = "Smooth")]
    Gradient,
}

/// Settings of the implicit-surface bake. Values out of range are clamped. Values that are `None`, or that a scene file
/// leaves out in `lighting: Expressive(...)`, are derived from the plant. Scene files must keep within the ranges that
/// are constants here.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, Reflect)]
#[reflect(Default)]
#[serde(deny_unknown_fields, default)]
pub struct ImplicitSettings {
    /// ρ, metres, 0..=1e6. Larger: a smoother, more general shape of the crown.
    #[reflect(@Range::factor(ImplicitSettings::RADIUS).unit("m"), @"Distance of a leaf's influence. Larger: a smoother crown.")]
    pub radius: Option<f32>,
    /// τ in units of the field (see [`Weighting`]), 0..=1e6. Larger: a surface closer to the densest foliage.
    #[reflect(@Range::factor(ImplicitSettings::DENSITY), @"Density at the surface. Larger: a surface closer to the densest foliage.")]
    pub threshold: Option<f32>,
    /// What the ambient term is a function of: `Depth`, nearer to the truth, or `Published`, lit by the paper's equations
    /// alone ([`AmbientField`]).
    #[reflect(@"Depth: leaves on the way out of the crown, at all radii. Published: density within rho minus tau.")]
    pub ambient: AmbientField,
    /// First radius of [`AmbientField::Depth`], metres, 0..=1e6. Larger: gaps between twigs no longer count. 0: the
    /// ambient term is 1.
    #[reflect(@Range::factor(ImplicitSettings::AMBIENT_RADIUS).unit("m"), @"First radius of the depth field. Larger: gaps between twigs are ignored.")]
    pub ambient_radius: Option<f32>,
    /// k_a_min, 0..=1: the least ambient term, in the core of the crown.
    #[reflect(@Range::fraction(ImplicitSettings::UNIT), @"Ambient light of the crown's core.")]
    pub least: Option<f32>,
    /// d_min in units of the ambient field, 0..=1e6: from this value on the ambient term is k_a_min. Larger: brighter.
    #[reflect(@Range::factor(ImplicitSettings::DENSITY), @"Depth or density at which the ambient light reaches that of the core. Larger: brighter.")]
    pub core: Option<f32>,
    /// n, 0.01..=100. Below 1 the crown darkens only near its core, above 1 already near its surface.
    #[reflect(@Range::factor(ImplicitSettings::EXPONENT), @"Below 1 the crown darkens late towards the core, above 1 early.")]
    pub exponent: Option<f32>,
    /// Fraction of the foliage's primitives that become generators, 0..=1 (at least one does). Smaller: faster and less
    /// accurate. [`AmbientField::Depth`] always uses all of them: it needs single leaves to find gaps, and thins them
    /// out itself. In a scene file: `share`.
    #[serde(rename = "share")]
    #[reflect(@Range::factor(ImplicitSettings::SHARE), @"Fraction of the leaves that form the surface. Smaller: a faster but less accurate bake.")]
    pub generator_share: f32,
    /// What a generator counts: `LeafArea`, `Primitives` [Luft 2007, 3.1] or `Vertices` [Luft 2006, 4.1]. It changes the units
    /// of [`threshold`](Self::threshold), and of [`core`](Self::core) as published. [`AmbientField::Depth`] goes by leaf area.
    #[reflect(@"What each leaf counts: its area, one per primitive, or one per vertex. It changes the unit of the threshold.")]
    pub weighting: Weighting,
    /// Where the normals come from.
    #[reflect(@"The normal of the surface's nearest vertex, as published, or the gradient of the density.")]
    pub normals: NormalSource,
    /// Weight of a leaf's own normal in the result, 0..=1; the publication shows 0. 1: the leaves' own normals,
    /// unchanged.
    #[reflect(@Range::fraction(ImplicitSettings::UNIT), @"Weight of each leaf's own normal in the result.")]
    pub own_normal: f32,
    /// Whether the surface is extracted even if the normals do not need it.
    pub surface: bool,
    /// Cells of the surface per radius ρ, 1..=16. More: a finer surface, whose triangles grow with the square.
    #[reflect(@Range::steps(ImplicitSettings::RESOLUTION, 1.0, 0.1), @"Cells of the surface per radius. More: a finer surface.")]
    pub resolution: f32,
    /// Triangles of the returned surface as a fraction of the foliage's, 0..=1 (the presets
    /// [`COARSE_SHARE`](super::COARSE_SHARE) and [`FINE_SHARE`](super::FINE_SHARE)); `None` leaves it as extracted. The
    /// fraction is always reached: a surface with fewer triangles is extracted again with finer cells. Exceptions: more
    /// separate lobes than the share has tetrahedra for, and more cells than
    /// [`MOST_CELLS`](super::isosurface::MOST_CELLS). Normals always come from the surface as `resolution` gives it.
    pub surface_share: Option<f32>,
    /// Whether all trees of such species are lit together, so that a small tree is darkened by its tall neighbour [Luft
    /// 2007, 5]. Each tree then is a model of its own, of which a scene has at most 1,023. The first such species' values
    /// count for all. Their neighbours darken them by the common field alone: of the cover around them nothing is counted
    /// again, trees of other species included. The shadow maps and, in [`AmbientField::Depth`], the factor on the direct
    /// light count for each. For who places trees: the bake of one plant does not look at it. Default false.
    pub together: bool,
}

impl Default for ImplicitSettings {
    fn default() -> Self {
        Self {
            radius: None,
            threshold: None,
            ambient: AmbientField::Depth,
            ambient_radius: None,
            least: None,
            core: None,
            exponent: None,
            generator_share: 1.0,
            weighting: Weighting::LeafArea,
            normals: NormalSource::NearestVertex,
            own_normal: 0.0,
            surface: true,
            resolution: 4.0,
            surface_share: None,
            together: false,
        }
    }
}

impl ImplicitSettings {
    /// Range of [`radius`](Self::radius) in a scene, metres.
    pub const RADIUS: RangeInclusive<f32> = 1e-6..=1e3;
    /// Range of [`threshold`](Self::threshold) and [`core`](Self::core) in a scene, leaves.
    pub const DENSITY: RangeInclusive<f32> = 0.0..=1e6;
    /// Range of [`ambient_radius`](Self::ambient_radius) in a scene, metres.
    pub const AMBIENT_RADIUS: RangeInclusive<f32> = 0.0..=1e3;
    /// Range of [`exponent`](Self::exponent) in a scene.
    pub const EXPONENT: RangeInclusive<f32> = 0.01..=100.0;
    /// Range of [`generator_share`](Self::generator_share) in a scene.
    pub const SHARE: RangeInclusive<f32> = 1e-3..=1.0;
    /// Range of [`least`](Self::least), [`own_normal`](Self::own_normal) and [`surface_share`](Self::surface_share) in
    /// a scene.
    pub const UNIT: RangeInclusive<f32> = 0.0..=1.0;
    /// Range of [`resolution`](Self::resolution) in a scene, cells a radius.
    pub const RESOLUTION: RangeInclusive<f32> = 1.0..=16.0;

    /// The settings with every value clamped to its range; a value that is not finite becomes the default.
    pub fn sanitized(self) -> Self {
        let default = Self::default();
        let or = |value: f32, default: f32| if value.is_finite() { value } else { default };
        let within = |value: Option<f32>, low: f32, high: f32| {
            value.filter(|value| value.is_finite()).map(|value| value.clamp(low, high))
        };
        Self {
            radius: within(self.radius, 0.0, 1.0e6),
            threshold: within(self.threshold, 0.0, 1.0e6),
            ambient_radius: within(self.ambient_radius, 0.0, 1.0e6),
            least: within(self.least, 0.0, 1.0),
            core: within(self.core, 0.0, 1.0e6),
            exponent: within(self.exponent, 0.01, 100.0),
            generator_share: or(self.generator_share, default.generator_share).clamp(0.0, 1.0),
            own_normal: or(self.own_normal, default.own_normal).clamp(0.0, 1.0),
            resolution: or(self.resolution, default.resolution).clamp(1.0, 16.0),
            surface_share: within(self.surface_share, 0.0, 1.0),
            ..self
        }
    }
}

/// The values that a bake went by.
#[derive(Clone, Copy, Debug, PartialEq, Reflect)]
pub struct ImplicitParameters {
    /// ρ, metres.
    pub radius: f32,
    /// τ, units of the field.
    pub threshold: f32,
    /// First radius of the ambient field, metres; ρ where the ambient term is as published.
    pub ambient_radius: f32,
    /// k_a_min, 0..=1.
    pub least: f32,
    /// d_min, units of the ambient field.
    pub core: f32,
    /// n.
    pub exponent: f32,
}

/// ρ in metres for a plant with `generators`, one a primitive, whose longest extent is `extent` metres: as the settings
/// say or as follows from the model. 0 where there are no generators or they have no extent.
pub fn radius(generators: &[Generator], extent: f32, settings: &ImplicitSettings) -> f32 {
    settings.radius.unwrap_or_else(|| relative_radius(generators, extent, RADIUS_SHARE, RADIUS_SPACINGS))
}

/// ρ in metres as a share of the longest extent, `extent` or that of `generators`, and at least as many mean distances between
/// neighbouring leaves as `spacings`. 0 where there are no generators or they have no extent.
pub fn relative_radius(generators: &[Generator], extent: f32, share: f32, spacings: f32) -> f32 {
    // One that has no area may lie anywhere.
    let counted = generators.iter().filter(|generator| generator.area > 0.0);
    let bounds = Aabb::around(counted.map(|generator| generator.position));
    let size = Vec3::from(bounds.size());
    let longest = size.max_element().max(extent);
    if generators.is_empty() || !longest.is_finite() || longest <= 0.0 {
        return 0.0;
    }
    // Leaves in a plane or a line have no volume: each side counts a hundredth of the longest at least.
    let relative = (size / longest).max(Vec3::splat(0.01));
    // The number of equal leaves that would vary as much as these: many tiny ones beside large ones do not count.
    let heaviest = generators.iter().map(|g| g.area).fold(0.0f32, f32::max);
    let shares = || generators.iter().map(|g| f64::from(if heaviest > 0.0 { g.area / heaviest } else { 1.0 }));
    let number = shares().sum::<f64>().powi(2) / shares().map(|share| share * share).sum::<f64>();
    let spacing = (f64::from(relative.element_product()) / number.max(1.0)).cbrt() as f32;
    share.max(spacings * spacing).min(1.0) * longest
}

/// The ambient field's first radius in metres for a plant whose longest extent is `extent` metres and whose field has
/// the radius `radius`: as the settings say or as follows from the model, 0 where there is no extent.
pub fn ambient_radius(radius: f32, extent: f32, settings: &ImplicitSettings) -> f32 {
    match settings.ambient {
        AmbientField::Published => radius,
        AmbientField::Depth => {
            settings.ambient_radius.unwrap_or(AMBIENT_SHARE * if extent > 0.0 { extent } else { 0.0 })
        }
    }
}

/// All values for a model with `generators`, one a primitive, and the `field` of them or of a share of them, whose
/// radius is kept, as is the ambient field's `ambient_radius`: as the settings say or as follows from the density at
/// the leaves.
pub fn parameters(
    generators: &[Generator],
    field: &DensityField,
    ambient_radius: f32,
    settings: &ImplicitSettings,
) -> ImplicitParameters {
    let share = SAMPLES as f32 / generators.len().max(1) as f32;
    let points: Vec<Vec3> = even_share(generators, share).iter().map(|generator| generator.position).collect();
    let mut densities = field.values(&points);
    densities.sort_by(f32::total_cmp);
    let median = densities.get(densities.len() / 2).copied().unwrap_or(0.0);
    let curve = settings.ambient.curve();
    let units = match settings.ambient {
        AmbientField::Published => per_leaf_area(generators, field.radius(), settings.weighting),
        AmbientField::Depth => 1.0,
    };
    ImplicitParameters {
        radius: field.radius(),
        threshold: settings.threshold.unwrap_or(THRESHOLD_SHARE * median),
        ambient_radius,
        least: settings.least.unwrap_or(curve.least),
        core: settings.core.unwrap_or(curve.core * units),
        exponent: settings.exponent.unwrap_or(curve.exponent),
    }
}

/// What the field of `generators` is with `weighting`, as a multiple of what it is by leaf area; 1 where there is none.
fn per_leaf_area(generators: &[Generator], radius: f32, weighting: Weighting) -> f32 {
    let sum = |weighting: Weighting| generators.iter().map(|g| f64::from(weighting.weight(g, radius))).sum::<f64>();
    let units = (sum(weighting) / sum(Weighting::LeafArea)) as f32;
    if units.is_finite() { units } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_are_moved_into_range() {
        let wild = ImplicitSettings {
            radius: Some(-1.0),
            threshold: Some(f32::NAN),
            least: Some(2.0),
            ambient_radius: Some(-0.5),
            core: Some(f32::INFINITY),
            exponent: Some(0.0),
            generator_share: f32::NAN,
            own_normal: -3.0,
            resolution: 1.0e9,
            surface_share: Some(7.0),
            ..ImplicitSettings::default()
        }
        .sanitized();
        assert_eq!((wild.radius, wild.threshold, wild.least, wild.core), (Some(0.0), None, Some(1.0), None));
        assert_eq!(wild.ambient_radius, Some(0.0));
        assert_eq!((wild.exponent, wild.generator_share, wild.own_normal), (Some(0.01), 1.0, 0.0));
        assert_eq!((wild.resolution, wild.surface_share), (16.0, Some(1.0)));
        assert_eq!(ImplicitSettings::default().sanitized(), ImplicitSettings::default());
    }

    #[test]
    fn automatic_values_scale_with_the_plant() {
        let of = |scale: f32| {
            let leaves: Vec<Generator> = (0..4000u32)
                .map(|i| Generator {
                    position: Vec3::new((i % 16) as f32, (i / 16 % 16) as f32, (i / 256) as f32) * scale,
                    area: scale * scale * 0.2,
                    primitives: 1.0,
                })
                .collect();
            let settings = ImplicitSettings::default();
            let field = DensityField::new(&leaves, radius(&leaves, 20.0 * scale, &settings), settings.weighting);
            parameters(&leaves, &field, ambient_radius(field.radius(), 20.0 * scale, &settings), &settings)
        };
        let (small, large) = (of(1.0e-4), of(1.0e3));
        assert!((small.radius / 1.0e-4 / (large.radius / 1.0e3) - 1.0).abs() < 1e-4);
        assert!((small.threshold / large.threshold - 1.0).abs() < 1e-3);
        assert!((small.ambient_radius / 1.0e-4 / (large.ambient_radius / 1.0e3) - 1.0).abs() < 1e-4);
        assert_eq!((small.core, small.least, small.exponent), (large.core, large.least, large.exponent));
        // Three times the distance of the leaves, as a tenth of 20 would be too little.
        assert!((2.3..3.5).contains(&(large.radius / 1.0e3)), "{}", large.radius);
        assert_eq!(radius(&[], 10.0, &ImplicitSettings::default()), 0.0);
    }
    #[test]
    fn the_published_core_is_in_leaves_where_leaves_are_counted() {
        // 500 leaves of 2 dm²: by area over ρ² and a constant of 0.957 each counts 0.02 / 4 / 0.957.
        let leaves: Vec<Generator> =
            (0..500u32).map(|i| Generator { position: Vec3::splat(i as f32), area: 0.02, primitives: 1.0 }).collect();
        let of = |weighting: Weighting| {
            let settings = ImplicitSettings { weighting, ambient: AmbientField::Published, ..Default::default() };
            parameters(&leaves, &DensityField::new(&leaves, 2.0, weighting), 2.0, &settings).core
        };
        let leaf = Weighting::LeafArea.weight(&leaves[0], 2.0);
        assert!((of(Weighting::Primitives) * leaf / of(Weighting::LeafArea) - 1.0).abs() < 1e-5);
    }
}
