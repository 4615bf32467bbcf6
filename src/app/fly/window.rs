//! Window input and output: captures the mouse, turns keys into commands, moves the camera's entity with the flight.

use std::io::Write;

use bevy::{
    app::AppExit,
    ecs::{
        change_detection::DetectChangesMut,
        message::{MessageReader, MessageWriter},
        query::With,
        system::{Local, Query, Res, ResMut, Single},
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
use bevy_egui::{
    EguiInput,
    egui::{self, Event},
    input::EguiWantsInput,
};

use super::{
    controls::{self, Command, PanelInput},
    loading::{self, Request, Terminal},
    session::Session,
    settings::SettingsPanel,
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

/// Takes the keys from the overlay that select something in the panel. Only a number that is typed gets them.
pub fn keep_keys_from_overlay(mut inputs: Query<&mut EguiInput>, overlay: Res<EguiWantsInput>) {
    if overlay.wants_any_keyboard_input() {
        return;
    }
    for mut input in &mut inputs {
        input.events.retain(|event| !matches!(event, Event::Key { key: egui::Key::Tab, .. }));
    }
}

/// Carries out the commands of the pressed keys. Before the flight there is one: to quit.
pub fn handle_keys(
    mut keys: MessageReader<KeyboardInput>,
    held: Res<ButtonInput<KeyCode>>,
    mut session: Option<ResMut<Session>>,
    mut panel: Option<ResMut<SettingsPanel>>,
    mut request: ResMut<Request>,
    mut terminal: ResMut<Terminal>,
    mut scene: Single<&mut CanopyScene>,
    mut view: Single<&mut ViewOptions, With<CanopyCamera>>,
    overlay: Res<EguiWantsInput>,
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
        if !pressed || overlay.wants_any_keyboard_input() {
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
            match panel.handle(input) {
                Some(text) => print(&text, session),
                None if input == PanelInput::Write => {
                    session.show_message(
                        "only the lighting of a species and the style are written into scene files".to_owned(),
                    );
                }
                None => {}
            }
            continue;
        }
        let Some(command) = controls::command(key.key_code, &key.logical_key, *shift, key.repeat) else { continue };
        match command {
            Command::Leave if captured(&cursor) => set_captured(&mut cursor, false),
            Command::Leave if panel.open => panel.open = false,
            Command::Settings => panel.open = !panel.open,
            Command::Tint => view.tint_levels = !view.tint_levels,
            Command::Leave => {
                exit.write(AppExit::Success);
            }
            Command::Reload => loading::reload(&request, session, &mut terminal, &mut scene),
            Command::Year(_) | Command::Variant(_) => {
                if loading::choose(&mut request, session, command) {
                    loading::reload(&request, session, &mut terminal, &mut scene);
                }
            }
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
    panel: Res<SettingsPanel>,
    overlay: Res<EguiWantsInput>,
    mut session: ResMut<Session>,
) {
    let seconds = time.delta_secs_f64();
    let mouse = if captured(&cursor) { motion.delta.as_dvec2() } else { glam::DVec2::ZERO };
    let scrolls = overlay.wants_any_pointer_input() && !captured(&cursor);
    let notches = match wheel.unit {
        _ if scrolls => 0.0,
        MouseScrollUnit::Line => f64::from(wheel.delta.y),
        MouseScrollUnit::Pixel => f64::from(wheel.delta.y) / PIXELS_PER_NOTCH,
    };
    // A key that was pressed and released between two slow frames still counts.
    let pressed = |key| keys.pressed(key) || keys.just_pressed(key);
    let typing = overlay.wants_any_keyboard_input();
    let held = |key| pressed(key) && !typing && !(panel.open && controls::rotates_view(key));
    let controls = controls::controls(held, mouse, notches, seconds);
    session.fly(&controls, seconds);
}

/// Updates camera and sun from the flight. Unchanged values are not touched, so change detection works.
pub fn follow(
    session: Res<Session>,
    mut origin: ResMut<CanopyOrigin>,
    mut transform: Single<&mut Transform, With<CanopyCamera>>,
    mut sun: Single<&mut Sun>,
) {
    let (new_origin, new_transform) = camera::origin_and_transform(&session.view());
    origin.set_if_neq(new_origin);
    transform.set_if_neq(new_transform);
    // The sun's refresh policy decides how often the light is computed again.
    let instant = session.clock.now().to_utc();
    if sun.instant != instant {
        sun.instant = instant;
    }
}
