//! What a user chooses: the style of the picture and its values.

use bevy::reflect::{Reflect, std_traits::ReflectDefault};
use ron::{extensions::Extensions, ser::PrettyConfig};
use serde::{Deserialize, Serialize};

use super::{
    palette::{BUILT_IN, NAMES},
    paper::Paper,
};
use crate::math::{Range, names::Names};

/// The style in which a scene is drawn. In a scene file, `style: Watercolour(palette: "sepia")`.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize, Reflect)]
#[reflect(Default)]
pub enum Style {
    /// As a camera sees it.
    #[default]
    Photograph,
    /// Watercolour on paper [Luft 2006].
    #[serde(alias = "Watercolor")]
    Watercolour(Watercolour),
    /// Contours from discontinuities of depth and normal [Luft 2007, section 4].
    Lines(Lines),
    /// Few tones of each colour, with contours [Luft 2007, section 4].
    Toon(Toon),
}

/// Values of a watercolour. Lengths in pixels are those of a picture of 720 lines, and grow with others.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, Reflect)]
#[reflect(Default)]
#[serde(deny_unknown_fields, default)]
pub struct Watercolour {
    /// Name of a palette, or the path of a palette's `.ron` file. Default `"natural"`.
    #[reflect(@Names(NAMES), @"The pigments.")]
    pub palette: String,
    /// Name of a paper: `"hot-pressed"`, `"cold-pressed"`, `"rough"`, `"laid"` or `"canvas"`. Default `"cold-pressed"`.
    #[reflect(@Names(Paper::NAMES), @"The paper.")]
    pub paper: String,
    /// Standard deviation in pixels of the Gaussian that simplifies shapes, 0 to 20. Default 2.5.
    #[reflect(@Range::steps(0.0..=20.0, 0.5, 0.1).unit("px"), @"How far shapes are simplified.")]
    pub simplification: f32,
    /// Darkening of the rims of washes, 0 to 3. Default 0.9.
    #[reflect(@Range::steps(0.0..=3.0, 0.1, 0.02), @"Darkening of the rims of washes.")]
    pub edges: f32,
    /// Pigment that settles in the paper's valleys, 0 to 3. Default 0.9.
    #[reflect(@Range::steps(0.0..=3.0, 0.1, 0.02), @"Pigment in the valleys of the paper.")]
    pub granulation: f32,
    /// How wet the paper is, 0 to 1: 0 paints wet-on-dry with sharp rims, 1 wet-in-wet. Default 0.3.
    #[reflect(@Range::fraction(0.0..=1.0), @"0: sharp washes on dry paper. 1: soft ones on wet paper.")]
    pub wetness: f32,
    /// Flow of the pigment inside a wash, 0 to 2. Default 0.5.
    #[reflect(@Range::steps(0.0..=2.0, 0.1, 0.02), @"Uneven pigment inside a wash.")]
    pub flow: f32,
    /// Strength of the layer of shadows, 0 to 2. Default 1.
    #[reflect(@Range::steps(0.0..=2.0, 0.1, 0.02), @"Strength of the layer of shadows.")]
    pub shadow: f32,
    /// Depth in metres over which shadows begin, δ of the blurred depth test, 0 to 20. Default 2.
    #[reflect(@Range::steps(0.0..=20.0, 0.5, 0.1).unit("m"), @"Softness of shadows.")]
    pub shadow_softness: f32,
    /// Strength of the dabs of foliage, 0 to 2. Default 1.
    #[reflect(@Range::steps(0.0..=2.0, 0.1, 0.02), @"Dabs of foliage over the washes.")]
    pub dabs: f32,
    /// How much of the textures of near plants is painted, in three intensities [Luft 2006, 4.3], 0 to 1. Default 0.7.
    #[reflect(@Range::fraction(0.0..=1.0), @"Textures of near plants, in three intensities.")]
    pub textures: f32,
    /// Strength of the pencil drawing under the paint, 0 to 2. Default 0.5.
    #[reflect(@Range::steps(0.0..=2.0, 0.1, 0.02), @"The pencil drawing under the paint.")]
    pub sketch: f32,
    /// How much the distance fades, 0 to 1. Default 0.7.
    #[reflect(@Range::fraction(0.0..=1.0), @"How much the distance fades.")]
    pub air: f32,
    /// To what the unevenness of the paint is fixed. Default `Scene`.
    #[reflect(@"To what the unevenness of the paint is fixed.")]
    pub noise: NoiseAnchor,
    /// Width of the unpainted margin as a fraction of the picture's height, 0 to 0.3. Default 0.
    #[reflect(@Range::fraction(0.0..=0.3), @"Unpainted margin.")]
    pub margin: f32,
}

impl Default for Watercolour {
    fn default() -> Self {
        Self {
            palette: BUILT_IN[0].0.to_owned(),
            paper: Paper::default().name().to_owned(),
            simplification: 2.5,
            edges: 0.9,
            granulation: 0.9,
            wetness: 0.3,
            flow: 0.5,
            shadow: 1.0,
            shadow_softness: 2.0,
            dabs: 1.0,
            textures: 0.7,
            sketch: 0.5,
            air: 0.7,
            noise: NoiseAnchor::default(),
            margin: 0.0,
        }
    }
}

/// To what noise and the trembling of lines are fixed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Deserialize, Serialize, Reflect)]
pub enum NoiseAnchor {
    /// To the scene, with the same size on paper at every distance [Bénard 2009]: nothing swims when the camera moves.
    #[default]
    Scene,
    /// To the page: for stills. In a film the scene moves behind it as behind the glass of a shower door.
    Page,
    /// To the scene, with the same size in metres at every distance: fine far away, coarse near.
    Solid,
}

/// Which normals contours are found in [Luft 2007, fig. 7].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Deserialize, Serialize, Reflect)]
pub enum LineNormals {
    /// Those of the leaves: clutter, for comparison (fig. 7 a).
    Own,
    /// Realigned to the crown's surface (fig. 7 b).
    Realigned,
    /// Realigned, and scaled by the ambient occlusion, which suppresses lines inside the crown (fig. 7 c).
    #[default]
    Scaled,
}

/// Values of a line drawing.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, Reflect)]
#[reflect(Default)]
#[serde(deny_unknown_fields, default)]
pub struct Lines {
    /// Name of a palette, or the path of its `.ron` file, of which paper and ink are used. Default `"natural"`.
    #[reflect(@Names(NAMES), @"The pigments.")]
    pub palette: String,
    /// Name of a paper. Default `"hot-pressed"`.
    #[reflect(@Names(Paper::NAMES), @"The paper.")]
    pub paper: String,
    /// Width of a line in pixels of a picture of 720 lines, 0.25 to 10. Default 2.
    #[reflect(@Range::steps(0.25..=10.0, 0.25, 0.05).unit("px"), @"Width of lines.")]
    pub width: f32,
    /// How small a discontinuity is drawn, 0 to 4. Default 1.
    #[reflect(@Range::steps(0.0..=4.0, 0.1, 0.02), @"How small a discontinuity is drawn.")]
    pub detail: f32,
    /// Standard deviation in pixels of a picture of 720 lines of the Gaussian that simplifies shapes, 0 to 20. Default 2. More gives
    /// fewer and smoother lines; what is smaller than `width` has none.
    #[reflect(@Range::steps(0.0..=20.0, 0.5, 0.1).unit("px"), @"How far shapes are simplified.")]
    pub simplification: f32,
    /// Which normals are used. Default `Scaled`.
    #[reflect(@"Normals in which contours are found.")]
    pub normals: LineNormals,
    /// To what the trembling of the pen is fixed. Default `Scene`.
    #[reflect(@"To what the trembling of the pen is fixed.")]
    pub noise: NoiseAnchor,
    /// Hatching of what lies in shade, 0 to 1. Default 0.5.
    #[reflect(@Range::fraction(0.0..=1.0), @"Hatching of what lies in shade.")]
    pub hatching: f32,
}

impl Default for Lines {
    fn default() -> Self {
        Self {
            palette: BUILT_IN[0].0.to_owned(),
            paper: Paper::HotPressed.name().to_owned(),
            width: 2.0,
            detail: 1.0,
            simplification: 2.0,
            normals: LineNormals::default(),
            noise: NoiseAnchor::default(),
            hatching: 0.5,
        }
    }
}

/// Values of toon shading.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, Reflect)]
#[reflect(Default)]
#[serde(deny_unknown_fields, default)]
pub struct Toon {
    /// Name of a palette, or the path of its `.ron` file, of which sky, distance, ink and night are used. Default
    /// `"natural"`.
    #[reflect(@Names(NAMES), @"The pigments.")]
    pub palette: String,
    /// Tones of each colour, 2 to 8. Default 3.
    #[reflect(@Range::steps(2..=8, 1.0, 1.0), @"Tones of each colour.")]
    pub tones: u32,
    /// Width of the contours in pixels of a picture of 720 lines, 0 to 10; 0: none. Default 1.6.
    #[reflect(@Range::steps(0.0..=10.0, 0.25, 0.05).unit("px"), @"Width of contours; 0: none.")]
    pub width: f32,
    /// How small a discontinuity has a contour, 0 to 4. Default 0.8.
    #[reflect(@Range::steps(0.0..=4.0, 0.1, 0.02), @"How small a discontinuity has a contour.")]
    pub detail: f32,
    /// Which normals are used. Default `Scaled`.
    #[reflect(@"Normals in which contours are found.")]
    pub normals: LineNormals,
}

impl Default for Toon {
    fn default() -> Self {
        Self { palette: BUILT_IN[0].0.to_owned(), tones: 3, width: 1.6, detail: 0.8, normals: LineNormals::default() }
    }
}

impl Style {
    /// The style with all of its values as a scene file has it: `Watercolour(palette: "sepia", …)`, a value a line.
    pub fn to_ron(&self) -> String {
        let options = ron::Options::default().with_default_extension(Extensions::UNWRAP_VARIANT_NEWTYPES);
        let pretty = PrettyConfig::new().new_line("\n");
        options.to_string_pretty(self, pretty).unwrap_or_else(|_| "Photograph".to_owned())
    }

    /// Names on the command line, and the styles with their default values.
    pub const NAMES: [&str; 4] = ["photograph", "watercolour", "lines", "toon"];

    /// The style of this name with its default values. The American spelling is understood too.
    pub fn named(name: &str) -> Option<Self> {
        match name.trim() {
            "photograph" => Some(Self::Photograph),
            "watercolour" | "watercolor" => Some(Self::Watercolour(Watercolour::default())),
            "lines" => Some(Self::Lines(Lines::default())),
            "toon" => Some(Self::Toon(Toon::default())),
            _ => None,
        }
    }

    /// Its name, one of [`NAMES`](Self::NAMES).
    pub fn name(&self) -> &'static str {
        match self {
            Self::Photograph => "photograph",
            Self::Watercolour(_) => "watercolour",
            Self::Lines(_) => "lines",
            Self::Toon(_) => "toon",
        }
    }

    /// Whether it is drawn by passes of its own.
    pub fn is_drawn(&self) -> bool {
        *self != Self::Photograph
    }

    /// The palette that it names, if it has one.
    pub fn palette(&self) -> Option<&str> {
        match self {
            Self::Watercolour(watercolour) => Some(&watercolour.palette),
            Self::Lines(lines) => Some(&lines.palette),
            Self::Toon(toon) => Some(&toon.palette),
            Self::Photograph => None,
        }
    }

    /// The place for its palette's name, if it has one.
    pub fn palette_mut(&mut self) -> Option<&mut String> {
        match self {
            Self::Watercolour(watercolour) => Some(&mut watercolour.palette),
            Self::Lines(lines) => Some(&mut lines.palette),
            Self::Toon(toon) => Some(&mut toon.palette),
            Self::Photograph => None,
        }
    }

    /// The place for its paper's name, if it has one.
    pub fn paper_mut(&mut self) -> Option<&mut String> {
        match self {
            Self::Watercolour(watercolour) => Some(&mut watercolour.paper),
            Self::Lines(lines) => Some(&mut lines.paper),
            Self::Photograph | Self::Toon(_) => None,
        }
    }

    /// The name of the paper on which it is drawn, if there is one.
    pub fn paper(&self) -> Option<&str> {
        match self {
            Self::Watercolour(watercolour) => Some(&watercolour.paper),
            Self::Lines(lines) => Some(&lines.paper),
            Self::Photograph | Self::Toon(_) => None,
        }
    }

    /// Whether contours are looked for.
    pub fn has_contours(&self) -> bool {
        match self {
            Self::Photograph => false,
            Self::Watercolour(watercolour) => watercolour.edges > 0.0 || watercolour.sketch > 0.0,
            Self::Lines(_) => true,
            Self::Toon(toon) => toon.width > 0.0,
        }
    }

    /// The numbers that a user sets: name, value and range.
    pub fn numbers(&self) -> Vec<(&'static str, f32, std::ops::RangeInclusive<f32>)> {
        match self {
            Self::Photograph => Vec::new(),
            Self::Watercolour(w) => vec![
                ("simplification", w.simplification, 0.0..=20.0),
                ("edges", w.edges, 0.0..=3.0),
                ("granulation", w.granulation, 0.0..=3.0),
                ("wetness", w.wetness, 0.0..=1.0),
                ("flow", w.flow, 0.0..=2.0),
                ("shadow", w.shadow, 0.0..=2.0),
                ("shadow_softness", w.shadow_softness, 0.0..=20.0),
                ("dabs", w.dabs, 0.0..=2.0),
                ("textures", w.textures, 0.0..=1.0),
                ("sketch", w.sketch, 0.0..=2.0),
                ("air", w.air, 0.0..=1.0),
                ("margin", w.margin, 0.0..=0.3),
            ],
            Self::Lines(l) => {
                vec![
                    ("width", l.width, 0.25..=10.0),
                    ("detail", l.detail, 0.0..=4.0),
                    ("simplification", l.simplification, 0.0..=20.0),
                    ("hatching", l.hatching, 0.0..=1.0),
                ]
            }
            Self::Toon(t) => {
                vec![
                    ("tones", t.tones as f32, 2.0..=8.0),
                    ("width", t.width, 0.0..=10.0),
                    ("detail", t.detail, 0.0..=4.0),
                ]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_is_a_style_whose_defaults_are_in_range() {
        for name in Style::NAMES {
            let style = Style::named(name).expect("a style");
            assert!(style.numbers().into_iter().all(|(_, value, range)| range.contains(&value)), "{name}");
            assert!(style.paper().is_none_or(|paper| Paper::named(paper).is_some()));
            assert!(style.palette().is_none_or(|palette| BUILT_IN.iter().any(|(known, _)| *known == palette)));
            assert_eq!(style.is_drawn(), name != "photograph");
            let options = ron::Options::default().with_default_extension(Extensions::UNWRAP_VARIANT_NEWTYPES);
            assert_eq!(options.from_str::<Style>(&style.to_ron()).as_ref(), Ok(&style), "{}", style.to_ron());
        }
        assert_eq!(Style::named("watercolor"), Style::named("watercolour"));
        assert_eq!(Style::named("oil"), None);
    }
}
