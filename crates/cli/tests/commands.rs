//! The commands that do not render.

mod common;

use common::{fail, folder_with_triangle, names, run, succeed};
use film::{ExrCompression, ExrFile, Image, Precision};
use std::path::Path;

fn write_exr(path: &Path, rgb: impl FnMut(u32, u32) -> [f32; 3]) {
    let image = Image::from_fn(24, 16, rgb);
    ExrFile::from_image(&image, Precision::Float).write(path, ExrCompression::Zip).unwrap();
}

#[test]
fn compare_tells_how_far_pictures_are_apart() {
    let folder = tempfile::tempdir().unwrap();
    write_exr(&folder.path().join("a.exr"), |x, _| [x as f32 / 24.0; 3]);
    write_exr(&folder.path().join("b.exr"), |x, _| [x as f32 / 24.0 + 0.1; 3]);
    let same = succeed(folder.path(), "compare a.exr a.exr --json --max-flip 0 --max-rel-mse 0").json();
    assert_eq!((same["flip"].as_f64(), same["rel_mse"].as_f64()), (Some(0.0), Some(0.0)));
    assert!(same["psnr"].is_null() && same["within_limits"] == true);

    let apart = succeed(folder.path(), "compare a.exr b.exr --json").json();
    assert!(apart["flip"].as_f64() > Some(0.05) && apart["rel_mse"].as_f64() > Some(0.01), "{apart}");
    let mean = |key: &str| apart[key][0].as_f64().unwrap();
    assert!((mean("mean_actual") - mean("mean_reference") - 0.1).abs() < 1e-5);

    let ran = succeed(folder.path(), "compare a.exr b.exr --max-flip 0.9 --max-rel-mse 100");
    assert!(ran.stdout.contains("FLIP") && ran.stderr.is_empty(), "{ran:?}");
}

#[test]
fn compare_exits_with_1_above_a_limit_and_2_without_a_result() {
    let folder = tempfile::tempdir().unwrap();
    write_exr(&folder.path().join("a.exr"), |_, _| [0.2; 3]);
    write_exr(&folder.path().join("b.exr"), |_, _| [0.4; 3]);
    write_exr(&folder.path().join("nan.exr"), |x, y| [if (x, y) == (3, 2) { f32::NAN } else { 0.2 }; 3]);
    Image::black(4, 4, 3).write_png_encoded(&folder.path().join("small.png")).unwrap();
    std::fs::write(folder.path().join("text.png"), "this is no picture").unwrap();

    let flip = run(folder.path(), "compare a.exr b.exr --max-flip 0.001");
    assert_eq!(flip.code, Some(1));
    assert!(flip.stdout.contains("FLIP") && flip.stderr.contains("above the limit of 0.001"), "{flip:?}");
    let mse = run(folder.path(), "compare a.exr b.exr --max-rel-mse 1e-6 --json");
    assert_eq!((mse.code, &mse.json()["within_limits"]), (Some(1), &false.into()));

    for (arguments, reason) in [
        ("compare a.exr small.png", "the picture has 4×4 pixels, the reference 24×16"),
        ("compare a.exr nan.exr", "first in pixel (3, 2)"),
        ("compare nan.exr a.exr", "the reference has a value that is not finite"),
        ("compare a.exr missing.exr", "missing.exr"),
        ("compare missing.exr a.exr", "missing.exr"),
        ("compare a.exr text.png", "text.png"),
        ("compare a.exr b.exr --max-flip nan", "--max-flip"),
        ("compare a.exr b.exr --difference d.exr", "d.exr"),
        ("compare a.exr", "<ACTUAL>"),
    ] {
        assert_eq!(fail(folder.path(), arguments, reason).code, Some(2), "{arguments}");
    }
    // As with all commands.
    let nowhere = "compare a.exr b.exr --difference missing/d.png";
    assert_eq!(fail(folder.path(), nowhere, "d.png").code, Some(6));
}

#[test]
fn compare_writes_a_picture_of_the_differences() {
    let folder = tempfile::tempdir().unwrap();
    write_exr(&folder.path().join("a.exr"), |_, _| [0.2; 3]);
    write_exr(&folder.path().join("b.exr"), |x, _| [if x < 12 { 0.2 } else { 0.3 }; 3]);
    succeed(folder.path(), "compare a.exr b.exr --difference d.png");
    let difference = Image::open(folder.path().join("d.png")).unwrap();
    let (same, brighter) = (difference.rgb(2, 2), difference.rgb(20, 2));
    assert!(same[0] == same[2] && brighter[0] > 0.9 && brighter[2] < 0.1, "{same:?} {brighter:?}");
}

#[test]
fn info_shows_what_is_in_a_file() {
    let folder = folder_with_triangle();
    let ran = succeed(folder.path(), "info triangle.obj");
    assert!(ran.stdout.contains("triangles    1") && ran.stdout.contains("red"), "{}", ran.stdout);
    let json = succeed(folder.path(), "info triangle.obj --json").json();
    assert_eq!((&json["unique_triangles"], &json["instances"]), (&1.into(), &1.into()));
    assert_eq!(json["bounds"], serde_json::json!([[-2.0, -2.0, 0.0], [2.0, 2.0, 0.0]]));
    let materials = json["materials"].as_array().unwrap();
    assert!(materials.iter().any(|m| m["name"] == "red"), "{materials:?}");
    std::fs::remove_file(folder.path().join("triangle.mtl")).unwrap();
    let json = succeed(folder.path(), "info triangle.obj --json").json();
    assert!(
        json["notes"][0]["message"].as_str().is_some_and(|m| m.contains("triangle.mtl")),
        "{}",
        json["notes"]
    );
}

#[test]
fn info_knows_every_built_in_scene() {
    let folder = tempfile::tempdir().unwrap();
    for scene in alhazen::builtin::list() {
        let json = succeed(folder.path(), &format!("info {} --json", scene.name)).json();
        assert!(json["table_bytes"].as_u64() > Some(0), "{}", scene.name);
        assert!(!json["cameras"].as_array().unwrap().is_empty(), "{}", scene.name);
    }
}

#[test]
fn scenes_are_listed_with_their_parameters() {
    let folder = tempfile::tempdir().unwrap();
    let text = succeed(folder.path(), "scenes").stdout;
    for scene in alhazen::builtin::list() {
        assert!(text.contains(scene.name) && text.contains(&scene.about), "{text}");
        assert!(scene.parameters.iter().all(|p| text.contains(&format!("-p {}=", p.name))), "{text}");
    }
    let json = succeed(folder.path(), "scenes --json").json();
    assert_eq!(json.as_array().map(Vec::len), Some(alhazen::builtin::list().len()));
    let file = succeed(folder.path(), "scenes --text cornell").stdout;
    std::fs::write(folder.path().join("own.toml"), file).unwrap();
    succeed(folder.path(), "info own.toml");
}

#[test]
fn doctor_names_what_is_chosen() {
    let folder = tempfile::tempdir().unwrap();
    let text = succeed(folder.path(), "doctor").stdout;
    assert!(text.contains("chosen") && text.contains("scalar") && text.contains("cpu"), "{text}");
    let json = succeed(folder.path(), "doctor --json").json();
    assert_eq!(json["backends"][0]["name"], "cpu");
    assert!(json["threads"].as_u64() > Some(0));
}

#[test]
fn completions_and_manual_pages_know_all_commands() {
    let folder = tempfile::tempdir().unwrap();
    let commands = ["render", "info", "scenes", "compare", "doctor", "completions", "man"];
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = succeed(folder.path(), &format!("completions {shell}")).stdout;
        assert!(commands.iter().all(|c| script.contains(c)), "{shell}");
    }
    assert!(succeed(folder.path(), "man").stdout.contains(".TH"));
    succeed(folder.path(), "man --output pages");
    let pages = names(&folder.path().join("pages"));
    assert!(commands.iter().all(|c| pages.contains(&format!("alhazen-{c}.1"))), "{pages:?}");
}

#[test]
fn help_has_examples() {
    let folder = tempfile::tempdir().unwrap();
    for command in ["", "render", "info", "scenes", "compare", "doctor", "completions", "man"] {
        let help = succeed(folder.path(), &format!("{command} --help")).stdout;
        assert!(help.contains("Examples:"), "{command}: {help}");
    }
    assert!(succeed(folder.path(), "--version").stdout.starts_with("alhazen 0."));
}

#[test]
fn explained_pixels_are_those_of_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let picture = "cornell --width 16 --height 16 --seed 5 --max-depth 4 --backend cpu --threads 1";
    succeed(folder.path(), &format!("render {picture} --spp 1 -o picture.exr"));
    let pixel = ExrFile::read(&folder.path().join("picture.exr")).unwrap().layer("").unwrap().rgb(3, 12);
    let explained = succeed(folder.path(), &format!("explain {picture} --pixel 3,12 --json")).json();
    let number = |value: &serde_json::Value| value.as_f64().unwrap() as f32;
    let radiance = &explained["samples"][0]["radiance"];
    assert_eq!([0, 1, 2].map(|i| number(&radiance[i])), pixel);
    let vertices = explained["samples"][0]["paths"][0]["vertices"].as_array().unwrap();
    let material = vertices[0]["place"]["surface"]["material"].to_string();
    assert!(explained["materials"][&material].is_string(), "{explained}");

    let ran =
        succeed(folder.path(), &format!("explain {picture} --pixel 3,12 --samples 3 --draw path.png -q"));
    assert!(ran.stdout.contains("mean of 3 samples") && ran.stdout.contains("end: "), "{ran:?}");
    let drawn = Image::open(folder.path().join("path.png")).unwrap();
    assert_eq!((drawn.width(), drawn.height()), (16, 16));

    fail(folder.path(), &format!("explain {picture} --pixel 16,0"), "no pixel 16,0 in a picture of 16×16");
    fail(folder.path(), &format!("explain {picture} --pixel 3"), "expected X,Y");
    fail(folder.path(), &format!("explain {picture} --pixel 3,3 --draw path.exr"), "give a .png");
    fail(folder.path(), &format!("explain {picture} --pixel 3,3 --integrator aov"), "not of `aov`");
}
