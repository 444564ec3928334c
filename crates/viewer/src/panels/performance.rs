//! How fast it is: frames, passes, devices, memory, counts.

use crate::viewer::{Command, Viewer};
use egui::{Color32, Grid, Ui};
use egui_plot::{HLine, Line, Plot, PlotPoints};

/// Frame times at which 60 and 30 frames a second are missed, milliseconds.
const LIMITS: [(f64, &str); 2] = [(16.7, "16.7 ms"), (33.3, "33.3 ms")];

/// Shows it.
pub fn show(viewer: &mut Viewer, ui: &mut Ui) {
    let s = &viewer.statistics;
    let frame = s.frames.back().copied().unwrap_or_default();
    let pass = s.passes.back().copied().unwrap_or_default();
    let (frames, passes) = (s.frames_per_second(), s.passes_per_second());
    plot(viewer, ui);
    let mega = |v: f64| format!("{:.2} M/s", v * 1e-6);
    let mebi = |bytes: f64| format!("{:.0} MiB", bytes / f64::from(1 << 20));
    let stats = &viewer.backend.stats;
    let counts = viewer.document.as_ref().map(|d| d.counts).unwrap_or_default();
    let mut rows = vec![
        ("Window", format!("{frames:.0} frames/s, {:.1} ms of work", frame.ui_ms)),
        ("Pictures", format!("{passes:.1} /s")),
        ("Rendering", format!("{:.1} ms a pass", pass.render_ms)),
        ("Film and display values", format!("{:.1} ms", pass.show_ms)),
        ("Samples", mega(pass.samples_per_second)),
        ("Rays", mega(pass.rays_per_second)),
        ("Memory of the process", mebi(pass.memory_bytes as f64)),
        ("Scene tables", mebi(stats.table_bytes as f64)),
        ("Acceleration structures", mebi(stats.acceleration_bytes as f64)),
        ("Build time", format!("{:.0} ms", stats.build.as_secs_f64() * 1e3)),
    ];
    if stats.device_bytes > 0 {
        rows.push(("Device memory", mebi(stats.device_bytes as f64)));
    }
    if let Some(kernel) = viewer.shot().and_then(|s| s.pass.kernel) {
        rows.push(("Kernel", kernel.to_owned()));
    }
    if let Some(document) = &viewer.document {
        let scene = document.scene();
        rows.push((
            "Triangles",
            format!("{} ({} in the world)", counts.triangles, counts.instanced_triangles),
        ));
        rows.push(("Meshes, objects", format!("{}, {}", counts.meshes, scene.instances.len())));
        rows.push(("Materials, textures", format!("{}, {}", scene.materials.len(), scene.textures.len())));
        rows.push(("Lights, images", format!("{}, {}", scene.lights.len(), counts.images)));
    }
    table(ui, "speed", &rows);
    if !viewer.statistics.device.is_empty() {
        ui.strong("Device passes");
        let rows: Vec<_> = viewer
            .statistics
            .device
            .iter()
            .map(|(name, ms)| (name.as_str(), format!("{ms:.2} ms")))
            .collect();
        table(ui, "device", &rows);
    }
    if ui.button("Export…").clicked() {
        viewer.run(Command::ExportStatistics, &ui.ctx().clone());
    }
}

fn table(ui: &mut Ui, id: &str, rows: &[(&str, String)]) {
    Grid::new(id).striped(true).show(ui, |ui| {
        for (name, value) in rows {
            ui.label(*name);
            ui.label(value);
            ui.end_row();
        }
    });
}

fn plot(viewer: &Viewer, ui: &mut Ui) {
    let s = &viewer.statistics;
    let now = viewer.time();
    let frames: PlotPoints = s.frames.iter().map(|f| [f.time - now, f64::from(f.ui_ms)]).collect();
    let passes: PlotPoints =
        s.passes.iter().map(|p| [p.time - now, f64::from(p.render_ms + p.show_ms)]).collect();
    Plot::new("times")
        .height(150.0)
        .include_y(0.0)
        .include_y(40.0)
        .include_x(0.0)
        .include_x(-10.0)
        .allow_drag(false)
        .allow_scroll(false)
        .allow_zoom(false)
        .y_axis_label("ms")
        .x_axis_label("s")
        .legend(egui_plot::Legend::default())
        .show(ui, |plot| {
            for (limit, name) in LIMITS {
                plot.hline(HLine::new(name, limit).color(Color32::from_gray(130)));
            }
            plot.line(Line::new("window", frames).color(Color32::from_rgb(90, 160, 250)));
            plot.line(Line::new("pass", passes).color(Color32::from_rgb(250, 160, 60)));
        });
}
