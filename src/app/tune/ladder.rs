//! The values between which a search steps.

use super::{ProfileError, Scene, Sweep, check_names, set_setting, settings_of};

/// A setting with its values in order.
pub type Ladder = Sweep;

/// The settings that cost no bake, from cheap to dear.
const BUILT_IN: [&str; 6] = [
    "quality.near_distance=0,5,10,20,30,40,60,80,120,160,240",
    "quality.shadow_map_size=256,512,1024,2048,4096",
    "quality.cascades=1,2,3,4",
    "quality.shadow_distance=50,100,200,400,800,1600",
    "quality.msaa=1,4",
    "quality.terrain_error=8,4,2,1,0.5",
];

/// The ladders that were asked for, or the built-in ones that have an effect on `scene`.
///
/// # Errors
/// [`ProfileError::Setting`] for a value that a setting cannot have, [`ProfileError::SweptTwice`].
pub fn ladders(asked: &[Sweep], scene: &Scene) -> Result<Vec<Ladder>, ProfileError> {
    check_names(asked)?;
    let has_effect = |ladder: &Sweep| scene.quality.levels.is_empty() || ladder.name != "quality.near_distance";
    let built_in = || BUILT_IN.iter().filter_map(|ladder| ladder.parse().ok()).filter(has_effect).collect();
    let ladders: Vec<Ladder> = if asked.is_empty() { built_in() } else { asked.to_vec() };
    for ladder in &ladders {
        for value in &ladder.values {
            set_setting(&mut scene.clone(), &ladder.name, value)?;
        }
    }
    Ok(ladders)
}

/// The rungs next to the scene's own values, as sweeps: the one below and the one above; for values that are no numbers all
/// others.
pub fn neighbours(ladders: &[Ladder], scene: &Scene) -> Vec<Sweep> {
    let settings = settings_of(scene);
    let of = |ladder: &Ladder| {
        let own = settings.iter().find(|setting| setting.name == ladder.name).map(|setting| setting.value.as_str());
        let numbers: Option<Vec<f64>> = ladder.values.iter().map(|value| value.parse().ok()).collect();
        let values: Vec<String> = match (numbers, own.and_then(|own| own.parse::<f64>().ok())) {
            (Some(numbers), Some(own)) => {
                let next = |above: bool| {
                    let beyond = (0..numbers.len())
                        .filter(|rung| if above { numbers[*rung] > own } else { numbers[*rung] < own });
                    beyond.min_by(|a, b| (numbers[*a] - own).abs().total_cmp(&(numbers[*b] - own).abs()))
                };
                [next(false), next(true)].into_iter().flatten().map(|rung| ladder.values[rung].clone()).collect()
            }
            _ => ladder.values.clone(),
        };
        (!values.is_empty()).then(|| Sweep { name: ladder.name.clone(), values })
    };
    ladders.iter().filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::QualityLevel;

    #[test]
    fn neighbours_are_the_next_rungs() -> Result<(), ProfileError> {
        let mut scene = Scene::default();
        let found = neighbours(&ladders(&[], &scene)?, &scene);
        let values = |name: &str| {
            let sweep = found.iter().find(|sweep| sweep.name == name);
            sweep.map(|sweep| sweep.values.join(",")).unwrap_or_default()
        };
        assert_eq!((values("quality.near_distance"), values("quality.cascades")), ("40,80".to_owned(), "3".to_owned()));
        assert_eq!((values("quality.msaa"), values("quality.terrain_error")), ("1".to_owned(), "0.5,2".to_owned()));
        scene.quality.levels = vec![QualityLevel { draw: "cross".to_owned(), until: 0.0, fade: 1.0 }];
        assert!(ladders(&[], &scene)?.iter().all(|ladder| ladder.name != "quality.near_distance"));
        let wrong = Sweep { name: "quality.msaa".to_owned(), values: vec!["3".to_owned()] };
        assert!(ladders(&[wrong], &scene).is_err());
        Ok(())
    }
}
