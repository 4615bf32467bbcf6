//! A custom level of detail: beyond 80 m a tree 20 m high is a box of its size. `cargo run --release --example box_level`
//!
//! A level needs a shader, a [`LevelRenderer`] and a [`GpuLevel`]. Lists and statistics come with [`Forest::levels`].

use bevy::{
    prelude::*,
    render::{render_phase::TrackedRenderPass, render_resource::RenderPipelineDescriptor},
};
use canopy::{bake::BakedPlant, cull::Grouping, prelude::*, render::forest::representation::*};

/// Twelve triangles per tree; the shader pulls their 36 vertices. Group 0 is the frame, group 1 the trees.
const WGSL: &str = "
#import canopy::frame::{frame, light}
#import canopy::instance::{trees, visible, variants, unpack_tree, plant_vertex_position, rotate, tint_level}
#import canopy::output::finish
struct Varying {
    @builtin(position) clip: vec4<f32>,
    @location(0) relative: vec3<f32>,
    @location(1) normal: vec3<f32>,
}
@vertex fn vertex(@builtin(vertex_index) index: u32) -> Varying {
    var corners = array(vec2(-1., -1.), vec2(1., -1.), vec2(1., 1.), vec2(-1., -1.), vec2(1., 1.), vec2(-1., 1.));
    let tree = unpack_tree(trees[visible[index / 36u]]);
    let face = index % 36u / 6u;
    let p = vec3(corners[index % 6u], select(-1., 1., face < 3u));
    let n = vec3(0., 0., p.z);
    let turn = face % 3u;
    let corner = select(select(p, p.zxy, turn == 1u), p.yzx, turn == 2u);
    let normal = select(select(n, n.zxy, turn == 1u), n.yzx, turn == 2u);
    let half = vec3(variants[tree.variant].crown_radius, 0.5 * variants[tree.variant].height, 0.).xyx;
    let position = plant_vertex_position(tree, corner * half + vec3(0., half.y, 0.));
    return Varying(frame.clip_from_relative * vec4(position.relative, 1.), position.relative, rotate(normal, tree.yaw));
}
@fragment fn fragment(in: Varying) -> @location(0) vec4<f32> {
    let lit = light.key_illuminance * (0.1 + 0.2 * saturate(dot(in.normal, light.key_direction)));
    return finish(in.relative, tint_level(vec3(0.9, 0.02, 0.02) * lit), 1.0);
}";

/// The level.
pub const BOX: Representation = Representation::named("box");

/// Registers the level; all forests show it beyond 80 m, trees of half the nominal height beyond 40 m.
pub struct BoxLevelPlugin;

impl Plugin for BoxLevelPlugin {
    fn build(&self, app: &mut App) {
        let shader = app.world_mut().resource_mut::<Assets<Shader>>().add(Shader::from_wgsl(WGSL, "box_level.wgsl"));
        app.register_representation(Boxes(shader)).add_systems(
            Update,
            |mut forests: Query<&mut Forest, Added<Forest>>| {
                for mut forest in &mut forests {
                    forest.levels = Levels::only(Representation::MODEL).then(FadeBand::new(80.0, 0.0), BOX);
                }
            },
        );
    }
}

struct Boxes(Handle<Shader>);

#[rustfmt::skip]
impl LevelRenderer for Boxes {
    fn representation(&self) -> Representation { BOX }
    fn label(&self) -> &'static str { "boxes" }
    fn tint(&self) -> Vec3 { Vec3::new(1.0, 0.5, 0.0) }
    fn grouping(&self) -> Grouping { Grouping::Together }
    fn coarsest_shadow_texel(&self) -> Option<f64> { None }
    fn upload(&self, _: &Forest, _: &mut ForestUpload) -> Box<dyn GpuLevel> { Box::new(GpuBoxes) }
    fn same_shape(&self, _: &BakedPlant, _: &BakedPlant) -> bool { true }
    fn pipeline(&self, _: u32, target: LevelTarget) -> RenderPipelineDescriptor {
        let LevelTarget::View(format) = target else { return RenderPipelineDescriptor::default() };
        let pipeline = format.pipeline(&self.0, Vec::new(), target.depth());
        RenderPipelineDescriptor { label: Some("boxes".into()), layout: target.layouts([]), ..pipeline }
    }
}

struct GpuBoxes;

/// All trees in one draw call.
const BOXES: TreeDraw = TreeDraw { group: 0, vertices: TreeVertices::Pulled(36) };

#[rustfmt::skip]
impl GpuLevel for GpuBoxes {
    fn features(&self, target: LevelTarget) -> Vec<u32> { if target == LevelTarget::ShadowMap { vec![] } else { vec![0] } }
    fn triangles(&self, _variant: usize) -> usize { 12 }
    fn draws(&self, _: LevelTarget) -> Vec<TreeDraw> { vec![BOXES] }
    fn draw<'a>(&'a self, pass: &mut TrackedRenderPass<'a>, _: u32, _: LevelTarget, trees: &DrawnTrees<'a>) {
        trees.draw(pass, BOXES);
    }
    fn relight(&mut self, _: &Relight, _: &mut ForestUpload) {}
}

fn main() {
    App::new().add_plugins((DefaultPlugins, CanopyPlugins, BoxLevelPlugin)).add_systems(Startup, set_up).run();
}

fn set_up(mut commands: Commands) {
    commands.spawn(CanopyScene::new("assets/scenes/inventory.ron")).observe(look);
}

fn look(ready: On<SceneReady>, mut commands: Commands) {
    let height = ready.stage.terrain.height(0.0, 120.0) as f32 + 20.0;
    commands.spawn((CanopyCamera, Transform::from_xyz(0.0, height, 120.0)));
}
