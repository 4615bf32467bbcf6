//! The maps of a styled view, as long as it is drawn.

use bevy::{
    core_pipeline::core_3d::CORE_3D_DEPTH_FORMAT,
    ecs::{
        query::With,
        resource::Resource,
        system::{Query, Res, ResMut},
    },
    render::{
        render_resource::{
            Extent3d, Texture, TextureDescriptor, TextureDimension, TextureFormat, TextureUsages, TextureView,
            TextureViewDescriptor, TextureViewDimension,
        },
        renderer::RenderDevice,
        view::ExtractedView,
    },
};

use crate::render::{
    components::{CanopyCamera, DrawnStyle},
    forest::GpuForests,
    view::PreparedFrame,
};
use crate::style::{
    Deviations, Style, Watercolour,
    deviations::{self, LINES},
    layers,
};

/// Format of normals, of light and of what is blurred of both.
pub const MAP_FORMAT: TextureFormat = TextureFormat::Rgba16Float;
/// Format of identifiers, with the strokes on leaves.
pub const IDENTITY_FORMAT: TextureFormat = TextureFormat::Rgba8Uint;
/// Format of albedo.
pub const COLOR_FORMAT: TextureFormat = TextureFormat::Rgba8UnormSrgb;
/// Format of four layers' intensities.
pub const SHAPE_FORMAT: TextureFormat = TextureFormat::Rgba8Unorm;

/// What the maps depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MapKey {
    /// Pixels of the picture.
    pub picture: (u32, u32),
    /// Texels of the maps.
    pub size: (u32, u32),
    /// Layers of pigment; 0 for a style without.
    pub layers: u32,
    /// Whether there are particles.
    pub dabs: bool,
    /// Texels along a side that become one in the map of the light around.
    pub wide_divisor: u32,
    /// The same in that of the colours.
    pub color_divisor: u32,
    /// The same in the map of noise.
    pub noise_divisor: u32,
}

impl MapKey {
    /// Texels of a map of which `divisor` along a side become one.
    pub fn coarse(&self, divisor: u32) -> (u32, u32) {
        (self.size.0.div_ceil(divisor), self.size.1.div_ceil(divisor))
    }
}

/// The maps.
pub struct StyleMaps {
    /// What they depend on.
    pub key: MapKey,
    /// Reversed depth.
    pub depth: TextureView,
    /// Normal times ambient visibility, height above the ground.
    pub surfaces: TextureView,
    /// Layer, number of the tree, strokes.
    pub identities: TextureView,
    /// Albedo.
    pub colors: TextureView,
    /// Light, pigment of the shadow, depth in two values.
    pub lights: TextureView,
    /// The same under a Gaussian.
    pub soft_lights: TextureView,
    /// The same under a wide one.
    pub wide_lights: TextureView,
    /// Normals under a Gaussian.
    pub soft_normals: TextureView,
    /// Albedo under a Gaussian, with the share of surfaces as its alpha.
    pub soft_colors: TextureView,
    /// Contours of normals and depth, of the picture's size: their strength, ink, depth of what is in front.
    pub contours: TextureView,
    /// Their lines, their rims, and that depth.
    pub lines: TextureView,
    /// Broad noises.
    pub noises: TextureView,
    /// What is blurred along one axis.
    pub half_blurred: TextureView,
    /// The same of the light around.
    pub half_wide: TextureView,
    /// The same of albedo.
    pub half_colors: TextureView,
    /// The same of layers.
    pub half_shapes: TextureView,
    /// One view a slice of four layers.
    pub shape_slices: Vec<TextureView>,
    /// All of them.
    pub shapes: TextureView,
    /// Intensities of particles: dark, medium, bright; `None` for a style without.
    pub dabs: Option<TextureView>,
    /// The same under a Gaussian; a single texel without particles.
    pub soft_dabs: TextureView,
}

/// The maps of the view that is drawn in a style; `None` while there is none.
#[derive(Resource, Default)]
pub struct StyleTargets(pub Option<StyleMaps>);

/// Whether a style has particles.
pub fn has_particles(style: &Style) -> bool {
    matches!(style, Style::Watercolour(Watercolour { dabs, .. }) if *dabs > 0.0)
}

/// Layers of pigment for `forests` under `style`.
pub fn layer_count(style: &Style, forests: &GpuForests) -> u32 {
    if !matches!(style, Style::Watercolour(_)) {
        return 0;
    }
    let groups = forests.iter().flat_map(|(_, forest)| forest.foliage_groups().iter().copied()).max().unwrap_or(0);
    u32::from(layers::FIRST_FOLIAGE) + u32::from(groups) + 1
}

/// Makes the maps that the view needs, and drops those that it does not.
pub fn prepare_targets(
    views: Query<(&ExtractedView, &DrawnStyle), With<CanopyCamera>>,
    frame: Res<PreparedFrame>,
    forests: Res<GpuForests>,
    device: Res<RenderDevice>,
    mut targets: ResMut<StyleTargets>,
) {
    let styled = frame.view.as_ref().and_then(|view| views.get(view.entity).ok());
    let Some((view, drawn)) = styled else {
        targets.0 = None;
        return;
    };
    let most = device.limits().max_texture_dimension_2d;
    let texels = |pixels: u32| ((pixels as f32 * drawn.map_scale()).round() as u32).clamp(1, most);
    let picture = (view.viewport.z.max(1), view.viewport.w.max(1));
    let size = (texels(picture.0), texels(picture.1));
    let deviations = Deviations::of(&drawn.style);
    let divisor = |deviation: f32| deviations::divisor(deviation * size.1 as f32 / LINES);
    let key = MapKey {
        picture,
        size,
        layers: layer_count(&drawn.style, &forests),
        dabs: has_particles(&drawn.style),
        wide_divisor: divisor(deviations.wide),
        color_divisor: divisor(deviations.lights),
        noise_divisor: deviations::noise_divisor(picture.1),
    };
    if targets.0.as_ref().is_none_or(|maps| maps.key != key) {
        targets.0 = Some(StyleMaps::new(&device, key));
    }
}

impl StyleMaps {
    fn new(device: &RenderDevice, key: MapKey) -> Self {
        let texture = |label, format, slices: u32, size: (u32, u32)| {
            device.create_texture(&TextureDescriptor {
                label: Some(label),
                size: Extent3d { width: size.0, height: size.1, depth_or_array_layers: slices },
                mip_level_count: 1,
                sample_count: 1,
                dimension: TextureDimension::D2,
                format,
                usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            })
        };
        let view = |texture: Texture| texture.create_view(&TextureViewDescriptor::default());
        let map = |label| view(texture(label, MAP_FORMAT, 1, key.size));
        // Only layers are painted with the light around, soft colours and noise.
        let coarse = |label, divisor| {
            view(texture(label, MAP_FORMAT, 1, if key.layers > 0 { key.coarse(divisor) } else { (1, 1) }))
        };
        // Without layers a single texel is bound.
        let slices = key.layers.div_ceil(4).max(1);
        let shape_size = if key.layers > 0 { key.size } else { (1, 1) };
        let shapes = texture("canopy_style_shapes", SHAPE_FORMAT, slices, shape_size);
        let slice = |base_array_layer| {
            shapes.create_view(&TextureViewDescriptor {
                dimension: Some(TextureViewDimension::D2),
                base_array_layer,
                array_layer_count: Some(1),
                ..Default::default()
            })
        };
        let array = TextureViewDescriptor { dimension: Some(TextureViewDimension::D2Array), ..Default::default() };
        Self {
            key,
            depth: view(texture("canopy_style_depth", CORE_3D_DEPTH_FORMAT, 1, key.size)),
            surfaces: map("canopy_style_surfaces"),
            identities: view(texture("canopy_style_identities", IDENTITY_FORMAT, 1, key.size)),
            colors: view(texture("canopy_style_colors", COLOR_FORMAT, 1, key.size)),
            lights: map("canopy_style_lights"),
            soft_lights: map("canopy_style_soft_lights"),
            wide_lights: coarse("canopy_style_wide_lights", key.wide_divisor),
            soft_normals: map("canopy_style_soft_normals"),
            soft_colors: coarse("canopy_style_soft_colors", key.color_divisor),
            contours: view(texture("canopy_style_contours", MAP_FORMAT, 1, key.picture)),
            lines: view(texture("canopy_style_lines", SHAPE_FORMAT, 1, key.picture)),
            noises: coarse("canopy_style_noises", key.noise_divisor),
            half_blurred: map("canopy_style_half_blurred"),
            half_wide: coarse("canopy_style_half_wide", key.wide_divisor),
            half_colors: coarse("canopy_style_half_colors", key.color_divisor),
            half_shapes: view(texture("canopy_style_half_shapes", SHAPE_FORMAT, 1, shape_size)),
            shape_slices: (0..key.layers.div_ceil(4)).map(slice).collect(),
            shapes: shapes.create_view(&array),
            dabs: key.dabs.then(|| view(texture("canopy_style_dabs", SHAPE_FORMAT, 1, key.size))),
            soft_dabs: view(texture(
                "canopy_style_soft_dabs",
                SHAPE_FORMAT,
                1,
                if key.dabs { key.size } else { (1, 1) },
            )),
        }
    }
}
