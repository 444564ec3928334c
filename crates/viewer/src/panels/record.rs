//! Recording sequences.

use crate::viewer::{Command, For, Viewer};
use egui::{DragValue, Ui};

/// Shows it.
pub fn show(viewer: &mut Viewer, ui: &mut Ui) {
    ui.separator();
    ui.strong("Record a sequence");
    let choice = &mut viewer.open.record;
    ui.horizontal_wrapped(|ui| {
        for (way, name) in [
            (Command::RecordTurntable, "Turntable"),
            (Command::RecordPath, "Through saved views"),
            (Command::RecordOrbit, "Camera orbit"),
        ] {
            ui.radio_value(&mut choice.way, way, name);
        }
    });
    ui.horizontal(|ui| {
        let name = ui.label("Frames");
        ui.add(DragValue::new(&mut choice.frames).range(1..=100_000)).labelled_by(name.id);
        let name = ui.label("per second");
        ui.add(DragValue::new(&mut choice.fps).range(1.0..=240.0)).labelled_by(name.id);
        let name = ui.label("spp");
        ui.add(DragValue::new(&mut choice.spp).range(1..=1_000_000)).labelled_by(name.id);
    });
    if viewer.recording.is_none() {
        if ui.button("Record…").clicked() {
            viewer.ask_for(For::Record);
        }
    } else if ui.button("Stop recording").clicked() {
        viewer.run(Command::StopRecording, &ui.ctx().clone());
    }
}
