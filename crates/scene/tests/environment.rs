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
        Pixels::Rgba8(_) => panic!("{} is not a float image", image.name),
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
