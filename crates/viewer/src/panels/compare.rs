//! Comparison with another picture, and error metrics.

use super::render::transport;
use super::widgets::{choice, slider, told};
use crate::analysis::{Compared, Difference};
use crate::viewer::{Command, Comparison, Look, Viewer};
use egui::Ui;

/// Shows it.
pub fn show(viewer: &mut Viewer, ui: &mut Ui) {
    ui.horizontal_wrapped(|ui| {
        for (name, command) in [
            ("Two settings", Command::CompareSettings),
            ("Current picture", Command::CompareNow),
            ("File…", Command::CompareFile),
            ("Off", Command::CompareNothing),
        ] {
            if ui.button(name).clicked() {
                viewer.run(command, &ui.ctx().clone());
            }
        }
    });
    if viewer.comparison.split().is_none() {
        ui.weak("A picture that is compared with is B, the reference.");
        return;
    }
    let look = &mut viewer.tools.look;
    choice(ui, "Shown", look.name(), |ui| {
        for one in Look::ALL {
            ui.selectable_value(look, one, one.name());
        }
    });
    let measure = &mut viewer.tools.difference;
    choice(ui, "Difference", measure.name(), |ui| {
        for one in Difference::ALL {
            ui.selectable_value(measure, one, one.name());
        }
    });
    match &mut viewer.comparison {
        Comparison::None => {}
        Comparison::Settings { settings, split } => {
            slider(ui, "Split position", split, 0.0..=1.0);
            ui.label("B");
            let on_gpu = viewer.backend.name.starts_with("gpu");
            transport(ui, "other", on_gpu, settings);
        }
        Comparison::Stored { name, split, .. } => {
            slider(ui, "Split position", split, 0.0..=1.0);
            ui.label(format!("B: {name}"));
        }
    }
    match viewer.tools.findings.as_ref().and_then(|findings| findings.compared.as_ref()) {
        Some(Ok(compared)) => numbers(compared, ui),
        Some(Err(reason)) => drop(ui.colored_label(ui.visuals().warn_fg_color, reason)),
        None => drop(ui.weak("Both pictures are not there yet.")),
    }
}

/// Error metrics of A, B being the reference.
fn numbers(compared: &Compared, ui: &mut Ui) {
    told(ui, "MSE", format!("{:.3e}", compared.mse));
    told(ui, "Relative MSE", format!("{:.3e}", compared.rel_mse));
    told(ui, "PSNR", format!("{:.2} dB", compared.psnr));
    told(ui, "FLIP", format!("{:.4}", compared.flip));
    told(ui, "Mean difference", format!("{:.3e}", compared.mean));
    let (value, [x, y]) = compared.greatest;
    told(ui, "Greatest difference", format!("{value:.3e} at {x}, {y}"));
}
