//! Every shader in every variant through naga, and every GPU struct against its Rust twin. Needs no graphics device.

mod branches;

use std::{
    collections::{BTreeMap, BTreeSet, HashMap},
    mem::offset_of,
    path::Path,
};

use canopy::{
    cull::{
        Cluster, TreeSize, Volume,
        volume::{LevelRange, Ring, VolumePlane},
    },
    render::{
        bindings::uniforms::{CascadeUniform, CascadeViewUniform, FrameUniform, LightUniform, ShadowUniform},
        cull::{ListRoom, TreeDrawWords},
        forest::{
            CloudPlaneUniform, CloudVariantUniform, CrossVariantUniform, ForestViewUniform, PartUniform, PlaneUniform,
            PlantVertex, TransferUniform, VariantUniform,
        },
        shaders::{ShaderFile, sources},
        style::uniforms::{BlurUniform, GpuParticle, LayerUniform, ParticleViewUniform, StyleUniform},
        terrain::{DrapeUniform, GpuTile, GpuTileVertex},
    },
    scatter::PackedTree,
};
use naga::{
    Module, ScalarKind, ShaderStage, TypeInner,
    proc::Layouter,
    valid::{Capabilities, ValidationFlags, Validator},
};
use naga_oil::compose::{ComposableModuleDescriptor, Composer, NagaModuleDescriptor, ShaderDefValue};

/// All that the pipelines switch on or off.
const DEFINES: [&str; 18] = [
    "FOLIAGE",
    "ALPHA_TO_COVERAGE",
    "NORMAL_MAP",
    "LAYERED",
    "TRANSFER",
    "TRANSFER_COLOR",
    "SUN_HARMONICS",
    "SUN_DETAIL",
    "SUN_PAIRS",
    "PLAIN_TOO",
    "DEPTH_FIRST",
    "STYLED",
    "OWN_NORMALS",
    "IDENTITIES",
    "TOON",
    "DRAPE",
    "FOREST_SURFACE",
    "SOFT_SHADOW",
];

/// All combinations of [`DEFINES`]; some mean something with transfer only, and crosses have no others with their depth
/// drawn first.
fn variants() -> impl Iterator<Item = Vec<&'static str>> {
    let all = (0..1u32 << DEFINES.len()).map(|bits| {
        DEFINES.iter().enumerate().filter(|(i, _)| bits >> i & 1 == 1).map(|(_, define)| *define).collect::<Vec<_>>()
    });
    let needs = ["TRANSFER_COLOR", "SUN_HARMONICS", "PLAIN_TOO"];
    let never_of_crosses = ["NORMAL_MAP", "LAYERED", "TRANSFER_COLOR", "SUN_HARMONICS", "SUN_DETAIL"];
    // Of the styles, only foliage and the ground have variants, and only without light; the ground has no others.
    let styles = ["STYLED", "OWN_NORMALS", "IDENTITIES", "TOON", "DRAPE", "FOREST_SURFACE", "SOFT_SHADOW"];
    let style_variant = |defines: &[&str]| match defines {
        ["IDENTITIES"] | ["TOON"] => true,
        _ if defines.iter().all(|define| ["DRAPE", "FOREST_SURFACE", "SOFT_SHADOW"].contains(define)) => true,
        _ => {
            defines.contains(&"STYLED")
                && defines
                    .iter()
                    .all(|define| ["FOLIAGE", "STYLED", "OWN_NORMALS", "DRAPE", "FOREST_SURFACE"].contains(define))
        }
    };
    let any_of = |defines: &[&str], some: &[&str]| some.iter().any(|define| defines.contains(define));
    all.filter(move |defines| defines.contains(&"TRANSFER") || !any_of(defines, &needs))
        .filter(move |defines| !any_of(defines, &styles) || style_variant(defines))
        .filter(|defines| {
            !defines.contains(&"LAYERED") || defines.contains(&"FOLIAGE") && !defines.contains(&"PLAIN_TOO")
        })
        .filter(|defines| !defines.contains(&"SUN_DETAIL") || defines.contains(&"SUN_HARMONICS"))
        .filter(move |defines| !defines.contains(&"DEPTH_FIRST") || !any_of(defines, &never_of_crosses))
}

fn is_library(source: &str) -> bool {
    source.contains("#define_import_path")
}

/// The shader at `path` with `defines`, composed as Bevy does it.
pub(crate) fn compose(path: &str, source: &str, defines: &[&str]) -> Result<Module, String> {
    let defs: HashMap<String, ShaderDefValue> =
        defines.iter().map(|define| ((*define).to_owned(), ShaderDefValue::Bool(true))).collect();
    let mut composer = Composer::default();
    for (library, source) in sources().iter().filter(|(_, source)| is_library(source)) {
        let added = composer.add_composable_module(ComposableModuleDescriptor {
            source: source.as_ref(),
            file_path: library,
            shader_defs: defs.clone(),
            ..Default::default()
        });
        let added = added.map(|_| ());
        added.map_err(|error| format!("{library} {defines:?}: {}", error.emit_to_string(&composer)))?;
    }
    composer
        .make_naga_module(NagaModuleDescriptor { source, file_path: path, shader_defs: defs, ..Default::default() })
        .map_err(|error| format!("{path} {defines:?}: {}", error.emit_to_string(&composer)))
}

/// The definitions on which a shader depends, by itself and by what it imports: others do not change it.
fn conditions(source: &'static str) -> BTreeSet<&'static str> {
    let mut conditions = BTreeSet::new();
    let (mut open, mut seen) = (vec![source], BTreeSet::new());
    while let Some(source) = open.pop() {
        for line in source.lines().map(str::trim) {
            if let Some(name) = line.strip_prefix("#ifdef ").or_else(|| line.strip_prefix("#ifndef ")) {
                conditions.insert(name.trim());
            }
            let Some(module) = line.strip_prefix("#import canopy::").and_then(|rest| rest.split("::").next()) else {
                continue;
            };
            let path = format!("#define_import_path canopy::{}", module.trim());
            let imported = ShaderFile::ALL.into_iter().map(ShaderFile::source);
            let imported = imported.filter(|source| source.lines().any(|line| line.trim() == path));
            open.extend(imported.filter(|_| seen.insert(path.clone())));
        }
    }
    conditions
}

/// Every shader with entry points in every variant.
fn modules() -> Vec<(String, Module)> {
    let mut modules = Vec::new();
    for file in ShaderFile::ALL.into_iter().filter(|file| !is_library(file.source())) {
        let path = file.path();
        let known = conditions(file.source());
        for defines in variants().filter(|defines| defines.iter().all(|define| known.contains(define))) {
            match compose(path, file.source(), &defines) {
                Ok(module) => modules.push((format!("{path} {defines:?}"), module)),
                Err(message) => panic!("{message}"),
            }
        }
    }
    modules
}

#[test]
fn every_shader_is_valid_in_every_variant() {
    let modules = modules();
    assert!(modules.len() >= 4 * 7, "{} modules are fewer than there are passes", modules.len());
    for (name, module) in modules {
        // No capability beyond the core: what every device has.
        let checked = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module);
        if let Err(error) = checked {
            panic!("{name}: {}", error.into_inner());
        }
        let stages: BTreeSet<_> = module.entry_points.iter().map(|entry| (entry.name.as_str(), entry.stage)).collect();
        let drawn = stages.contains(&("vertex", ShaderStage::Vertex));
        let computed = stages.iter().any(|(_, stage)| *stage == ShaderStage::Compute);
        assert!(drawn || computed, "{name} has no entry point that a pipeline uses: {stages:?}");
    }
}

#[test]
fn the_table_of_sources_is_the_folder_of_shaders() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders");
    let on_disk: BTreeSet<String> = crate::support::program::listing(&folder)
        .into_iter()
        .filter(|path| path.extension().is_some_and(|extension| extension == "wgsl"))
        .filter_map(|path| path.strip_prefix(&folder).ok().map(|path| path.display().to_string()))
        .collect();
    let embedded: BTreeSet<String> = ShaderFile::ALL.iter().map(|file| file.path().to_owned()).collect();
    assert_eq!(embedded, on_disk);
    for file in ShaderFile::ALL {
        let path = file.path();
        for line in file.source().lines().filter_map(|line| line.trim().strip_prefix("#if")) {
            let name = line.trim_start_matches("def").trim_start_matches("ndef").trim();
            assert!(
                DEFINES.contains(&name),
                "{path} depends on `{name}`, which no test switches on: add it to DEFINES"
            );
        }
    }
}

#[test]
fn a_broken_shader_is_found() {
    let broken = "@vertex fn vertex() -> @builtin(position) vec4<f32> { return vec3(0.0); }";
    assert!(compose("broken.wgsl", broken, &[]).is_err());
}

/// Size of a struct, and offset and size of each of its members, in bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Layout {
    size: u32,
    members: Vec<(String, u32, u32)>,
}

/// The name that a type has in its own file.
fn own_name(name: &str) -> &str {
    name.split("X_naga_oil_mod_X").next().unwrap_or(name)
}

/// All structs of all shaders by name, with where they were found. A name that two shaders use differently is in it
/// twice.
fn layouts() -> BTreeMap<String, Vec<(String, Layout)>> {
    let mut found: BTreeMap<String, Vec<(String, Layout)>> = BTreeMap::new();
    for (place, module) in modules() {
        let mut layouter = Layouter::default();
        if let Err(error) = layouter.update(module.to_ctx()) {
            panic!("{place}: {error}");
        }
        for (_, kind) in module.types.iter() {
            let (Some(name), TypeInner::Struct { members, span }) = (&kind.name, &kind.inner) else { continue };
            let members =
                members.iter().map(|m| (m.name.clone().unwrap_or_default(), m.offset, layouter[m.ty].size)).collect();
            let layout = Layout { size: *span, members };
            let known = found.entry(own_name(name).to_owned()).or_default();
            if known.iter().all(|(_, other)| *other != layout) {
                known.push((place.clone(), layout));
            }
        }
    }
    found
}

/// Compares the WGSL struct `$wgsl` with the Rust struct `$rust`, member by member.
macro_rules! twin {
    ($layouts:expr, $wgsl:literal, $rust:ty { $($member:ident),+ $(,)? }) => {{
        let known = $layouts.get($wgsl).map_or(&[][..], Vec::as_slice);
        assert_eq!(known.len(), 1, "{}: no struct of that name, or several: {known:?}", $wgsl);
        let ours = Layout {
            size: size_of::<$rust>() as u32,
            members: vec![$((
                stringify!($member).to_owned(),
                offset_of!($rust, $member) as u32,
                member_size(|twin: &$rust| size_of_val(&twin.$member)) as u32,
            )),+],
        };
        assert_eq!(ours, known[0].1, "{} and {}", stringify!($rust), $wgsl);
    }};
}

/// Size of a member of a zeroed twin.
fn member_size<T: bytemuck::Zeroable>(size: impl Fn(&T) -> usize) -> usize {
    size(&T::zeroed())
}

#[test]
fn gpu_structs_are_what_the_shaders_think() {
    let layouts = layouts();
    twin!(
        layouts,
        "Frame",
        FrameUniform {
            clip_from_relative,
            relative_from_clip,
            camera,
            focal_length_pixels,
            mean_cover,
            openness,
            noise_block,
            forest_surface,
            crown_albedo,
            crown_layers
        }
    );
    twin!(
        layouts,
        "Light",
        LightUniform {
            key_direction,
            exposure,
            key_illuminance,
            scotopic_strength,
            sun_direction,
            sun_disc_cosine,
            sun_radiance,
            star_cells,
            moon_direction,
            moon_disc_cosine,
            moon_radiance,
            star_density,
            sky,
            fog_extinction,
            fog_inverse_scale_height,
            scotopic_tint,
            scotopic_amount,
            star_frame,
            ground_radiance,
            star_seed,
            shaded_hue,
            level_radiance,
            sky_axis,
        }
    );
    twin!(layouts, "Cascade", CascadeUniform { map_from_relative, texel, radius });
    twin!(layouts, "Shadow", ShadowUniform { cascades, ground, cascade_count, inverse_map_size, softness });
    twin!(layouts, "Drape", DrapeUniform { origin, inverse_size, edge, texel, brightness, mirrored });
    twin!(layouts, "CascadeView", CascadeViewUniform { clip_from_anchor, direction });
    twin!(
        layouts,
        "ForestView",
        ForestViewUniform { anchor_cell, anchor_offset, anchor_y, cell_size, fade_in, fade_out, tint }
    );
    twin!(layouts, "Plane", PlaneUniform { center, u, v, normal });
    twin!(
        layouts,
        "Variant",
        VariantUniform {
            height,
            crown_radius,
            radiance_transfer,
            specular_reflectance,
            roughness,
            realigned,
            indirect_sun_zenith,
            indirect_sun_mean,
            indirect_sun_color,
            ambient_term,
            lobe_gain,
            lobe_room,
            cover_weight,
            inverse_height,
            foliage_layer,
        }
    );
    twin!(
        layouts,
        "Part",
        PartUniform {
            base_color,
            realigned,
            transmission,
            specular_reflectance,
            roughness,
            ambient_term,
            lobe_gain,
            lobe_room,
            cover_weight,
            front_reflected,
            front_transmitted,
            back_reflected,
            back_transmitted
        }
    );
    twin!(
        layouts,
        "CrossVariant",
        CrossVariantUniform { planes, transmission, first_layer, isotropic_fraction, first_light_layer, uprights }
    );
    twin!(
        layouts,
        "CloudPlane",
        CloudPlaneUniform { center, texture_left, u, texture_top, v, texture_right, normal, texture_bottom }
    );
    twin!(layouts, "CloudVariant", CloudVariantUniform { transmission, light_layer, isotropic_fraction });
    twin!(
        layouts,
        "Transfer",
        TransferUniform {
            scale,
            vertex_words,
            mean_words,
            side_words,
            indirect_sun_start,
            indirect_sun_color,
            indirect_sun_scale,
        }
    );
    twin!(
        layouts,
        "Style",
        StyleUniform {
            anchor,
            unit,
            size,
            map_size,
            paper,
            margin,
            ink,
            sketch,
            distance,
            air,
            night,
            flow,
            edges,
            granulation,
            wetness,
            dabs,
            shadow,
            shadow_softness,
            line_width,
            detail,
            hatching,
            tones,
            scaled_normals,
            scene,
            noise_anchor,
            textures,
            softness,
        }
    );
    twin!(layouts, "Layer", LayerUniform { threshold, softness, edge, foliage });
    twin!(layouts, "BlurJob", BlurUniform { step, scale, spacing, first_layer, splits_depth });
    twin!(layouts, "Particle", GpuParticle { position, normal });
    twin!(
        layouts,
        "ParticleView",
        ParticleViewUniform { size, least_pixels, cover, reach, thresholds, map_size, fade }
    );
    twin!(layouts, "Tree", PackedTree { xz, y, cell, look });
    twin!(layouts, "Ring", Ring { shift, square });
    twin!(layouts, "LevelRange", LevelRange { begin, end, first_group, by_variant });
    twin!(layouts, "VolumePlane", VolumePlane { normal, offset, drop_factor });
    twin!(
        layouts,
        "Volume",
        Volume {
            anchor_cell,
            anchor_step,
            anchor_y,
            y_scale,
            shift,
            size_factor,
            height_factor,
            lowest,
            first_level_only,
            whole_levels,
            along_light,
            key_normal,
            key_offset,
            key_shift,
            plane_count,
            level_count,
            cluster_count,
            variant_count,
            limit,
            levels,
            planes
        }
    );
    twin!(layouts, "Cluster", Cluster { cell, first, count, low, high, bottom, top, factors });
    twin!(layouts, "TreeSize", TreeSize { radius, height, inverse_height });
    twin!(layouts, "TreeDraw", TreeDrawWords { group, vertices, kind, first_vertex, share, shares });
    twin!(layouts, "ListRoom", ListRoom { capacity, staging, group_count, draw_count });
    twin!(layouts, "Tile", GpuTile { origin, spacing, first, morph_start, morph_end, clearance, camera_height });
    twin!(layouts, "TileVertex", GpuTileVertex { height, parent_height, normal, parent_normal });
    assert_eq!(size_of::<PackedTree>(), 16, "a tree costs at most 16 bytes");
}

#[test]
fn every_bound_struct_has_its_twin_tested() {
    // Structs that no buffer holds, or (MeshPosition) that are one matrix.
    let twins = [
        "Frame",
        "Light",
        "Shadow",
        "CascadeView",
        "ForestView",
        "Variant",
        "CrossVariant",
        "CloudPlane",
        "CloudVariant",
        "Part",
        "Transfer",
        "Tree",
        "Tile",
        "TileVertex",
        "Style",
        "Layer",
        "BlurJob",
        "Drape",
        "Particle",
        "ParticleView",
        "MeshPosition",
        "Volume",
        "Cluster",
        "TreeSize",
        "TreeDraw",
        "ListRoom",
    ];
    for (place, module) in modules() {
        for (_, variable) in module.global_variables.iter().filter(|(_, variable)| variable.binding.is_some()) {
            let mut kind = &module.types[variable.ty];
            while let TypeInner::Array { base, .. } = kind.inner {
                kind = &module.types[base];
            }
            if let (Some(name), TypeInner::Struct { .. }) = (&kind.name, &kind.inner) {
                assert!(twins.contains(&own_name(name)), "{place}: `{name}` is bound, but no test knows its twin");
            }
        }
    }
}

#[test]
fn plant_vertices_are_what_the_shaders_read() {
    let layout = PlantVertex::layout();
    assert_eq!(layout.array_stride, size_of::<PlantVertex>() as u64);
    let mut inputs = 0;
    for (place, module) in modules() {
        if !place.starts_with("forest/model.wgsl") && !place.starts_with("sun_shadow/model.wgsl") {
            continue;
        }
        let vertex =
            module.entry_points.iter().find(|entry| entry.stage == ShaderStage::Vertex).expect("a vertex stage");
        let mut members = Vec::new();
        for argument in &vertex.function.arguments {
            match (&argument.binding, &module.types[argument.ty].inner) {
                (Some(binding), _) => members.push((binding.clone(), argument.ty)),
                (None, TypeInner::Struct { members: inner, .. }) => {
                    members.extend(inner.iter().filter_map(|m| m.binding.clone().map(|binding| (binding, m.ty))));
                }
                _ => {}
            }
        }
        for (binding, kind) in members {
            let naga::Binding::Location { location, .. } = binding else { continue };
            let attribute = layout.attributes.iter().find(|attribute| attribute.shader_location == location);
            let attribute = attribute.unwrap_or_else(|| panic!("{place}: no attribute {location}"));
            let components = match module.types[kind].inner {
                TypeInner::Vector { size, scalar } if scalar.kind == ScalarKind::Float => size as u32,
                _ => panic!("{place}: attribute {location} is no vector of floats"),
            };
            let wanted = match attribute.format {
                bevy::render::render_resource::VertexFormat::Float32x3 => 3,
                bevy::render::render_resource::VertexFormat::Unorm10_10_10_2 => 4,
                bevy::render::render_resource::VertexFormat::Float16x2 => 2,
                other => panic!("{other:?}: say here how many components it has"),
            };
            assert_eq!(components, wanted, "{place}: attribute {location}");
            inputs += 1;
        }
    }
    assert!(inputs > 0);
}
