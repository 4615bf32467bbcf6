//! The scene of a transfer bake: the plant's points, and the rays that connect them with the surfaces that they hit.

use glam::Vec3;

use super::TransferSettings;
use super::points::Points;
use crate::math::luminance;
use crate::plant::PartKind;
use crate::trace::{Hit, ParallelTracer, PlantTracer};

/// Front and back, slot by slot.
pub(super) type Sides = [Vec<f32>; 2];

/// What a bake works on.
pub(super) struct Scene<'a> {
    pub tracer: &'a PlantTracer,
    pub points: &'a Points,
    pub settings: TransferSettings,
}

impl Scene<'_> {
    /// A colour in as many channels as are baked.
    pub fn in_channels(&self, color: Vec3) -> [f32; 3] {
        if self.settings.channels.count() == 1 { [luminance(color), 0.0, 0.0] } else { color.to_array() }
    }

    /// The lines through all points, by direction.
    pub fn lines(&self) -> ParallelTracer<'_> {
        self.tracer.parallel(self.points.list.iter().map(|point| point.position))
    }
}

/// A ray that hit a surface, which may scatter light back along it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Link {
    /// The part and its triangle that were met, and whether from the front.
    pub part: u32,
    pub triangle: u32,
    pub front: bool,
    /// What the link counts: the cosine at its point.
    pub weight: f32,
    /// What the side that was met passes on, by channel; zero for the inside of wood, which is dark.
    pub near: [f32; 3],
    /// What the other side passes through, by channel; zero for wood.
    pub far: [f32; 3],
}

impl Link {
    /// The link along a ray that met `hit`.
    pub fn new(scene: &Scene, hit: &Hit, weight: f32) -> Self {
        let surface = scene.tracer.point(hit);
        let near = if surface.kind == PartKind::Wood && !hit.front { Vec3::ZERO } else { surface.base_color };
        Self {
            part: hit.part,
            triangle: hit.triangle,
            front: hit.front,
            weight,
            near: scene.in_channels(near),
            far: scene.in_channels(surface.transmission),
        }
    }
}

/// All links, by slot and side.
pub(super) struct Links {
    list: Vec<Link>,
    /// Where the links of `2 * slot + side` start; one entry more than there are.
    starts: Vec<u32>,
}

impl Links {
    /// From the links of each line, each with `2 * slot + side`; those of one side stay in the order of the lines.
    /// Their weights are scaled to the share of even surroundings that is `hidden` from each side.
    pub fn new(by_line: Vec<Vec<(u32, Link)>>, hidden: &[Vec<f32>; 2]) -> Self {
        let keys = 2 * hidden[0].len();
        let mut starts = vec![0u32; keys + 1];
        for (of, _) in by_line.iter().flatten() {
            starts[*of as usize + 1] += 1;
        }
        for of in 0..keys {
            starts[of + 1] += starts[of];
        }
        let mut next = starts.clone();
        let mut list = vec![Link::default(); starts[keys] as usize];
        for (of, link) in by_line.into_iter().flatten() {
            list[next[of as usize] as usize] = link;
            next[of as usize] += 1;
        }
        for of in 0..keys {
            let links = &mut list[starts[of] as usize..starts[of + 1] as usize];
            let total: f32 = links.iter().map(|link| link.weight).sum();
            let scale = if total > 0.0 { hidden[of % 2][of / 2] / total } else { 0.0 };
            links.iter_mut().for_each(|link| link.weight *= scale);
        }
        Self { list, starts }
    }
    /// The links of one side of `slot`: 0 front, 1 back.
    pub fn of(&self, slot: usize, side: usize) -> &[Link] {
        let (from, to) = (self.starts[2 * slot + side], self.starts[2 * slot + side + 1]);
        &self.list[from as usize..to as usize]
    }
}
