//! The values of a species' lighting that can be adjusted, with their steps and ranges. Pure.
//!
//! Numbers that span decades are multiplied by a factor, fractions move by equal steps. Both are rounded, so that a
//! scene file stays readable. A number that was not set yet starts from its automatic value, which follows from the
//! plant.

use std::ops::RangeInclusive;

use crate::{
    bake::lighting::implicit::{AmbientField, ImplicitParameters, ImplicitSettings, NormalSource},
    scene::{Lighting, lighting::word},
};

/// A value that can be adjusted: a line of the panel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Line {
    /// The scene's own lighting or that of an implicit surface.
    Light,
    /// ρ.
    Radius,
    /// τ.
    Threshold,
    /// The field that the ambient term is computed from.
    Ambient,
    /// First radius of the depth field.
    AmbientRadius,
    /// d_min.
    Core,
    /// n.
    Exponent,
    /// k_a_min.
    Least,
    /// The source of the normals.
    Normals,
    /// Weight of a leaf's own normal.
    OwnNormal,
    /// Fraction of the leaves that are generators.
    Share,
}

/// All lines from top to bottom.
pub const LINES: [Line; 11] = [
    Line::Light,
    Line::Radius,
    Line::Threshold,
    Line::Ambient,
    Line::AmbientRadius,
    Line::Core,
    Line::Exponent,
    Line::Least,
    Line::Normals,
    Line::OwnNormal,
    Line::Share,
];

/// How a number is adjusted.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Step {
    /// By a factor; below the number given here comes the lower end of the range.
    Factor(f64),
    /// By one hundredth or five.
    Hundredths,
}

/// Factor of a step, and of a fine one. Rounding to three digits must not cancel the latter.
const FACTORS: (f64, f64) = (1.2, 1.02);
/// Hundredths of a step, and of a fine one.
const HUNDREDTHS: (f64, f64) = (5.0, 1.0);

impl Line {
    /// Its name in the panel.
    pub fn name(self) -> &'static str {
        match self {
            Self::Light => "lighting",
            Self::Radius => "radius \u{3c1}",
            Self::Threshold => "threshold \u{3c4}",
            Self::Ambient => "ambient term",
            Self::AmbientRadius => "ambient radius",
            Self::Core => "core d_min",
            Self::Exponent => "exponent n",
            Self::Least => "least k_a_min",
            Self::Normals => "normals",
            Self::OwnNormal => "leaf's own normal",
            Self::Share => "share of leaves",
        }
    }

    /// What it is and what a larger value does.
    pub fn tip(self) -> &'static str {
        match self {
            Self::Light => "How this species is lit in this session: as in its scene, or with an implicit surface.",
            Self::Radius => "Distance of a leaf's influence. Larger: a smoother crown.",
            Self::Threshold => "Density at the surface. Larger: a surface closer to the densest foliage.",
            Self::Ambient => {
                "Depth: leaves on the way out of the crown, at all radii. Published: density within rho minus tau."
            }
            Self::AmbientRadius => "First radius of the depth field. Larger: gaps between twigs are ignored.",
            Self::Core => "Depth or density at which the ambient light reaches that of the core. Larger: brighter.",
            Self::Exponent => "Below 1 the crown darkens late towards the core, above 1 early.",
            Self::Least => "Ambient light of the crown's core.",
            Self::Normals => {
                "Nearest: normal of the surface's nearest vertex, as published. Smooth: gradient of the density."
            }
            Self::OwnNormal => "Weight of each leaf's own normal in the result.",
            Self::Share => "Fraction of the leaves that form the surface. Smaller: a faster but less accurate bake.",
        }
    }

    fn unit(self) -> &'static str {
        if matches!(self, Self::Radius | Self::AmbientRadius) { " m" } else { "" }
    }

    fn number(self) -> Option<(RangeInclusive<f64>, Step)> {
        let (range, step) = match self {
            Self::Light | Self::Normals | Self::Ambient => return None,
            Self::AmbientRadius => (ImplicitSettings::AMBIENT_RADIUS, Step::Factor(1e-3)),
            Self::Radius => (ImplicitSettings::RADIUS, Step::Factor(as_written(*ImplicitSettings::RADIUS.start()))),
            Self::Threshold | Self::Core => (ImplicitSettings::DENSITY, Step::Factor(1e-3)),
            Self::Exponent => {
                (ImplicitSettings::EXPONENT, Step::Factor(as_written(*ImplicitSettings::EXPONENT.start())))
            }
            Self::Share => (ImplicitSettings::SHARE, Step::Factor(as_written(*ImplicitSettings::SHARE.start()))),
            Self::Least | Self::OwnNormal => (ImplicitSettings::UNIT, Step::Hundredths),
        };
        Some((as_written(*range.start())..=as_written(*range.end()), step))
    }

    /// The number; `None` if it is not set, and for lines that are not numbers.
    fn get(self, settings: &ImplicitSettings) -> Option<f64> {
        let default = ImplicitSettings::default();
        let value = match self {
            Self::Light | Self::Normals | Self::Ambient => None,
            Self::AmbientRadius => settings.ambient_radius,
            Self::Radius => settings.radius,
            Self::Threshold => settings.threshold,
            Self::Core => settings.core,
            Self::Exponent => settings.exponent,
            Self::Least => settings.least,
            Self::OwnNormal => Some(settings.own_normal).filter(|value| *value != default.own_normal),
            Self::Share => Some(settings.generator_share).filter(|value| *value != default.generator_share),
        };
        value.map(as_written)
    }

    /// Sets the number, or resets it to automatic.
    fn set(self, settings: &mut ImplicitSettings, value: Option<f64>) {
        let value = value.map(|value| value as f32);
        let default = ImplicitSettings::default();
        match self {
            Self::Light | Self::Normals | Self::Ambient => {}
            Self::AmbientRadius => settings.ambient_radius = value,
            Self::Radius => settings.radius = value,
            Self::Threshold => settings.threshold = value,
            Self::Core => settings.core = value,
            Self::Exponent => settings.exponent = value,
            Self::Least => settings.least = value,
            Self::OwnNormal => settings.own_normal = value.unwrap_or(default.own_normal),
            Self::Share => settings.generator_share = value.unwrap_or(default.generator_share),
        }
    }

    /// The value of a number that is not set; `None` until a bake has derived it from the plant.
    fn automatic(self, used: Option<&ImplicitParameters>) -> Option<f64> {
        let value = match self {
            Self::Light | Self::Normals | Self::Ambient => return None,
            Self::AmbientRadius => used?.ambient_radius.into(),
            Self::OwnNormal => 0.0,
            Self::Share => 1.0,
            Self::Radius => used?.radius.into(),
            Self::Threshold => used?.threshold.into(),
            Self::Core => used?.core.into(),
            Self::Exponent => used?.exponent.into(),
            Self::Least => used?.least.into(),
        };
        f64::is_finite(value).then_some(value)
    }
}

/// The lighting of a species: that of the scene, and the user's changes to it.
#[derive(Clone, Debug, PartialEq)]
pub struct Tuning {
    scene: Lighting,
    expressive: ImplicitSettings,
    is_expressive: bool,
}

impl Tuning {
    /// The scene's own lighting.
    pub fn new(scene: Lighting) -> Self {
        let (expressive, is_expressive) = match &scene {
            Lighting::Expressive(expressive) => (*expressive, true),
            Lighting::Local | Lighting::Transfer(_) => (ImplicitSettings::default(), false),
        };
        Self { scene, expressive, is_expressive }
    }

    /// The current lighting.
    pub fn lighting(&self) -> Lighting {
        if self.is_expressive { Lighting::Expressive(self.expressive) } else { self.scene.clone() }
    }

    /// The settings of the implicit surface, if one lights the species.
    pub fn expressive(&self) -> Option<&ImplicitSettings> {
        self.is_expressive.then_some(&self.expressive)
    }

    /// Whether the lighting differs from the scene's.
    pub fn is_changed(&self) -> bool {
        self.lighting() != self.scene
    }

    /// Lines that can be adjusted now.
    pub fn lines(&self) -> &'static [Line] {
        if self.is_expressive { &LINES } else { &LINES[..1] }
    }

    /// Adjusts a line up or down, by a small step if `fine`. `used` are the parameters of the last bake. `false` if
    /// nothing changed: at the end of a range, or if the automatic value is not known yet.
    pub fn adjust(&mut self, line: Line, up: bool, fine: bool, used: Option<&ImplicitParameters>) -> bool {
        let before = self.clone();
        match line {
            Line::Light => self.is_expressive = up || matches!(self.scene, Lighting::Expressive(_)),
            _ if !self.is_expressive => {}
            Line::Ambient => self.expressive.ambient = if up { AmbientField::Depth } else { AmbientField::Published },
            Line::Normals => {
                self.expressive.normals = if up { NormalSource::Gradient } else { NormalSource::NearestVertex }
            }
            _ => {
                let Some((range, step)) = line.number() else { return false };
                if let Some(value) = line.get(&self.expressive).or(line.automatic(used)) {
                    line.set(&mut self.expressive, Some(stepped(value, &range, step, up, fine)));
                }
            }
        }
        *self != before
    }

    /// Resets a line: a number to its automatic value, normals to the default, the lighting with all its values to the
    /// scene's. Returns whether anything changed.
    pub fn reset(&mut self, line: Line) -> bool {
        let before = self.clone();
        match line {
            Line::Light => *self = Self::new(self.scene.clone()),
            Line::Ambient => self.expressive.ambient = AmbientField::default(),
            Line::Normals => self.expressive.normals = NormalSource::default(),
            _ => line.set(&mut self.expressive, None),
        }
        *self != before
    }

    /// A line's value, as the panel shows it.
    pub fn value(&self, line: Line, used: Option<&ImplicitParameters>) -> String {
        let number = |value: f64| format!("{}{}", three_digits(value), line.unit());
        match (line, line.get(&self.expressive)) {
            (Line::Light, _) => {
                let name = match self.lighting() {
                    Lighting::Local => "local",
                    Lighting::Expressive(_) => "expressive",
                    Lighting::Transfer(_) => "transfer",
                };
                let origin = if self.is_changed() { "this session" } else { "from the scene" };
                format!("{name} ({origin})")
            }
            (Line::Ambient, _) => word(&self.expressive.ambient).to_lowercase(),
            (Line::Normals, _) => word(&self.expressive.normals).to_lowercase(),
            (_, Some(value)) => number(value),
            (_, None) => {
                line.automatic(used).map_or("automatic".to_owned(), |value| format!("{} (automatic)", number(value)))
            }
        }
    }
}

/// The decimal number that `value` is written as: 0.833, whereas `f64::from` gives 0.83300000429.
fn as_written(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(f64::from(value))
}

/// `value` after one step, clamped to `range`.
fn stepped(value: f64, range: &RangeInclusive<f64>, step: Step, up: bool, fine: bool) -> f64 {
    let of = |(coarse, small)| if fine { small } else { coarse };
    let next = match step {
        Step::Factor(least) if up => {
            if value < least {
                least
            } else {
                rounded(value * of(FACTORS))
            }
        }
        Step::Factor(least) => {
            let next = rounded(value / of(FACTORS));
            if next < least { *range.start() } else { next }
        }
        Step::Hundredths => {
            // A value between two steps goes to the next one; a value that only rounding moved off a step counts as on
            // it.
            let (step, hundredths) = (of(HUNDREDTHS), value * 100.0);
            let steps =
                if up { (hundredths / step + 1e-6).floor() + 1.0 } else { (hundredths / step - 1e-6).ceil() - 1.0 };
            steps * step / 100.0
        }
    };
    next.clamp(*range.start(), *range.end())
}

/// Number of decimals for three significant digits, for a `value` above 0.
fn decimals(value: f64) -> i32 {
    if value > 0.0 && value.is_finite() { 2 - value.log10().floor() as i32 } else { 0 }
}

/// Rounds to three significant digits.
fn rounded(value: f64) -> f64 {
    let decimals = decimals(value);
    let scale = 10f64.powi(decimals.abs());
    if decimals < 0 { (value / scale).round() * scale } else { (value * scale).round() / scale }
}

/// Writes a number with three significant digits, whole numbers with all of theirs.
fn three_digits(value: f64) -> String {
    format!("{:.*}", decimals(value).clamp(0, 9) as usize, rounded(value))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::scene::{Scene, Transfer};

    const USED: ImplicitParameters = ImplicitParameters {
        radius: 2.355,
        threshold: 1.71,
        ambient_radius: 0.23,
        least: 0.2,
        core: 7.392,
        exponent: 3.0,
    };

    fn expressive() -> Tuning {
        Tuning::new(Lighting::Expressive(ImplicitSettings::default()))
    }

    /// The light of a scene with `lighting` written into it.
    fn parsed(lighting: &str) -> Result<Option<Lighting>, crate::scene::SceneError> {
        let text = format!(
            "(terrain: Flat(size: 100), place: (latitude: 47, longitude: 9), species: [(name: \"a\", plant: Grown(), \
             lighting: {lighting})])"
        );
        Scene::parse(&text, "light.ron".as_ref()).map(|scene| scene.species[0].lighting.clone())
    }

    #[test]
    fn a_number_starts_from_its_automatic_value() {
        let mut tuning = expressive();
        assert_eq!(tuning.value(Line::Radius, Some(&USED)), "2.36 m (automatic)");
        assert!(!tuning.adjust(Line::Radius, true, false, None));
        assert!(tuning.adjust(Line::Radius, true, false, Some(&USED)));
        assert_eq!(tuning.value(Line::Radius, Some(&USED)), "2.83 m");
        assert!(tuning.adjust(Line::Least, false, false, Some(&USED)));
        assert!(tuning.adjust(Line::Least, true, true, Some(&USED)));
        assert_eq!(tuning.value(Line::Least, None), "0.160");
        assert_eq!(tuning.lighting().to_ron(), "Expressive(radius: 2.83, least: 0.16)");
        assert!(tuning.reset(Line::Radius) && tuning.reset(Line::Least) && !tuning.reset(Line::Least));
        assert_eq!(tuning, expressive());
    }

    #[test]
    fn another_lighting_lasts_for_the_session_and_can_be_reset() {
        let scene = Lighting::Transfer(Transfer { bands: 5, ..Transfer::default() });
        let mut tuning = Tuning::new(scene.clone());
        assert_eq!((tuning.lines(), tuning.lighting().to_ron()), (&[Line::Light][..], "Transfer(bands: 5)".to_owned()));
        assert!(
            !tuning.adjust(Line::Radius, true, false, Some(&USED)) && !tuning.adjust(Line::Light, false, false, None)
        );
        assert!(tuning.adjust(Line::Light, true, false, None) && tuning.is_changed());
        assert!(tuning.adjust(Line::Normals, true, false, None) && !tuning.adjust(Line::Normals, true, false, None));
        assert_eq!(tuning.lighting().to_ron(), "Expressive(normals: Smooth)");
        // Off and on again keeps the values, a reset does not.
        assert!(tuning.adjust(Line::Light, false, false, None) && !tuning.is_changed());
        assert!(
            tuning.adjust(Line::Light, true, false, None)
                && tuning.expressive().is_some_and(|e| *e != ImplicitSettings::default())
        );
        assert!(tuning.reset(Line::Light));
        assert_eq!(tuning, Tuning::new(scene));
        let mut own = expressive();
        assert!(!own.adjust(Line::Light, false, false, None) && own.expressive().is_some());
    }

    #[test]
    fn ranges_have_ends_that_can_be_reached_and_left() {
        for line in LINES {
            let Some((range, _)) = line.number() else { continue };
            let mut tuning = expressive();
            for (up, end) in [(false, *range.start()), (true, *range.end()), (false, *range.start())] {
                let mut steps = 0;
                while tuning.adjust(line, up, false, Some(&USED)) {
                    steps += 1;
                    assert!(steps < 300, "{line:?}");
                }
                let reached = line.get(&tuning.expressive).or(line.automatic(None));
                assert_eq!(reached, Some(end), "{line:?}");
            }
        }
    }

    #[test]
    fn numbers_have_three_digits() {
        for (value, text) in
            [(0.0, "0"), (1e-6, "0.00000100"), (0.0123456, "0.0123"), (1.0, "1.00"), (98765.0, "98800")]
        {
            assert_eq!(three_digits(value), text);
        }
    }

    proptest! {
        #[test]
        fn values_stay_in_range_and_survive_a_scene_file(
            moves in prop::collection::vec((0..LINES.len(), any::<bool>(), any::<bool>(), 0..12u8), 0..60),
            wild in prop::array::uniform6(prop_oneof![any::<f32>(), 0.0f32..10.0]),
            known in any::<bool>(),
        ) {
            let [radius, threshold, ambient_radius, least, core, exponent] = wild;
            let used = ImplicitParameters { radius, threshold, ambient_radius, least, core, exponent };
            let mut tuning = Tuning::new(Lighting::Local);
            tuning.adjust(Line::Light, true, false, None);
            for (line, up, fine, kind) in moves {
                match kind {
                    0 => tuning.reset(LINES[line]),
                    _ => tuning.adjust(LINES[line], up, fine, known.then_some(&used)),
                };
            }
            for line in LINES {
                if let (Some(value), Some((range, _))) = (line.get(&tuning.expressive), line.number()) {
                    prop_assert!(range.contains(&value), "{:?} {}", line, value);
                }
                prop_assert!(!tuning.value(line, Some(&used)).contains("NaN"));
            }
            prop_assert_eq!(parsed(&tuning.lighting().to_ron()).unwrap(), Some(tuning.lighting()));
        }

        #[test]
        fn a_step_back_undoes_a_step(value in 0.01f64..0.9, fine in any::<bool>(), decade in -1..3i32) {
            for line in [Line::Radius, Line::Threshold, Line::Core, Line::Least] {
                let Some((range, step)) = line.number() else { continue };
                let value = if step == Step::Hundredths { (value * 100.0).round() / 100.0 } else { value * 10f64.powi(decade) };
                let up = stepped(value, &range, step, true, fine);
                let back = stepped(up, &range, step, false, fine);
                prop_assert!(up > value);
                let near = if step == Step::Hundredths { 0.051 } else { 0.011 * value };
                prop_assert!((back - value).abs() <= near, "{:?} {} {} {}", line, value, up, back);
            }
        }
    }

    #[test]
    fn every_lighting_is_written_as_it_is_read() -> Result<(), Box<dyn std::error::Error>> {
        for text in [
            "Local",
            "Transfer()",
            "Transfer(bands: 6, color: true, rays: 16, bounces: 0, sun: Harmonics)",
            "Expressive()",
        ] {
            let light = parsed(text)?.ok_or("no light")?;
            assert_eq!(light.to_ron(), text);
        }
        Ok(())
    }
}
