//! What a user can edit of a reflected value: its fields as a list, and the edits. Pure.
//!
//! Numbers, switches, enums, names among others and `Option`s of numbers ("automatic") can be edited, in structs and enums of any
//! depth. A field states its range as a [`Range`] attribute, its names as a [`Names`] attribute and its tip as a `&'static str`
//! attribute.

use std::collections::HashMap;

use bevy::reflect::{
    Access, ParsedPath, PartialReflect, ReflectPath, ReflectRef, TypeRegistry,
    attributes::CustomAttributes,
    enums::{DynamicEnum, DynamicVariant, VariantInfo},
    std_traits::ReflectDefault,
    structs::DynamicStruct,
    tuple::DynamicTuple,
};

use crate::math::{Range, names::Names};

/// A field that can be edited.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    /// Its path in the value.
    pub path: ParsedPath,
    /// Number of choices that it depends on.
    pub depth: usize,
    /// Its name, for people.
    pub label: String,
    /// What it does; may be empty.
    pub tip: &'static str,
    /// Whether it differs from the initial value.
    pub is_changed: bool,
    /// What it holds.
    pub content: Content,
}

/// What a field holds.
#[derive(Clone, Debug, PartialEq)]
pub enum Content {
    /// A number.
    Number {
        /// The number; `None` is automatic.
        set: Option<f64>,
        /// What an automatic number currently is, if that is known.
        known: Option<f64>,
        /// What an edit begins with: the number, or else what is known, or else the value next to 0. `None` while it is not
        /// known yet.
        start: Option<f64>,
        /// Whether it can be automatic.
        optional: bool,
        /// Whether it is a whole number.
        whole: bool,
        /// Its range.
        range: Range,
    },
    /// On or off.
    Switch(bool),
    /// One of several variants or names.
    Choice {
        /// Index of the current one.
        selected: usize,
        /// Their names, for people.
        names: Vec<String>,
    },
    /// Something that cannot be edited here.
    Text(String),
}

/// An edit of a field.
#[derive(Clone, Debug, PartialEq)]
pub enum Edit {
    /// Sets a number.
    Number(f64),
    /// Makes a number automatic.
    Automatic,
    /// Switches on or off.
    Switch(bool),
    /// Chooses a variant or a name. A variant that was chosen before gets its fields back.
    Choose(usize),
    /// One step up or down.
    Step {
        /// Whether to increase it.
        up: bool,
        /// Whether to use a small step.
        fine: bool,
    },
    /// Takes the initial value, or the default where that has none.
    Reset,
}

/// A value that is edited, and what edits need.
pub struct Edited<'a> {
    /// The name of the value, if it is not a struct.
    pub name: &'a str,
    /// The value.
    pub value: &'a mut dyn PartialReflect,
    /// What it was at first.
    pub initial: &'a dyn PartialReflect,
    /// A struct with the current values of automatic numbers, by the names of their fields, once it is known; `None` where
    /// there is none.
    pub automatic: Option<Option<&'a dyn PartialReflect>>,
    /// Names of fields that are not shown.
    pub hidden: &'a [&'a str],
    /// Variants that were left, by path and name.
    pub left: &'a mut HashMap<(String, String), Box<dyn PartialReflect>>,
    /// Types and their defaults.
    pub registry: &'a TypeRegistry,
}

impl Edited<'_> {
    /// The fields from top to bottom.
    pub fn fields(&self) -> Vec<Field> {
        let mut list =
            List { initial: self.initial, automatic: self.automatic, hidden: self.hidden, fields: Vec::new() };
        list.walk(&*self.value, &At { name: self.name, path: Vec::new(), depth: 0, attributes: None });
        list.fields
    }

    /// Edits `field`, one of [`fields`](Self::fields). Returns whether the value has changed.
    pub fn edit(&mut self, field: &Field, edit: &Edit) -> bool {
        let before = self.value.to_dynamic();
        let edit = match (edit, &field.content) {
            (Edit::Step { up, fine }, Content::Number { start, whole, range, .. }) => match start {
                Some(value) => Edit::Number(range.stepped(*value, *up, *fine, *whole)),
                None => return false,
            },
            (Edit::Step { up, .. }, Content::Switch(_)) => Edit::Switch(*up),
            (Edit::Step { up, .. }, Content::Choice { selected, names }) => {
                let next = if *up { selected + 1 } else { selected.saturating_sub(1) };
                Edit::Choose(next.min(names.len().saturating_sub(1)))
            }
            _ => edit.clone(),
        };
        let reference = self.reference(field, &edit);
        let Ok(element) = field.path.reflect_element_mut(&mut *self.value) else { return false };
        match edit {
            Edit::Number(value) => set_number(element, Some(value)),
            Edit::Automatic => set_number(element, None),
            Edit::Switch(on) => {
                if let Some(slot) = element.try_downcast_mut::<bool>() {
                    *slot = on;
                }
            }
            Edit::Choose(_) | Edit::Reset => {
                // A variant that cannot be made leaves the value as it is.
                let _ = reference.map(|reference| element.try_apply(&*reference));
            }
            Edit::Step { .. } => {}
        }
        self.value.reflect_partial_eq(&*before) != Some(true)
    }

    /// What a choice or a reset of a field gives it.
    fn reference(&mut self, Field { path, content, .. }: &Field, edit: &Edit) -> Option<Box<dyn PartialReflect>> {
        match edit {
            Edit::Choose(index) => {
                let element = path.reflect_element(&*self.value).ok()?;
                if element.try_downcast_ref::<String>().is_some() {
                    let Content::Choice { names, .. } = content else { return None };
                    return Some(Box::new(names.get(*index)?.clone()));
                }
                let ReflectRef::Enum(current) = element.reflect_ref() else { return None };
                let variant = current.get_represented_enum_info()?.variant_at(*index)?;
                let initial = path.reflect_element(self.initial).ok();
                let (path, left) = (path.to_string(), current.variant_name().to_owned());
                if left == variant.name() {
                    return None;
                }
                self.left.insert((path.clone(), left), element.to_dynamic());
                let known = self.left.get(&(path, variant.name().to_owned())).map(|known| known.to_dynamic());
                known.or_else(|| self.variant(element, initial, variant))
            }
            Edit::Reset => {
                self.left.retain(|(left, _), _| !left.starts_with(&path.to_string()));
                let mut reference = self.initial.to_dynamic();
                // Where the initial value has another variant, that of the value with its default fields.
                for length in 0..path.0.len() {
                    let outer = ParsedPath(path.0[..length].to_vec());
                    let of = outer.reflect_element(&*self.value).ok()?;
                    let ReflectRef::Enum(current) = of.reflect_ref() else { continue };
                    let variant = current.get_represented_enum_info()?.variant(current.variant_name())?;
                    let other = outer.reflect_element_mut(&mut *reference).ok()?;
                    if !matches!(other.reflect_ref(), ReflectRef::Enum(other) if other.variant_name() == variant.name())
                    {
                        other.try_apply(&*self.variant(of, None, variant)?).ok()?;
                    }
                }
                Some(path.reflect_element(&*reference).ok()?.to_dynamic())
            }
            _ => None,
        }
    }

    /// `variant` of the enum `of`: the initial value if it is that, or else with default fields.
    fn variant(
        &self,
        of: &dyn PartialReflect,
        initial: Option<&dyn PartialReflect>,
        variant: &VariantInfo,
    ) -> Option<Box<dyn PartialReflect>> {
        let info = of.get_represented_type_info()?;
        let default = |id| Some(self.registry.get_type_data::<ReflectDefault>(id)?.default().into_partial_reflect());
        let is_variant = |value: &dyn PartialReflect| matches!(value.reflect_ref(), ReflectRef::Enum(value) if value.variant_name() == variant.name());
        if let Some(initial) = initial.filter(|initial| is_variant(*initial)) {
            return Some(initial.to_dynamic());
        }
        if let Some(whole) = default(info.type_id()).filter(|whole| is_variant(&**whole)) {
            return Some(whole);
        }
        let fields = match variant {
            VariantInfo::Unit(_) => DynamicVariant::Unit,
            VariantInfo::Tuple(info) => {
                let mut fields = DynamicTuple::default();
                for field in info.iter() {
                    fields.insert_boxed(default(field.type_id())?);
                }
                DynamicVariant::Tuple(fields)
            }
            VariantInfo::Struct(info) => {
                let mut fields = DynamicStruct::default();
                for field in info.iter() {
                    fields.insert_boxed(field.name(), default(field.type_id())?);
                }
                DynamicVariant::Struct(fields)
            }
        };
        Some(Box::new(DynamicEnum::new(variant.name(), fields)))
    }
}

/// An element on its way into the list.
struct At<'a> {
    name: &'a str,
    path: Vec<Access<'static>>,
    depth: usize,
    attributes: Option<&'a CustomAttributes>,
}

struct List<'a> {
    initial: &'a dyn PartialReflect,
    automatic: Option<Option<&'a dyn PartialReflect>>,
    hidden: &'a [&'a str],
    fields: Vec<Field>,
}

impl List<'_> {
    fn walk(&mut self, value: &dyn PartialReflect, at: &At) {
        if let Some((set, optional, whole)) = number(value) {
            let range = at.attributes.and_then(|attributes| attributes.get()).copied().unwrap_or(Range::ANY);
            let known = self.known(at.name).filter(|_| set.is_none());
            let start = set.or(known).or(self.automatic.is_none().then(|| 0.0f64.max(range.low).min(range.high)));
            return self.push(value, at, Content::Number { set, known, start, optional, whole, range });
        }
        if let Some(on) = value.try_downcast_ref() {
            return self.push(value, at, Content::Switch(*on));
        }
        let known_names = at.attributes.and_then(|attributes| attributes.get::<Names>());
        if let (Some(text), Some(known)) = (value.try_downcast_ref::<String>(), known_names) {
            let mut names: Vec<String> = known.0.iter().map(|name| (*name).to_owned()).collect();
            let selected = names.iter().position(|name| name == text.trim()).unwrap_or_else(|| {
                // Such as the path of a file.
                names.push(text.clone());
                names.len() - 1
            });
            return self.push(value, at, Content::Choice { selected, names });
        }
        let inner = match value.reflect_ref() {
            ReflectRef::Enum(current) => {
                let Some(info) = current.get_represented_enum_info() else { return };
                let names = info.variant_names().iter().map(|name| words(name)).collect();
                self.push(value, at, Content::Choice { selected: current.variant_index(), names });
                at.depth + 1
            }
            ReflectRef::Opaque(_) => return self.push(value, at, Content::Text(format!("{value:?}"))),
            _ => at.depth,
        };
        for (access, field, attributes) in children(value) {
            let name = match &access {
                Access::Field(name) if self.hidden.contains(&&**name) => continue,
                Access::Field(name) => name.to_string(),
                _ => at.name.to_owned(),
            };
            let path = at.path.iter().cloned().chain([access]).collect();
            self.walk(field, &At { name: &name, path, depth: inner, attributes });
        }
    }

    /// The current value of an automatic number.
    fn known(&self, name: &str) -> Option<f64> {
        let ReflectRef::Struct(fields) = self.automatic??.reflect_ref() else { return None };
        number(fields.field(name)?)?.0.filter(|value| value.is_finite())
    }

    fn push(&mut self, value: &dyn PartialReflect, at: &At, content: Content) {
        let path = ParsedPath::from(at.path.clone());
        let initial = path.reflect_element(self.initial).ok();
        let is_changed = initial.and_then(|initial| value.reflect_partial_eq(initial)) != Some(true);
        let unit = matches!(&content, Content::Number { range, .. } if !range.unit.is_empty());
        let label = if unit { words(without_unit(at.name)) } else { words(at.name) };
        let tip = at.attributes.and_then(|attributes| attributes.get()).copied().unwrap_or("");
        self.fields.push(Field { path, depth: at.depth, label, tip, is_changed, content });
    }
}

type Child<'a> = (Access<'static>, &'a dyn PartialReflect, Option<&'static CustomAttributes>);

/// The fields of a struct, tuple or enum with their attributes.
fn children(value: &dyn PartialReflect) -> Vec<Child<'_>> {
    let info = value.get_represented_type_info();
    let indexed = |(index, field)| (Access::TupleIndex(index), field, None);
    match value.reflect_ref() {
        ReflectRef::Struct(fields) => {
            let info = info.and_then(|info| info.as_struct().ok());
            let named = |(name, field): (&str, _)| {
                let attributes = info.and_then(|info| info.field(name)).map(|field| field.custom_attributes());
                (Access::Field(name.to_owned().into()), field, attributes)
            };
            fields.iter_fields().map(named).collect()
        }
        ReflectRef::TupleStruct(fields) => fields.iter_fields().enumerate().map(indexed).collect(),
        ReflectRef::Tuple(fields) => fields.iter_fields().enumerate().map(indexed).collect(),
        ReflectRef::Enum(current) => {
            let info = info.and_then(|info| info.as_enum().ok()?.variant(current.variant_name()));
            let mut children: Vec<Child> = Vec::with_capacity(current.field_len());
            for (index, field) in current.iter_fields().enumerate() {
                children.push(match (field.name(), info) {
                    (Some(name), Some(VariantInfo::Struct(info))) => {
                        let attributes = info.field(name).map(|field| field.custom_attributes());
                        (Access::Field(name.to_owned().into()), field.value(), attributes)
                    }
                    _ => (Access::TupleIndex(index), field.value(), None),
                });
            }
            children
        }
        _ => Vec::new(),
    }
}

/// The name of a type, field or variant as words: `AmbientField` and `ambient_field` become "ambient field".
pub fn words(name: &str) -> String {
    let mut text = String::new();
    for letter in name.chars() {
        if letter == '_' || letter.is_uppercase() && !text.is_empty() {
            text.push(' ');
        }
        text.extend(letter.to_lowercase().filter(|letter| *letter != '_'));
    }
    text
}

/// A field's name without the unit that it ends in.
fn without_unit(name: &str) -> &str {
    const UNITS: [&str; 6] = ["m", "km", "deg", "mbar", "c", "ev"];
    match name.rsplit_once('_') {
        Some((name, unit)) if UNITS.contains(&unit) => name,
        _ => name,
    }
}

/// The numbers that can be edited, as one type.
macro_rules! numbers {
    ($($type:ty, $whole:expr, $get:expr);*) => {
        /// A number, whether it can be automatic, and whether it is a whole one; `None` if `value` is not a number.
        fn number(value: &dyn PartialReflect) -> Option<(Option<f64>, bool, bool)> {
            $(
                if let Some(number) = value.try_downcast_ref::<$type>() {
                    return Some((Some($get(*number)), false, $whole));
                }
                if let Some(number) = value.try_downcast_ref::<Option<$type>>() {
                    return Some((number.map($get), true, $whole));
                }
            )*
            None
        }

        /// Sets a number, or makes it automatic if it can be.
        fn set_number(slot: &mut dyn PartialReflect, value: Option<f64>) {
            $(
                if let (Some(slot), Some(value)) = (slot.try_downcast_mut::<$type>(), value) {
                    *slot = (if $whole { value.round() } else { value }) as $type;
                    return;
                }
                if let Some(slot) = slot.try_downcast_mut::<Option<$type>>() {
                    *slot = value.map(|value| (if $whole { value.round() } else { value }) as $type);
                    return;
                }
            )*
        }
    };
}

numbers!(
    f32, false, as_written; f64, false, f64::from; u8, true, f64::from; u16, true, f64::from; u32, true, f64::from;
    u64, true, |n| n as f64; usize, true, |n| n as f64; i32, true, f64::from; i64, true, |n| n as f64
);

/// The decimal number that `value` is written as: 0.833, whereas `f64::from` gives 0.83300000429.
fn as_written(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(f64::from(value))
}

#[cfg(test)]
mod tests {
    use bevy::reflect::Reflect;
    use proptest::prelude::*;

    use super::*;
    use crate::{
        bake::lighting::implicit::{ImplicitParameters, ImplicitSettings},
        scene::{Lighting, Scene, Transfer},
    };

    static USED: ImplicitParameters = ImplicitParameters {
        radius: 2.355,
        threshold: 1.71,
        ambient_radius: 0.23,
        least: 0.2,
        core: 7.392,
        exponent: 3.0,
    };

    /// A setting as a later pass may have it.
    #[derive(Clone, Debug, Default, PartialEq, Reflect)]
    #[reflect(Default)]
    struct Style {
        #[reflect(@"How areas are filled.")]
        fill: Fill,
        #[reflect(@Range::factor(0.1..=10.0).unit("m"), @"Of an outline.")]
        width_m: Option<f32>,
        edge_count: u8,
        rate: f64,
        seed: (u64, String),
    }

    #[derive(Clone, Debug, PartialEq, Reflect)]
    struct Page {
        #[reflect(@Names(&["rough", "smooth", "laid"]), @"Of the page.")]
        paper: String,
    }

    #[derive(Clone, Debug, Default, PartialEq, Reflect)]
    enum Fill {
        #[default]
        Plain,
        Ramp {
            #[reflect(@Range::steps(2..=6, 1.0, 1.0))]
            steps: u8,
            is_soft: bool,
        },
        TwoTone(f32),
    }

    struct Subject<T> {
        value: T,
        initial: T,
        /// Whether the automatic values are known; `None` where there are none.
        known: Option<bool>,
        left: HashMap<(String, String), Box<dyn PartialReflect>>,
        registry: TypeRegistry,
    }

    impl<T: Reflect + Clone> Subject<T> {
        fn new(value: T) -> Self {
            let mut registry = TypeRegistry::new();
            registry.register_derived_types();
            Self { initial: value.clone(), value, known: Some(true), left: HashMap::new(), registry }
        }

        fn edited(&mut self) -> Edited<'_> {
            Edited {
                name: "light",
                value: self.value.as_partial_reflect_mut(),
                initial: self.initial.as_partial_reflect(),
                automatic: self.known.map(|known| known.then_some(USED.as_partial_reflect())),
                hidden: &["rate", "surface", "surface_share", "together"],
                left: &mut self.left,
                registry: &self.registry,
            }
        }

        fn field(&mut self, label: &str) -> Option<Field> {
            self.edited().fields().into_iter().find(|field| field.label == label)
        }

        /// Whether the edit changed anything.
        fn edit(&mut self, label: &str, edit: Edit) -> bool {
            let field = self.field(label).unwrap();
            self.edited().edit(&field, &edit)
        }

        fn step(&mut self, label: &str, up: bool, fine: bool) -> bool {
            self.edit(label, Edit::Step { up, fine })
        }

        fn labels(&mut self) -> Vec<(usize, String)> {
            self.edited().fields().into_iter().map(|field| (field.depth, field.label)).collect()
        }
    }

    fn labels(expected: &[(usize, &str)]) -> Vec<(usize, String)> {
        expected.iter().map(|(depth, label)| (*depth, (*label).to_owned())).collect()
    }

    #[test]
    fn a_text_is_chosen_among_its_names() {
        let mut subject = Subject::new(Page { paper: "smooth".to_owned() });
        let field = subject.field("paper").unwrap();
        let names = ["rough", "smooth", "laid"].map(str::to_owned).to_vec();
        assert_eq!((field.content, field.tip), (Content::Choice { selected: 1, names }, "Of the page."));
        let up = Edit::Step { up: true, fine: false };
        assert!(subject.edit("paper", up.clone()) && subject.value.paper == "laid");
        assert!(!subject.edit("paper", up), "there is no name behind the last");
        assert!(subject.edit("paper", Edit::Choose(0)) && subject.value.paper == "rough");
        assert!(subject.field("paper").unwrap().is_changed);
        assert!(!subject.edit("paper", Edit::Choose(17)));
        assert!(subject.edit("paper", Edit::Reset) && subject.value.paper == "smooth");
        // What is not among them stays until another is chosen.
        let mut subject = Subject::new(Page { paper: "mine.ron".to_owned() });
        let Content::Choice { selected, names } = subject.field("paper").unwrap().content else { panic!("no choice") };
        assert_eq!((selected, names.len(), names[3].as_str()), (3, 4, "mine.ron"));
        assert!(subject.edit("paper", Edit::Choose(1)) && subject.value.paper == "smooth");
    }

    #[test]
    fn any_reflected_setting_can_be_edited() {
        let mut style = Subject::new(Style::default());
        let plain = [(0, "fill"), (0, "width"), (0, "edge count"), (0, "seed"), (0, "seed")];
        assert_eq!(style.labels(), labels(&plain));
        assert_eq!(style.field("fill").map(|field| field.tip), Some("How areas are filled."));
        assert!(style.edit("fill", Edit::Choose(1)));
        assert_eq!(style.labels()[..3], labels(&[(0, "fill"), (1, "steps"), (1, "is soft")]));
        assert!(style.step("steps", true, false) && style.edit("is soft", Edit::Switch(true)));
        assert_eq!(style.value.fill, Fill::Ramp { steps: 2, is_soft: true });
        style.known = None;
        assert!(style.step("width", true, false) && style.value.width_m == Some(0.12));
        assert!(style.edit("width", Edit::Number(0.25)) && style.step("width", true, true));
        assert_eq!(style.value.width_m, Some(0.255));
        assert!(style.edit("width", Edit::Automatic) && style.value.width_m.is_none());
        assert!(style.edit("edge count", Edit::Number(1e9)) && style.value.edge_count == 255);
        assert!(style.field("edge count").is_some_and(|field| field.is_changed));
        // A variant that was left comes back as it was; a reset forgets it.
        assert!(style.step("fill", true, false) && style.value.fill == Fill::TwoTone(0.0));
        assert!(!style.step("fill", true, false) && style.step("fill", false, false));
        assert_eq!(style.value.fill, Fill::Ramp { steps: 2, is_soft: true });
        assert!(style.edit("steps", Edit::Reset) && style.value.fill == Fill::Ramp { steps: 0, is_soft: true });
        assert!(style.edit("fill", Edit::Reset) && style.edit("fill", Edit::Choose(1)));
        assert_eq!(style.value.fill, Fill::Ramp { steps: 0, is_soft: false });
        assert!(!style.edit("seed", Edit::Switch(true)));
    }

    #[test]
    fn words_are_those_of_the_names() {
        for (name, text) in [("AmbientField", "ambient field"), ("own_normal", "own normal"), ("Sun", "sun")] {
            assert_eq!(words(name), text);
        }
        assert_eq!((without_unit("visibility_km"), without_unit("map_size")), ("visibility", "map_size"));
    }

    #[test]
    fn a_number_starts_from_its_automatic_value() {
        let mut light = Subject::new(Lighting::Expressive(ImplicitSettings::default()));
        light.known = Some(false);
        assert!(!light.step("radius", true, false));
        light.known = Some(true);
        assert!(light.step("radius", true, false));
        assert!(light.step("least", false, false) && light.step("least", true, true));
        assert_eq!(light.value.to_ron(), "Expressive(radius: 2.83, least: 0.16)");
        assert!(light.edit("radius", Edit::Reset) && light.edit("least", Edit::Automatic));
        assert!(!light.edit("least", Edit::Reset));
        assert_eq!(light.value, light.initial);
    }

    #[test]
    fn another_lighting_lasts_for_the_session_and_can_be_reset() {
        let mut light = Subject::new(Lighting::Transfer(Transfer { bands: 5, ..Transfer::default() }));
        assert!(light.edit("light", Edit::Choose(1)) && light.edit("normals", Edit::Choose(1)));
        assert_eq!(light.value.to_ron(), "Expressive(normals: Smooth)");
        // There and back keeps the values, a reset does not.
        assert!(light.edit("light", Edit::Choose(2)) && light.value == light.initial);
        assert!(light.edit("light", Edit::Choose(1)) && light.value.to_ron() == "Expressive(normals: Smooth)");
        assert!(light.edit("light", Edit::Reset) && light.value == light.initial);
        assert!(light.edit("light", Edit::Choose(1)) && light.value.to_ron() == "Expressive()");
    }

    /// The lighting of a scene with `lighting` written into it.
    fn parsed(lighting: &str) -> Result<Option<Lighting>, crate::scene::SceneError> {
        let text = format!(
            "(terrain: Flat(size: 100), place: (latitude: 47, longitude: 9), species: [(name: \"a\", plant: Grown(), \
             lighting: {lighting})])"
        );
        Scene::parse(&text, "light.ron".as_ref()).map(|scene| scene.species[0].lighting.clone())
    }

    proptest! {
        #[test]
        fn values_stay_in_range_and_survive_a_scene_file(
            moves in prop::collection::vec((any::<usize>(), any::<bool>(), any::<bool>(), 0..12u8), 0..60),
            known in any::<bool>(),
        ) {
            let mut light = Subject::new(Lighting::Local);
            light.known = Some(known);
            light.edit("light", Edit::Choose(1));
            for (line, up, fine, kind) in moves {
                let fields = light.edited().fields();
                let field = &fields[line % fields.len()];
                let edit = if kind == 0 { Edit::Reset } else { Edit::Step { up, fine } };
                light.edited().edit(field, &edit);
            }
            for field in light.edited().fields() {
                if let Content::Number { set: Some(value), range, .. } = field.content {
                    prop_assert!((range.low as f32..=range.high as f32).contains(&(value as f32)), "{} {}", field.label, value);
                }
            }
            prop_assert_eq!(parsed(&light.value.to_ron()).unwrap(), Some(light.value.clone()));
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
