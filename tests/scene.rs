//! Scene files as users write them: what is read, and where each fault is reported.

use std::path::Path as FilePath;

use canopy::app::parse_lighting;
use canopy::bake::lighting::SunLight;
use canopy::light::MoonSetting;
use canopy::lod::{FadeBand, Levels, Representation};
use canopy::plant::{Gloss, LeafKind, grow::HousePlant};
use canopy::scatter::{LengthUnit, Sequence};
use canopy::scene::{
    Anchor, GltfPlants, Ground, GroundFile, GrownForm, GrownPlants, InventoryTrees, Lighting, Overrides, Path,
    PlantSource, Position, ScatteredTrees, Scene, SceneError, Species, Transfer, Trees,
};
use canopy::style::{Lines, Style, Toon};
use canopy::terrain::CoordinateSystem;

type Outcome = Result<(), Box<dyn std::error::Error>>;

/// A scene with every structure, one field or element per line, so that a fault's line is easy to state.
const FULL: &str = r#"(
    name: "full",
    seed: 7,
    terrain: Noise(
        seed: 3,
        size: 400,
        amplitude: 20,
        wavelength: 150,
        octaves: 5,
        ridged: true,
    ),
    species: [
        (
            name: "oak",
            weight: 3,
            plant: Grown(form: Broadleaf, individuals: 4, triangles: 30000, seed: 9),
            height: (14, 22),
            elevation: (-10, 900),
            slope_limit: 35,
            trunk_radius: 0.4,
        ),
        (
            name: "pine",
            plant: Gltf(files: ["pine.glb", "other/pine2.glb"], foliage: ["needles"], wood: ["bark"]),
        ),
        (
            name: "birch",
            plant: Grown(form: File("birch.ron")),
        ),
    ],
    trees: Scattered(
        stems_per_hectare: 280,
        sequence: Hammersley,
        min_distance: 1.5,
        slope_limit: 40,
        elevation: (0, 500),
        area: (west: -100, south: -90, east: 80, north: 70),
        clearings: (wavelength: 120, share: 0.2),
    ),
    place: (
        latitude: 47.5,
        longitude: 9.25,
        time: "2026-06-21T15:30+02:00",
        moon: Astronomical,
        visibility: 15000,
    ),
    camera: (
        start: (position: (1, 2, 3), yaw: 45, pitch: -5),
        path: [
            (seconds: 0, position: (0, 10, 0), yaw: 0, pitch: 0),
            (seconds: 5, position: (50, 20, 0), yaw: 90, pitch: -10),
        ],
        field_of_view: 60,
    ),
    quality: (
        shadow_map_size: 1024,
        cascades: 3,
        shadow_distance: 300,
        near_distance: 40,
        fade_band: 10,
        msaa: 1,
        cross_resolution: 128,
        view_distance: 5000,
        terrain_error: 2,
    ),
    style: Watercolour(palette: "sepia", paper: "rough", edges: 1.5),
)"#;

fn parse(text: &str) -> Result<Scene, SceneError> {
    Scene::parse(text, FilePath::new("folder/full.ron"))
}

/// The 1-based line and column of the only occurrence of `needle`, plus `skip` columns.
fn place_of(text: &str, needle: &str, skip: usize) -> Position {
    let offset = text.find(needle).unwrap_or_else(|| panic!("`{needle}` is not in the text"));
    assert_eq!(text.matches(needle).count(), 1, "`{needle}` must be unique");
    Position::of_offset(text, offset + skip)
}

/// Replaces `old` (which must be there once) by `new` and expects a fault at the `at`th byte of `new`, whose message
/// holds all of `words`.
#[track_caller]
fn faulty(old: &str, new: &str, at: usize, words: &[&str]) {
    assert_eq!(FULL.matches(old).count(), 1, "`{old}` must be there once");
    let text = FULL.replace(old, new);
    let expected = Position::of_offset(&text, FULL.find(old).unwrap_or(0) + at);
    let error = match parse(&text) {
        Ok(_) => panic!("`{new}` was accepted"),
        Err(error) => error,
    };
    let message = error.to_string();
    let found = match error {
        SceneError::Syntax { position, remedy, .. } => {
            assert!(!remedy.is_empty());
            position
        }
        SceneError::Invalid { problems, .. } => {
            assert!(problems.iter().all(|problem| !problem.remedy.is_empty()));
            problems[0].position.expect("a scene file has positions")
        }
        other => panic!("unexpected kind of error: {other}"),
    };
    assert_eq!(found, expected, "{message}");
    assert!(message.starts_with(&format!("folder/full.ron:{expected}: ")), "{message}");
    for word in words {
        assert!(message.contains(word), "`{word}` is not in: {message}");
    }
}

#[test]
fn everything_is_read() -> Outcome {
    let scene = parse(FULL)?;
    assert_eq!((scene.name.as_str(), scene.seed), ("full", 7));
    let Ground::Noise(noise) = &scene.terrain else { return Err("no noise".into()) };
    assert_eq!((noise.seed, noise.size, noise.octaves, noise.ridged), (3, 400.0, 5, true));
    let [oak, pine, birch] = scene.species.as_slice() else { return Err("not three species".into()) };
    assert_eq!((oak.height, oak.elevation, oak.trunk_radius_m()), ((14.0, 22.0), Some((-10.0, 900.0)), 0.4));
    let PlantSource::Gltf(gltf) = &pine.plant else { return Err("no glTF".into()) };
    assert_eq!(gltf.files[1], FilePath::new("folder/other/pine2.glb"));
    assert_eq!((pine.weight, pine.height, pine.slope_limit), (1.0, (16.0, 26.0), 90.0));
    assert!((pine.trunk_radius_m() - 0.315).abs() < 1e-12);
    let PlantSource::Grown(grown) = &birch.plant else { return Err("not grown".into()) };
    assert_eq!(grown.form, GrownForm::File("folder/birch.ron".into()));
    let Trees::Scattered(rules) = &scene.trees else { return Err("not scattered".into()) };
    assert_eq!((rules.sequence, rules.area.map(|area| area.max.x)), (Sequence::Hammersley, Some(80.0)));
    assert_eq!((scene.place.latitude, scene.place.moon), (Some(47.5), MoonSetting::Astronomical));
    let path = Path::new(&scene.camera.path).ok_or("no path")?;
    assert_eq!(path.at(5.0), scene.camera.path[1].pose());
    assert_eq!((scene.quality.cascades, scene.quality.near_distance), (3, 40.0));
    let Style::Watercolour(watercolour) = &scene.style else { return Err("no watercolour".into()) };
    assert_eq!((watercolour.palette.as_str(), watercolour.edges), ("sepia", 1.5));
    Ok(())
}

#[test]
fn the_kind_of_leaf_is_read() -> Outcome {
    assert_eq!(parse(FULL)?.species[1].leaf, None);
    let scene = parse(&FULL.replace("name: \"pine\",", "name: \"pine\", leaf: Needle,"))?;
    assert_eq!(scene.species[1].leaf, Some(LeafKind::Needle));
    Ok(())
}

#[test]
fn house_plants_are_named_by_their_form() -> Outcome {
    let text = |form: &str| FULL.replace("form: File(\"birch.ron\")", &format!("form: House({form})"));
    let form = |scene: &Scene| match &scene.species[2].plant {
        PlantSource::Grown(grown) => Some(grown.form.clone()),
        PlantSource::Gltf(_) => None,
    };
    assert_eq!(form(&parse(&text("RubberPlant"))?), Some(GrownForm::House(HousePlant::RubberPlant)));
    assert_eq!(form(&parse(&text("Stamped(\"leaf\")"))?), Some(GrownForm::House(HousePlant::Stamped("leaf".into()))));
    let wrong = parse(&text("Stamped(\"\u{e9}\")")).err().ok_or("accepted")?.to_string();
    assert!(wrong.contains("cannot be stamped") && wrong.contains("form"), "{wrong}");
    Ok(())
}

#[test]
fn gloss_and_the_way_of_the_sun_are_read() -> Outcome {
    let plain = parse(FULL)?;
    assert_eq!(plain.species[0].gloss, Gloss { reflectance: 0.045, roughness: 0.4 });
    let text =
        FULL.replace("weight: 3,", "weight: 3, gloss: (roughness: 0.2), lighting: Transfer(bands: 4, sun: Harmonics),");
    let oak = &parse(&text)?.species[0];
    assert_eq!(oak.gloss, Gloss { reflectance: 0.045, roughness: 0.2 });
    assert_eq!(
        oak.lighting,
        Some(Lighting::Transfer(Transfer { bands: 4, sun: SunLight::Harmonics, ..Transfer::default() }))
    );
    assert_eq!(Transfer::default().sun, SunLight::Combined);
    faulty("weight: 3", "weight: 3, gloss: (share: 0.5)", 26, &["`species[0].gloss.share` is 0.5", "0 to 0.09"]);
    faulty("weight: 3", "weight: 3, gloss: (roughness: 0)", 30, &["`species[0].gloss.roughness` is 0", "0.1 to 1"]);
    let wrong = parse(&FULL.replace("weight: 3", "weight: 3, lighting: Transfer(sun: Disc)"));
    assert!(wrong.is_err_and(|error| error.to_string().contains("LeafShader")));
    Ok(())
}

#[test]
fn a_request_changes_the_way_of_the_sun_and_keeps_the_rest() -> Outcome {
    let mut scene = parse(&FULL.replace("weight: 3,", "weight: 3, lighting: Transfer(bands: 5),"))?;
    let overrides = |name: &str| -> Result<Overrides, Box<dyn std::error::Error>> {
        Ok(Overrides { lighting: Some(parse_lighting(name)?), ..Overrides::default() })
    };
    let transfer = |scene: &Scene, index: usize| match &scene.species[index].lighting {
        Some(Lighting::Transfer(transfer)) => Some((transfer.bands, transfer.sun)),
        _ => None,
    };
    overrides("harmonics")?.apply(&mut scene);
    assert_eq!(transfer(&scene, 0), Some((5, SunLight::Harmonics)));
    assert_eq!(transfer(&scene, 1), Some((Transfer::default().bands, SunLight::Harmonics)));
    overrides("transfer")?.apply(&mut scene);
    assert_eq!(transfer(&scene, 0), Some((5, SunLight::Combined)));
    overrides("local")?.apply(&mut scene);
    assert_eq!(scene.species[0].lighting, Some(Lighting::Local));
    Ok(())
}

#[test]
fn a_request_restyles_a_scene_and_gives_its_foliage_a_surface() -> Outcome {
    let full = parse(FULL)?;
    let style = |name: &str| Style::named(name).ok_or("no style");
    // The same style keeps its own values; palette and paper are replaced one by one.
    let same = Overrides { style: Some(style("watercolour")?), paper: Some("laid".to_owned()), ..Overrides::default() };
    let Style::Watercolour(kept) = same.applied(full.clone()).style else { return Err("no watercolour".into()) };
    assert_eq!((kept.palette.as_str(), kept.paper.as_str(), kept.edges), ("sepia", "laid", 1.5));
    let toon = Overrides { style: Some(style("toon")?), ..Overrides::default() }.applied(full.clone());
    assert_eq!(toon.style, Style::Toon(Toon::default()));
    let realigned = |scene: &Scene| scene.species.iter().all(|s| matches!(s.lighting, Some(Lighting::Expressive(_))));
    assert!(realigned(&toon));
    // A palette or a paper that the style does not have is not dropped in silence.
    let given = |style| Overrides {
        style: Some(style),
        palette: Some("sepia".to_owned()),
        paper: Some("laid".to_owned()),
        ..Overrides::default()
    };
    let warnings = |style: Style| given(style.clone()).warnings(&given(style).applied(full.clone()));
    assert_eq!(warnings(Style::Lines(Lines::default())), Vec::<String>::new());
    assert!(matches!(&warnings(Style::Toon(Toon::default()))[..], [paper] if paper.contains("paper")));
    assert_eq!(warnings(Style::Photograph).len(), 2);
    let photograph = Overrides { style: Some(Style::Photograph), ..Overrides::default() }.applied(full.clone());
    assert!(!photograph.style.is_drawn() && photograph.species == full.species && !realigned(&full));
    Ok(())
}

#[test]
fn only_the_terrain_is_required() -> Outcome {
    let scene = Scene::parse("(terrain: File(path: \"hills.tif\"))", FilePath::new("a/hills scene.ron"))?;
    assert_eq!((scene.name.as_str(), scene.seed), ("hills scene", 1));
    assert_eq!(scene.trees, Trees::None);
    assert_eq!(scene.place.time.utc().to_rfc3339(), "2026-06-21T12:00:00+00:00");
    let Ground::File(file) = scene.terrain else { return Err("no file".into()) };
    assert_eq!((file.path.as_path(), file.crop, file.exaggeration), (FilePath::new("a/hills.tif"), None, 1.0));
    let absolute = Scene::parse("(terrain: File(path: \"/data/hills.tif\"))", FilePath::new("a/b.ron"))?;
    assert!(matches!(absolute.terrain, Ground::File(file) if file.path == FilePath::new("/data/hills.tif")));
    Ok(())
}

#[test]
fn optional_values_may_be_wrapped_or_not() -> Outcome {
    let wrapped = parse(&FULL.replace("trunk_radius: 0.4", "trunk_radius: Some(0.4)"))?;
    assert_eq!(wrapped, parse(FULL)?);
    faulty("elevation: (0, 500)", "elevation: Some((0, 500))", 16, &["remove `Some`"]);
    let none = parse(&FULL.replace("elevation: (0, 500)", "elevation: None"))?;
    assert!(matches!(none.trees, Trees::Scattered(rules) if rules.elevation.is_none()));
    Ok(())
}

#[test]
fn inventories_state_units_and_species() -> Outcome {
    let trees = "trees: Inventory(path: \"stand.csv\", dbh_unit: Millimetres, anchor: SouthWest, \
                 species: {\"Quercus\": \"oak\", \"Pinus\": \"pine\"}, default_species: \"birch\")";
    let start = FULL.find("trees:").ok_or("no trees")?;
    let end = FULL.find("place:").ok_or("no place")?;
    let text = format!("{}{trees},\n    {}", &FULL[..start], &FULL[end..]);
    let Trees::Inventory(inventory) = parse(&text)?.trees else { return Err("no inventory".into()) };
    assert_eq!((inventory.dbh_unit, inventory.height_unit), (Some(LengthUnit::Millimetres), None));
    assert_eq!(inventory.path, FilePath::new("folder/stand.csv"));
    assert_eq!(inventory.species.get("Pinus").map(String::as_str), Some("pine"));

    // Older files say `Centre` and `Middle`, which do not tell whose centre they mean.
    for (word, anchor) in [
        ("TerrainCentre", Anchor::TerrainCentre),
        ("Centre", Anchor::TerrainCentre),
        ("StandCentre", Anchor::StandCentre),
        ("Middle", Anchor::StandCentre),
    ] {
        let Trees::Inventory(inventory) = parse(&text.replace("SouthWest", word))?.trees else {
            return Err("no inventory".into());
        };
        assert_eq!(inventory.anchor, anchor, "{word}");
    }

    let wrong = text.replace("\"pine\"}", "\"pin\"}");
    let error = parse(&wrong).err().ok_or("accepted")?;
    let SceneError::Invalid { problems, .. } = &error else { return Err(error.into()) };
    assert_eq!(problems[0].position, Some(place_of(&wrong, "\"pin\"", 0)));
    assert!(problems[0].remedy.contains("did you mean `pine`"), "{error}");
    let wrong = text.replace("default_species: \"birch\"", "default_species: \"elm\"");
    assert!(parse(&wrong).is_err_and(|error| error.to_string().contains("`oak`, `pine`, `birch`")));
    Ok(())
}

#[test]
fn unknown_fields_name_their_place_and_the_nearest_known_one() {
    faulty("    seed: 7,", "    sead: 7,", 4, &["unknown field `sead`", "did you mean `seed`", "`terrain`"]);
    faulty("amplitude: 20", "amplitud: 20", 0, &["did you mean `amplitude`", "`octaves`"]);
    faulty("trunk_radius: 0.4", "bark: 0.4", 0, &["unknown field `bark`", "known fields are", "`slope_limit`"]);
    faulty("min_distance: 1.5", "min_distanse: 1.5", 0, &["did you mean `min_distance`"]);
    faulty("share: 0.2", "part: 0.2", 0, &["unknown field `part`", "`share`"]);
    faulty("south: -90", "sout: -90", 0, &["did you mean `south`"]);
    faulty("latitude: 47.5", "lattitude: 47.5", 0, &["did you mean `latitude`"]);
    faulty("seconds: 5", "second: 5", 0, &["did you mean `seconds`"]);
    faulty("cascades: 3", "cascade: 3", 0, &["did you mean `cascades`"]);
    faulty("foliage: [\"needles\"]", "leaves: [\"needles\"]", 0, &["unknown field `leaves`", "`foliage`"]);
}

#[test]
fn unknown_choices_are_listed() {
    faulty("Noise(", "Noize(", 0, &["unknown choice `Noize`", "did you mean `Noise`", "`Flat`"]);
    faulty("sequence: Hammersley", "sequence: Halten", 10, &["did you mean `Halton`", "`Random`"]);
    faulty("form: Broadleaf", "form: Palm", 6, &["unknown choice `Palm`", "`Conifer`"]);
    faulty("moon: Astronomical", "moon: New", 6, &["unknown choice `New`", "`None`"]);
    faulty("style: Watercolour(", "style: Oil(", 7, &["unknown choice `Oil`", "`Lines`", "`Toon`"]);
    faulty("weight: 3,", "leaf: Rubber,", 6, &["unknown choice `Rubber`", "`Leathery`", "`Needle`"]);
}

#[test]
fn wrong_types_and_missing_or_double_fields_are_placed() {
    faulty("seed: 7", "seed: -7", 6, &["integer"]);
    faulty("octaves: 5", "octaves: 5.5", 9, &["expected a whole number but found 5.5"]);
    faulty("name: \"full\"", "name: full", 6, &["double quotes"]);
    faulty("weight: 3", "weight: \"3\"", 8, &["float"]);
    faulty("    seed: 7,", "    seed: 7, seed: 8,", 13, &["given twice"]);
    faulty("(\n            name: \"pine\",\n", "(\n", 0, &["`name` is missing", "add `name: ...`"]);
}

#[test]
fn broken_texts_are_refused_with_a_place() {
    for (text, words) in [
        ("", "field: value"),
        ("(terrain: Flat()", "bracket"),
        ("(terrain: Flat() place: ())", "comma"),
        ("terrain: Flat()", "field: value"),
        ("(terrain: Flat(), name: \"\u{1}", "end"),
    ] {
        let error = parse(text).map(|_| ()).map_err(|error| error.to_string());
        assert!(error.as_ref().is_err_and(|error| error.contains(words)), "{text}: {error:?}");
    }
    assert!(parse(&"(".repeat(100_000)).is_err());
    assert!(parse(&format!("(terrain: {}", "[".repeat(100_000))).is_err());
}

#[test]
fn impossible_values_are_placed() {
    faulty("size: 400", "size: -400", 6, &["`terrain.size` is -400 m", "from 20 to 100000"]);
    faulty("amplitude: 20", "amplitude: NaN", 11, &["`terrain.amplitude` is NaN, which is not a finite number"]);
    faulty("wavelength: 150", "wavelength: inf", 12, &["not a finite number"]);
    faulty("octaves: 5", "octaves: 0", 9, &["whole number from 1 to 16"]);
    faulty("weight: 3", "weight: -1", 8, &["`species[0].weight`"]);
    faulty("individuals: 4", "individuals: 17", 13, &["`species[0].plant.individuals` is 17", "1 to 16"]);
    faulty("triangles: 30000", "triangles: 100", 11, &["5000 to 100000"]);
    faulty("height: (14, 22)", "height: (22, 14)", 8, &["`species[0].height`", "write (14, 22)"]);
    faulty("height: (14, 22)", "height: (14, 2200)", 13, &["`species[0].height[1]`"]);
    faulty("elevation: (-10, 900)", "elevation: (900, -10)", 11, &["lower end lies above"]);
    faulty("slope_limit: 35", "slope_limit: 95", 13, &["0 to 90 degrees"]);
    faulty("trunk_radius: 0.4", "trunk_radius: 0", 14, &["`species[0].trunk_radius`"]);
    faulty("files: [\"pine.glb\", \"other/pine2.glb\"]", "files: []", 7, &["names 0 files"]);
    faulty("wood: [\"bark\"]", "wood: [\"bark\", \"needles\"]", 15, &["`needles`, which `foliage` names too"]);
    faulty("name: \"birch\"", "name: \"oak\"", 6, &["`species[2].name`", "species[0] too"]);
    faulty("name: \"birch\"", "name: \" \"", 6, &["is empty"]);
    faulty("stems_per_hectare: 280", "stems_per_hectare: -5", 19, &["`trees.stems_per_hectare` is -5 stems/ha"]);
    faulty("min_distance: 1.5", "min_distance: 1e9", 14, &["from 0 to 100 m"]);
    faulty("elevation: (0, 500)", "elevation: (500, 0)", 11, &["write (0, 500)"]);
    faulty("west: -100", "west: 100", 6, &["not west of `east`"]);
    faulty("south: -90", "south: 90", 7, &["not south of `north`"]);
    faulty("stems_per_hectare: 280", "stems_per_hectare: 0", 19, &["from 0.01 to 100000 stems/ha"]);
    faulty("elevation: (0, 500)", "elevation: (5, 5)", 11, &["nothing lies between"]);
    faulty("share: 0.2", "share: 0.2, edge: 2", 18, &["`trees.clearings.edge`"]);
    faulty("ridged: true", "spacing: 0.01", 9, &["`terrain.spacing` is 0.01 m"]);
    faulty("ridged: true", "roughness: 1", 11, &["from 0.01 to 0.99"]);
    faulty("share: 0.2", "share: 20", 7, &["from 0 to 1"]);
    faulty("latitude: 47.5", "latitude: 100", 10, &["`place.latitude` is 100 degrees", "from -90 to 90"]);
    faulty("longitude: 9.25", "longitude: -181", 11, &["from -180 to 180"]);
    faulty("visibility: 15000", "visibility: 0", 12, &["`place.visibility`"]);
    faulty("position: (1, 2, 3)", "position: (1, -2, 3)", 14, &["`camera.start.position[1]`"]);
    faulty("pitch: -5", "pitch: -95", 7, &["from -90 to 90"]);
    faulty("seconds: 5", "seconds: 0", 9, &["not after the key before it"]);
    faulty("field_of_view: 60", "field_of_view: 180", 15, &["from 1 to 170"]);
    faulty("shadow_map_size: 1024", "shadow_map_size: 1000", 17, &["1024, 2048"]);
    faulty("cascades: 3", "cascades: 5", 10, &["1 to 4"]);
    faulty("msaa: 1", "msaa: 2", 6, &["write 1 (off) or 4"]);
    faulty("terrain_error: 2", "terrain_error: 0", 15, &["pixels"]);
    faulty("edges: 1.5", "edges: 9", 7, &["`style.edges` is 9", "from 0 to 3"]);
    faulty("palette: \"sepia\"", "palette: \"sepai\"", 9, &["which is no palette", "did you mean \"sepia\""]);
    faulty("paper: \"rough\"", "paper: \"ruogh\"", 7, &["which is no paper", "did you mean \"rough\""]);
}

#[test]
fn times_need_their_zone() {
    let words = ["`2026-06-21T15:30` has no zone; write the offset from UTC", "2026-06-21T15:30+02:00"];
    faulty("time: \"2026-06-21T15:30+02:00\"", "time: \"2026-06-21T15:30\"", 6, &words);
    faulty("time: \"2026-06-21T15:30+02:00\"", "time: \"2026-06-31T15:30Z\"", 6, &["`2026-06-31`", "does not exist"]);
    faulty("time: \"2026-06-21T15:30+02:00\"", "time: 15", 6, &["string"]);
}

#[test]
fn made_terrain_needs_a_place() {
    let remedy = "add `place: (latitude: 47.5, longitude: 9.2)`";
    let text = FULL.replace("        latitude: 47.5,\n", "");
    let expected = place_of(&text, "place: (", 7);
    let error = parse(&text).map(|_| ()).map_err(|error| error.to_string());
    let start = format!("folder/full.ron:{expected}: `place.latitude` is missing");
    assert!(error.as_ref().is_err_and(|error| error.starts_with(&start) && error.contains(remedy)), "{error:?}");
}

#[test]
fn several_problems_are_listed_in_the_order_of_the_file() -> Outcome {
    let text = FULL.replace("cascades: 3", "cascades: 9").replace("size: 400", "size: 1");
    let error = parse(&text).err().ok_or("accepted")?;
    let message = error.to_string();
    let SceneError::Invalid { problems, .. } = error else { return Err(message.into()) };
    let fields: Vec<&str> = problems.iter().map(|problem| problem.field.as_str()).collect();
    assert_eq!(fields, ["terrain.size", "quality.cascades"]);
    assert_eq!(message.lines().count(), 2);
    Ok(())
}

#[test]
fn trees_need_species() -> Outcome {
    let rest = "place: (latitude: 47, longitude: 9)";
    let none = format!("(terrain: Flat(), trees: Scattered(), species: [], {rest})");
    let error = parse(&none).err().ok_or("accepted")?.to_string();
    assert!(error.starts_with("folder/full.ron:1:48: `species` is empty"), "{error}");
    assert!(parse(&none.replace("Scattered()", "None")).is_ok());
    Ok(())
}

#[test]
fn terrain_files_have_their_own_rules() -> Outcome {
    let file = |fields: &str| parse(&format!("(terrain: File(path: \"a.tif\", {fields}))"));
    assert!(file("crop: (west: -84.3, south: 36.4, east: -84.1, north: 36.6), exaggeration: 2").is_ok());
    let swapped = file("crop: (west: 84.3, south: 36.4, east: 84.1, north: 36.6)").err().ok_or("accepted")?;
    assert!(swapped.to_string().contains("1:44: `terrain.crop.west` is 84.3, not west"), "{swapped}");
    assert!(file("crop: (west: 1, south: 3, east: 2, north: 3)").is_err());
    assert!(file("exaggeration: 0").is_err());
    assert!(parse("(terrain: File(path: \"\"))").is_err());
    let coordinates = |system: &str| parse(&format!("(terrain: File(path: \"a.asc\", coordinates: {system}))"));
    for known in ["Geographic", "Utm(zone: 17)", "Utm(zone: 33, south: true)", "Epsg(25832)"] {
        assert!(coordinates(known).is_ok(), "{known}: {:?}", coordinates(known));
    }
    let zone = coordinates("Utm(zone: 61)").err().ok_or("accepted")?.to_string();
    assert!(zone.contains("1:54: `terrain.coordinates.zone` is 61; write a whole number from 1 to 60"), "{zone}");
    let scene = parse("(terrain: File(path: \"a.asc\", coordinates: Epsg(32733)))")?;
    let Ground::File(file) = scene.terrain else { return Err("no file".into()) };
    assert_eq!(file.coordinates, Some(CoordinateSystem::Utm { zone: 33, south: true }));
    assert!(coordinates("Epsg(5)").is_err_and(|error| error.to_string().contains("1024 to 32767")));
    let place_less = coordinates("Projected(metres_per_unit: 0.3048)").err().ok_or("accepted")?.to_string();
    assert!(place_less.contains("`place.latitude` is missing"), "{place_less}");
    let typo = coordinates("Utm(zone: 17, sout: true)").err().ok_or("accepted")?.to_string();
    assert!(typo.contains("1:58: unknown field `sout`") && typo.contains("did you mean `south`"), "{typo}");
    let one = parse("(terrain: File(path: \"a.tif\"), place: (latitude: 3))").err().ok_or("accepted")?;
    assert!(one.to_string().contains("only one of `latitude` and `longitude`"), "{one}");
    let image = "(terrain: Image(path: \"a.png\", spacing: 2, low: 50, high: 9), place: (latitude: 1, longitude: 2))";
    let image = parse(image).err().ok_or("accepted")?;
    assert!(image.to_string().contains("1:49: `terrain.low` is 50 m, above `high`"), "{image}");
    Ok(())
}

#[test]
fn files_that_are_no_scenes_are_refused() -> Outcome {
    let folder = tempfile::tempdir()?;
    let missing = folder.path().join("missing.ron");
    let error = Scene::read(&missing).err().ok_or("read")?.to_string();
    assert!(error.contains("missing.ron") && error.contains("check the name"), "{error}");
    assert!(matches!(Scene::read(folder.path()), Err(SceneError::Read { .. })));

    let latin = folder.path().join("latin.ron");
    std::fs::write(&latin, b"(\n  name: \"B\xe4ume\",\n)")?;
    let error = Scene::read(&latin).err().ok_or("read")?.to_string();
    assert!(error.contains("latin.ron:2:11: the text is not UTF-8"), "{error}");

    let large = folder.path().join("large.ron");
    std::fs::write(&large, vec![b' '; 5 << 20])?;
    assert!(matches!(Scene::read(&large), Err(SceneError::TooLarge { bytes, .. }) if bytes == 5 << 20));

    let marked = folder.path().join("marked.ron");
    std::fs::write(&marked, "\u{feff}(terrain: File(path: \"a.tif\"))")?;
    let scene = Scene::read(&marked)?;
    assert!(matches!(scene.terrain, Ground::File(file) if file.path == folder.path().join("a.tif")));
    Ok(())
}

#[test]
fn shipped_scenes_are_valid_and_name_files_that_exist() -> Outcome {
    let folder = FilePath::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes");
    let mut count = 0;
    for entry in std::fs::read_dir(&folder)?.chain(std::fs::read_dir(folder.join("leaf"))?) {
        let path = entry?.path();
        if path.extension().is_none_or(|extension| extension != "ron") {
            continue;
        }
        let scene = Scene::read(&path)?;
        let mut files = Vec::new();
        if let Ground::File(file) = &scene.terrain {
            files.push(file.path.clone());
        }
        if let Trees::Inventory(inventory) = &scene.trees {
            files.push(inventory.path.clone());
        }
        for species in &scene.species {
            match &species.plant {
                PlantSource::Gltf(gltf) => files.extend(gltf.files.iter().cloned()),
                PlantSource::Grown(grown) => {
                    if let GrownForm::File(file) = &grown.form {
                        files.push(file.clone());
                    }
                }
            }
        }
        for file in files {
            assert!(file.is_file(), "{} names {}, which is absent", path.display(), file.display());
        }
        count += 1;
    }
    assert!(count >= 9, "only {count} scenes in {}", folder.display());
    Ok(())
}

proptest::proptest! {
    #[test]
    fn any_text_is_answered(text in "[(){}\\[\\]a-z0-9:,\"'#/*. -]{0,60}") {
        let _ = parse(&text);
    }

    #[test]
    fn any_damage_to_a_scene_is_answered(at in 0..FULL.len(), length in 0_usize..20, patch in "[()\\[\\],:\"a-zN0-9-]{0,4}") {
        let end = (at + length).min(FULL.len());
        let _ = parse(&format!("{}{patch}{}", &FULL[..at], &FULL[end..]));
    }
}

#[test]
fn a_scene_in_code_has_the_defaults_of_a_file() -> Outcome {
    let text = "(terrain: Flat(), place: (latitude: 47.5, longitude: 9.2), trees: Inventory(path: \"t.csv\"), species: [\
                (name: \"a\", plant: Grown()), (name: \"b\", plant: Gltf(files: [\"b.glb\"]))])";
    let read = Scene::parse(text, FilePath::new("scene.ron"))?;
    let species = vec![Species::new("a", GrownPlants::default()), Species::new("b", GltfPlants::new(["b.glb"]))];
    let built = Scene { species, trees: InventoryTrees::new("t.csv").into(), ..Scene::default() };
    built.validate()?;
    assert_eq!(Scene { file: None, ..read.clone() }, built);
    assert_eq!((read.label(), built.label()), ("scene.ron".to_owned(), "the scene `scene`".to_owned()));

    // A terrain file keeps its own place, and paths can be moved to another folder.
    let read = Scene::parse(
        "(terrain: File(path: \"hills.tif\"), trees: Scattered(), species: [(name: \"a\", plant: \
                             Grown())])",
        FilePath::new("a/scene.ron"),
    )?;
    let mut built = Scene {
        species: vec![Species::new("a", GrownPlants::default())],
        trees: ScatteredTrees::default().into(),
        file: read.file.clone(),
        ..Scene::new(GroundFile::new("hills.tif"))
    };
    built.resolve_paths(FilePath::new("a"));
    assert_eq!(built, read);
    Ok(())
}

#[test]
fn a_scene_in_code_lists_what_is_out_of_range_by_name() -> Outcome {
    let mut scene = Scene { name: "oaks".to_owned(), ..Scene::default() };
    scene.place.latitude = Some(100.0);
    scene.quality.msaa = 3;
    let error = scene.validate().err().ok_or("accepted")?;
    let SceneError::Invalid { problems, .. } = &error else { return Err(error.into()) };
    assert!(problems.len() == 2 && problems.iter().all(|problem| problem.position.is_none()));
    let lines: Vec<String> = error.to_string().lines().map(str::to_owned).collect();
    assert!(lines[0].starts_with("the scene `oaks`: `place.latitude` is 100 degrees"), "{error}");
    assert_eq!(lines[1], "the scene `oaks`: `quality.msaa` is 3; write 1 (off) or 4");
    Ok(())
}

#[test]
fn the_levels_of_detail_are_a_list() -> Outcome {
    let listed = |list: &str| FULL.replace("near_distance: 40,", &format!("near_distance: 40, levels: {list},"));
    // By default trees below two pixels are the surface of the forest.
    let surface = |levels: Levels| levels.to_size(2.0);
    // Without a list, models give way to crosses behind the near distance.
    let levels = parse(FULL)?.quality.lod_levels();
    assert_eq!(levels, surface(Levels::model_and_cross(FadeBand::new(40.0, 10.0))));
    // With a tolerance, where crosses are that much worse.
    let tolerant = |text: &str| parse(&FULL.replace("near_distance: 40,", &format!("tolerance: {text},")));
    assert_eq!(tolerant("0.1")?.quality.lod_levels(), surface(Levels::by_error(0.1)));
    let message = tolerant("-1").err().ok_or("accepted")?.to_string();
    assert!(message.contains("quality.tolerance"), "{message}");
    let quality = parse(&listed(r#"[(draw: "model", until: 90, fade: 5), (draw: "cross")]"#))?.quality;
    assert_eq!(quality.lod_levels(), surface(Levels::model_and_cross(FadeBand::new(90.0, 5.0))));
    assert_eq!(quality.nearest_level_end(), 95.0);
    let only = parse(&listed(r#"[(draw: "cross")]"#))?.quality.lod_levels();
    assert_eq!(only, surface(Levels::only(Representation::CROSS)));

    let wrong = listed(r#"[(draw: "modle", until: 90), (draw: "model", until: 50), (draw: "cross")]"#);
    let message = parse(&wrong).err().ok_or("accepted")?.to_string();
    for word in [
        "`quality.levels[0].draw` is \"modle\"; write \"model\", \"thinned\", \"surface\", \"cloud\" or \"cross\"",
        "`quality.levels[1].until` is 50 m, where the level before it ends at 110 m",
    ] {
        assert!(message.contains(word), "no `{word}` in {message}");
    }
    let place = format!("folder/full.ron:{}", place_of(&wrong, "\"modle\"", 0));
    assert!(message.starts_with(&place), "no `{place}` in {message}");
    Ok(())
}

#[test]
fn thousands_of_mistakes_are_counted_and_the_first_twenty_listed() -> Outcome {
    let keys: String = (0..10_000)
        .map(|key| format!("\n(seconds: {}, position: (0, 5, 0), yaw: 0, pitch: {}),", 2 * key, 100 + key))
        .collect();
    let names: String = (0..10_000).map(|name| format!("\n\"name {name}\": \"species {name}\",")).collect();
    let text = format!(
        "(terrain: Flat(), place: (latitude: 47, longitude: 9), species: [(name: \"oak\", plant: Grown(form: \
         Broadleaf))], trees: Inventory(path: \"t.csv\", species: {{{names}}}), camera: (path: [{keys}]))"
    );
    let Err(error) = Scene::parse(&text, FilePath::new("many.ron")) else { return Err("no error".into()) };
    let SceneError::Invalid { problems, .. } = &error else { return Err(error.into()) };
    assert_eq!(problems.len(), 20_000);
    for (line, problem) in problems.iter().enumerate() {
        assert_eq!(problem.position.map(|position| position.line), Some(line + 2), "{problem}");
    }
    let message = error.to_string();
    let lines: Vec<&str> = message.lines().collect();
    assert_eq!(lines.len(), 21, "{message}");
    assert!(lines[0].starts_with("many.ron:2:11: `trees.species.name 0`"), "{}", lines[0]);
    assert_eq!(lines[20], "many.ron: 20000 mistakes, of which the first 20 are listed");
    Ok(())
}

#[test]
fn keys_of_a_path_need_a_millisecond() {
    let scene = |seconds: &str| {
        Scene::parse(
            &format!(
                "(terrain: Flat(), place: (latitude: 47, longitude: 9), camera: (path: [(seconds: 0, position: (0, 5, 0), \
                 yaw: 0, pitch: 0), (seconds: {seconds}, position: (900, 5, 0), yaw: 0, pitch: 0)]))"
            ),
            FilePath::new("path.ron"),
        )
    };
    for seconds in ["1e-308", "1e-9", "0.0009"] {
        let message = scene(seconds).map_or_else(|error| error.to_string(), |_| String::new());
        assert!(message.contains("camera.path[1].seconds") && message.contains("millisecond"), "{seconds}: {message}");
    }
    assert!(scene("0.001").is_ok());
}
