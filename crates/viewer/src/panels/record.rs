//! Recording sequences.

use super::widgets::{count, number, section};
use crate::viewer::{Command, For, Viewer};
use egui::Ui;

/// Shows it.
pub fn show(viewer: &mut Viewer, ui: &mut Ui) {
    section(ui, "Record a sequence", |ui| sequence(viewer, ui));
}

fn sequence(viewer: &mut Viewer, ui: &mut Ui) {
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
    let mut frames = choice.frames as u32;
    if count(ui, "Frames", &mut frames, 1..=100_000) {
        choice.frames = frames as usize;
    }
    number(ui, "Frames per second", &mut choice.fps, 0.1, 1.0..=240.0);
    count(ui, "Samples per pixel of a sequence", &mut choice.spp, 1..=1_000_000);
    if ui.button("Record…").clicked() {
        viewer.ask_for(For::Record);
    }
    if viewer.recording.is_some() && ui.button("Stop recording").clicked() {
        viewer.run(Command::StopRecording, &ui.ctx().clone());
    }
}
