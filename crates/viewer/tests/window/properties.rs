//! Properties of objects, and pages as a whole.

use super::{open, page, run, scene, until, write_car};
use crate::common::click;
use alhazen::TextureSlot;
use egui::accesskit::Role;
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use viewer::outliner::Item::Object;
use viewer::panels::{Tab, settings};
use viewer::viewer::{Command, Viewer};

fn open_body() -> (tempfile::TempDir, Harness<'static, Viewer>) {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = open(&write_car(folder.path()));
    page(&mut harness, Tab::Objects);
    harness.state_mut().choose(Object(2));
    harness.run_steps(3);
    assert_eq!(scene(&harness).instances[2].name, "body");
    (folder, harness)
}

/// Names of all controls that are shown.
fn controls(harness: &Harness<'_, Viewer>) -> Vec<String> {
    let roles = [Role::Slider, Role::SpinButton, Role::CheckBox, Role::ComboBox, Role::ColorWell];
    let nodes = roles.into_iter().flat_map(|role| harness.query_all_by_role(role).collect::<Vec<_>>());
    nodes.filter_map(|node| node.accesskit_node().label()).collect()
}

#[test]
fn every_control_says_what_it_does() {
    let mut harness = open("three-spheres");
    harness.state_mut().choose(Object(0));
    for (tab, light) in [
        (Tab::Render, None),
        (Tab::Objects, None),
        (Tab::Lights, Some(())),
        (Tab::Sky, None),
        (Tab::Camera, None),
    ] {
        page(&mut harness, tab);
        if light.is_some() {
            ["Add point light", "Add spot light", "Add directional light"]
                .into_iter()
                .for_each(|name| click(&mut harness, name));
        }
        let own = ["Visible: ", "A picture from a file"];
        let controls = controls(&harness);
        for label in controls.iter().filter(|label| !own.iter().any(|own| label.starts_with(own))) {
            assert!(settings::tooltip(label).is_some(), "{tab:?}: {label:?} has no tool-tip");
        }
        assert!(!controls.is_empty(), "{tab:?}");
    }
}

#[test]
fn textured_parameters_show_their_texture() {
    let (_folder, harness) = open_body();
    // Base colour, metallic and roughness.
    assert_eq!(harness.query_all_by_label("Picture of red.png").count(), 3);
    assert!(harness.query_by_label("RGB: red.png").is_some());
    assert!(harness.query_by_label("G: red.png").is_some() && harness.query_by_label("B: red.png").is_some());
    assert!(harness.query_by_label("Base colour: red.png").is_some());
    assert_eq!(harness.query_all_by_label("70 × 30 pixels").count(), 2);
    assert!(harness.query_by_label("roughness in G, metallic in B").is_some());
}

#[test]
fn textures_are_replaced_from_a_file_and_brought_back() {
    let (folder, mut harness) = open_body();
    let picture = alhazen::Image::from_fn(8, 4, |_, _| [0.0, 1.0, 0.0]);
    let file = folder.path().join("green.png");
    picture.write_png_encoded(&file).expect("a picture");
    let replace = harness.query_all_by_label("Replace…").next().expect("a button");
    replace.click();
    harness.run_steps(3);
    assert!(harness.query_by_label("Choose a picture for the texture").is_some());
    let (what, browser) = harness.state_mut().browser.as_mut().expect("a dialog");
    browser.text = file.display().to_string();
    let (what, chosen) = (*what, browser.accept().expect("a file"));
    harness.state_mut().browser = None;
    harness.state_mut().use_file(what, chosen);
    until(&mut harness, "the picture", |v| v.document.as_ref().is_some_and(|d| !d.edits().slots.is_empty()));
    harness.run_steps(3);
    assert!(harness.query_by_label("Base colour: green.png").is_some());
    assert!(harness.query_by_label("8 × 4 pixels").is_some());
    let wanted = harness.state().changes();
    until(&mut harness, "a picture with it", |v| v.shot().is_some_and(|s| s.changes >= wanted));
    assert!(!harness.state().notices.iter().any(|n| n.is_error), "{:?}", harness.state().notices);
    let edited = folder.path().join("edited.toml");
    harness.state_mut().save_scene(&edited);
    let loaded = alhazen::Source::parse_file(&edited).load(&alhazen::LoadOptions::default()).expect("loads");
    let names: Vec<_> = loaded.scene.images.iter().map(|image| image.name.as_str()).collect();
    assert!(names.contains(&"green.png"), "{names:?}");
    click(&mut harness, "Reset");
    assert!(harness.query_by_label("Base colour: red.png").is_some());
    run(&mut harness, Command::Undo);
    assert!(harness.query_by_label("Base colour: green.png").is_some());
}

#[test]
fn coordinates_of_textures_are_moved() {
    let (_folder, mut harness) = open_body();
    harness.state_mut().edit("texture slot", |edits| {
        let record =
            alhazen::edits::UvTransformRecord { offset: [0.5, 0.0], rotation: 0.0, scale: [2.0, 2.0] };
        edits.slot(0, TextureSlot::BaseColor).transform = Some(record);
    });
    harness.run_steps(3);
    let texture = scene(&harness).materials[0].base_color_texture.expect("a texture");
    assert_eq!(texture.transform.offset.x, 0.5);
    assert!(harness.query_all_by_label("UV scale").next().is_some());
    assert!(harness.query_by_label("Reset").is_some(), "only what is edited is reset");
    click(&mut harness, "Reset");
    assert_eq!(scene(&harness).materials[0].base_color_texture.expect("a texture").transform.offset.x, 0.0);
}

#[test]
fn pages_do_not_push_the_panel_wider() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = open(&write_car(folder.path()));
    harness.state_mut().choose(Object(2));
    harness.state_mut().shown.tone.exposure = 1.0 / 1.234_56;
    harness.run_steps(10);
    let width = |h: &Harness<'_, Viewer>| h.state().place.width();
    let before = width(&harness);
    for tab in Tab::ALL {
        page(&mut harness, tab);
        harness.run_steps(10);
        assert_eq!(width(&harness), before, "{tab:?}");
    }
}

/// The pointer rests in the middle of a drag, longer than two changes of keys may be apart.
#[test]
fn a_drag_that_pauses_is_one_step() {
    let mut harness = open("cornell");
    page(&mut harness, Tab::Objects);
    harness.state_mut().choose(Object(0));
    harness.run_steps(3);
    let slider = harness.get_by_role_and_label(Role::Slider, "Roughness").rect();
    let at = |share: f32| egui::pos2(slider.left() + share * slider.width(), slider.center().y);
    let roughness = |h: &Harness<'_, Viewer>| {
        scene(h).materials[h.state().selection.unwrap().material as usize].roughness
    };
    let before = roughness(&harness);
    harness.drag_at(at(0.1));
    harness.run_steps(2);
    for share in [0.2, 0.3] {
        harness.hover_at(at(share));
        harness.run_steps(2);
        std::thread::sleep(std::time::Duration::from_millis(900));
        harness.run_steps(1);
    }
    harness.drop_at(at(0.3));
    harness.run_steps(2);
    assert_ne!(roughness(&harness), before);
    run(&mut harness, Command::Undo);
    assert_eq!(roughness(&harness), before, "a drag is several steps");
    assert!(!harness.state().document.as_ref().expect("open").can_undo_redo().0);
}

#[test]
fn tabs_are_in_one_row() {
    let mut harness = open("cornell");
    page(&mut harness, Tab::Sky);
    let rows: Vec<f32> = Tab::ALL
        .map(|tab| {
            harness.query_all_by_label(tab.name()).map(|n| n.rect().top()).fold(f32::INFINITY, f32::min)
        })
        .to_vec();
    // "File" is in the menu, too, which is above.
    let others = &rows[..Tab::ALL.len() - 1];
    assert!(others.iter().all(|top| *top == others[0]), "{rows:?}");
}

#[test]
fn no_number_is_a_negative_zero() {
    let mut harness = open("cornell");
    page(&mut harness, Tab::Objects);
    let turned =
        glam::Affine3A::from_rotation_y(-0.0) * glam::Affine3A::from_translation(glam::Vec3::splat(-0.0));
    harness.state_mut().edit("move", |edits| edits.object(0).set_transform(&turned));
    harness.state_mut().choose(Object(0));
    harness.state_mut().shown.tone.exposure = 0.999_999;
    for tab in Tab::ALL {
        page(&mut harness, tab);
        let roles = [Role::SpinButton, Role::Slider, Role::Label];
        for node in roles.into_iter().flat_map(|role| harness.query_all_by_role(role)) {
            let text = node.accesskit_node().value().unwrap_or_default();
            let is_zero =
                !text.is_empty() && text.chars().all(|c| "-−+0.°".contains(c)) && text.contains('0');
            assert!(!is_zero || text.starts_with('0'), "{tab:?}: {text}");
        }
    }
}
