//! Changing the scene.

use super::super::common::click;
use super::{Task, Window, click_at, ctrl, drag, key, type_text, until};
use egui::{Key, Modifiers, Pos2, vec2};
use egui_kittest::kittest::Queryable;
use viewer::gizmo::Handle;

pub const TASKS: &[Task] = &[
    Task { name: "select in the picture", run: select },
    Task { name: "find an object by its name", run: find },
    Task { name: "hide an object and show it again", run: hide },
    Task { name: "rename an object", run: rename },
    Task { name: "move an object", run: translate },
    Task { name: "rotate an object", run: rotate },
    Task { name: "duplicate and delete an object", run: duplicate },
    Task { name: "undo and redo", run: undo },
    Task { name: "change a material", run: material },
    Task { name: "add a light", run: light },
    Task { name: "aim a light", run: aim },
];

fn document(window: &Window) -> &viewer::document::Document {
    window.state().document.as_ref().expect("open")
}

fn grip(window: &Window, handle: Handle) -> Pos2 {
    let shapes = window.state().gizmo_shapes();
    shapes.iter().find(|shape| shape.handle == handle).expect("it is seen").grip
}

/// Selects the red sphere in the tree.
fn red(window: &mut Window) -> usize {
    click(window, "Objects");
    click(window, "red");
    window.state().selection.expect("selected").object as usize
}

fn select(window: &mut Window) {
    let spheres = document(window).scene().instances.iter().position(|i| i.name == "red").expect("there");
    let (low, high) = document(window).bounds_of(spheres as u32).expect("it has a size");
    let at = window.state().lens().project((low + high) * 0.5).expect("seen");
    click_at(window, at);
    until(window, "a selection", |v| v.selection.is_some_and(|s| s.object as usize == spheres));
}

fn find(window: &mut Window) {
    click(window, "Objects");
    window.get_by_label("Find").focus();
    window.run_steps(2);
    type_text(window, "yel");
    assert!(window.query_by_label("yellow").is_some() && window.query_by_label("floor").is_none());
}

fn hide(window: &mut Window) {
    let object = red(window);
    let visible = |window: &Window| document(window).scene().instances[object].visible;
    key(window, Key::H);
    assert!(!visible(window));
    key(window, Key::H);
    assert!(visible(window));
}

fn rename(window: &mut Window) {
    let object = red(window);
    key(window, Key::F2);
    ctrl(window, Key::A);
    type_text(window, "rose");
    key(window, Key::Enter);
    assert_eq!(document(window).scene().instances[object].name, "rose");
}

fn translate(window: &mut Window) {
    let object = red(window);
    let place = |window: &Window| document(window).scene().instances[object].transform.translation;
    let before = place(window);
    key(window, Key::Num2);
    let from = grip(window, Handle::Axis(1));
    drag(window, from, vec2(0.0, -40.0));
    let moved = place(window) - before;
    assert!(moved.y > 0.0 && moved.x == 0.0 && moved.z == 0.0, "{moved}");
}

fn rotate(window: &mut Window) {
    let object = red(window);
    let before = document(window).scene().instances[object].transform;
    key(window, Key::Num3);
    let from = grip(window, Handle::Ring(1));
    drag(window, from, vec2(40.0, 0.0));
    assert!(!document(window).scene().instances[object].transform.abs_diff_eq(before, 1e-4));
}

fn duplicate(window: &mut Window) {
    red(window);
    let before = document(window).scene().instances.len();
    ctrl(window, Key::D);
    assert_eq!(document(window).scene().instances.len(), before + 1);
    let copy = window.state().selection.expect("the copy is selected").object;
    key(window, Key::Delete);
    assert!(document(window).edits().objects[&copy].removed && window.state().selection.is_none());
}

fn undo(window: &mut Window) {
    let object = red(window);
    let visible = |window: &Window| document(window).scene().instances[object].visible;
    key(window, Key::H);
    ctrl(window, Key::Z);
    assert!(visible(window));
    window.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    window.run_steps(3);
    assert!(!visible(window));
}

fn material(window: &mut Window) {
    red(window);
    let number = window.state().selection.expect("selected").material as usize;
    let roughness = |window: &Window| document(window).scene().materials[number].roughness;
    let before = roughness(window);
    let slider = window.get_by_role_and_label(egui::accesskit::Role::Slider, "Roughness").rect();
    drag(window, slider.center(), vec2(30.0, 0.0));
    assert!(roughness(window) > before + 0.2, "{before} {}", roughness(window));
}

fn light(window: &mut Window) {
    click(window, "Lights");
    let before = document(window).scene().lights.len();
    click(window, "Add spot light");
    assert_eq!(document(window).scene().lights.len(), before + 1);
}

fn aim(window: &mut Window) {
    light(window);
    let last = document(window).scene().lights.len() - 1;
    let direction = |window: &Window| match document(window).scene().lights[last].kind {
        alhazen::LightKind::Spot { direction, .. } => direction,
        other => panic!("{other:?}"),
    };
    let before = direction(window);
    // The light is selected by its sign, so that it is the one that is aimed.
    window.state_mut().select_light(last);
    window.run_steps(2);
    key(window, Key::J);
    let floor = window.state().place.center_bottom() - vec2(120.0, 40.0);
    click_at(window, floor);
    until(window, "an answer", |v| v.notices.iter().any(|n| n.text == "aimed"));
    assert!(direction(window) != before);
}
