//! Time in scenes that move: a line of controls below the picture. What a control is comes before it; what a box switches, after.

use super::widgets::together;
use crate::numbers::fixed;
use crate::viewer::{Command, Viewer};
use egui::{ComboBox, DragValue, Slider, Ui};

/// Room for the time behind the slider, points.
const TIME: f32 = 120.0;

/// Whether there is anything to show.
pub fn is_needed(viewer: &Viewer) -> bool {
    viewer.document.as_ref().is_some_and(|d| d.scene().is_animated())
}

/// Shows it.
pub fn show(viewer: &mut Viewer, ui: &mut Ui) {
    ui.horizontal_wrapped(|ui| {
        let play = if viewer.clock.playing { "Pause" } else { "Play" };
        for (name, command) in [
            ("Previous frame", Command::StepBack),
            (play, Command::PlayTime),
            ("Next frame", Command::StepOn),
        ] {
            if ui.button(name).clicked() {
                viewer.run(command, &ui.ctx().clone());
            }
        }
        if ui.add_enabled(viewer.clock.shown, egui::Button::new("Rest pose")).clicked() {
            viewer.run(Command::Rest, &ui.ctx().clone());
        }
        scrubber(viewer, ui);
        let clock = &mut viewer.clock;
        ui.checkbox(&mut clock.looping, "Loop").on_hover_text("Starts again after the end.");
        let repeat = ui.checkbox(&mut clock.repeat, "Repeat short clips");
        repeat.on_hover_text("Clips that are shorter than the longest start again by themselves.");
        together(ui, "Speed", 52.0, |ui, name| {
            let speed = DragValue::new(&mut clock.speed).speed(0.01).range(-16.0..=16.0).suffix("×");
            let speed = ui.add(speed).labelled_by(name);
            speed.on_hover_text("Seconds of the scene per second. Negative plays backwards. -16 to 16.");
        });
        together(ui, "Frames per second", 52.0, |ui, name| {
            ui.add(DragValue::new(&mut clock.fps).speed(0.1).range(0.1..=1000.0)).labelled_by(name);
        });
        clips(viewer, ui);
    });
}

fn scrubber(viewer: &mut Viewer, ui: &mut Ui) {
    let (mut frame, last) = (viewer.clock.frame(), viewer.clock.last_frame());
    let text = match viewer.clock.moment().time {
        Some(time) => format!("{} of {:.3} s", fixed(time, 3), viewer.clock.duration()),
        None => "rest pose".to_owned(),
    };
    let slider = (ui.available_width() * 0.5).clamp(100.0, 600.0);
    together(ui, "Frame", slider + 70.0 + TIME, |ui, name| {
        ui.spacing_mut().slider_width = slider;
        if ui.add(Slider::new(&mut frame, 0..=last)).labelled_by(name).changed() {
            viewer.clock.seek(frame);
        }
        ui.label(text);
    });
}

/// A choice of what is played, where there is one.
fn clips(viewer: &mut Viewer, ui: &mut Ui) {
    let Some(document) = &viewer.document else { return };
    let names = document.clips();
    if names.len() < 2 {
        return;
    }
    let mut clip = viewer.clock.clip.clone();
    let shown = clip.clone().unwrap_or_else(|| "first".into());
    together(ui, "Clip", 110.0, |ui, name| {
        let choice = ComboBox::from_id_salt("clip").selected_text(shown).show_ui(ui, |ui| {
            ui.selectable_value(&mut clip, None, "first");
            for name in names {
                ui.selectable_value(&mut clip, Some(name.clone()), name);
            }
        });
        choice.response.labelled_by(name);
    });
    if clip != viewer.clock.clip {
        viewer.play_clip(clip);
    }
}
