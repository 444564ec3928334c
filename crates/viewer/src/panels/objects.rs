//! The objects of the scene, and the transform and material of the selected one.

use super::widgets::{section, told, vector};
use super::{material, materials, outliner};
use crate::viewer::{COMMANDS, Command, Selection, Viewer};
use egui::Ui;
use glam::{Affine3A, EulerRot, Quat, Vec3};

/// Shows them.
pub fn show(viewer: &mut Viewer, ui: &mut Ui) {
    outliner::show(viewer, ui);
    buttons(viewer, ui);
    match (viewer.selection, viewer.chosen()) {
        (Some(selection), _) => {
            let count = 1 + viewer.also.len();
            if count > 1 {
                ui.label(format!("{count} objects are selected. The numbers are those of one of them:"));
            }
            section(ui, "Transform", |ui| transform(viewer, ui, selection));
            material::show(viewer, ui, selection);
        }
        (None, Some(item)) => {
            let count = viewer.chosen_objects().len();
            ui.strong(viewer.name_of(item).unwrap_or_default().to_owned());
            ui.label(format!("A group of {count} objects."));
        }
        (None, None) => drop(ui.weak("Click an object in the picture or a name to select it.")),
    }
    section(ui, "All materials", |ui| materials::show(viewer, ui));
}

fn buttons(viewer: &mut Viewer, ui: &mut Ui) {
    ui.horizontal_wrapped(|ui| {
        for (name, command) in [
            ("Duplicate", Command::Duplicate),
            ("Delete", Command::Delete),
            ("Hide / show", Command::Hide),
            ("Isolate", Command::Isolate),
            ("Show all", Command::ShowAll),
            ("Rename", Command::Rename),
            ("Frame selection", Command::Frame),
            ("Copy material", Command::CopyMaterial),
            ("Paste material", Command::PasteMaterial),
            ("Add model…", Command::AddModel),
            ("Add sphere light", Command::AddLamp),
        ] {
            let info = COMMANDS.iter().find(|info| info.command == command);
            let about = info.map_or(String::new(), |i| format!("{} {}", i.name, i.shortcut_text(ui.ctx())));
            if ui.button(name).on_hover_text(about).clicked() {
                viewer.run(command, &ui.ctx().clone());
            }
        }
    });
}

/// Position, rotation and scale of the selected object.
fn transform(viewer: &mut Viewer, ui: &mut Ui, selection: Selection) {
    let Some(document) = &viewer.document else { return };
    let Some(instance) = document.scene().instances.get(selection.object as usize) else { return };
    told(ui, "Name", instance.name.clone());
    let Parts { mut position, mut rotation, mut scale } = Parts::of(&instance.transform);
    let original = document.unchanged().instances.get(selection.object as usize).map(|i| i.transform);
    let speed = viewer.scene_size() * 1e-3;
    let mut changed = vector(ui, "Position (m)", &mut position, speed);
    changed |= vector(ui, "Rotation (°)", &mut rotation, 0.5);
    changed |= vector(ui, "Scale", &mut scale, 0.01);
    if changed {
        let transform = Parts { position, rotation, scale }.transform();
        let what = format!("transform {}", selection.object);
        viewer.edit(&what, |edits| edits.object(selection.object).set_transform(&transform));
    }
    if ui.button("Reset transform").clicked() && original.is_some() {
        viewer.edit("reset transform", |edits| edits.object(selection.object).transform = None);
    }
}

/// A transform as people read it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Parts {
    /// Metres.
    position: [f32; 3],
    /// Degrees about x, then y, then z.
    rotation: [f32; 3],
    scale: [f32; 3],
}

impl Parts {
    /// Shear, which these numbers cannot say, is lost when one of them is changed.
    fn of(transform: &Affine3A) -> Self {
        let (scale, rotation, position) = transform.to_scale_rotation_translation();
        let (z, y, x) = rotation.to_euler(EulerRot::ZYX);
        Self {
            position: position.to_array(),
            rotation: [x, y, z].map(f32::to_degrees),
            scale: scale.to_array(),
        }
    }

    fn transform(&self) -> Affine3A {
        let [x, y, z] = self.rotation.map(f32::to_radians);
        let rotation = Quat::from_euler(EulerRot::ZYX, z, y, x);
        // A scale of 0 has no inverse, and rays could not be taken into the object's space.
        let scale = self.scale.map(|s| if s.abs() < 1e-6 { 1e-6 } else { s });
        Affine3A::from_scale_rotation_translation(Vec3::from_array(scale), rotation, self.position.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_make_the_transform_again() {
        let rotation = Quat::from_euler(EulerRot::ZYX, 0.3, -0.5, 1.1);
        let transform = Affine3A::from_scale_rotation_translation(
            Vec3::new(1.0, 2.0, 0.5),
            rotation,
            Vec3::new(3.0, -1.0, 2.0),
        );
        let again = Parts::of(&transform).transform();
        assert!(transform.abs_diff_eq(again, 1e-5), "{transform:?} {again:?}");
        let flat = Parts { scale: [1.0, 0.0, 1.0], ..Parts::of(&transform) };
        assert!(flat.transform().inverse().is_finite());
    }
}
