//! Images of the flight: what the window shows without its overlays, with the settings that reproduce it.

use std::{
    path::PathBuf,
    time::{SystemTime, UNIX_EPOCH},
};

use bevy::{
    ecs::{
        observer::On,
        system::{Commands, Res, ResMut, Single},
    },
    image::Image,
    log::warn,
    render::view::screenshot::{Screenshot, ScreenshotCaptured},
};
use chrono::{DateTime, Utc};

use super::{session::Session, settings::SettingsPanel};
use crate::{
    app::{error::AppError, notes::notes, rendered_image::RenderedImage},
    components::DrawnSun,
    render::components::{CanopyStyle, ViewOptions},
};

/// Captures this frame if the session asks for it.
pub fn save_image(
    mut commands: Commands,
    session: Res<Session>,
    panel: Res<SettingsPanel>,
    view: Single<(&ViewOptions, &CanopyStyle)>,
    drawn: Option<Res<DrawnSun>>,
) {
    if !session.capturing {
        return;
    }
    // The light may lag behind the clock.
    let instant = drawn.map_or_else(|| session.clock.now().to_utc(), |sun| sun.0.instant);
    let (view, style) = view.into_inner();
    let mut notes = notes(&session.stage, &session.view(), instant);
    if view.tint_levels {
        notes.push(("View", "trees tinted by level of detail".to_owned()));
    }
    if *style != session.stage.style {
        notes.retain(|(name, _)| *name != "Style");
        notes.push(("Style", format!("{:?}", style.style)));
    }
    notes.extend(panel.notes().map(|light| ("Light", light)));
    let save = move |captured: On<ScreenshotCaptured>, mut session: ResMut<Session>| {
        let outcome = picture(&captured.image).and_then(|picture| {
            let file = free_name(SystemTime::now());
            picture.save(&file, &notes).map(|()| file)
        });
        session.show_message(match outcome {
            Ok(file) => format!("saved {}", file.display()),
            Err(error) => {
                warn!("{error}");
                error.to_string()
            }
        });
    };
    commands.spawn(Screenshot::primary_window()).observe(save);
}

fn picture(image: &Image) -> Result<RenderedImage, AppError> {
    let failed = |error: &dyn std::fmt::Display| AppError::Render(format!("the image could not be read back: {error}"));
    let pixels = image.clone().try_into_dynamic().map_err(|error| failed(&error))?.to_rgb8();
    Ok(RenderedImage { width: pixels.width(), height: pixels.height(), pixels: pixels.into_raw() })
}

/// An unused file name in the working directory: date, time (UTC) and a number.
fn free_name(now: SystemTime) -> PathBuf {
    let seconds = now.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
    let time = i64::try_from(seconds).ok().and_then(|seconds| DateTime::<Utc>::from_timestamp(seconds, 0));
    let stamp = time.unwrap_or_default().format("%Y%m%d-%H%M%S");
    let name = |number: u32| PathBuf::from(format!("canopy-{stamp}-{number}.png"));
    (1..u32::MAX).map(name).find(|file| !file.exists()).unwrap_or_else(|| name(0))
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn names_carry_the_time() {
        let name = free_name(UNIX_EPOCH + Duration::from_secs(1_782_055_800));
        assert_eq!(name, PathBuf::from("canopy-20260621-153000-1.png"));
    }
}
