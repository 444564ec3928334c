//! Small files that ask for much: each is loaded in a process of its own with a limit on memory and time, which an abort or a
//! hang does not survive. What comes out is a scene or an error, never a dead process.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]
#![cfg(target_os = "linux")]

use scene::tables::SceneTables;
use scene::{LoadError, LoadOptions};
use std::fmt::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// What `alhazen info` allows for a small file, in bytes.
const MAX_MEMORY: u64 = 768 << 20;
/// Address space of a child in KiB: 1 GiB, beside what threads and the program itself reserve.
const ADDRESS_SPACE: u64 = (1 << 20) + (512 << 10);
/// Processor time of a child in seconds, of all its threads. Debug builds are several times slower than what users have.
const PROCESSOR_TIME: u64 = 10;
const WALL_TIME: Duration = Duration::from_secs(60);
/// Files are at most this large, bytes.
const SMALL: u64 = 1 << 20;

const CHILD: &str = "ALHAZEN_BOMB";

/// A case: its name, the scene's file name, and what writes files into a folder.
struct Bomb {
    name: String,
    scene: &'static str,
    files: Vec<(String, Vec<u8>)>,
}

fn bomb(name: impl Into<String>, scene: &'static str, text: impl Into<Vec<u8>>) -> Bomb {
    Bomb { name: name.into(), scene, files: vec![(scene.to_owned(), text.into())] }
}

impl Bomb {
    fn with(mut self, file: impl Into<String>, content: impl Into<Vec<u8>>) -> Self {
        self.files.push((file.into(), content.into()));
        self
    }
}

/// A scene file with a line for each number below `count`.
fn lines(count: usize, line: impl Fn(usize) -> String) -> String {
    (0..count).fold(String::new(), |mut text, i| {
        let _ = writeln!(text, "{}", line(i));
        text
    })
}

fn shapes() -> Vec<Bomb> {
    let mut bombs = Vec::new();
    for divisions in ["[4000, 4000]", "[8192, 1953]", "[1953, 8192]"] {
        for kind in ["terrain", "grid", "curtain"] {
            let text = format!("[[shape]]\nkind = \"{kind}\"\ndivisions = {divisions}\n");
            bombs.push(bomb(format!("{kind} {divisions}"), "scene.toml", text.clone()));
            bombs.push(bomb(format!("40 × {kind} {divisions}"), "scene.toml", text.repeat(40)));
        }
    }
    for (kind, keys) in [
        ("icosphere", "level = 10"),
        ("blob", "level = 10"),
        ("uv-sphere", "segments = 4000\nrings = 4000"),
        ("torus", "segments = 4000\nsides = 4000"),
        ("knot", "segments = 4000\nsides = 4000"),
        ("coffers", "count = [400, 400]\nsegments = 64"),
        ("column", "segments = 8192"),
    ] {
        bombs.push(bomb(kind, "scene.toml", format!("[[shape]]\nkind = \"{kind}\"\n{keys}\n")));
    }
    bombs
}

fn copies() -> Vec<Bomb> {
    let repeat =
        |count: usize| format!("repeat = {{ grid = {{ count = [{count}, 1, 1], spacing = [1, 1, 1] }} }}\n");
    let shape = |kind: &str, rest: &str| format!("[[shape]]\nkind = \"{kind}\"\n{rest}");
    let long = format!("name = \"{}\"\n", "x".repeat(20_000));
    let mut bombs = Vec::new();
    for count in [100_000, 1_000_000, 4_000_000, 4_000_000_000] {
        bombs.push(bomb(format!("{count} copies"), "scene.toml", shape("quad", &repeat(count))));
        bombs.push(bomb(
            format!("{count} names"),
            "scene.toml",
            shape("quad", &(long.clone() + &repeat(count))),
        ));
        let vary = "vary = { roughness = { from = 0.0, to = 1.0 } }\n";
        bombs.push(bomb(format!("{count} materials"), "scene.toml", shape("quad", &(repeat(count) + vary))));
        let shining = "material = { emission = [1, 1, 1] }\n";
        bombs.push(bomb(
            format!("{count} shining"),
            "scene.toml",
            shape("icosphere", &(repeat(count) + shining)),
        ));
        let lamps =
            lines(200, |_| "[[light]]\nkind = \"point\"\nposition = [0, 1, 0]\nintensity = 1.0".into());
        let model = format!("[[model]]\nfile = \"lamps.toml\"\n{}", repeat(count));
        bombs.push(bomb(format!("lamps × {count}"), "scene.toml", model).with("lamps.toml", lamps));
    }
    let mut nested =
        bomb("nested copies", "scene.toml", format!("[[model]]\nfile = \"0.toml\"\n{}", repeat(200)));
    for i in 0..6 {
        nested = nested
            .with(format!("{i}.toml"), format!("[[model]]\nfile = \"{}.toml\"\n{}", i + 1, repeat(200)));
    }
    bombs.push(nested.with("6.toml", shape("quad", "")));
    bombs
}

fn repeated_work() -> Vec<Bomb> {
    let ies = format!(
        "TILT=NONE\n1 1 1 181 361 1 1 0 0 0 1 1 1\n{}{}{}",
        lines(181, |i| i.to_string()),
        lines(361, |i| i.to_string()),
        "1\n".repeat(181 * 361)
    );
    let lamp = |_| {
        "[[light]]\nkind = \"point\"\nposition = [0, 1, 0]\ndirection = [0, -1, 0]\nies = \"a.ies\"".into()
    };
    let include = |count| "Include \"part.pbrt\"\n".repeat(count);
    let shape = "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2]\n";
    let textures = lines(5000, |i| format!("newmtl m{i}\nmap_Kd Missing{i}.png"));
    let uses = lines(5000, |i| format!("usemtl m{i}\nf 1 2 3"));
    let subsurface = |i: usize| {
        format!(
            "[materials.m{i}]\nmodel = \"dielectric\"\nbase-color = [0.5, 0.4, 0.3]\nsubsurface = {{ radius = [1, 1, 1] }}"
        )
    };
    let large: Vec<u8> = png(4096);
    let cut = |header: &[u8], count: u32, triangles: usize| {
        let mut stl = header.to_vec();
        stl.resize(80, b' ');
        stl.extend(count.to_le_bytes());
        stl.extend(std::iter::repeat_n(1u8, 50 * triangles));
        stl
    };
    vec![
        bomb("one stl again and again", "scene.toml", lines(5000, |i| format!("[[model]]\nfile = \"a.stl\"\ntranslate = [{i}, 0, 0]")))
            .with("a.stl", cut(b"solid", 20_000, 20_000)),
        bomb("stl that is cut off", "scene.stl", cut(b"solid x", 4_000_000_000, 20_000)),
        bomb("stl in words", "scene.stl", "solid\n".to_owned() + &"facet ".repeat(170_000)),
        bomb("stl of normals", "scene.stl", "facet normal 0 0 1 ".repeat(50_000)),
        bomb("one picture under many names", "scene.toml", lines(3000, |i| format!("[materials.m{i}]\nbase-color-texture = \"./{}a.png\"", "./".repeat(i % 100))))
            .with("a.png", large),
        bomb("one object again and again", "scene.pbrt", "Shape \"plymesh\" \"string filename\" \"a.ply\"\n".repeat(10_000))
            .with("a.ply", format!("ply\nformat ascii 1.0\nelement vertex 50000\nproperty float x\nproperty float y\nproperty float z\nelement face 50000\nproperty list uchar int vertex_indices\nend_header\n{}{}", "0 0 1\n".repeat(50_000), "3 0 1 2\n".repeat(50_000))),
        bomb("lamps of one profile", "scene.toml", lines(3000, lamp)).with("a.ies", ies),
        bomb(
            "an entry a line",
            "scene.toml",
            lines(15_000, |i| format!("[materials.m{i}]\nroughness = 0.5")),
        ),
        bomb("bodies of one kind", "scene.toml", lines(5000, subsurface)),
        bomb("includes", "scene.pbrt", include(4000)).with("part.pbrt", shape.repeat(3000)),
        bomb("more includes than files", "scene.pbrt", include(50_000)).with("part.pbrt", shape),
        bomb("comments", "scene.pbrt", include(4000)).with("part.pbrt", "#\n".repeat(400_000)),
        bomb("itself", "scene.pbrt", "Include \"scene.pbrt\"\n"),
        bomb("missing textures", "scene.obj", format!("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n{uses}"))
            .with("a.mtl", textures),
        bomb("missing libraries", "scene.obj", lines(20_000, |i| format!("mtllib {i} a b c d e.mtl"))),
        bomb("blocks", "scene.pbrt", "AttributeBegin\n".repeat(60_000)),
        bomb("lists", "scene.toml", format!("a = {}", "[".repeat(500_000))),
        bomb("tables", "scene.toml", format!("a = {}", "{a=".repeat(300_000))),
        bomb("keys", "scene.toml", format!("{}b = 1", "a.".repeat(400_000))),
        bomb("json lists", "scene.gltf", "[".repeat(1_000_000)),
        bomb("json objects", "scene.gltf", "{\"a\":".repeat(200_000)),
    ]
}

fn polygons() -> Vec<Bomb> {
    // A spiral's corners are hardly ever ears.
    let spiral = |corners: usize| {
        let point = |i: usize, inset: f64| {
            let t = i as f64 * 0.05;
            format!("v {:.4} {:.4} 0", (t + inset) * t.cos(), (t + inset) * t.sin())
        };
        let (out, back) = (corners / 2, corners / 2);
        lines(out, |i| point(i, 0.0)) + &lines(back, |i| point(back - i, 0.3))
    };
    let face =
        |corners: usize| format!("f{}\n", (1..=corners).fold(String::new(), |f, i| f + &format!(" {i}")));
    let mut bombs = Vec::new();
    for (corners, faces) in [(1000, 150), (5000, 15), (20_000, 1), (30_000, 1)] {
        let text = spiral(corners) + &face(corners).repeat(faces);
        bombs.push(bomb(format!("{faces} spirals of {corners}"), "scene.obj", text));
        // Nearly all edges cross.
        let mixed = |i: usize| 1 + i * 7919 % corners;
        let knot = (0..corners).fold(String::from("f"), |f, i| f + &format!(" {}", mixed(i))) + "\n";
        let text = spiral(corners) + &knot.repeat(faces);
        bombs.push(bomb(format!("{faces} knots of {corners}"), "scene.obj", text));
    }
    bombs
}

fn headers() -> Vec<Bomb> {
    let ply = |format: &str, elements: &str| format!("ply\nformat {format} 1.0\n{elements}end_header\n");
    let vertex = "element vertex 4000000000\nproperty float x\nproperty float y\nproperty float z\n";
    let face = "element vertex 0\nproperty float x\nproperty float y\nproperty float z\nelement face 4000000000\n\
                property list uint int vertex_indices\n";
    let mut stl = vec![0u8; 80];
    stl.extend(u32::MAX.to_le_bytes());
    let nothing = "element nothing 18446744073709551615\n";
    let vol: Vec<u8> = b"VOL\x03"
        .iter()
        .copied()
        .chain([1u32, 60000, 60000, 1, 1].iter().flat_map(|w| w.to_le_bytes()))
        .chain([0; 24])
        .collect();
    let fog = "[[shape]]\nkind = \"box\"\nmaterial = { model = \"boundary\", medium = { scattering = [1, 1, 1], density = \"a.vol\" } }\n";
    let picture = "[[shape]]\nkind = \"quad\"\nmaterial = { base-color-texture = \"a.png\" }\n";
    let hdr = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 60000 +X 60000\n";
    let bmp: Vec<u8> = [
        b"BM".as_slice(),
        &[0; 8],
        &54u32.to_le_bytes(),
        &40u32.to_le_bytes(),
        &60000u32.to_le_bytes(),
        &60000u32.to_le_bytes(),
        &1u16.to_le_bytes(),
        &24u16.to_le_bytes(),
        &[0; 24],
    ]
    .concat();
    vec![
        bomb("vertices in text", "scene.ply", ply("ascii", vertex)),
        bomb("vertices", "scene.ply", ply("binary_little_endian", vertex)),
        bomb("faces in text", "scene.ply", ply("ascii", face)),
        bomb("faces", "scene.ply", ply("binary_big_endian", face)),
        bomb("corners", "scene.ply", ply("ascii", &face.replace("4000000000", "1")) + "4000000000 1 2 3"),
        bomb("rows of nothing", "scene.ply", ply("ascii", nothing)),
        bomb("binary rows of nothing", "scene.ply", ply("binary_little_endian", nothing)),
        bomb("stl", "scene.stl", stl),
        bomb("grid of densities", "scene.toml", fog).with("a.vol", vol),
        bomb("hdr", "scene.toml", "[environment]\nfile = \"a.hdr\"\n").with("a.hdr", hdr),
        bomb("bmp", "scene.toml", picture).with("a.png", bmp),
    ]
}

/// A picture of one colour, which compresses well.
fn png(side: u32) -> Vec<u8> {
    let mut bytes = Vec::new();
    let image = image::GrayImage::new(side, side);
    image.write_to(&mut std::io::Cursor::new(&mut bytes), image::ImageFormat::Png).expect("a picture");
    bytes
}

fn images() -> Vec<Bomb> {
    let material = |i: usize| format!("[materials.m{i}]\nbase-color-texture = \"{i}.png\"");
    let mut bombs = Vec::new();
    for (side, count) in [(4096, 16), (4096, 60), (8192, 8)] {
        let picture = png(side);
        let mut bomb = bomb(format!("{count} images of {side}²"), "scene.toml", lines(count, material));
        for i in 0..count {
            bomb = bomb.with(format!("{i}.png"), picture.clone());
        }
        bombs.push(bomb);
    }
    bombs
}

fn gltf() -> Vec<Bomb> {
    let document = |rest: &str| format!(r#"{{"asset":{{"version":"2.0"}},"scene":0,{rest}}}"#);
    let list = |count: usize, item: &dyn Fn(usize) -> String| {
        format!("[{}]", (0..count).map(item).collect::<Vec<_>>().join(","))
    };
    let mesh = |count: u64| {
        format!(
            r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
            "accessors":[{{"componentType":5126,"count":{count},"type":"VEC3"}}]"#
        )
    };
    let one = r#""scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"#;
    let mut bombs = Vec::new();
    for count in [3_000_000, 30_000_000, 300_000_000, 4_294_967_295, 1 << 60] {
        bombs.push(bomb(format!("{count} zeros"), "scene.gltf", document(&(one.to_owned() + &mesh(count)))));
    }
    let primitives = list(5000, &|_| r#"{"attributes":{"POSITION":0}}"#.into());
    let many = format!(
        r#"{one}"meshes":[{{"primitives":{primitives}}}],"accessors":[{{"componentType":5126,"count":300000,"type":"VEC3"}}]"#
    );
    bombs.push(bomb("primitives of one accessor", "scene.gltf", document(&many)));
    let nodes = list(40_000, &|_| r#"{"mesh":0}"#.into());
    let roots = list(40_000, &|i| i.to_string());
    let placed = format!(r#""scenes":[{{"nodes":{roots}}}],"nodes":{nodes},"#);
    bombs.push(bomb("nodes", "scene.gltf", document(&(placed.clone() + &mesh(300)))));
    let weights = list(60_000, &|_| "0.5".into());
    let heavy = mesh(3).replace(r#""primitives""#, &format!(r#""weights":{weights},"primitives""#));
    bombs.push(bomb("weights of nodes", "scene.gltf", document(&(placed + &heavy))));
    let name = "n".repeat(200_000);
    let instancing = format!(
        r#""extensionsUsed":["EXT_mesh_gpu_instancing"],"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0,"name":"{name}",
        "extensions":{{"EXT_mesh_gpu_instancing":{{"attributes":{{"TRANSLATION":1}}}}}}}}],{}"#,
        mesh(3).replace(r#""accessors":["#, r#""accessors":[{"componentType":5126,"count":3,"type":"VEC3"},{"componentType":5126,"count":500000,"type":"VEC3"},"#)
    );
    bombs.push(bomb("instances with a long name", "scene.gltf", document(&instancing)));
    let chain =
        list(50_000, &|i| if i < 49_999 { format!(r#"{{"children":[{}]}}"#, i + 1) } else { "{}".into() });
    bombs.push(bomb(
        "a chain of nodes",
        "scene.gltf",
        document(&format!(r#""scenes":[{{"nodes":[0]}}],"nodes":{chain}"#)),
    ));
    let buffer = format!(
        r#"{one}{},"bufferViews":[{{"buffer":0,"byteLength":1000000000000}}],"buffers":[{{"byteLength":1000000000000}}]"#,
        mesh(3).replace(r#""count""#, r#""bufferView":0,"count""#)
    );
    bombs.push(bomb("a buffer", "scene.gltf", document(&buffer)));
    bombs
}

/// Shapes that are small in the file and many, and what is made for the triangles of a large one.
fn many_shapes() -> Vec<Bomb> {
    let many = |kind: &str, count: usize, keys: &str| {
        let shape = format!("[[shape]]\nkind = \"{kind}\"\n{keys}\n");
        bomb(format!("{count} × {kind} {keys}"), "scene.toml", shape.repeat(count))
    };
    let path = (0..2000).fold(String::new(), |path, i| path + &format!("[{i}, {}, 0], ", i % 2));
    let terrain = "[[shape]]\nkind = \"terrain\"\ndivisions = [1400, 1400]\n";
    let tangents = format!("{terrain}material = {{ anisotropy = 0.5, metallic = 1 }}\n");
    let model = "[[model]]\nfile = \"a.toml\"\nmaterial = { anisotropy = 0.5, metallic = 1 }\n";
    let wide = "[[shape]]\nkind = \"terrain\"\ndivisions = [800, 800]\nmaterial = { anisotropy = 1, metallic = 1 }\n";
    vec![
        many("icosphere", 1500, "level = 5"),
        many("icosphere", 300, "level = 6"),
        many("blob", 60, "level = 7"),
        many("box", 1200, "bevel = 0.1\nsegments = 64"),
        many("cylinder", 400, "segments = 8192"),
        many("tube", 8, &format!("sides = 1024\npath = [{path}]")),
        many("column", 100, "segments = 8192"),
        bomb("tangents of a terrain", "scene.toml", tangents),
        bomb("tangents of terrains", "scene.toml", wide.repeat(30)),
        bomb("tangents of a model", "scene.toml", model).with("a.toml", terrain),
    ]
}

/// Text that stands once in a file and many times in the scene.
fn long_texts() -> Vec<Bomb> {
    let parameter = |length: usize| format!("[parameters]\na = \"{}\"\n", "x".repeat(length));
    let named = |i: usize| format!("[materials.m{i}]\nname = \"${{a}}\"");
    let with = |i: usize| format!("[[model]]\nfile = \"a.toml\"\nparameters = {{ a = {i} }}");
    let materials = |i: usize| format!("[materials.m{i}]\nroughness = 0.5\nname = \"{}\"", "n".repeat(300));
    let sphere = "[[shape]]\nkind = \"icosphere\"\nlevel = 5\n";
    let node = |what: &str| format!("[{}]", vec![what; 8_000].join(","));
    let gltf = |what: &str, rest: &str| {
        let roots = (0..8_000).map(|i| i.to_string()).collect::<Vec<_>>().join(",");
        let nodes = node(what);
        format!(
            r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[{roots}]}}],"nodes":{nodes},{rest}}}"#
        )
    };
    let name = "n".repeat(300_000);
    let cameras = format!(
        r#""cameras":[{{"type":"perspective","name":"{name}","perspective":{{"yfov":1,"znear":1}}}}]"#
    );
    let lights = format!(
        r#""extensions":{{"KHR_lights_punctual":{{"lights":[{{"type":"point","name":"{name}"}}]}}}}"#
    );
    let meshes = format!(
        r#""meshes":[{{"name":"{name}","primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
        "accessors":[{{"componentType":5126,"count":3,"type":"VEC3"}}]"#
    );
    let faces = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[],"extensions":{"EXT_lights_image_based":{"light":0}}}],
        "extensions":{"EXT_lights_image_based":{"lights":[{"specularImages":[[0,0,0,0,0,0]],"specularImageSize":8192,
        "irradianceCoefficients":[]}]}},"images":[{"uri":"a.png"}]}"#;
    vec![
        bomb("a long name for each material", "scene.toml", parameter(100_000) + &lines(20_000, named)),
        bomb(
            "a text of texts",
            "scene.toml",
            format!("{}[materials.m]\nname = \"{}\"\n", parameter(50_000), "${a}".repeat(50_000)),
        ),
        bomb("materials of other parameters", "scene.toml", lines(1500, with))
            .with("a.toml", "[parameters]\na = 0\n".to_owned() + &lines(1000, materials)),
        bomb("shapes of other parameters", "scene.toml", lines(3000, with))
            .with("a.toml", format!("[parameters]\na = 0\n{sphere}")),
        bomb("cameras with a long name", "scene.gltf", gltf(r#"{"camera":0}"#, &cameras)),
        bomb(
            "lights with a long name",
            "scene.gltf",
            gltf(r#"{"extensions":{"KHR_lights_punctual":{"light":0}}}"#, &lights),
        ),
        bomb("meshes with a long name", "scene.gltf", gltf(r#"{"mesh":0}"#, &meshes)),
        bomb("six faces of one picture", "scene.gltf", faces).with("a.png", png(8192)),
        bomb("channels", "scene.toml", "[environment]\nfile = \"a.exr\"\n").with("a.exr", channels(20_000)),
    ]
}

/// Textures that consist of textures.
fn graphs() -> Vec<Bomb> {
    let chain = lines(12_000, |i| format!("[textures.t{i}]\nnode = \"invert\"\ninput = \"t{}\"", i + 1));
    let doubled =
        lines(500, |i| format!("[textures.t{i}]\nnode = \"add\"\na = \"t{0}\"\nb = \"t{0}\"", i + 1));
    let circle =
        lines(500, |i| format!("[textures.t{i}]\nnode = \"invert\"\ninput = \"t{}\"", (i + 1) % 500));
    let ramp = format!(
        "[textures.t]\nnode = \"ramp\"\ninput = 0.5\nstops = [{}]\n",
        (0..60_000).map(|i| format!("[{i},0],")).collect::<String>()
    );
    let node = "{ node = \"noise\", octaves = 16 }";
    let many = lines(8_000, |i| format!("[materials.m{i}]\nbase-color = {node}\nroughness = {node}"));
    [("chain", chain), ("doubled", doubled), ("circle", circle), ("ramp", ramp), ("many graphs", many)]
        .map(|(name, text)| bomb(format!("textures: {name}"), "scene.toml", text))
        .into()
}

/// An EXR file of 16×16 pixels with so many layers of one channel.
fn channels(count: usize) -> Vec<u8> {
    let layer = |i: usize| film::ExrChannel {
        name: format!("c{i:05}.R"),
        samples: film::ExrSamples::Half(vec![0.0; 256]),
    };
    let mut file = film::ExrFile::new(16, 16, film::Rect { x: 0, y: 0, width: 16, height: 16 });
    file.channels = (0..count).map(layer).collect();
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.exr");
    file.write(&path, film::ExrCompression::Zip).expect("written");
    std::fs::read(path).expect("read")
}

fn all() -> Vec<Bomb> {
    [
        shapes(),
        copies(),
        repeated_work(),
        polygons(),
        headers(),
        images(),
        gltf(),
        many_shapes(),
        long_texts(),
        graphs(),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// What a child does: loads as `alhazen info` would.
#[test]
fn child() {
    let Ok(scene) = std::env::var(CHILD) else { return };
    let options = LoadOptions { max_memory: MAX_MEMORY, ..LoadOptions::default() };
    match scene::load::load(Path::new(&scene), &options) {
        Ok(loaded) => {
            let tables = SceneTables::build(&loaded.scene);
            println!("loaded {} instances, {} lights", loaded.scene.instances.len(), tables.lights.len());
        }
        Err(error) => {
            let over = matches!(error, LoadError::OverBudget { .. });
            println!(
                "refused{} {}",
                if over { " (memory)" } else { "" },
                error.to_string().chars().take(200).collect::<String>()
            );
        }
    }
    println!("survived");
}

#[test]
fn no_small_file_takes_much() {
    let bombs = all();
    assert!(bombs.len() >= 60, "{}", bombs.len());
    let (mut failed, mut over) = (Vec::new(), 0);
    for bomb in bombs {
        let folder = tempfile::tempdir().expect("a folder");
        for (name, content) in &bomb.files {
            assert!(content.len() as u64 <= SMALL, "{}: {} bytes", bomb.name, content.len());
            std::fs::write(folder.path().join(name), content).expect("a file");
        }
        let began = Instant::now();
        let output = run(&folder.path().join(bomb.scene));
        let seconds = began.elapsed().as_secs_f32();
        let said = output.lines().find(|l| l.contains("loaded") || l.contains("refused")).unwrap_or("died");
        println!("{seconds:6.2} s  {}: {said}", bomb.name);
        assert!(!said.contains("unknown field"), "{}: the row tests nothing: {said}", bomb.name);
        over += u32::from(output.contains("--max-memory"));
        if !output.contains("survived") {
            failed.push(format!("{}: {}", bomb.name, output.chars().take(400).collect::<String>()));
        }
    }
    assert!(failed.is_empty(), "{} died:\n{}", failed.len(), failed.join("\n"));
    assert!(over >= 10, "the budget refuses the worst: {over}");
}

/// What the child said, on both streams.
fn run(scene: &Path) -> String {
    let program = std::env::current_exe().expect("this program");
    let shell = format!("ulimit -v {ADDRESS_SPACE}; ulimit -t {PROCESSOR_TIME}; exec \"$0\" \"$@\" 2>&1");
    let mut child = Command::new("sh")
        .args(["-c", &shell])
        .arg(program)
        .args(["--exact", "child", "--nocapture", "--test-threads=1"])
        .env(CHILD, scene)
        .env("RAYON_NUM_THREADS", "2")
        .stdout(Stdio::piped())
        .spawn()
        .expect("a shell");
    let began = Instant::now();
    while child.try_wait().expect("a child").is_none() {
        if began.elapsed() > WALL_TIME {
            let _ = child.kill();
            break;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    let output = child.wait_with_output().expect("its output");
    String::from_utf8_lossy(&output.stdout).into_owned()
}
