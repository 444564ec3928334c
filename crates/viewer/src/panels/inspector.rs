//! What is under the pointer, in numbers.

use crate::numbers::fixed;
use crate::queries::Purpose;
use crate::viewer::Viewer;
use crate::viewport::pixel_at;
use egui::{Grid, Ui};

/// Shows it.
pub fn show(viewer: &mut Viewer, ui: &mut Ui) {
    let Some(at) = viewer.pointer else {
        ui.weak("Move the pointer over the picture.");
        return;
    };
    viewer.ask(at, Purpose::Inspect);
    let Some(shot) = viewer.shot() else { return };
    let [width, height] = [shot.linear.width(), shot.linear.height()];
    let Some((x, y)) = pixel_at(viewer.place, at, width, height) else { return };
    let value = shot.linear.rgb(x, y);
    // It may be enlarged.
    let [columns, rows] = shot.image.size.map(|side| side as u32);
    let Some((column, line)) = pixel_at(viewer.place, at, columns, rows) else { return };
    let shown = shot.image.pixels[(line * columns + column) as usize];
    let count = shot.counts.get((y * width + x) as usize).copied().unwrap_or(0);
    let mut rows = vec![
        ("Pixel", format!("{x}, {y} of {width}×{height}")),
        (viewer.shown.layer.name(), value.map(|v| fixed(v, 5)).join("  ")),
        ("Luminance", fixed(alhazen::luminance(value), 5)),
        ("Display value", format!("{} {} {}", shown.r(), shown.g(), shown.b())),
        ("Samples", count.to_string()),
    ];
    if let Some(other) = viewer.other_value(x, y, [width, height]) {
        rows.push(("Other picture", other.map(|v| fixed(v, 5)).join("  ")));
        let difference: [f32; 3] = std::array::from_fn(|c| value[c] - other[c]);
        rows.push(("Difference", difference.map(|v| format!("{v:+.5}")).join("  ")));
    }
    rows.extend(surface(viewer));
    Grid::new("pixel").striped(true).show(ui, |ui| {
        for (name, value) in rows {
            ui.label(name);
            ui.monospace(value);
            ui.end_row();
        }
    });
    // Answers come later.
    ui.ctx().request_repaint_after(std::time::Duration::from_millis(100));
}

fn surface(viewer: &Viewer) -> Vec<(&'static str, String)> {
    let (Some(seen), Some(document)) = (viewer.under_pointer, &viewer.document) else {
        return vec![("Surface", "none".into())];
    };
    let scene = document.scene();
    let object = scene.instances.get(seen.instance as usize).map_or("", |i| &i.name);
    let material = scene.materials.get(seen.material as usize).map_or("", |m| &m.name);
    let vector = |v: glam::Vec3| v.to_array().map(|v| fixed(v, 4)).join("  ");
    vec![
        ("Object", format!("{} {object}", seen.instance)),
        ("Material", format!("{} {material}", seen.material)),
        ("Primitive", seen.primitive.to_string()),
        ("Distance", format!("{:.4} m", seen.distance)),
        ("Position", vector(seen.position)),
        ("Normal", vector(seen.normal)),
    ]
}
