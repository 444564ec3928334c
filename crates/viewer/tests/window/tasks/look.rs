//! Looking at a scene, and measuring its picture.

use super::super::common::click;
use super::{Task, Window, click_at, ctrl, drag, key, settle, type_text, until, wheel};
use egui::{Key, Modifiers, vec2};
use egui_kittest::kittest::Queryable;
use viewer::viewer::{Comparison, Look};
use viewer::worker::Layer;

pub const TASKS: &[Task] = &[
    Task { name: "orbit", run: orbit },
    Task { name: "pan and dolly", run: pan_and_dolly },
    Task { name: "frame an object", run: frame },
    Task { name: "go back to the first camera", run: home },
    Task { name: "save a view and return to it", run: views },
    Task { name: "set the focus distance", run: focus },
    Task { name: "change the exposure", run: exposure },
    Task { name: "look at a layer", run: layer },
    Task { name: "zoom into the pixels", run: zoom },
    Task { name: "read a pixel's value", run: pixel },
    Task { name: "find clipped pixels", run: clipping },
    Task { name: "keep a snapshot and compare", run: compare },
    Task { name: "find a setting", run: find },
    Task { name: "choose a preset", run: preset },
];

fn orbit(window: &mut Window) {
    let (before, at) = (window.state().camera.clone(), window.state().place.center());
    // Beside handles and signs.
    drag(window, at + vec2(0.0, 300.0), vec2(80.0, 20.0));
    let now = &window.state().camera;
    let distance = |c: &alhazen::Camera| c.eye.distance(c.target);
    assert!(now.eye != before.eye && now.target == before.target);
    assert!((distance(now) / distance(&before) - 1.0).abs() < 1e-3);
}

fn pan_and_dolly(window: &mut Window) {
    let before = window.state().camera.clone();
    wheel(window, 3.0, Modifiers::NONE);
    let nearer = window.state().camera.clone();
    assert!(nearer.eye.distance(before.target) < before.eye.distance(before.target));
    let at = window.state().place.center() + vec2(0.0, 300.0);
    window.event(egui::Event::ModifiersChanged(Modifiers::SHIFT));
    drag(window, at, vec2(60.0, 0.0));
    assert!(window.state().camera.target != nearer.target, "it does not pan");
}

fn frame(window: &mut Window) {
    click(window, "Objects");
    click(window, "yellow");
    let before = window.state().camera.clone();
    window.hover_at(window.state().place.center());
    window.run_steps(1);
    key(window, Key::F);
    let viewer = window.state();
    let object = viewer.selection.expect("selected").object;
    let (low, high) = viewer.document.as_ref().expect("open").bounds_of(object).expect("it has a size");
    assert!(viewer.camera != before);
    assert!(viewer.camera.target.distance((low + high) * 0.5) < 1e-3);
}

fn home(window: &mut Window) {
    let before = window.state().camera.clone();
    orbit(window);
    key(window, Key::Home);
    assert_eq!(window.state().camera.eye, before.eye);
}

fn views(window: &mut Window) {
    let before = window.state().camera.clone();
    ctrl(window, Key::B);
    orbit(window);
    click(window, "Camera");
    click(window, "view 1");
    assert_eq!(window.state().camera.eye, before.eye);
}

fn focus(window: &mut Window) {
    let before = window.state().camera.focus_distance;
    let at = window.state().place.center() + vec2(0.0, 200.0);
    window.event(egui::Event::ModifiersChanged(Modifiers::COMMAND));
    click_at(window, at);
    until(window, "another focus", |v| v.camera.focus_distance != before);
    window.event(egui::Event::ModifiersChanged(Modifiers::NONE));
    window.run_steps(1);
}

fn exposure(window: &mut Window) {
    let before = window.state().shown.tone.exposure;
    key(window, Key::CloseBracket);
    key(window, Key::CloseBracket);
    assert!((window.state().shown.tone.exposure / before - 2.0).abs() < 1e-4);
}

fn layer(window: &mut Window) {
    key(window, Key::L);
    assert_ne!(window.state().shown.layer, Layer::Picture);
    settle(window);
    key(window, Key::P);
    assert_eq!(window.state().shown.layer, Layer::Picture);
}

fn zoom(window: &mut Window) {
    wheel(window, 10.0, Modifiers::COMMAND);
    assert!(window.state().zoom.factor > 1.5, "{}", window.state().zoom.factor);
    key(window, Key::Num0);
    assert_eq!(window.state().zoom.factor, 1.0);
}

fn pixel(window: &mut Window) {
    click(window, "Image");
    window.hover_at(window.state().place.center());
    window.run_steps(3);
    assert!(window.query_by_label("16, 12 of 32×24").is_some());
    until(window, "the surface", |v| v.under_pointer.is_some());
}

fn clipping(window: &mut Window) {
    key(window, Key::Z);
    until(window, "stripes", |v| v.tools.findings.as_ref().is_some_and(|f| f.clipping.is_some()));
}

fn compare(window: &mut Window) {
    key(window, Key::K);
    click(window, "Image");
    click(window, "Compare");
    assert!(matches!(window.state().comparison, Comparison::Stored { .. }));
    let compared =
        |v: &viewer::viewer::Viewer| v.tools.findings.as_ref().is_some_and(|f| f.compared.is_some());
    until(window, "error metrics", compared);
    window.run_steps(2);
    assert!(window.query_by_label("PSNR").is_some());
    key(window, Key::V);
    assert_eq!(window.state().tools.look, Look::A);
}

fn find(window: &mut Window) {
    ctrl(window, Key::P);
    window.get_by_label("Type to find a command or a setting").focus();
    type_text(window, "turbidity");
    assert!(window.query_all_by_label_contains("Turbidity").next().is_some());
    key(window, Key::Escape);
    assert!(window.state().open.overlay.is_none());
}

fn preset(window: &mut Window) {
    click(window, "Render");
    click(window, "draft");
    assert_eq!((window.state().render.spp, window.state().render.noise), (16, None));
    click(window, "final");
    assert_eq!(window.state().render.noise, Some(0.01));
}
