//! The page Image: the pixel under the pointer, the distribution of values, clipping, and comparison.

use super::widgets::{check, section};
use super::{compare, distribution, inspector, snapshots};
use crate::viewer::Viewer;
use egui::Ui;

/// Lines that tell of a pixel, at most.
const ROWS: f32 = 13.0;

/// Shows it.
pub fn show(viewer: &mut Viewer, ui: &mut Ui) {
    section(ui, "Pixel", |ui| {
        // As high with a pixel as without: what is below keeps its place.
        let top = ui.cursor().top();
        inspector::show(viewer, ui);
        let row = ui.spacing().interact_size.y + ui.spacing().item_spacing.y;
        ui.add_space((top + row * ROWS - ui.cursor().top()).max(0.0));
    });
    section(ui, "Distribution", |ui| distribution::show(viewer, ui));
    section(ui, "Overlays", |ui| overlays(viewer, ui));
    section(ui, "Comparison", |ui| compare::show(viewer, ui));
    section(ui, "Snapshots", |ui| snapshots::show(viewer, ui));
}

fn overlays(viewer: &mut Viewer, ui: &mut Ui) {
    check(ui, "Zebra", &mut viewer.tools.zebra);
    let clipping = viewer.tools.findings.as_ref().and_then(|findings| findings.clipping.as_ref());
    if let Some(clipping) = clipping.filter(|_| viewer.tools.zebra) {
        let percent = |share: f32| format!("{:.2} %", share * 100.0);
        ui.weak(format!("white: {}, black: {}", percent(clipping.bright), percent(clipping.dark)));
    }
    check(ui, "Pixel grid", &mut viewer.settings.pixel_grid);
}
