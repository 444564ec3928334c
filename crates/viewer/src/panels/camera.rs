//! The camera: projection, lens, focus, cameras of the file, saved views, automatic orbit.

use super::lights::degrees;
use super::widgets::{check, choice, number, section, vector};
use crate::viewer::{Command, Viewer};
use alhazen::navigation;
use alhazen::{Camera, CameraPath, Projection, ProjectionParameter, Quantity};
use egui::Ui;

/// Shows it.
pub fn show(viewer: &mut Viewer, ui: &mut Ui) {
    ui.horizontal_wrapped(|ui| {
        for (name, command) in [
            ("Home", Command::Home),
            ("Frame everything", Command::Frame),
            ("Perspective / orthographic", Command::ToggleProjection),
        ] {
            if ui.button(name).clicked() {
                viewer.run(command, &ui.ctx().clone());
            }
        }
    });
    section(ui, "View", |ui| numbers(viewer, ui));
    section(ui, "Lens", |ui| lens(viewer, ui));
    section(ui, "Orbit", |ui| orbit(viewer, ui));
    section(ui, "Cameras and saved views", |ui| views(viewer, ui));
}

fn numbers(viewer: &mut Viewer, ui: &mut Ui) {
    let mut camera = viewer.camera.at(viewer.camera_time);
    let before = camera.clone();
    let speed = viewer.scene_size() * 1e-3;
    let (mut eye, mut target) = (camera.eye.to_array(), camera.target.to_array());
    vector(ui, "Eye", &mut eye, speed);
    vector(ui, "Target", &mut target, speed);
    (camera.eye, camera.target) = (eye.into(), target.into());
    projection(ui, &mut camera.projection, speed);
    // A camera that looks nowhere makes no rays.
    if camera != before && camera.eye != camera.target {
        viewer.steer(|c| *c = Camera { path: None, ..camera });
    }
}

/// The kind of projection, and its number.
fn projection(ui: &mut Ui, projection: &mut Projection, speed: f32) {
    choice(ui, "Projection", projection.name(), |ui| {
        for other in Projection::NAMED {
            if ui.selectable_label(other.name() == projection.name(), other.name()).clicked() {
                *projection = other;
            }
        }
    });
    match projection.parameter_mut() {
        Some((ProjectionParameter { label, range: [low, high], quantity: Quantity::Angle, .. }, angle)) => {
            degrees(ui, label, angle, low.max(1.0)..=high);
        }
        Some((ProjectionParameter { label, range: [low, high], .. }, length)) => {
            number(ui, &format!("{label} (m)"), length, speed, low..=high);
        }
        None => {}
    }
}

fn lens(viewer: &mut Viewer, ui: &mut Ui) {
    let mut camera = viewer.camera.clone();
    let mut has_lens = camera.lens_radius > 0.0;
    if check(ui, "Depth of field", &mut has_lens) {
        camera.lens_radius = if has_lens { viewer.scene_size() * 5e-3 } else { 0.0 };
    }
    if has_lens {
        let speed = (camera.lens_radius * 0.02).max(1e-6);
        number(ui, "Lens radius (m)", &mut camera.lens_radius, speed, 0.0..=1e6);
        let speed = (camera.focus_distance * 5e-3).max(1e-5);
        number(ui, "Focus distance (m)", &mut camera.focus_distance, speed, 1e-4..=1e9);
        ui.weak("Ctrl+click in the picture sets the focus distance.");
    }
    if camera != viewer.camera {
        viewer.camera = camera;
        viewer.follows = None;
    }
}

fn orbit(viewer: &mut Viewer, ui: &mut Ui) {
    let label = if viewer.playing { "Stop" } else { "Automatic orbit" };
    if ui.button(label).clicked() {
        viewer.run(Command::Play, &ui.ctx().clone());
    }
    if viewer.camera.path.is_none() && ui.button("Create an orbit from this view").clicked() {
        viewer.camera.path = Some(navigation::orbit_path(&viewer.camera, 0.0, 12.0));
        (viewer.camera_time, viewer.follows) = (0.0, None);
    }
    let speed = viewer.scene_size() * 1e-3;
    let before = viewer.camera.path;
    if let Some(CameraPath::Orbit { radius, height, bob, period, .. }) = &mut viewer.camera.path {
        number(ui, "Orbit radius (m)", radius, speed, 1e-5..=1e9);
        number(ui, "Orbit height (m)", height, speed, -1e9..=1e9);
        number(ui, "Vertical amplitude (m)", bob, speed, -1e9..=1e9);
        number(ui, "Period (s)", period, 0.05, 0.1..=3600.0);
    }
    if viewer.camera.path != before {
        viewer.follows = None;
    }
}

fn views(viewer: &mut Viewer, ui: &mut Ui) {
    let mut chosen = None;
    let mut removed = None;
    ui.weak("Cameras of the scene");
    let mut own = None;
    for (i, camera) in viewer.document.iter().flat_map(|d| d.scene().cameras.iter().enumerate()) {
        if ui.button(&camera.name).clicked() {
            own = Some(i);
        }
    }
    ui.weak("Saved views");
    for (i, view) in viewer.views.iter().enumerate() {
        ui.horizontal(|ui| {
            if ui.button(&view.name).clicked() {
                chosen = Some(view.clone());
            }
            if ui.small_button("Remove").on_hover_text(&view.name).clicked() {
                removed = Some(i);
            }
        });
    }
    if ui.button("Save this view").clicked() {
        viewer.run(Command::KeepView, &ui.ctx().clone());
    }
    if let Some(i) = own {
        viewer.look_through_own(i);
    }
    if let Some(camera) = chosen {
        viewer.look_through(camera);
    }
    if let Some(i) = removed {
        viewer.views.remove(i);
    }
}
