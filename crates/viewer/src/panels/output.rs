//! Presets of quality, and rendering into files.

use super::widgets::{choice, count, row};
use crate::presets::Preset;
use crate::viewer::{Command, Viewer};
use egui::Ui;

/// Sizes that are offered, pixels.
const SIZES: [[u32; 2]; 4] = [[1280, 720], [1920, 1080], [2560, 1440], [3840, 2160]];

/// The preset that the settings are.
pub fn presets(viewer: &mut Viewer, ui: &mut Ui) {
    let now = Preset::of(&viewer.render, &viewer.shown);
    row(ui, "Quality", |ui, _| {
        for preset in Preset::ALL {
            let button = ui.selectable_label(now == Some(preset), preset.name());
            if button.on_hover_text(preset.about()).clicked() {
                viewer.use_preset(preset);
            }
        }
    });
}

/// Rendering into a file.
pub fn show(viewer: &mut Viewer, ui: &mut Ui) {
    let shown = viewer.size();
    let output = &mut viewer.open.output;
    let text = |size: [u32; 2]| format!("{}×{}", size[0], size[1]);
    let name = output.size.map_or("as shown".to_owned(), text);
    choice(ui, "Size of the file", &name, |ui| {
        ui.selectable_value(&mut output.size, None, "as shown");
        for size in SIZES {
            ui.selectable_value(&mut output.size, Some(size), text(size));
        }
        let own = output.size.filter(|size| !SIZES.contains(size)).unwrap_or(shown);
        ui.selectable_value(&mut output.size, Some(own), "other");
    });
    if let Some([width, height]) = &mut output.size {
        count(ui, "Width of the file (pixels)", width, 1..=32_768);
        count(ui, "Height of the file (pixels)", height, 1..=32_768);
    }
    let name = output.quality.map_or("as on this page", Preset::name);
    choice(ui, "Quality of the file", name, |ui| {
        ui.selectable_value(&mut output.quality, None, "as on this page");
        for preset in Preset::ALL {
            let entry = ui.selectable_value(&mut output.quality, Some(preset), preset.name());
            entry.on_hover_text(preset.about());
        }
    });
    let ctx = ui.ctx().clone();
    ui.horizontal(|ui| {
        if ui.button("Render to a file…").clicked() {
            viewer.run(Command::RenderToFile, &ctx);
        }
        if viewer.recording.is_some() && ui.button("Stop").clicked() {
            viewer.run(Command::StopRecording, &ctx);
        }
    });
}
