//! Handles over the picture, and signs of lights, used with the pointer.

use super::{open, page, press, run, scene, until};
use egui::{Event, Key, Modifiers, Pos2, vec2};
use egui_kittest::Harness;
use glam::Vec3;
use viewer::gizmo::{Handle, Tool, markers};
use viewer::outliner::Item::Object;
use viewer::panels::Tab;
use viewer::viewer::{Command, Viewer};

/// Where a handle can be held.
fn grip(harness: &Harness<'_, Viewer>, handle: Handle) -> Pos2 {
    let shapes = harness.state().gizmo_shapes();
    shapes.iter().find(|shape| shape.handle == handle).expect("it is seen").grip
}

fn drag(harness: &mut Harness<'_, Viewer>, from: Pos2, way: egui::Vec2) {
    harness.hover_at(from);
    harness.run_steps(2);
    harness.drag_at(from);
    harness.run_steps(2);
    for share in [0.3, 0.7, 1.0] {
        harness.hover_at(from + way * share);
        harness.run_steps(2);
    }
}

fn click_at(harness: &mut Harness<'_, Viewer>, at: Pos2) {
    harness.hover_at(at);
    harness.run_steps(2);
    harness.drag_at(at);
    harness.run_steps(1);
    harness.drop_at(at);
    harness.run_steps(3);
}

fn transform(harness: &Harness<'_, Viewer>) -> glam::Affine3A {
    scene(harness).instances[0].transform
}

fn can_undo(harness: &Harness<'_, Viewer>) -> bool {
    harness.state().document.as_ref().expect("open").can_undo_redo().0
}

/// A scene with the first sphere selected, and its transform.
fn selected() -> (Harness<'static, Viewer>, glam::Affine3A) {
    let mut harness = open("three-spheres");
    harness.state_mut().choose(Object(0));
    harness.run_steps(3);
    let before = transform(&harness);
    (harness, before)
}

#[test]
fn handles_move_turn_and_scale_in_one_step_each() {
    let (mut harness, before) = selected();
    let camera = harness.state().camera.clone();
    for (key, handle) in
        [(Key::Num2, Handle::Axis(0)), (Key::Num3, Handle::Ring(1)), (Key::Num4, Handle::Center)]
    {
        press(&mut harness, key);
        let from = grip(&harness, handle);
        drag(&mut harness, from, vec2(40.0, -15.0));
        harness.drop_at(from + vec2(40.0, -15.0));
        harness.run_steps(3);
        let after = transform(&harness);
        assert!(!after.abs_diff_eq(before, 1e-4), "{handle:?} changes nothing");
        let offset = Vec3::from(after.translation - before.translation);
        match handle {
            Handle::Axis(_) => {
                assert!(offset.x.abs() > 1e-3 && offset.y == 0.0 && offset.z == 0.0, "{offset}")
            }
            // 55 points of the 100 that double it.
            Handle::Center => {
                let factor = after.matrix3.x_axis.length() / before.matrix3.x_axis.length();
                assert!((factor - 1.4641).abs() < 1e-2, "{factor}");
            }
            _ => {}
        }
        run(&mut harness, Command::Undo);
        assert!(transform(&harness) == before && !can_undo(&harness), "{handle:?} takes several steps");
    }
    assert_eq!(harness.state().camera, camera, "the camera has followed the pointer, too");
    press(&mut harness, Key::Num1);
    assert_eq!(harness.state().gizmo.tool, Tool::Select);
    assert!(harness.state().gizmo_shapes().is_empty());
}

#[test]
fn escape_gives_a_drag_up_and_numbers_are_typed() {
    let (mut harness, before) = selected();
    let from = grip(&harness, Handle::Axis(1));
    drag(&mut harness, from, vec2(0.0, -50.0));
    assert!(transform(&harness) != before);
    press(&mut harness, Key::Escape);
    assert!(transform(&harness) == before && !can_undo(&harness));
    assert!(harness.state().selection.is_some(), "Escape has ended the selection, too");
    harness.hover_at(from + vec2(0.0, -90.0));
    harness.run_steps(2);
    assert!(transform(&harness) == before, "what was given up goes on");
    harness.drop_at(from);
    harness.run_steps(3);

    drag(&mut harness, from, vec2(0.0, -50.0));
    // A digit is a tool's key, too; not while something is dragged.
    for text in ["1", ".", "5"] {
        harness.event(Event::Text(text.into()));
    }
    harness.key_press(Key::Num1);
    harness.run_steps(3);
    harness.drop_at(from + vec2(0.0, -50.0));
    harness.run_steps(3);
    let moved = Vec3::from(transform(&harness).translation - before.translation);
    assert!(moved.distance(Vec3::Y * 1.5) < 1e-5, "{moved}");
    assert_eq!(harness.state().gizmo.tool, Tool::Move);
}

#[test]
fn control_snaps() {
    let (mut harness, before) = selected();
    let step = harness.state().snap_length();
    let from = grip(&harness, Handle::Axis(1));
    harness.event(Event::ModifiersChanged(Modifiers::COMMAND));
    drag(&mut harness, from, vec2(0.0, -33.0));
    let moved = (transform(&harness).translation - before.translation).y;
    harness.drop_at(from + vec2(0.0, -33.0));
    harness.run_steps(2);
    let steps = moved / step;
    assert!((steps - steps.round()).abs() < 1e-3, "{moved} is no multiple of {step}");
}

/// Where the sign of the first light is.
fn sign(harness: &Harness<'_, Viewer>) -> Pos2 {
    let signs = markers::markers(scene(harness), &harness.state().lens());
    signs.iter().find(|sign| sign.of == markers::Of::Light(0)).expect("it is seen").at
}

#[test]
fn lights_are_selected_moved_aimed_and_removed_in_the_picture() {
    let mut harness = open("three-spheres");
    let camera = harness.state().camera.clone();
    let side = (camera.target - camera.eye).cross(camera.up).normalize();
    let position = camera.target + camera.up * 0.4 + side * 0.6;
    let kind = alhazen::LightKind::Spot {
        position,
        direction: Vec3::NEG_Y,
        intensity: Vec3::ONE,
        inner_angle: 0.2,
        outer_angle: 0.4,
    };
    harness.state_mut().edit_lights("add", |lights| *lights = vec![alhazen::Light::new("spot", kind)]);
    page(&mut harness, Tab::Render);
    let at = sign(&harness);
    click_at(&mut harness, at);
    assert_eq!((harness.state().gizmo.light, harness.state().open.tab), (Some(0), Tab::Lights));
    let light = |h: &Harness<'_, Viewer>| match scene(h).lights[0].kind {
        alhazen::LightKind::Spot { position, direction, .. } => (position, direction),
        other => panic!("{other:?}"),
    };
    let from = grip(&harness, Handle::Axis(1));
    drag(&mut harness, from, vec2(0.0, -30.0));
    harness.drop_at(from + vec2(0.0, -30.0));
    harness.run_steps(3);
    let (moved, direction) = light(&harness);
    assert!(moved.y > position.y && direction == Vec3::NEG_Y, "{moved}");
    press(&mut harness, Key::J);
    assert!(harness.state().gizmo.aims);
    let floor = harness.state().place.center_bottom() - vec2(0.0, 20.0);
    click_at(&mut harness, floor);
    until(&mut harness, "an answer", |v| v.notices.iter().any(|n| n.text == "aimed"));
    let (_, aimed) = light(&harness);
    assert!(aimed != Vec3::NEG_Y && aimed.is_normalized(), "{aimed}");
    press(&mut harness, Key::Delete);
    assert!(scene(&harness).lights.is_empty() && harness.state().gizmo.light.is_none());
}

#[test]
fn the_sun_is_dragged_through_the_sky() {
    let mut harness = open("three-spheres");
    let camera = harness.state().camera.clone();
    let direction = (camera.target - camera.eye).normalize().to_array();
    let sky = alhazen::edits::SkyRecord {
        horizon: [1.0; 3],
        zenith: [1.0; 3],
        ground: [1.0; 3],
        sun: Some(alhazen::edits::SunRecord { direction, irradiance: [1.0; 3], angular_radius: 0.01 }),
    };
    let sky = alhazen::edits::EnvironmentRecord::Sky(sky);
    harness.state_mut().edit("sky", |edits| edits.environment = Some(sky));
    harness.run_steps(3);
    let sun = |h: &Harness<'_, Viewer>| scene(h).environment.sun().expect("it shines").direction;
    let before = sun(&harness);
    let from = harness.state().lens().project_direction(before).expect("seen");
    let way = vec2(60.0, -40.0);
    drag(&mut harness, from, way);
    harness.drop_at(from + way);
    harness.run_steps(3);
    let now = harness.state().lens().project_direction(sun(&harness)).expect("seen");
    assert!((now - from - way).length() < 1.0, "{now} is not where the pointer is");
    assert_eq!(harness.state().camera, camera);
}
