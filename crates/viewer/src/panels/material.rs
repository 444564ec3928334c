//! The material of the selected object: its numbers and its textures.

use super::textures;
use super::widgets::{bright_colour, check, choice, colour, section, share, slider};
use crate::viewer::{Selection, Viewer};
use alhazen::edits::{Addition, MaterialRecord};
use alhazen::{AlphaMode, Model, TextureSlot};
use egui::Ui;

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
    if numbers(viewer, ui, &mut record, id) {
        viewer.edit(&format!("material {id}"), |edits| drop(edits.materials.insert(id, record)));
    }
    ui.horizontal_wrapped(|ui| {
        if ui.button("Reset material").on_hover_text("Takes back all changes of its numbers.").clicked() {
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
    choice(ui, "Material", &name(chosen), |ui| {
        for id in 0..materials.len() {
            ui.selectable_value(&mut chosen, id, name(id));
        }
    });
    if chosen as u32 != selection.material {
        viewer.assign_material(&viewer.chosen_objects(), chosen as u32);
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

/// What a material consists of, group by group; true when something was changed.
fn numbers(viewer: &mut Viewer, ui: &mut Ui, m: &mut MaterialRecord, id: u32) -> bool {
    let before = m.clone();
    section(ui, "Surface", |ui| surface(viewer, ui, m, id));
    section(ui, "Transmission", |ui| {
        share(ui, "Transmission", &mut m.transmission);
        textures::driver(viewer, ui, id, TextureSlot::Transmission, "R");
        slider(ui, "Index of refraction", &mut m.ior, 1.0..=3.0);
        check(ui, "Thin-walled", &mut m.thin_walled);
    });
    section(ui, "Emission", |ui| {
        bright_colour(ui, "Emission", &mut m.emission, " W/sr/m²");
        textures::driver(viewer, ui, id, TextureSlot::Emission, "RGB");
        check(ui, "Two-sided emission", &mut m.emission_two_sided);
    });
    section(ui, "Visibility", |ui| {
        alpha(ui, m);
        check(ui, "Double-sided", &mut m.double_sided);
    });
    *m != before
}

fn surface(viewer: &mut Viewer, ui: &mut Ui, m: &mut MaterialRecord, id: u32) {
    let model = MODELS.iter().find(|(model, _)| *model == m.model).map_or("", |(_, name)| name);
    choice(ui, "Model", model, |ui| {
        for (model, name) in MODELS {
            ui.selectable_value(&mut m.model, model, name);
        }
    });
    let [r, g, b, a] = m.base_color;
    let mut rgb = [r, g, b];
    if colour(ui, "Base colour", &mut rgb) {
        let [r, g, b] = rgb.map(|c| c.clamp(0.0, 1.0));
        m.base_color = [r, g, b, a];
    }
    textures::driver(viewer, ui, id, TextureSlot::BaseColor, "RGB");
    share(ui, "Metallic", &mut m.metallic);
    textures::driver(viewer, ui, id, TextureSlot::MetallicRoughness, "B");
    share(ui, "Roughness", &mut m.roughness);
    textures::driver(viewer, ui, id, TextureSlot::MetallicRoughness, "G");
    share(ui, "Specular", &mut m.specular);
    textures::driver(viewer, ui, id, TextureSlot::Specular, "A");
    let material = viewer.document.as_ref().and_then(|d| d.scene().materials.get(id as usize));
    if material.is_some_and(|m| m.normal_texture.is_some()) {
        slider(ui, "Normal scale", &mut m.normal_scale, -2.0..=4.0);
        textures::driver(viewer, ui, id, TextureSlot::Normal, "RGB");
    }
}

fn alpha(ui: &mut Ui, m: &mut MaterialRecord) {
    let name = match m.alpha_mode {
        AlphaMode::Opaque => "opaque",
        AlphaMode::Mask(_) => "mask",
        AlphaMode::Blend => "blend",
    };
    choice(ui, "Alpha", name, |ui| {
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
