//! Which key does what. The help of the overlay is made of the same table.

use bevy::input::keyboard::{Key, KeyCode};
use glam::{DVec2, DVec3};

use super::motion::Controls;

/// Radians that the view turns for one pixel of the mouse's way.
const TURN_A_PIXEL: f64 = 0.0022;
/// Radians per second that the view turns with the arrow keys.
const TURN_A_SECOND: f64 = 1.0;

/// Something that a key press asks for, once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Command {
    /// Free the mouse, or quit.
    Leave,
    /// Begin or leave the scripted flight.
    Tour,
    /// Stop or go on with clock and scripted flight.
    Pause,
    /// Tint trees by level of detail.
    Tint,
    /// Let the camera go under the ground.
    Underground,
    /// Save a picture.
    Picture,
    /// Show all keys.
    Help,
    /// Show the small overlay.
    Overlay,
    /// Open or close the panel of the leaves' light.
    Light,
    /// Back to where and when the flight began.
    Home,
    /// Set the clock by this many minutes.
    Minutes(i64),
    /// Set the calendar by this many days.
    Days(i32),
    /// Set the calendar by this many months.
    Months(i32),
    /// Let the clock run faster.
    Faster,
    /// Let the clock run slower.
    Slower,
}

impl Command {
    /// Whether a key that is held asks for it again and again.
    fn repeats(self) -> bool {
        matches!(self, Self::Minutes(_) | Self::Days(_) | Self::Months(_))
    }
}

/// Something that a key asks of the open panel of the leaves' light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// Choose the next line, downwards or upwards.
    Line(bool),
    /// Choose the next species, forwards or backwards.
    Species(bool),
    /// Turn the chosen line.
    Value {
        /// Whether up.
        up: bool,
        /// Whether by a small step.
        fine: bool,
    },
    /// Take the chosen line back to what it is of itself.
    Reset,
    /// Write the values for a scene file.
    Write,
}

/// All keys and what they do, as the help shows them.
pub const HELP: [(&str, &str); 20] = [
    ("W A S D", "fly forward, left, back, right"),
    ("E  Q", "up, down"),
    ("Shift", "five times as fast"),
    ("wheel", "faster, slower"),
    ("mouse", "look; a click catches it, Esc frees it"),
    ("arrows", "look without a mouse"),
    ("F", "fly the scene's path; W A S D Q E leave it"),
    ("Space", "pause clock and path"),
    (",  .", "an hour back, on"),
    ("[  ]", "ten minutes back, on"),
    ("Page Up, Down", "a day on, back; with Shift a month"),
    ("+  -", "clock: stands, 1x, 60x, 600x, 3600x"),
    ("Home", "back to the start, place and time"),
    ("U", "under the ground or not"),
    ("T", "tint trees by level of detail"),
    ("L", "panel: turn the light of the leaves; it takes the arrows"),
    ("P", "save a picture into the working directory"),
    ("O", "overlay"),
    ("H", "this help"),
    ("Esc", "free the mouse, close the panel, then quit"),
];

/// The physical keys of travel, which lie where W, A, S, D, Q and E lie on an American keyboard, and their directions
/// as [`Controls::travel`] has them.
const TRAVEL: [(KeyCode, DVec3); 6] = [
    (KeyCode::KeyW, DVec3::Z),
    (KeyCode::KeyS, DVec3::NEG_Z),
    (KeyCode::KeyD, DVec3::X),
    (KeyCode::KeyA, DVec3::NEG_X),
    (KeyCode::KeyE, DVec3::Y),
    (KeyCode::KeyQ, DVec3::NEG_Y),
];

/// The keys that turn the view: x to the right, y upward.
const TURN: [(KeyCode, DVec2); 4] = [
    (KeyCode::ArrowRight, DVec2::X),
    (KeyCode::ArrowLeft, DVec2::NEG_X),
    (KeyCode::ArrowUp, DVec2::Y),
    (KeyCode::ArrowDown, DVec2::NEG_Y),
];

/// What a pressed key asks for. Commands go by what is printed on the key, since `[` and `+` move from layout to
/// layout; keys of travel go by their place and are no commands.
pub fn command(code: KeyCode, key: &Key, shift: bool, repeat: bool) -> Option<Command> {
    if TRAVEL.iter().any(|(travel, _)| *travel == code) {
        return None;
    }
    let command = match key {
        Key::Escape => Command::Leave,
        Key::Space => Command::Pause,
        Key::Home => Command::Home,
        Key::PageUp if shift => Command::Months(1),
        Key::PageDown if shift => Command::Months(-1),
        Key::PageUp => Command::Days(1),
        Key::PageDown => Command::Days(-1),
        Key::Character(text) => match text.to_lowercase().as_str() {
            "f" => Command::Tour,
            " " => Command::Pause,
            "t" => Command::Tint,
            "u" => Command::Underground,
            "p" => Command::Picture,
            "h" => Command::Help,
            "o" => Command::Overlay,
            "l" => Command::Light,
            "," => Command::Minutes(-60),
            "." => Command::Minutes(60),
            "[" => Command::Minutes(-10),
            "]" => Command::Minutes(10),
            // On many layouts the plus is above the equals sign.
            "+" | "=" => Command::Faster,
            "-" => Command::Slower,
            _ => return None,
        },
        _ => return None,
    };
    (!repeat || command.repeats()).then_some(command)
}

/// What a pressed key asks of the open panel. Tab and what cannot be taken back at once do not repeat.
pub fn turn(key: &Key, shift: bool, repeat: bool) -> Option<Turn> {
    let turn = match key {
        Key::ArrowDown => Turn::Line(true),
        Key::ArrowUp => Turn::Line(false),
        Key::ArrowRight => Turn::Value { up: true, fine: shift },
        Key::ArrowLeft => Turn::Value { up: false, fine: shift },
        _ if repeat => return None,
        Key::Tab => Turn::Species(!shift),
        Key::Backspace => Turn::Reset,
        Key::Enter => Turn::Write,
        _ => return None,
    };
    Some(turn)
}

/// Whether a key turns the view.
pub fn turns_view(key: KeyCode) -> bool {
    TURN.iter().any(|(turn, _)| *turn == key)
}

/// The flight that the held keys and the mouse ask for within a step. `held` tells whether a key is down, `mouse` is
/// the mouse's way in pixels (x right, y down), `notches` the wheel's turn.
pub fn controls(held: impl Fn(KeyCode) -> bool, mouse: DVec2, notches: f64, seconds: f64) -> Controls {
    let travel = TRAVEL.iter().filter(|(key, _)| held(*key)).map(|(_, way)| *way).sum();
    let keys: DVec2 = TURN.iter().filter(|(key, _)| held(*key)).map(|(_, way)| *way).sum();
    let turn = DVec2::new(mouse.x, -mouse.y) * TURN_A_PIXEL + keys * (TURN_A_SECOND * seconds.clamp(0.0, 0.25));
    let hurry = held(KeyCode::ShiftLeft) || held(KeyCode::ShiftRight);
    Controls { travel, hurry, turn, notches }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn typed(code: KeyCode, text: &str) -> Option<Command> {
        command(code, &Key::Character(text.into()), false, false)
    }

    #[test]
    fn commands_go_by_what_is_printed() {
        assert_eq!(typed(KeyCode::KeyF, "f"), Some(Command::Tour));
        assert_eq!(typed(KeyCode::KeyH, "H"), Some(Command::Help));
        assert_eq!(typed(KeyCode::Equal, "="), Some(Command::Faster));
        // A German keyboard has its plus where an American one has its right bracket.
        assert_eq!(typed(KeyCode::BracketRight, "+"), Some(Command::Faster));
        assert_eq!(typed(KeyCode::BracketRight, "]"), Some(Command::Minutes(10)));
        assert_eq!(typed(KeyCode::KeyX, "x"), None);
    }

    #[test]
    fn keys_of_travel_are_no_commands() {
        // A Dvorak keyboard prints a comma where W is on an American one.
        assert_eq!(typed(KeyCode::KeyW, ","), None);
        assert_eq!(typed(KeyCode::Comma, ","), Some(Command::Minutes(-60)));
    }

    #[test]
    fn shift_makes_months_of_days_and_only_steps_repeat() {
        assert_eq!(command(KeyCode::PageUp, &Key::PageUp, false, false), Some(Command::Days(1)));
        assert_eq!(command(KeyCode::PageDown, &Key::PageDown, true, true), Some(Command::Months(-1)));
        assert_eq!(command(KeyCode::KeyT, &Key::Character("t".into()), false, true), None);
        assert_eq!(command(KeyCode::Escape, &Key::Escape, false, true), None);
    }

    #[test]
    fn the_panel_has_its_own_keys() {
        assert_eq!(typed(KeyCode::KeyL, "l"), Some(Command::Light));
        assert_eq!(turn(&Key::ArrowLeft, true, true), Some(Turn::Value { up: false, fine: true }));
        assert_eq!((turn(&Key::Tab, true, false), turn(&Key::Tab, false, true)), (Some(Turn::Species(false)), None));
        // What the panel does not know goes to the flight.
        assert_eq!(turn(&Key::Character("t".into()), false, false), None);
        assert!(turns_view(KeyCode::ArrowUp) && !turns_view(KeyCode::KeyW));
    }

    #[test]
    fn opposite_keys_cancel_and_the_mouse_looks_where_it_goes() {
        let both = controls(|key| matches!(key, KeyCode::KeyW | KeyCode::KeyS), DVec2::ZERO, 0.0, 0.1);
        assert!(!both.travels());
        let one = controls(|key| matches!(key, KeyCode::KeyD | KeyCode::ShiftLeft), DVec2::new(10.0, -5.0), 2.0, 0.1);
        assert!(one.travels() && one.hurry && one.travel == DVec3::X && one.notches == 2.0);
        assert!(one.turn.x > 0.0 && one.turn.y > 0.0);
        let arrow = controls(|key| key == KeyCode::ArrowLeft, DVec2::ZERO, 0.0, 0.1);
        assert!(arrow.turn.x < 0.0 && !arrow.travels());
    }
}
