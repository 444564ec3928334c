//! The textures of a material: what each of its parameters takes from place to place.

use super::graph;
use super::widgets::{count, number, row, section, told, vector};
use crate::node_previews::graph_of;
use crate::thumbnails::SIDE;
use crate::viewer::{For, Viewer};
use alhazen::edits::UvTransformRecord;
use alhazen::{ColorSpace, Material, Scene, Texture, TextureRef, TextureSlot};
use egui::load::SizedTexture;
use egui::{CollapsingHeader, ComboBox, Image, Ui, vec2};

/// The side of a picture beside a parameter, points.
const SIGN: f32 = 18.0;

/// Shows those of a material.
pub fn show(viewer: &mut Viewer, ui: &mut Ui, material: u32) {
    section(ui, "Textures", |ui| {
        let Some(document) = &viewer.document else { return };
        let scene = document.scene();
        let Some(of_material) = scene.materials.get(material as usize) else { return };
        let title = |(slot, shown): (TextureSlot, TextureRef)| {
            let text =
                format!("{}: {}", slot_name(of_material, scene, slot), texture_name(scene, shown.texture)?);
            Some((slot, text, shown))
        };
        let slots: Vec<_> = slots(of_material).filter_map(title).collect();
        for (slot, title, shown) in slots {
            let header = CollapsingHeader::new(title).id_salt((slot, shown.texture)).default_open(true);
            header.show(ui, |ui| texture(viewer, ui, material, slot, &shown));
        }
        add(viewer, ui, material);
    });
}

/// Slots of a material that have a texture.
fn slots(material: &Material) -> impl Iterator<Item = (TextureSlot, TextureRef)> {
    TextureSlot::ALL.into_iter().filter_map(|slot| Some((slot, material.texture(slot)?)))
}

/// What the user calls a slot.
fn slot_name(material: &Material, scene: &Scene, slot: TextureSlot) -> &'static str {
    match slot {
        TextureSlot::BaseColor => "Base colour",
        TextureSlot::MetallicRoughness => "Roughness and metalness",
        // Where there are heights, they take the place of a normal map.
        TextureSlot::Normal => match material.normal_texture {
            Some(shown) if graph_of(scene, shown.texture).is_some() => "Height",
            _ => "Normal map",
        },
        TextureSlot::Emission => "Emission",
        TextureSlot::Transmission => "Transmission",
        TextureSlot::Specular => "Specular",
        TextureSlot::SpecularColor => "Specular colour",
        TextureSlot::Clearcoat => "Clearcoat",
        TextureSlot::ClearcoatRoughness => "Clearcoat roughness",
        TextureSlot::ClearcoatNormal => "Clearcoat normal map",
        TextureSlot::SheenColor => "Sheen colour",
        TextureSlot::SheenRoughness => "Sheen roughness",
        TextureSlot::Iridescence => "Iridescence",
        TextureSlot::IridescenceThickness => "Iridescence thickness",
        TextureSlot::Anisotropy => "Anisotropy",
        TextureSlot::DiffuseTransmission => "Diffuse transmission",
        TextureSlot::DiffuseTransmissionColor => "Diffuse transmission colour",
    }
}

/// The name of a texture: that of its picture, or what its nodes are.
pub(super) fn texture_name(scene: &Scene, id: u32) -> Option<String> {
    Some(match scene.textures.get(id as usize)? {
        Texture::Image(texture) => scene.images.get(texture.image as usize)?.name.clone(),
        Texture::Graph(graph) => graph.summary(),
    })
}

/// Below a number: the texture that it is multiplied with, if there is one.
pub(super) fn driver(viewer: &mut Viewer, ui: &mut Ui, material: u32, slot: TextureSlot, channel: &str) {
    let Some(document) = &viewer.document else { return };
    let material = document.scene().materials.get(material as usize);
    let Some(shown) = material.and_then(|material| material.texture(slot)) else { return };
    row(ui, "", |ui, _| {
        ui.weak("×");
        named(viewer, ui, shown.texture, &format!("{channel}: "));
    });
}

/// A small picture of a texture and its name, with something before it.
pub(super) fn named(viewer: &mut Viewer, ui: &mut Ui, id: u32, before: &str) {
    let Some(document) = &viewer.document else { return };
    let Some(name) = texture_name(document.scene(), id) else { return };
    let picture = match graph_of(document.scene(), id).cloned() {
        None => Some(viewer.previews.of_image(ui.ctx(), document, id).clone()),
        Some(graph) => {
            let nodes = viewer.previews.of_graph(ui.ctx(), document, id, &graph);
            nodes.last().map(|shown| shown.texture.clone())
        }
    };
    if let Some(picture) = picture {
        let sized = SizedTexture::new(picture.id(), vec2(SIGN, SIGN));
        ui.add(Image::new(sized).alt_text(format!("Picture of {name}")));
    }
    ui.add(egui::Label::new(format!("{before}{name}")).truncate())
        .on_hover_text("A texture drives this from place to place. It is below, among the textures.");
}

/// Number of materials that have a texture.
fn users(scene: &Scene, id: u32) -> usize {
    scene.materials.iter().filter(|m| slots(m).any(|(_, shown)| shown.texture == id)).count()
}

/// One texture: a picture, or nodes.
fn texture(viewer: &mut Viewer, ui: &mut Ui, material: u32, slot: TextureSlot, shown: &TextureRef) {
    let Some(document) = &viewer.document else { return };
    let id = shown.texture;
    match document.scene().textures.get(id as usize) {
        None => {}
        Some(Texture::Image(texture)) => {
            let (size, space) = (document.image_size(texture.image), texture.color_space);
            let picture = viewer.previews.of_image(ui.ctx(), document, id).clone();
            ui.horizontal(|ui| {
                preview(ui, &picture, &format!("Preview of texture {id}"));
                ui.vertical(|ui| {
                    if let Some([width, height]) = size {
                        ui.label(format!("{width} × {height} pixels"));
                    }
                    ui.horizontal(|ui| replace(viewer, ui, material, slot));
                });
            });
            told(ui, "Channels", slot.channels());
            told(ui, "Colour space", if space == ColorSpace::Srgb { "sRGB" } else { "linear" });
            coordinates(viewer, ui, material, slot, shown);
        }
        Some(Texture::Graph(nodes)) => {
            let nodes = nodes.clone();
            let users = users(document.scene(), id);
            if users > 1 {
                ui.weak(format!("{users} materials share it."));
            }
            ui.horizontal(|ui| replace(viewer, ui, material, slot));
            graph::show(viewer, ui, id, &nodes);
        }
    }
}

/// Another picture, or the file's own texture again.
fn replace(viewer: &mut Viewer, ui: &mut Ui, material: u32, slot: TextureSlot) {
    if ui.button("Replace…").on_hover_text("Another picture from a file, for this material.").clicked() {
        viewer.ask_for(For::Texture(material, slot));
    }
    let edits = viewer.document.as_ref().map(|d| d.edits());
    let is_edited = edits.is_some_and(|e| e.slots.get(&material).is_some_and(|s| s.contains_key(&slot)));
    if is_edited && ui.button("Reset").on_hover_text("The texture of the file, as it was.").clicked() {
        viewer.edit("reset texture slot", |edits| {
            if let Some(slots) = edits.slots.get_mut(&material) {
                slots.remove(&slot);
            }
            edits.slots.retain(|_, slots| !slots.is_empty());
        });
    }
}

/// Where on a surface a picture lies.
fn coordinates(viewer: &mut Viewer, ui: &mut Ui, material: u32, slot: TextureSlot, shown: &TextureRef) {
    let (mut uv_set, before) = (shown.uv_set, UvTransformRecord::from(&shown.transform));
    let mut record = before;
    let set_changed = count(ui, "UV set", &mut uv_set, 0..=1);
    vector(ui, "UV offset", &mut record.offset, 0.005);
    let mut degrees = record.rotation.to_degrees();
    if number(ui, "UV rotation (°)", &mut degrees, 0.25, -360.0..=360.0) {
        record.rotation = degrees.to_radians();
    }
    vector(ui, "UV scale", &mut record.scale, 0.01);
    if set_changed || record != before {
        viewer.edit(&format!("texture slot {material} {slot:?}"), |edits| {
            let edit = edits.slot(material, slot);
            edit.uv_set = if set_changed { Some(uv_set) } else { edit.uv_set };
            edit.transform = if record == before { edit.transform } else { Some(record) };
        });
    }
}

/// A picture for a slot that has no texture.
fn add(viewer: &mut Viewer, ui: &mut Ui, material: u32) {
    let Some(document) = &viewer.document else { return };
    let scene = document.scene();
    let Some(of_material) = scene.materials.get(material as usize) else { return };
    let free = TextureSlot::ALL.into_iter().filter(|slot| of_material.texture(*slot).is_none());
    let free: Vec<_> = free.map(|slot| (slot, slot_name(of_material, scene, slot))).collect();
    let mut chosen = None;
    let list = ComboBox::from_id_salt("add texture").selected_text("Add a texture…").show_ui(ui, |ui| {
        for (slot, name) in free {
            if ui.selectable_label(false, name).clicked() {
                chosen = Some(slot);
            }
        }
    });
    list.response.on_hover_text("A picture from a file for a parameter that has no texture.");
    if let Some(slot) = chosen {
        viewer.ask_for(For::Texture(material, slot));
    }
}

/// A small picture; `name` is for those who do not see it.
pub(super) fn preview(ui: &mut Ui, picture: &egui::TextureHandle, name: &str) -> egui::Response {
    let side = SIDE as f32;
    ui.add(Image::new(SizedTexture::new(picture.id(), vec2(side, side))).alt_text(name))
}
