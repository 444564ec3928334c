//! What a scene file includes, and what it refuses.

use super::*;

/// A folder with the given files; loads `main.toml`.
fn load_folder(files: &[(&str, &str)]) -> Result<Loaded, LoadError> {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in files {
        std::fs::write(folder.path().join(name), text).expect("written");
    }
    scene_file::load(&folder.path().join("main.toml"), &LoadOptions::default())
}

/// A cosine in three angles, 100 candela at most.
const LAMP: &str = "IESNA91\nTILT=NONE\n1 0 10 3 1 1 2 0 0 0\n1 1 0\n0 60 90\n0\n10 5 0\n";

#[test]
fn projectors_throw_images_and_graphs() {
    let main = "
        [[light]]
        kind = \"projector\"
        position = [0, 3, 0]
        target = [0, 0, 0]
        intensity = 20
        field-of-view = 40
        texture = { node = \"checkerboard\", scale = 8 }";
    let scene = load_folder(&[("main.toml", main)]).expect("loads").scene;
    let LightKind::Projector { direction, up, field_of_view, picture, .. } = scene.lights[0].kind else {
        panic!("{:?}", scene.lights)
    };
    assert_eq!((direction, up), (Vec3::NEG_Y, Vec3::NEG_Z), "straight down, its top is away");
    assert!((field_of_view.to_degrees() - 40.0).abs() < 1e-4);
    assert_eq!(picture.texture, 0);
    let tables = SceneTables::build(&scene);
    let [light] = &tables.lights[..] else { panic!("one light") };
    assert_eq!(light.textured_material as usize, tables.materials.len() - 1);
    assert!(light.strength < 20.0 && light.strength > 5.0, "half of it is dark: {}", light.strength);
    for (from, to, says) in [
        ("target = [0, 0, 0]", "direction = [0, 1, 0]\nup = [0, 2, 0]", "`up`"),
        ("field-of-view = 40", "field-of-view = 180", "field-of-view"),
        ("texture = {", "textures = {", "textures"),
        ("node = \"checkerboard\"", "node = \"chess\"", "chess"),
    ] {
        let error = load_folder(&[("main.toml", &main.replace(from, to))]).expect_err(to).to_string();
        assert!(error.contains(says), "{to}: {error}");
    }
}

#[test]
fn lamps_have_profiles_of_photometric_files() {
    let main = "
        [[light]]
        kind = \"point\"
        ies = \"lamp.ies\"
        rotate = [0, 0, 90]
        repeat = { grid = { count = [2, 1, 1], spacing = [1, 0, 0] } }
        [[light]]
        kind = \"spot\"
        target = [0, 0, -1]
        intensity = 7
        ies = \"lamp.ies\"
        turn = 90
    ";
    let scene = load_folder(&[("main.toml", main), ("lamp.ies", LAMP)]).expect("loads").scene;
    let LightKind::Point { intensity, .. } = scene.lights[1].kind else { panic!("a point") };
    assert_eq!(intensity, Vec3::splat(100.0), "the file's candela");
    let profiles: Vec<_> = scene.lights.iter().map(|l| l.profile.as_ref().expect("a profile")).collect();
    assert!((profiles[0].axis - Vec3::X).length() < 1e-6, "turned with its lamp: {}", profiles[0].axis);
    let LightKind::Spot { intensity, direction, .. } = scene.lights[2].kind else { panic!("a spot") };
    assert_eq!((intensity, profiles[2].axis), (Vec3::splat(7.0), direction));
    let tables = SceneTables::build(&scene);
    assert_eq!(tables.profiles.len(), 2 + 181, "one table for all");
    assert!(tables.lights.iter().all(|light| light.profile == 0));
    // Of a point: ∫ cos, nearly, of 100 candela; of the spot less than that of its cone.
    let pi = std::f32::consts::PI;
    assert!((tables.lights[0].power / (100.0 * pi) - 1.0).abs() < 0.1, "{}", tables.lights[0].power);
    assert!(tables.lights[2].power < 7.0 * pi && tables.lights[2].power > 1.0);

    let with = |keys: &str| format!("[[light]]\nkind = \"point\"\n{keys}\n");
    for (keys, reason) in [
        ("direction = [0, 1, 0]\nintensity = 1", "go with `ies`"),
        ("turn = 30\nintensity = 1", "it goes with `ies`"),
        ("color = 1", "needs an `intensity`"),
        ("ies = \"lamp.ies\"\ndirection = [0, 0, 0]", "`direction`"),
        ("ies = \"lamp.ies\"\nintensity = -1", "`intensity`"),
        ("ies = \"none.ies\"", "none.ies"),
        ("ies = \"main.toml\"", "TILT="),
    ] {
        let error = load_folder(&[("main.toml", &with(keys)), ("lamp.ies", LAMP)]).expect_err(keys);
        assert!(error.to_string().contains(reason), "{keys}: {error}");
    }
}

const PART: &str = "
    [parameters]
    size = 1.0
    [environment]
    color = 0.5
    [materials]
    red = { base-color = [1, 0, 0] }
    blue = { base-color = [0, 0, 1] }
    [[shape]]
    name = \"r\"
    kind = \"box\"
    size = [\"${size}\", 1, 1]
    material = \"red\"
    [[shape]]
    name = \"b\"
    kind = \"sphere\"
    translate = [2, 0, 0]
    material = \"blue\"
    [[light]]
    kind = \"point\"
    intensity = 1
    [[camera]]
    eye = [0, 0, 5]
";

#[test]
fn models_are_stored_once_and_materials_replaced() {
    let main = "
        [materials.gold]
        metallic = 1
        [[model]]
        file = \"part.toml\"
        repeat = { at = [[0, 0, 0], [0, 5, 0]] }
        [[model]]
        file = \"part.toml\"
        materials = { red = \"gold\", nothing = \"gold\" }
        [[model]]
        file = \"part.toml\"
        material = \"gold\"
        lights = false
        cameras = true
        parameters = { size = 7 }
    ";
    let Loaded { scene, report } = load_folder(&[("main.toml", main), ("part.toml", PART)]).expect("loaded");
    assert_eq!(scene.meshes.len(), 4, "two for each set of parameters");
    assert_eq!(scene.instances.len(), 8);
    assert_eq!((scene.lights.len(), scene.cameras.len()), (3, 1));
    assert_eq!(scene.instances[2].transform.translation.y, 5.0);
    let gold = scene.materials.iter().position(|m| m.name == "gold").expect("gold") as u32;
    assert_eq!(scene.instances[0].materials, None);
    assert_eq!(scene.instances[4].materials, Some(vec![gold]), "red was replaced");
    assert_ne!(scene.instances[5].materials, Some(vec![gold]), "blue was not");
    assert!(scene.instances[6..].iter().all(|i| i.materials == Some(vec![gold])));
    assert_eq!(scene.environment, Environment::Constant(Vec3::splat(0.5)), "taken from the model");
    assert!(report.notes.iter().any(|n| n.severity == Severity::Ignored && n.message.contains("nothing")));
    assert!(report.bytes_read as usize >= main.len() + 2 * PART.len());
}

#[test]
fn files_that_include_each_other_are_an_error() {
    let include = |file: &str| format!("[[model]]\nfile = \"{file}\"\n");
    let error = load_folder(&[("main.toml", &include("main.toml"))]).expect_err("itself").to_string();
    assert!(error.contains("includes itself"), "{error}");
    let (main, other) = (include("other.toml"), include("./main.toml"));
    let error =
        load_folder(&[("main.toml", &main), ("other.toml", &other)]).expect_err("a circle").to_string();
    assert!(error.contains("includes itself") && error.contains("other.toml"), "{error}");
    let chain: Vec<(String, String)> =
        (0..12).map(|i| (format!("{i}.toml"), include(&format!("{}.toml", i + 1)))).collect();
    let mut files: Vec<(&str, &str)> = chain.iter().map(|(a, b)| (a.as_str(), b.as_str())).collect();
    let first = include("0.toml");
    files.push(("main.toml", &first));
    let error = load_folder(&files).expect_err("too deep").to_string();
    assert!(error.contains("deep"), "{error}");
}

#[test]
fn includes_cannot_multiply_without_bound() {
    // Each file places the next one a thousand times: 10¹² spheres without a limit.
    let next = |file: &str| {
        format!("[[model]]\nfile = \"{file}\"\nrepeat = {{ spiral = {{ count = 1000, spacing = 1 }} }}\n")
    };
    let (a, b, c) = (next("b.toml"), next("c.toml"), next("d.toml"));
    let files = [
        ("main.toml", a.as_str()),
        ("b.toml", &b),
        ("c.toml", &c),
        ("d.toml", "[[shape]]\nkind = \"sphere\""),
    ];
    let error = load_folder(&files).expect_err("too many").to_string();
    assert!(error.contains("more than 4000000 objects"), "{error}");
}

#[test]
fn text_that_is_not_utf8_is_an_error_with_its_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("main.toml");
    std::fs::write(&path, b"name = \"a\"\n# \xff\n").expect("written");
    let error = scene_file::load(&path, &LoadOptions::default()).expect_err("not UTF-8").to_string();
    assert!(error.contains("line 2") && error.contains("UTF-8"), "{error}");
}

#[test]
fn deep_nesting_is_an_error() {
    let error = message(&format!("a = {}", "[".repeat(100_000)));
    assert!(error.contains("line 1"), "{error}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn random_text_never_panics(text in "\\PC{0,200}") {
        let _ = parse_with(&text, &[]);
    }

    /// Bytes of a valid file are replaced: what comes out loads or is an error, and what loads is consistent.
    #[test]
    fn changed_files_never_panic(
        example in 0usize..8,
        changes in prop::collection::vec((any::<prop::sample::Index>(), "[ -~\n]{0,3}"), 1..6),
    ) {
        let mut text = examples()[example].clone();
        for (at, replacement) in changes {
            let mut start = at.index(text.len());
            while !text.is_char_boundary(start) {
                start -= 1;
            }
            let end = start + text[start..].chars().next().map_or(0, char::len_utf8);
            text.replace_range(start..end, &replacement);
        }
        // A changed digit may ask for a large shape; that is allowed, but slow.
        prop_assume!(!text.contains("e9") && !text.contains("000"));
        if let Ok(loaded) = parse_with(&text, &[]) {
            for instance in &loaded.scene.instances {
                prop_assert!((instance.mesh as usize) < loaded.scene.meshes.len());
                prop_assert!(instance.transform.is_finite());
            }
        }
    }

    /// Every number of every kind of shape: what is accepted is finite.
    #[test]
    fn any_numbers_give_finite_shapes_or_errors(
        kind in prop::sample::select(vec![
            "box", "sphere", "icosphere", "uv-sphere", "grid", "cylinder", "torus", "knot", "blob", "column",
            "baluster", "arch", "coffers", "curtain",
        ]),
        key in prop::sample::select(vec![
            "radius", "height", "segments", "sides", "rings", "tube", "level", "p", "q", "bevel", "spring", "rise",
            "opening", "moulding", "depth", "folds", "gather", "amplitude", "detail", "seed", "flutes", "top-radius",
        ]),
        value in prop_oneof![
            Just("0".to_owned()), Just("-1".to_owned()), Just("1e-30".to_owned()), Just("1e17".to_owned()),
            (0u32..20).prop_map(|n| n.to_string()), (-2.0f32..2.0).prop_map(|x| format!("{x:?}")),
        ],
    ) {
        // Level 10 and more are errors; 8 and 9 are only slow.
        prop_assume!(!(key == "level" && (value == "8" || value == "9")));
        let text = format!("[[shape]]\nkind = \"{kind}\"\n{key} = {value}\n");
        if let Ok(loaded) = parse_with(&text, &[]) {
            for part in loaded.scene.meshes.iter().flat_map(|m| &m.parts) {
                if let Shape::Triangles(mesh) = &part.shape {
                    prop_assert!(mesh.positions.iter().all(|p| p.is_finite()));
                    prop_assert!(mesh.normals.iter().all(|n| n.is_finite()));
                    prop_assert!(mesh.uv0.iter().all(|uv| uv.is_finite()));
                    prop_assert!(mesh.indices.iter().flatten().all(|i| (*i as usize) < mesh.positions.len()));
                }
            }
        }
    }
}

/// A file that says what light there is may be as dark as it likes; one that only places models may not.
#[test]
fn files_that_declare_light_are_known() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    let model = "[[model]]\nfile = \"glow.obj\"\n";
    write("glow.obj", "mtllib glow.mtl\nusemtl glow\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    write("glow.mtl", "newmtl glow\nKd 0 0 0\nKe 5 5 5\n");
    write("lit.toml", "[[light]]\nkind = \"point\"\nposition = [0, 1, 0]\nintensity = 1\n");
    write("lit.pbrt", "WorldBegin\nLightSource \"point\"\nShape \"sphere\"\n");
    write("dark.pbrt", "WorldBegin\nShape \"sphere\"\n");
    let declares = |text: &str| {
        write("scene.toml", text);
        let loaded = scene::load::load(&folder.path().join("scene.toml"), &LoadOptions::default());
        loaded.unwrap_or_else(|e| panic!("{text}: {e}")).scene.declares_light
    };
    let material = "[materials.lamp]\nbase-color = [0, 0, 0]\nemission = [3, 3, 3]\n";
    let light = "[[light]]\nkind = \"point\"\nposition = [0, 1, 0]\nintensity = 0\n";
    let black = "[environment]\ncolor = [0, 0, 0]\n";
    for own in [material, light, black] {
        assert!(declares(own) && declares(&format!("{model}\n{own}")), "{own}");
    }
    for (file, expected) in
        [("glow.obj", false), ("lit.toml", true), ("lit.pbrt", true), ("dark.pbrt", false)]
    {
        assert_eq!(declares(&format!("[[model]]\nfile = \"{file}\"\n")), expected, "{file}");
    }
}

#[test]
fn daylight_is_read() {
    let text = "[environment.daylight]\nsun = \"2026-06-21T14:30+02:00@48.14,11.58\"\nturbidity = 4\nground = [0.1, 0.2, 0.3]\n";
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("day.toml");
    let load = |text: &str| {
        std::fs::write(&path, text).unwrap();
        scene::load::load(&path, &LoadOptions::default())
    };
    let scene = load(text).unwrap().scene;
    let Environment::Daylight(daylight) = scene.environment else { panic!("{:?}", scene.environment) };
    assert_eq!((daylight.turbidity, daylight.ground), (4.0, glam::vec3(0.1, 0.2, 0.3)));
    assert!(daylight.sun.elevation > 1.0, "a summer's afternoon");
    // The sun is seen, and the sky is sampled by its own table.
    let tables = SceneTables::build(&scene);
    assert!(tables.lights.len() == 2 && tables.lights[0].visible && tables.environment.width > 0);
    let error = load(&text.replace("14:30", "02:30")).unwrap_err().to_string();
    assert!(error.contains("below the horizon"), "{error}");
    assert!(load(&text.replace("turbidity = 4", "turbidity = 40")).is_err());
}

#[test]
fn media_are_read_and_impossible_ones_refused() {
    let scene = parsed(
        "[materials.milk]\nmodel = \"boundary\"\n\
         medium = { absorption = [0.1, 0.2, 0.3], scattering = 5, anisotropy = 0.7 }\n\
         [fog]\nscattering = 0.1\ntop = 3\n",
    )
    .scene;
    let milk = &scene.materials[0];
    assert_eq!(milk.model, Model::Boundary);
    let medium = milk.medium.clone().expect("a medium");
    assert_eq!(medium.absorption, Vec3::new(0.1, 0.2, 0.3));
    assert_eq!((medium.scattering, medium.emission, medium.anisotropy), (Vec3::splat(5.0), Vec3::ZERO, 0.7));
    let fog = scene.fog.expect("fog");
    assert_eq!((fog.medium.scattering, fog.top), (Vec3::splat(0.1), 3.0));
    assert_eq!(parsed("[fog]\nabsorption = 1\n").scene.fog.expect("fog").top, f32::INFINITY);
    for (text, says) in [
        ("[materials.a]\nmedium = { scattering = 1 }\n", "light gets through"),
        ("[materials.a]\nmodel = \"dielectric\"\nthin-walled = true\nmedium = {}\n", "light gets through"),
        ("[materials.a]\nmodel = \"boundary\"\nalpha-mode = \"blend\"\n", "no surface"),
        ("[materials.a]\nmodel = \"boundary\"\nmedium = { anisotropy = 1 }\n", "medium.anisotropy"),
        ("[materials.a]\nmodel = \"boundary\"\nmedium = { scattering = -1 }\n", "negative"),
        ("[materials.a]\nmodel = \"boundary\"\nmedium = { thickness = 1 }\n", "thickness"),
        ("[materials.a]\nsubsurface = { radius = 0.1 }\n", "dielectric"),
        ("[materials.a]\nmodel = \"dielectric\"\nsubsurface = { radius = [1, 0, 1] }\n", "subsurface.radius"),
        ("[materials.a]\nmodel = \"dielectric\"\nmedium = {}\nsubsurface = { radius = 1 }\n", "already"),
        ("[materials.a]\nmodel = \"dielectric\"\nsubsurface = {}\n", "radius"),
        ("[materials.a]\npriority = 1\n", "light gets into"),
        ("[materials.a]\nmodel = \"dielectric\"\npriority = 5000\n", "priority"),
        ("[fog]\nemission = 1\n", "infinitely bright"),
        ("[fog]\nscattering = 1\nanisotropy = -1\n", "anisotropy"),
    ] {
        let message = message(text);
        assert!(message.contains(says), "{message}");
    }
}

#[test]
fn densities_are_read_from_files_and_placed() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut bytes = b"VOL\x03".to_vec();
    bytes.extend([1u32, 2, 1, 1, 1].iter().flat_map(|w| w.to_le_bytes()));
    bytes.extend([0.0f32, 0.0, 0.0, 1.0, 1.0, 1.0, 0.5, 2.0].iter().flat_map(|v| v.to_le_bytes()));
    std::fs::write(folder.path().join("cloud.vol"), bytes).expect("a file");
    let load = |density: &str| {
        let text = format!(
            "[materials.a]\nmodel = \"boundary\"\nmedium = {{ scattering = 1, density = {density} }}\n"
        );
        scene_file::parse(
            &text,
            Path::new("test.toml"),
            folder.path(),
            &Parameters::new(),
            &LoadOptions::default(),
        )
    };
    let grid = |density: &str| {
        let medium = load(density).expect("a scene").scene.materials[0].medium.clone().expect("a medium");
        medium.density.expect("a density")
    };
    let own = grid("\"cloud.vol\"");
    assert_eq!((own.bounds(), own.values(), own.largest()), ([Vec3::ZERO, Vec3::ONE], &[0.5, 2.0][..], 2.0));
    let placed = grid("{ file = \"cloud.vol\", bounds = [[-1, 0, 0], [1, 2, 3]] }");
    assert_eq!(placed.bounds(), [Vec3::new(-1.0, 0.0, 0.0), Vec3::new(1.0, 2.0, 3.0)]);
    let error = load("{ file = \"cloud.vol\", bounds = [[0, 0, 0], [1, 0, 1]] }").expect_err("flat");
    assert!(error.to_string().contains("density.bounds"), "{error}");
    let error = load("\"none.vol\"").expect_err("no file");
    assert!(matches!(error, LoadError::Read { .. }), "{error}");
}

/// A texture graph as a density: declared or in place, with its bounds; and what is wrong with others.
#[test]
fn densities_are_texture_graphs_too() {
    let text = |density: &str| {
        format!(
            "[textures.billows]\nnode = \"noise\"\nspace = \"world\"\nlow = -1\n\n\
             [materials.a]\nmodel = \"boundary\"\nmedium = {{ scattering = 1, density = {density} }}\n"
        )
    };
    let bounds = "bounds = [[-1, 0, -1], [1, 2, 1]]";
    let billows = format!("{{ texture = \"billows\", {bounds}, size = [8, 9, 10] }}");
    let in_place = "{ node = \"gradient\", space = \"world\" }";
    for (density, size) in [(billows, [8, 9, 10]), (format!("{{ texture = {in_place}, {bounds} }}"), [64; 3])]
    {
        let medium = parsed(&text(&density)).scene.materials[0].medium.clone().expect("a medium");
        let grid = medium.density.expect("a density");
        assert_eq!(grid.size(), size);
        assert_eq!(grid.bounds(), [Vec3::new(-1.0, 0.0, -1.0), Vec3::new(1.0, 2.0, 1.0)]);
        assert!(grid.values().iter().any(|v| *v > 0.0) && grid.values().contains(&0.0));
    }
    for (density, says) in [
        ("{ texture = \"billows\" }", "needs `bounds`"),
        ("{ texture = \"billows\", bounds = [[0, 0, 0], [0, 1, 1]] }", "above the first"),
        (&format!("{{ texture = \"billows\", {bounds}, size = [0, 1, 1] }}"), "density.size"),
        (&format!("{{ texture = \"billows\", {bounds}, size = [1024, 1024, 1024] }}"), "too many"),
        (&format!("{{ file = \"a.vol\", texture = \"billows\", {bounds} }}"), "either `file`"),
        ("{ file = \"a.vol\", size = [2, 2, 2] }", "either `file`"),
        (&format!("{{ texture = {{ node = \"smoke\" }}, {bounds} }}"), "no such node"),
        (&format!("{{ texture = {{ node = \"image\", image = \"a.png\" }}, {bounds} }}"), "an image"),
    ] {
        let error = message(&text(density));
        assert!(error.contains(says), "{error}");
    }
}
