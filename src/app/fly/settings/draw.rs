//! Draws the settings panel. What the mouse does to a field becomes an edit, as what the keys do.

use bevy_egui::egui::{Color32, ComboBox, DragValue, Grid, Label, RichText, ScrollArea, Sense, Ui};

use super::{
    SettingsPanel,
    fields::{Content, Edit, Field, words},
};
use crate::{
    app::fly::overlay::{NAME, SMALL, WARNING, small},
    math::range::{Range, Step, three_digits},
};

/// Width of the panel and of a field's name, and height of a field in points.
const WIDTH: f32 = 330.0;
const NAME_WIDTH: f32 = 135.0;
const ROW_HEIGHT: f32 = 18.0;
/// Points that the panel leaves to the window's other edge.
const MARGIN: f32 = 150.0;
const SELECTED: Color32 = Color32::from_rgb(255, 214, 120);

/// Keys of the panel, shown in its last lines.
const KEYS: [(&str, &str); 6] = [
    ("Up Down", "select a value"),
    ("Left Right", "adjust it; with Shift in small steps"),
    ("Backspace", "reset it to the scene's own"),
    ("Delete", "make it automatic"),
    ("Tab", "next section"),
    ("Enter", "print the lighting or the style for the scene file, in the terminal"),
];

/// Draws the panel.
pub fn settings_panel(ui: &mut Ui, panel: &mut SettingsPanel) {
    ui.set_width(WIDTH);
    heading(ui, panel);
    let mut selected = panel.line;
    let tallest = (ui.ctx().viewport_rect().height() - MARGIN).max(MARGIN);
    let section = panel.section;
    ScrollArea::vertical().max_height(tallest).show(ui, |ui| {
        // Names and values are centred on rows of one height.
        ui.spacing_mut().interact_size.y = ROW_HEIGHT;
        // A grid remembers its columns by its name.
        let grid = Grid::new(("canopy_settings", section)).num_columns(2).spacing([10.0, 3.0]);
        grid.min_col_width(NAME_WIDTH).show(ui, |ui| {
            for (number, field) in panel.fields.iter().enumerate() {
                let (clicked, edit) = row(ui, (section, number), field, number == panel.line);
                if clicked || edit.is_some() {
                    selected = number;
                }
                panel.edits.extend(edit.map(|edit| (field.path.clone(), edit)));
                ui.end_row();
            }
        });
    });
    panel.line = selected;
    let tip = panel.fields.get(panel.line).map_or("", |field| field.tip);
    ui.label(RichText::new(tip).size(SMALL - 1.0).color(NAME));
    if let Some(light) = panel.species.get(section) {
        ui.label(small(light.state()));
        for text in light.warnings() {
            ui.label(small(text).color(WARNING));
        }
    }
    Grid::new("canopy_settings_keys").num_columns(2).spacing([10.0, 0.0]).show(ui, |ui| {
        for (key, what) in KEYS {
            ui.label(RichText::new(key).size(SMALL - 1.0).strong());
            ui.label(RichText::new(what).size(SMALL - 1.0).color(NAME));
            ui.end_row();
        }
    });
}

/// The name of the section, between buttons that lead to the ones beside it.
fn heading(ui: &mut Ui, panel: &mut SettingsPanel) {
    let (number, all) = (panel.section + 1, panel.species.len() + panel.components.len());
    let title = match panel.species.get(panel.section) {
        Some(light) => format!("Leaves of \"{}\"", light.name),
        None => {
            let words = panel.component().map(|component| words(component.name)).unwrap_or_default();
            let mut letters = words.chars();
            letters.next().map(|first| first.to_uppercase().chain(letters).collect()).unwrap_or_default()
        }
    };
    ui.horizontal(|ui| {
        if ui.button(small("\u{25c0}")).clicked() {
            panel.turn(false);
        }
        if ui.button(small("\u{25b6}")).clicked() {
            panel.turn(true);
        }
        ui.label(small(title).strong());
        ui.label(small(format!("{number} of {all}")).color(NAME));
    });
}

/// A field. Returns whether its name was clicked, and what the mouse did to its value.
fn row(ui: &mut Ui, id: (usize, usize), field: &Field, selected: bool) -> (bool, Option<Edit>) {
    let color = if selected { SELECTED } else { NAME };
    let mark = if selected { "\u{25b6} " } else { "    " };
    let name = small(format!("{mark}{}{}", "   ".repeat(field.depth), field.label)).color(color);
    let name =
        if field.is_changed { name.strong().color(if selected { SELECTED } else { Color32::WHITE }) } else { name };
    let clicked = ui.add(Label::new(name).sense(Sense::click())).on_hover_text(tip(field)).clicked();
    let edit = ui.horizontal(|ui| value(ui, id, field)).inner;
    (clicked, edit)
}

fn tip(field: &Field) -> &str {
    if field.tip.is_empty() { &field.label } else { field.tip }
}

fn value(ui: &mut Ui, id: (usize, usize), field: &Field) -> Option<Edit> {
    match &field.content {
        Content::Number { set, known, start, optional, whole, range } => {
            let mut automatic = set.is_none();
            let number = set.or(*known).and_then(|value| number(ui, value, *whole, range));
            let switched = *optional && ui.checkbox(&mut automatic, small("automatic")).changed();
            match (switched, automatic) {
                (true, true) => Some(Edit::Automatic),
                (true, false) => start.map(Edit::Number),
                (false, _) => number.map(Edit::Number),
            }
        }
        Content::Switch(on) => {
            let mut on = *on;
            ui.checkbox(&mut on, "").changed().then_some(Edit::Switch(on))
        }
        Content::Choice { selected, names } => {
            let mut chosen = *selected;
            let text = small(names.get(chosen).map_or("", String::as_str));
            ComboBox::from_id_salt(("canopy_choice", id)).selected_text(text).show_ui(ui, |ui| {
                for (index, name) in names.iter().enumerate() {
                    ui.selectable_value(&mut chosen, index, small(name));
                }
            });
            (chosen != *selected).then_some(Edit::Choose(chosen))
        }
        Content::Text(text) => {
            ui.label(small(text).color(NAME));
            None
        }
    }
}

/// A number that is dragged or typed; the new one, if it has changed.
fn number(ui: &mut Ui, value: f64, whole: bool, range: &Range) -> Option<f64> {
    let mut new = value;
    let speed = match range.step {
        Step::Factor(_, _, least) => (0.01 * value.abs()).max(0.01 * least),
        Step::Sum(_, fine) => 0.3 * fine,
    };
    let suffix = if range.unit.is_empty() { String::new() } else { format!(" {}", range.unit) };
    let drag = DragValue::new(&mut new).range(range.low..=range.high).speed(speed).suffix(suffix);
    let drag = if whole { drag.fixed_decimals(0) } else { drag.custom_formatter(|value, _| three_digits(value)) };
    let changed = ui.add(drag.update_while_editing(false)).changed();
    // What the panel rounds for display is no change.
    (changed && new != value).then_some(new)
}
