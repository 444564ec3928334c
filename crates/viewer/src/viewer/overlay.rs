//! What lies over the picture and tells of it: zebra stripes, borders and values of pixels, the legend
//! of false colours.

use super::state::Viewer;
use super::tools::Look;
use crate::analysis::Difference;
use crate::viewport::pixels_in;
use crate::worker::{Layer, heat};
use alhazen::Image;
use egui::{Align2, Color32, FontId, Painter, Rect, Stroke, pos2, vec2};

/// Pixels of the picture have borders from this size on, points.
const BORDERED: f32 = 12.0;
/// They have values from this size on, points.
const VALUED: f32 = 54.0;
/// Size of the legend's bar, points.
const BAR: egui::Vec2 = vec2(220.0, 10.0);

impl Viewer {
    /// Draws it.
    pub(super) fn paint_overlays(&self, painter: &Painter, place: Rect) {
        let Some(shot) = self.shot() else { return };
        let has_stripes = self.tools.zebra && !shot.preview && !self.shows_difference();
        if let (true, Some(stripes)) = (has_stripes, &self.tools.stripes) {
            let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
            painter.image(stripes.id(), place, whole, Color32::WHITE);
        }
        if self.settings.pixel_grid && !shot.preview {
            let other = self.reference().filter(|_| self.tools.look == Look::B);
            paint_pixels(painter, place, other.as_ref().unwrap_or(&shot.linear));
        }
        if let Some(legend) = self.legend() {
            legend.paint(painter, place);
        }
    }

    /// What the false colours stand for; `None` where there are none.
    pub fn legend(&self) -> Option<Legend> {
        if self.shows_difference() {
            let name = self.tools.difference.name();
            let title = format!("difference to B, {name}");
            let colours = Colours::Difference(self.tools.difference);
            let labels = self.tools.difference.scale().1.map(str::to_owned);
            return Some(Legend { title, labels, colours });
        }
        match (self.shown.layer, self.shown.false_colour) {
            (Layer::Picture, Some(stops)) => {
                let value = |stop: f32| format!("{:.3}", 0.18 * stop.exp2() / self.shown.tone.exposure);
                let labels = [-stops, 0.0, stops].map(|stop| format!("{stop:+.0} stops: {}", value(stop)));
                Some(Legend { title: "luminance around middle grey".into(), labels, colours: Colours::Heat })
            }
            (Layer::Noise, _) => Some(Legend {
                title: "standard error relative to the value".into(),
                labels: ["0.001", "0.03", "1"].map(str::to_owned),
                colours: Colours::Heat,
            }),
            _ => None,
        }
    }

    /// Whether the difference to another picture is shown now.
    pub(super) fn shows_difference(&self) -> bool {
        let is_wanted = self.comparison.split().is_some() && self.tools.look == Look::Difference;
        is_wanted && self.tools.error_map.is_some() && self.shot().is_some_and(|shot| !shot.preview)
    }
}

/// What colours stand for.
#[derive(Clone, Debug, PartialEq)]
pub struct Legend {
    /// What is shown.
    pub title: String,
    /// At the least value, in the middle, and at the greatest.
    pub labels: [String; 3],
    colours: Colours,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Colours {
    Heat,
    Difference(Difference),
}

impl Legend {
    fn paint(&self, painter: &Painter, place: Rect) {
        const STEPS: usize = 55;
        let visible = place.intersect(painter.clip_rect());
        let frame = Rect::from_min_size(visible.left_bottom() + vec2(10.0, -62.0), vec2(BAR.x + 16.0, 52.0));
        painter.rect_filled(frame, 4.0, Color32::from_black_alpha(170));
        let font = FontId::proportional(11.0);
        let text = |at, align, text: &str| painter.text(at, align, text, font.clone(), Color32::WHITE);
        text(frame.left_top() + vec2(8.0, 4.0), Align2::LEFT_TOP, &self.title);
        let bar = Rect::from_min_size(frame.left_top() + vec2(8.0, 20.0), BAR);
        for step in 0..STEPS {
            let share = |i: usize| i as f32 / STEPS as f32;
            let colour = match self.colours {
                Colours::Heat => heat(share(step) + 0.5 / STEPS as f32),
                Colours::Difference(difference) => difference.scale().0(share(step) + 0.5 / STEPS as f32),
            };
            let part = Rect::from_min_max(
                pos2(bar.left() + bar.width() * share(step), bar.top()),
                pos2(bar.left() + bar.width() * share(step + 1), bar.bottom()),
            );
            painter.rect_filled(part, 0.0, colour);
        }
        let ends = [
            (bar.left_bottom(), Align2::LEFT_TOP),
            (bar.center_bottom(), Align2::CENTER_TOP),
            (bar.right_bottom(), Align2::RIGHT_TOP),
        ];
        for ((at, align), label) in ends.into_iter().zip(&self.labels) {
            text(at + vec2(0.0, 3.0), align, label);
        }
    }
}

/// Borders of the pixels that are seen, and their values where there is room for them.
fn paint_pixels(painter: &Painter, place: Rect, image: &Image) {
    let size = place.size() / vec2(image.width() as f32, image.height() as f32);
    if size.x.min(size.y) < BORDERED {
        return;
    }
    let visible = place.intersect(painter.clip_rect());
    let Some([columns, rows]) = pixels_in(place, visible, image.width(), image.height()) else { return };
    let stroke = Stroke::new(1.0, Color32::from_gray(128).gamma_multiply(0.5));
    for x in columns.start..=columns.end {
        painter.vline(place.left() + x as f32 * size.x, visible.y_range(), stroke);
    }
    for y in rows.start..=rows.end {
        painter.hline(visible.x_range(), place.top() + y as f32 * size.y, stroke);
    }
    if size.x.min(size.y) < VALUED {
        return;
    }
    let font = FontId::monospace((size.y.min(size.x) * 0.17).clamp(9.0, 14.0));
    for (x, y) in rows.flat_map(|y| columns.clone().map(move |x| (x, y))) {
        let at = place.min + vec2(x as f32 + 0.5, y as f32 + 0.5) * size;
        let lines = image.rgb(x, y).map(value_text).join("\n");
        let galley = painter.layout_no_wrap(lines, font.clone(), Color32::WHITE);
        let rect = Align2::CENTER_CENTER.anchor_size(at, galley.size());
        painter.rect_filled(rect.expand(2.0), 2.0, Color32::from_black_alpha(120));
        painter.galley(rect.min, galley, Color32::WHITE);
    }
}

/// A value in at most six characters.
fn value_text(value: f32) -> String {
    match value.abs() {
        0.0 => "0".into(),
        v if !(1e-3..1000.0).contains(&v) => format!("{value:.0e}"),
        v if v >= 10.0 => format!("{value:.1}"),
        _ => format!("{value:.3}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_short() {
        for (value, text) in [
            (0.0, "0"),
            (0.1234, "0.123"),
            (12.34, "12.3"),
            (12345.0, "1e4"),
            (1.2e-5, "1e-5"),
            (-0.5, "-0.500"),
        ] {
            assert_eq!(value_text(value), text);
            assert!(text.len() <= 6);
        }
        assert_eq!(value_text(f32::NAN), "NaN");
    }
}
