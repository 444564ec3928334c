//! The file dialog of our own is used as people use it.

mod common;

use common::{click, open_with, until};
use egui::Key;
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use std::path::Path;
use viewer::settings::Settings;
use viewer::viewer::{Command, FirstView, Viewer};

fn open() -> Harness<'static, Viewer> {
    let settings = Settings { own_dialogs: true, ..Settings::default() };
    open_with("three-spheres", settings, FirstView::default())
}

fn run(harness: &mut Harness<'_, Viewer>, command: Command) {
    let ctx = harness.ctx.clone();
    harness.state_mut().run(command, &ctx);
    harness.run_steps(2);
}

/// Goes to a folder and waits until it is shown.
fn go(harness: &mut Harness<'_, Viewer>, folder: &Path) {
    harness.state_mut().browser.as_mut().expect("a dialog").1.go(folder);
    until(harness, "the folder", |v| v.browser.as_ref().is_some_and(|(_, b)| !b.is_listing()));
    harness.run_steps(2);
}

fn press(harness: &mut Harness<'_, Viewer>, key: Key) {
    harness.key_press(key);
    harness.run_steps(2);
}

#[test]
fn a_scene_is_found_previewed_and_opened_by_keys() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("notes.txt"), "words").expect("written");
    std::fs::write(folder.path().join("wall.obj"), "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n")
        .expect("written");
    let mut harness = open();
    run(&mut harness, Command::Open);
    go(&mut harness, folder.path());
    assert!(harness.query_by_label("notes.txt").is_none(), "a file of another kind is listed");
    press(&mut harness, Key::ArrowDown);
    until(&mut harness, "a preview", |v| v.browser.as_ref().is_some_and(|(_, b)| b.texture.is_some()));
    harness.run_steps(2);
    assert!(harness.query_by_label("1 objects, 1 triangles").is_some(), "the preview says nothing");
    press(&mut harness, Key::Enter);
    assert!(harness.state().browser.is_none());
    let name = |v: &Viewer| v.document.as_ref().map(|d| d.source.to_string()).unwrap_or_default();
    until(&mut harness, "the scene", |v| name(v).ends_with("wall.obj"));
    // The next dialog begins where the last file was.
    run(&mut harness, Command::AddModel);
    let there = harness.state().browser.as_ref().expect("a dialog").1.folder().to_owned();
    assert_eq!(there, folder.path());
}

#[test]
fn escape_closes_only_the_dialog() {
    let mut harness = open();
    click(&mut harness, "Objects");
    let name = harness.state().document.as_ref().expect("open").scene().instances[0].name.clone();
    click(&mut harness, &name);
    run(&mut harness, Command::CompareFile);
    assert!(harness.query_by_label("Compare with a picture").is_some());
    press(&mut harness, Key::Escape);
    assert!(harness.state().browser.is_none());
    assert!(harness.state().selection.is_some(), "what was selected is not any more");
}

#[test]
fn a_scene_is_saved_and_what_exists_is_replaced_on_the_second_click() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("scene.toml");
    let mut harness = open();
    for is_there in [false, true] {
        run(&mut harness, Command::SaveAs);
        go(&mut harness, folder.path());
        click(&mut harness, "Save");
        if is_there {
            assert_eq!(std::fs::read_to_string(&file).expect("kept"), "precious");
            assert!(harness.state().browser.is_some(), "nobody was asked");
            click(&mut harness, "Save");
        }
        assert!(harness.state().browser.is_none());
        assert!(std::fs::read_to_string(&file).expect("saved").contains("three-spheres"));
        std::fs::write(&file, "precious").expect("written");
    }
}

#[test]
fn places_and_the_way_up_are_buttons() {
    let folder = tempfile::tempdir().expect("a folder");
    let deep = folder.path().join("attic/chest");
    std::fs::create_dir_all(&deep).expect("made");
    let mut harness = open();
    run(&mut harness, Command::Open);
    go(&mut harness, &deep);
    click(&mut harness, "attic");
    let folder_of =
        |h: &Harness<'_, Viewer>| h.state().browser.as_ref().expect("a dialog").1.folder().to_owned();
    assert_eq!(folder_of(&harness), folder.path().join("attic"));
    click(&mut harness, "Current folder");
    assert_eq!(folder_of(&harness), std::env::current_dir().expect("a folder"));
    click(&mut harness, "Cancel");
    assert!(harness.state().browser.is_none());
}
