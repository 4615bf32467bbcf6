//! Window input and output: captures the mouse, turns keys into commands, moves the camera's entity with the flight.

use std::io::Write;

use bevy::{
    app::AppExit,
    ecs::{
        change_detection::DetectChangesMut,
        message::{MessageReader, MessageWriter},
        query::With,
        system::{Local, Res, ResMut, Single},
    },
    input::{
        ButtonInput, ButtonState,
        keyboard::{Key, KeyCode, KeyboardInput},
        mouse::{AccumulatedMouseMotion, AccumulatedMouseScroll, MouseButton, MouseScrollUnit},
    },
    prelude::Transform,
    time::{Real, Time},
    window::{CursorGrabMode, CursorOptions, PrimaryWindow, WindowFocused},
};
use bevy_egui::input::EguiWantsInput;

use super::{
    controls::{self, Command},
    light::LightPanel,
    loading::{self, Request, Terminal},
    session::Session,
};
use crate::{
    app::camera,
    components::{CanopyScene, Sun},
    render::components::{CanopyCamera, CanopyOrigin, ViewOptions},
};

/// Pixels of touchpad scrolling that equal one notch of a wheel.
const PIXELS_PER_NOTCH: f64 = 100.0;

/// Captures the mouse on a click, and releases it when the window loses the focus.
pub fn capture_mouse(
    mut cursor: Single<&mut CursorOptions, With<PrimaryWindow>>,
    buttons: Res<ButtonInput<MouseButton>>,
    overlay: Res<EguiWantsInput>,
    mut focus: MessageReader<WindowFocused>,
) {
    if buttons.just_pressed(MouseButton::Left) && !overlay.wants_any_pointer_input() {
        set_captured(&mut cursor, true);
    }
    if focus.read().any(|message| !message.focused) {
        set_captured(&mut cursor, false);
    }
}

fn captured(cursor: &CursorOptions) -> bool {
    cursor.grab_mode != CursorGrabMode::None
}

fn set_captured(cursor: &mut CursorOptions, captured: bool) {
    // If the platform cannot lock the mouse at its position, winit confines it to the window instead.
    cursor.grab_mode = if captured { CursorGrabMode::Locked } else { CursorGrabMode::None };
    cursor.visible = !captured;
}

/// Carries out the commands of the pressed keys. Before the flight there is one: to quit.
pub fn handle_keys(
    mut keys: MessageReader<KeyboardInput>,
    held: Res<ButtonInput<KeyCode>>,
    mut session: Option<ResMut<Session>>,
    mut panel: Option<ResMut<LightPanel>>,
    request: Res<Request>,
    mut terminal: ResMut<Terminal>,
    mut scene: Single<&mut CanopyScene>,
    mut cursor: Single<&mut CursorOptions, With<PrimaryWindow>>,
    mut exit: MessageWriter<AppExit>,
    mut shift: Local<bool>,
) {
    const SHIFTS: [KeyCode; 2] = [KeyCode::ShiftLeft, KeyCode::ShiftRight];
    for key in keys.read() {
        let pressed = key.state == ButtonState::Pressed;
        // Shift is tracked in the order of the key strokes: it may be pressed and released within one slow frame.
        if SHIFTS.contains(&key.key_code) {
            *shift = pressed;
        }
        if !pressed {
            continue;
        }
        let (Some(session), Some(panel)) = (&mut session, &mut panel) else {
            if key.logical_key == Key::Escape {
                exit.write(AppExit::Success);
            }
            continue;
        };
        if panel.open
            && let Some(input) = controls::panel_input(&key.logical_key, *shift, key.repeat)
        {
            if let Some(text) = panel.handle(input) {
                print(&text, session);
            }
            continue;
        }
        let Some(command) = controls::command(key.key_code, &key.logical_key, *shift, key.repeat) else { continue };
        match command {
            Command::Leave if captured(&cursor) => set_captured(&mut cursor, false),
            Command::Leave if panel.open => panel.open = false,
            Command::Light => {
                if !panel.toggle() {
                    session.show_message("this scene has no species whose lighting can be adjusted".to_owned());
                }
            }
            Command::Leave => {
                exit.write(AppExit::Success);
            }
            Command::Reload => loading::reload(&request, session, &mut terminal, &mut scene),
            _ => session.carry_out(command),
        }
    }
    // A window that lost the focus gets no release events.
    *shift = held.any_pressed(SHIFTS);
}

/// Prints a text for the user to copy.
fn print(text: &str, session: &mut Session) {
    let mut out = std::io::stdout();
    session.show_message(match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Ok(()) => "printed in the terminal".to_owned(),
        Err(error) => format!("cannot print in the terminal: {error}"),
    });
}

/// Flies for the time since the last frame.
pub fn fly(
    time: Res<Time<Real>>,
    keys: Res<ButtonInput<KeyCode>>,
    motion: Res<AccumulatedMouseMotion>,
    wheel: Res<AccumulatedMouseScroll>,
    cursor: Single<&CursorOptions, With<PrimaryWindow>>,
    panel: Res<LightPanel>,
    mut session: ResMut<Session>,
) {
    let seconds = time.delta_secs_f64();
    let mouse = if captured(&cursor) { motion.delta.as_dvec2() } else { glam::DVec2::ZERO };
    let notches = match wheel.unit {
        MouseScrollUnit::Line => f64::from(wheel.delta.y),
        MouseScrollUnit::Pixel => f64::from(wheel.delta.y) / PIXELS_PER_NOTCH,
    };
    // A key that was pressed and released between two slow frames still counts.
    let pressed = |key| keys.pressed(key) || keys.just_pressed(key);
    let held = |key| pressed(key) && !(panel.open && controls::rotates_view(key));
    let controls = controls::controls(held, mouse, notches, seconds);
    session.fly(&controls, seconds);
}

/// Updates camera, light and options from the flight. Unchanged values are not touched, so change detection works.
pub fn follow(
    session: Res<Session>,
    mut origin: ResMut<CanopyOrigin>,
    camera: Single<(&mut Transform, &mut ViewOptions), With<CanopyCamera>>,
    mut sun: Single<&mut Sun>,
) {
    let (mut transform, mut options) = camera.into_inner();
    let (new_origin, new_transform) = camera::origin_and_transform(&session.view());
    origin.set_if_neq(new_origin);
    transform.set_if_neq(new_transform);
    options.set_if_neq(ViewOptions { tint_levels: session.tinted });
    // The sun's refresh policy decides how often the light is computed again.
    let instant = session.clock.now().to_utc();
    if sun.instant != instant {
        sun.instant = instant;
    }
}
