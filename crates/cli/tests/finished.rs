//! `alhazen denoise` and `alhazen tonemap`, on files of ours and of others, and after `merge`;
//! `--clamp-indirect`.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

mod common;

use common::{fail, folder_with_triangle, succeed};
use film::{ExrCompression, ExrFile, Image, Precision, Rect, metrics};

const RENDER: &str = "render cornell -q --width 24 --height 24 --backend cpu --threads 2";
const LAYERS: &str = "--aov albedo,normal,standard-error";

#[test]
fn finished_pictures_are_denoised_and_shown() {
    let folder = folder_with_triangle();
    let folder = folder.path();
    let path = |name: &str| folder.join(name);
    succeed(
        folder,
        &format!("{RENDER} --spp 4 {LAYERS} --denoise --exposure 0.5 -o at-once.exr -o at-once.png"),
    );
    succeed(folder, &format!("{RENDER} --spp 4 {LAYERS} --exposure 0.5 -o noisy.exr"));
    let ran = succeed(folder, "denoise noisy.exr --denoiser network -o clean.exr -o clean.png");
    assert!(ran.stderr.contains("albedo: albedo, normals: normal, errors: the file's"), "{ran:?}");
    // The layers of the file have fewer bits than the film.
    let open = |name: &str| Image::open(path(name)).unwrap();
    let distance = metrics::rel_mse(&open("at-once.exr"), &open("clean.exr")).unwrap();
    assert!(distance < 1e-3, "as if it had been denoised at once: {distance}");
    let file = ExrFile::read(&path("clean.exr")).unwrap();
    assert_eq!(file.layer("noisy"), ExrFile::read(&path("noisy.exr")).unwrap().colour());
    assert!(file.layer("albedo").is_some() && file.metadata["denoiser"].contains("network"));
    // What is denoised again begins anew.
    succeed(folder, "denoise clean.exr --denoiser network -o again.exr -q");
    assert_eq!(open("again.exr"), open("clean.exr"));
    // The exposure is the one that the file tells.
    succeed(folder, "tonemap at-once.exr -o shown.png -o shown.jpg");
    assert_eq!(std::fs::read(path("shown.png")).unwrap(), std::fs::read(path("at-once.png")).unwrap());
    succeed(folder, "tonemap at-once.exr --exposure 0.25 -o darker.png");
    let mean = |name: &str| open(name).mean()[1];
    assert!(mean("darker.png") < 0.7 * mean("shown.png"));
    assert!((mean("shown.jpg") / mean("shown.png") - 1.0).abs() < 0.05);
}

#[test]
fn merged_pictures_are_denoised() {
    let folder = folder_with_triangle();
    let folder = folder.path();
    for tile in 1..=2 {
        succeed(folder, &format!("{RENDER} --spp 4 {LAYERS} --tile {tile}/2 -o part{tile}.exr"));
    }
    fail(folder, "denoise part1.exr -o a.exr", "alhazen merge");
    succeed(folder, "merge part1.exr part2.exr -o whole.exr");
    let ran = succeed(folder, "denoise whole.exr --denoiser network -o clean.exr");
    assert!(ran.stderr.contains("errors: the file's"), "{ran:?}");
}

/// A file as Blender writes it, and one without any layer to guide.
#[test]
fn pictures_of_others_are_denoised() {
    let folder = folder_with_triangle();
    let folder = folder.path();
    // A flat picture with noise of ±0.1.
    let noise = |x: u32, y: u32| {
        (x.wrapping_mul(2654435761) ^ y.wrapping_mul(40503) ^ (x * y)).wrapping_mul(2246822519)
    };
    let noisy = Image::from_fn(32, 32, |x, y| [0.4 + 0.2 * (noise(x, y) >> 8) as f32 / 16_777_216.0; 3]);
    let mut file = ExrFile::new(32, 32, Rect::full(32, 32));
    file.push_layer("ViewLayer.Combined", &["R", "G", "B"], &noisy, Precision::Half);
    let albedo = Image::from_fn(32, 32, |_, _| [0.8; 3]);
    file.push_layer("ViewLayer.Denoising Albedo", &["R", "G", "B"], &albedo, Precision::Half);
    file.write(&folder.join("blender.exr"), ExrCompression::Zip).unwrap();
    noisy.write_hdr(&folder.join("plain.hdr")).unwrap();
    for name in ["blender.exr", "plain.hdr"] {
        let ran = succeed(folder, &format!("denoise {name} --denoiser network -o clean.exr"));
        let guided = ran.stderr.contains("albedo: ViewLayer.Denoising Albedo");
        assert_eq!(guided, name == "blender.exr", "{ran:?}");
        let clean = Image::open(folder.join("clean.exr")).unwrap();
        let spread = |image: &Image| {
            let green = || image.data().iter().skip(1).step_by(image.channels());
            let mean = green().sum::<f32>() / 1024.0;
            (green().map(|v| (v - mean).powi(2)).sum::<f32>() / 1024.0).sqrt()
        };
        assert!(spread(&clean) < 0.25 * spread(&noisy), "{name}: {} of {}", spread(&clean), spread(&noisy));
    }
    fail(folder, "tonemap blender.exr -o blender.exr", "blender.exr");
    fail(folder, "tonemap blender.exr -o a.hdr", "not be tone mapped");
    fail(folder, "tonemap blender.exr --layer Depth -o a.png", "ViewLayer.Combined");
    fail(folder, "denoise blender.exr --normal Normal -o a.exr", "no layer `Normal`");
    fail(folder, "denoise missing.exr -o a.exr", "missing.exr");
    succeed(folder, "tonemap blender.exr --layer ViewLayer.Combined -o a.png");
}

#[test]
fn clamped_pictures_say_so() {
    let folder = folder_with_triangle();
    let folder = folder.path();
    succeed(folder, &format!("{RENDER} --spp 2 -o a.exr"));
    succeed(folder, &format!("{RENDER} --spp 2 --clamp-indirect 0.01 -o b.exr"));
    let [a, b] = ["a.exr", "b.exr"].map(|name| ExrFile::read(&folder.join(name)).unwrap());
    assert_eq!((a.metadata["clamp"].as_str(), b.metadata["clamp"].as_str()), ("none", "indirect 0.01"));
    let mean = |file: &ExrFile| file.colour().unwrap().mean()[0];
    assert!(mean(&b) < mean(&a));
    fail(folder, "render cornell --integrator direct --clamp-indirect 1 -o c.png", "--clamp-indirect is for");
    fail(folder, "render cornell --clamp-indirect 0 -o c.png", "clamp-indirect");
}
