//! The exposure of cameras: from the light at their place, without history.

use std::sync::Arc;

use bevy::{
    camera::{Exposure, visibility::InheritedVisibility},
    ecs::{
        entity::Entity,
        query::With,
        resource::Resource,
        system::{Commands, Query, Res, ResMut},
    },
    transform::components::GlobalTransform,
};

use crate::render::{
    components::{CameraOpenness, CanopyCamera, CanopyOrigin, Daylight, Forest, ForestUpdates, Ground},
    exposure::{CameraExposure, StandTotals},
    forest::{DrawnForest, DrawnForests},
    report::FrameReport,
};

/// What the exposure in a stand is computed from, kept while light and forests stay.
#[derive(Resource, Default)]
pub struct StandCache {
    totals: Vec<(DrawnForest, StandTotals)>,
    exposure: Option<(Daylight, StandTotals, Arc<CameraExposure>)>,
}

impl StandCache {
    /// The sums over all forests.
    fn totals(&mut self, forests: Vec<DrawnForest>) -> StandTotals {
        let mut sum = StandTotals::default();
        let mut known = Vec::new();
        for forest in forests {
            let same = |of: &DrawnForest| of.entity == forest.entity && Arc::ptr_eq(&of.stand, &forest.stand);
            let kept = self.totals.iter().find(|(of, _)| same(of));
            let own = kept.map_or_else(|| StandTotals::of(&forest.stand, &forest.plants), |(_, totals)| *totals);
            sum = sum.combined(own);
            known.push((forest, own));
        }
        self.totals = known;
        sum
    }

    /// The exposure under `daylight` among trees of these sums.
    fn exposure(&mut self, daylight: &Daylight, totals: StandTotals) -> Arc<CameraExposure> {
        if let Some((of, trees, exposure)) = &self.exposure
            && of == daylight
            && *trees == totals
        {
            return exposure.clone();
        }
        let exposure = Arc::new(CameraExposure::new(daylight.0.clone(), totals));
        self.exposure = Some((daylight.clone(), totals, exposure.clone()));
        exposure
    }
}

/// Sets the exposure on all Canopy cameras.
pub(super) fn expose_cameras(
    mut commands: Commands,
    mut cache: ResMut<StandCache>,
    daylight: Option<Res<Daylight>>,
    origin: Option<Res<CanopyOrigin>>,
    report: Option<Res<FrameReport>>,
    updates: Option<Res<ForestUpdates>>,
    drawn: Option<Res<DrawnForests>>,
    forests: Query<(Entity, &Forest, &InheritedVisibility)>,
    grounds: Query<(Entity, &Ground, &GlobalTransform, &InheritedVisibility)>,
    cameras: Query<(Entity, &GlobalTransform, Option<&Exposure>, Option<&CameraOpenness>), With<CanopyCamera>>,
) {
    let Some(daylight) = daylight else { return };
    // A forest that arrives over several frames counts once it is drawn, and what it replaces until then.
    let spread = updates.is_none_or(|updates| *updates == ForestUpdates::Spread);
    let trees = match drawn.filter(|_| spread) {
        Some(drawn) => drawn.get(),
        None => {
            let visible = forests.iter().filter(|(.., visibility)| visibility.get());
            let of = |(entity, forest, _): (Entity, &Forest, _)| DrawnForest {
                entity,
                stand: forest.stand.clone(),
                plants: forest.plants.clone(),
            };
            let mut order: Vec<_> = visible.map(of).collect();
            order.sort_by_key(|forest| forest.entity);
            order
        }
    };
    let totals = cache.totals(trees);
    let exposure = cache.exposure(&daylight, totals);
    let ground = grounds.iter().filter(|(.., visibility)| visibility.get()).min_by_key(|(entity, ..)| *entity);
    let origin = origin.map_or_else(CanopyOrigin::default, |origin| *origin);
    for (camera, place, current, openness) in &cameras {
        let at = origin.0 + place.translation().as_dvec3();
        let found = match ground {
            Some((_, ground, moved, _)) => exposure.at(ground, at - moved.translation().as_dvec3()),
            None => exposure.in_the_open(),
        };
        if let Some(report) = &report {
            report.ran("exposure", found.to_string());
        }
        if current.is_none_or(|current| current.ev100 != found.ev100) {
            commands.entity(camera).insert(Exposure { ev100: found.ev100 });
        }
        let open = CameraOpenness(found.share);
        if openness.is_none_or(|openness| *openness != open) {
            commands.entity(camera).insert(open);
        }
    }
}
