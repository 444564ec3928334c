//! What a stranger's scene may read: nothing outside its folder, by whatever name, link or loader.
//!
//! Beside the folder lies another one with files whose content is a mark of its own kind: a colour, a triangle's height, a word.
//! Each case is a scene that tries to get at one of them; neither the scene nor any message may hold the mark.
#![cfg(unix)]

use scene::{LoadError, LoadOptions, Loaded, Pixels, Shape};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// A coordinate, a channel and a word that only files outside hold.
const HEIGHT: f32 = 4321.5;
const COLOR: [u8; 3] = [201, 37, 99];
const WORD: &str = "canaryword";

/// A folder with a scene's own `inside` and a stranger's `outside`.
struct World {
    folder: tempfile::TempDir,
}

impl World {
    fn new() -> Self {
        let world = Self { folder: tempfile::tempdir().expect("a temporary folder") };
        std::fs::create_dir_all(world.inside().join("sub")).expect("inside");
        std::fs::create_dir_all(world.outside()).expect("outside");
        let outside = |name: &str, content: &[u8]| {
            std::fs::write(world.outside().join(name), content).expect("a file outside");
        };
        outside("secret.png", &png(COLOR));
        outside(
            "secret.hdr",
            b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n\xc9\x25\x63\x82\xc9\x25\x63\x82",
        );
        outside("secret.txt", format!("{WORD} {HEIGHT} `{WORD}` more\n").as_bytes());
        outside("secret.mtl", format!("newmtl m\nKd 0 0 0\n{WORD} 1\nmap_Kd {WORD}.png\n").as_bytes());
        outside("secret.obj", format!("v 0 {HEIGHT} 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\n").as_bytes());
        outside("secret.ply", ply().as_bytes());
        outside(
            "secret.pbrt",
            format!("Shape \"trianglemesh\" \"point3 P\" [0 {HEIGHT} 0 1 0 0 0 0 1]\n").as_bytes(),
        );
        outside("secret.toml", format!("{WORD} = 1\n").as_bytes());
        outside("secret.ies", ies().as_bytes());
        outside("secret.vol", &vol());
        let heights: Vec<u8> = [0.0, HEIGHT, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0f32]
            .iter()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        outside("secret.bin", &heights);
        // Links that lead out, one to a file each, to the folder, and over another link.
        for entry in std::fs::read_dir(world.outside()).expect("outside").filter_map(Result::ok) {
            let name = entry.file_name();
            let link = world
                .inside()
                .join(Path::new("link").with_extension(Path::new(&name).extension().unwrap_or_default()));
            symlink(entry.path(), &link).expect("a link");
            symlink(&link, world.inside().join(format!("twice-{}", name.to_string_lossy()))).expect("a link");
        }
        symlink(world.outside(), world.inside().join("door")).expect("a link");
        symlink("../outside", world.inside().join("near")).expect("a link");
        symlink("..", world.inside().join("sub").join("up")).expect("a link");
        world
    }

    fn inside(&self) -> PathBuf {
        self.folder.path().join("inside")
    }

    fn outside(&self) -> PathBuf {
        self.folder.path().join("outside")
    }

    /// Loads a scene of this text; only `extension` says which loader.
    fn load(&self, extension: &str, text: &str, lenient: bool) -> Result<Loaded, LoadError> {
        let path = self.inside().join(format!("scene.{extension}"));
        std::fs::write(&path, text).expect("a scene");
        scene::load::load(&path, &LoadOptions { lenient, ..LoadOptions::default() })
    }

    /// The ways to write the file `secret.EXTENSION` of the folder outside.
    fn names(&self, extension: &str) -> Vec<String> {
        let outside = self.outside().join(format!("secret.{extension}"));
        let absolute = outside.to_string_lossy().into_owned();
        vec![
            format!("../outside/secret.{extension}"),
            format!("..\\outside\\secret.{extension}"),
            format!("sub/../../outside/secret.{extension}"),
            format!("./.././outside/./secret.{extension}"),
            format!("..//outside//secret.{extension}"),
            format!("../OUTSIDE/SECRET.{extension}"),
            absolute.clone(),
            format!("/{absolute}"),
            format!("/..{absolute}"),
            format!("link.{extension}"),
            format!("LINK.{extension}"),
            format!("twice-secret.{extension}"),
            format!("door/secret.{extension}"),
            format!("near/secret.{extension}"),
            format!("door/../outside/secret.{extension}"),
            format!("sub/up/../outside/secret.{extension}"),
            format!("/proc/self/cwd/../..{absolute}"),
            format!("/proc/self/root{absolute}"),
        ]
    }

    /// Ways that only URIs have.
    fn uris(&self, extension: &str) -> Vec<String> {
        let absolute = self.outside().join(format!("secret.{extension}")).to_string_lossy().into_owned();
        let mut uris =
            self.names(extension).into_iter().map(|name| name.replace('\\', "\\\\")).collect::<Vec<_>>();
        uris.extend([
            format!("..%2foutside%2Fsecret.{extension}"),
            format!("%2e%2e/outside/secret.{extension}"),
            format!("%2e%2e%2f%6futside%2fsecret.{extension}"),
            format!("..%5coutside%5csecret.{extension}"),
            format!("%252e%252e/outside/secret.{extension}"),
            absolute.replace('/', "%2F"),
            format!("file://{absolute}"),
            format!("../outside/secret.{extension}%00.png"),
            format!("link%2e{extension}"),
        ]);
        uris
    }
}

fn png(color: [u8; 3]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let image = image::RgbImage::from_pixel(2, 2, image::Rgb(color));
    image.write_to(&mut std::io::Cursor::new(&mut bytes), image::ImageFormat::Png).expect("a picture");
    bytes
}

fn ply() -> String {
    format!(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
         element face 1\nproperty list uchar int vertex_indices\nend_header\n0 {HEIGHT} 0\n1 0 0\n0 0 1\n3 0 1 2\n"
    )
}

fn ies() -> String {
    format!("IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 2 1 1 2 0 0 0\n1 1 100\n0 90\n0\n{HEIGHT} {HEIGHT}\n")
}

fn vol() -> Vec<u8> {
    let words = [1u32, 1, 1, 1, 1].iter().flat_map(|w| w.to_le_bytes());
    let numbers = [0.0, 0.0, 0.0, 1.0, 1.0, 1.0, HEIGHT].into_iter().flat_map(f32::to_le_bytes);
    b"VOL\x03".iter().copied().chain(words).chain(numbers).collect()
}

/// Whether anything of a file outside is in what came out.
fn leak(result: &Result<Loaded, LoadError>) -> Option<String> {
    let loaded = match result {
        Err(error) => {
            let mut text = error.to_string();
            let mut source = std::error::Error::source(error);
            while let Some(error) = source {
                text += &format!(": {error}");
                source = error.source();
            }
            return text.contains(WORD).then_some(text);
        }
        Ok(loaded) => loaded,
    };
    let notes = loaded.report.notes.iter().map(|n| n.message.as_str()).collect::<Vec<_>>().join("\n");
    if notes.contains(WORD) || notes.contains("4321") {
        return Some(notes);
    }
    let scene = &loaded.scene;
    let close = |v: f32| (v - HEIGHT).abs() < 1.0;
    for image in &scene.images {
        let found = match &image.pixels {
            Pixels::Rgba8(pixels) => pixels.iter().any(|p| p[..3] == COLOR),
            floats => {
                let looks_so = |[r, g, ..]: [f32; 4]| r > 1.5 && g < r;
                (0..floats.len()).any(|i| looks_so(floats.stored(i)))
            }
        };
        if found {
            return Some(format!("the image {}", image.name));
        }
    }
    for part in scene.meshes.iter().flat_map(|mesh| &mesh.parts) {
        if let Shape::Triangles(mesh) = &part.shape
            && mesh.positions.iter().flat_map(|p| p.to_array()).any(close)
        {
            return Some(format!("geometry {:?}", mesh.positions));
        }
    }
    let lamp =
        scene.lights.iter().filter_map(|light| light.profile.as_ref()).any(|p| close(p.profile.peak()));
    let fog = scene
        .materials
        .iter()
        .filter_map(|m| m.medium.as_ref()?.density.as_ref())
        .any(|grid| close(grid.largest()));
    (lamp || fog).then(|| "a lamp or a medium".into())
}

/// A scene that names one file: the loader, and the text for the name.
type Vehicle = (&'static str, &'static str, fn(&str) -> String);

const PLAIN: [Vehicle; 11] = [
    ("obj", "mtl", |name| format!("mtllib {name}\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")),
    ("pbrt", "pbrt", |name| format!("Include \"{name}\"\n")),
    ("pbrt", "txt", |name| format!("Include \"{name}\"\n")),
    ("pbrt", "ply", |name| format!("Shape \"plymesh\" \"string filename\" \"{name}\"\n")),
    ("pbrt", "png", |name| {
        format!(
            "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"{name}\"\nMaterial \"diffuse\" \"texture \
             reflectance\" \"t\"\nShape \"sphere\"\n"
        )
    }),
    ("pbrt", "hdr", |name| format!("LightSource \"infinite\" \"string filename\" \"{name}\"\n")),
    ("toml", "obj", |name| format!("[[model]]\nfile = '{name}'\n")),
    ("toml", "toml", |name| format!("[[model]]\nfile = '{name}'\n")),
    ("toml", "png", |name| {
        format!("[[shape]]\nkind = \"quad\"\nmaterial = {{ base-color-texture = '{name}' }}\n")
    }),
    ("toml", "ies", |name| {
        format!("[[light]]\nkind = \"point\"\nposition = [0, 1, 0]\ndirection = [0, -1, 0]\nies = '{name}'\n")
    }),
    ("toml", "hdr", |name| format!("[environment]\nfile = '{name}'\n")),
];

fn gltf_buffer(uri: &str) -> String {
    format!(
        r#"{{"asset": {{"version": "2.0"}}, "scenes": [{{"nodes": [0]}}], "nodes": [{{"mesh": 0}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}}}]}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 36}}], "buffers": [{{"byteLength": 36, "uri": "{uri}"}}]}}"#
    )
}

fn gltf_image(uri: &str) -> String {
    let triangle = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
    format!(
        r#"{{"asset": {{"version": "2.0"}}, "scenes": [{{"nodes": [0]}}], "nodes": [{{"mesh": 0}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "material": 0}}]}}],
        "materials": [{{"pbrMetallicRoughness": {{"baseColorTexture": {{"index": 0}}}}}}],
        "textures": [{{"source": 0}}], "images": [{{"uri": "{uri}"}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 36}}],
        "buffers": [{{"byteLength": 36, "uri": "data:;base64,{triangle}"}}]}}"#
    )
}

fn mtl_texture(world: &World, name: &str) -> String {
    std::fs::write(world.inside().join("own.mtl"), format!("newmtl m\nKd 1 1 1\nmap_Kd {name}\n"))
        .expect("a library");
    "mtllib own.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n".into()
}

/// All scenes that try to get out, as loader and text.
fn attempts(world: &World) -> Vec<(String, &'static str, String)> {
    let mut attempts = Vec::new();
    for (loader, extension, text) in PLAIN {
        let names = world.names(extension).into_iter();
        attempts.extend(names.map(|name| (format!("{loader} → {name}"), loader, text(&name))));
    }
    for uri in world.uris("bin") {
        attempts.push((format!("gltf buffer → {uri}"), "gltf", gltf_buffer(&uri)));
    }
    for uri in world.uris("png") {
        attempts.push((format!("gltf image → {uri}"), "gltf", gltf_image(&uri)));
    }
    attempts
}

#[test]
fn nothing_outside_is_read() {
    let world = World::new();
    let mut tried = 0;
    let mut check = |label: &str, loader: &str, text: &str| {
        for lenient in [false, true] {
            tried += 1;
            let result = world.load(loader, text, lenient);
            assert_eq!(leak(&result), None, "{label}");
        }
    };
    for (label, loader, text) in attempts(&world) {
        check(&label, loader, &text);
    }
    for name in world.names("png") {
        check(&format!("mtl → {name}"), "obj", &mtl_texture(&world, &name));
    }
    assert!(tried >= 2 * 60, "{tried}");
}

/// The same scenes read what they name if the user allows it: what the test above finds missing, it would have seen.
#[test]
fn what_is_allowed_is_read() {
    let world = World::new();
    let allowed = |loader: &str, text: &str| {
        let path = world.inside().join(format!("scene.{loader}"));
        std::fs::write(&path, text).expect("a scene");
        let options = LoadOptions { allowed_paths: vec![world.outside()], ..LoadOptions::default() };
        scene::load::load(&path, &options)
    };
    let mut seen = 0;
    for (loader, extension, text) in PLAIN {
        // What is no scene, and a library without an image, leave nothing to see.
        if !matches!((loader, extension), (_, "txt" | "toml" | "mtl") | ("pbrt", "hdr")) {
            let result = allowed(loader, &text(&format!("../outside/secret.{extension}")));
            assert!(leak(&result).is_some(), "{loader} {extension}: {:?}", result.map(|l| l.report));
            seen += 1;
        }
    }
    assert!(leak(&allowed("gltf", &gltf_buffer("../outside/secret.bin"))).is_some());
    assert!(leak(&allowed("gltf", &gltf_image("%2e%2e/outside/secret.png"))).is_some());
    assert!(leak(&allowed("obj", &mtl_texture(&world, "../outside/secret.png"))).is_some());
    assert!(seen >= 6, "{seen}");
}

/// Whoever opened a scene may learn what it was refused, to allow it. That is no name that is not there, and nothing of the
/// system's.
#[test]
fn what_is_refused_is_told_to_the_caller() {
    let world = World::new();
    let refused = |uri: &str| {
        let path = world.inside().join("scene.gltf");
        std::fs::write(&path, gltf_buffer(uri)).expect("a scene");
        let options = LoadOptions::default();
        assert!(scene::load::load(&path, &options).is_err());
        options.files_refused.list()
    };
    let secret = world.outside().join("secret.bin").canonicalize().expect("it is there");
    assert_eq!(refused("../outside/secret.bin"), [secret]);
    for uri in ["../outside/absent.bin", "absent.bin", "/proc/self/environ", "../outside"] {
        assert!(refused(uri).is_empty(), "{uri}");
    }
}

/// Whoever wrote a scene must not learn whether a file exists that it may not read.
#[test]
fn missing_and_forbidden_look_the_same() {
    let world = World::new();
    let says = |loader: &str, text: &str| match world.load(loader, text, false) {
        Ok(loaded) => format!("{:?}", loaded.report.notes),
        Err(error) => format!("{error} {:?}", std::error::Error::source(&error).map(ToString::to_string)),
    };
    for (loader, extension, text) in PLAIN {
        let there = says(loader, &text(&format!("../outside/secret.{extension}")));
        let missing = says(loader, &text(&format!("../outside/absent.{extension}")));
        assert_eq!(there.replace("secret", "absent"), missing, "{loader} {extension}");
    }
    let hint = says("gltf", &gltf_buffer("../outside/secret.bin"));
    assert!(hint.contains("--allow-path"), "{hint}");
}

#[test]
fn special_files_are_not_opened() {
    let world = World::new();
    let pipe = world.inside().join("pipe.bin");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status();
    let devices =
        ["/dev/zero", "/dev/stdin", "/proc/self/environ", "/proc/self/maps", "/sys/kernel/notes", "sub", "."];
    let pipe = made.is_ok_and(|status| status.success()).then_some("pipe.bin");
    for name in devices.into_iter().chain(pipe) {
        for (loader, text) in [
            ("gltf", gltf_buffer(name)),
            ("pbrt", format!("Include \"{name}\"\n")),
            ("toml", format!("[environment]\nfile = '{name}'\n")),
        ] {
            // Also where the user allows everything: these are no files.
            let path = world.inside().join(format!("scene.{loader}"));
            std::fs::write(&path, text).expect("a scene");
            let options = LoadOptions { allowed_paths: vec!["/".into()], ..LoadOptions::default() };
            let error = scene::load::load(&path, &options).map(|_| ()).expect_err(name);
            assert!(matches!(error, LoadError::Read { .. }), "{name}: {error}");
        }
    }
}

/// A link that is swapped while scenes are loaded: either the file inside is read or nothing is.
#[test]
fn a_swapped_link_leads_nowhere() {
    let world = World::new();
    let (inside, outside) = (world.inside(), world.outside());
    std::fs::create_dir(inside.join("real")).expect("a folder");
    std::fs::write(inside.join("real").join("secret.bin"), [0u8; 36]).expect("a file");
    let (folder, spare) = (inside.join("race"), inside.join("spare"));
    let stop = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            for round in 0u32.. {
                if stop.load(Ordering::Relaxed) {
                    return;
                }
                let target = if round % 2 == 0 { inside.join("real") } else { outside.clone() };
                let _ = std::fs::remove_file(&spare);
                let _ = symlink(target, &spare).and_then(|()| std::fs::rename(&spare, &folder));
            }
        });
        let mut read = 0;
        for _ in 0..2000 {
            let result = world.load("gltf", &gltf_buffer("race/secret.bin"), false);
            assert_eq!(leak(&result), None);
            read += u32::from(result.is_ok());
        }
        stop.store(true, Ordering::Relaxed);
        assert!(read > 0, "the race was never won by the scene's own file");
    });
}

#[test]
fn names_do_not_steer_terminals() {
    let world = World::new();
    let result = world.load("toml", "[[model]]\nfile = \"a\\u001b[31mb\\n.obj\"\n", false);
    let error = result.map(|_| ()).expect_err("no such file").to_string();
    assert!(!error.contains(char::is_control), "{error:?}");
    let named = "newmtl \u{1b}[2J\nfrobnicate\u{1b}[2J 1\n";
    std::fs::write(world.inside().join("own.mtl"), named).expect("a library");
    let loaded =
        world.load("obj", "mtllib own.mtl\nusemtl \u{1b}[2Jx\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", false);
    let notes = loaded.expect("it loads").report.notes;
    assert!(!notes.is_empty() && notes.iter().all(|n| !n.message.contains(char::is_control)), "{notes:?}");
}

/// What is wrong in an included file is not quoted, what is wrong in the scene itself is.
#[test]
fn included_files_are_not_quoted() {
    let world = World::new();
    std::fs::write(world.inside().join("part.pbrt"), format!("{WORD} 1\n")).expect("a part");
    std::fs::write(world.inside().join("part.toml"), format!("{WORD} = 1\n")).expect("a part");
    for (loader, text) in [("pbrt", "Include \"part.pbrt\"\n"), ("toml", "[[model]]\nfile = 'part.toml'\n")] {
        let error = world.load(loader, text, false).map(|_| ()).expect_err("no scene").to_string();
        assert!(error.contains("part") && error.contains("line 1") && !error.contains(WORD), "{error}");
    }
    let error =
        world.load("pbrt", &format!("{WORD} 1\n"), false).map(|_| ()).expect_err("no scene").to_string();
    assert!(error.contains(WORD), "{error}");
}
