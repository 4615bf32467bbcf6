//! The window's side: the mouse is caught and freed, keys become commands, the camera's entity follows the flight.

use std::io::Write;

use bevy::{
    app::AppExit,
    ecs::{
        change_detection::DetectChangesMut,
        message::{MessageReader, MessageWriter},
        query::With,
        system::{Commands, Local, Res, ResMut, Single},
    },
    input::{
        ButtonInput, ButtonState,
        keyboard::{KeyCode, KeyboardInput},
        mouse::{AccumulatedMouseMotion, AccumulatedMouseScroll, MouseButton, MouseScrollUnit},
    },
    prelude::Transform,
    render::view::Msaa,
    time::{Real, Time},
    window::{CursorGrabMode, CursorOptions, PrimaryWindow, WindowFocused},
};
use bevy_egui::input::EguiWantsInput;

use super::{
    controls::{self, Command},
    light::LightPanel,
    session::Session,
};
use crate::{
    app::camera,
    components::Sun,
    render::components::{CanopyCamera, CanopyOrigin, ViewOptions},
};

/// Pixels of a touchpad's scrolling that are one notch of a wheel.
const PIXELS_A_NOTCH: f64 = 100.0;

/// Puts the stage and the camera into the world.
pub fn set_up(mut commands: Commands, session: Res<Session>) {
    let stage = &session.stage;
    stage.show(&mut commands);
    commands.spawn((stage.sun(session.clock.now().to_utc()), stage.shadow()));
    commands.spawn((
        CanopyCamera,
        Msaa::from_samples(stage.scene.quality.msaa),
        camera::projection(session.view().field_of_view),
    ));
}

/// Catches the mouse on a click, and frees it when the window loses the focus.
pub fn catch_mouse(
    mut cursor: Single<&mut CursorOptions, With<PrimaryWindow>>,
    buttons: Res<ButtonInput<MouseButton>>,
    overlay: Res<EguiWantsInput>,
    mut focus: MessageReader<WindowFocused>,
) {
    if buttons.just_pressed(MouseButton::Left) && !overlay.wants_any_pointer_input() {
        set_caught(&mut cursor, true);
    }
    if focus.read().any(|message| !message.focused) {
        set_caught(&mut cursor, false);
    }
}

fn caught(cursor: &CursorOptions) -> bool {
    cursor.grab_mode != CursorGrabMode::None
}

fn set_caught(cursor: &mut CursorOptions, caught: bool) {
    // Where a system cannot lock the mouse to its place, winit confines it to the window instead.
    cursor.grab_mode = if caught { CursorGrabMode::Locked } else { CursorGrabMode::None };
    cursor.visible = !caught;
}

/// Carries out what the pressed keys ask for.
pub fn obey(
    mut keys: MessageReader<KeyboardInput>,
    held: Res<ButtonInput<KeyCode>>,
    mut session: ResMut<Session>,
    mut panel: ResMut<LightPanel>,
    mut cursor: Single<&mut CursorOptions, With<PrimaryWindow>>,
    mut exit: MessageWriter<AppExit>,
    mut shift: Local<bool>,
) {
    const SHIFTS: [KeyCode; 2] = [KeyCode::ShiftLeft, KeyCode::ShiftRight];
    for key in keys.read() {
        let pressed = key.state == ButtonState::Pressed;
        // In the order of the strokes: in one slow frame Shift may have come and gone again.
        if SHIFTS.contains(&key.key_code) {
            *shift = pressed;
        }
        if !pressed {
            continue;
        }
        if panel.open
            && let Some(turn) = controls::turn(&key.logical_key, *shift, key.repeat)
        {
            if let Some(text) = panel.turn(turn) {
                write(&text, &mut session);
            }
            continue;
        }
        let Some(command) = controls::command(key.key_code, &key.logical_key, *shift, key.repeat) else { continue };
        match command {
            Command::Leave if caught(&cursor) => set_caught(&mut cursor, false),
            Command::Leave if panel.open => panel.open = false,
            Command::Light => {
                if !panel.toggle() {
                    session.say("this scene has no species whose light could be turned".to_owned());
                }
            }
            Command::Leave => {
                exit.write(AppExit::Success);
            }
            _ => session.carry_out(command),
        }
    }
    // A window that lost the focus hears of no release.
    *shift = held.any_pressed(SHIFTS);
}

/// Writes a text for the user to take.
fn write(text: &str, session: &mut Session) {
    let mut out = std::io::stdout();
    session.say(match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Ok(()) => "written into the terminal".to_owned(),
        Err(error) => format!("the terminal cannot be written to: {error}"),
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
    let mouse = if caught(&cursor) { motion.delta.as_dvec2() } else { glam::DVec2::ZERO };
    let notches = match wheel.unit {
        MouseScrollUnit::Line => f64::from(wheel.delta.y),
        MouseScrollUnit::Pixel => f64::from(wheel.delta.y) / PIXELS_A_NOTCH,
    };
    // A key that was pressed and released between two slow frames still counts.
    let pressed = |key| keys.pressed(key) || keys.just_pressed(key);
    let held = |key| pressed(key) && !(panel.open && controls::turns_view(key));
    let controls = controls::controls(held, mouse, notches, seconds);
    session.fly(&controls, seconds);
}

/// Brings camera, light and options in step with the flight; what stays the same is not touched.
pub fn follow(
    session: Res<Session>,
    mut origin: ResMut<CanopyOrigin>,
    camera: Single<(&mut Transform, &mut ViewOptions), With<CanopyCamera>>,
    mut sun: Single<&mut Sun>,
) {
    let (mut transform, mut options) = camera.into_inner();
    let (place, moved) = camera::place(&session.view());
    origin.set_if_neq(place);
    transform.set_if_neq(moved);
    options.set_if_neq(ViewOptions { tint_levels: session.tinted });
    // How often the light follows is the sun's own affair.
    sun.set_if_neq(session.stage.sun(session.clock.now().to_utc()));
}
