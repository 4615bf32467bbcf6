//! Draws the light panel.

use bevy_egui::egui::{Color32, Grid, RichText, Ui};

use super::{
    LightPanel, SpeciesTuning,
    baker::{PREVIEW_SHARE, Progress},
    tuning::Line,
};
use crate::app::fly::overlay::{NAME, SMALL, WARNING, small};

/// Width of the panel in points; its longest line needs it.
const WIDTH: f32 = 330.0;
const SELECTED: Color32 = Color32::from_rgb(255, 214, 120);

/// Keys of the panel, shown in its last lines.
const KEYS: [(&str, &str); 5] = [
    ("Up Down", "select a value"),
    ("Left Right", "adjust it; with Shift in small steps"),
    ("Backspace", "reset to automatic, or to the scene's lighting"),
    ("Tab", "next species"),
    ("Enter", "print for the scene file, in the terminal"),
];

/// Draws the panel.
pub fn light_panel(ui: &mut Ui, panel: &LightPanel) {
    let Some(species) = panel.species.get(panel.selected) else { return };
    ui.set_width(WIDTH);
    let (number, all) = (panel.selected + 1, panel.species.len());
    let which = if all > 1 { format!(" ({number} of {all})") } else { String::new() };
    ui.label(small(format!("Leaves of \"{}\"{which}", species.name)).strong());
    // A grid remembers its columns by its name.
    let name = ("canopy_light", species.tuning.lines().len());
    Grid::new(name).num_columns(2).spacing([10.0, 2.0]).show(ui, |ui| {
        for (number, line) in species.tuning.lines().iter().enumerate() {
            let selected = number == panel.line;
            let value = species.tuning.value(*line, species.values.as_ref());
            let (mark, color) = if selected { ("\u{25b6} ", SELECTED) } else { ("    ", NAME) };
            ui.label(small(format!("{mark}{}", line.name())).color(color)).on_hover_text(line.tip());
            let value = small(value);
            ui.label(if selected { value.color(SELECTED) } else { value }).on_hover_text(line.tip());
            ui.end_row();
        }
    });
    ui.label(RichText::new(selected_tip(species, panel.line)).size(SMALL - 1.0).color(NAME));
    ui.label(small(state(species, panel.baker.progress(panel.selected))));
    for text in panel.baker.failure().into_iter().chain(no_surface_note(species)) {
        ui.label(small(text).color(WARNING));
    }
    Grid::new("canopy_light_keys").num_columns(2).spacing([10.0, 0.0]).show(ui, |ui| {
        for (key, what) in KEYS {
            ui.label(RichText::new(key).size(SMALL - 1.0).strong());
            ui.label(RichText::new(what).size(SMALL - 1.0).color(NAME));
            ui.end_row();
        }
    });
}

fn selected_tip(species: &SpeciesTuning, line: usize) -> &'static str {
    match species.tuning.lines().get(line) {
        Some(Line::Light) | None if species.tuning.expressive().is_none() => {
            "Right: light this species with an implicit surface, for this session."
        }
        line => line.unwrap_or(&Line::Light).tip(),
    }
}

/// What is being baked, and how long the last adjustment took.
fn state(species: &SpeciesTuning, progress: Option<Progress>) -> String {
    let now = match progress {
        Some(Progress::Preview) => format!("preview with {:.0} % of the leaves ...", 100.0 * PREVIEW_SHARE),
        Some(Progress::Full(done, all)) => format!("full quality ({done} of {all}) ..."),
        Some(Progress::Crosses(done, all)) => format!("billboards ({done} of {all}) ..."),
        None => "up to date".to_owned(),
    };
    let names = ["preview", "full quality", "billboards"];
    let times = names.iter().zip(species.times).filter_map(|(name, time)| Some(format!("{name} {:.2} s", time?)));
    std::iter::once(now).chain(times).collect::<Vec<_>>().join("; ")
}

/// Why individuals use their leaves' own normals: the reason of the first one, and how many they are.
fn no_surface_note(species: &SpeciesTuning) -> Option<String> {
    let reasons: Vec<&String> = species.no_surface.iter().flatten().collect();
    let (first, all) = (reasons.first()?, species.no_surface.len());
    Some(if all > 1 { format!("{} of {all} plants: {first}", reasons.len()) } else { (*first).clone() })
}
