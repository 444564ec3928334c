//! Time in scenes that move: a line of controls below the picture. What a control is comes before it; what a box switches, after.

use crate::viewer::{Command, Viewer};
use egui::{ComboBox, DragValue, Slider, Ui};

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
        ui.checkbox(&mut clock.looping, "Loop");
        ui.checkbox(&mut clock.repeat, "Repeat short clips");
        let name = ui.label("Speed");
        ui.add(DragValue::new(&mut clock.speed).speed(0.01).range(-16.0..=16.0).suffix("×"))
            .labelled_by(name.id);
        let name = ui.label("Frames per second");
        ui.add(DragValue::new(&mut clock.fps).speed(0.1).range(0.1..=1000.0)).labelled_by(name.id);
        clips(viewer, ui);
    });
}

fn scrubber(viewer: &mut Viewer, ui: &mut Ui) {
    let (mut frame, last) = (viewer.clock.frame(), viewer.clock.last_frame());
    let name = ui.label("Frame");
    let width = ui.spacing().slider_width;
    ui.spacing_mut().slider_width = (ui.available_width() * 0.5).clamp(100.0, 600.0);
    if ui.add(Slider::new(&mut frame, 0..=last)).labelled_by(name.id).changed() {
        viewer.clock.seek(frame);
    }
    ui.spacing_mut().slider_width = width;
    match viewer.clock.moment().time {
        Some(time) => ui.label(format!("{time:.3} of {:.3} s", viewer.clock.duration())),
        None => ui.weak("rest pose"),
    };
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
    let name = ui.label("Clip");
    let choice = ComboBox::from_id_salt("clip").selected_text(shown).show_ui(ui, |ui| {
        ui.selectable_value(&mut clip, None, "first");
        for name in names {
            ui.selectable_value(&mut clip, Some(name.clone()), name);
        }
    });
    choice.response.labelled_by(name.id);
    if clip != viewer.clock.clip {
        viewer.play_clip(clip);
    }
}
