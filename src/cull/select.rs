//! The trees that a volume sees, in order: the oracle of `shaders/cull/lists.wgsl`, and what draws where the device cannot.

use super::{
    clusters::{Page, TreeSize},
    lists::{DrawLists, Grouping, ListBuilder},
    volume::{ClusterLook, Volume},
};
use crate::scatter::PackedTree;

/// The trees of `page` that `volume` sees, by level and group, as indices into the page's trees.
///
/// Clusters come in the order of their keys (front to back, those that no plane of a view cuts before the others), clusters of equal keys and the trees within a cluster in the
/// order of the stand. `trees` are the page's trees, `sizes` those of the plants, `groupings` has one entry for each
/// level.
pub fn select(
    page: &Page,
    trees: &[PackedTree],
    sizes: &[TreeSize],
    groupings: &[Grouping],
    volume: &Volume,
) -> DrawLists {
    let mut seen: Vec<(u32, u32, Option<u32>)> = page
        .clusters
        .iter()
        .enumerate()
        .filter_map(|(index, cluster)| match volume.look_at(cluster) {
            ClusterLook::Hidden => None,
            ClusterLook::Whole { key, level } => Some((key, index as u32, Some(level))),
            ClusterLook::Mixed { key } => Some((key, index as u32, None)),
        })
        .collect();
    seen.sort_unstable();

    let mut lists = ListBuilder::new(groupings, sizes.len());
    for (_, index, whole) in seen {
        let Some(cluster) = page.clusters.get(index as usize) else { continue };
        let members = cluster.first..cluster.first + cluster.count;
        if let Some(list) = whole.and_then(|level| lists.list(level as usize, 0)) {
            list.extend(members);
            continue;
        }
        for member in members {
            let Some(tree) = trees.get(member as usize) else { continue };
            let variant = usize::from(tree.variant());
            let Some(&size) = sizes.get(variant) else { continue };
            let levels = volume.levels_of_tree(tree, size);
            for level in (0..groupings.len()).filter(|level| levels >> level & 1 == 1) {
                if let Some(list) = lists.list(level, variant) {
                    list.push(member);
                }
            }
        }
    }
    lists.finish()
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Mat4, Quat, Vec4Swizzles};
    use proptest::prelude::*;

    use super::*;
    use crate::{
        cull::{
            Drawn, Frustum, SeenShadows,
            cascades::{CascadeBox, LOWEST_SINE, light_frame},
            clusters::{CLUSTER_TREES, pages},
            volume::KEYS,
        },
        lod::{
            FadeBand, GONE, Levels, Representation,
            level_distance::{FACTOR_ONE, distance_factor},
        },
        scatter::{PackedStand, PlantSize, Stand, Tree},
    };

    const SIZES: [PlantSize; 2] = [PlantSize { height: 9.0, radius: 3.0 }, PlantSize { height: 22.0, radius: 5.5 }];
    const GROUPINGS: [Grouping; 2] = [Grouping::ByVariant, Grouping::Together];

    fn levels() -> Levels {
        Levels::only(Representation::MODEL).then(FadeBand::new(40.0, 12.0), Representation::CROSS)
    }

    fn stands() -> impl Strategy<Value = PackedStand> {
        let tree = (-1.0f64..1.0, -20.0f64..40.0, -1.0f64..1.0, 0.5f32..2.0, 0u16..2);
        let cell = prop_oneof![Just(64.0), 5.0f64..300.0];
        (prop::collection::vec(tree, 0..400), 1.0f64..2000.0, cell).prop_map(|(trees, size, cell)| {
            let trees = trees.into_iter().enumerate();
            let trees = trees.map(|(index, (x, y, z, scale, variant))| Tree {
                position: DVec3::new(size * x + 5_000.0, y, size * z - 30_000.0),
                yaw: 1.0,
                scale,
                variant,
                tint: 0.0,
                index: index as u32,
            });
            PackedStand::new(&Stand { trees: trees.collect() }, cell, &SIZES).expect("trees that can be packed")
        })
    }

    fn cameras() -> impl Strategy<Value = (DVec3, Frustum)> {
        let angles = (-180.0f32..180.0, -90.0f32..90.0, prop_oneof![Just(1.0f32), 5.0f32..120.0, Just(170.0)]);
        ((-1.5f64..1.5, -30.0f64..600.0, -1.5f64..1.5), angles).prop_map(|((x, y, z), (yaw, pitch, view))| {
            let rotation = Quat::from_rotation_y(yaw.to_radians()) * Quat::from_rotation_x(pitch.to_radians());
            let projection = Mat4::perspective_infinite_reverse_rh(view.to_radians(), 1.6, 0.1);
            let frustum = Frustum::new(&(projection * Mat4::from_quat(rotation.inverse())));
            (DVec3::new(5_000.0 + 1_000.0 * x, y, -30_000.0 + 1_000.0 * z), frustum)
        })
    }

    /// Levels of each tree in the lists, as bits.
    fn listed(stand: &PackedStand, lists: &[(DrawLists, usize)]) -> Vec<u32> {
        let mut bits = vec![0; stand.trees.len()];
        for (lists, first) in lists {
            for (level, ranges) in lists.levels.iter().enumerate() {
                for tree in ranges.iter().flat_map(|range| &lists.visible[range.start as usize..range.end as usize]) {
                    let bit = &mut bits[first + *tree as usize];
                    assert_eq!(*bit >> level & 1, 0, "a tree is listed twice");
                    *bit |= 1 << level;
                }
            }
        }
        bits
    }

    /// Lists of all pages, with the first tree of each.
    fn lists_of(stand: &PackedStand, most_trees: usize, volume: impl Fn(&Drawn) -> Volume) -> Vec<(DrawLists, usize)> {
        let sizes = SIZES.each_ref().map(TreeSize::from);
        pages(stand, &SIZES, most_trees)
            .iter()
            .map(|page| {
                let drawn = Drawn { page, grid: stand.grid, groupings: &GROUPINGS, variants: SIZES.len() };
                let trees = &stand.trees[page.trees.clone()];
                (select(page, trees, &sizes, &GROUPINGS, &volume(&drawn)), page.trees.start)
            })
            .collect()
    }

    /// The distance by which a tree's levels are chosen.
    fn by_size(tree: &PackedTree, distance: f64) -> f64 {
        let size = TreeSize::from(&SIZES[usize::from(tree.variant())]);
        distance * f64::from(distance_factor(tree, size.inverse_height)) / f64::from(FACTOR_ONE)
    }

    /// Smallest and largest corner of a tree's box, in f64.
    fn tree_box(stand: &PackedStand, tree: &PackedTree, wider: f64) -> (DVec3, DVec3) {
        let size = SIZES[usize::from(tree.variant())];
        let (foot, scale) = (tree.position(&stand.grid), f64::from(tree.scale()));
        let (radius, height) = (f64::from(size.radius) * scale, f64::from(size.height) * scale);
        let low = foot - DVec3::new(radius, 0.0, radius);
        (low - wider, foot + DVec3::new(radius, height, radius) + wider)
    }

    fn reach(normal: DVec3, min: DVec3, max: DVec3) -> f64 {
        (normal * min).max(normal * max).element_sum()
    }

    proptest! {
        #[test]
        fn a_view_lists_every_tree_that_it_sees_and_few_others(
            stand in stands(), (camera, frustum) in cameras(), view_distance in 20.0f32..3e3,
            most_trees in prop_oneof![Just(usize::MAX), 64usize..200],
        ) {
            let levels = levels();
            let lists = lists_of(&stand, most_trees, |drawn| {
                Volume::view(drawn, camera, &frustum, &levels, view_distance)
            });
            let bits = listed(&stand, &lists);
            for (tree, bits) in stand.trees.iter().zip(bits) {
                let at = tree.position(&stand.grid) - camera;
                let distance = at.x.hypot(at.z);
                let sees = |wider: f64| {
                    let (min, max) = tree_box(&stand, tree, wider);
                    frustum.planes().iter().all(|plane| reach(plane.xyz().as_dvec3(), min - camera, max - camera) >= 0.0)
                };
                let slack = 0.05 + 1e-3 * distance;
                if sees(0.0) && distance < f64::from(view_distance) - slack {
                    for level in 0..2 {
                        let wanted = levels.threshold(level, by_size(tree, at.length()) as f32) < GONE;
                        prop_assert!(!wanted || bits >> level & 1 == 1, "level {} of a tree at {}", level, distance);
                    }
                }
                // Full models are tested one by one; crosses come with their clusters.
                if bits & 1 == 1 {
                    prop_assert!(by_size(tree, at.length() - 8.0) < 52.1 && distance < f64::from(view_distance) + slack);
                    prop_assert!(sees(1.0 + 0.15 * f64::from(tree.scale()) * 22.0), "a tree at {at}");
                }
                prop_assert!(bits & 2 == 0 || by_size(tree, at.length() + 8.0) > 39.9);
            }
        }

        #[test]
        fn pages_share_no_tree(stand in stands(), (camera, frustum) in cameras()) {
            let lists = lists_of(&stand, 100, |drawn| Volume::view(drawn, camera, &frustum, &levels(), 1e6));
            listed(&stand, &lists);
            let mut first = 0;
            for page in pages(&stand, &SIZES, 100) {
                prop_assert_eq!(page.trees.start, first);
                prop_assert!(page.trees.len() <= 100 && !page.clusters.is_empty());
                prop_assert!(page.clusters.iter().all(|cluster| (1..=CLUSTER_TREES as u32).contains(&cluster.count)));
                first = page.trees.end;
            }
            prop_assert_eq!(first, stand.trees.len());
        }

        #[test]
        fn clusters_that_no_plane_of_the_view_cuts_come_first(stand in stands(), (camera, frustum) in cameras()) {
            for page in pages(&stand, &SIZES, usize::MAX) {
                let drawn = Drawn { page: &page, grid: stand.grid, groupings: &GROUPINGS, variants: SIZES.len() };
                let volume = Volume::view(&drawn, camera, &frustum, &levels(), 1e6);
                for cluster in &page.clusters {
                    let (ClusterLook::Whole { key, .. } | ClusterLook::Mixed { key }) = volume.look_at(cluster) else {
                        continue;
                    };
                    let trees = &stand.trees[page.trees.clone()][cluster.first as usize..][..cluster.count as usize];
                    let is_inside = |wider: f64| {
                        trees.iter().all(|tree| {
                            let (min, max) = tree_box(&stand, tree, wider);
                            let planes = frustum.planes();
                            planes.iter().all(|plane| {
                                reach(-plane.xyz().as_dvec3(), min - camera, max - camera) <= f64::from(plane.w)
                            })
                        })
                    };
                    let first = key < KEYS / 2;
                    prop_assert!(!first || is_inside(0.0));
                    // The numbers are whole, and each cluster has one box.
                    let far = trees.iter().map(|tree| tree.position(&stand.grid).distance(camera)).fold(0.0, f64::max);
                    prop_assert!(first || trees.len() > 1 || !is_inside(3.0 + 0.02 * far));
                }
            }
        }

        #[test]
        fn a_cascade_lists_every_caster_in_one_level(
            stand in stands(), (camera, frustum) in cameras(), elevation in 0.02f64..1.5, azimuth in -3.0f64..3.0,
            radius in 20.0f64..900.0, only_seen in any::<bool>(),
        ) {
            let direction = DVec3::new(azimuth.sin() * elevation.cos(), elevation.sin(), -azimuth.cos() * elevation.cos());
            let cascade = CascadeBox::new(camera, radius, 1024, direction, 44.0);
            let casting = [0.0..80.0, 0.0..f64::INFINITY];
            let seen = SeenShadows { camera, frustum: &frustum, lowest: -40.0, margin: 5.0 };
            let seen = only_seen.then_some(seen);
            let origin = DVec3::ZERO;
            let lists = lists_of(&stand, usize::MAX, |drawn| {
                Volume::cascade(drawn, origin, &cascade, &casting, seen.as_ref())
            });
            let frame = light_frame(cascade.direction);
            for (tree, bits) in stand.trees.iter().zip(listed(&stand, &lists)) {
                let (min, max) = tree_box(&stand, tree, 0.0);
                let within = [
                    (frame.x_axis, cascade.half_width),
                    (-frame.x_axis, cascade.half_width),
                    (frame.y_axis, cascade.half_width),
                    (-frame.y_axis, cascade.half_width),
                    (frame.z_axis, cascade.half_depth),
                    (-frame.z_axis, cascade.distance_to_light),
                ]
                .into_iter()
                .all(|(normal, half)| reach(normal, min - cascade.center, max - cascade.center) >= -half);
                let falls = |seen: &SeenShadows| {
                    let middle = 0.5 * (min + max);
                    let drop = (max.y + seen.margin - seen.lowest).max(0.0);
                    let length = drop / cascade.direction.y.max(LOWEST_SINE);
                    let end = middle - cascade.direction * length;
                    frustum.planes().iter().all(|plane| {
                        let normal = plane.xyz().as_dvec3();
                        let above = |point: DVec3| normal.dot(point - camera);
                        // The inscribed sphere: what certainly casts.
                        above(middle).max(above(end)) >= -0.5 * (max - min).min_element()
                    })
                };
                prop_assert!(bits.count_ones() <= 1);
                let at = tree.position(&stand.grid) - cascade.center;
                let distance = at.x.hypot(at.z);
                if within && seen.as_ref().is_none_or(falls) {
                    prop_assert!(bits != 0, "a caster {distance} m away is missing");
                }
                let distance = by_size(tree, distance);
                if bits != 0 && (distance - 80.0).abs() > 0.3 {
                    prop_assert_eq!(bits, if distance < 80.0 { 1 } else { 2 });
                }
            }
        }
    }

    #[test]
    fn clusters_beyond_the_fade_are_taken_as_a_whole() {
        let trees = (0..300).map(|index| Tree {
            position: DVec3::new(f64::from(index % 20) * 3.0, 0.0, -300.0 - f64::from(index / 20) * 3.0),
            yaw: 0.0,
            scale: 1.0,
            variant: (index % 2) as u16,
            tint: 0.0,
            index,
        });
        let stand = PackedStand::new(&Stand { trees: trees.collect() }, 64.0, &SIZES).expect("trees");
        let frustum = Frustum::new(&Mat4::perspective_infinite_reverse_rh(1.0, 1.0, 0.1));
        let lists = lists_of(&stand, usize::MAX, |drawn| Volume::view(drawn, DVec3::ZERO, &frustum, &levels(), 1e4));
        assert_eq!(lists[0].0.count(0), 0);
        assert_eq!(lists[0].0.count(1), 300);
    }
}
