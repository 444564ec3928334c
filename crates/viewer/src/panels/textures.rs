//! The textures of a material: what each of its parameters takes from place to place.

use super::graph;
use crate::node_previews::graph_of;
use crate::thumbnails::SIDE;
use crate::viewer::Viewer;
use alhazen::{Material, Scene, Texture, TextureRef};
use egui::load::SizedTexture;
use egui::{CollapsingHeader, Image, Ui, vec2};

/// Shows those of a material.
pub fn show(viewer: &mut Viewer, ui: &mut Ui, material: u32) {
    let Some(document) = &viewer.document else { return };
    let scene = document.scene();
    let Some(of_material) = scene.materials.get(material as usize) else { return };
    let title = |(name, shown): (&'static str, TextureRef)| {
        let text = match scene.textures.get(shown.texture as usize)? {
            Texture::Image(texture) => {
                let image = scene.images.get(texture.image as usize)?;
                format!("{name}: {}", image.name)
            }
            Texture::Graph(graph) => format!("{name}: {}", graph.summary()),
        };
        Some((name, text, shown.texture))
    };
    let slots: Vec<_> = slots(of_material, scene).into_iter().filter_map(title).collect();
    for (slot, title, id) in slots {
        let header = CollapsingHeader::new(title).id_salt((slot, id)).default_open(true);
        header.show(ui, |ui| texture(viewer, ui, id));
    }
}

/// Parameters of a material that have a texture, as the user calls them.
fn slots(m: &Material, scene: &Scene) -> Vec<(&'static str, TextureRef)> {
    let l = &m.layers;
    let is_graph = |shown: &TextureRef| graph_of(scene, shown.texture).is_some();
    // Where there are heights, they take the place of a normal map.
    let normal = if m.normal_texture.as_ref().is_some_and(is_graph) { "Height" } else { "Normal map" };
    let all = [
        ("Base colour", &m.base_color_texture),
        ("Roughness and metalness", &m.metallic_roughness_texture),
        (normal, &m.normal_texture),
        ("Emission", &m.emission_texture),
        ("Transmission", &m.transmission_texture),
        ("Specular", &l.specular_texture),
        ("Specular colour", &l.specular_color_texture),
        ("Clearcoat", &l.clearcoat.texture),
        ("Clearcoat roughness", &l.clearcoat.roughness_texture),
        ("Clearcoat normal map", &l.clearcoat.normal_texture),
        ("Sheen colour", &l.sheen.color_texture),
        ("Sheen roughness", &l.sheen.roughness_texture),
        ("Iridescence", &l.iridescence.texture),
        ("Iridescence thickness", &l.iridescence.thickness_texture),
        ("Anisotropy", &l.anisotropy.texture),
        ("Diffuse transmission", &l.diffuse_transmission.texture),
        ("Diffuse transmission colour", &l.diffuse_transmission.color_texture),
    ];
    all.into_iter().filter_map(|(name, texture)| Some((name, (*texture)?))).collect()
}

/// Number of materials that have a texture.
fn users(scene: &Scene, id: u32) -> usize {
    let uses = |m: &&Material| slots(m, scene).iter().any(|(_, shown)| shown.texture == id);
    scene.materials.iter().filter(uses).count()
}

/// One texture: a picture, or nodes.
fn texture(viewer: &mut Viewer, ui: &mut Ui, id: u32) {
    let Some(document) = &viewer.document else { return };
    match document.scene().textures.get(id as usize) {
        None => {}
        Some(Texture::Image(texture)) => {
            let size = document.image_size(texture.image);
            let picture = viewer.previews.of_image(ui.ctx(), document, id);
            ui.horizontal(|ui| {
                preview(ui, picture, &format!("Preview of texture {id}"));
                if let Some([width, height]) = size {
                    ui.label(format!("{width} × {height} pixels"));
                }
            });
        }
        Some(Texture::Graph(nodes)) => {
            let nodes = nodes.clone();
            let users = users(document.scene(), id);
            if users > 1 {
                ui.weak(format!("{users} materials share it."));
            }
            graph::show(viewer, ui, id, &nodes);
        }
    }
}

/// A small picture; `name` is for those who do not see it.
pub(super) fn preview(ui: &mut Ui, picture: &egui::TextureHandle, name: &str) -> egui::Response {
    let side = SIDE as f32;
    ui.add(Image::new(SizedTexture::new(picture.id(), vec2(side, side))).alt_text(name))
}
