//! The parameters of a species, from which individuals are grown.
//!
//! Names and meanings follow the parameter table of Weber & Penn 1995, "Creation and Rendering of Realistic Trees"
//! (SIGGRAPH 95), section 4 and appendix. Fields say where they differ from the paper. Angles are in degrees here, and
//! only here, because people write these files.

use serde::{Deserialize, Serialize};

use super::GrowError;

/// A species: everything that its individuals share. It is read from RON (`assets/species`), or comes from
/// [`GrowParameters::broadleaf`] or [`GrowParameters::conifer`]. The default is the broadleaf.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GrowParameters {
    /// Name for messages and reports.
    pub name: String,
    /// Outline of the crown: how long a bough may grow at each height (W&P `Shape`, 4.3). Default `Cylindrical`, with
    /// which `pruning` alone determines the outline.
    pub shape: CrownShape,
    /// Mean height of the trunk in metres, 1 to 60 (W&P `Scale`). Default 21.4. Foliage extends above it by less
    /// than a cluster.
    pub height: f32,
    /// Largest deviation of an individual's height in metres, 0 to half the height (W&P `ScaleV`). Default 1.6.
    pub height_variation: f32,
    /// Radius of the trunk divided by its length, 0.002 to 0.05 (W&P `Ratio`). Default 0.0112. Higher: stouter.
    pub ratio: f32,
    /// Exponent that gives the ratio of radii of a branch and its parent from the ratio of their lengths, 0.5 to 3 (W&P
    /// `RatioPower`). Default 1.2. Higher: thinner boughs on the same trunk.
    pub ratio_power: f32,
    /// Widening of the trunk's foot as a fraction of its radius, 0 to 3 (W&P `Flare`, 4.4). Default 0.6.
    pub flare: f32,
    /// Number of root lobes around the foot, 0 to 12 (W&P `Lobes`). Default 6.
    pub lobes: u32,
    /// Depth of the lobes as a fraction of the radius, 0 to 0.4 (W&P `LobeDepth`). Default 0.14. Unlike in the
    /// paper, the lobes fade out with the flare.
    pub lobe_depth: f32,
    /// Maximum lean of the trunk at its foot in degrees, 0 to 20. Default 2.5. Not in the paper.
    pub lean_deg: f32,
    /// How much the crown differs from a body of revolution: the fraction of bough length, 0 to 0.8, by which whole
    /// sides of the crown are longer or shorter. Default 0.3. Not in the paper. It gives individuals their character.
    pub irregularity: f32,
    /// An envelope for the tips of boughs and of the trunk's prongs (W&P 4.6), or `None` for free growth. Default
    /// `Some`: a dome.
    pub pruning: Option<Pruning>,
    /// The trunk. Its `length` is a fraction of the height.
    pub trunk: StemParameters,
    /// The levels of branches: boughs on the trunk, branches on boughs, twigs on branches; 1 to 3 entries. The last
    /// level carries the foliage, together with the outer parts of the levels before it.
    pub branches: Vec<BranchParameters>,
    /// The foliage.
    pub leaves: LeafParameters,
    /// The bark.
    pub bark: BarkParameters,
    /// Fraction of the triangles that wood may use, 0.05 to 0.8. Default 0.36. Higher: rounder wood and more twigs, but
    /// fewer and larger leaf clusters.
    pub wood_share: f32,
}

/// A stem of any level, by itself (W&P 4.1).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct StemParameters {
    /// Length as a fraction of the parent's, 0.01 to 1.5; of the height for the trunk (W&P `nLength`). Default 0.4.
    pub length: f32,
    /// Largest deviation of `length`, 0 to `length` (W&P `nLengthV`). Default 0.05.
    pub length_variation: f32,
    /// Number of segments of the stem, 1 to 40 (W&P `nCurveRes`). Default 5. More segments approximate the curve
    /// better.
    pub segments: u32,
    /// Taper, 0 to 2 (W&P `nTaper`, 4.4): 0 is a cylinder, 1 a cone, and between 1 and 2 the cone widens to a cylinder
    /// with a round end. Default 1.
    pub taper: f32,
    /// Rotation from base to tip in degrees, -360 to 360, positive away from the direction of the parent (W&P
    /// `nCurve`). Default 0. If `curve_back_deg` is not 0, it is the rotation from the base to the middle.
    pub curve_deg: f32,
    /// Rotation of the outer half in degrees, -360 to 360 (W&P `nCurveBack`). 0: `curve_deg` applies to the whole stem.
    /// Default 0.
    pub curve_back_deg: f32,
    /// Sum of the random rotations of the segments, in degrees, 0 to 720 (W&P `nCurveV`). Default 40. Higher: more
    /// gnarled.
    pub curve_variation_deg: f32,
    /// Attraction towards the zenith, -3 to 3; negative values make the stem hang (W&P `AttractionUp`, 4.8, which is
    /// one value for all levels from the second). A horizontal stem bends by about this many radians. Default 0.
    pub attraction_up: f32,
    /// Mean number of forks in the stem, 0 to 4 (W&P `nSegSplits` times `nCurveRes`, 4.2). Default 0.
    pub splits: f32,
    /// Fraction of the length beyond which forks appear, 0 to 1. Default 0.4. Not in the paper.
    pub split_from: f32,
    /// Angle between the two prongs of a fork in degrees, 0 to 120 (W&P `nSplitAngle`). Default 30.
    pub split_angle_deg: f32,
    /// Largest deviation of that angle in degrees, 0 to 90 (W&P `nSplitAngleV`). Default 10.
    pub split_angle_variation_deg: f32,
    /// Fraction of the length, from the base, without branches, 0 to 0.95 (W&P `BaseSize`, which is for the trunk
    /// only). Default 0.15.
    pub bare: f32,
}

/// The branches of a level, and how they are attached to their parents.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BranchParameters {
    /// The stem itself.
    pub stem: StemParameters,
    /// Number of branches on a parent of full length, 1 to 500 (W&P `nBranches`). Default 12.
    pub count: u32,
    /// Number of branches per whorl, 0 (spread evenly) to 12. Default 0. Not in the paper. Conifers grow one whorl a
    /// year.
    pub whorl: u32,
    /// Angle between the parent's direction and the branch in degrees, 0 to 180 (W&P `nDownAngle`). Default 45.
    pub down_angle_deg: f32,
    /// Deviation of that angle in degrees, -90 to 90 (W&P `nDownAngleV`). Positive: random, up to this value. Negative:
    /// ordered along the parent, with a larger angle at its base and a smaller one at its tip. Default 10.
    pub down_angle_variation_deg: f32,
    /// Rotation about the parent from one branch to the next in degrees, -180 to 180 (W&P `nRotate`). 137.5 is the
    /// golden angle. Negative: branches alternate left and right, this many degrees from the underside of the parent.
    /// Default 137.5.
    pub rotate_deg: f32,
    /// Largest deviation of that rotation in degrees, 0 to 180 (W&P `nRotateV`). Default 15.
    pub rotate_variation_deg: f32,
}

/// The foliage: cards textured with a leaf cluster (W&P 4.9 has single leaves).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LeafParameters {
    /// Shape of the leaves on the cards (W&P `LeafShape`). Default `Ovate`.
    pub shape: LeafShape,
    /// Number of clusters of size `scale` on a tree of mean height, 100 to 100000 (W&P `Leaves` over all branches).
    /// Default 13000. With fewer triangles there are fewer, larger clusters with the same total area.
    pub count: u32,
    /// Length of a cluster in metres, 0.02 to 2 (W&P `LeafScale`). Default 0.3.
    pub scale: f32,
    /// Width of a cluster divided by its length, 0.2 to 2 (W&P `LeafScaleX`). Default 1.
    pub aspect: f32,
    /// Largest deviation of a cluster's length as a fraction, 0 to 0.6. Default 0.25.
    pub scale_variation: f32,
    /// Angle between the twig and the cluster in degrees, 0 to 120 (W&P `nDownAngle` of the leaves). Default 40.
    pub down_angle_deg: f32,
    /// Largest deviation of that angle in degrees, 0 to 90. Default 25.
    pub down_angle_variation_deg: f32,
    /// Rotation about the twig from one cluster to the next in degrees, -180 to 180, as for branches. Default 137.5.
    pub rotate_deg: f32,
    /// How much clusters droop towards the ground, 0 (not at all) to 1 (most hang). Default 0.15.
    pub droop: f32,
    /// How much the upper sides of clusters face the light (outwards and up), 0 (not at all) to 1 (W&P `LeafBend`,
    /// 4.9). Default 0.5.
    pub bend: f32,
    /// Angle by which each half of a cluster is folded along its twig in degrees, 0 to 60. Default 18. Only clusters
    /// with enough triangles are folded.
    pub fold_deg: f32,
    /// Weight of the crown's outward direction in the shading normals, 0 (the card's own normal) to 1. Default 0.55.
    pub normal_bend: f32,
    /// How much the inside of the crown is thinned out, 0 (not at all) to 1 (leaves only at the outside). Default 0.65.
    pub shell: f32,
    /// Linear factor on the painted colour, 0 to 1 each. Default white.
    pub tint: [f32; 3],
    /// Largest deviation of an individual's tint as a fraction, 0 to 0.5. Default 0.12.
    pub tint_variation: f32,
    /// Transmitted light in linear colour, as a factor on the leaf's colour without gloss, 0 to 2 each.
    /// [`LeafKind`](crate::plant::LeafKind) has typical values: 1.3 for thin leaves, 0.7 for leathery ones, 0.5 for
    /// needles. Default (1.3, 1.3, 1.3).
    pub transmission: [f32; 3],
}

/// The bark.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BarkParameters {
    /// Kind of the bark. Default `Fissured`.
    pub kind: BarkKind,
    /// Width in metres of one repeat of the texture on the trunk, 0.05 to 5. Default 0.7. The texture is twice as high
    /// as wide. On thin branches it repeats once around, in the same proportions.
    pub tile: f32,
    /// Linear factor on the painted colour, 0 to 1 each. Default white.
    pub tint: [f32; 3],
}

/// The envelope of W&P 4.6: `r / height < width * shape(h)`, widest at the fraction `width_peak` of the crown. It
/// differs from the paper: it follows a bent trunk half-way, its sides differ by `irregularity`, each bough may exceed
/// or miss it by up to 16 %, and branches thinner than boughs are free.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pruning {
    /// Largest radius as a fraction of the height, 0.02 to 2 (W&P `PruneWidth`).
    pub width: f32,
    /// Height of the widest point, as a fraction of the crown from below, 0.05 to 0.95 (W&P `PruneWidthPeak`).
    pub width_peak: f32,
    /// Shape below the widest point, 0.05 to 5 (W&P `PrunePowerLow`): below 1 convex, 1 straight, above 1 concave.
    pub power_low: f32,
    /// Shape above the widest point, in the same way (W&P `PrunePowerHigh`).
    pub power_high: f32,
}

/// Outlines of crowns (W&P 4.3, `ShapeRatio`).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum CrownShape {
    /// Widest below, straight to the top.
    Conical,
    /// Conical, but more pointed, and narrower at the shaded base: spruces. Not in the paper.
    Spire,
    /// Widest in the middle.
    Spherical,
    /// Widest below, round above.
    Hemispherical,
    /// The same width everywhere.
    Cylindrical,
    /// Slightly wider below.
    TaperedCylindrical,
    /// Widest at 30 % of the crown, pointed above and below.
    Flame,
    /// Widest at the top.
    InverseConical,
    /// Widest at 30 % of the crown, half as wide at the top and at the base: most broadleaves.
    TendFlame,
}

/// Shape of the leaves in a cluster.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum LeafShape {
    /// A twig with pointed oval leaves (beech).
    Ovate,
    /// A twig with lobed leaves (oak).
    Lobed,
    /// A twig with side twigs full of needles (spruce).
    Needles,
}

/// Kinds of bark.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum BarkKind {
    /// Long ridges between dark fissures (oak).
    Fissured,
    /// Small round scales (spruce).
    Scaly,
}

/// Maximum number of stems of a species.
const MAX_STEMS: u64 = 60_000;

impl CrownShape {
    /// Relative length of boughs at `ratio` of the crown, 0 at its top and 1 at its base (W&P 4.3).
    pub fn ratio(self, ratio: f32) -> f32 {
        let r = ratio.clamp(0.0, 1.0);
        let pi = std::f32::consts::PI;
        match self {
            Self::Conical => 0.2 + 0.8 * r,
            Self::Spire => (0.04 + 0.96 * r.powf(0.85)) * (1.0 - 0.4 * ((r - 0.86) / 0.14).max(0.0)),
            Self::Spherical => 0.2 + 0.8 * (pi * r).sin(),
            Self::Hemispherical => 0.2 + 0.8 * (0.5 * pi * r).sin(),
            Self::Cylindrical => 1.0,
            Self::TaperedCylindrical => 0.5 + 0.5 * r,
            Self::Flame => peak(r),
            Self::InverseConical => 1.0 - 0.8 * r,
            Self::TendFlame => 0.5 + 0.5 * peak(r),
        }
    }
}

/// Rises to 1 at 0.7 and falls to 0 at 1.
fn peak(r: f32) -> f32 {
    if r <= 0.7 { r / 0.7 } else { (1.0 - r) / 0.3 }
}

impl Pruning {
    /// Largest radius at `ratio` of the crown (0 top, 1 base), as a fraction of the height (W&P 4.6).
    pub fn radius(&self, ratio: f32) -> f32 {
        let below = 1.0 - self.width_peak;
        if !(0.0..=1.0).contains(&ratio) {
            0.0
        } else if ratio < below {
            self.width * (ratio / below).powf(self.power_high)
        } else {
            self.width * ((1.0 - ratio) / self.width_peak).powf(self.power_low)
        }
    }
}

impl GrowParameters {
    /// Reads a species from RON text and validates it.
    ///
    /// # Errors
    /// [`GrowError::Syntax`] with line and column for text that is not a species, or has unknown fields;
    /// [`GrowError::Parameter`] for a value out of range.
    pub fn from_ron(text: &str) -> Result<Self, GrowError> {
        let options = ron::Options::default().with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
        let species: Self = options.from_str(text).map_err(|error| GrowError::Syntax {
            line: error.span.start.line,
            column: error.span.start.col,
            message: error.code.to_string(),
        })?;
        species.validate()?;
        Ok(species)
    }

    /// Checks every number against its range.
    ///
    /// # Errors
    /// [`GrowError::Parameter`] with the first field that is out of range or not finite, its value and its range.
    pub fn validate(&self) -> Result<(), GrowError> {
        check("height", self.height, 1.0, 60.0)?;
        check("height_variation", self.height_variation, 0.0, 0.5 * self.height)?;
        check("ratio", self.ratio, 0.002, 0.05)?;
        check("ratio_power", self.ratio_power, 0.5, 3.0)?;
        check("flare", self.flare, 0.0, 3.0)?;
        check("lobes", self.lobes as f32, 0.0, 12.0)?;
        check("lobe_depth", self.lobe_depth, 0.0, 0.4)?;
        check("lean_deg", self.lean_deg, 0.0, 20.0)?;
        check("irregularity", self.irregularity, 0.0, 0.8)?;
        check("wood_share", self.wood_share, 0.05, 0.8)?;
        if let Some(pruning) = &self.pruning {
            check("pruning.width", pruning.width, 0.02, 2.0)?;
            check("pruning.width_peak", pruning.width_peak, 0.05, 0.95)?;
            check("pruning.power_low", pruning.power_low, 0.05, 5.0)?;
            check("pruning.power_high", pruning.power_high, 0.05, 5.0)?;
        }
        self.trunk.validate("trunk")?;
        check("number of entries in branches", self.branches.len() as f32, 1.0, 3.0)?;
        let mut stems = 1u64;
        for (index, branch) in self.branches.iter().enumerate() {
            branch.validate(&format!("branches[{index}]"))?;
            stems = stems.saturating_mul(u64::from(branch.count));
        }
        if stems > MAX_STEMS {
            return Err(GrowError::Parameter {
                field: "product of branches[..].count".into(),
                value: stems as f32,
                low: 1.0,
                high: MAX_STEMS as f32,
            });
        }
        self.leaves.validate()?;
        check("bark.tile", self.bark.tile, 0.05, 5.0)?;
        check_color("bark.tint", self.bark.tint)
    }
}

impl StemParameters {
    fn validate(&self, at: &str) -> Result<(), GrowError> {
        let check = |field: &str, value, low, high| check(&format!("{at}.{field}"), value, low, high);
        check("length", self.length, 0.01, 1.5)?;
        check("length_variation", self.length_variation, 0.0, self.length)?;
        check("segments", self.segments as f32, 1.0, 40.0)?;
        check("taper", self.taper, 0.0, 2.0)?;
        check("curve_deg", self.curve_deg, -360.0, 360.0)?;
        check("curve_back_deg", self.curve_back_deg, -360.0, 360.0)?;
        check("curve_variation_deg", self.curve_variation_deg, 0.0, 720.0)?;
        check("attraction_up", self.attraction_up, -3.0, 3.0)?;
        check("splits", self.splits, 0.0, 4.0)?;
        check("split_from", self.split_from, 0.0, 1.0)?;
        check("split_angle_deg", self.split_angle_deg, 0.0, 120.0)?;
        check("split_angle_variation_deg", self.split_angle_variation_deg, 0.0, 90.0)?;
        check("bare", self.bare, 0.0, 0.95)
    }
}

impl BranchParameters {
    fn validate(&self, at: &str) -> Result<(), GrowError> {
        self.stem.validate(&format!("{at}.stem"))?;
        let check = |field: &str, value, low, high| check(&format!("{at}.{field}"), value, low, high);
        check("count", self.count as f32, 1.0, 500.0)?;
        check("whorl", self.whorl as f32, 0.0, 12.0)?;
        check("down_angle_deg", self.down_angle_deg, 0.0, 180.0)?;
        check("down_angle_variation_deg", self.down_angle_variation_deg, -90.0, 90.0)?;
        check("rotate_deg", self.rotate_deg, -180.0, 180.0)?;
        check("rotate_variation_deg", self.rotate_variation_deg, 0.0, 180.0)
    }
}

impl LeafParameters {
    fn validate(&self) -> Result<(), GrowError> {
        check("leaves.count", self.count as f32, 100.0, 100_000.0)?;
        check("leaves.scale", self.scale, 0.02, 2.0)?;
        check("leaves.aspect", self.aspect, 0.2, 2.0)?;
        check("leaves.scale_variation", self.scale_variation, 0.0, 0.6)?;
        check("leaves.down_angle_deg", self.down_angle_deg, 0.0, 120.0)?;
        check("leaves.down_angle_variation_deg", self.down_angle_variation_deg, 0.0, 90.0)?;
        check("leaves.rotate_deg", self.rotate_deg, -180.0, 180.0)?;
        check("leaves.droop", self.droop, 0.0, 1.0)?;
        check("leaves.bend", self.bend, 0.0, 1.0)?;
        check("leaves.fold_deg", self.fold_deg, 0.0, 60.0)?;
        check("leaves.normal_bend", self.normal_bend, 0.0, 1.0)?;
        check("leaves.shell", self.shell, 0.0, 1.0)?;
        check("leaves.tint_variation", self.tint_variation, 0.0, 0.5)?;
        check_color("leaves.tint", self.tint)?;
        check_factors("leaves.transmission", self.transmission, 2.0)
    }
}

fn check(field: &str, value: f32, low: f32, high: f32) -> Result<(), GrowError> {
    // NaN is in no range.
    if (low..=high).contains(&value) {
        Ok(())
    } else {
        Err(GrowError::Parameter { field: field.to_owned(), value, low, high })
    }
}

fn check_color(field: &str, color: [f32; 3]) -> Result<(), GrowError> {
    check_factors(field, color, 1.0)
}

fn check_factors(field: &str, factors: [f32; 3], high: f32) -> Result<(), GrowError> {
    factors.iter().enumerate().try_for_each(|(i, &value)| check(&format!("{field}[{i}]"), value, 0.0, high))
}
