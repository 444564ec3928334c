//! The nodes of a texture: what each looks like, takes, and is told.

use super::textures;
use super::widgets::{check, choice, row, slider, vector};
use crate::node_previews::ShownPreview;
use crate::viewer::Viewer;
use alhazen::edits::GraphRecord;
use alhazen::texture_graph::{
    GraphInput, Parameter, Placement, PlacementParts, Space, TextureGraph, TextureGraphNode,
};
use egui::{CollapsingHeader, DragValue, Id, Response, Ui};
use glam::Vec3;

/// Parameters whose range is not wider have a slider.
const WIDEST_SLIDER: f32 = 64.0;
/// Least and greatest scale of a pattern: a scale of 0 would lose its rotation.
const SCALES: [f32; 2] = [1e-6, 1e6];

/// Shows the nodes of texture `id` in their order; the last one is its value.
pub fn show(viewer: &mut Viewer, ui: &mut Ui, id: u32, graph: &TextureGraph) {
    let Some(document) = &viewer.document else { return };
    let mut changed = graph.clone();
    let previews = viewer.previews.of_graph(ui.ctx(), document, id, graph);
    for (number, of_node) in changed.nodes.iter_mut().enumerate() {
        ui.push_id((id, number), |ui| node(ui, number, of_node, previews.get(number)));
    }
    if changed != *graph {
        let record = GraphRecord::from(&changed);
        viewer.edit(&format!("texture {id}"), |edits| drop(edits.textures.insert(id, record)));
    }
    let is_edited = viewer.document.as_ref().is_some_and(|d| d.edits().textures.contains_key(&id));
    if is_edited && ui.button("Reset texture").clicked() {
        viewer.edit("reset texture", |edits| drop(edits.textures.remove(&id)));
    }
}

fn node(ui: &mut Ui, number: usize, node: &mut TextureGraphNode, preview: Option<&ShownPreview>) {
    ui.horizontal_top(|ui| {
        if let Some(ShownPreview { texture, range: [low, high] }) = preview {
            textures::preview(ui, texture, &format!("Preview of node {number}"))
                .on_hover_text(format!("Values from {low:.4} to {high:.4}."));
        }
        ui.vertical(|ui| {
            ui.strong(format!("node {number}: {}", node.kind.name)).on_hover_text(node.kind.purpose);
            for (kind, value) in node.kind.inputs.iter().zip(&mut node.inputs) {
                input(ui, kind.name, value);
            }
            if let Some(offset) = &mut node.offset {
                input(ui, "offset", offset);
            }
            for (kind, value) in node.kind.parameters.iter().zip(&mut node.parameters) {
                parameter(ui, kind, value);
            }
            if node.kind.is_placed {
                placement(ui, &mut node.placement);
            }
        });
    });
}

/// What an input takes: a constant, which can be changed, or a node.
fn input(ui: &mut Ui, name: &str, input: &mut GraphInput) {
    row(ui, name, |ui, label| match input {
        GraphInput::Node(number) => drop(ui.weak(format!("node {number}"))),
        GraphInput::Constant(value) => constant(ui, label, value),
    });
}

/// A number where red, green and blue are the same, and a colour. A number is alpha, too, as in files; a colour that takes
/// the place of a number is opaque.
fn constant(ui: &mut Ui, label: Id, value: &mut [f32; 4]) {
    let [r, g, b, alpha] = *value;
    let is_number = [g, b, alpha] == [r; 3];
    if [g, b] == [r; 2] {
        let mut grey = r;
        if drag(ui, label, &mut grey, [-1e6, 1e6]).changed() {
            *value = [grey, grey, grey, if is_number { grey } else { alpha }];
        }
    }
    let mut color = [r, g, b];
    if ui.color_edit_button_rgb(&mut color).labelled_by(label).changed() {
        let [r, g, b] = color;
        *value = [r, g, b, if is_number { 1.0 } else { alpha }];
    }
}

/// A number of any size: the larger it is, the faster it changes.
fn drag(ui: &mut Ui, label: Id, value: &mut f32, [low, high]: [f32; 2]) -> Response {
    let speed = (value.abs() * 0.01).max(0.002);
    let drag = DragValue::new(value).speed(speed).range(low..=high).clamp_existing_to_range(false);
    ui.add(drag.max_decimals(4)).labelled_by(label)
}

fn parameter(ui: &mut Ui, p: &Parameter, value: &mut f32) {
    let [low, high] = p.range;
    if p.is_switch() {
        let mut on = *value == 1.0;
        if check(ui, p.name, &mut on) {
            *value = f32::from(u8::from(on));
        }
    } else if !p.choices.is_empty() {
        let selected = p.choices.get(*value as usize).copied().unwrap_or_default();
        choice(ui, p.name, selected, |ui| {
            for (i, name) in p.choices.iter().enumerate() {
                ui.selectable_value(value, i as f32, *name);
            }
        });
    } else if high - low <= WIDEST_SLIDER {
        slider(ui, p.name, value, low..=high);
    } else {
        row(ui, p.name, |ui, label| {
            if p.is_whole {
                let mut whole = *value as u32;
                let drag = DragValue::new(&mut whole).speed(0.2).range(low as u32..=high as u32);
                if ui.add(drag).labelled_by(label).changed() {
                    *value = whole as f32;
                }
            } else {
                drag(ui, label, value, p.range);
            }
        });
    }
}

/// The space of a pattern, and how it lies there.
fn placement(ui: &mut Ui, placement: &mut Placement) {
    let title = format!("Placement: {}", placement.space.name());
    CollapsingHeader::new(title).id_salt("placement").show(ui, |ui| {
        choice(ui, "space", placement.space.name(), |ui| {
            for (space, name) in Space::ALL {
                ui.selectable_value(&mut placement.space, space, name);
            }
        });
        let before = PlacementParts::of(&placement.map);
        let mut parts = before;
        parts.scale = scale(ui, before.scale);
        parts.rotate = three(ui, "rotate (°)", before.rotate, 0.5);
        parts.translate = three(ui, "translate", before.translate, 0.01);
        if (parts.scale, parts.rotate) != (before.scale, before.rotate) {
            placement.map = parts.map();
        } else if parts.translate != before.translate {
            placement.map.translation = parts.translate.into();
        }
    });
}

fn three(ui: &mut Ui, label: &str, value: Vec3, speed: f32) -> Vec3 {
    let mut numbers = value.to_array();
    if vector(ui, label, &mut numbers, speed) { numbers.into() } else { value }
}

/// Three scales; each keeps its sign.
fn scale(ui: &mut Ui, value: Vec3) -> Vec3 {
    let [least, most] = SCALES;
    let mut scale = value.to_array();
    let is_changed = row(ui, "scale", |ui, label| {
        scale.iter_mut().fold(false, |changed, s| {
            let range = if *s < 0.0 { [-most, -least] } else { [least, most] };
            drag(ui, label, s, range).changed() | changed
        })
    });
    if is_changed { scale.into() } else { value }
}
