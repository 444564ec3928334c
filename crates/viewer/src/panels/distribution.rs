//! Histogram and waveform of the picture.

use super::widgets::told;
use crate::analysis::{BINS, Histogram, STOPS, stop_of};
use crate::numbers::fixed;
use crate::viewer::Viewer;
use egui::{Color32, Rect, Sense, Ui, pos2, vec2};
use egui_plot::{Line, Plot, PlotPoints, VLine};

/// Red, green, blue and luminance.
const CURVES: [(&str, Color32); 4] = [
    ("red", Color32::from_rgb(235, 80, 80)),
    ("green", Color32::from_rgb(90, 200, 90)),
    ("blue", Color32::from_rgb(80, 140, 250)),
    ("luminance", Color32::from_gray(150)),
];

/// Shows it.
pub fn show(viewer: &Viewer, ui: &mut Ui) {
    let findings = viewer.tools.findings.as_ref();
    // Before there is a picture, everything has its place already.
    let nothing = Histogram::default();
    let histogram = findings.and_then(|findings| findings.histogram.as_ref()).unwrap_or(&nothing);
    plot(histogram, ui);
    let percent = |share: f32| format!("{:.2} %", share * 100.0);
    told(ui, "Above 1", percent(histogram.above_one[3]));
    told(ui, "Least, mean, greatest", {
        [histogram.least, histogram.mean, histogram.greatest].map(|v| fixed(v, 4)).join("  ")
    });
    if histogram.not_finite > 0 {
        ui.colored_label(ui.visuals().error_fg_color, format!("not finite: {}", histogram.not_finite));
    }
    let size = vec2(ui.available_width(), 110.0);
    let (place, response) = ui.allocate_exact_size(size, Sense::hover());
    let Some(waveform) = &viewer.tools.waveform else { return };
    let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    ui.painter().image(waveform.id(), place, whole, Color32::WHITE);
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Waveform"));
    response.on_hover_text(
        "Display values of each column of the picture: black at the bottom, white at the top. Red, green \
         and blue add up.",
    );
}

fn plot(histogram: &Histogram, ui: &mut Ui) {
    let points = |channel: usize| -> PlotPoints<'_> {
        let share = |bin: usize| histogram.bins[channel].get(bin).copied().unwrap_or(0.0);
        let height = |bin: usize| f64::from(share(bin)) * 100.0;
        (0..BINS).map(|bin| [f64::from(stop_of(bin)), height(bin)]).collect()
    };
    Plot::new("histogram")
        .height(130.0)
        .include_x(f64::from(STOPS[0]))
        .include_x(f64::from(STOPS[1]))
        .include_y(0.0)
        .allow_drag(false)
        .allow_scroll(false)
        .allow_zoom(false)
        .x_axis_label("stops after exposure; 0 is a value of 1")
        .y_axis_label("% of pixels")
        .show(ui, |plot| {
            plot.vline(VLine::new("one", 0.0).color(Color32::from_gray(130)));
            for (channel, (name, colour)) in CURVES.into_iter().enumerate() {
                plot.line(Line::new(name, points(channel)).color(colour).width(1.2));
            }
        });
}
