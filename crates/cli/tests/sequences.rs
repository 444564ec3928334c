//! Pictures of scenes that move, turntables and videos, and how pictures are stored.

mod common;

use alhazen::Image;
use base64::Engine as _;
use common::{fail, folder_with_triangle, names, succeed};
use film::{ExrFile, ExrSamples};
use std::path::Path;

const VIEW: &str = "--eye 0,0,6 --target 0,0,0 --environment 1,1,1 --width 24 --height 16 --spp 4 -q";

/// A triangle that moves by 4 m to the right within two seconds.
fn write_moving(folder: &Path) {
    let numbers: [f32; 17] = [
        -1.0, -1.0, 0.0, 1.0, -1.0, 0.0, 0.0, 1.0, 0.0, // corners
        0.0, 2.0, // times
        0.0, 0.0, 0.0, 4.0, 0.0, 0.0, // translations
    ];
    let bytes: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
    let data = base64::engine::general_purpose::STANDARD.encode(&bytes);
    let accessor = |view: u32, count: u32, kind: &str| serde_json::json!({"bufferView": view, "componentType": 5126, "count": count, "type": kind});
    let view = |offset: u32, length: u32| serde_json::json!({"buffer": 0, "byteOffset": offset, "byteLength": length});
    let json = serde_json::json!({
        "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [accessor(0, 3, "VEC3"), accessor(1, 2, "SCALAR"), accessor(2, 2, "VEC3")],
        "bufferViews": [view(0, 36), view(36, 8), view(44, 24)],
        "buffers": [{"byteLength": 68, "uri": format!("data:application/octet-stream;base64,{data}")}],
        "animations": [{"name": "Slide", "samplers": [{"input": 1, "output": 2}],
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}]}],
    });
    std::fs::write(folder.join("moving.gltf"), json.to_string()).unwrap();
}

fn picture(folder: &Path, name: &str) -> Image {
    Image::open(folder.join(name)).unwrap()
}

#[test]
fn frames_and_moments_are_on_one_clock() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_moving(folder);
    succeed(folder, &format!("render moving.gltf {VIEW} --frames 0..3 --fps 1 -o frame.exr"));
    assert_eq!(names(folder), ["frame.0000.exr", "frame.0001.exr", "frame.0002.exr", "moving.gltf"]);
    for (frame, at) in [("frame.0000.exr", "0"), ("frame.0001.exr", "1"), ("frame.0002.exr", "99")] {
        succeed(folder, &format!("render moving.gltf {VIEW} --at {at} -o still.exr"));
        assert!(picture(folder, frame).data() == picture(folder, "still.exr").data(), "{frame}");
    }
    succeed(folder, &format!("render moving.gltf {VIEW} --animation Slide --repeat --at 3 -o still.exr"));
    assert!(picture(folder, "frame.0001.exr").data() == picture(folder, "still.exr").data());
    let [first, second] = ["frame.0000.exr", "frame.0001.exr"].map(|name| picture(folder, name));
    assert_ne!(first.rgb(12, 8), [1.0; 3], "the triangle is in the middle");
    assert_eq!(second.rgb(12, 8), [1.0; 3], "and then it is not");
    fail(
        folder,
        &format!("render moving.gltf {VIEW} --animation Jump -o no.png"),
        "the scene has [\"Slide\"]",
    );
}

/// Without a camera of its own: what a moment shows is what the frame of that moment shows, and all of the way is in the picture.
#[test]
fn moments_are_framed_as_sequences_are() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_moving(folder);
    const VIEW: &str = "--environment 0.5,0.5,0.5 --width 48 --height 48 --spp 4 -q --aov depth";
    succeed(folder, &format!("render moving.gltf {VIEW} --frames 0..3 --fps 1 -o frame.exr"));
    // A sequence that begins later has the same camera.
    succeed(folder, &format!("render moving.gltf {VIEW} --frames 1..3 --fps 1 -o later.exr"));
    let mut centers = Vec::new();
    for (i, at) in [(0, "0"), (1, "1"), (2, "2")] {
        succeed(folder, &format!("render moving.gltf {VIEW} --at {at} -o still.exr"));
        let file = |name: &str| ExrFile::read(&folder.join(name)).unwrap();
        let depth = |name: &str| file(name).layer("depth").expect("a layer").data().to_vec();
        let frame = depth(&format!("frame.000{i}.exr"));
        assert!(frame == depth("still.exr"), "frame {i}");
        if i > 0 {
            assert!(frame == depth(&format!("later.000{i}.exr")), "frame {i}");
        }
        let seen: Vec<_> = (0..48 * 48).filter(|p| frame[*p] > 0.0).map(|p| (p % 48, p / 48)).collect();
        let at_side = |(x, y): &(usize, usize)| *x == 0 || *x == 47 || *y == 0 || *y == 47;
        assert!(!seen.is_empty() && !seen.iter().any(at_side), "frame {i}: all of it is in the picture");
        centers.push(seen.iter().map(|(x, _)| *x as f64).sum::<f64>() / seen.len() as f64);
    }
    assert!(
        centers[1] > centers[0] + 8.0 && centers[2] > centers[1] + 8.0,
        "it goes to the right: {centers:?}"
    );
}

#[test]
fn sequences_that_do_not_move_say_so() {
    let folder = folder_with_triangle();
    let folder = folder.path();
    write_moving(folder);
    const SMALL: &str = "--width 8 --height 8 --spp 1 -q -o frame.png";
    let said = |arguments: &str| succeed(folder, &format!("render {arguments} {SMALL}")).stderr;
    let still = said("triangle.obj --frames 0..2");
    assert!(still.contains("all 2 pictures will be equal") && still.contains("--turntable"), "{still}");
    let over = said("moving.gltf --frames 48..50");
    assert!(over.contains("over after 2 s, before frame 48") && over.contains("--repeat"), "{over}");
    for moves in [
        "triangle.obj --frames 0..1",
        "triangle.obj --frames 0..2 --turntable 2",
        "moving.gltf --frames 0..2",
        "moving.gltf --frames 48..50 --repeat",
        "three-spheres --frames 0..2",
    ] {
        assert!(!said(moves).contains("equal"), "{moves}");
    }
}

#[test]
fn a_turntable_goes_around_the_target() {
    let folder = folder_with_triangle();
    let folder = folder.path();
    succeed(folder, &format!("render triangle.obj {VIEW} --turntable 1 --fps 4 -o turn.exr"));
    succeed(folder, &format!("render triangle.obj {VIEW} -o still.exr"));
    let frames = [0, 1, 2, 3].map(|i| picture(folder, &format!("turn.000{i}.exr")));
    assert_eq!(names(folder).iter().filter(|n| n.starts_with("turn")).count(), 4);
    let still = picture(folder, "still.exr");
    let difference = |a: &Image, b: &Image| -> f32 {
        a.data().iter().zip(b.data()).map(|(a, b)| (a - b).abs()).sum::<f32>() / a.data().len() as f32
    };
    assert!(difference(&frames[0], &still) < 0.02, "{}", difference(&frames[0], &still));
    assert!(difference(&frames[1], &still) > 0.1, "a triangle seen from its edge is not there");
}

#[test]
fn precision_and_compression_are_chosen() {
    let folder = folder_with_triangle();
    let folder = folder.path();
    let render = |options: &str, name: &str| {
        succeed(folder, &format!("render triangle.obj {VIEW} {options} -o {name}"));
        std::fs::read(folder.join(name)).unwrap()
    };
    let plain = render("", "plain.exr");
    let half = render("--exr-precision half", "half.exr");
    let raw = render("--exr-compression none", "raw.exr");
    let piz = render("--exr-compression piz", "piz.exr");
    assert!(plain != piz && raw.len() > plain.len(), "{} and {} bytes", raw.len(), plain.len());
    assert!(plain.len() != half.len());
    let samples = |name: &str| ExrFile::read(&folder.join(name)).unwrap().channels[0].samples.clone();
    assert!(matches!(samples("plain.exr"), ExrSamples::Float(_)));
    assert!(matches!(samples("half.exr"), ExrSamples::Half(_)));
    assert!(picture(folder, "plain.exr").data() == picture(folder, "piz.exr").data());
    render("--png-bits 16", "deep.png");
    render("", "plain.png");
    let distinct = |name: &str| {
        let mut values: Vec<u32> = picture(folder, name).data().iter().map(|v| v.to_bits()).collect();
        values.sort_unstable();
        values.dedup();
        values.len()
    };
    assert!(distinct("deep.png") >= distinct("plain.png"));
    // The type of a PNG's samples is in its header.
    assert_eq!(std::fs::read(folder.join("deep.png")).unwrap()[24], 16);
    assert_eq!(std::fs::read(folder.join("plain.png")).unwrap()[24], 8);
}

#[test]
fn a_video_needs_a_sequence() {
    let folder = folder_with_triangle();
    fail(
        folder.path(),
        &format!("render triangle.obj {VIEW} -o a.mp4"),
        "a video needs --frames or --turntable",
    );
}

/// A program in ffmpeg's place shows what it would be given.
#[cfg(unix)]
#[test]
fn videos_are_made_of_all_frames() {
    use std::os::unix::fs::PermissionsExt as _;
    let folder = folder_with_triangle();
    let folder = folder.path();
    let tools = folder.join("tools");
    std::fs::create_dir(&tools).unwrap();
    let script = "#!/bin/sh\nfor last; do :; done\nfor frame in \"${last%/*}\"/*.png; do echo \"${frame##*/} $*\"; done > \"$last\"\n";
    std::fs::write(tools.join("ffmpeg"), script).unwrap();
    std::fs::set_permissions(tools.join("ffmpeg"), std::fs::Permissions::from_mode(0o755)).unwrap();
    let run = |path: &Path| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_alhazen"));
        let arguments = format!("render triangle.obj {VIEW} --frames 3..5 --fps 12 -o turn.mp4 -o frame.png");
        command.args(arguments.split_whitespace()).current_dir(folder).env("PATH", path);
        command.output().unwrap()
    };
    let missing = run(Path::new("/nowhere"));
    assert!(!missing.status.success());
    assert!(String::from_utf8_lossy(&missing.stderr).contains("needs ffmpeg"), "{missing:?}");
    let made = run(&tools);
    assert!(made.status.success(), "{made:?}");
    let video = std::fs::read_to_string(folder.join("turn.mp4")).unwrap();
    let lines: Vec<_> = video.lines().collect();
    assert_eq!(lines.len(), 2, "{video}");
    assert!(lines[0].starts_with("00000003.png") && lines[1].starts_with("00000004.png"), "{video}");
    assert!(lines[0].contains("-framerate 12") && lines[0].contains("-start_number 3"), "{video}");
    assert!(folder.join("frame.0003.png").is_file() && folder.join("frame.0004.png").is_file());
}

/// Frames are denoised with those before: the first as if alone, the second not. Each keeps its own noisy picture, which has noise
/// of its own.
#[test]
fn denoised_sequences_have_a_history() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_moving(folder);
    const VIEW: &str =
        "--eye 0,0,6 --target 0,0,0 --environment 1,1,1 --width 48 --height 32 --spp 4 --denoise";
    let run = |options: &str, name: &str| {
        succeed(
            folder,
            &format!("render moving.gltf {VIEW} --frames 0..2 --fps 8 {options} -q -o {name}.exr"),
        );
        [0, 1].map(|frame| ExrFile::read(&folder.join(format!("{name}.000{frame}.exr"))).unwrap())
    };
    let together = run("--seed 3", "together");
    let alone = run("--seed 3 --frames-alone", "alone");
    let colour = |file: &ExrFile| file.colours("").expect("a picture").data().to_vec();
    let noisy = |file: &ExrFile| file.colours("noisy").expect("a layer").data().to_vec();
    assert!(noisy(&together[0]) == noisy(&alone[0]));
    assert!(colour(&together[0]) == colour(&alone[0]), "the first frame has no history");
    assert!(noisy(&together[1]) != noisy(&alone[1]), "each frame has noise of its own");
    let seed = &together[1].metadata["seed"];
    assert_ne!(seed, "3");
    succeed(folder, &format!("render moving.gltf {VIEW} --at 0.125 --seed {seed} -q -o still.exr"));
    let still = ExrFile::read(&folder.join("still.exr")).unwrap();
    assert!(noisy(&together[1]) == noisy(&still), "the frame's own noisy picture is kept as it was");
    assert!(colour(&together[1]) != colour(&still), "the second frame has a history");
    assert!(together[1].layer("position").is_some());
}
