//! Comparison with another picture, error metrics, and the pictures that were kept.

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

/// What is done with a picture that was kept.
enum Deed {
    Compare,
    Return,
    Forget,
}

/// The pictures that were kept.
pub fn snapshots(viewer: &mut Viewer, ui: &mut Ui) {
    if ui.button("Keep this picture").clicked() {
        viewer.run(Command::Snapshot, &ui.ctx().clone());
    }
    if viewer.tools.snapshots.is_empty() {
        ui.weak("Snapshots and opened pictures are listed here.");
    }
    let mut deed = None;
    let ctx = ui.ctx().clone();
    for (number, kept) in viewer.tools.snapshots.iter_mut().enumerate() {
        ui.push_id(number, |ui| {
            ui.horizontal(|ui| {
                let small = kept.thumbnail(&ctx);
                let size = small.size_vec2() * (64.0 / small.size_vec2().x);
                let picture = egui::Image::new((small.id(), size)).alt_text(&kept.name);
                ui.add(picture).on_hover_text(&kept.about);
                ui.vertical(|ui| {
                    ui.add(egui::TextEdit::singleline(&mut kept.name).desired_width(160.0));
                    ui.horizontal(|ui| {
                        if ui.small_button("Compare").clicked() {
                            deed = Some((number, Deed::Compare));
                        }
                        let returns = ui.add_enabled(kept.made_by.is_some(), small_button("Go back"));
                        let returns = returns.on_hover_text("Render with its camera and settings again.");
                        if returns.clicked() {
                            deed = Some((number, Deed::Return));
                        }
                        if ui.small_button("Forget").clicked() {
                            deed = Some((number, Deed::Forget));
                        }
                    });
                    ui.weak(&kept.about);
                });
            });
        });
    }
    match deed {
        Some((number, Deed::Compare)) => viewer.compare_with_snapshot(number),
        Some((number, Deed::Return)) => viewer.return_to_snapshot(number),
        Some((number, Deed::Forget)) => viewer.forget_snapshot(number),
        None => {}
    }
}

fn small_button(text: &str) -> egui::Button<'_> {
    egui::Button::new(text).small()
}
