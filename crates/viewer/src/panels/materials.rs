//! The list of all materials. They are dragged from here onto objects in the picture.

use crate::viewer::Viewer;
use alhazen::{MaterialId, Model};
use egui::{Color32, DragAndDrop, Id, LayerId, Order, Sense, Ui, vec2};

/// A material that is dragged, by its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DraggedMaterial(pub MaterialId);

/// Height of the list, points.
const HEIGHT: f32 = 150.0;
/// Side of the square with a material's colour, points.
const SWATCH: f32 = 14.0;

/// Shows it; only the lines that are seen are made.
pub fn show(viewer: &mut Viewer, ui: &mut Ui) {
    ui.weak("Drag one onto an object in the picture, or click it for what is selected.");
    let Some(document) = &viewer.document else { return };
    let materials = &document.scene().materials;
    let line = ui.spacing().interact_size.y;
    let active = viewer.selection.map(|selection| selection.material);
    let mut clicked = None;
    let area = egui::ScrollArea::vertical().id_salt("materials").auto_shrink([false, true]);
    area.max_height(HEIGHT).show_rows(ui, line, materials.len(), |ui, seen| {
        for (id, material) in seen.clone().zip(&materials[seen]) {
            let text = format!("{} ({id})", material.name);
            ui.horizontal(|ui| {
                let (place, _) = ui.allocate_exact_size(vec2(SWATCH, SWATCH), Sense::hover());
                ui.painter().rect_filled(place, 2.0, swatch(material));
                let button = egui::Button::selectable(active == Some(id as MaterialId), &text).truncate();
                let response = ui.add(button.sense(Sense::click_and_drag()));
                response.dnd_set_drag_payload(DraggedMaterial(id as MaterialId));
                if response.clicked() {
                    clicked = Some(id as MaterialId);
                }
            });
        }
    });
    if let Some(id) = clicked {
        match viewer.chosen_objects() {
            objects if objects.is_empty() => {
                viewer.notice("select the objects that get the material, or drag it onto one", false);
            }
            objects => viewer.assign_material(&objects, id),
        }
    }
}

/// The colour that a material is listed with: what it emits, or its base colour.
fn swatch(material: &alhazen::Material) -> Color32 {
    let emitted = material.emission;
    let brightest = emitted.max_element();
    let linear = match material.model {
        _ if brightest > 0.0 => emitted / brightest,
        Model::Mirror | Model::Dielectric => glam::Vec3::ONE * 0.8,
        _ => glam::Vec3::new(material.base_color.x, material.base_color.y, material.base_color.z),
    };
    let [r, g, b] =
        linear.to_array().map(|v| (alhazen::srgb_encode(v.clamp(0.0, 1.0)) * 255.0).round() as u8);
    Color32::from_rgb(r, g, b)
}

/// Shows what is dragged beside the pointer.
pub fn paint_dragged(viewer: &Viewer, ctx: &egui::Context) {
    let Some(dragged) = DragAndDrop::payload::<DraggedMaterial>(ctx) else { return };
    let Some(at) = ctx.pointer_interact_pos() else { return };
    let layer = LayerId::new(Order::Tooltip, Id::unique("dragged material"));
    let name = viewer.material_name(dragged.0).unwrap_or_default();
    let painter = ctx.layer_painter(layer);
    crate::viewer::outlined_text(&painter, at + vec2(14.0, 0.0), egui::Align2::LEFT_CENTER, name);
}
