//! Whether there is a display to open a window on.

use std::panic::{self, AssertUnwindSafe};

use super::AppError;

/// Checks before the long work whether a window can be opened.
///
/// # Errors
/// [`AppError::NoDisplay`] if the environment names no display.
pub fn check() -> Result<(), AppError> {
    if cfg!(any(not(unix), target_vendor = "apple", target_os = "android")) {
        return Ok(());
    }
    let named = |variable: &str| std::env::var_os(variable).is_some_and(|value| !value.is_empty());
    named_display(named("DISPLAY"), named("WAYLAND_DISPLAY"))
}

/// The program speaks X11; a Wayland desktop offers it through Xwayland, which sets `DISPLAY` too.
fn named_display(x11: bool, wayland: bool) -> Result<(), AppError> {
    let details = match (x11, wayland) {
        (true, _) => return Ok(()),
        (false, true) => "WAYLAND_DISPLAY is set, but DISPLAY is not, and this program needs Xwayland",
        (false, false) => "neither DISPLAY nor WAYLAND_DISPLAY is set",
    };
    Err(AppError::NoDisplay { details: details.to_owned() })
}

/// Builds a Bevy app with a window. Bevy's window plugin panics if the display that the environment names does not
/// answer or if one of its libraries is missing; the panic becomes an error here.
///
/// # Errors
/// [`AppError::NoDisplay`].
pub fn open<T>(build: impl FnOnce() -> T) -> Result<T, AppError> {
    let hook = panic::take_hook();
    panic::set_hook(Box::new(|_| {}));
    let outcome = panic::catch_unwind(AssertUnwindSafe(build));
    panic::set_hook(hook);
    outcome.map_err(|payload| {
        let text = payload.downcast_ref::<String>().map(String::as_str).or(payload.downcast_ref::<&str>().copied());
        let display = std::env::var("DISPLAY").map(|name| format!(" `{name}`")).unwrap_or_default();
        let reason = text.map(|text| format!(" ({text})")).unwrap_or_default();
        AppError::NoDisplay { details: format!("the display{display} does not answer{reason}") }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn x11_is_needed() {
        assert!(named_display(true, false).is_ok() && named_display(true, true).is_ok());
        let error = |wayland| named_display(false, wayland).err().map(|error| error.to_string()).unwrap_or_default();
        assert!(error(true).contains("Xwayland"));
        assert!(error(false).contains("canopy render") && error(false).contains("xvfb-run"));
    }
}
