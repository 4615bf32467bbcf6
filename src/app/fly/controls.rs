//! The keys and what they do. The help of the overlay uses the same table.

use bevy::input::keyboard::{Key, KeyCode};
use glam::{DVec2, DVec3};

use super::motion::Controls;

/// Rotation of the view in radians per pixel of mouse motion.
const ROTATION_PER_PIXEL: f64 = 0.0022;
/// Rotation of the view in radians per second of a held arrow key.
const ROTATION_PER_SECOND: f64 = 1.0;

/// A command that a key press gives, once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Command {
    /// Free the mouse, or quit.
    Leave,
    /// Start or leave the scripted flight.
    Tour,
    /// Pause or resume the clock and the scripted flight.
    Pause,
    /// Tint trees by level of detail.
    Tint,
    /// Let the camera go below the ground.
    Underground,
    /// Save an image.
    SaveImage,
    /// Show all keys.
    Help,
    /// Show the small overlay.
    Overlay,
    /// Open or close the settings panel.
    Settings,
    /// Return to the start of the flight, position and time.
    Home,
    /// Read the scene file again.
    Reload,
    /// Show the next year of the inventory, or the one before.
    Year(bool),
    /// Show the next variant of the inventory, or the one before.
    Variant(bool),
    /// Move the clock by this many minutes.
    Minutes(i64),
    /// Move the calendar by this many days.
    Days(i32),
    /// Move the calendar by this many months.
    Months(i32),
    /// Speed the clock up.
    Faster,
    /// Slow the clock down.
    Slower,
}

impl Command {
    /// Whether a held key repeats the command.
    fn repeats(self) -> bool {
        matches!(self, Self::Minutes(_) | Self::Days(_) | Self::Months(_))
    }
}

/// A key press for the open settings panel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PanelInput {
    /// Select the next line, downwards if `true`, else upwards.
    Line(bool),
    /// Select the next section, forwards if `true`, else backwards.
    Section(bool),
    /// Adjust the selected line.
    Value {
        /// Whether to increase it.
        up: bool,
        /// Whether to use a small step.
        fine: bool,
    },
    /// Reset the selected line to the scene's value.
    Reset,
    /// Make the selected number automatic.
    Automatic,
    /// Print the values for a scene file.
    Write,
}

/// All keys and what they do, as the help shows them.
pub const HELP: [(&str, &str); 22] = [
    ("W A S D", "fly forward, left, back, right"),
    ("E  Q", "up, down"),
    ("Shift", "five times faster"),
    ("wheel", "faster, slower"),
    ("mouse", "look around; click to capture it, Esc to release it"),
    ("arrows", "look around without a mouse"),
    ("F", "fly the scene's path; W A S D Q E leaves it"),
    ("Space", "pause the clock and the path"),
    (",  .", "one hour back, forward"),
    ("[  ]", "ten minutes back, forward"),
    ("Page Up, Down", "one day forward, back; with Shift one month"),
    ("+  -", "clock speed: stopped, 1x, 60x, 600x, 3600x"),
    ("Home", "return to the start, position and time"),
    ("R", "load the changed scene file; camera and clock stay"),
    ("Y  V", "next year / next variant of the inventory; with Shift, the previous one"),
    ("U", "allow flight below the ground, or not"),
    ("T", "tint trees by level of detail"),
    ("L", "settings: lighting of the leaves, view, sun and shadows"),
    ("P", "save an image in the working directory"),
    ("O", "show or hide the overlay"),
    ("H", "this help"),
    ("Esc", "release the mouse, then close the panel, then quit"),
];

/// The physical keys of travel, at the positions of W, A, S, D, Q and E on an American keyboard, and their directions
/// as in [`Controls::travel`].
const TRAVEL: [(KeyCode, DVec3); 6] = [
    (KeyCode::KeyW, DVec3::Z),
    (KeyCode::KeyS, DVec3::NEG_Z),
    (KeyCode::KeyD, DVec3::X),
    (KeyCode::KeyA, DVec3::NEG_X),
    (KeyCode::KeyE, DVec3::Y),
    (KeyCode::KeyQ, DVec3::NEG_Y),
];

/// The keys that rotate the view: x to the right, y upward.
const ROTATION: [(KeyCode, DVec2); 4] = [
    (KeyCode::ArrowRight, DVec2::X),
    (KeyCode::ArrowLeft, DVec2::NEG_X),
    (KeyCode::ArrowUp, DVec2::Y),
    (KeyCode::ArrowDown, DVec2::NEG_Y),
];

/// The command of a pressed key. Commands depend on the character of the key, because `[` and `+` are at different
/// positions on different layouts. Keys of travel depend on the position of the key and are not commands.
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
            "p" => Command::SaveImage,
            "h" => Command::Help,
            "o" => Command::Overlay,
            "l" => Command::Settings,
            "r" => Command::Reload,
            "y" => Command::Year(!shift),
            "v" => Command::Variant(!shift),
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

/// The input of a pressed key for the open panel. Tab, and keys that cannot be undone at once, do not repeat.
pub fn panel_input(key: &Key, shift: bool, repeat: bool) -> Option<PanelInput> {
    let input = match key {
        Key::ArrowDown => PanelInput::Line(true),
        Key::ArrowUp => PanelInput::Line(false),
        Key::ArrowRight => PanelInput::Value { up: true, fine: shift },
        Key::ArrowLeft => PanelInput::Value { up: false, fine: shift },
        _ if repeat => return None,
        Key::Tab => PanelInput::Section(!shift),
        Key::Backspace => PanelInput::Reset,
        Key::Delete => PanelInput::Automatic,
        Key::Enter => PanelInput::Write,
        _ => return None,
    };
    Some(input)
}

/// Whether a key rotates the view.
pub fn rotates_view(key: KeyCode) -> bool {
    ROTATION.iter().any(|(rotating, _)| *rotating == key)
}

/// The controls of a step. `held`: whether a key is down. `mouse`: its motion in pixels (x right, y down). `notches`:
/// the wheel's motion.
pub fn controls(held: impl Fn(KeyCode) -> bool, mouse: DVec2, notches: f64, seconds: f64) -> Controls {
    let travel = TRAVEL.iter().filter(|(key, _)| held(*key)).map(|(_, direction)| *direction).sum();
    let keys: DVec2 = ROTATION.iter().filter(|(key, _)| held(*key)).map(|(_, direction)| *direction).sum();
    let rotation =
        DVec2::new(mouse.x, -mouse.y) * ROTATION_PER_PIXEL + keys * (ROTATION_PER_SECOND * seconds.clamp(0.0, 0.25));
    let hurry = held(KeyCode::ShiftLeft) || held(KeyCode::ShiftRight);
    Controls { travel, hurry, rotation, notches }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn typed(code: KeyCode, text: &str) -> Option<Command> {
        command(code, &Key::Character(text.into()), false, false)
    }

    #[test]
    fn commands_depend_on_the_printed_character() {
        assert_eq!(typed(KeyCode::KeyF, "f"), Some(Command::Tour));
        assert_eq!(typed(KeyCode::KeyH, "H"), Some(Command::Help));
        assert_eq!(typed(KeyCode::Equal, "="), Some(Command::Faster));
        // A German keyboard has its plus where an American one has its right bracket.
        assert_eq!(typed(KeyCode::BracketRight, "+"), Some(Command::Faster));
        assert_eq!(typed(KeyCode::BracketRight, "]"), Some(Command::Minutes(10)));
        assert_eq!(typed(KeyCode::KeyX, "x"), None);
    }

    #[test]
    fn keys_of_travel_are_not_commands() {
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
        assert_eq!(typed(KeyCode::KeyL, "l"), Some(Command::Settings));
        assert_eq!(panel_input(&Key::ArrowLeft, true, true), Some(PanelInput::Value { up: false, fine: true }));
        assert_eq!(
            (panel_input(&Key::Tab, true, false), panel_input(&Key::Tab, false, true)),
            (Some(PanelInput::Section(false)), None)
        );
        // What the panel does not know goes to the flight.
        assert_eq!(panel_input(&Key::Character("t".into()), false, false), None);
        assert!(rotates_view(KeyCode::ArrowUp) && !rotates_view(KeyCode::KeyW));
    }

    #[test]
    fn opposite_keys_cancel_and_the_mouse_looks_where_it_goes() {
        let both = controls(|key| matches!(key, KeyCode::KeyW | KeyCode::KeyS), DVec2::ZERO, 0.0, 0.1);
        assert!(!both.travels());
        let one = controls(|key| matches!(key, KeyCode::KeyD | KeyCode::ShiftLeft), DVec2::new(10.0, -5.0), 2.0, 0.1);
        assert!(one.travels() && one.hurry && one.travel == DVec3::X && one.notches == 2.0);
        assert!(one.rotation.x > 0.0 && one.rotation.y > 0.0);
        let arrow = controls(|key| key == KeyCode::ArrowLeft, DVec2::ZERO, 0.0, 0.1);
        assert!(arrow.rotation.x < 0.0 && !arrow.travels());
    }
}
