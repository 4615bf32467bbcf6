//! The panel of the leaves' light, as the overlay shows it.

use bevy_egui::egui::{Color32, Grid, RichText, Ui};

use super::{
    LightPanel, Turned,
    baker::{PREVIEW_SHARE, Progress},
    tuning::Line,
};
use crate::app::fly::overlay::{NAME, SMALL, small};

/// Points of the panel's width, which its longest line needs.
const WIDTH: f32 = 330.0;
const CHOSEN: Color32 = Color32::from_rgb(255, 214, 120);
const WARNING: Color32 = Color32::from_rgb(255, 150, 110);

/// Keys of the panel, as its last lines show them.
const KEYS: [(&str, &str); 5] = [
    ("Up Down", "choose a line"),
    ("Left Right", "turn it; with Shift finely"),
    ("Backspace", "back to automatic, or to the scene's light"),
    ("Tab", "next species"),
    ("Enter", "write for the scene file, into the terminal"),
];

/// Draws the panel.
pub fn light_panel(ui: &mut Ui, panel: &LightPanel) {
    let Some(species) = panel.species.get(panel.chosen) else { return };
    ui.set_width(WIDTH);
    let (number, all) = (panel.chosen + 1, panel.species.len());
    let which = if all > 1 { format!(" ({number} of {all})") } else { String::new() };
    ui.label(small(format!("Leaves of \"{}\"{which}", species.name)).strong());
    // A grid remembers its columns by its name.
    let name = ("canopy_light", species.tuning.lines().len());
    Grid::new(name).num_columns(2).spacing([10.0, 2.0]).show(ui, |ui| {
        for (number, line) in species.tuning.lines().iter().enumerate() {
            let chosen = number == panel.line;
            let value = species.tuning.value(*line, species.values.as_ref());
            let (mark, color) = if chosen { ("\u{25b6} ", CHOSEN) } else { ("    ", NAME) };
            ui.label(small(format!("{mark}{}", line.name())).color(color)).on_hover_text(line.tip());
            let value = small(value);
            ui.label(if chosen { value.color(CHOSEN) } else { value }).on_hover_text(line.tip());
            ui.end_row();
        }
    });
    ui.label(RichText::new(chosen_tip(species, panel.line)).size(SMALL - 1.0).color(NAME));
    ui.label(small(state(species, panel.baker.progress(panel.chosen))));
    for text in panel.baker.failure().into_iter().chain(told(species)) {
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

fn chosen_tip(species: &Turned, line: usize) -> &'static str {
    match species.tuning.lines().get(line) {
        Some(Line::Light) | None if species.tuning.expressive().is_none() => {
            "Right: light this species by an implicit surface, for this session."
        }
        line => line.unwrap_or(&Line::Light).tip(),
    }
}

/// What is baked, and what the last turn took.
fn state(species: &Turned, progress: Option<Progress>) -> String {
    let now = match progress {
        Some(Progress::Preview) => format!("preview by {:.0} % of the leaves ...", 100.0 * PREVIEW_SHARE),
        Some(Progress::Full(done, all)) => format!("baking in full ({done} of {all}) ..."),
        Some(Progress::Crosses(done, all)) => format!("pictures of far trees ({done} of {all}) ..."),
        None => "at rest".to_owned(),
    };
    let names = ["preview", "full", "far trees"];
    let times = names.iter().zip(species.times).filter_map(|(name, time)| Some(format!("{name} {:.2} s", time?)));
    std::iter::once(now).chain(times).collect::<Vec<_>>().join("; ")
}

/// Why individuals have their leaves' own normals: the first one's reason, and how many there are.
fn told(species: &Turned) -> Option<String> {
    let told: Vec<&String> = species.no_surface.iter().flatten().collect();
    let (first, all) = (told.first()?, species.no_surface.len());
    Some(if all > 1 { format!("{} of {all} plants: {first}", told.len()) } else { (*first).clone() })
}
