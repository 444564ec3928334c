//! Scene files: every documented example, every section, and errors that name what is wrong.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

mod files;
mod surfaces;

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
    let text = include_str!("../../../../docs/scene-files.md");
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
        (
            "[materials.clay]\ndiffuse-roughness = 1.5",
            "`clay`: `diffuse-roughness` must be between 0 and 1, it is 1.5",
        ),
        (
            "[materials.clay]\ndiffuse-roughness = \"high\"",
            "`clay`: invalid type: string \"high\", expected a number",
        ),
        ("[materials.film]\niridescence-ior = 0.5", "`iridescence-ior` must be between 1 and 10, it is 0.5"),
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
        ("[[camera]]\neye = [0, 0, 3]\nprojection = \"round\"", "panorama, fisheye, cubemap"),
        ("[[camera]]\neye = [0, 0, 3]\nprojection = \"cubemap\"\nfov = 3", "`fov`"),
        ("[[camera]]\neye = [0, 0, 3]\nprojection = \"fisheye\"\nfov = 361", "between 0.01 and 360"),
        ("[[camera]]\neye = [0, 0, 3]\nprojection = \"orthographic\"", "needs `height`"),
        ("[environment]", "needs one of"),
        ("[environment]\ncolor = 1\nfile = \"x\"", "needs one of"),
        ("[environment]\ncolor = 1\nrotation = 3", "`rotation` needs `file` or `texture`"),
        ("[[light]]\nkind = \"point\"\nturn = 3\nintensity = 1", "`turn`"),
        (
            "[[light]]\nkind = \"point\"\nies = \"a.ies\"\ntexture = { node = \"noise\" }",
            "`ies` and `texture` exclude each other",
        ),
        ("[environment]\ntexture = { node = \"marbles\" }", "`texture`"),
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
        clearcoat = 0.9
        sheen-roughness = 0.6
        iridescence-ior = 1.7
        diffuse-roughness = 0.8
        dispersion = 2
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
    let l = &a.layers;
    assert_eq!((l.clearcoat.strength, l.sheen.roughness, l.iridescence.ior), (0.9, 0.6, 1.7));
    assert_eq!((l.diffuse_roughness, l.dispersion), (0.8, 2.0));
    assert_eq!((b.model, b.roughness, b.base_color), (Model::Dielectric, 0.0, Vec4::ONE));
    assert!(!b.layers.are_present());
    let texture = a.base_color_texture.expect("a texture");
    assert_eq!(
        scene.textures[texture.texture as usize].as_image().expect("an image").sampler.wrap_u,
        Wrap::ClampToEdge
    );
    let uv = |u: glam::Vec2| {
        glam::vec2(texture.transform.rows[0].dot(u), texture.transform.rows[1].dot(u))
            + texture.transform.offset
    };
    assert!(uv(glam::Vec2::X).abs_diff_eq(glam::vec2(0.5, -2.0), 1e-5), "as KHR_texture_transform turns");
    assert!(report.notes.iter().any(|n| n.severity > Severity::Info), "missing textures are reported");
    assert_eq!(scene.textures.len(), 2);
    assert!(
        scene.textures.iter().filter_map(|t| t.as_image()).all(|t| (t.image as usize) < scene.images.len())
    );
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
        [[camera]]
        projection = \"fisheye\"
        eye = [0, 0, 5]
        fov = 220
        [[camera]]
        projection = \"cubemap\"
        eye = [0, 0, 5]
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
    assert_eq!(scene.cameras[3].projection, Projection::Fisheye { fov: 220f32.to_radians() });
    assert_eq!(scene.cameras[4].projection, Projection::Cubemap);
}

#[test]
fn environments_are_what_they_say() {
    let painted = parsed(
        "[environment]\ntexture = { node = \"gradient\", space = \"world\" }\nintensity = 2\nrotation = 90",
    )
    .scene;
    let Environment::Image { image, rotation, intensity } = painted.environment else { panic!() };
    assert_eq!((rotation, intensity), (90f32.to_radians(), 2.0));
    let scene::Pixels::Rgb32F(pixels) = &painted.images[image as usize].pixels else { panic!() };
    assert_eq!(pixels.len(), 2048 * 1024);
    // Along x: 0 to the left, the unit direction's x to the right.
    let at = |column: usize| pixels[512 * 2048 + column][0];
    assert!(at(512) == 0.0 && (at(1536) - 1.0).abs() < 1e-3 && (at(1195) - 0.5).abs() < 2e-2, "{}", at(1195));
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
