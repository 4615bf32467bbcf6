//! The text chunks of an image: enough to render it again.

use chrono::{DateTime, Utc};

use crate::{assets::Stage, scene::Viewpoint};

/// Pairs of keyword and text for an image of `stage`, seen from `view` in the light of `instant`.
pub fn notes(stage: &Stage, view: &Viewpoint, instant: DateTime<Utc>) -> Vec<(&'static str, String)> {
    [
        ("Software", format!("Canopy {}", env!("CARGO_PKG_VERSION"))),
        ("Title", stage.scene.name.clone()),
        ("Scene", stage.scene.label()),
        ("Instant", instant.to_rfc3339()),
        ("Place", format!("{:.6}, {:.6}", stage.observer.latitude_deg, stage.observer.longitude_deg)),
        (
            "Camera",
            format!(
                "position {:.3}, {:.3}, {:.3} m; yaw {:.4} rad; pitch {:.4} rad; field of view {:.4} rad",
                view.position.x, view.position.y, view.position.z, view.yaw, view.pitch, view.field_of_view
            ),
        ),
        ("Seed", stage.scene.seed.to_string()),
        ("Quality", format!("{:?}", stage.scene.quality)),
    ]
    .into_iter()
    .chain(stage.scene.style.is_drawn().then(|| ("Style", format!("{:?}", stage.scene.style))))
    .collect()
}
