//! Bad input gives one clear message, a non-zero exit code, no panic and no half-written file.

mod common;

use common::{fail, folder_with_triangle, succeed};
use film::{ExrCompression, ExrFile, Image, Precision};

const SMALL: &str = "-q --width 16 --height 16 --spp 1";

#[test]
fn scenes_that_are_not_there() {
    let folder = tempfile::tempdir().unwrap();
    fail(folder.path(), "render missing.obj", "missing.obj");
    fail(folder.path(), "render missing.glb", "missing.glb");
    fail(folder.path(), "render folder/scene.toml", "folder/scene.toml");
    fail(folder.path(), "render cornel", "did you mean cornell?");
    fail(folder.path(), "render nonsense", "known are three-spheres, cornell");
    fail(folder.path(), "render .", ".");
    fail(folder.path(), "info missing.obj", "missing.obj");
    fail(folder.path(), "scenes --text nonsense", "known are three-spheres");
}

#[test]
fn scenes_that_cannot_be_read() {
    let folder = folder_with_triangle();
    let cases: [(&str, &[u8], &str); 13] = [
        ("notes.txt", b"hello", "unknown file type"),
        ("none", b"hello", "unknown file type"),
        ("empty.gltf", b"", "empty.gltf"),
        ("broken.gltf", b"{\"asset\": {\"version\": \"2.0\"", "broken.gltf"),
        ("old.gltf", b"{\"asset\": {\"version\": \"1.0\"}}", "old.gltf"),
        ("required.gltf", b"{\"asset\":{\"version\":\"2.0\"},\"extensionsRequired\":[\"EXT_nope\"]}", "EXT_nope"),
        (
            "outside.gltf",
            b"{\"asset\":{\"version\":\"2.0\"},\"scenes\":[{\"nodes\":[5]}],\"scene\":0,\"nodes\":[]}",
            "outside.gltf",
        ),
        ("short.glb", b"glTF\x02\0\0\0\xff\0\0\0", "short.glb"),
        ("header.ply", b"ply\nformat nonsense 1.0\nend_header\n", "header.ply"),
        (
            "short.ply",
            b"ply\nformat binary_little_endian 1.0\nelement vertex 1000\nproperty float x\nproperty float y\n\
              property float z\nend_header\nabc",
            "short.ply",
        ),
        ("key.toml", b"name = \"x\"\nnonsense = 1\n", "nonsense"),
        ("syntax.toml", b"name = = 1\n", "syntax.toml"),
        ("missing.toml", b"name = \"x\"\n[[model]]\nfile = \"missing.obj\"\n", "missing.obj"),
    ];
    for (name, bytes, reason) in cases {
        std::fs::write(folder.path().join(name), bytes).unwrap();
        fail(folder.path(), &format!("render ./{name} {SMALL} -o a.png"), reason);
        fail(folder.path(), &format!("info ./{name}"), reason);
    }
}

#[test]
fn damaged_obj_files_are_errors_or_reported() {
    let folder = tempfile::tempdir().unwrap();
    let cases = ["v 0 0 0\nv 1 0 0\nf 1 2 9\n", "v a b c\nf 1 1 1\n", "f 1 2 3\n", "v 0 0 nan\nf 1 1 1\n"];
    for (i, text) in cases.into_iter().enumerate() {
        std::fs::write(folder.path().join("bad.obj"), text).unwrap();
        let ran =
            common::run(folder.path(), &format!("render bad.obj --width 8 --height 8 --spp 1 -o {i}.png"));
        let told = ran.stderr.contains("bad.obj")
            || ran.stderr.contains("ignored")
            || ran.stderr.contains("repaired");
        assert!(told, "{text:?}: {ran:?}");
        assert_eq!(ran.code == Some(0), folder.path().join(format!("{i}.png")).exists(), "{text:?}");
    }
}

#[test]
fn outputs_that_cannot_be_written() {
    let folder = folder_with_triangle();
    std::fs::create_dir(folder.path().join("folder.png")).unwrap();
    fail(folder.path(), &format!("render triangle.obj {SMALL} -o a.tif"), "unknown picture format");
    fail(folder.path(), &format!("render triangle.obj {SMALL} -o a"), "unknown picture format");
    fail(
        folder.path(),
        &format!("render triangle.obj {SMALL} -o missing/a.png"),
        "there is no folder missing",
    );
    fail(folder.path(), &format!("render triangle.obj {SMALL} -o folder.png"), "it is a folder");
    fail(folder.path(), "man --output triangle.obj/man", "cannot write manual pages");
}

#[test]
fn impossible_cameras() {
    let folder = folder_with_triangle();
    let cases = [
        ("--eye 1,1,1 --target 1,1,1", "same point"),
        ("--eye 1,1", "three numbers"),
        ("--eye 1,1,nan", "three numbers"),
        ("--fov 0", "above zero"),
        ("--fov 180", "between 0.01° and 179°"),
        ("--fov 361", "between 0 and 360"),
        ("--projection fisheye --fov 361", "between 0 and 360"),
        ("--projection cubemap --fov 30", "no meaning"),
        ("--projection round", "panorama, fisheye, cubemap"),
        ("--fov -20", "--fov"),
        ("--f-number 0", "above zero"),
        ("--focus -1", "--focus"),
        ("--camera nonsense", "there is no camera"),
    ];
    for (arguments, reason) in cases {
        fail(folder.path(), &format!("render triangle.obj {SMALL} {arguments} -o a.png"), reason);
    }
}

#[test]
fn values_out_of_range() {
    let folder = folder_with_triangle();
    let cases = [
        ("--spp 0", "--spp"),
        ("--width 0", "--width"),
        ("--width 70000", "--width"),
        ("--width 65536 --height 65536", "65536"),
        ("--crop 10,10,16,16", "not inside the picture"),
        ("--crop 0,0,0,4", "not inside the picture"),
        ("--crop 4294967295,0,2,2", "not inside the picture"),
        ("--crop 1,2,3", "four whole numbers"),
        ("--aov depth,nonsense", "nonsense"),
        ("--max-depth 0", "--max-depth"),
        ("--noise 0", "above zero"),
        ("--time nonsense", "duration"),
        ("--time=-1s", "--time"),
        ("--frames 5..5", "no frames"),
        ("--exposure 0", "above zero"),
        ("--tonemap nonsense", "nonsense"),
        ("--integrator nonsense", "nonsense"),
        ("--param nonsense", "NAME=VALUE"),
        ("--param a=1", "only scene files and built-in scenes take them"),
        ("--nonsense", "--nonsense"),
    ];
    for (arguments, reason) in cases {
        // The last of two values counts, so the small size comes first.
        let small = if arguments.contains("--width") || arguments.contains("--spp") { "-q" } else { SMALL };
        fail(folder.path(), &format!("render triangle.obj {small} {arguments} -o a.png"), reason);
    }
    fail(folder.path(), "render material-grid -p nonsense=1 -o a.png", "nonsense");
    fail(folder.path(), "render material-grid -p columns=100000 -o a.png", "columns");
    fail(folder.path(), "nonsense", "nonsense");
}

#[test]
fn environments_that_cannot_be_used() {
    let folder = folder_with_triangle();
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).unwrap();
    write("text.hdr", b"this is no picture");
    write("short.exr", &[0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0, 1]);
    let image = Image::from_fn(8, 4, |_, _| [1.0; 3]);
    let whole = folder.path().join("whole.exr");
    ExrFile::from_image(&image, Precision::Float).write(&whole, ExrCompression::Zip).unwrap();
    let bytes = std::fs::read(&whole).unwrap();
    write("cut.exr", &bytes[..bytes.len() * 2 / 3]);
    let render = format!("render triangle.obj {SMALL} -o a.png --environment");
    for (environment, reason) in [
        ("text.hdr", "text.hdr"),
        ("short.exr", "short.exr"),
        ("cut.exr", "cut.exr"),
        ("missing.exr", "missing.exr"),
        ("nan,0,0", "nan,0,0"),
        ("-1,0,0", "negative"),
        ("1,2", "1,2"),
    ] {
        fail(
            folder.path(),
            &format!("{render} {environment}").replace("--environment -", "--environment=-"),
            reason,
        );
    }
}

#[test]
fn environments_with_broken_pixels_are_mended_and_say_so() {
    let folder = folder_with_triangle();
    let image = Image::from_fn(8, 4, |x, _| [if x == 3 { f32::NAN } else { 1.0 }; 3]);
    let path = folder.path().join("nan.exr");
    ExrFile::from_image(&image, Precision::Float).write(&path, ExrCompression::Zip).unwrap();
    let ran = succeed(
        folder.path(),
        "render triangle.obj --environment nan.exr --width 8 --height 8 --spp 4 -o a.exr",
    );
    assert!(ran.stderr.contains("repaired"), "{}", ran.stderr);
    let picture = Image::open(folder.path().join("a.exr")).unwrap();
    assert!(picture.data().iter().all(|v| v.is_finite()));
}
