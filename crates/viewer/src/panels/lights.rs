//! Point, spot and directional lights.

use super::textures;
use super::widgets::{bright_colour, number, row, vector};
use crate::viewer::{Command, Viewer};
use alhazen::{Light, LightKind, LightParameter};
use egui::{CollapsingHeader, Ui};
use glam::Vec3;

/// Shows them.
pub fn show(viewer: &mut Viewer, ui: &mut Ui) {
    let Some(document) = &viewer.document else { return };
    let before = document.edits().lights.clone().unwrap_or_else(|| document.scene().lights.clone());
    let mut lights = before.clone();
    ui.horizontal_wrapped(|ui| {
        if ui.button("Add point light").clicked() {
            viewer.run(Command::AddPointLight, &ui.ctx().clone());
        }
        let at = viewer.camera.target + Vec3::Y * viewer.scene_size() * 0.4;
        if ui.button("Add spot light").clicked() {
            lights.push(spot(at, viewer.scene_size()));
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
        let mark = if viewer.gizmo.light == Some(i) { ", selected" } else { "" };
        let title = format!("{} ({}{mark})", light.name, light.kind.name());
        CollapsingHeader::new(title).id_salt(("light", i)).default_open(i < 3).show(ui, |ui| {
            one(viewer, ui, light, speed);
            ui.horizontal(|ui| {
                if ui.button("Remove").clicked() {
                    removed = Some(i);
                }
                if ui.button("Show handles").clicked() {
                    viewer.select_light(i);
                }
                if ui.button("Aim").on_hover_text("Then click where the light should fall (J).").clicked() {
                    viewer.select_light(i);
                    viewer.run(Command::Aim, &ui.ctx().clone());
                }
            });
        });
    }
    if let Some(i) = removed {
        viewer.gizmo.light = None;
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

fn one(viewer: &mut Viewer, ui: &mut Ui, light: &mut Light, speed: f32) {
    for (label, parameter) in light.kind.parameters() {
        match parameter {
            LightParameter::Position(p) => {
                vector(ui, label, p.as_mut(), speed);
            }
            LightParameter::Direction(d) => {
                vector(ui, label, d.as_mut(), 0.01);
            }
            LightParameter::Strength(strength, unit) => {
                bright_colour(ui, label, strength.as_mut(), &format!(" {unit}"));
            }
            LightParameter::Angle(radians, range) => {
                degrees(ui, label, radians, range.start().to_degrees()..=range.end().to_degrees());
            }
            LightParameter::Picture(picture) => {
                row(ui, label, |ui, _| textures::named(viewer, ui, picture.texture, ""));
            }
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

fn spot(position: Vec3, size: f32) -> Light {
    let (direction, intensity) = (Vec3::NEG_Y, Vec3::splat(size * size));
    Light::new("spot", LightKind::Spot { position, direction, intensity, inner_angle: 0.3, outer_angle: 0.5 })
}

fn directional() -> Light {
    let direction = Vec3::new(-0.4, -1.0, -0.3).normalize();
    let irradiance = Vec3::splat(3.0);
    Light::new("sun", LightKind::Directional { direction, irradiance, angular_diameter: 0.0093 })
}
