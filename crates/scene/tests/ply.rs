//! PLY files from the wild, and files made to break the loader.

mod common;

use common::{Limits, files, load_within, mesh};
use glam::{Vec2, Vec3, Vec4, vec2, vec3};
use proptest::prelude::*;
use scene::load::ply;
use scene::{LoadError, LoadOptions, Loaded, TriangleMesh};

fn parse(bytes: &[u8]) -> Result<Loaded, LoadError> {
    ply::parse(bytes, &LoadOptions::default())
}

fn only_mesh(loaded: &Loaded) -> &TriangleMesh {
    assert_eq!(loaded.scene.meshes.len(), 1);
    mesh(&loaded.scene.meshes[0].parts[0])
}

fn note(loaded: &Loaded, text: &str) -> bool {
    loaded.report.notes.iter().any(|n| n.message.contains(text))
}

#[test]
fn every_shared_file_loads_or_says_why() {
    let Some(shared) = testkit::require_shared("every_shared_file_loads_or_says_why") else { return };
    let folders = ["torture_assimp_ply", "spaceship", "reference_ignis"];
    let (mut count, mut triangles, mut spaceship) = (0, 0, 0);
    for folder in folders {
        for file in files(&shared.join("scenes").join(folder), "ply") {
            let loaded =
                load_within(&file, Limits::default()).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
            common::check(&loaded.scene);
            count += 1;
            spaceship += usize::from(folder == "spaceship");
            triangles += if folder == "spaceship" { loaded.scene.unique_triangles() } else { 0 };
        }
    }
    assert!(count >= 93, "only {count} files were found");
    assert_eq!(spaceship, 87);
    assert!(triangles >= 318_558, "{triangles}");
}

#[test]
fn counts_of_known_files() {
    let Some(shared) = testkit::require_shared("counts_of_known_files") else { return };
    for (name, triangles, normals, uvs, colors) in [
        ("Wuson.ply", 3_732, true, true, false),
        ("cube.ply", 12, true, false, false),
        ("cube_binary.ply", 12, true, false, false),
        ("cube_uv.ply", 12, true, true, false),
        ("float-color.ply", 1, true, false, true),
    ] {
        let path = shared.join("scenes/torture_assimp_ply").join(name);
        let loaded = load_within(&path, Limits::default()).unwrap();
        let mesh = only_mesh(&loaded);
        let has = (!mesh.normals.is_empty(), !mesh.uv0.is_empty(), !mesh.colors.is_empty());
        assert_eq!((mesh.indices.len(), has), (triangles, (normals, uvs, colors)), "{name}");
    }
    let points =
        load_within(&shared.join("scenes/torture_assimp_ply/points.ply"), Limits::default()).unwrap();
    assert!(points.scene.meshes.is_empty() && note(&points, "point cloud"));
}

/// A triangle with every kind of property, in an order that nobody uses.
fn header(format: &str) -> String {
    format!(
        "ply\nformat {format} 1.0\ncomment made by hand\nelement camera 1\nproperty list uchar short k\nproperty double d\n\
         element vertex 3\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nproperty double z\n\
         property float y\nproperty short x\nproperty list ushort float skipped\nproperty float u\nproperty float v\n\
         element face 1\nproperty char flags\nproperty list int ushort vertex_index\nend_header\n"
    )
}

fn binary(big: bool) -> Vec<u8> {
    macro_rules! put {
        ($out:expr, $value:expr) => {
            $out.extend(if big { $value.to_be_bytes().to_vec() } else { $value.to_le_bytes().to_vec() })
        };
    }
    let mut out = header(if big { "binary_big_endian" } else { "binary_little_endian" }).into_bytes();
    out.push(2);
    put!(out, 7i16);
    put!(out, 8i16);
    put!(out, 1.5f64);
    for (x, y) in [(0i16, 0f32), (-2, 0.0), (0, 0.5)] {
        out.extend([255, 188, 0]);
        put!(out, 0.25f64);
        put!(out, y);
        put!(out, x);
        put!(out, 1u16);
        put!(out, 9f32);
        put!(out, 0.25f32);
        put!(out, 0.25f32);
    }
    out.push(1);
    put!(out, 3i32);
    for index in [0u16, 2, 1] {
        put!(out, index);
    }
    out
}

fn ascii() -> Vec<u8> {
    let data = "2 7 8 1.5\n255 188 0 0.25 0 0 1 9 .25 .25\n255 188 0 2.5e-1 0 -2 1 9 .25 .25\n\
                255 188 0 +0.25 0.5 0 1 9 .25 .25 1 3\n0 2 1";
    [header("ascii").as_bytes(), data.as_bytes()].concat()
}

#[test]
fn all_formats_hold_the_same() {
    for bytes in [ascii(), binary(false), binary(true)] {
        let loaded = parse(&bytes).unwrap();
        let mesh = only_mesh(&loaded);
        assert_eq!(mesh.positions, [vec3(0.0, 0.0, 0.25), vec3(-2.0, 0.0, 0.25), vec3(0.0, 0.5, 0.25)]);
        assert_eq!(mesh.uv0, [vec2(0.25, 0.75); 3]);
        assert_eq!(mesh.indices, [[0, 2, 1]]);
        assert!(mesh.colors.iter().all(|c| c.distance(Vec4::new(1.0, 0.5028865, 0.0, 1.0)) < 1e-5));
        assert!(mesh.normals.iter().all(|n| n.distance(Vec3::Z) < 1e-6));
        assert!(note(&loaded, "element camera") && note(&loaded, "property skipped of element vertex"));
        assert_eq!(loaded.report.notes.len(), 3);
    }
}

#[test]
fn every_truncation_is_a_clear_error() {
    for bytes in [binary(false), ascii()] {
        let data = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
        for length in 0..bytes.len() {
            match parse(&bytes[..length]) {
                Err(LoadError::Malformed { object, message, .. }) => {
                    assert!(!object.is_empty() && !message.is_empty())
                }
                Err(other) => panic!("{other}"),
                Ok(_) => {
                    assert!(length > data && bytes.len() - length < 2, "{length} of {} bytes", bytes.len())
                }
            }
        }
    }
}

#[test]
fn lying_counts_are_refused_before_allocation() {
    let vertices = "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\nproperty float z\nend_header\n0123";
    let error = parse(vertices.as_bytes()).unwrap_err().to_string();
    assert!(error.contains("element vertex: 4000000000 rows need at least 48000000000 bytes"), "{error}");

    let list = b"ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty uchar x\nproperty uchar y\nproperty uchar z\nelement face 1\nproperty list uint uint vertex_indices\nend_header\n000\xff\xff\xff\xff\0\0\0\0";
    let error = parse(list).unwrap_err().to_string();
    assert!(error.ends_with("element face: the file ends in row 0 of 1"), "{error}");
}

fn small(elements: &str, data: &str) -> Loaded {
    let text = format!(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n{elements}end_header\n\
         0 0 0 1 0 0 1 1 0 0 1 0\n{data}\n"
    );
    parse(text.as_bytes()).unwrap()
}

#[test]
fn polygons_strips_and_bad_faces() {
    let faces = "element face 4\nproperty list uchar int vertex_indices\n";
    let loaded = small(faces, "4 0 1 2 3\n2 0 1\n3 0 1 9\n3 0 -1 2");
    assert_eq!(only_mesh(&loaded).indices.len(), 2);
    assert!(note(&loaded, "2 faces refer to vertices that do not exist (4 do)"));
    assert!(note(&loaded, "1 faces have fewer than three corners"));

    let strips = small("element tristrips 1\nproperty list int int vertex_indices\n", "8 0 1 3 2 -1 1 2 3");
    assert_eq!(only_mesh(&strips).indices, [[0, 1, 3], [3, 1, 2], [1, 2, 3]]);
}

#[test]
fn texture_coordinates_of_corners_split_vertices() {
    let faces =
        "element face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\n";
    let loaded = small(faces, "3 0 1 2 6 0 0 1 0 1 1\n3 0 2 3 6 0 0 0.5 0.5 0 1");
    let mesh = only_mesh(&loaded);
    assert_eq!(mesh.indices, [[0, 1, 2], [0, 4, 3]]);
    assert_eq!(mesh.uv0, [vec2(0.0, 1.0), Vec2::ONE, vec2(1.0, 0.0), Vec2::ZERO, vec2(0.5, 0.5)]);
    assert_eq!(mesh.positions[4], mesh.positions[2]);
}

#[test]
fn faces_may_come_before_vertices() {
    let text = "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nend_header\n3 0 1 2\n0 0 0 1 0 0 nan 1 0";
    let loaded = parse(text.as_bytes()).unwrap();
    assert_eq!(only_mesh(&loaded).positions[2], Vec3::Y);
    assert!(note(&loaded, "1 numbers that are not finite were set to 0"));
}

proptest! {
    #[test]
    fn random_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = parse(&bytes);
        let _ = parse(&[b"ply\nformat binary_little_endian 1.0\n", &bytes[..]].concat());
    }

    #[test]
    fn damaged_files_never_panic(which in 0usize..3, edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..5)) {
        let mut bytes = [ascii(), binary(false), binary(true)][which].clone();
        for (at, value) in edits {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        if let Ok(loaded) = parse(&bytes) {
            common::check(&loaded.scene);
        }
    }
}

/// Two triangles, with `vertex` and `face` behind their rows and `end` behind the last.
fn square(vertex: &str, face: &str, end: &str) -> String {
    format!(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 2\n\
         property list uchar int vertex_indices\nend_header\n0 0 0{vertex}\n1 0 0{vertex}\n1 1 0{vertex}\n0 1 0{vertex}\n\
         3 0 1 2{face}\n3 0 2 3{face}\n{end}"
    )
}

#[test]
fn numbers_that_are_too_many_shift_nothing() {
    let load = |text: &str| ply::parse(text.as_bytes(), &LoadOptions::default());
    for (vertex, face, end, said) in [
        ("", "", "", ""),
        ("", " 0 0", "", "2 lines have more numbers than declared, the first is line 14"),
        (" 7", "", "", "4 lines have more numbers than declared, the first is line 10"),
        (" 7", " 1", "1 2 3\n\n4\n", "2 lines are left over"),
        ("", "", "1 2 3\n", "1 lines are left over"),
    ] {
        for line_end in ["\n", "\r\n", "\r"] {
            let loaded = load(&square(vertex, face, end).replace('\n', line_end)).expect("two triangles");
            let mesh = only_mesh(&loaded);
            assert_eq!(mesh.indices.len(), 2);
            let corner = mesh.positions.iter().fold(Vec3::ZERO, |a, b| a.max(*b));
            assert_eq!(corner, Vec3::new(1.0, 1.0, 0.0));
            let as_said = if said.is_empty() { loaded.report.notes.is_empty() } else { note(&loaded, said) };
            assert!(as_said, "{:?}", loaded.report);
        }
    }
    // Rows that go on in the next line, and rows that share one.
    let free = square("", "", "").replacen("3 0 1 2\n3", "3 0\n1 2\n3", 1);
    assert_eq!(only_mesh(&load(&free).expect("free lines")).indices.len(), 2);
    let joined = square("", "", "").replacen("0 0 0\n1", "0 0 0 1", 1);
    assert_eq!(only_mesh(&load(&joined).expect("joined lines")).indices.len(), 2);
    let short = square("", "", "").replacen("3 0 1 2\n", "3 0 1\n", 1);
    let error = load(&short).expect_err("a number is missing").to_string();
    assert!(error.contains("line 14") && error.contains("too few numbers"), "{error}");
}

#[test]
fn textures_in_comments_are_used() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = square(" 0 1", "", "")
        .replacen("property float z", "property float z\nproperty float s\nproperty float t", 1)
        .replacen("format ascii 1.0", "format ascii 1.0\ncomment TextureFile my wood.png", 1);
    std::fs::write(folder.path().join("a.ply"), text).expect("a file");
    let load = || ply::load(&folder.path().join("a.ply"), &LoadOptions::default()).expect("sound");
    assert!(note(&load(), "my wood.png"), "a missing texture is reported");
    image::RgbImage::from_pixel(2, 2, image::Rgb([200, 0, 0]))
        .save(folder.path().join("my wood.png"))
        .expect("a picture");
    let loaded = load();
    assert!(loaded.report.notes.is_empty(), "{:?}", loaded.report);
    assert!(loaded.scene.materials[0].base_color_texture.is_some());
    assert_eq!(loaded.scene.images[0].width, 2);
}

/// Doubles beyond the range of single precision are no positions; those within it may lie as far apart as it reaches.
#[test]
fn doubles_beyond_single_precision_are_not_positions() {
    let text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1e300 1 0\n3 0 1 2";
    let loaded = parse(text.as_bytes()).unwrap();
    assert_eq!(only_mesh(&loaded).positions[2], Vec3::Y);
    assert!(note(&loaded, "1 numbers that are not finite were set to 0"));
    let far = parse(text.replace("1e300", "3e38").replace("1 0 0", "-3e38 0 0").as_bytes()).unwrap();
    common::check(&far.scene);
}
