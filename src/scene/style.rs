//! The style of a scene's pictures.

use std::path::Path;

use super::check::Check;
use crate::{
    math::names,
    style::{Palette, PaletteError, Paper, Style},
};

/// Checks the values of a style, and the names of its palette and its paper.
pub(super) fn check(style: &Style, check: &mut Check) {
    for (name, value, range) in style.numbers() {
        check.number(&format!("style.{name}"), value, range, "");
    }
    if let Some(paper) = style.paper().filter(|paper| Paper::named(paper).is_none()) {
        let known = Paper::ALL.map(Paper::name);
        let nearest = names::nearest(paper, known).unwrap_or_default();
        let remedy = format!("did you mean \"{nearest}\"? (known: {})", known.join(", "));
        check.problem("style.paper", format!("is \"{paper}\", which is no paper"), remedy);
    }
    if let Some(palette) = style.palette().filter(|palette| !Palette::is_file(palette))
        && let Err(PaletteError::Unknown { name, nearest }) = Palette::named(palette)
    {
        let remedy = format!("did you mean \"{nearest}\"? (or name a .ron file)");
        check.problem("style.palette", format!("is \"{name}\", which is no palette"), remedy);
    }
}

/// Prepends `folder` to the path of a palette's file.
pub(super) fn resolve(style: &mut Style, folder: &Path) {
    if let Some(palette) = style.palette_mut().filter(|palette| Palette::is_file(palette)) {
        *palette = folder.join(&*palette).to_string_lossy().into_owned();
    }
}
