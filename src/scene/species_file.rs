//! A species in a file of its own: one entry of a scene's list `species`.

use std::path::Path;

use super::{Position, Scene, SceneError, Species};

/// Wraps a species into a scene; on the first line of the text, so that all lines keep their numbers.
const BEFORE: &str = "(terrain: Flat(size: 100), place: (latitude: 0, longitude: 0), species: [";
/// A line of its own: the text may end in a comment.
const AFTER: &str = "\n])";

impl Species {
    /// Reads the text of a species file, which is an entry of a scene's list `species`: `(name: "oak", plant:
    /// Grown(form: Broadleaf), height: (14, 22))`. `path` is its source, for messages and for the relative paths in it.
    ///
    /// # Errors
    /// [`SceneError::Syntax`] or [`SceneError::Invalid`] with the position in the text.
    pub fn parse(text: &str, path: &Path) -> Result<Self, SceneError> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let scene = Scene::parse(&format!("{BEFORE}{text}{AFTER}"), path).map_err(unwrapped)?;
        match <[Self; 1]>::try_from(scene.species) {
            Ok([species]) => Ok(species),
            Err(list) => Err(SceneError::Syntax {
                path: path.to_owned(),
                position: Position { line: 1, column: 1 },
                message: format!("{} species instead of one", list.len()),
                remedy: "write one species to a file: (name: \"oak\", plant: Grown(form: Broadleaf))".to_owned(),
            }),
        }
    }
}

/// The error, with positions in the species' own text.
fn unwrapped(mut error: SceneError) -> SceneError {
    let moved = |position: &mut Position| {
        if position.line == 1 {
            position.column = position.column.saturating_sub(BEFORE.len()).max(1);
        }
    };
    match &mut error {
        SceneError::Syntax { position, .. } => moved(position),
        SceneError::Invalid { problems, .. } => {
            for problem in problems {
                problem.position.iter_mut().for_each(moved);
                if let Some(field) = problem.field.strip_prefix("species[0].") {
                    problem.field = field.to_owned();
                }
            }
        }
        SceneError::Read { .. } | SceneError::TooLarge { .. } => {}
    }
    error
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(text: &str) -> String {
        Species::parse(text, "folder/a.species.ron".as_ref()).map_or_else(|error| error.to_string(), |_| "none".into())
    }

    #[test]
    fn a_species_is_an_entry_of_a_scene() -> Result<(), SceneError> {
        let text = "// An oak.\n(name: \"oak\", plant: Gltf(files: [\"a.glb\"]), height: (14, 22)) // the end";
        let species = Species::parse(text, "folder/a.species.ron".as_ref())?;
        assert_eq!((species.name.as_str(), species.height), ("oak", (14.0, 22.0)));
        assert!(format!("{:?}", species.plant).contains("folder/a.glb"), "{:?}", species.plant);
        Ok(())
    }

    #[test]
    fn errors_have_the_position_in_the_species_own_text() {
        let wrong = error("(name: \"oak\", plant: Grown(), height: (14, -22))");
        assert!(wrong.starts_with("folder/a.species.ron:1:44"), "{wrong}");
        assert!(wrong.contains("`height"), "{wrong}");
        let wrong = error("(name: \"oak\",\n plant: Grown(),\n hight: (14, 22))");
        assert!(wrong.starts_with("folder/a.species.ron:3:2: unknown field `hight`"), "{wrong}");
        let two = error("(name: \"a\", plant: Grown()), (name: \"b\", plant: Grown())");
        assert!(two.contains("2 species instead of one"), "{two}");
        assert_ne!(error(""), "none");
    }
}
