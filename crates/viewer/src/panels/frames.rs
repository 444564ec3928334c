//! Settings of the real-time path tracer.

use super::widgets::{check, choice, count, number, slider};
use alhazen::{
    AllocationSettings, FrameSamples, FrameView, HistorySettings, RealtimeSettings, SpatialFilter, Visibility,
};
use egui::Ui;
use std::time::Duration;

/// The time of a frame that is offered first, seconds.
const USUAL_BUDGET: f32 = 8e-3;

/// Shows it.
pub fn show(ui: &mut Ui, r: &mut RealtimeSettings) {
    choice(ui, "Displayed buffer", r.show.name(), |ui| {
        for view in FrameView::ALL {
            ui.selectable_value(&mut r.show, view, view.name());
        }
    });
    let of_adaptive = matches!(r.show, FrameView::Noise | FrameView::BlurredNoise | FrameView::Mask);
    if of_adaptive && r.samples.is_fixed() {
        ui.weak("Every pixel gets the same samples, so there is no noise map.");
    }
    count(ui, "Maximum depth", &mut r.path.max_depth, 1..=1000);
    samples(ui, r);
    count(ui, "Light candidates", &mut r.light_candidates, 0..=RealtimeSettings::MOST_LIGHT_CANDIDATES);
    history(ui, &mut r.history);
    check(ui, "Spatial filter", &mut r.filter);
    if r.filter {
        choice(ui, "Filter", r.spatial.name(), |ui| {
            for filter in SpatialFilter::ALL {
                ui.selectable_value(&mut r.spatial, filter, filter.name());
            }
        });
    }
    if r.filter && r.spatial == SpatialFilter::Edges {
        count(ui, "Filter passes", &mut r.filter_passes, 0..=8);
    }
    let mut raster = r.visibility == Visibility::Raster;
    if check(ui, "Rasterised first hits", &mut raster) {
        r.visibility = if raster { Visibility::Raster } else { Visibility::Rays };
    }
}

/// How many samples pixels get in a frame.
fn samples(ui: &mut Ui, r: &mut RealtimeSettings) {
    let mut adapts = !r.samples.is_fixed();
    if check(ui, "Adaptive frames", &mut adapts) {
        r.samples = if adapts { FrameSamples::ADAPTIVE } else { FrameSamples { least: 1, most: 1 } };
        // Frames in which all pixels get the same take as long as they take.
        r.budget = None;
    }
    if !adapts {
        count(ui, "Samples per pixel and frame", &mut r.samples.most, 1..=FrameSamples::MOST);
        r.samples.least = r.samples.most;
        return;
    }
    // Equal numbers would be a fixed one.
    count(ui, "Minimum samples", &mut r.samples.least, 1..=FrameSamples::MOST - 1);
    count(ui, "Maximum samples", &mut r.samples.most, r.samples.least + 1..=FrameSamples::MOST);
    r.samples.most = r.samples.most.max(r.samples.least + 1);
    let mut has_budget = r.budget.is_some();
    if check(ui, "Time budget", &mut has_budget) {
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
    number(ui, "Variance tolerance", &mut a.tolerance, 1e-4, 1e-4..=1.0);
    count(ui, "Noise radius (pixels)", &mut a.noise_radius, 0..=8);
    count(ui, "Spread radius (pixels)", &mut a.blur_radius, 0..=8);
    count(ui, "Refresh interval (frames)", &mut a.refresh, 0..=1000);
    if a.refresh == 0 {
        ui.weak("0 is biased: pixels that only seem free of noise get no more samples.");
    }
}

/// What is kept of frames before.
fn history(ui: &mut Ui, h: &mut HistorySettings) {
    number(ui, "History length (samples)", &mut h.most, 0.2, 0.0..=10_000.0);
    number(ui, "Depth tolerance (tenths)", &mut h.depth_tolerance, 0.01, 0.001..=10.0);
    slider(ui, "Normal tolerance (cosine)", &mut h.normal_tolerance, 0.0..=1.0);
    number(ui, "History clipping (deviations)", &mut h.clip, 0.01, 0.1..=100.0);
}
