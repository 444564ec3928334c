//! Environment maps from the wild.

mod common;

use common::files;
use scene::load::environment;
use scene::{Image, LoadError, LoadOptions, LoadReport, Pixels};
use std::path::Path;

fn load(path: &Path, options: &LoadOptions) -> (Image, LoadReport) {
    let mut report = LoadReport::default();
    let image = environment::load(path, options, &mut report);
    (image.unwrap_or_else(|e| panic!("{}: {e}", path.display())), report)
}

fn pixels(image: &Image) -> &[[f32; 3]] {
    match &image.pixels {
        Pixels::Rgb32F(pixels) => pixels,
        _ => panic!("{} is not RGB of floats", image.name),
    }
}

fn mean(image: &Image) -> f32 {
    let sum: f64 = pixels(image).iter().flatten().map(|v| f64::from(*v)).sum();
    (sum / (pixels(image).len() * 3) as f64) as f32
}

#[test]
fn skies_have_their_size_and_range() {
    let Some(shared) = testkit::require_shared("skies_have_their_size_and_range") else { return };
    for (name, width, height) in [
        ("hdri_polyhaven/aristea_wreck_puresky_1k.hdr", 1024, 512),
        ("hdri_polyhaven/brown_photostudio_02_1k.hdr", 1024, 512),
        ("hdri_spiaggia/spiaggia_di_mondello_1k.hdr", 1024, 512),
    ] {
        let (image, report) = load(&shared.join("scenes").join(name), &LoadOptions::default());
        assert_eq!((image.width, image.height), (width, height), "{name}");
        assert!(pixels(&image).iter().flatten().all(|v| v.is_finite() && *v >= 0.0));
        assert!((0.01..100.0).contains(&mean(&image)), "{name}: {}", mean(&image));
        assert!(report.notes.iter().all(|n| !n.message.contains("2 : 1")), "{report:?}");
        assert!(report.bytes_read > 100_000);
    }
}

#[test]
fn every_shared_exr_file_loads() {
    let Some(shared) = testkit::require_shared("every_shared_exr_file_loads") else { return };
    let all = files(&shared.join("scenes/reference_ignis"), "exr");
    let references = shared.join("references");
    let more = if references.is_dir() { files(&references, "exr") } else { Vec::new() };
    assert!(all.len() >= 10, "only {} files were found", all.len());
    for file in all.iter().chain(&more) {
        let (image, _) = load(file, &LoadOptions::default());
        assert!(mean(&image) > 0.0, "{}", file.display());
    }
}

#[test]
fn large_maps_are_shrunk_and_keep_their_mean() {
    let Some(shared) = testkit::require_shared("large_maps_are_shrunk_and_keep_their_mean") else { return };
    let path = shared.join("scenes/hdri_spiaggia/spiaggia_di_mondello_1k.hdr");
    let (whole, _) = load(&path, &LoadOptions::default());
    let (small, report) = load(&path, &LoadOptions { max_texture_size: 100, ..Default::default() });
    assert_eq!((small.width, small.height), (64, 32));
    assert!((mean(&small) / mean(&whole) - 1.0).abs() < 1e-3);
    assert!(report.notes.iter().any(|n| n.message == "shrunk from 1024 × 512 to 64 × 32"), "{report:?}");
}

#[test]
fn what_cannot_be_read_is_a_clear_error() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    };
    let options = LoadOptions::default();
    let error = |path: &Path| environment::load(path, &options, &mut LoadReport::default()).unwrap_err();
    assert!(matches!(error(&folder.path().join("none.hdr")), LoadError::Read { .. }));
    assert!(matches!(error(folder.path()), LoadError::Read { .. }));
    for path in [
        write("text.hdr", b"hello"),
        write("cut.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 512 +X 1024\n"),
        write("cut.exr", &[0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0]),
        write("huge.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 900000 +X 900000\n"),
    ] {
        let error = error(&path);
        let LoadError::Malformed { object, message, .. } = &error else { panic!("{error}") };
        assert!(object == "environment map" && !message.is_empty(), "{error}");
    }
}

/// A glTF file whose environment is a cube, one colour a face, with the upper left quarter of each face in another colour.
///
/// `light`: further properties of the light, JSON. `files`: how many of the six faces are there.
fn cube(light: &str, files: usize, alpha: u8) -> Result<scene::Loaded, LoadError> {
    use base64::Engine;
    let face = |number: usize| {
        let color = [30 + 40 * number as u8, 0, 200 - 30 * number as u8, alpha];
        let mark = [0, 255, 0, alpha];
        let pixel = |x: u32, y: u32| image::Rgba(if x < 4 && y < 4 { mark } else { color });
        let mut bytes = std::io::Cursor::new(Vec::new());
        image::RgbaImage::from_fn(8, 8, pixel).write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        let text = base64::engine::general_purpose::STANDARD.encode(bytes.into_inner());
        format!(r#"{{ "uri": "data:image/png;base64,{text}" }}"#)
    };
    let images: Vec<String> = (0..files).map(face).collect();
    let text = format!(
        r#"{{ "asset": {{ "version": "2.0" }}, "extensionsRequired": ["EXT_lights_image_based"], "scene": 0,
        "scenes": [{{ "extensions": {{ "EXT_lights_image_based": {{ "light": 0 }} }} }}],
        "images": [{}],
        "extensions": {{ "EXT_lights_image_based": {{ "lights": [{{ {light} "specularImageSize": 8,
            "irradianceCoefficients": [] }}] }} }} }}"#,
        images.join(", ")
    );
    scene::load::gltf::load_bytes(Path::new("cube.gltf"), text.as_bytes(), &LoadOptions::default())
}

const SIX: &str = r#""specularImages": [[0, 1, 2, 3, 4, 5]],"#;

/// The environment's radiance in a direction, without its intensity.
fn seen(loaded: &scene::Loaded, x: f32, y: f32, z: f32) -> [f32; 3] {
    let scene::Environment::Image { image, rotation, .. } = loaded.scene.environment else { panic!("a map") };
    assert_eq!(rotation, 0.0);
    let image = &loaded.scene.images[image as usize];
    let length = (x * x + y * y + z * z).sqrt();
    let uv = optics::sky::direction_to_equirect(optics::vec3f(x / length, y / length, z / length), 0.0);
    let (column, row) = ((uv.x * image.width as f32) as u32, (uv.y * image.height as f32) as u32);
    pixels(image)[(row.min(image.height - 1) * image.width + column.min(image.width - 1)) as usize]
}

fn color(number: usize) -> [f32; 3] {
    [30 + 40 * number as u8, 0, 200 - 30 * number as u8]
        .map(|v| optics::tonemap::srgb_decode_channel(f32::from(v) / 255.0))
}

#[track_caller]
fn assert_near(a: [f32; 3], b: [f32; 3]) {
    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-4), "{a:?} instead of {b:?}");
}

const AXES: [[f32; 3]; 6] =
    [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];

#[test]
fn faces_of_a_cube_are_seen_in_their_directions() {
    let loaded = cube(SIX, 6, 255).unwrap();
    assert!(loaded.report.notes.is_empty(), "{:?}", loaded.report);
    // Off the middle, to the lower right of each picture, and at its upper left.
    let right = [
        [0.0, 0.0, 1.0],
        [0.0, 0.0, -1.0],
        [-1.0, 0.0, 0.0],
        [-1.0, 0.0, 0.0],
        [-1.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
    ];
    let up = [
        [0.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, -1.0],
        [0.0, 0.0, 1.0],
        [0.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
    ];
    for number in 0..6 {
        let aside = |across: f32, upwards: f32| {
            let [x, y, z] =
                [0, 1, 2].map(|i| AXES[number][i] + right[number][i] * across + up[number][i] * upwards);
            seen(&loaded, x, y, z)
        };
        assert_near(aside(0.5, -0.5), color(number));
        assert_near(aside(0.5, 0.5), color(number));
        assert_near(aside(-0.5, -0.5), color(number));
        assert_near(aside(-0.5, 0.5), [0.0, 1.0, 0.0]);
    }
}

#[test]
fn cubes_are_turned_and_scaled() {
    let quarter = std::f32::consts::FRAC_1_SQRT_2;
    // About +Y, anticlockwise from above: +X comes to −Z. Not of unit length.
    let light =
        format!(r#"{SIX} "intensity": 2.5, "rotation": [0, {}, 0, {}],"#, 3.0 * quarter, 3.0 * quarter);
    let loaded = cube(&light, 6, 255).unwrap();
    let scene::Environment::Image { intensity, .. } = loaded.scene.environment else { panic!("a map") };
    assert_eq!(intensity, 2.5);
    assert_near(seen(&loaded, 0.4, -0.4, -1.0), color(0));
    assert_near(seen(&loaded, -1.0, -0.4, -0.4), color(5));
    // About +X: +Y comes to +Z.
    let loaded = cube(&format!(r#"{SIX} "rotation": [{quarter}, 0, 0, {quarter}],"#), 6, 255).unwrap();
    assert_near(seen(&loaded, -0.4, -0.4, 1.0), color(2));
}

#[test]
fn alpha_of_cubes_divides() {
    let loaded = cube(SIX, 6, 51).unwrap();
    assert_near(seen(&loaded, -1.0, -0.4, -0.4), color(1).map(|v| 5.0 * v));
    let nothing = cube(SIX, 6, 0).unwrap();
    assert!(pixels(&nothing.scene.images[0]).iter().flatten().all(|v| v.is_finite()));
}

#[test]
fn broken_cubes_are_refused_or_mended() {
    let refused = |light: &str, files: usize| cube(light, files, 255).map(|_| ()).unwrap_err().to_string();
    let five = refused(r#""specularImages": [[0, 1, 2, 3, 4]],"#, 6);
    assert!(five.contains("image-based light 0") && five.contains("5 images"), "{five}");
    assert!(refused("", 6).contains("0 images"));
    let missing = refused(SIX, 5);
    assert!(missing.contains("image 5"), "{missing}");
    let odd = cube(&format!(r#"{SIX} "intensity": -1, "rotation": [0, 0, 0, 0],"#), 6, 255).unwrap();
    assert_eq!(odd.report.notes.len(), 2, "{:?}", odd.report);
    assert_near(seen(&odd, 1.0, -0.4, 0.4), color(0));
}
