//! The text chunks of an image: enough to render it again.

use chrono::{DateTime, Utc};

use crate::{
    assets::Stage,
    scene::{Scene, Viewpoint},
};

/// Keyword of the scene's file. What the scene is follows from its fingerprint: the same scene may lie elsewhere.
pub const SCENE: &str = "Scene";

/// Pairs of keyword and text for an image of `stage`, seen from `view` in the light of `instant`.
pub fn notes(stage: &Stage, view: &Viewpoint, instant: DateTime<Utc>) -> Vec<(&'static str, String)> {
    [
        ("Software", format!("Canopy {}", env!("CARGO_PKG_VERSION"))),
        ("Title", stage.scene.name.clone()),
        (SCENE, file_name(&stage.scene)),
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

/// The name of the scene's file without its folder, so that an image has the same bytes wherever the scene lies.
fn file_name(scene: &Scene) -> String {
    let name = scene.file.as_deref().and_then(|file| file.file_name());
    name.map_or_else(|| scene.label(), |name| name.to_string_lossy().into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `./wood.ron` and `/home/me/wood.ron` once gave images of different bytes.
    #[test]
    fn a_scene_is_noted_without_its_folder() {
        for file in ["wood.ron", "./wood.ron", "/home/me/wood.ron"] {
            assert_eq!(file_name(&Scene { file: Some(file.into()), ..Scene::default() }), "wood.ron");
        }
        let built = Scene { name: "wood".to_owned(), file: None, ..Scene::default() };
        assert_eq!(file_name(&built), "the scene `wood`");
    }
}
