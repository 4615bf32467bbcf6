//! The overlays of the window: numbers, help, messages.

use bevy::ecs::system::{Local, Res, ResMut, Single};
use bevy_egui::{
    EguiContexts,
    egui::{
        Align2, Area, Color32, Context, CornerRadius, Frame, Grid, Id, Margin, ProgressBar, RichText, Spinner, Stroke,
        Ui, Visuals,
    },
};

use super::{
    controls::HELP,
    session::Session,
    settings::{SettingsPanel, settings_panel},
    timing::FrameTimes,
};
use crate::{
    components::{SceneProgress, SceneState},
    math::digits::grouped,
    render::{
        components::{Daylight, ViewOptions},
        report::{FrameReport, PassOutcome},
    },
};

/// Points between an overlay and the window's edge.
const EDGE: f32 = 8.0;
/// Size of the overlays' text in points.
pub(super) const SMALL: f32 = 12.0;
/// Colour of a value's name.
pub(super) const NAME: Color32 = Color32::from_gray(185);
/// Colour of warnings.
pub(super) const WARNING: Color32 = Color32::from_rgb(255, 150, 110);
/// Width and height of the progress of a build without warnings in points, and height of its bar.
const BUILDING_WIDTH: f32 = 420.0;
const BUILDING_HEIGHT: f32 = 50.0;
const BAR_HEIGHT: f32 = 6.0;
/// Width of the longest name of a pass in points.
const PASS_WIDTH: f32 = 110.0;
const FRAME_TIME: &str = "Time between the completion of two frames on the device, over the last 120 frames: CPU, \
                          device, and the wait for the screen. Half of the frames take at most p50, 95 % of them at \
                          most p95.";
const TREES: &str = "Trees that the view draws. A tree in the fade band between two levels counts in both.";
const TRIANGLES: &str = "Triangles that the view draws: trees and ground, without shadow maps.";
const SUN: &str = "Elevation of the sun's centre above the horizon, with refraction, in the light that is drawn.";
const POSITION: &str = "Metres east (x) and south (z) of the terrain's centre, and above the datum of its heights. \
                        --camera takes x, z, the height above ground, bearing and pitch.";

/// Draws the overlays. A frame that is saved as an image has none.
pub fn draw_overlays(
    mut contexts: EguiContexts,
    session: Option<ResMut<Session>>,
    settings: Option<ResMut<SettingsPanel>>,
    view: Single<&ViewOptions>,
    scene: Single<&SceneProgress>,
    frames: Res<FrameTimes>,
    report: Res<FrameReport>,
    daylight: Option<Res<Daylight>>,
    mut styled: Local<bool>,
) {
    let Ok(context) = contexts.ctx_mut() else { return };
    if !*styled {
        let mut visuals = Visuals::dark();
        visuals.override_text_color = Some(Color32::from_gray(235));
        context.set_visuals(visuals);
        *styled = true;
    }
    let (Some(mut session), Some(mut settings)) = (session, settings) else {
        panel(context, "canopy_building", Align2::CENTER_CENTER, [0.0, 0.0], |ui| building(ui, &scene));
        return;
    };
    if std::mem::take(&mut session.capturing) {
        return;
    }
    if session.help {
        panel(context, "canopy_help", Align2::CENTER_CENTER, [0.0, 0.0], help);
    } else if session.overlay {
        panel(context, "canopy_numbers", Align2::LEFT_TOP, [EDGE, EDGE], |ui| {
            let sun = daylight.as_ref().map(|light| light.0.sun_direction.y.clamp(-1.0, 1.0).asin().to_degrees());
            numbers(ui, &session, &scene, &frames, sun, view.tint_levels);
            passes(ui, &report);
        });
    }
    if settings.open && !session.help {
        panel(context, "canopy_settings", Align2::RIGHT_TOP, [-EDGE, EDGE], |ui| settings_panel(ui, &mut settings));
    }
    let is_building = scene.state == SceneState::Building;
    if is_building {
        panel(context, "canopy_building_again", Align2::CENTER_BOTTOM, [0.0, -EDGE], |ui| building(ui, &scene));
    }
    if let Some(message) = session.message() {
        // An area remembers its size by its name, so each message has its own.
        let rise = if is_building { BUILDING_HEIGHT } else { 0.0 };
        panel(context, message, Align2::CENTER_BOTTOM, [0.0, -2.0 * EDGE - rise], |ui| {
            ui.label(message);
        });
    }
}

fn panel(context: &Context, name: &str, align: Align2, offset: [f32; 2], contents: impl FnOnce(&mut Ui)) {
    let widest = context.viewport_rect().width() - 4.0 * EDGE;
    Area::new(Id::new(name)).anchor(align, offset).default_width(widest).fade_in(false).show(context, |ui| {
        // Rows are as high as their text, not as a button.
        ui.spacing_mut().interact_size.y = 0.0;
        Frame::new()
            .fill(Color32::from_black_alpha(205))
            .stroke(Stroke::NONE)
            .corner_radius(CornerRadius::same(4))
            .inner_margin(Margin::same(8))
            .show(ui, |ui| {
                ui.set_max_width(widest);
                contents(ui);
            });
    });
}

pub(super) fn small(text: impl Into<String>) -> RichText {
    RichText::new(text).size(SMALL)
}

/// How far the build of the scene has come.
fn building(ui: &mut Ui, scene: &SceneProgress) {
    ui.set_width(BUILDING_WIDTH);
    let step = if scene.step.is_empty() { "Scene" } else { &scene.step };
    let count =
        if scene.total > 0 { format!("{} of {}", scene.done.min(scene.total), scene.total) } else { String::new() };
    ui.horizontal(|ui| {
        ui.add(Spinner::new().size(SMALL));
        ui.label(small(step).strong());
        ui.label(small(count).color(NAME));
    });
    match scene.share() {
        Some(share) => ui.add(ProgressBar::new(share).desired_height(BAR_HEIGHT)),
        None => ui.add(ProgressBar::new(1.0).desired_height(BAR_HEIGHT).fill(Color32::from_gray(70)).animate(true)),
    };
    for warning in &scene.warnings {
        ui.label(small(warning).color(WARNING));
    }
}

fn numbers(ui: &mut Ui, session: &Session, scene: &SceneProgress, frames: &FrameTimes, sun: Option<f32>, tinted: bool) {
    let milliseconds = |share| frames.percentile(share).map_or("-".to_owned(), |s| format!("{:.1}", s * 1e3));
    let (forest, terrain) = (&frames.forest, frames.terrain);
    let levels: Vec<String> =
        forest.levels.iter().map(|level| format!("{} {}", grouped(level.trees), level.label)).collect();
    let clock = match session.clock.rate() {
        _ if session.paused => "paused".to_owned(),
        0.0 => "stopped".to_owned(),
        rate => format!("{rate}x"),
    };
    let position = session.pilot.position;
    let flight = match &session.tour {
        Some(tour) if session.touring => format!("on the path, {:.1} s", tour.seconds()),
        _ => format!("free, {:.1} m/s", session.pilot.speed),
    };
    let mut rows = vec![
        (
            "frame",
            format!("p50 {} ms, p95 {} ms of {} frames", milliseconds(0.5), milliseconds(0.95), frames.frames()),
            FRAME_TIME,
        ),
        ("trees", levels.join(", "), TREES),
        ("triangles", grouped(forest.triangles() + terrain.triangles), TRIANGLES),
        ("ground", format!("{} tiles", grouped(terrain.tiles)), "Terrain tiles that the view draws."),
        (
            "time",
            format!("{}, clock {clock}", session.clock.now().format("%Y-%m-%d %H:%M:%S %:z")),
            "Local time with its offset from UTC.",
        ),
        ("position", format!("x {:.1}, z {:.1}, height {:.1} m", position.x, position.z, position.y), POSITION),
        (
            "view",
            format!(
                "{:.1} m above ground, bearing {:.0}\u{b0}, pitch {:.0}\u{b0}",
                session.above_ground(),
                session.pilot.bearing(),
                session.pilot.pitch.to_degrees()
            ),
            POSITION,
        ),
        ("flight", flight, "Speed of free flight without Shift; the wheel changes it."),
    ];
    if let Some(sun) = sun {
        rows.insert(
            5,
            ("sun", format!("{:.1}\u{b0} {} the horizon", sun.abs(), if sun < 0.0 { "below" } else { "above" }), SUN),
        );
    }
    let states = [(session.underground, "below the ground"), (tinted, "tinted by level")];
    let states: Vec<&str> = states.iter().filter(|(on, _)| *on).map(|(_, name)| *name).collect();
    if !states.is_empty() {
        rows.push(("options", states.join(", "), "Keys U and T."));
    }
    let warnings = scene.warnings.join("\n");
    if !warnings.is_empty() {
        rows.push(("warnings", format!("{}, in the terminal and here", scene.warnings.len()), &warnings));
    }
    Grid::new("canopy_rows").num_columns(2).spacing([10.0, 2.0]).show(ui, |ui| {
        for (name, value, tip) in rows {
            ui.label(small(name).color(NAME)).on_hover_text(tip);
            ui.label(small(value)).on_hover_text(tip);
            ui.end_row();
        }
    });
}

fn passes(ui: &mut Ui, report: &FrameReport) {
    // A grid has the columns of the frame before; a frame may take a second.
    Grid::new("canopy_passes").num_columns(2).spacing([10.0, 0.0]).min_col_width(PASS_WIDTH).show(ui, |ui| {
        for (pass, outcome) in report.outcomes() {
            let (text, color) = match outcome {
                PassOutcome::Ran(on) => (format!("ran: {on}"), Color32::from_rgb(190, 225, 180)),
                PassOutcome::Skipped(why) => (format!("skipped: {why}"), NAME),
            };
            ui.label(RichText::new(pass).size(SMALL - 2.0).color(NAME));
            ui.label(RichText::new(text).size(SMALL - 2.0).color(color));
            ui.end_row();
        }
    });
}

fn help(ui: &mut Ui) {
    Grid::new("canopy_keys").num_columns(2).spacing([16.0, 2.0]).show(ui, |ui| {
        for (key, what) in HELP {
            ui.label(small(key).strong());
            ui.label(small(what));
            ui.end_row();
        }
    });
}
