//! The style of a camera. The passes that draw it are in [`style`](super::style).

use std::sync::Arc;

use bevy::{
    ecs::{component::Component, query::QueryItem, reflect::ReflectComponent},
    reflect::{Reflect, std_traits::ReflectDefault},
    render::{extract_component::ExtractComponent, sync_component::SyncComponent},
};

use crate::style::{Palette, PaletteError, Paper, Style, palette};

/// The style of a [`CanopyCamera`](crate::render::components::CanopyCamera): what it draws instead of a photograph. A camera
/// without it, or with [`Style::Photograph`], has a photograph.
///
/// ```
/// use canopy::{render::camera_style::CanopyStyle, style::{Style, Watercolour}};
///
/// let sepia = CanopyStyle::new(Style::Watercolour(Watercolour { palette: "sepia".to_owned(), ..Watercolour::default() }))?;
/// # Ok::<(), canopy::style::PaletteError>(())
/// ```
#[derive(Component, Clone, Debug, Default, PartialEq, Reflect)]
#[reflect(Component, Default)]
pub struct CanopyStyle {
    /// The style and its values. Another palette takes effect by [`CanopyStyle::new`] only.
    pub style: Style,
    /// The pigments.
    #[reflect(ignore, clone)]
    palette: Arc<Pigments>,
}

/// A palette; by default the first one of the program.
#[derive(Clone, Debug, PartialEq)]
struct Pigments(Option<Palette>);

impl Default for Pigments {
    fn default() -> Self {
        Self(Palette::named(palette::BUILT_IN[0].0).ok())
    }
}

impl CanopyStyle {
    /// The style with the palette that it names, which is read from its file if it has one.
    ///
    /// # Errors
    /// [`PaletteError`].
    pub fn new(style: Style) -> Result<Self, PaletteError> {
        let palette = Palette::load(style.palette())?;
        Ok(Self { style, palette: Arc::new(Pigments(Some(palette))) })
    }
}

/// A style that is drawn, on its camera in the render world.
#[derive(Component, Clone, Debug, PartialEq)]
pub struct DrawnStyle {
    /// Never [`Style::Photograph`].
    pub style: Style,
    palette: Arc<Pigments>,
}

impl DrawnStyle {
    /// The pigments.
    pub fn palette(&self) -> Option<&Palette> {
        self.palette.0.as_ref()
    }

    /// The paper: the default one for a name that is none.
    pub fn paper(&self) -> Paper {
        self.style.paper().and_then(Paper::named).unwrap_or_default()
    }

    /// Texels of the maps per pixel of the picture along each axis. Toon shading takes the mean of four, for smooth edges; the
    /// others have Gaussians.
    pub fn map_scale(&self) -> f32 {
        if matches!(self.style, Style::Toon(_)) { 2.0 } else { 1.0 }
    }
}

impl SyncComponent for CanopyStyle {
    type Target = DrawnStyle;
}

impl ExtractComponent for CanopyStyle {
    type QueryData = &'static Self;
    type QueryFilter = ();
    type Out = DrawnStyle;

    fn extract_component(item: QueryItem<'_, '_, Self::QueryData>) -> Option<DrawnStyle> {
        item.style.is_drawn().then(|| DrawnStyle { style: item.style.clone(), palette: item.palette.clone() })
    }
}
