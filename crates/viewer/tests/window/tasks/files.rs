//! Opening and writing files.

use super::super::common::click;
use super::{Task, Window, ctrl, key, settle, type_text, until};
use egui::Key;
use egui_kittest::kittest::Queryable;
use std::path::Path;

pub const TASKS: &[Task] = &[
    Task { name: "open a file", run: open },
    Task { name: "open a built-in scene", run: builtin },
    Task { name: "save the scene", run: save },
    Task { name: "save the picture", run: picture },
    Task { name: "render to a file", run: render },
];

/// Types a path into the dialog and confirms it.
fn choose(window: &mut Window, field: &str, path: &Path) {
    until(window, "the folder", |v| v.browser.as_ref().is_some_and(|(_, b)| !b.is_listing()));
    window.run_steps(2);
    window.get_by_role_and_label(egui::accesskit::Role::TextInput, field).focus();
    window.run_steps(2);
    ctrl(window, Key::A);
    type_text(window, &path.display().to_string());
    key(window, Key::Enter);
    assert!(window.state().browser.is_none(), "the dialog is open");
}

fn open(window: &mut Window) {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("wall.obj");
    std::fs::write(&file, "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n").expect("written");
    ctrl(window, Key::O);
    choose(window, "Find, or a path", &file);
    until(window, "the scene", |v| v.generation() == 2 && v.loading().is_empty());
}

fn builtin(window: &mut Window) {
    // There is a page of this name, too; the menu is above it.
    let name = window.query_all_by_label("File").map(|node| node.rect());
    let name = name.min_by(|a, b| a.top().total_cmp(&b.top())).expect("a menu");
    super::click_at(window, name.center());
    let menu = window.query_all_by_label_contains("Built-in scenes").next().expect("an entry").rect();
    super::click_at(window, menu.center());
    click(window, "cornell");
    until(window, "the scene", |v| v.generation() == 2);
    assert_eq!(window.state().document.as_ref().expect("open").source.to_string(), "cornell");
}

fn save(window: &mut Window) {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("mine.toml");
    click(window, "Objects");
    click(window, "red");
    key(window, Key::H);
    ctrl(window, Key::S);
    choose(window, "Name", &file);
    let loaded = alhazen::Source::parse_file(&file).load(&alhazen::LoadOptions::default()).expect("loads");
    let red = loaded.scene.instances.iter().find(|i| i.name == "red").expect("it is there");
    assert!(!red.visible);
}

fn picture(window: &mut Window) {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("picture.png");
    settle(window);
    ctrl(window, Key::E);
    choose(window, "Name", &file);
    until(window, "the file", |v| v.notices.iter().any(|n| n.text.starts_with("wrote ")));
    let image = alhazen::Image::open(&file).expect("a picture");
    assert_eq!([image.width(), image.height()], [32, 24]);
}

fn render(window: &mut Window) {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("render.exr");
    window.state_mut().open.output.size = Some([48, 20]);
    window.state_mut().open.output.quality = Some(viewer::presets::Preset::Draft);
    ctrl(window, Key::F12);
    choose(window, "Name", &file);
    assert!(window.state().title().contains(" % – "), "{}", window.state().title());
    until(window, "the file", |v| v.notices.iter().any(|n| n.text.starts_with("rendered ")));
    assert!(window.state().recording.is_none() && window.state().finished == 1);
    let image = alhazen::Image::open(&file).expect("a picture");
    assert_eq!([image.width(), image.height()], [48, 20]);
    let title = window.state().title();
    assert_eq!(title, "three-spheres – Alhazen");
}
