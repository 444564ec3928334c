//! What lies over the picture, the tree of objects, and properties, used as people use them.

mod commands;
#[path = "../common/mod.rs"]
mod common;
mod gizmo;
mod image;
mod outliner;
mod overlays;
mod properties;
mod several;
mod sharing;
mod tasks;

use common::{open_with, until};
use egui_kittest::Harness;
use viewer::panels::Tab;
use viewer::settings::Settings;
use viewer::viewer::{Command, FirstView, Viewer};

fn open(scene: &str) -> Harness<'static, Viewer> {
    open_with(scene, Settings { own_dialogs: true, ..Settings::default() }, FirstView::default())
}

fn page(harness: &mut Harness<'_, Viewer>, tab: Tab) {
    harness.state_mut().open.tab = tab;
    harness.run_steps(3);
}

fn run(harness: &mut Harness<'_, Viewer>, command: Command) {
    let ctx = harness.ctx.clone();
    harness.state_mut().run(command, &ctx);
    harness.run_steps(3);
}

fn press(harness: &mut Harness<'_, Viewer>, key: egui::Key) {
    harness.key_press(key);
    harness.run_steps(3);
}

fn scene<'h>(harness: &'h Harness<'_, Viewer>) -> &'h alhazen::Scene {
    harness.state().document.as_ref().expect("open").scene()
}

/// Files a scene of a car of two wheels and a body, with groups, and a picture on the body.
fn write_car(folder: &std::path::Path) -> String {
    let positions: [f32; 9] = [-1.0, -1.0, 0.0, 1.0, -1.0, 0.0, 0.0, 1.0, 0.0];
    let bytes: Vec<u8> = positions.iter().flat_map(|v| v.to_le_bytes()).collect();
    std::fs::write(folder.join("car.bin"), bytes).expect("written");
    let picture = alhazen::Image::from_fn(70, 30, |_, _| [1.0, 0.0, 0.0]);
    picture.write_png_encoded(&folder.join("red.png")).expect("a picture");
    let json = r#"{"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [
            {"name": "car", "children": [1, 2]}, {"name": "wheels", "children": [3, 4]},
            {"name": "body", "mesh": 0}, {"name": "left", "mesh": 1}, {"name": "right", "mesh": 1}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]},
            {"primitives": [{"attributes": {"POSITION": 0}, "material": 1}]}],
        "materials": [{"name": "paint", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0},
            "metallicRoughnessTexture": {"index": 0}}}, {"name": "rubber"}],
        "textures": [{"source": 0}], "images": [{"uri": "red.png"}],
        "buffers": [{"byteLength": 36, "uri": "car.bin"}],
        "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}]}"#;
    let path = folder.join("car.gltf");
    std::fs::write(&path, json).expect("written");
    path.display().to_string()
}
