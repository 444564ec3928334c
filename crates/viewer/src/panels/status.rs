//! The line at the bottom: what is being done, and how far it is.

use crate::viewer::{Command, Viewer};
use egui::Ui;

/// Shows it.
pub fn show(viewer: &mut Viewer, ui: &mut Ui) {
    ui.horizontal(|ui| {
        let name = viewer.document.as_ref().map_or("no scene".to_owned(), |d| {
            format!("{}{}", d.source, if d.is_changed() { " (changed)" } else { "" })
        });
        ui.strong(name);
        ui.separator();
        ui.label(viewer.backend.name.clone()).on_hover_text(&viewer.backend.device);
        ui.separator();
        if let Some(shot) = viewer.shot() {
            let [width, height] = [shot.job.width, shot.job.height];
            let at = if shot.preview {
                format!("{}×{} of {width}×{height}", shot.linear.width(), shot.linear.height())
            } else {
                format!("{width}×{height}")
            };
            ui.label(at);
            ui.add(
                egui::ProgressBar::new(shot.spp as f32 / viewer.render.spp.max(1) as f32)
                    .desired_width(120.0)
                    .text(format!("{} / {} spp", if shot.preview { 0 } else { shot.spp }, viewer.render.spp)),
            );
        }
        if viewer.paused {
            ui.colored_label(ui.visuals().warn_fg_color, "paused");
        }
        let loading: Vec<_> = viewer.loading().iter().map(|l| (l.job.to_string(), l.elapsed())).collect();
        for (name, elapsed) in &loading {
            ui.spinner();
            ui.label(format!("loading {name}, {:.1} s", elapsed.as_secs_f32()));
        }
        if !loading.is_empty() {
            ui.ctx().request_repaint_after(std::time::Duration::from_millis(100));
            if ui.small_button("Stop").clicked() {
                viewer.run(Command::CancelLoading, &ui.ctx().clone());
            }
        }
        if let Some((done, of)) = viewer.recording {
            ui.add(
                egui::ProgressBar::new(done as f32 / of.max(1) as f32)
                    .desired_width(120.0)
                    .text(format!("recording {done} / {of}")),
            );
            if ui.small_button("Stop recording").clicked() {
                viewer.run(Command::StopRecording, &ui.ctx().clone());
            }
        }
        if let Some(notice) = viewer.notices.iter().rev().find(|n| !n.is_error) {
            let age = viewer.time() - notice.time;
            if age < 6.0 {
                ui.label(&notice.text);
                ui.ctx().request_repaint_after(std::time::Duration::from_secs(1));
            }
        }
    });
}
