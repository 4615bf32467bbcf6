//! The canopy cover of each ground: the sum over all forests on it.

use std::sync::Arc;

use bevy::ecs::{
    change_detection::DetectChanges,
    component::Component,
    entity::Entity,
    lifecycle::RemovedComponents,
    query::{Changed, With},
    system::Query,
};
use glam::DVec2;

use super::Terrain3d;
use crate::{render::components::Ground, scatter::CoverMap};

/// Maximum number of texels of a sum; 64 MiB. Beyond it the forests are too far apart for one map, and that of the
/// largest forest is used.
const MOST_TEXELS: f64 = 67_108_864.0;

/// The canopy cover of a forest, and its terrain.
#[derive(Component, Clone, Debug)]
pub struct ForestCover {
    pub ground: Entity,
    pub map: Arc<CoverMap>,
}

/// Sets the canopy cover of each ground.
pub fn cover_grounds(
    covers: Query<(Entity, &ForestCover)>,
    changed: Query<(), Changed<ForestCover>>,
    mut removed: RemovedComponents<ForestCover>,
    mut grounds: Query<(Entity, &mut Ground), With<Terrain3d>>,
) {
    let new_ground = grounds.iter_mut().any(|(_, ground)| ground.is_added());
    if removed.read().count() == 0 && changed.is_empty() && !new_ground {
        return;
    }
    for (entity, mut ground) in &mut grounds {
        let mut maps: Vec<(Entity, &Arc<CoverMap>)> = covers
            .iter()
            .filter(|(_, cover)| cover.ground == entity)
            .map(|(forest, cover)| (forest, &cover.map))
            .collect();
        maps.sort_by_key(|(forest, _)| *forest);
        let maps: Vec<&Arc<CoverMap>> = maps.into_iter().map(|(_, map)| map).collect();
        let cover = sum(&maps);
        let same = match (&cover, &ground.cover) {
            (None, None) => true,
            (Some(new), Some(old)) => Arc::ptr_eq(new, old) || new == old,
            _ => false,
        };
        if !same {
            ground.cover = cover;
        }
    }
}

/// The sum of maps whose texels have one size and lie on one grid, at most 255 per texel. `None` for no maps; a single
/// map is returned as it is.
fn sum(maps: &[&Arc<CoverMap>]) -> Option<Arc<CoverMap>> {
    let filled: Vec<&Arc<CoverMap>> = maps.iter().filter(|map| map.columns > 0 && map.rows > 0).copied().collect();
    let (first, others) = filled.split_first()?;
    if others.is_empty() {
        return Some(Arc::clone(first));
    }
    let texel = first.texel;
    let extent = |map: &CoverMap| texel * DVec2::new(f64::from(map.columns), f64::from(map.rows));
    let min = filled.iter().fold(first.origin, |min, map| min.min(map.origin));
    let max = filled.iter().fold(first.origin, |max, map| max.max(map.origin + extent(map)));
    let size = ((max - min) / texel).round();
    if !(0.0..=MOST_TEXELS).contains(&(size.x * size.y)) {
        return filled.iter().max_by_key(|map| map.cover.len()).map(|map| Arc::clone(map));
    }
    let (columns, rows) = (size.x as usize, size.y as usize);
    let mut cover = vec![0u8; columns * rows];
    for map in &filled {
        let first = ((map.origin - min) / texel).round();
        let (column, row) = (first.x as usize, first.y as usize);
        for (line, from) in map.cover.chunks_exact(map.columns as usize).enumerate() {
            let start = (row + line) * columns + column;
            let Some(to) = cover.get_mut(start..start + from.len()) else { break };
            for (to, from) in to.iter_mut().zip(from) {
                *to = to.saturating_add(*from);
            }
        }
    }
    Some(Arc::new(CoverMap { origin: min, texel, columns: columns as u32, rows: rows as u32, cover }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(origin: (f64, f64), columns: u32, cover: &[u8]) -> Arc<CoverMap> {
        let (origin, rows) = (DVec2::new(origin.0, origin.1), cover.len() as u32 / columns);
        Arc::new(CoverMap { origin, texel: 8.0, columns, rows, cover: cover.to_vec() })
    }

    #[test]
    fn covers_add_up_where_they_overlap_and_stay_where_they_do_not() {
        let west = map((-8.0, 0.0), 2, &[10, 200, 30, 40]);
        let east = map((0.0, 8.0), 2, &[5, 6, 255, 7]);
        let both = sum(&[&west, &east]).expect("a map");
        assert_eq!((both.origin, both.columns, both.rows), (DVec2::new(-8.0, 0.0), 3, 3));
        assert_eq!(both.cover, [10, 200, 0, 30, 45, 6, 0, 255, 7]);
        let twice = sum(&[&west, &west]).expect("a map");
        assert_eq!(twice.cover, [20, 255, 60, 80]);
    }

    #[test]
    fn one_cover_is_itself_and_none_is_none() {
        let one = map((0.0, 0.0), 1, &[9]);
        let nothing = map((0.0, 0.0), 1, &[]);
        assert!(sum(&[&one, &nothing]).is_some_and(|sum| Arc::ptr_eq(&sum, &one)));
        assert!(sum(&[]).is_none() && sum(&[&nothing]).is_none());
        // Too far apart for one map.
        let far = map((1e8, 1e8), 1, &[1]);
        assert!(sum(&[&one, &far]).is_some());
    }
}
