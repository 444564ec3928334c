//! Widgets that panels have in common: labelled numbers, lists and colours.

use super::tooltips;
use egui::Ui;

/// A number with as few of the allowed decimals as tell it, and no sign where they are all zeros.
fn without_negative_zero(value: f64, decimals: std::ops::RangeInclusive<usize>) -> String {
    let text = egui::emath::format_with_decimals_in_range(value, decimals);
    let is_zero = text.chars().all(|c| !c.is_ascii_digit() || c == '0');
    if is_zero { text.trim_start_matches(['-', '−']).to_owned() } else { text }
}

/// A number with a label before it; true when it was changed.
pub(super) fn number(
    ui: &mut Ui,
    label: &str,
    value: &mut f32,
    speed: f32,
    range: std::ops::RangeInclusive<f32>,
) -> bool {
    ui.horizontal(|ui| {
        let name = tooltips::explain(ui.label(label), label);
        let drag = egui::DragValue::new(value).speed(speed).range(range).max_decimals(4);
        let drag = drag.custom_formatter(without_negative_zero);
        tooltips::explain(ui.add(drag).labelled_by(name.id), label).changed()
    })
    .inner
}

/// A whole number with a label before it; true when it was changed.
pub(super) fn count(ui: &mut Ui, label: &str, value: &mut u32, range: std::ops::RangeInclusive<u32>) -> bool {
    ui.horizontal(|ui| {
        let name = tooltips::explain(ui.label(label), label);
        let drag = egui::DragValue::new(value).speed(0.2).range(range);
        tooltips::explain(ui.add(drag).labelled_by(name.id), label).changed()
    })
    .inner
}

/// Three numbers with a label before them; true when one was changed.
pub(super) fn vector(ui: &mut Ui, label: &str, value: &mut [f32; 3], speed: f32) -> bool {
    ui.horizontal(|ui| {
        let name = ui.label(label);
        let drag = |v| {
            let drag = egui::DragValue::new(v).speed(speed).max_decimals(4);
            drag.custom_formatter(without_negative_zero)
        };
        let mut one = |v| ui.add(drag(v)).labelled_by(name.id).changed();
        value.iter_mut().fold(false, |changed, v| one(v) | changed)
    })
    .inner
}

/// A checkbox; true when it was changed.
pub(super) fn check(ui: &mut Ui, label: &str, value: &mut bool) -> bool {
    tooltips::explain(ui.checkbox(value, label), label).changed()
}

/// A slider with a label behind it; true when it was changed.
pub(super) fn slider(
    ui: &mut Ui,
    label: &str,
    value: &mut f32,
    range: std::ops::RangeInclusive<f32>,
) -> bool {
    tooltips::explain(ui.add(egui::Slider::new(value, range).text(label)), label).changed()
}

/// A share from 0 to 1 with a label behind it; true when it was changed.
pub(super) fn share(ui: &mut Ui, label: &str, value: &mut f32) -> bool {
    slider(ui, label, value, 0.0..=1.0)
}

/// A list to choose from, with a label behind it.
pub(super) fn choice(ui: &mut Ui, label: &str, selected: &str, entries: impl FnOnce(&mut Ui)) {
    let list = egui::ComboBox::from_label(label).selected_text(selected).show_ui(ui, entries);
    tooltips::explain(list.response, label);
}

/// A colour of any brightness, as a hue and a factor; true when it was changed.
pub(super) fn bright_colour(ui: &mut Ui, label: &str, value: &mut [f32; 3], unit: &str) -> bool {
    let mut strength = value.iter().copied().fold(0.0, f32::max);
    let mut hue = if strength > 0.0 { value.map(|v| v / strength) } else { [1.0; 3] };
    let changed = ui
        .horizontal(|ui| {
            let name = ui.label(label);
            let colour = ui.color_edit_button_rgb(&mut hue).labelled_by(name.id).changed();
            let speed = (strength * 0.01).max(0.01);
            let drag = egui::DragValue::new(&mut strength).speed(speed).range(0.0..=1e9).suffix(unit);
            let strength = ui.add(drag).labelled_by(name.id).changed();
            colour || strength
        })
        .inner;
    if changed {
        *value = hue.map(|v| v * strength);
    }
    changed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zeros_have_no_sign() {
        assert_eq!(without_negative_zero(-0.0, 1..=4), "0.0");
        assert_eq!(without_negative_zero(-0.00001, 1..=1), "0.0");
        assert_eq!(without_negative_zero(0.25, 1..=4), "0.25");
        assert!(without_negative_zero(-0.25, 1..=4).ends_with("0.25"));
        assert_eq!(without_negative_zero(-0.25, 1..=4).chars().count(), 5);
    }
}
