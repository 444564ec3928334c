//! The window without a window.

use alhazen::{LoadOptions, RendererOptions, Source};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use std::time::{Duration, Instant};
use viewer::panels;
use viewer::settings::Settings;
use viewer::viewer::{FirstView, Start, Viewer};

/// The whole window around a scene that is loaded.
pub fn open_with(scene: &str, settings: Settings, first: FirstView) -> Harness<'static, Viewer> {
    let start = Start {
        settings,
        first,
        tev: None,
        load: LoadOptions::default(),
        renderer: RendererOptions { backend: alhazen::BackendChoice::Cpu, ..RendererOptions::default() },
        size: Some([32, 24]),
    };
    let viewer = Viewer::new(Source::parse(scene), start, || {}).expect("threads");
    let began = Instant::now();
    let show = move |ui: &mut egui::Ui, viewer: &mut Viewer| {
        viewer.tick(ui.ctx(), began.elapsed().as_secs_f64());
        viewer.take_keys(ui.ctx());
        panels::show(viewer, ui);
    };
    let size = egui::vec2(1200.0, 1500.0);
    let mut harness = Harness::builder().with_size(size).build_ui_state(show, viewer);
    until(&mut harness, "a picture", |v| v.document.is_some() && v.shot().is_some());
    harness
}

/// Frames until something is so.
pub fn until(harness: &mut Harness<'_, Viewer>, what: &str, is_so: impl Fn(&Viewer) -> bool) {
    let began = Instant::now();
    while !is_so(harness.state()) {
        assert!(began.elapsed() < Duration::from_secs(120), "{what} does not come");
        std::thread::sleep(Duration::from_millis(5));
        harness.step();
    }
}

/// Clicks what has a label.
pub fn click(harness: &mut Harness<'_, Viewer>, label: &str) {
    harness.get_by_label(label).click();
    harness.run_steps(3);
}
