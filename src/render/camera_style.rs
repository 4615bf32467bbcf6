//! The style of a camera. The passes that draw it are in [`style`](super::style).

use std::sync::Arc;

use bevy::{
    ecs::{
        component::Component,
        query::{Changed, QueryItem},
        reflect::ReflectComponent,
        system::Query,
    },
    log::warn,
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
    /// The style and its values. Another palette is read when its name changes; if it cannot be read, the old one stays and a warning
    /// says why.
    pub style: Style,
    /// The pigments.
    #[reflect(ignore, clone)]
    palette: Arc<Pigments>,
}

/// A palette and the name by which it was asked for; by default the first one of the program.
#[derive(Clone, Debug, PartialEq)]
struct Pigments {
    name: String,
    palette: Option<Palette>,
}

impl Default for Pigments {
    fn default() -> Self {
        let name = palette::NAMES[0];
        Self { name: name.to_owned(), palette: Palette::named(name).ok() }
    }
}

impl CanopyStyle {
    /// The style with the palette that it names, which is read from its file if it has one.
    ///
    /// # Errors
    /// [`PaletteError`].
    pub fn new(style: Style) -> Result<Self, PaletteError> {
        let name = style.palette().unwrap_or(palette::NAMES[0]).to_owned();
        let palette = Some(Palette::load(&name)?);
        Ok(Self { style, palette: Arc::new(Pigments { name, palette }) })
    }
}

/// Reads the palettes of styles that name another one than they have.
pub(super) fn follow_palettes(mut styles: Query<&mut CanopyStyle, Changed<CanopyStyle>>) {
    for mut style in &mut styles {
        let Some(name) = style.style.palette().filter(|name| *name != style.palette.name) else { continue };
        let palette = match Palette::load(name) {
            Ok(palette) => Some(palette),
            Err(error) => {
                warn!("{error}; the palette `{}` stays", style.palette.name);
                style.palette.palette.clone()
            }
        };
        // A name that cannot be read is not tried again.
        style.palette = Arc::new(Pigments { name: name.to_owned(), palette });
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
        self.palette.palette.as_ref()
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

#[cfg(test)]
mod tests {
    use bevy::ecs::{system::RunSystemOnce, world::World};

    use super::*;
    use crate::style::Watercolour;

    fn watercolour(palette: &str) -> Style {
        Style::Watercolour(Watercolour { palette: palette.to_owned(), ..Watercolour::default() })
    }

    #[test]
    fn pigments_follow_the_name_of_the_palette() -> Result<(), Box<dyn std::error::Error>> {
        let mut world = World::new();
        let camera = world.spawn(CanopyStyle::new(watercolour("natural"))?).id();
        let mut rename = |name: &str| -> Result<CanopyStyle, Box<dyn std::error::Error>> {
            world.get_mut::<CanopyStyle>(camera).ok_or("no style")?.style = watercolour(name);
            world.run_system_once(follow_palettes).map_err(|error| error.to_string())?;
            Ok(world.get::<CanopyStyle>(camera).ok_or("no style")?.clone())
        };
        let sepia = rename("sepia")?;
        assert_eq!(sepia, CanopyStyle::new(watercolour("sepia"))?);
        // A name without a palette keeps the pigments.
        let none = rename("no such palette")?;
        assert_eq!(none.palette.palette, sepia.palette.palette);
        assert_eq!(rename("indigo")?, CanopyStyle::new(watercolour("indigo"))?);
        Ok(())
    }
}
