//! Several objects at once: selected, changed, and undone in one step. Materials that go from one to others.

use super::{open, page, press, run, scene, until, write_car};
use crate::common::click;
use egui::{Event, Key, Modifiers, Pos2, vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use viewer::gizmo::Handle;
use viewer::panels::Tab;
use viewer::viewer::{Command, Viewer};

/// Number of an object by its name.
fn number(harness: &Harness<'_, Viewer>, name: &str) -> u32 {
    scene(harness).instances.iter().position(|i| i.name == name).expect("it is there") as u32
}

fn chosen(harness: &Harness<'_, Viewer>) -> Vec<String> {
    let objects = harness.state().chosen_objects();
    objects.iter().map(|object| scene(harness).instances[*object as usize].name.clone()).collect()
}

/// Where the middle of an object is seen.
fn middle(harness: &Harness<'_, Viewer>, name: &str) -> Pos2 {
    let (low, high) =
        harness.state().document.as_ref().and_then(|d| d.bounds_of(number(harness, name))).expect("bounds");
    harness.state().lens().project((low + high) * 0.5).expect("it is seen")
}

fn hold(harness: &mut Harness<'_, Viewer>, modifiers: Modifiers) {
    harness.event(Event::ModifiersChanged(modifiers));
    harness.run_steps(1);
}

fn drag(harness: &mut Harness<'_, Viewer>, from: Pos2, to: Pos2) {
    harness.hover_at(from);
    harness.run_steps(2);
    harness.drag_at(from);
    harness.run_steps(2);
    for share in [0.3, 1.0] {
        harness.hover_at(from + (to - from) * share);
        harness.run_steps(2);
    }
    harness.drop_at(to);
    harness.run_steps(3);
}

fn click_at(harness: &mut Harness<'_, Viewer>, at: Pos2) {
    harness.hover_at(at);
    harness.run_steps(2);
    harness.drag_at(at);
    harness.run_steps(1);
    harness.drop_at(at);
    harness.run_steps(3);
}

fn spheres() -> Harness<'static, Viewer> {
    let mut harness = open("three-spheres");
    until(&mut harness, "a full picture", |v| v.shot().is_some_and(|shot| !shot.preview));
    harness
}

const BALLS: [&str; 3] = ["red", "yellow", "glass"];

#[test]
fn rectangles_and_shift_select_several() {
    let mut harness = spheres();
    let balls: Vec<&str> =
        scene(&harness).instances.iter().map(|i| i.name.as_str()).filter(|n| *n != "floor").collect();
    let balls: Vec<String> = balls.into_iter().map(str::to_owned).collect();
    let camera = harness.state().camera.clone();
    let place = harness.state().place;
    // Ctrl and a drag around all of the picture's middle; the floor is seen all around.
    let corners = |place: egui::Rect| {
        let inset = place.size() * vec2(0.02, 0.12);
        (place.min + inset, place.max - inset)
    };
    hold(&mut harness, Modifiers::COMMAND);
    let (from, to) = corners(place);
    drag(&mut harness, from, to);
    hold(&mut harness, Modifiers::NONE);
    until(&mut harness, "a selection", |v| v.selection.is_some());
    let all = chosen(&harness);
    assert!(balls.iter().all(|ball| all.contains(ball)), "{all:?} of {balls:?}");
    assert_eq!(harness.state().camera, camera, "the camera has followed the pointer, too");
    // B, then a drag in the sky: nothing is there, and that is said.
    press(&mut harness, Key::B);
    drag(&mut harness, place.min + vec2(4.0, 4.0), place.min + vec2(30.0, 12.0));
    until(&mut harness, "an answer", |v| v.notices.iter().any(|n| n.text.contains("no object is seen")));
    assert!(chosen(&harness).is_empty());
    assert_eq!(harness.state().camera, camera);
    // Shift and clicks add and take away.
    let [a, b] = [&balls[0], &balls[1]].map(|name| middle(&harness, name));
    click_at(&mut harness, a);
    until(&mut harness, "one", |v| v.selection.is_some());
    press(&mut harness, Key::Num1);
    hold(&mut harness, Modifiers::SHIFT);
    click_at(&mut harness, b);
    until(&mut harness, "two", |v| v.also.len() == 1);
    click_at(&mut harness, a);
    until(&mut harness, "one again", |v| v.also.is_empty());
    assert_eq!(chosen(&harness), [balls[1].clone()]);
    hold(&mut harness, Modifiers::NONE);
    press(&mut harness, Key::Escape);
    assert!(chosen(&harness).is_empty());
    // Escape gives a rectangle up before it is dragged.
    press(&mut harness, Key::B);
    press(&mut harness, Key::Escape);
    drag(&mut harness, place.center(), place.center() + vec2(60.0, 0.0));
    assert!(harness.state().camera != camera, "the drag does not turn the camera");
}

#[test]
fn handles_and_commands_act_on_all_in_one_step() {
    let mut harness = spheres();
    page(&mut harness, Tab::Objects);
    click(&mut harness, "red");
    hold(&mut harness, Modifiers::COMMAND);
    click(&mut harness, "yellow");
    hold(&mut harness, Modifiers::NONE);
    let [red, yellow] = ["red", "yellow"].map(|name| number(&harness, name) as usize);
    assert_eq!(harness.state().chosen_objects().len(), 2);
    assert!(harness.query_by_label_contains("2 objects are selected").is_some());
    let transforms = |h: &Harness<'_, Viewer>| [red, yellow].map(|i| scene(h).instances[i].transform);
    let before = transforms(&harness);
    // Handles are at the common middle, and turn both about it.
    let pivot = harness.state().gizmo_frame().expect("handles").pivot;
    let (low, high) = [red, yellow]
        .iter()
        .filter_map(|i| harness.state().document.as_ref()?.bounds_of(*i as u32))
        .reduce(|(a, b), (c, d)| (a.min(c), b.max(d)))
        .expect("bounds");
    assert!(pivot.distance((low + high) * 0.5) < 1e-4);
    for (key, handle) in
        [(Key::Num2, Handle::Axis(1)), (Key::Num3, Handle::Ring(1)), (Key::Num4, Handle::Center)]
    {
        press(&mut harness, key);
        let shapes = harness.state().gizmo_shapes();
        let from = shapes.iter().find(|shape| shape.handle == handle).expect("it is seen").grip;
        drag(&mut harness, from, from + vec2(30.0, -25.0));
        let after = transforms(&harness);
        assert!((0..2).all(|i| !after[i].abs_diff_eq(before[i], 1e-4)), "{handle:?} leaves one");
        let apart = |t: [glam::Affine3A; 2]| t[0].translation.distance(t[1].translation);
        match handle {
            Handle::Center => assert!((apart(after) / apart(before) - 1.0).abs() > 0.1),
            _ => assert!((apart(after) - apart(before)).abs() < 1e-3),
        }
        run(&mut harness, Command::Undo);
        assert!(transforms(&harness) == before, "{handle:?} takes several steps");
    }
    let count = scene(&harness).instances.len();
    let visible = |h: &Harness<'_, Viewer>| [red, yellow].map(|i| scene(h).instances[i].visible);
    press(&mut harness, Key::H);
    assert_eq!(visible(&harness), [false; 2]);
    press(&mut harness, Key::H);
    assert_eq!(visible(&harness), [true; 2]);
    run(&mut harness, Command::Isolate);
    assert_eq!(scene(&harness).instances.iter().filter(|i| i.visible).count(), 2);
    run(&mut harness, Command::Undo);
    run(&mut harness, Command::Duplicate);
    assert_eq!(scene(&harness).instances.len(), count + 2);
    assert_eq!(harness.state().chosen_objects(), [count as u32, count as u32 + 1]);
    run(&mut harness, Command::Undo);
    assert_eq!(scene(&harness).instances.len(), count, "one step");
    assert!(harness.state().chosen_objects().is_empty(), "what is gone is selected");
    harness.state_mut().select_objects([red as u32, yellow as u32].into(), None);
    run(&mut harness, Command::Frame);
    run(&mut harness, Command::Delete);
    let removed = |h: &Harness<'_, Viewer>| {
        let edits = h.state().document.as_ref().expect("open").edits();
        edits.objects.values().filter(|o| o.removed).count()
    };
    assert_eq!((removed(&harness), chosen(&harness).len()), (2, 0));
    run(&mut harness, Command::Undo);
    assert_eq!(removed(&harness), 0, "one step");
}

#[test]
fn the_tree_selects_ranges_and_single_lines() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = write_car(folder.path());
    let mut harness = open(&file);
    page(&mut harness, Tab::Objects);
    click(&mut harness, "Expand all");
    click(&mut harness, "left");
    hold(&mut harness, Modifiers::SHIFT);
    click(&mut harness, "body");
    assert_eq!(chosen(&harness), ["left", "right", "body"]);
    hold(&mut harness, Modifiers::COMMAND);
    click(&mut harness, "right");
    assert_eq!(chosen(&harness), ["left", "body"]);
    // All that is in a group, and no more.
    click(&mut harness, "wheels");
    assert_eq!(chosen(&harness).len(), 3);
    click(&mut harness, "wheels");
    assert_eq!(chosen(&harness), ["body"]);
    hold(&mut harness, Modifiers::NONE);
    click(&mut harness, "wheels");
    assert_eq!(chosen(&harness), ["left", "right"]);
    assert!(harness.state().selection.is_none(), "a group is chosen");
}

#[test]
fn materials_are_copied_pasted_and_dragged() {
    let mut harness = spheres();
    page(&mut harness, Tab::Objects);
    let material = |h: &Harness<'_, Viewer>, name: &str| {
        h.state().document.as_ref().and_then(|d| d.material_of(number(h, name))).expect("it has one")
    };
    let [red, others] = [BALLS[0], BALLS[1]].map(|name| material(&harness, name));
    assert!(red != others);
    let ctrl = |h: &mut Harness<'_, Viewer>, key| {
        h.key_press_modifiers(Modifiers::COMMAND, key);
        h.run_steps(3);
    };
    ctrl(&mut harness, Key::V);
    assert!(harness.state().notices.iter().any(|n| n.text.contains("no material was copied")));
    click(&mut harness, "red");
    ctrl(&mut harness, Key::C);
    click(&mut harness, "yellow");
    hold(&mut harness, Modifiers::COMMAND);
    click(&mut harness, "floor");
    hold(&mut harness, Modifiers::NONE);
    ctrl(&mut harness, Key::V);
    assert_eq!(["yellow", "floor"].map(|name| material(&harness, name)), [red; 2]);
    run(&mut harness, Command::Undo);
    assert!(["yellow", "floor"].iter().all(|name| material(&harness, name) != red), "one step");
    // From the list onto an object that is not selected.
    harness.state_mut().deselect();
    harness.run_steps(3);
    let name = harness.state().material_name(others).expect("it has a name").to_owned();
    let line = harness.get_by_label(&format!("{name} ({others})")).rect().center();
    let to = middle(&harness, "red");
    drag(&mut harness, line, to);
    until(&mut harness, "the material", |v| {
        v.document.as_ref().is_some_and(|d| d.edits().objects.values().any(|o| o.material == Some(others)))
    });
    assert_eq!(material(&harness, "red"), others);
    harness.state_mut().open_source(alhazen::Source::parse("cornell"));
    until(&mut harness, "another scene", |v| v.generation() == 2);
    run(&mut harness, Command::PasteMaterial);
    assert!(harness.state().notices.iter().any(|n| n.text.contains("of another scene")));
}

/// Only the rectangle has samples, and it is what is saved.
#[test]
fn a_rectangle_is_rendered_and_saved_alone() {
    let mut harness = spheres();
    harness.state_mut().render.spp = 2;
    press(&mut harness, Key::M);
    let place = harness.state().place;
    let at = |x: f32, y: f32| place.min + place.size() * vec2(x, y);
    drag(&mut harness, at(0.25, 0.5), at(0.75, 0.75));
    let size = harness.state().size();
    let crop = harness.state().job().crop.expect("a crop");
    let near = |a: u32, share: f32, of: u32| (a as f32 - share * of as f32).abs() <= 1.5;
    assert!(near(crop.x, 0.25, size[0]) && near(crop.width, 0.5, size[0]), "{crop:?} of {size:?}");
    assert!(near(crop.y, 0.5, size[1]) && near(crop.height, 0.25, size[1]), "{crop:?} of {size:?}");
    until(&mut harness, "the picture", |v| v.is_current() && v.shot().is_some_and(|shot| !shot.preview));
    let shot = harness.state().shot().expect("shown");
    assert_eq!([shot.linear.width(), shot.linear.height()], size, "pictures are shown whole");
    for (i, count) in shot.counts.iter().enumerate() {
        let (x, y) = (i as u32 % size[0], i as u32 / size[0]);
        assert_eq!(*count > 0, crop.contains(x, y), "{x} {y}");
    }
    let words = format!("--crop {},{},{},{}", crop.x, crop.y, crop.width, crop.height);
    assert!(harness.state().command_line().contains(&words));
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("part.exr");
    harness.state_mut().use_file(viewer::viewer::For::Picture, path.clone());
    until(&mut harness, "the file", |_| path.is_file());
    let saved = alhazen::Image::open(&path).expect("a picture");
    assert_eq!([saved.width(), saved.height()], size, "the file says where the rectangle is");
    for i in 0..size[0] * size[1] {
        let (x, y) = (i % size[0], i / size[0]);
        assert_eq!(saved.rgb(x, y) != [0.0; 3], crop.contains(x, y), "{x} {y}");
    }
    harness.key_press_modifiers(Modifiers::ALT, Key::M);
    harness.run_steps(3);
    assert!(harness.state().job().crop.is_none());
    until(&mut harness, "all of it", |v| {
        v.is_current() && v.shot().is_some_and(|s| !s.preview && s.counts.iter().all(|n| *n > 0))
    });
}
