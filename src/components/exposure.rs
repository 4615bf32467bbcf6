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

use crate::{
    render::{
        components::{CanopyCamera, CanopyOrigin, Daylight, Forest, Ground},
        exposure::{CameraExposure, StandTotals},
        report::FrameReport,
    },
    scatter::PackedStand,
};

/// What the exposure in a stand is computed from, kept while light and forests stay.
#[derive(Resource, Default)]
pub struct StandCache {
    totals: Vec<(Entity, Arc<PackedStand>, StandTotals)>,
    exposure: Option<(Daylight, StandTotals, Arc<CameraExposure>)>,
}

impl StandCache {
    /// The sums over all forests.
    fn totals<'a>(&mut self, forests: impl Iterator<Item = (Entity, &'a Forest)>) -> StandTotals {
        let mut sum = StandTotals::default();
        let mut known = Vec::new();
        for (entity, forest) in forests {
            let kept = self.totals.iter().find(|(of, stand, _)| *of == entity && Arc::ptr_eq(stand, &forest.stand));
            let own = kept.map_or_else(|| StandTotals::of(&forest.stand, &forest.plants), |(.., totals)| *totals);
            sum = sum.combined(own);
            known.push((entity, forest.stand.clone(), own));
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
    forests: Query<(Entity, &Forest, &InheritedVisibility)>,
    grounds: Query<(Entity, &Ground, &GlobalTransform, &InheritedVisibility)>,
    cameras: Query<(Entity, &GlobalTransform, Option<&Exposure>), With<CanopyCamera>>,
) {
    let Some(daylight) = daylight else { return };
    let visible = || forests.iter().filter(|(.., visibility)| visibility.get());
    let mut order: Vec<_> = visible().map(|(entity, forest, _)| (entity, forest)).collect();
    order.sort_by_key(|(entity, _)| *entity);
    let totals = cache.totals(order.into_iter());
    let exposure = cache.exposure(&daylight, totals);
    let ground = grounds.iter().filter(|(.., visibility)| visibility.get()).min_by_key(|(entity, ..)| *entity);
    let origin = origin.map_or_else(CanopyOrigin::default, |origin| *origin);
    for (camera, place, current) in &cameras {
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
    }
}
