//! pbrt-v4 scenes: directives one by one, the picture's orientation, and files made to break the loader.

use glam::{Vec3, vec3};
use proptest::prelude::*;
use scene::load::pbrt;
use scene::{
    AlphaMode, Environment, GraphInput, LightKind, LoadError, LoadOptions, Loaded, Model, Pixels, Projection,
    Severity, Shape, Texture, TriangleMesh,
};
use std::path::Path;

fn parse(text: &str) -> Result<Loaded, LoadError> {
    pbrt::load_bytes(Path::new("test.pbrt"), text.into(), &LoadOptions::default())
}

fn load(text: &str) -> Loaded {
    parse(text).unwrap_or_else(|error| panic!("{error}"))
}

fn mesh(loaded: &Loaded, index: usize) -> &TriangleMesh {
    let Shape::Triangles(mesh) = &loaded.scene.meshes[index].parts[0].shape else { panic!("not triangles") };
    mesh
}

const TRIANGLE: &str =
    "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2]\n";

/// Where a world point is in the picture of the scene's camera: to the right and up, as tangents.
fn in_picture(loaded: &Loaded, point: Vec3) -> (f32, f32) {
    let camera = &loaded.scene.cameras[0];
    let forward = (camera.target - camera.eye).normalize();
    let right = forward.cross(camera.up).normalize();
    let up = right.cross(forward);
    let offset = point - camera.eye;
    (offset.dot(right) / offset.dot(forward), offset.dot(up) / offset.dot(forward))
}

/// Normals say which side is outside, whatever the winding; `ReverseOrientation` then turns it.
#[test]
fn normals_decide_the_side_of_meshes() {
    for (normal, reversed) in [(1, false), (-1, false), (1, true), (-1, true)] {
        let lines = if reversed { "ReverseOrientation\n" } else { "" };
        let folder = tempfile::tempdir().expect("a folder");
        let ply = format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
             property float nx\nproperty float ny\nproperty float nz\nelement face 1\n\
             property list uchar int vertex_indices\nend_header\n0 0 0 0 0 {normal}\n1 0 0 0 0 {normal}\n0 1 0 0 0 {normal}\n3 0 1 2\n"
        );
        std::fs::write(folder.path().join("a.ply"), ply).expect("a file");
        let shape = TRIANGLE.trim_end();
        let text = format!(
            "WorldBegin\nAreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\n{lines}{shape} \"normal N\" [0 0 {normal} 0 0 {normal} 0 0 {normal}]\n\
             Shape \"plymesh\" \"string filename\" \"a.ply\"\n"
        );
        let path = folder.path().join("a.pbrt");
        std::fs::write(&path, text).expect("a file");
        let loaded = pbrt::load(&path, &LoadOptions::default()).expect("sound");
        let side = if reversed { -normal as f32 } else { normal as f32 };
        for index in 0..2 {
            let mesh = mesh(&loaded, index);
            let [a, b, c] = mesh.indices[0].map(|i| mesh.positions[i as usize]);
            assert_eq!((b - a).cross(c - a), Vec3::Z * side, "{normal} {reversed} {index}");
            assert!(mesh.normals.iter().all(|n| *n == Vec3::Z * side));
        }
    }
}

#[test]
fn older_versions_are_named() {
    let text = "Film \"image\"\nWorldBegin\nMaterial \"matte\" \"rgb Kd\" [1 0 0]\n";
    let loaded = load(&format!("{text}{TRIANGLE}"));
    assert!(loaded.report.notes.iter().any(|n| n.message.contains("pbrt-v3")), "{:?}", loaded.report);
    let error = parse(&format!("{text}Volume \"x\"\n")).expect_err("no such directive").to_string();
    assert!(error.contains("pbrt-v3"), "{error}");
    assert!(!parse("Volume \"x\"\n").expect_err("no such directive").to_string().contains("pbrt-v3"));
}

/// The example of the format's documentation, shortened.
#[test]
fn the_example_of_the_documentation_is_read() {
    let text = "LookAt 3 4 1.5  # eye
        .5 .5 0  # look at point
        0 0 1    # up vector
    Camera \"perspective\" \"float fov\" 45
    Sampler \"halton\" \"integer pixelsamples\" 128
    Integrator \"volpath\" \"integer maxdepth\" [ 7 ]
    Film \"rgb\" \"string filename\" \"simple.png\" \"integer xresolution\" [400] \"integer yresolution\" [300]
    WorldBegin
    LightSource \"infinite\" \"rgb L\" [ .4 .45 .5 ]
    LightSource \"distant\"  \"point3 from\" [ -30 40  100 ] \"blackbody L\" 3000 \"float scale\" 1.5
    AttributeBegin
      Material \"dielectric\"
      Shape \"sphere\" \"float radius\" 1
    AttributeEnd
    AttributeBegin
      Texture \"checks\" \"spectrum\" \"checkerboard\" \"float uscale\" [16] \"float vscale\" [16]
          \"rgb tex1\" [.1 .1 .1] \"rgb tex2\" [.8 .8 .8]
      Material \"diffuse\" \"texture reflectance\" \"checks\"
      Translate 0 0 -1
      Shape \"bilinearmesh\" \"point3 P\" [ -20 -20 0 20 -20 0 -20 20 0 20 20 0 ] \"point2 uv\" [ 0 0 1 0 1 1 0 1 ]
    AttributeEnd";
    let loaded = load(text);
    let scene = &loaded.scene;
    let defaults = &scene.defaults;
    assert_eq!(
        (defaults.width, defaults.height, defaults.spp, defaults.max_depth),
        (Some(400), Some(300), Some(128), Some(8))
    );
    let Projection::Perspective { fov_y } = scene.cameras[0].projection else { panic!("perspective") };
    assert!((fov_y - 45f32.to_radians()).abs() < 1e-6, "the height is the shorter side");
    assert_eq!(scene.environment, Environment::Constant(vec3(0.4, 0.45, 0.5)));
    let LightKind::Directional { direction, irradiance, .. } = scene.lights[0].kind else {
        panic!("distant")
    };
    assert!(
        (direction - vec3(-30.0, -40.0, -99.0).normalize()).length() < 1e-5,
        "to (0, 0, 1), mirrored at x = 0: {direction}"
    );
    assert!(irradiance.x > irradiance.y && irradiance.y > irradiance.z, "3000 K is warm: {irradiance}");
    let materials: Vec<_> = scene.materials.iter().map(|m| m.model).collect();
    assert_eq!(materials, [Model::Lambert, Model::Dielectric, Model::Lambert]);
    let checks = scene.materials[2].base_color_texture.expect("a texture").texture as usize;
    let Texture::Graph(graph) = &scene.textures[checks] else { panic!("a graph") };
    let board = &graph.nodes[0];
    assert_eq!((graph.summary().as_str(), board.inputs[1]), ("checkerboard", GraphInput::color([0.8; 3])));
    let corner = board.placement.map.transform_point3(vec3(0.0, 1.0, 0.0));
    assert_eq!(corner, vec3(0.0, 0.0, 0.0), "v grows upwards there");
    assert_eq!(scene.materials[2].alpha_mode, AlphaMode::Opaque);
    assert!(matches!(scene.meshes[0].parts[0].shape, Shape::Spheres(_)));
    assert_eq!(mesh(&loaded, 1).indices, [[0, 1, 3], [0, 3, 2]]);
}

/// Every texture that pbrt computes is a graph, and graphs are put together.
#[test]
fn procedural_textures_are_graphs() {
    let text = "WorldBegin Rotate 30 0 0 1
    Texture \"f\" \"float\" \"fbm\" \"integer octaves\" 4
    Texture \"w\" \"float\" \"wrinkled\"
    Texture \"y\" \"float\" \"windy\"
    Texture \"m\" \"spectrum\" \"marble\" \"float variation\" .4
    Texture \"d\" \"spectrum\" \"dots\" \"rgb inside\" [1 0 0] \"float uscale\" 8
    Texture \"c\" \"spectrum\" \"checkerboard\" \"integer dimension\" 3 \"texture tex1\" \"m\"
    Texture \"s\" \"spectrum\" \"scale\" \"texture tex\" \"c\" \"texture scale\" \"f\"
    Texture \"x\" \"spectrum\" \"mix\" \"texture tex1\" \"d\" \"texture tex2\" \"m\" \"texture amount\" \"w\"
    Texture \"n\" \"spectrum\" \"directionmix\" \"texture tex1\" \"d\" \"rgb tex2\" [0 0 1]
    Material \"diffuse\" \"texture reflectance\" \"s\" \"texture displacement\" \"y\"
    Material \"diffuse\" \"texture reflectance\" \"x\"
    Material \"coateddiffuse\" \"texture reflectance\" \"n\" \"texture roughness\" \"f\"
    Shape \"sphere\"";
    let loaded = load(text);
    let scene = &loaded.scene;
    let graph =
        |reference: Option<scene::TextureRef>| match &scene.textures[reference.unwrap().texture as usize] {
            Texture::Graph(graph) => graph.summary(),
            Texture::Image(_) => panic!("an image"),
        };
    let of = |i: usize| graph(scene.materials[i].base_color_texture);
    assert_eq!(of(1), "noise, wave, range, mix, checkerboard, multiply");
    assert_eq!(graph(scene.materials[1].normal_texture), "noise, magnitude, multiply");
    assert_eq!(of(2), "dots, noise, wave, range, mix");
    assert_eq!(of(3), "dots, facing, mix");
    assert_eq!(graph(scene.materials[3].metallic_roughness_texture), "noise, power, combine");
    let notes = &loaded.report.notes;
    assert!(!notes.iter().any(|n| n.message.contains("texture")), "{notes:?}");
}

/// +x of pbrt's camera is to the right, whether the world is mirrored by the file or not.
#[test]
fn the_picture_is_not_mirrored() {
    let sphere = "WorldBegin Translate 2 1 10 Shape \"sphere\"";
    let plain = load(&format!("Camera \"perspective\" {sphere}"));
    let at = plain.scene.instances[0].transform.translation.into();
    let (right, up) = in_picture(&plain, at);
    assert!((right - 0.2).abs() < 1e-5 && (up - 0.1).abs() < 1e-5, "{right} {up}");
    // Exporters flip x before the camera: then +x of the world is to the left.
    let flipped = load(&format!("Scale -1 1 1 Camera \"perspective\" {sphere}"));
    let at = flipped.scene.instances[0].transform.translation.into();
    let (right, up) = in_picture(&flipped, at);
    assert!((right + 0.2).abs() < 1e-5 && (up - 0.1).abs() < 1e-5, "{right} {up}");
}

#[test]
fn transforms_and_blocks_nest() {
    let loaded = load(&format!(
        "Scale -1 1 1 Camera \"perspective\" WorldBegin
        Translate 1 0 0 CoordinateSystem \"here\"
        AttributeBegin Scale 2 2 2 Rotate 90 0 0 1 {TRIANGLE} AttributeEnd
        TransformBegin Transform [1 0 0 0 0 1 0 0 0 0 1 0 0 0 5 1] {TRIANGLE} TransformEnd
        Identity CoordSysTransform \"here\" ConcatTransform [1 0 0 0 0 1 0 0 0 0 1 0 0 3 0 1] {TRIANGLE}"
    ));
    let corner = |i: usize| loaded.scene.instances[i].transform.transform_point3(Vec3::X);
    assert!((corner(0) - vec3(1.0, 2.0, 0.0)).length() < 1e-5, "{}", corner(0));
    assert!((corner(1) - vec3(1.0, 0.0, 5.0)).length() < 1e-5, "{}", corner(1));
    assert!((corner(2) - vec3(2.0, 3.0, 0.0)).length() < 1e-5, "{}", corner(2));
}

#[test]
fn objects_are_stored_once() {
    let loaded = load(&format!(
        "Scale -1 1 1 Camera \"perspective\" WorldBegin
        ObjectBegin \"thing\" Translate 0 1 0 {TRIANGLE} Shape \"disk\" ObjectEnd
        AttributeBegin Translate 5 0 0 ObjectInstance \"thing\" AttributeEnd
        Translate 7 0 0 ObjectInstance \"thing\""
    ));
    assert_eq!((loaded.scene.meshes.len(), loaded.scene.instances.len()), (2, 4));
    let at: Vec<Vec3> = loaded.scene.instances.iter().map(|i| i.transform.translation.into()).collect();
    assert_eq!([at[0], at[2]], [vec3(5.0, 1.0, 0.0), vec3(7.0, 1.0, 0.0)]);
}

/// A triangle shines to the side from which its corners go counter-clockwise in pbrt's own coordinates (by its formula,
/// the cross product of its edges), and to the other with ReverseOrientation.
#[test]
fn area_lights_shine_to_their_own_side() {
    let shining = "AreaLightSource \"diffuse\" \"rgb L\" [1 2 3] \"float scale\" 2";
    for (reversed, sign) in [("", 1.0), ("ReverseOrientation", -1.0)] {
        let loaded = load(&format!("Camera \"perspective\" WorldBegin {reversed} {shining} {TRIANGLE}"));
        let tables = scene::tables::SceneTables::build(&loaded.scene);
        let light = &tables.lights[0].light;
        assert_eq!(light.emission.to_array(), [2.0, 4.0, 6.0]);
        let normal = Vec3::from(light.edge1.to_array()).cross(light.edge2.to_array().into());
        assert!(normal.z * sign > 0.0, "{reversed}: {normal}");
        assert!(!light.two_sided);
    }
}

#[test]
fn materials_are_named_and_converted() {
    let loaded = load(&format!(
        "WorldBegin
        MakeNamedMaterial \"gold\" \"string type\" \"conductor\" \"spectrum eta\" \"metal-Au-eta\" \"spectrum k\" \"metal-Au-k\" \"float roughness\" 0.0625
        MakeNamedMaterial \"plastic\" \"string type\" \"coateddiffuse\" \"rgb reflectance\" [.2 .4 .6] \"float roughness\" 0.25 \"bool remaproughness\" false
        Texture \"image\" \"spectrum\" \"imagemap\" \"string filename\" \"missing.png\" \"float uscale\" 4
        Material \"diffuse\" \"texture reflectance\" \"image\"
        {TRIANGLE} NamedMaterial \"gold\" {TRIANGLE} NamedMaterial \"plastic\" {TRIANGLE}
        Material \"thindielectric\" \"float eta\" 1.3 {TRIANGLE} Material \"hair\" {TRIANGLE}"
    ));
    let material =
        |mesh: usize| &loaded.scene.materials[loaded.scene.meshes[mesh].parts[0].material as usize];
    let image = material(0).base_color_texture.expect("a texture");
    assert_eq!((image.transform.rows[0].x, image.transform.offset.y), (4.0, 0.0));
    assert_eq!((material(1).metallic, material(1).base_color.y), (1.0, 0.766));
    assert!((material(1).roughness - 0.5).abs() < 1e-6, "the width is the square root of the value");
    assert_eq!((material(2).roughness, material(2).base_color.z), (0.5, 0.6));
    assert!(material(3).thin_walled && material(3).ior == 1.3 && material(3).model == Model::Dielectric);
    let note = |text: &str| {
        loaded.report.notes.iter().any(|n| n.severity > Severity::Info && n.message.contains(text))
    };
    assert!(note("the material hair is taken as diffuse") && note("missing.png"), "{:?}", loaded.report);
}

#[test]
fn files_include_others() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("written");
    std::fs::create_dir(folder.path().join("geometry")).expect("made");
    write("main.pbrt", "WorldBegin Include \"geometry/a.pbrt\" Material \"conductor\"");
    write("geometry/a.pbrt", &format!("{TRIANGLE} Shape \"plymesh\" \"string filename\" \"b.ply\""));
    write(
        "geometry/b.ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
    );
    let load = |name: &str| scene::load::load(&folder.path().join(name), &LoadOptions::default());
    let loaded = load("main.pbrt").unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(loaded.scene.unique_triangles(), 2);
    write("geometry/a.pbrt", "Include \"a.pbrt\"");
    let error = load("main.pbrt").err().map(|e| e.to_string()).unwrap_or_default();
    assert!(error.contains("a.pbrt") && error.contains("includes"), "{error}");
    write("main.pbrt", "Include \"nowhere.pbrt\"");
    assert!(matches!(load("main.pbrt"), Err(LoadError::Read { .. })));
}

/// An environment map is turned with its light: white above, black below, for a light that turns z up to y up.
#[test]
fn environment_maps_are_turned() {
    let folder = tempfile::tempdir().expect("a folder");
    // The upper half of the sphere (z > 0) is the diamond in the middle of the square.
    let upper = |x: u32, y: u32| (x as f32 - 15.5).abs() + (y as f32 - 15.5).abs() < 16.0;
    let mut picture = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 32 +X 32\n".to_vec();
    for pixel in 0..32 * 32 {
        picture.extend(if upper(pixel % 32, pixel / 32) { [128, 128, 128, 129] } else { [0; 4] });
    }
    std::fs::write(folder.path().join("sky.hdr"), picture).expect("written");
    let text = "Scale -1 1 1 Camera \"perspective\" WorldBegin Rotate -90 1 0 0 LightSource \"infinite\" \"string filename\" \"sky.hdr\" \"float scale\" 3";
    std::fs::write(folder.path().join("sky.pbrt"), text).expect("written");
    let path = folder.path().join("sky.pbrt");
    let scene = scene::load::load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}")).scene;
    let Environment::Image { image, intensity, .. } = scene.environment else {
        panic!("{:?}", scene.environment)
    };
    let image = &scene.images[image as usize];
    let Pixels::Rgb32F(pixels) = &image.pixels else { panic!("not linear") };
    assert_eq!((intensity, image.width, image.height), (3.0, 64, 32));
    let rows = pixels.chunks(64).map(|row| row.iter().map(|p| p[0]).sum::<f32>() / 64.0).collect::<Vec<_>>();
    assert!(
        rows[..13].iter().all(|mean| *mean > 0.9) && rows[19..].iter().all(|mean| *mean < 0.1),
        "{rows:?}"
    );
}

/// A projection's picture is upright to a camera at its place, also if that mirrors the world; a mirrored light throws a
/// mirrored one.
#[test]
fn projections_are_projectors() {
    let folder = tempfile::tempdir().expect("a folder");
    image::RgbImage::new(4, 2).save(folder.path().join("slide.png")).expect("written");
    let load = |before: &str, parameters: &str| {
        let text = format!(
            "WorldBegin AttributeBegin {before} LightSource \"projection\" {parameters} AttributeEnd"
        );
        let path = folder.path().join("scene.pbrt");
        std::fs::write(&path, text).expect("written");
        scene::load::load(&path, &LoadOptions::default())
    };
    let slide = "\"string filename\" \"slide.png\" \"float fov\" 40 \"float scale\" 3";
    for (before, x) in [("", [1.0, 0.0]), ("Scale -1 1 1", [-1.0, 0.0])] {
        let scene = load(&format!("Translate 1 2 3 {before}"), slide).unwrap_or_else(|e| panic!("{e}")).scene;
        let LightKind::Projector { position, direction, up, intensity, field_of_view, picture } =
            scene.lights[0].kind
        else {
            panic!("{:?}", scene.lights)
        };
        // The world is mirrored, from left-handed to right-handed.
        assert_eq!((direction.abs(), up), (Vec3::Z, Vec3::Y));
        assert_eq!(intensity, Vec3::splat(3.0));
        assert!((field_of_view.to_degrees() - 40.0).abs() < 1e-4);
        assert_eq!(picture.transform.rows[0].to_array(), x, "{before}");
        let place = position + scene.origin.as_vec3();
        assert!((place.abs() - Vec3::new(1.0, 2.0, 3.0)).length() < 1e-5, "{place}");
    }
    let error = load("", "").expect_err("no picture");
    assert!(error.to_string().contains("filename"), "{error}");
}

/// Four points of the world, which is mirrored at x = 0.
#[test]
fn environments_have_portals() {
    let text =
        "WorldBegin LightSource \"infinite\" \"rgb L\" [1 1 1] \"point3 portal\" [1 0 0 3 0 0 3 1 0 1 1 0]";
    let scene = load(text).scene;
    let corners = scene.portals[0].corners();
    assert_eq!(
        (scene.portals.len(), corners[0], corners[2]),
        (1, vec3(-1.0, 0.0, 0.0), vec3(-3.0, 1.0, 0.0))
    );
}

#[test]
fn errors_name_the_line() {
    for (text, line, message) in [
        (
            "WorldBegin\nLightSource \"infinite\" \"point3 portal\" [0 0 0 1 0 0 1 1 0 0 1 1]",
            2,
            "the portal is not flat",
        ),
        (
            "WorldBegin\nLightSource \"infinite\" \"point3 portal\" [0 0 0 1 0 0 1 1 0]",
            2,
            "the portal of an infinite light needs four points",
        ),
        (
            "WorldBegin\nShape \"trianglemesh\" \"point3 P\" [0 0 0] \"integer indices\" [0 1 2]",
            2,
            "1 is not the index",
        ),
        ("Translate 1 2", 1, "expected a number, found the end of the file"),
        ("WorldBegin\n\nShpae \"sphere\"", 3, "`Shpae` does not exist"),
        ("Camera \"perspective\" \"float fov\" [ 1 \"x\" ]", 1, "expected a value"),
        ("AttributeEnd", 1, "has no beginning"),
        ("AttributeBegin TransformEnd", 1, "has no beginning"),
        ("# only this\nLookAt 0 0 0 0 0 0 0 1 0", 2, "LookAt has no direction"),
        ("Shape \"sphere", 1, "a string has no end"),
        ("ObjectInstance \"x\"", 1, "there is no object `x`"),
        ("12 13", 1, "expected a directive, found `12`"),
        ("Scale 0x1 1 1", 1, "`0x1` is not a number"),
    ] {
        let error = parse(text).err().map(|e| e.to_string()).unwrap_or_default();
        assert!(error.contains(&format!("line {line}")) && error.contains(message), "{text}: {error}");
    }
}

const SAMPLE: &str = "LookAt 0 0 5 0 0 0 0 1 0 Camera \"perspective\" \"float fov\" [ 40 ] WorldBegin AttributeBegin \
    Material \"diffuse\" \"rgb reflectance\" [ .5 .5 .5 ] AreaLightSource \"diffuse\" \"rgb L\" [ 1 1 1 ] \
    Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ] \"integer indices\" [ 0 1 2 ] AttributeEnd \
    ObjectBegin \"o\" Shape \"disk\" ObjectEnd ObjectInstance \"o\" LightSource \"point\" \"rgb I\" [ 1 1 1 ]";

proptest! {
    #[test]
    fn no_file_panics(at in 0usize..400, byte: u8, cut in 0usize..400) {
        let mut bytes = SAMPLE.as_bytes().to_vec();
        let length = bytes.len();
        bytes[at % length] = byte;
        bytes.truncate(length - cut % length);
        if let Ok(loaded) = pbrt::load_bytes(Path::new("test.pbrt"), bytes, &LoadOptions::default()) {
            let _ = scene::tables::SceneTables::build(&loaded.scene);
        }
    }

    /// Words of the format in any order.
    #[test]
    fn no_order_of_words_panics(words in proptest::collection::vec(0usize..60, 0..80)) {
        let all: Vec<&str> = SAMPLE.split_whitespace().collect();
        let text: Vec<&str> = words.iter().map(|w| all[*w % all.len()]).collect();
        let _ = parse(&text.join(" "));
    }
}

#[test]
fn loop_subdivision_has_its_levels() {
    let cage = "\"point3 P\" [1 1 1 1 -1 -1 -1 1 -1 -1 -1 1] \"integer indices\" [0 1 2 0 3 1 0 2 3 1 3 2]";
    for (levels, triangles) in [("", 256), ("\"integer levels\" [1]", 16)] {
        let loaded = load(&format!("WorldBegin\nShape \"loopsubdiv\" {cage} {levels}\n"));
        assert_eq!(mesh(&loaded, 0).indices.len(), triangles);
        let corner = Vec3::splat(0.2);
        assert!(mesh(&loaded, 0).positions.iter().any(|p| p.abs().distance(corner) < 1e-5));
        let severe = loaded.report.notes.iter().filter(|note| note.severity > Severity::Info).count();
        assert_eq!(severe, 0, "{:?}", loaded.report.notes);
    }
}
