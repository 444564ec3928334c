//! The open file and what was noticed while loading it.

use super::widgets::check;
use crate::viewer::{Command, Viewer};
use alhazen::Severity;
use egui::Ui;

/// Shows it.
pub fn show(viewer: &mut Viewer, ui: &mut Ui) {
    check(ui, "Reload when the file changes", &mut viewer.settings.watch);
    check(ui, "Built-in file dialog", &mut viewer.settings.own_dialogs);
    if ui.button("Reload").clicked() {
        viewer.run(Command::Reload, &ui.ctx().clone());
    }
    if let Some(document) = &viewer.document {
        ui.strong(document.source.to_string());
        let report = &document.report;
        let megabytes = report.bytes_read as f64 * 1e-6;
        ui.label(format!("loaded in {:.2} s, {megabytes:.1} MB read", report.elapsed.as_secs_f64()));
        for note in &report.notes {
            let colour = match note.severity {
                Severity::Info => ui.visuals().text_color(),
                Severity::Repaired | Severity::Approximated => ui.visuals().warn_fg_color,
                Severity::Ignored => ui.visuals().error_fg_color,
            };
            ui.colored_label(colour, note.to_string());
        }
        if report.notes.is_empty() {
            ui.weak("Nothing was ignored or repaired.");
        }
    }
    ui.separator();
    ui.strong("Messages");
    for notice in viewer.notices.iter().rev() {
        let colour = if notice.is_error { ui.visuals().error_fg_color } else { ui.visuals().text_color() };
        ui.colored_label(colour, &notice.text);
    }
}
