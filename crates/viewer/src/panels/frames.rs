//! What frames of the real-time path tracer are made of, and what they show.

use super::{count, number};
use alhazen::{AllocationSettings, FrameSamples, FrameView, HistorySettings, RealtimeSettings, Visibility};
use egui::{ComboBox, Slider, Ui};
use std::time::Duration;

/// The time of a frame that is offered first, seconds.
const USUAL_BUDGET: f32 = 8e-3;

/// Shows it.
pub fn show(ui: &mut Ui, r: &mut RealtimeSettings) {
    ComboBox::from_label("Frames show").selected_text(r.show.name()).show_ui(ui, |ui| {
        for view in FrameView::ALL {
            ui.selectable_value(&mut r.show, view, view.name());
        }
    });
    let of_adaptive = matches!(r.show, FrameView::Noise | FrameView::BlurredNoise | FrameView::Mask);
    if of_adaptive && r.samples.is_fixed() {
        ui.weak("Nothing is measured: every pixel gets the same samples.");
    }
    count(ui, "Longest path", &mut r.path.max_depth, 1..=1000);
    samples(ui, r);
    count(
        ui,
        "Lights looked at (0: one, as paths do)",
        &mut r.light_candidates,
        0..=RealtimeSettings::MOST_LIGHT_CANDIDATES,
    );
    history(ui, &mut r.history);
    ui.checkbox(&mut r.filter, "Filter");
    if r.filter {
        count(ui, "Passes of the filter", &mut r.filter_passes, 0..=8);
    }
    let mut raster = r.visibility == Visibility::Raster;
    if ui.checkbox(&mut raster, "First hits by the rasteriser").changed() {
        r.visibility = if raster { Visibility::Raster } else { Visibility::Rays };
    }
}

/// How many samples pixels get in a frame.
fn samples(ui: &mut Ui, r: &mut RealtimeSettings) {
    let mut adapts = !r.samples.is_fixed();
    if ui.checkbox(&mut adapts, "Samples where it is noisy").changed() {
        r.samples = if adapts { FrameSamples::ADAPTIVE } else { FrameSamples { least: 1, most: 1 } };
        // Frames in which all pixels get the same take as long as they take.
        r.budget = None;
    }
    if !adapts {
        count(ui, "Samples of a pixel", &mut r.samples.most, 1..=FrameSamples::MOST);
        r.samples.least = r.samples.most;
        return;
    }
    // Equal numbers would be a fixed one.
    count(ui, "Least samples", &mut r.samples.least, 1..=FrameSamples::MOST - 1);
    count(ui, "Most samples", &mut r.samples.most, r.samples.least + 1..=FrameSamples::MOST);
    r.samples.most = r.samples.most.max(r.samples.least + 1);
    let mut has_budget = r.budget.is_some();
    if ui.checkbox(&mut has_budget, "As many as there is time for").changed() {
        r.budget = has_budget.then(|| Duration::from_secs_f32(USUAL_BUDGET));
    }
    if let Some(budget) = &mut r.budget {
        let mut ms = budget.as_secs_f32() * 1e3;
        if number(ui, "Time of a frame (ms)", &mut ms, 0.05, 0.1..=1000.0) {
            *budget = Duration::from_secs_f32(ms * 1e-3);
        }
    }
    allocation(ui, &mut r.allocation);
}

/// When pixels need no more samples.
fn allocation(ui: &mut Ui, a: &mut AllocationSettings) {
    number(ui, "Calm below this variance", &mut a.tolerance, 1e-4, 1e-4..=1.0);
    count(ui, "Pixels that tell the noise", &mut a.noise_radius, 0..=8);
    count(ui, "Pixels it is spread over", &mut a.blur_radius, 0..=8);
    count(ui, "Calm pixels: one of so many frames", &mut a.refresh, 0..=1000);
    if a.refresh == 0 {
        ui.weak("Never is biased: what was only thought to be calm stays so.");
    }
}

/// What is kept of frames before.
fn history(ui: &mut Ui, h: &mut HistorySettings) {
    number(ui, "The past counts for (samples)", &mut h.most, 0.2, 0.0..=10_000.0);
    number(ui, "Distances differ by (tenths)", &mut h.depth_tolerance, 0.01, 0.001..=10.0);
    ui.add(Slider::new(&mut h.normal_tolerance, 0.0..=1.0).text("Least cosine of normals"));
    number(ui, "The past is clipped to (deviations)", &mut h.clip, 0.01, 0.1..=100.0);
}
