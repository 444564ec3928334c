//! Widgets that panels have in common: rows of a label and a control, and sections of rows.

use super::settings;
use egui::{Align, CollapsingHeader, ComboBox, DragValue, Id, Label, Response, RichText, Slider, Ui};
use std::ops::RangeInclusive;

/// The share of a row that its label takes.
const LABELS: f32 = 0.42;
/// The width of the number behind a slider, points.
const NUMBER: f32 = 78.0;

/// A label in the left column, and what it is for in the right one. The control is labelled by the
/// label's id.
pub(super) fn row<R>(ui: &mut Ui, label: &str, control: impl FnOnce(&mut Ui, Id) -> R) -> R {
    let shown = ui.horizontal(|ui| {
        let width = ((ui.available_width() - ui.spacing().item_spacing.x) * LABELS).max(60.0);
        let name = ui.vertical(|ui| {
            ui.set_width(width.floor());
            let line = ui.text_style_height(&egui::TextStyle::Body);
            ui.add_space(((ui.spacing().interact_size.y - line) * 0.5).max(0.0));
            settings::explain(ui.add(Label::new(label).wrap()), label)
        });
        control(ui, name.inner.id)
    });
    settings::show_if_sought(ui, label, &shown.response);
    shown.inner
}

/// As [`row`], of one widget; true when it was changed.
fn widget(ui: &mut Ui, label: &str, widget: impl egui::Widget) -> bool {
    row(ui, label, |ui, name| settings::explain(ui.add(widget).labelled_by(name), label).changed())
}

/// Rows that can be folded away.
pub(super) fn section<R>(ui: &mut Ui, title: &str, rows: impl FnOnce(&mut Ui) -> R) -> Option<R> {
    section_if(ui, title, true, rows)
}

/// As [`section`]; `open`: whether it is at first.
pub(super) fn section_if<R>(
    ui: &mut Ui,
    title: &str,
    open: bool,
    rows: impl FnOnce(&mut Ui) -> R,
) -> Option<R> {
    let header = CollapsingHeader::new(RichText::new(title).strong()).id_salt(title).default_open(open);
    // A setting that is looked for may be in it.
    let opened = settings::is_seeking(ui.ctx()).then_some(true);
    header.open(opened).show_unindented(ui, rows).body_returned
}

/// A number; true when it was changed.
pub(super) fn number(
    ui: &mut Ui,
    label: &str,
    value: &mut f32,
    speed: f32,
    range: RangeInclusive<f32>,
) -> bool {
    widget(ui, label, DragValue::new(value).speed(speed).range(range).max_decimals(4))
}

/// A whole number; true when it was changed.
pub(super) fn count(ui: &mut Ui, label: &str, value: &mut u32, range: RangeInclusive<u32>) -> bool {
    widget(ui, label, DragValue::new(value).speed(0.2).range(range))
}

/// As many numbers as fit into a row; true when one was changed.
pub(super) fn vector<const N: usize>(ui: &mut Ui, label: &str, value: &mut [f32; N], speed: f32) -> bool {
    row(ui, label, |ui, name| {
        let gap = ui.spacing().item_spacing.x;
        ui.spacing_mut().interact_size.x = ((ui.available_width() + gap) / N as f32 - gap).floor().max(30.0);
        let mut one = |v| {
            let drag = ui.add(DragValue::new(v).speed(speed).max_decimals(4)).labelled_by(name);
            settings::explain(drag, label).changed()
        };
        value.iter_mut().fold(false, |changed, v| one(v) | changed)
    })
}

/// A box to tick; true when it was changed.
pub(super) fn check(ui: &mut Ui, label: &str, value: &mut bool) -> bool {
    widget(ui, label, egui::Checkbox::without_text(value))
}

/// A slider; true when it was changed.
pub(super) fn slider(ui: &mut Ui, label: &str, value: &mut f32, range: RangeInclusive<f32>) -> bool {
    row(ui, label, |ui, name| slider_alone(ui, name, label, Slider::new(value, range)).changed())
}

/// A slider that fills the rest of a row.
pub(super) fn slider_alone(ui: &mut Ui, name: Id, label: &str, slider: Slider<'_>) -> Response {
    ui.spacing_mut().slider_width = (ui.available_width() - NUMBER).max(40.0);
    settings::explain(ui.add(slider.max_decimals(4)).labelled_by(name), label)
}

/// A share from 0 to 1; true when it was changed.
pub(super) fn share(ui: &mut Ui, label: &str, value: &mut f32) -> bool {
    slider(ui, label, value, 0.0..=1.0)
}

/// A list to choose from.
pub(super) fn choice(ui: &mut Ui, label: &str, selected: &str, entries: impl FnOnce(&mut Ui)) {
    row(ui, label, |ui, name| {
        let list = ComboBox::from_id_salt(label).selected_text(selected).width(ui.available_width());
        let list = list.truncate().show_ui(ui, entries);
        settings::explain(list.response.labelled_by(name), label)
    });
}

/// A colour, linear red, green and blue from 0 to 1; true when it was changed.
pub(super) fn colour(ui: &mut Ui, label: &str, value: &mut [f32; 3]) -> bool {
    row(ui, label, |ui, name| {
        settings::explain(ui.color_edit_button_rgb(value).labelled_by(name), label).changed()
    })
}

/// A colour of any brightness, as a hue and a factor; true when it was changed.
pub(super) fn bright_colour(ui: &mut Ui, label: &str, value: &mut [f32; 3], unit: &str) -> bool {
    let mut strength = value.iter().copied().fold(0.0, f32::max);
    let mut hue = if strength > 0.0 { value.map(|v| v / strength) } else { [1.0; 3] };
    let changed = row(ui, label, |ui, name| {
        let colour = settings::explain(ui.color_edit_button_rgb(&mut hue).labelled_by(name), label);
        let speed = (strength * 0.01).max(0.01);
        let drag = DragValue::new(&mut strength).speed(speed).range(0.0..=1e9).suffix(unit);
        let strength = settings::explain(ui.add(drag).labelled_by(name), label);
        colour.changed() || strength.changed()
    });
    if changed {
        *value = hue.map(|v| v * strength);
    }
    changed
}

/// Something to read in the right column.
pub(super) fn told(ui: &mut Ui, label: &str, text: impl Into<RichText>) {
    row(ui, label, |ui, _| drop(ui.add(Label::new(text.into()).truncate())));
}

/// A label and a control that stay together where lines are broken. `width`: of the control, points.
pub(super) fn together<R>(ui: &mut Ui, label: &str, width: f32, control: impl FnOnce(&mut Ui, Id) -> R) -> R {
    let font = egui::TextStyle::Body.resolve(ui.style());
    let galley = ui.painter().layout_no_wrap(label.to_owned(), font, egui::Color32::WHITE);
    let height = ui.spacing().interact_size.y;
    let size = egui::vec2(galley.size().x + ui.spacing().item_spacing.x + width, height);
    let layout = egui::Layout::left_to_right(Align::Center);
    ui.allocate_ui_with_layout(size, layout, |ui| {
        let name = settings::explain(ui.add(Label::new(label).extend()), label);
        control(ui, name.id)
    })
    .inner
}
