//! The canopy cover of each ground: the sum over all forests on it.

use std::sync::Arc;

use bevy::ecs::{
    change_detection::DetectChanges,
    component::Component,
    entity::Entity,
    lifecycle::RemovedComponents,
    query::{Changed, Or, With},
    system::Query,
};
use glam::DVec2;

use super::Terrain3d;
use crate::{
    assets::stage::{COVER_TEXEL, MOST_COVER_TEXELS},
    render::components::{Forest, ForestSurface, Ground},
    scatter::CoverMap,
};

/// Largest texel of a sum in metres. Forests that would need a larger one are too far apart for one map, and that of
/// the largest forest is used.
const LARGEST_TEXEL: f64 = 16.0 * COVER_TEXEL;

/// The canopy cover of a forest, and its terrain.
#[derive(Component, Clone, Debug)]
pub struct ForestCover {
    pub ground: Entity,
    pub map: Arc<CoverMap>,
    /// Metres beyond the terrain's data on which it stands too.
    pub surroundings: f64,
    /// Mean height of its trees, metres.
    pub tree_height: f32,
}

/// Sets the canopy cover of each ground.
pub fn cover_grounds(
    covers: Query<(Entity, &ForestCover, Option<&Forest>)>,
    changed: Query<(), Or<(Changed<ForestCover>, (Changed<Forest>, With<ForestCover>))>>,
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
            .filter(|(_, cover, _)| cover.ground == entity)
            .map(|(forest, cover, _)| (forest, &cover.map))
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
        let of_ground = || covers.iter().filter(|(_, cover, _)| cover.ground == entity);
        let surroundings = of_ground().map(|(_, cover, _)| cover.surroundings).fold(0.0, f64::max);
        // Of several forests, the surface is that of the one whose trees vanish first.
        let surfaces = of_ground().filter_map(|(_, cover, forest)| {
            Some(ForestSurface { fade: forest?.levels.surface()?, tree_height: cover.tree_height })
        });
        let begin = |surface: &ForestSurface| surface.fade.start * surface.tree_height;
        let surface = surfaces.min_by(|a, b| begin(a).total_cmp(&begin(b)));
        if ground.forest_surface != surface {
            ground.forest_surface = surface;
        }
        if ground.surroundings != surroundings {
            ground.surroundings = surroundings;
        }
    }
}

/// The sum of maps, at most 255 per texel, on the smallest texels that all of them have in common: their sizes differ by
/// powers of two, and they begin at multiples of their size. `None` for no maps; a single map is returned as it is.
fn sum(maps: &[&Arc<CoverMap>]) -> Option<Arc<CoverMap>> {
    let filled: Vec<&Arc<CoverMap>> = maps.iter().filter(|map| map.columns > 0 && map.rows > 0).copied().collect();
    let (first, others) = filled.split_first()?;
    if others.is_empty() {
        return Some(Arc::clone(first));
    }
    let extent = |map: &CoverMap| map.texel * DVec2::new(f64::from(map.columns), f64::from(map.rows));
    let min = filled.iter().fold(first.origin, |min, map| min.min(map.origin));
    let max = filled.iter().fold(first.origin, |max, map| max.max(map.origin + extent(map)));
    let mut texel = filled.iter().fold(first.texel, |texel, map| texel.max(map.texel));
    let frame = |texel: f64| {
        let first = (min / texel).floor();
        (first * texel, (max / texel).ceil() - first)
    };
    let is_large = |texel: f64| {
        let (_, size) = frame(texel);
        !(0.0..=f64::from(MOST_COVER_TEXELS)).contains(&(size.x * size.y))
    };
    while is_large(texel) && texel < LARGEST_TEXEL {
        texel *= 2.0;
    }
    if is_large(texel) {
        return filled.iter().max_by_key(|map| map.cover.len()).map(|map| Arc::clone(map));
    }
    let (min, size) = frame(texel);
    let (columns, rows) = (size.x as usize, size.y as usize);
    let mut cover = vec![0u8; columns * rows];
    for map in filled.iter().map(|map| map.coarsened((texel / map.texel).round() as u32)) {
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
    fn covers_of_different_texels_add_up_on_the_larger_ones() {
        let fine = map((-8.0, 8.0), 2, &[10, 30, 40, 60]);
        let coarse = Arc::new(CoverMap { origin: DVec2::ZERO, texel: 16.0, columns: 1, rows: 1, cover: vec![100] });
        let both = sum(&[&fine, &coarse]).expect("a map");
        assert_eq!((both.origin, both.texel, both.columns, both.rows), (DVec2::new(-16.0, 0.0), 16.0, 2, 2));
        // Each coarse texel has one of the fine ones in its four.
        assert_eq!(both.cover, [3, 108, 10, 15]);
    }

    #[test]
    fn forests_far_apart_share_a_map_of_larger_texels() {
        let here = map((0.0, 0.0), 2, &[200; 4]);
        let there = map((80_000.0, 80_000.0), 2, &[200; 4]);
        let both = sum(&[&here, &there]).expect("a map");
        assert!(both.texel == 32.0 && both.cover.len() <= MOST_COVER_TEXELS as usize, "{}", both.texel);
        assert_eq!(both.at(DVec2::ONE), 50.0 / 255.0);
        assert_eq!(both.at(DVec2::splat(80_001.0)), 50.0 / 255.0);
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
