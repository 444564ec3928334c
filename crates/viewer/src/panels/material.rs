//! The material of the selected object: its numbers and its textures.

use super::textures;
use super::widgets::{bright_colour, share};
use crate::viewer::{Selection, Viewer};
use alhazen::edits::{Addition, MaterialRecord};
use alhazen::{AlphaMode, Model};
use egui::{ComboBox, Slider, Ui};

const MODELS: [(Model, &str); 6] = [
    (Model::MetallicRoughness, "metallic-roughness"),
    (Model::Lambert, "Lambert"),
    (Model::Dielectric, "dielectric"),
    (Model::Mirror, "mirror"),
    (Model::Unlit, "unlit"),
    (Model::Boundary, "medium boundary"),
];

/// Shows it.
pub fn show(viewer: &mut Viewer, ui: &mut Ui, selection: Selection) {
    choose(viewer, ui, selection);
    let Some(document) = &viewer.document else { return };
    let id = viewer.selection.map_or(selection.material, |s| s.material);
    let Some(material) = document.scene().materials.get(id as usize) else { return };
    let users = users(document.scene(), id);
    let mut record = MaterialRecord::from(material);
    if numbers(ui, &mut record, material.normal_texture.is_some()) {
        viewer.edit(&format!("material {id}"), |edits| drop(edits.materials.insert(id, record)));
    }
    ui.horizontal_wrapped(|ui| {
        if ui.button("Reset material").clicked() {
            viewer.edit("reset material", |edits| drop(edits.materials.remove(&id)));
        }
        let own = ui.button("Make unique");
        if own
            .on_hover_text(format!("Copies the material for this object. {users} objects share it."))
            .clicked()
        {
            make_own(viewer, selection.object, id);
        }
    });
    textures::show(viewer, ui, id);
}

/// The list of materials, for another one.
fn choose(viewer: &mut Viewer, ui: &mut Ui, selection: Selection) {
    let Some(document) = &viewer.document else { return };
    let materials = &document.scene().materials;
    let name = |id: usize| materials.get(id).map_or(String::new(), |m| format!("{} ({id})", m.name));
    let mut chosen = selection.material as usize;
    ComboBox::from_label("Material").selected_text(name(chosen)).show_ui(ui, |ui| {
        for id in 0..materials.len() {
            ui.selectable_value(&mut chosen, id, name(id));
        }
    });
    if chosen as u32 != selection.material {
        viewer.edit("assign material", |edits| {
            edits.object(selection.object).material = Some(chosen as u32);
        });
        viewer.selection = Some(Selection { material: chosen as u32, ..selection });
    }
}

/// Number of objects that have a material.
fn users(scene: &alhazen::Scene, id: u32) -> usize {
    let own =
        |mesh: u32| scene.meshes.get(mesh as usize).is_some_and(|m| m.parts.iter().any(|p| p.material == id));
    let uses = |i: &&alhazen::Instance| match &i.materials {
        Some(materials) => materials.contains(&id),
        None => own(i.mesh),
    };
    scene.instances.iter().filter(uses).count()
}

/// Copies the material, with its changes, for one object.
fn make_own(viewer: &mut Viewer, object: u32, id: u32) {
    let Some(document) = &viewer.document else { return };
    let new = document.scene().materials.len() as u32;
    let Some(material) = document.scene().materials.get(id as usize) else { return };
    let mut record = MaterialRecord::from(material);
    record.name += " copy";
    viewer.edit("own material", |edits| {
        edits.additions.push(Addition::Material { of: id });
        edits.materials.insert(new, record);
        edits.object(object).material = Some(new);
    });
    viewer.selection = Some(Selection { object, material: new });
}

/// All numbers; true when one was changed.
fn numbers(ui: &mut Ui, m: &mut MaterialRecord, has_normals: bool) -> bool {
    let before = m.clone();
    let model = MODELS.iter().find(|(model, _)| *model == m.model).map_or("", |(_, name)| name);
    ComboBox::from_label("Model").selected_text(model).show_ui(ui, |ui| {
        for (model, name) in MODELS {
            ui.selectable_value(&mut m.model, model, name);
        }
    });
    ui.horizontal(|ui| {
        let name = ui.label("Base colour");
        let [r, g, b, a] = m.base_color;
        let mut rgb = [r, g, b];
        if ui.color_edit_button_rgb(&mut rgb).labelled_by(name.id).changed() {
            let [r, g, b] = rgb.map(|c| c.clamp(0.0, 1.0));
            m.base_color = [r, g, b, a];
        }
    });
    share(ui, "Metallic", &mut m.metallic);
    share(ui, "Roughness", &mut m.roughness);
    share(ui, "Specular", &mut m.specular);
    ui.add(Slider::new(&mut m.ior, 1.0..=3.0).text("Index of refraction"));
    share(ui, "Transmission", &mut m.transmission);
    ui.checkbox(&mut m.thin_walled, "Thin-walled");
    bright_colour(ui, "Emission", &mut m.emission, " W/sr/m²");
    ui.checkbox(&mut m.emission_two_sided, "Two-sided emission");
    if has_normals {
        ui.add(Slider::new(&mut m.normal_scale, -2.0..=4.0).text("Normal scale"));
    }
    alpha(ui, m);
    ui.checkbox(&mut m.double_sided, "Double-sided");
    *m != before
}

fn alpha(ui: &mut Ui, m: &mut MaterialRecord) {
    let name = match m.alpha_mode {
        AlphaMode::Opaque => "opaque",
        AlphaMode::Mask(_) => "mask",
        AlphaMode::Blend => "blend",
    };
    ComboBox::from_label("Alpha").selected_text(name).show_ui(ui, |ui| {
        ui.selectable_value(&mut m.alpha_mode, AlphaMode::Opaque, "opaque");
        ui.selectable_value(&mut m.alpha_mode, AlphaMode::Mask(0.5), "mask");
        ui.selectable_value(&mut m.alpha_mode, AlphaMode::Blend, "blend");
    });
    if let AlphaMode::Mask(cutoff) = &mut m.alpha_mode {
        share(ui, "Alpha cutoff", cutoff);
    }
    if m.alpha_mode != AlphaMode::Opaque {
        share(ui, "Opacity", &mut m.base_color[3]);
    }
}
