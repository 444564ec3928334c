//! Panels are used as people use them: by their labels, without a window.

use alhazen::{LoadOptions, RendererOptions, Source, ToneMapper};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use std::time::{Duration, Instant};
use viewer::panels::{self, Tab};
use viewer::viewer::{Command, Start, Viewer};

/// The whole window around a scene that is loaded.
fn open(scene: &str) -> Harness<'static, Viewer> {
    let start = Start {
        load: LoadOptions::default(),
        renderer: RendererOptions { backend: alhazen::BackendChoice::Cpu, ..RendererOptions::default() },
        size: Some([32, 24]),
        ..Start::default()
    };
    let viewer = Viewer::new(Source::parse(scene), start, || {}).expect("threads");
    let began = Instant::now();
    let show = move |ui: &mut egui::Ui, viewer: &mut Viewer| {
        viewer.tick(ui.ctx(), began.elapsed().as_secs_f64());
        viewer.take_keys(ui.ctx());
        panels::show(viewer, ui);
    };
    let size = egui::vec2(1200.0, 1500.0);
    let mut harness = Harness::builder().with_size(size).build_ui_state(show, viewer);
    until(&mut harness, "a picture", |v| v.document.is_some() && v.shot().is_some());
    harness
}

/// Frames until something is so.
fn until(harness: &mut Harness<'_, Viewer>, what: &str, is_so: impl Fn(&Viewer) -> bool) {
    let began = Instant::now();
    while !is_so(harness.state()) {
        assert!(began.elapsed() < Duration::from_secs(120), "{what} does not come");
        std::thread::sleep(Duration::from_millis(5));
        harness.step();
    }
}

fn click(harness: &mut Harness<'_, Viewer>, label: &str) {
    harness.get_by_label(label).click();
    harness.run_steps(3);
}

/// Opens a page. Its name may stand elsewhere, too.
fn page(harness: &mut Harness<'_, Viewer>, tab: Tab) {
    harness.state_mut().open.tab = tab;
    harness.run_steps(3);
}

#[test]
fn every_page_shows_what_it_is_for() {
    let mut harness = open("three-spheres");
    for (tab, label) in [
        (Tab::Render, "Tone mapper"),
        (Tab::Objects, "Add model…"),
        (Tab::Lights, "Add spot light"),
        (Tab::Sky, "Picture from a file…"),
        (Tab::Camera, "Depth of field"),
        (Tab::Speed, "Triangles"),
        (Tab::Pixel, "Point at the picture."),
        (Tab::File, "Reload when the file changes"),
    ] {
        page(&mut harness, tab);
        assert!(harness.query_all_by_label(label).next().is_some(), "{tab:?} has no {label:?}");
    }
}

#[test]
fn objects_are_selected_changed_and_brought_back() {
    let mut harness = open("cornell");
    page(&mut harness, Tab::Objects);
    let name = harness.state().document.as_ref().expect("open").scene().instances[0].name.clone();
    click(&mut harness, &name);
    let selection = harness.state().selection.expect("selected");
    assert_eq!(selection.object, 0);
    let visible =
        |h: &Harness<'_, Viewer>| h.state().document.as_ref().expect("open").scene().instances[0].visible;
    click(&mut harness, "Hide / show");
    assert!(!visible(&harness));
    let ctx = harness.ctx.clone();
    harness.state_mut().run(Command::Undo, &ctx);
    assert!(visible(&harness));
    click(&mut harness, "Thin wall");
    let material = |h: &Harness<'_, Viewer>| {
        h.state().document.as_ref().expect("open").scene().materials[selection.material as usize].clone()
    };
    assert!(material(&harness).thin_walled);
    click(&mut harness, "Reset material");
    assert!(!material(&harness).thin_walled);
    let count = |h: &Harness<'_, Viewer>| h.state().document.as_ref().expect("open").scene().materials.len();
    let before = count(&harness);
    click(&mut harness, "Give this object its own");
    assert_eq!(count(&harness), before + 1);
    click(&mut harness, "Delete");
    assert!(harness.state().selection.is_none() && !visible(&harness));
    assert!(harness.query_by_label(&name).is_none(), "what was deleted is not listed");
}

#[test]
fn lights_come_and_go() {
    let mut harness = open("cornell");
    page(&mut harness, Tab::Lights);
    let count = |h: &Harness<'_, Viewer>| h.state().document.as_ref().expect("open").scene().lights.len();
    let before = count(&harness);
    click(&mut harness, "Add directional light");
    assert_eq!(count(&harness), before + 1);
    click(&mut harness, "Remove");
    assert_eq!(count(&harness), before);
    click(&mut harness, "Reset lights");
    assert!(harness.state().document.as_ref().expect("open").edits().lights.is_none());
}

#[test]
fn what_is_set_is_rendered() {
    let mut harness = open("cornell");
    page(&mut harness, Tab::Render);
    click(&mut harness, "glTF to the letter");
    assert!(harness.state().render.single_scatter);
    let wanted = harness.state().job();
    until(&mut harness, "the new picture", |v| v.shot().is_some_and(|s| *s.job == wanted));
    click(&mut harness, "False colour");
    assert!(harness.state().shown.false_colour.is_some());
    harness.state_mut().shown.tone.mapper = ToneMapper::Aces;
    click(&mut harness, "Reset display");
    assert_ne!(harness.state().shown.tone.mapper, ToneMapper::Aces);
    click(&mut harness, "Two settings");
    assert!(harness.state().comparison.split().is_some());
}

#[test]
fn commands_are_found_by_typing() {
    let mut harness = open("cornell");
    let before = harness.state().shown.tone.exposure;
    harness.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::P);
    harness.run_steps(3);
    assert!(harness.state().open.palette);
    harness.get_by_label("Type to find a command").type_text("stop brighter");
    harness.run_steps(2);
    harness.key_press(egui::Key::Enter);
    harness.run_steps(3);
    assert!(!harness.state().open.palette);
    assert!(harness.state().shown.tone.exposure > before);
}

#[test]
fn errors_are_shown_until_they_are_dismissed() {
    let mut harness = open("cornell");
    let before = harness.state().generation();
    harness.state_mut().open_source(Source::parse("no/such/file.obj"));
    until(&mut harness, "an error", |v| v.notices.iter().any(|n| n.is_error));
    harness.run_steps(3);
    assert_eq!(harness.state().generation(), before, "nothing else changes");
    click(&mut harness, "Dismiss");
    assert!(!harness.state().notices.iter().any(|n| n.is_error));
}
