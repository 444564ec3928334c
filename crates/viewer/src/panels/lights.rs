//! Point, spot and directional lights.

use super::widgets::{bright_colour, number, vector};
use crate::viewer::{Command, Viewer};
use alhazen::edits::LightRecord;
use egui::{CollapsingHeader, Ui};

/// Shows them.
pub fn show(viewer: &mut Viewer, ui: &mut Ui) {
    let Some(document) = &viewer.document else { return };
    let before: Vec<LightRecord> = match &document.edits().lights {
        Some(lights) => lights.clone(),
        None => document.scene().lights.iter().map(LightRecord::from).collect(),
    };
    let mut lights = before.clone();
    ui.horizontal_wrapped(|ui| {
        if ui.button("Add point light").clicked() {
            viewer.run(Command::AddPointLight, &ui.ctx().clone());
        }
        let at = viewer.camera.target + glam::Vec3::Y * viewer.scene_size() * 0.4;
        if ui.button("Add spot light").clicked() {
            lights.push(spot(at.to_array(), viewer.scene_size()));
        }
        if ui.button("Add directional light").clicked() {
            lights.push(directional());
        }
        if ui.button("Add sphere light").clicked() {
            viewer.run(Command::AddLamp, &ui.ctx().clone());
        }
    });
    if lights.is_empty() {
        ui.weak("No lights. Emissive surfaces are objects whose material has an emission.");
    }
    let mut removed = None;
    let speed = viewer.scene_size() * 1e-3;
    for (i, light) in lights.iter_mut().enumerate() {
        let title = format!("{} ({})", light.name(), kind(light));
        CollapsingHeader::new(title).id_salt(("light", i)).default_open(i < 3).show(ui, |ui| {
            one(ui, light, speed);
            if ui.button("Remove").clicked() {
                removed = Some(i);
            }
        });
    }
    if let Some(i) = removed {
        lights.remove(i);
    }
    if lights != before {
        viewer.edit_lights("lights", |all| *all = lights);
    }
    let is_edited = viewer.document.as_ref().is_some_and(|d| d.edits().lights.is_some());
    if is_edited && ui.button("Reset lights").clicked() {
        viewer.edit("reset lights", |edits| edits.lights = None);
    }
}

fn kind(light: &LightRecord) -> &'static str {
    match light {
        LightRecord::Point { .. } => "point",
        LightRecord::Spot { .. } => "spot",
        LightRecord::Directional { .. } => "directional",
    }
}

fn one(ui: &mut Ui, light: &mut LightRecord, speed: f32) {
    match light {
        LightRecord::Point { position, intensity, .. } => {
            vector(ui, "Position", position, speed);
            bright_colour(ui, "Intensity", intensity, " W/sr");
        }
        LightRecord::Spot { position, direction, intensity, inner_angle, outer_angle, .. } => {
            vector(ui, "Position", position, speed);
            vector(ui, "Direction", direction, 0.01);
            bright_colour(ui, "Intensity", intensity, " W/sr");
            degrees(ui, "Outer cone angle", outer_angle, 0.5..=90.0);
            degrees(ui, "Inner cone angle", inner_angle, 0.0..=89.0);
        }
        LightRecord::Directional { direction, irradiance, angular_diameter, .. } => {
            vector(ui, "Direction", direction, 0.01);
            bright_colour(ui, "Irradiance", irradiance, " W/m²");
            degrees(ui, "Angular diameter", angular_diameter, 0.0..=90.0);
        }
    }
}

/// An angle, shown in degrees and kept in radians; a value that is not touched stays bit for bit.
pub(super) fn degrees(ui: &mut Ui, label: &str, radians: &mut f32, range: std::ops::RangeInclusive<f32>) {
    let mut shown = radians.to_degrees();
    if number(ui, &format!("{label} (°)"), &mut shown, 0.25, range) {
        *radians = shown.to_radians();
    }
}

fn spot(position: [f32; 3], size: f32) -> LightRecord {
    LightRecord::Spot {
        name: "spot".into(),
        position,
        direction: [0.0, -1.0, 0.0],
        intensity: [size * size; 3],
        inner_angle: 0.3,
        outer_angle: 0.5,
        profile: None,
    }
}

fn directional() -> LightRecord {
    let direction = glam::Vec3::new(-0.4, -1.0, -0.3).normalize().to_array();
    LightRecord::Directional { name: "sun".into(), direction, irradiance: [3.0; 3], angular_diameter: 0.0093 }
}
