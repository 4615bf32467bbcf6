//! Pipelines of the styles, requested when a view is drawn in one.

use bevy::{
    asset::Handle,
    ecs::{
        query::With,
        resource::Resource,
        system::{Query, Res, ResMut},
        world::{FromWorld, World},
    },
    log::warn_once,
    platform::collections::HashMap,
    render::render_resource::{
        BlendComponent, BlendFactor, BlendOperation, BlendState, CachedRenderPipelineId, ColorTargetState, ColorWrites,
        Face, MultisampleState, PipelineCache, PrimitiveState, RenderPipelineDescriptor, TextureFormat,
    },
    shader::{Shader, ShaderDefVal},
};

use super::{
    full_screen::full_screen,
    layouts::{
        Picture, blur_layout, contours_layout, illumination_layout, lines_layout, noises_layout, particles_layout,
        picture_layout,
    },
    targets::{COLOR_FORMAT, IDENTITY_FORMAT, MAP_FORMAT, SHAPE_FORMAT, has_particles},
};
use crate::{
    lod::Representation,
    render::{
        bindings::frame_layout,
        components::{CanopyCamera, DrawnStyle},
        forest::{
            GpuForests, instance_layout,
            representation::{ForestLevel, LevelTarget},
        },
        gpu::opaque_depth,
        shaders::{CanopyShaders, ShaderFile},
        terrain::{DRAPE, FOREST_SURFACE, GpuTerrain, GroundFeatures, terrain_layout},
        view::{PreparedFrame, ViewFormat},
    },
    style::{LineNormals, Style},
};

/// Shader definition of the pipelines that write surfaces without light.
pub const STYLED: &str = "STYLED";
/// Shader definition of those that keep the leaves' own normals.
const OWN_NORMALS: &str = "OWN_NORMALS";

/// What a level's renderer draws for: only its groups matter, not its colours.
pub const LEVEL_TARGET: LevelTarget = LevelTarget::View(ViewFormat::ANY);

/// The pipelines that were requested.
#[derive(Resource)]
pub struct StylePipelines {
    shaders: CanopyShaders,
    levels: HashMap<(Representation, u32, bool), CachedRenderPipelineId>,
    ground: HashMap<GroundFeatures, CachedRenderPipelineId>,
    illumination: Option<CachedRenderPipelineId>,
    blurs: Option<[CachedRenderPipelineId; 3]>,
    particles: Option<CachedRenderPipelineId>,
    contours: Option<[CachedRenderPipelineId; 2]>,
    noises: Option<CachedRenderPipelineId>,
    pictures: HashMap<(Picture, TextureFormat), CachedRenderPipelineId>,
    /// Whether the leaves' own normals are wanted.
    own_normals: bool,
}

impl FromWorld for StylePipelines {
    fn from_world(world: &mut World) -> Self {
        Self {
            shaders: world.resource::<CanopyShaders>().clone(),
            levels: HashMap::default(),
            ground: HashMap::default(),
            illumination: None,
            blurs: None,
            particles: None,
            contours: None,
            noises: None,
            pictures: HashMap::default(),
            own_normals: false,
        }
    }
}

impl StylePipelines {
    /// The pipeline that writes the surfaces of a level.
    pub fn level(&self, level: &ForestLevel, features: u32) -> Option<CachedRenderPipelineId> {
        self.levels.get(&(level.renderer.representation(), features, self.own_normals)).copied()
    }

    /// That of the ground.
    pub fn ground(&self, features: GroundFeatures) -> Option<CachedRenderPipelineId> {
        self.ground.get(&features).copied()
    }

    /// That of the light.
    pub fn illumination(&self) -> Option<CachedRenderPipelineId> {
        self.illumination
    }

    /// Those of the Gaussian: of maps, of identifiers, and of what they give.
    pub fn blurs(&self) -> Option<[CachedRenderPipelineId; 3]> {
        self.blurs
    }

    /// That of the particles.
    pub fn particles(&self) -> Option<CachedRenderPipelineId> {
        self.particles
    }

    /// Those of the contours' strength and of their lines.
    pub fn contours(&self) -> Option<[CachedRenderPipelineId; 2]> {
        self.contours
    }

    /// That of the noise, which washes need.
    pub fn noises(&self) -> Option<CachedRenderPipelineId> {
        self.noises
    }

    /// That of the picture.
    pub fn picture(&self, picture: Picture, format: TextureFormat) -> Option<CachedRenderPipelineId> {
        self.pictures.get(&(picture, format)).copied()
    }

    fn request(
        &mut self,
        drawn: &DrawnStyle,
        format: TextureFormat,
        forests: &GpuForests,
        ground_features: GroundFeatures,
        cache: &PipelineCache,
    ) {
        let Some(picture) = Picture::of(&drawn.style) else { return };
        self.own_normals = match &drawn.style {
            Style::Lines(lines) => lines.normals == LineNormals::Own,
            Style::Toon(toon) => toon.normals == LineNormals::Own,
            Style::Photograph | Style::Watercolour(_) => false,
        };
        for level in forests.levels() {
            if !level.renderer.styled() {
                warn_once!(
                    "the representation `{}` has no styled shader: its trees are not drawn in watercolour, lines or toon",
                    level.renderer.representation().name()
                );
                continue;
            }
            for features in level.gpu.features(LEVEL_TARGET) {
                let own = self.own_normals;
                self.levels.entry((level.renderer.representation(), features, own)).or_insert_with(|| {
                    cache.queue_render_pipeline(styled(level.renderer.pipeline(features, LEVEL_TARGET), own))
                });
            }
        }
        let shaders = &self.shaders;
        self.ground
            .entry(ground_features)
            .or_insert_with(|| cache.queue_render_pipeline(ground(shaders.get(ShaderFile::Terrain), ground_features)));
        let of_maps = |label, file, own, format| {
            let layout = vec![frame_layout(), own];
            cache.queue_render_pipeline(full_screen(label, shaders.get(file), Vec::new(), layout, format))
        };
        self.illumination.get_or_insert_with(|| {
            of_maps("canopy_style_light", ShaderFile::StyleIllumination, illumination_layout(), MAP_FORMAT)
        });
        self.blurs.get_or_insert_with(|| {
            [(false, MAP_FORMAT), (true, SHAPE_FORMAT), (false, SHAPE_FORMAT)].map(|(identities, format)| {
                let defs = if identities { vec!["IDENTITIES".into()] } else { Vec::new() };
                let shader = shaders.get(ShaderFile::StyleBlur);
                let layout = vec![blur_layout(identities)];
                cache.queue_render_pipeline(full_screen("canopy_style_blur", shader, defs, layout, format))
            })
        });
        if has_particles(&drawn.style) {
            let shader = shaders.get(ShaderFile::StyleParticles);
            self.particles.get_or_insert_with(|| cache.queue_render_pipeline(particles(shader)));
        }
        self.contours.get_or_insert_with(|| {
            [
                of_maps("canopy_style_contours", ShaderFile::StyleContours, contours_layout(), MAP_FORMAT),
                of_maps("canopy_style_lines", ShaderFile::StyleLines, lines_layout(), SHAPE_FORMAT),
            ]
        });
        if picture == Picture::Watercolour {
            self.noises.get_or_insert_with(|| {
                of_maps("canopy_style_noises", ShaderFile::StyleNoiseMap, noises_layout(), MAP_FORMAT)
            });
        }
        self.pictures.entry((picture, format)).or_insert_with(|| {
            let (file, defs): (_, Vec<ShaderDefVal>) = match picture {
                Picture::Watercolour => (ShaderFile::StyleWatercolor, Vec::new()),
                Picture::Lines => (ShaderFile::StyleInk, Vec::new()),
                Picture::Toon => (ShaderFile::StyleInk, vec!["TOON".into()]),
            };
            let layout = vec![frame_layout(), picture_layout(picture)];
            cache.queue_render_pipeline(full_screen("canopy_style_picture", shaders.get(file), defs, layout, format))
        });
    }
}

/// The pipeline of the particles, which add up.
fn particles(shader: Handle<Shader>) -> RenderPipelineDescriptor {
    let layout = vec![frame_layout(), instance_layout(), particles_layout()];
    let mut pipeline = full_screen("canopy_style_particles", shader, Vec::new(), layout, SHAPE_FORMAT);
    let component =
        BlendComponent { src_factor: BlendFactor::One, dst_factor: BlendFactor::One, operation: BlendOperation::Add };
    if let Some(fragment) = &mut pipeline.fragment {
        fragment.targets.iter_mut().flatten().for_each(|target| {
            target.blend = Some(BlendState { color: component, alpha: component });
        });
    }
    pipeline
}

/// What the surfaces' pass writes: normal and height, identifiers, albedo.
fn surface_targets() -> Vec<Option<ColorTargetState>> {
    [MAP_FORMAT, IDENTITY_FORMAT, COLOR_FORMAT]
        .map(|format| Some(ColorTargetState { format, blend: None, write_mask: ColorWrites::ALL }))
        .to_vec()
}

/// The pipeline that writes surfaces where `pipeline` draws light: the same vertices and textures, the entry point `styled`, and none
/// of what is defined for light alone.
fn styled(mut pipeline: RenderPipelineDescriptor, own_normals: bool) -> RenderPipelineDescriptor {
    let restyle = |defs: &mut Vec<ShaderDefVal>| {
        let kept = |def: &ShaderDefVal| {
            ["FOLIAGE", DRAPE, FOREST_SURFACE].iter().any(|name| *def == ShaderDefVal::from(*name))
        };
        defs.retain(kept);
        defs.push(STYLED.into());
        if own_normals {
            defs.push(OWN_NORMALS.into());
        }
    };
    restyle(&mut pipeline.vertex.shader_defs);
    if let Some(fragment) = &mut pipeline.fragment {
        restyle(&mut fragment.shader_defs);
        fragment.entry_point = Some("styled".into());
        fragment.targets = surface_targets();
    }
    pipeline.multisample = MultisampleState::default();
    pipeline.label = Some("canopy_style_trees".into());
    pipeline
}

fn ground(shader: Handle<Shader>, features: GroundFeatures) -> RenderPipelineDescriptor {
    let format = ViewFormat { color: MAP_FORMAT, samples: 1 };
    styled(
        RenderPipelineDescriptor {
            layout: vec![frame_layout(), terrain_layout(features.draped)],
            primitive: PrimitiveState { cull_mode: Some(Face::Back), ..Default::default() },
            ..format.pipeline(&shader, features.defs(), opaque_depth())
        },
        false,
    )
}

/// Requests the pipelines that the view needs in its style.
pub fn prepare_pipelines(
    views: Query<&DrawnStyle, With<CanopyCamera>>,
    frame: Res<PreparedFrame>,
    forests: Res<GpuForests>,
    terrain: Res<GpuTerrain>,
    cache: Res<PipelineCache>,
    mut pipelines: ResMut<StylePipelines>,
) {
    let Some(view) = &frame.view else { return };
    if let Ok(drawn) = views.get(view.entity) {
        pipelines.request(drawn, view.attachment.color, &forests, terrain.features, &cache);
    }
}
