//! STL files in both forms, sound and broken.

use glam::Vec3;
use proptest::prelude::*;
use scene::load::stl;
use scene::{LoadError, LoadOptions, Loaded, Shape, TriangleMesh};

fn parse(bytes: &[u8]) -> Result<Loaded, LoadError> {
    stl::parse(bytes, &LoadOptions::default())
}

fn mesh(loaded: &Loaded) -> &TriangleMesh {
    let Shape::Triangles(mesh) = &loaded.scene.meshes[0].parts[0].shape else { panic!("no spheres in STL") };
    mesh
}

/// A unit tetrahedron.
const FACES: [[[f32; 3]; 3]; 4] = {
    let (o, x, y, z) = ([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    [[o, y, x], [o, x, z], [o, z, y], [x, y, z]]
};

fn binary(header: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0; 80];
    bytes[..header.len()].copy_from_slice(header);
    bytes.extend((FACES.len() as u32).to_le_bytes());
    for face in FACES {
        bytes.extend([0; 12]); // writers often leave the normal away
        bytes.extend(face.as_flattened().iter().flat_map(|v| v.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

fn text() -> String {
    let mut text = String::from("solid tetrahedron\r\n");
    for face in FACES {
        text += "  facet normal 0 0 0\n outer loop\n";
        face.iter().for_each(|[x, y, z]| text += &format!("\tVERTEX {x} {y:e} {z}\n"));
        text += " endloop\n endfacet\n";
    }
    text + "endsolid tetrahedron\n"
}

#[test]
fn both_forms_hold_the_same() {
    let files = [binary(b""), binary(b"solid in name only"), text().into_bytes()];
    let loaded: Vec<Loaded> = files.iter().map(|file| parse(file).expect("sound")).collect();
    let first = &mesh(&loaded[0]).positions;
    for loaded in &loaded {
        let mesh = mesh(loaded);
        assert!(loaded.report.notes.is_empty(), "{:?}", loaded.report);
        assert_eq!(mesh.indices.len(), 4);
        // Edges of a tetrahedron are sharp: each face has its own corners and its own normal.
        assert_eq!(mesh.positions.len(), 12);
        for triangle in &mesh.indices {
            let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
            let face = (b - a).cross(c - a).normalize();
            assert!(triangle.iter().all(|i| mesh.normals[*i as usize].dot(face) > 0.999));
            assert!(face.dot((a + b + c) / 3.0 - Vec3::splat(0.25)) > 0.0, "it points out");
        }
        assert_eq!(&mesh.positions, first);
    }
}

#[test]
fn corners_in_one_place_are_joined() {
    let options = LoadOptions { crease_angle: std::f32::consts::PI, ..LoadOptions::default() };
    let loaded = stl::parse(&binary(b""), &options).expect("sound");
    assert_eq!(mesh(&loaded).positions.len(), 4);
}

#[test]
fn what_is_broken_is_left_out_or_named() {
    let mut bytes = binary(b"");
    bytes[84 + 12..84 + 16].copy_from_slice(&f32::NAN.to_le_bytes());
    let loaded = parse(&bytes).expect("the rest is sound");
    assert_eq!((mesh(&loaded).indices.len(), loaded.report.notes.len()), (3, 1));
    bytes.truncate(84 + 3 * 50 - 3);
    assert!(parse(&bytes).expect_err("cut off").to_string().contains("ends after 2 of 4 triangles"));
    let lenient = LoadOptions { lenient: true, ..LoadOptions::default() };
    let loaded = stl::parse(&bytes, &lenient).expect("whole triangles");
    assert_eq!((mesh(&loaded).indices.len(), loaded.report.notes.len()), (1, 2));
    let error = |bytes: &[u8]| parse(bytes).expect_err("broken").to_string();
    assert!(error(&bytes[..84 + 47]).contains("4 triangles are declared, there is none"));
    assert!(error(b"not a mesh").contains("10 bytes are neither text"));
    let wrong = text().replacen("1e0", "one", 1);
    assert!(error(wrong.as_bytes()).contains("`one` is not a coordinate"), "{}", error(wrong.as_bytes()));
    let cut = text();
    let cut = &cut[..cut.rfind(" endloop").expect("a loop")];
    assert!(error(cut.as_bytes()).contains("a facet ends after 3 corners"));
    assert!(error(b"solid\nface 1 2 3\n").contains("line 2: `face` does not belong"));
}

#[test]
fn a_declared_count_takes_no_memory() {
    let mut bytes = binary(b"");
    bytes[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    assert_eq!(mesh(&parse(&bytes).expect("four are there")).indices.len(), 4);
}

#[test]
fn variants_of_other_writers_hold_the_same() {
    let one_line_a_facet = text().replace("\r\n", "\n").replace("\n outer", " outer").replace("\n\t", " ");
    let one_line_a_facet = one_line_a_facet.replace("\n endloop\n endfacet", " endloop endfacet");
    let one_line = text().replace(['\r', '\n'], " ");
    let utf16 = |bytes: fn(u16) -> [u8; 2], mark: &str| -> Vec<u8> {
        format!("{mark}{}", text()).encode_utf16().flat_map(bytes).collect()
    };
    let solid = binary(b"solid exported by a CAD");
    let mut uncounted = binary(b"solid");
    uncounted[80..84].fill(0);
    for (name, file) in [
        ("trailing bytes", [&solid[..], &[0, 0]].concat()),
        ("without the last bytes", solid[..solid.len() - 2].to_vec()),
        ("no count", uncounted),
        ("CR", text().replace("\r\n", "\n").replace('\n', "\r").into_bytes()),
        ("CR LF", text().replace("\r\n", "\n").replace('\n', "\r\n").into_bytes()),
        ("a facet a line", one_line_a_facet.into_bytes()),
        ("one line", one_line.into_bytes()),
        ("byte order mark", format!("\u{feff}{}", text()).into_bytes()),
        ("UTF-16", utf16(u16::to_le_bytes, "\u{feff}")),
        ("UTF-16, big-endian, no mark", utf16(u16::to_be_bytes, "")),
        ("keywords in names", text().replace("tetrahedron", "facet of a solid").into_bytes()),
        (
            "two solids",
            text().replacen(" endfacet\n", " endfacet\nendsolid a\nsolid facet b\n", 2).into_bytes(),
        ),
    ] {
        let loaded = parse(&file).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(mesh(&loaded).indices.len(), 4, "{name}");
        assert!(mesh(&loaded).positions.iter().all(|p| p.max_element() <= 1.0), "{name}");
    }
    let error = |bytes: &[u8]| parse(bytes).expect_err("broken").to_string();
    assert!(error(&solid[..solid.len() - 3]).contains("ends after 3 of 4 triangles"));
    assert!(error(b"solid nothing\nendsolid nothing\n").contains("there is no triangle in it"));
}

proptest! {
    #[test]
    fn no_file_panics(at in 0usize..284, byte: u8, cut in 0usize..284, as_text: bool) {
        let mut bytes = if as_text { text().into_bytes() } else { binary(b"solid") };
        let length = bytes.len();
        bytes[at % length] = byte;
        bytes.truncate(length - cut % length);
        if let Ok(loaded) = parse(&bytes) {
            for mesh in loaded.scene.meshes.iter().map(|_| mesh(&loaded)) {
                prop_assert!(mesh.positions.iter().all(|p| p.is_finite()));
                prop_assert!(mesh.indices.as_flattened().iter().all(|i| (*i as usize) < mesh.positions.len()));
            }
        }
    }
}
