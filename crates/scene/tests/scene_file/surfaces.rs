//! Shapes that are subdivided and displaced.

use super::{message, parsed};
use scene::load::scene_file::{self, Parameters};
use scene::{LoadOptions, Shape};
use std::path::Path;

/// Triangles and notes of the first mesh of a scene.
fn surface(text: &str) -> (usize, Vec<String>) {
    let loaded = parsed(text);
    let Shape::Triangles(mesh) = &loaded.scene.meshes[0].parts[0].shape else { panic!("triangles") };
    assert!(loaded.scene.refinements.is_empty());
    (mesh.indices.len(), loaded.report.notes.iter().map(|note| note.message.clone()).collect())
}

#[test]
fn shapes_are_subdivided_and_displaced() {
    let shape = |keys: &str| format!("[[shape]]\nkind = \"box\"\n{keys}\n");
    assert_eq!(surface(&shape("subdivision = 3")).0, 12 * 64);
    assert_eq!(surface(&shape("subdivision = { scheme = \"loop\", levels = 1 }")).0, 48);
    assert_eq!(surface(&shape("subdivision = { edge-length = 0.3, crease-angle = 30 }")).0, 12 * 16);
    let camera = "[[camera]]\neye = [0, 0, 5]\ntarget = [0, 0, 0]\n[render]\nwidth = 200\nheight = 200\n";
    let pixels = |most: u32| {
        let text = format!("{}{camera}", shape(&format!("subdivision = {{ edge-pixels = {most} }}")));
        surface(&text).0
    };
    let found = [64, 16, 4].map(pixels);
    assert!(found[1] >= 4 * found[0] && found[2] >= 8 * found[1], "{found:?}");
    // A constant value moves all of it outwards.
    let by = "displacement = { texture = { node = \"invert\", input = 0.5 }, scale = 0.2 }\nsubdivision = { scheme = \"linear\", levels = 0 }";
    let moved = parsed(&shape(by)).scene.bounds().expect("a box");
    assert!(moved.0.x < -0.5 && moved.1.x > 0.5, "{moved:?}");
    let (_, notes) = surface(&shape("subdivision = { edge-length = 0.001, max-levels = 2 }"));
    assert!(notes.iter().any(|note| note.contains("too long after 2 levels")), "{notes:?}");
}

#[test]
fn what_is_wrong_with_a_surface_is_said() {
    let shape = |keys: &str| message(&format!("[[shape]]\nkind = \"box\"\n{keys}\n"));
    for (keys, expected) in [
        ("subdivision = 99", "levels"),
        ("subdivision = -1", "no number of levels"),
        ("subdivision = \"fine\"", "a number of levels, or a table"),
        ("subdivision = { scheme = \"doo-sabin\" }", "catmull-clark"),
        ("subdivision = { levels = 2, edge-pixels = 1 }", "exclude each other"),
        ("subdivision = { edge-pixels = 0 }", "edge-pixels"),
        ("subdivision = { level = 2 }", "level"),
        ("displacement = { scale = 2 }", "texture"),
        ("displacement = { texture = { node = \"noise\" }, space = \"camera\" }", "space"),
    ] {
        let message = shape(keys);
        assert!(message.contains(expected), "{keys}: {message}");
    }
    let ball = message("[[shape]]\nkind = \"sphere\"\nsubdivision = 2\n");
    assert!(ball.contains("icosphere"), "{ball}");
}

#[test]
fn fine_surfaces_count_before_they_are_made() {
    let text = "[[shape]]\nkind = \"box\"\nsubdivision = 12\n";
    let options = LoadOptions { max_memory: 100 << 20, ..LoadOptions::default() };
    let parameters = Parameters::new();
    let path = Path::new("test.toml");
    let error = scene_file::parse(text, path, Path::new("none"), &parameters, &options).expect_err("12 GB");
    let message = error.to_string();
    assert!(message.contains("subdivided meshes") && message.contains("bytes"), "{message}");
}
