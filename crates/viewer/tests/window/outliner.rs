//! The tree of objects.

use super::{open, page, press, run, scene, write_car};
use crate::common::click;
use egui::Key;
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use viewer::outliner::Item::{Group, Object};
use viewer::panels::Tab;
use viewer::viewer::{Command, Viewer};

fn open_car() -> (tempfile::TempDir, Harness<'static, Viewer>) {
    let folder = tempfile::tempdir().expect("a folder");
    let file = write_car(folder.path());
    let mut harness = open(&file);
    page(&mut harness, Tab::Objects);
    (folder, harness)
}

/// Whether there is a line with this name.
fn lists(harness: &Harness<'_, Viewer>, name: &str) -> bool {
    harness.query_by_label(&format!("Visible: {name}")).is_some()
}

fn visible(harness: &Harness<'_, Viewer>) -> Vec<String> {
    scene(harness).instances.iter().filter(|i| i.visible).map(|i| i.name.clone()).collect()
}

#[test]
fn groups_are_opened_and_what_is_picked_is_shown() {
    let (_folder, mut harness) = open_car();
    assert!(lists(&harness, "car") && !lists(&harness, "body"));
    click(&mut harness, "Expand car");
    assert!(lists(&harness, "body") && lists(&harness, "wheels") && !lists(&harness, "left"));
    click(&mut harness, "Collapse car");
    assert!(!lists(&harness, "body"));
    // As a click into the picture does.
    harness.state_mut().selection = Some(viewer::viewer::Selection { object: 0, material: 0 });
    harness.run_steps(3);
    assert_eq!(scene(&harness).instances[0].name, "left");
    assert!(lists(&harness, "left"), "what was picked is not shown");
    assert_eq!(harness.state().open.outliner.cursor, Some(Object(0)));
    click(&mut harness, "Collapse all");
    assert!(!lists(&harness, "wheels"));
    click(&mut harness, "Expand all");
    assert!(lists(&harness, "left") && lists(&harness, "right") && lists(&harness, "body"));
}

#[test]
fn typing_finds_objects_in_closed_groups() {
    let (_folder, mut harness) = open_car();
    harness.get_by_label("Find").focus();
    harness.run_steps(2);
    harness.get_by_label("Find").type_text("RIGHT");
    harness.run_steps(3);
    assert!(lists(&harness, "right") && lists(&harness, "wheels") && !lists(&harness, "left"));
    harness.state_mut().open.outliner.filter = "nothing".into();
    harness.run_steps(2);
    assert!(harness.query_by_label("No matches").is_some());
}

#[test]
fn objects_and_groups_are_hidden_isolated_and_shown() {
    let (_folder, mut harness) = open_car();
    click(&mut harness, "Expand all");
    click(&mut harness, "Visible: wheels");
    assert_eq!(visible(&harness), ["body"]);
    click(&mut harness, "Visible: body");
    assert!(visible(&harness).is_empty());
    run(&mut harness, Command::Undo);
    run(&mut harness, Command::Undo);
    assert_eq!(visible(&harness).len(), 3);
    click(&mut harness, "wheels");
    assert_eq!(harness.state().chosen(), Some(Group(1)));
    click(&mut harness, "Isolate");
    assert_eq!(visible(&harness), ["left", "right"]);
    click(&mut harness, "Isolate");
    assert_eq!(visible(&harness).len(), 3, "the same again ends it");
    click(&mut harness, "Visible: left");
    click(&mut harness, "Visible: car");
    assert!(visible(&harness).is_empty());
    click(&mut harness, "Show all");
    assert_eq!(visible(&harness).len(), 3);
    run(&mut harness, Command::Undo);
    assert!(visible(&harness).is_empty(), "one step");
}

#[test]
fn names_are_changed_saved_and_brought_back() {
    let (folder, mut harness) = open_car();
    click(&mut harness, "Expand all");
    for (old, new) in [("wheels", "tyres"), ("body", "hull")] {
        click(&mut harness, old);
        run(&mut harness, Command::Rename);
        harness.state_mut().open.outliner.renaming.as_mut().expect("a field").1 = new.into();
        press(&mut harness, Key::Enter);
        assert!(harness.state().open.outliner.renaming.is_none());
        assert!(lists(&harness, new) && !lists(&harness, old));
    }
    let file = folder.path().join("scene.toml");
    harness.state_mut().save_scene(&file);
    let loaded = alhazen::Source::parse_file(&file).load(&alhazen::LoadOptions::default()).expect("loads");
    assert_eq!(loaded.scene.groups.list[1].name, "tyres");
    assert_eq!(loaded.scene.instances[2].name, "hull");
    run(&mut harness, Command::Undo);
    run(&mut harness, Command::Undo);
    assert!(lists(&harness, "wheels") && lists(&harness, "body"));
    // Escape gives it up.
    harness.state_mut().choose(Object(2));
    run(&mut harness, Command::Rename);
    harness.state_mut().open.outliner.renaming.as_mut().expect("a field").1 = "x".into();
    press(&mut harness, Key::Escape);
    assert!(harness.state().open.outliner.renaming.is_none() && lists(&harness, "body"));
}

#[test]
fn keys_walk_open_and_hide() {
    let (_folder, mut harness) = open_car();
    click(&mut harness, "car");
    assert!(harness.state().open.outliner.has_focus);
    let cursor = |h: &Harness<'_, Viewer>| h.state().open.outliner.cursor;
    press(&mut harness, Key::ArrowRight);
    assert!(lists(&harness, "body") && cursor(&harness) == Some(Group(0)));
    press(&mut harness, Key::ArrowRight);
    assert_eq!(cursor(&harness), Some(Group(1)));
    press(&mut harness, Key::Enter);
    assert!(lists(&harness, "left"));
    press(&mut harness, Key::ArrowDown);
    assert_eq!((cursor(&harness), harness.state().selection.map(|s| s.object)), (Some(Object(0)), Some(0)));
    let paused = harness.state().paused;
    press(&mut harness, Key::Space);
    assert_eq!(visible(&harness), ["right", "body"]);
    assert_eq!(harness.state().paused, paused, "the key has done two things");
    press(&mut harness, Key::H);
    assert_eq!(visible(&harness).len(), 3);
    press(&mut harness, Key::ArrowLeft);
    assert_eq!(cursor(&harness), Some(Group(1)));
    press(&mut harness, Key::ArrowLeft);
    assert!(!lists(&harness, "left"));
    press(&mut harness, Key::ArrowUp);
    assert_eq!(cursor(&harness), Some(Group(0)));
    let picture = harness.state().place.center();
    harness.drag_at(picture);
    harness.run_steps(2);
    harness.drop_at(picture);
    harness.run_steps(2);
    assert!(!harness.state().open.outliner.has_focus, "keys are the picture's again");
    harness.state_mut().choose(Group(0));
    press(&mut harness, Key::Delete);
    assert!(visible(&harness).is_empty() && !lists(&harness, "car"));
    run(&mut harness, Command::Undo);
    assert_eq!(visible(&harness).len(), 3);
}

#[test]
fn the_list_is_made_higher_by_its_border() {
    let (_folder, mut harness) = open_car();
    let before = harness.state().settings.outliner_height;
    let border = harness.get_by_label("Height of the list").rect().center();
    harness.drag_at(border);
    harness.run_steps(2);
    harness.hover_at(border + egui::vec2(0.0, 40.0));
    harness.run_steps(2);
    harness.drop_at(border + egui::vec2(0.0, 40.0));
    harness.run_steps(2);
    let height = harness.state().settings.outliner_height;
    assert!((height - before - 40.0).abs() < 8.0, "{before} {height}");
}
