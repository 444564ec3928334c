//! The line at the bottom: what is being done, and how far it is.

use crate::remaining::{Progress, in_words};
use crate::viewer::{Command, Viewer};
use crate::worker::Shot;
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
            ui.label(how_far(viewer, shot)).on_hover_text(NOISE);
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
        recording(viewer, ui);
        if let Some(notice) = viewer.notices.iter().rev().find(|n| !n.is_error) {
            let age = viewer.time() - notice.time;
            if age < 6.0 {
                ui.label(&notice.text);
                ui.ctx().request_repaint_after(std::time::Duration::from_secs(1));
            }
        }
    });
}

/// What the numbers of the picture's noise are.
const NOISE: &str = "Standard error relative to the picture's values, and the time until it is done.";

/// The noise of the picture and the time that it still takes.
fn how_far(viewer: &Viewer, shot: &Shot) -> String {
    if shot.preview {
        return String::new();
    }
    let noise = shot.pass.noise;
    let (wanted, limit) = (viewer.render.spp, viewer.render.noise);
    let progress = Progress { spp: shot.spp, wanted, noise, limit };
    let mut parts = Vec::from_iter(noise.map(|noise| format!("noise {noise:.3}")));
    if progress.share() < 1.0 && !viewer.paused && viewer.recording.is_none() {
        parts.extend(progress.left(shot.pass.total).map(|left| format!("{} left", in_words(left))));
    }
    parts.join(", ")
}

/// What is rendered into files, and how far it is.
fn recording(viewer: &mut Viewer, ui: &mut Ui) {
    let Some(recorded) = &viewer.recording else { return };
    let name = recorded.path.as_ref().and_then(|path| path.file_name()).map(|n| n.to_string_lossy());
    let name = name.map_or_else(|| format!("{} / {} pictures", recorded.done, recorded.of), Into::into);
    let left = recorded.left().map_or(String::new(), |left| format!(", {} left", in_words(left)));
    let waiting =
        if recorded.waiting > 0 { format!(", {} waiting", recorded.waiting) } else { String::new() };
    let text = format!("{name}: {:.0} %", recorded.share() * 100.0);
    ui.add(egui::ProgressBar::new(recorded.share()).desired_width(180.0).text(text));
    ui.label(format!("rendering to a file{left}{waiting}"));
    if ui.small_button("Stop").on_hover_text("Stop rendering to a file").clicked() {
        viewer.run(Command::StopRecording, &ui.ctx().clone());
    }
}
