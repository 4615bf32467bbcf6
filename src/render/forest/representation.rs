//! The traits that a level of detail implements to be drawn: the renderer's side of a [`Representation`].
//!
//! ```text
//!   Levels of a forest ── by name ──> LevelRenderer ── upload ──> GpuLevel, one per forest
//!                                         │ pipeline                  │ draw (view, shadow maps), relight
//!                                         v                           v
//!                                    LevelPipelines ────────────> forest pass, sun shadow pass
//! ```
//!
//! A new level is one file that bakes it (in `bake/levels`, if it needs a bake), one that implements both traits, one
//! shader, and one line in `levels::built_in`. A program adds its own with [`RegisterRepresentation`];
//! `examples/box_level.rs` is one with under a hundred lines. Shared code (lists of trees, thresholds, tints,
//! statistics, reports) iterates over the list and does not refer to any single level.

use std::sync::Arc;

use bevy::{
    app::App,
    ecs::resource::Resource,
    log::warn,
    render::{
        RenderApp,
        render_phase::TrackedRenderPass,
        render_resource::{BindGroupLayoutDescriptor, DepthStencilState, RenderPipelineDescriptor},
    },
};
use glam::Vec3;

use super::instance_layout::instance_layout;
pub use super::{
    drawn_trees::DrawnTrees,
    upload::{DeviceWrites, ForestUpload},
};
pub use crate::render::cull::{TreeDraw, TreeVertices};
use crate::{
    bake::BakedPlant,
    cull::Grouping,
    lod::Representation,
    render::{
        bindings::{SHADOW_FORMAT, caster_layout, frame_layout},
        components::{Forest, SunLight},
        gpu::{opaque_depth, reversed_depth},
        view::ViewFormat,
    },
};

/// The target of a level's pipeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LevelTarget {
    /// Colour and depth of a view.
    View(ViewFormat),
    /// Depth of a shadow map.
    ShadowMap,
}

impl LevelTarget {
    /// Bind group layouts of a pipeline: group 0 (the view, or the cascade), group 1 (the trees), then the level's own.
    pub fn layouts(self, own: impl IntoIterator<Item = BindGroupLayoutDescriptor>) -> Vec<BindGroupLayoutDescriptor> {
        let first = match self {
            Self::View(_) => frame_layout(),
            Self::ShadowMap => caster_layout(),
        };
        [first, instance_layout()].into_iter().chain(own).collect()
    }

    /// Depth test and write.
    pub fn depth(self) -> DepthStencilState {
        match self {
            Self::View(_) => opaque_depth(),
            Self::ShadowMap => reversed_depth(SHADOW_FORMAT),
        }
    }
}

/// Draws one representation. One value is used for all forests.
pub trait LevelRenderer: Send + Sync + 'static {
    /// The representation that it draws.
    fn representation(&self) -> Representation;

    /// Plural name of its trees in reports, such as "crosses".
    fn label(&self) -> &'static str;

    /// Linear colour of its trees when levels are tinted.
    fn tint(&self) -> Vec3;

    /// How its draw calls group the trees.
    fn grouping(&self) -> Grouping;

    /// Metres per texel of the coarsest shadow map into which it casts. `None`: it never casts. The farthest level of a
    /// forest that casts at all casts into every map.
    fn coarsest_shadow_texel(&self) -> Option<f64>;

    /// Uploads the plants of `forest`.
    fn upload(&self, forest: &Forest, upload: &mut ForestUpload) -> Box<dyn GpuLevel>;

    /// Whether `new` has the same shape as `old`, so that [`GpuLevel::relight`] can update one to the other.
    fn same_shape(&self, old: &BakedPlant, new: &BakedPlant) -> bool;

    /// The pipeline for `features` (bits that only this renderer interprets) and `target`. Both entry points of its
    /// shader use groups 0 and 1 as in [`LevelTarget::layouts`].
    fn pipeline(&self, features: u32, target: LevelTarget) -> RenderPipelineDescriptor;

    /// A pipeline of the same layout that writes the depth alone of what [`pipeline`](Self::pipeline) draws into a view of
    /// `format`, for a level whose light costs much more than its depth. `None`: depth and light are drawn at once. Where
    /// there is one, both are compiled with the shader definition [`DEPTH_FIRST`], under which their positions must be
    /// `@invariant`.
    fn depth_pipeline(&self, _features: u32, _format: ViewFormat) -> Option<RenderPipelineDescriptor> {
        None
    }

    /// Whether its shaders can be drawn in a style: under the definition `STYLED` they have a fragment entry point `styled`, which
    /// returns a `StyledSurface` (`shaders/style/surface.wgsl`); of the other definitions only `FOLIAGE` is kept.
    fn styled(&self) -> bool {
        false
    }
}

/// Shader definition of the pipelines of a level whose depth is drawn before its light.
pub const DEPTH_FIRST: &str = "DEPTH_FIRST";

/// The plants of one forest in one representation on the device.
pub trait GpuLevel: Send + Sync + 'static {
    /// The pipelines that these plants need, in the order in which they draw.
    fn features(&self, target: LevelTarget) -> Vec<u32>;

    /// Triangles of a tree of `variant`.
    fn triangles(&self, variant: usize) -> usize;

    /// Every draw call that [`draw`](Self::draw) may make into `target`, of all pipelines: a group of trees (a variant, or
    /// 0, by the renderer's [`Grouping`]) and the vertices of each tree. They stay the same while the plants' shapes do.
    fn draws(&self, target: LevelTarget) -> Vec<TreeDraw>;

    /// Draws those `trees` that belong to the pipeline of `features`, which is set, as are groups 0 and 1, by draw calls
    /// that [`draws`](Self::draws) lists: how many trees there are is known on the device only.
    fn draw<'a>(&'a self, pass: &mut TrackedRenderPass<'a>, features: u32, target: LevelTarget, trees: &DrawnTrees<'a>);

    /// Overwrites the lighting on the device with that of other bakes of the same shapes.
    fn relight(&mut self, relight: &Relight, upload: &mut ForestUpload);
}

/// New bakes of plants that are already drawn.
#[derive(Clone, Copy, Debug)]
pub struct Relight<'a> {
    /// The plants on the device.
    pub old: &'a [BakedPlant],
    /// The new plants, each of the same shape as the old one.
    pub new: &'a [BakedPlant],
    /// How the sun lights each plant; the default beyond the end of the list.
    pub suns: &'a [SunLight],
}

/// All representations that can be drawn: a resource of the main world until the app is finished, then of the render
/// world.
#[derive(Resource, Clone, Default)]
pub struct Representations(Vec<Arc<dyn LevelRenderer>>);

impl Representations {
    /// Adds a renderer; `false` if one of that name exists already, which stays.
    pub fn add(&mut self, renderer: Arc<dyn LevelRenderer>) -> bool {
        let new = self.get(renderer.representation()).is_none();
        if new {
            self.0.push(renderer);
        }
        new
    }

    /// The renderer of a representation.
    pub fn get(&self, representation: Representation) -> Option<&Arc<dyn LevelRenderer>> {
        self.0.iter().find(|renderer| renderer.representation() == representation)
    }

    /// All renderers in the order in which they were added.
    pub fn iter(&self) -> impl Iterator<Item = &Arc<dyn LevelRenderer>> {
        self.0.iter()
    }
}

/// Adds custom representations.
pub trait RegisterRepresentation {
    /// Registers `renderer`, before or after Canopy's plugins are added. Forests that were uploaded before keep their
    /// renderers.
    fn register_representation(&mut self, renderer: impl LevelRenderer) -> &mut Self;
}

impl RegisterRepresentation for App {
    fn register_representation(&mut self, renderer: impl LevelRenderer) -> &mut Self {
        let name = renderer.representation().name();
        let renderer = Arc::new(renderer);
        // Once the plugins are finished, the render world has the list.
        let render_world = self.get_sub_app_mut(RenderApp).map(|render_app| render_app.world_mut());
        let new = match render_world.and_then(|world| world.get_resource_mut::<Representations>()) {
            Some(mut known) => known.add(renderer),
            None => self.world_mut().get_resource_or_init::<Representations>().add(renderer),
        };
        if !new {
            warn!("a representation called `{name}` is registered already: the second one is not used");
        }
        self
    }
}

/// A level of one forest on the device.
pub struct ForestLevel {
    /// The renderer that draws it.
    pub renderer: Arc<dyn LevelRenderer>,
    /// Its plants.
    pub gpu: Box<dyn GpuLevel>,
}
