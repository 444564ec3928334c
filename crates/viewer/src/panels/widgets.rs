//! Widgets that panels have in common: labelled numbers, lists and colours.

use super::tooltips;
use egui::Ui;

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
        let drag = |v| egui::DragValue::new(v).speed(speed).max_decimals(4);
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
