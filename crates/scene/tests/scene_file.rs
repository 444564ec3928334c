//! Scene files: every documented example, every section, and errors that name what is wrong.

use glam::{Vec3, Vec4};
use proptest::prelude::*;
use scene::load::scene_file::{self, Parameters};
use scene::tables::SceneTables;
use scene::{
    AlphaMode, CameraPath, Distortion, Environment, LightKind, LoadError, LoadOptions, Loaded, Model,
    Projection, Severity, Shape, Wrap,
};
use std::path::Path;

fn parse_with(text: &str, parameters: &[(&str, &str)]) -> Result<Loaded, LoadError> {
    let parameters: Parameters = parameters.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
    let path = Path::new("test.toml");
    scene_file::parse(text, path, Path::new("no-such-folder"), &parameters, &LoadOptions::default())
}

fn parsed(text: &str) -> Loaded {
    parse_with(text, &[]).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// The error's text; every one names the file.
fn message(text: &str) -> String {
    let message = parse_with(text, &[]).map(|_| ()).expect_err(text).to_string();
    assert!(message.starts_with("test.toml: line "), "no file and line in: {message}");
    message
}

/// The examples of the documentation.
fn examples() -> Vec<String> {
    let text = include_str!("../../../docs/scene-files.md");
    let blocks = text.split("```toml\n").skip(1);
    blocks.map(|block| block.split("```").next().unwrap_or_default().to_owned()).collect()
}

#[test]
fn every_documented_example_loads() {
    let examples = examples();
    assert!(examples.len() >= 8, "only {} examples found", examples.len());
    for example in examples {
        match parse_with(&example, &[]) {
            Ok(loaded) => {
                let textures = loaded.scene.textures.len();
                let notes = loaded.report.notes.iter().filter(|n| n.severity > Severity::Info).count();
                assert!(notes == 0 || textures > 0, "{:?}", loaded.report.notes);
            }
            // Models that the page names do not exist; what is before them was understood.
            Err(LoadError::Read { path, .. }) => {
                assert!(example.contains(&*path.file_name().expect("a name").to_string_lossy()))
            }
            Err(error) => panic!("{error}\n{example}"),
        }
    }
}

#[test]
fn the_complete_example_is_what_it_says() {
    let loaded = parse_with(&examples()[0], &[("posts", "5")]).expect("the example");
    let scene = loaded.scene;
    assert_eq!(scene.name, "still life");
    assert_eq!(scene.instances.iter().filter(|i| i.name.starts_with("post")).count(), 5);
    assert_eq!((scene.cameras.len(), scene.lights.len()), (2, 1));
    assert_eq!(scene.defaults.width, Some(960));
    assert!(matches!(scene.cameras[1].path, Some(CameraPath::Orbit { .. })));
    let focal_length = 0.012 / (35f32.to_radians() * 0.5).tan();
    assert!((scene.cameras[0].lens_radius - focal_length / 8.0).abs() < 1e-6);
    let front = &scene.cameras[0];
    assert!((front.focus_distance - (front.target - front.eye).length()).abs() < 1e-4);
    let posts = scene.instances.iter().filter(|i| i.name.starts_with("post"));
    let roughness: Vec<f32> = posts
        .map(|i| i.materials.as_ref().map_or(-1.0, |m| scene.materials[m[0] as usize].roughness))
        .collect();
    assert!((roughness[0] - 0.05).abs() < 1e-6 && (roughness[4] - 0.9).abs() < 1e-6, "{roughness:?}");
}

#[test]
fn unknown_keys_are_named_with_their_line() {
    let cases = [
        ("nmae = \"x\"", "nmae", "line 1"),
        ("\n[render]\nwitdh = 3", "witdh", "line 3"),
        ("[materials.red]\nbase_color = 1", "base_color", "line 2"),
        ("[[shape]]\nkind = \"sphere\"\nradus = 1", "radus", "line 3"),
        ("[[shape]]\nkind = \"sphere\"\nmaterial = { rughness = 1 }", "rughness", "line 3"),
        ("[[shape]]\nkind = \"sphere\"\nrepeat = { grdi = 1 }", "grdi", "line 3"),
        ("[[shape]]\nkind = \"sphere\"\n[shape.vary]\nroughnes = 1", "roughnes", "line 4"),
        ("[[model]]\nfile = \"a.obj\"\nfitt = 1", "fitt", "line 3"),
        ("[[light]]\nkind = \"point\"\nintensity = 1\nangle = 3", "angle", "line 4"),
        ("[[camera]]\neye = [0, 0, 1]\nfow = 3", "fow", "line 3"),
        ("[camera]\n[camera.orbit]\nradius = 1\nperiod = 1\nbop = 3", "bop", "line 5"),
        ("[environment]\ncolour = 1", "colour", "line 2"),
        ("[environment.sky]\nhorizon = 1\nzenith = 1\nsun = { directoin = 1 }", "directoin", "line 4"),
        ("[parameters]\na = { default = 1, mni = 3 }", "mni", "line 2"),
        ("[materials.a]\nnormal-texture = { fiel = \"x\" }", "fiel", "line 2"),
    ];
    for (text, key, line) in cases {
        let message = message(text);
        assert!(message.contains(&format!("`{key}`")) && message.contains(line), "{text}\n=> {message}");
    }
}

#[test]
fn errors_name_the_object_and_the_value() {
    let cases = [
        ("a = = 1", "line 1"),
        ("[[shape]]\nname = \"ball\"\nkind = \"shpere\"", "shape 1 `ball`: unknown kind `shpere`"),
        ("[[shape]]\nkind = \"sphere\"\nradius = -2", "`radius` must be positive, it is -2"),
        ("[[shape]]\nkind = \"sphere\"\nmaterial = \"glas\"\n[materials.glass]", "no material `glas`"),
        (
            "[environment]\ncolor = 1\nportals = [{ corners = [[0, 0, 0], [1, 0, 0], [1, 2, 1], [0, 2, 0]] }]",
            "`portals`, number 1: the portal is not flat: a corner is",
        ),
        (
            "[environment]\ncolor = 1\nportals = [{ corners = [[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]] }]",
            "`portals`, number 1: the portal has no area",
        ),
        ("[[shape]]\nkind = \"icosphere\"\nlevel = 30", "`level` must be between 0 and 9, it is 30"),
        ("[[shape]]\nkind = \"grid\"\ndivisions = [8000, 8000]", "64000000"),
        ("[[shape]]\nkind = \"quad\"\ncorners = [[0, 0, 0]]", "four points"),
        ("[[shape]]\nkind = \"box\"\nsize = [1, 0, 1]", "`size` must be positive"),
        ("[[shape]]\nkind = \"box\"\nscale = 0", "`scale` must not be 0"),
        ("[[shape]]\nkind = \"box\"\nrotate = { axis = [0, 0, 0], angle = 1 }", "`rotate.axis`"),
        ("[[shape]]\nkind = \"box\"\nrotate = 3", "rotation"),
        (
            "[[shape]]\nkind = \"box\"\nrepeat = { spiral = { count = 4294967295, spacing = 1 } }",
            "4294967295 copies",
        ),
        (
            "[[shape]]\nkind = \"box\"\nrepeat = { grid = { count = [4294967295, 4294967295, 4294967295], spacing = [1, 1, 1] } }",
            "copies",
        ),
        ("[[shape]]\nkind = \"box\"\nrepeat = {}", "needs one of"),
        ("[[shape]]\nsize = 1", "`kind` is missing"),
        ("[materials.a]\nroughness = 1.5", "material `a`: `roughness` must be between 0 and 1, it is 1.5"),
        ("[materials.a]\nbase-color = \"red\"", "`red`"),
        ("[materials.a]\nbase-color = [-1, 0, 0]", "negative"),
        ("[materials.a]\nbase-color = [1.5, 0, 0]", "`base-color`"),
        ("[materials.a]\nalpha = 0.5", "`alpha-mode`"),
        ("[materials.a]\nior = 0.5", "`ior`"),
        ("[materials.a]\nmodel = \"phong\"", "phong"),
        ("[[light]]\nkind = \"area\"", "unknown kind `area`"),
        ("[[light]]\nkind = \"point\"", "`intensity`"),
        ("[[light]]\nkind = \"spot\"\nintensity = 1", "`direction` and `target`"),
        (
            "[[light]]\nkind = \"directional\"\nirradiance = 1\ntowards = [0, 0, 0]",
            "`towards` must not be zero",
        ),
        ("[[camera]]\nfov = 3", "`eye` is missing"),
        ("[[camera]]\neye = [0, 0, 0]", "`target − eye`"),
        ("[[camera]]\neye = [0, 3, 0]", "`up"),
        ("[[camera]]\neye = [0, 0, 3]\nfov = 180", "`fov`"),
        ("[[camera]]\neye = [0, 0, 3]\nheight = 2", "`height`"),
        ("[[camera]]\neye = [0, 0, 3]\nmatrix = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]", "`matrix-size`"),
        ("[[camera]]\neye = [0, 0, 3]\nprojection = \"panorama\"\nskew = 0.1", "`skew`"),
        (
            "[[camera]]\neye = [0, 0, 3]\ndistortion = { model = \"fisheye\", k = [nan, 0, 0, 0] }",
            "nan is not a number",
        ),
        (
            "[[camera]]\neye = [0, 0, 3]\nfov = 3\nmatrix-size = [4, 3]\nmatrix = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]",
            "excludes `fov`",
        ),
        (
            "[[camera]]\neye = [0, 0, 3]\nmatrix-size = [4, 3]\nmatrix = [[-1, 0, 0], [0, 1, 0], [0, 0, 1]]",
            "positive focal lengths",
        ),
        ("[environment]", "needs one of"),
        ("[environment]\ncolor = 1\nfile = \"x\"", "needs one of"),
        ("[environment]\ncolor = 1\nrotation = 3", "`rotation` needs `file`"),
        ("[[shape]]\nkind = \"sphere\"\nradius = nan", "nan"),
        ("[[shape]]\nkind = \"sphere\"\nradius = 1e300", "1e300"),
        ("[[shape]]\nkind = \"sphere\"\nradius = \"${r}\"", "`r` is not among"),
        ("shape = 3", "expected a table, not an integer"),
        ("name = 3", "expected a string, not an integer"),
        ("[[model]]\nfile = \"\"", "`file` is empty"),
        ("[[model]]", "`file`"),
    ];
    for (text, part) in cases {
        let message = message(text);
        assert!(message.contains(part), "{text}\n=> {message}\nlacks: {part}");
    }
}

#[test]
fn parameters_fill_numbers_and_text() {
    let text = "
        name = \"n${count}-${label}\"
        [parameters]
        count = 3
        label = \"x\"
        radius = { default = 0.5, min = 0.1, max = 2 }
        on = true
        [[shape]]
        kind = \"sphere\"
        if = \"${on}\"
        radius = \"${radius}\"
        repeat = { ring = { count = \"${count}\", radius = 2 } }
    ";
    let scene = parse_with(text, &[]).expect("defaults").scene;
    assert_eq!((scene.name.as_str(), scene.instances.len()), ("n3-x", 3));
    let given = [("count", "7"), ("label", "quo\"te\n"), ("radius", "2")];
    let scene = parse_with(text, &given).expect("given").scene;
    assert_eq!((scene.name.as_str(), scene.instances.len()), ("n7-quo\"te\n", 7));
    let Shape::Spheres(spheres) = &scene.meshes[0].parts[0].shape else { panic!("a sphere") };
    assert_eq!(spheres[0].radius, 2.0);
    assert!(parse_with(text, &[("on", "false")]).expect("off").scene.instances.is_empty());
    for (name, value, part) in [
        ("radius", "3", "more than 2"),
        ("radius", "inf", "finite"),
        ("on", "yes", "true or false"),
        ("x", "1", "`x`"),
    ] {
        let error = parse_with(text, &[(name, value)]).expect_err(name).to_string();
        assert!(error.contains(part) && error.contains(&format!("`{name}`")), "{error}");
    }
}

#[test]
fn transforms_scale_then_rotate_then_move() {
    let text = "
        [[shape]]
        kind = \"sphere\"
        scale = [2, 3, 4]
        rotate = [90, 0, 0]
        translate = [1, 0, 0]
        [[shape]]
        kind = \"sphere\"
        rotate = { axis = [0, 2, 0], angle = 90 }
        [[shape]]
        kind = \"sphere\"
        rotate = [90, 90, 0]
    ";
    let scene = parsed(text).scene;
    let at = |i: usize, p: Vec3| scene.instances[i].transform.transform_point3(p);
    assert!(at(0, Vec3::Y).abs_diff_eq(Vec3::new(1.0, 0.0, 3.0), 1e-5));
    assert!(at(1, Vec3::Z).abs_diff_eq(Vec3::X, 1e-5));
    // About x first: Y becomes Z; then about y: Z becomes X.
    assert!(at(2, Vec3::Y).abs_diff_eq(Vec3::X, 1e-5));
}

#[test]
fn layouts_put_copies_where_they_say() {
    let positions = |layout: &str| -> Vec<Vec3> {
        let text = format!("[[shape]]\nkind = \"sphere\"\nrepeat = {{ {layout} }}");
        parsed(&text).scene.instances.iter().map(|i| i.transform.translation.into()).collect()
    };
    let grid = positions("grid = { count = [3, 1, 2], spacing = [1, 5, 2] }, center = [0, 7, 0]");
    assert_eq!(grid.len(), 6);
    assert_eq!((grid[0], grid[5]), (Vec3::new(-1.0, 7.0, -1.0), Vec3::new(1.0, 7.0, 1.0)));
    let ring = positions("ring = { count = 4, radius = 2 }");
    assert!(ring[1].abs_diff_eq(Vec3::X * 2.0, 1e-5), "{ring:?}");
    let half = positions("ring = { count = 3, radius = 2, sweep = 180 }");
    assert!(half[2].abs_diff_eq(Vec3::NEG_Z * 2.0, 1e-5), "{half:?}");
    let spiral = positions("spiral = { count = 100, spacing = 1 }");
    let nearest = |p: &Vec3| {
        let distances = spiral.iter().map(|q| p.distance(*q)).filter(|d| *d > 0.0);
        distances.fold(f32::MAX, f32::min)
    };
    assert!(spiral.iter().all(|p| nearest(p) > 0.6), "copies keep their distance");
    let scattered = positions("scatter = { count = 50, size = [2, 0, 4] }, seed = 3");
    assert!(scattered.iter().all(|p| p.x.abs() <= 1.0 && p.y == 0.0 && p.z.abs() <= 2.0));
    assert_ne!(scattered, positions("scatter = { count = 50, size = [2, 0, 4] }, seed = 4"));
    assert_eq!(positions("at = [[1, 2, 3]]"), [Vec3::new(1.0, 2.0, 3.0)]);
    assert!(positions("at = []").is_empty());
}

#[test]
fn materials_have_all_their_fields() {
    let text = "
        [materials.a]
        base-color = \"#ffffff\"
        alpha = 0.25
        alpha-mode = \"mask\"
        alpha-cutoff = 0.1
        metallic = 0.2
        roughness = 0.3
        specular = 0.4
        ior = 1.6
        transmission = 0.7
        emission = [1, 2, 3]
        emission-strength = 2
        emission-two-sided = true
        double-sided = true
        thin-walled = true
        base-color-texture = { file = \"missing.png\", wrap = \"clamp\", rotate = 90, scale = [2, 3], offset = [0.5, 0] }
        normal-texture = \"missing.png\"
        [materials.b]
        model = \"dielectric\"
    ";
    let Loaded { scene, report } = parsed(text);
    let [a, b] = &scene.materials[..] else { panic!("two materials") };
    assert_eq!(a.base_color, Vec4::new(1.0, 1.0, 1.0, 0.25));
    assert_eq!((a.metallic, a.roughness, a.specular, a.ior, a.transmission), (0.2, 0.3, 0.4, 1.6, 0.7));
    assert_eq!(a.emission, Vec3::new(2.0, 4.0, 6.0));
    assert_eq!(a.alpha_mode, AlphaMode::Mask(0.1));
    assert!(a.emission_two_sided && a.double_sided && a.thin_walled);
    assert_eq!((b.model, b.roughness, b.base_color), (Model::Dielectric, 0.0, Vec4::ONE));
    let texture = a.base_color_texture.expect("a texture");
    assert_eq!(scene.textures[texture.texture as usize].sampler.wrap_u, Wrap::ClampToEdge);
    let uv = |u: glam::Vec2| {
        glam::vec2(texture.transform.rows[0].dot(u), texture.transform.rows[1].dot(u))
            + texture.transform.offset
    };
    assert!(uv(glam::Vec2::X).abs_diff_eq(glam::vec2(0.5, -2.0), 1e-5), "as KHR_texture_transform turns");
    assert!(report.notes.iter().any(|n| n.severity > Severity::Info), "missing textures are reported");
    assert_eq!(scene.textures.len(), 2);
    assert!(scene.textures.iter().all(|t| (t.image as usize) < scene.images.len()));
}

#[test]
fn cameras_may_be_calibrated() {
    let text = "[[camera]]\neye = [0, 0, 3]\nmatrix = [[400, 4, 319.5], [0, 410, 239.5], [0, 0, 1]]\n\
        matrix-size = [640, 480]\ndistortion = { model = \"brown-conrady\", k = [1, 2, 3, 4, 5, 6], p = [7, 8] }\n\
        [[camera]]\neye = [0, 0, 3]\nfov = 60\nskew = 0.5\ndistortion = { model = \"fisheye\" }";
    let cameras = parsed(text).scene.cameras;
    let Projection::Intrinsics { focal, center } = cameras[0].projection else { panic!("{cameras:?}") };
    assert!((focal.x * 640.0 - 400.0).abs() < 1e-3 && (center.y - 0.5).abs() < 1e-6);
    assert!((cameras[0].skew - 0.01).abs() < 1e-7 && cameras[0].aspect == Some(640.0 / 480.0));
    let brown = Distortion::BrownConrady { k: [1.0, 2.0, 3.0, 4.0, 5.0, 6.0], p: [7.0, 8.0] };
    assert_eq!(cameras[0].distortion, Some(brown));
    assert_eq!((cameras[1].distortion, cameras[1].skew), (Some(Distortion::Fisheye { k: [0.0; 4] }), 0.5));
}

#[test]
fn lights_and_cameras_are_what_they_say() {
    let text = "
        [[light]]
        kind = \"directional\"
        towards = [0, 2, 0]
        irradiance = 3
        angular-diameter = 2
        [[light]]
        kind = \"spot\"
        position = [0, 1, 0]
        target = [0, 0, 0]
        intensity = 5
        angle = 40
        translate = [0, 1, 0]
        [[light]]
        kind = \"point\"
        intensity = 8
        split-intensity = true
        repeat = { ring = { count = 4, radius = 1 } }
        vary-color = { colors = [1, [1, 0, 0]] }
        [[camera]]
        projection = \"orthographic\"
        eye = [0, 0, 5]
        height = 3
        [[camera]]
        projection = \"panorama\"
        eye = [0, 0, 5]
        [[camera]]
        eye = [0, 0, 5]
        focal-length = 24
    ";
    let scene = parsed(text).scene;
    let LightKind::Directional { direction, irradiance, angular_diameter } = scene.lights[0].kind else {
        panic!()
    };
    assert_eq!((direction, irradiance), (Vec3::NEG_Y, Vec3::splat(3.0)));
    assert!((angular_diameter - 2f32.to_radians()).abs() < 1e-6);
    let LightKind::Spot { position, direction, outer_angle, .. } = scene.lights[1].kind else { panic!() };
    assert_eq!((position, direction), (Vec3::Y * 2.0, Vec3::NEG_Y));
    assert!((outer_angle - 40f32.to_radians()).abs() < 1e-6);
    let LightKind::Point { intensity, .. } = scene.lights[3].kind else { panic!() };
    assert_eq!(intensity, Vec3::new(2.0, 0.0, 0.0));
    assert_eq!(scene.cameras[0].projection, Projection::Orthographic { height: 3.0 });
    assert_eq!(scene.cameras[1].projection, Projection::Panorama);
    let Projection::Perspective { fov_y } = scene.cameras[2].projection else { panic!() };
    assert!((fov_y.to_degrees() - 53.130_1).abs() < 1e-3);
}

#[test]
fn environments_are_what_they_say() {
    assert_eq!(parsed("").scene.environment, Environment::Black);
    let constant = parsed("[environment]\ncolor = [1, 2, 3]\nintensity = 2").scene.environment;
    assert_eq!(constant, Environment::Constant(Vec3::new(2.0, 4.0, 6.0)));
    let window =
        "[environment]\ncolor = 1\nportals = [{ corners = [[0, 0, 0], [1, 0, 0], [1, 2, 0], [0, 2, 0]] }]";
    let portals = parsed(window).scene.portals;
    assert_eq!((portals.len(), portals[0].area()), (1, 2.0));
    let table = "[environment]\ncolor = 1\n[[environment.portals]]\ncorners = [[0, 0, 0], [1, 0, 0], [1, 2, 0], [0, 2, 0]]";
    assert_eq!(parsed(table).scene.portals, portals);
    let missing = parse_with("[environment]\nfile = \"missing.hdr\"", &[]).expect_err("missing");
    assert!(matches!(missing, LoadError::Read { .. }), "{missing}");
}

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
