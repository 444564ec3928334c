//! Everything around the picture, one file a panel. Panels show the viewer's state and change it; they keep none.

mod camera;
mod environment;
mod frames;
mod graph;
mod inspector;
mod lights;
mod material;
mod menu;
mod objects;
mod palette;
mod performance;
mod record;
mod render;
mod report;
mod status;
mod textures;
mod time;
mod tooltips;
mod windows;

use crate::viewer::{Command, Viewer};
use egui::{CentralPanel, Frame, Panel, ScrollArea, Ui};

/// A page of the panel on the right.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs, reason = "each has a file of its own")]
pub enum Tab {
    #[default]
    Render,
    Objects,
    Lights,
    Sky,
    Camera,
    Speed,
    Pixel,
    File,
}

impl Tab {
    /// All of them, in their order.
    pub const ALL: [Self; 8] = [
        Self::Render,
        Self::Objects,
        Self::Lights,
        Self::Sky,
        Self::Camera,
        Self::Speed,
        Self::Pixel,
        Self::File,
    ];

    /// What the user calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Render => "Render",
            Self::Objects => "Objects",
            Self::Lights => "Lights",
            Self::Sky => "Sky",
            Self::Camera => "Camera",
            Self::Speed => "Speed",
            Self::Pixel => "Pixel",
            Self::File => "File",
        }
    }
}

/// Which panels and windows are open.
#[derive(Clone, Debug, Default)]
pub struct Open {
    /// The panel on the right.
    pub side: bool,
    /// Its page.
    pub tab: Tab,
    /// The list of all commands.
    pub palette: bool,
    /// What is typed there.
    pub palette_text: String,
    /// Mouse and keys.
    pub help: bool,
    /// What is typed to find objects.
    pub object_filter: String,
    /// How sequences are recorded.
    pub record: RecordChoice,
    /// Radius of a scene's automatic orbit is the camera's distance; this is how far it rises, metres.
    pub orbit_bob: f32,
}

/// How sequences are recorded.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordChoice {
    /// Which of the recording commands.
    pub way: Command,
    /// Number of pictures.
    pub frames: usize,
    /// Pictures a second, where time counts.
    pub fps: f32,
    /// Samples per pixel.
    pub spp: u32,
}

impl Default for RecordChoice {
    fn default() -> Self {
        Self { way: Command::RecordTurntable, frames: 96, fps: 24.0, spp: 64 }
    }
}

/// The whole window.
pub fn show(viewer: &mut Viewer, ui: &mut Ui) {
    Panel::top("menu").show(ui, |ui| menu::show(viewer, ui));
    Panel::bottom("status").show(ui, |ui| status::show(viewer, ui));
    if time::is_needed(viewer) {
        Panel::bottom("time").show(ui, |ui| time::show(viewer, ui));
    }
    if viewer.open.side {
        Panel::right("side").default_size(330.0).show(ui, |ui| side(viewer, ui));
    }
    CentralPanel::default().frame(Frame::NONE).show(ui, |ui| crate::viewport::show(viewer, ui));
    palette::show(viewer, ui.ctx());
    windows::help(viewer, ui.ctx());
    windows::notices(viewer, ui.ctx());
    windows::elsewhere(viewer, ui.ctx());
}

/// The panel on the right.
pub fn side(viewer: &mut Viewer, ui: &mut Ui) {
    ui.horizontal_wrapped(|ui| {
        for tab in Tab::ALL {
            ui.selectable_value(&mut viewer.open.tab, tab, tab.name());
        }
    });
    ui.separator();
    ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| page(viewer, ui));
}

/// The page of the panel on the right that is open.
pub fn page(viewer: &mut Viewer, ui: &mut Ui) {
    match viewer.open.tab {
        Tab::Render => render::show(viewer, ui),
        Tab::Objects => objects::show(viewer, ui),
        Tab::Lights => lights::show(viewer, ui),
        Tab::Sky => environment::show(viewer, ui),
        Tab::Camera => {
            camera::show(viewer, ui);
            record::show(viewer, ui);
        }
        Tab::Speed => performance::show(viewer, ui),
        Tab::Pixel => inspector::show(viewer, ui),
        Tab::File => report::show(viewer, ui),
    }
}

/// A number with a label before it; true when it was changed.
fn number(
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
fn count(ui: &mut Ui, label: &str, value: &mut u32, range: std::ops::RangeInclusive<u32>) -> bool {
    ui.horizontal(|ui| {
        let name = tooltips::explain(ui.label(label), label);
        let drag = egui::DragValue::new(value).speed(0.2).range(range);
        tooltips::explain(ui.add(drag).labelled_by(name.id), label).changed()
    })
    .inner
}

/// Three numbers with a label before them; true when one was changed.
fn vector(ui: &mut Ui, label: &str, value: &mut [f32; 3], speed: f32) -> bool {
    ui.horizontal(|ui| {
        let name = ui.label(label);
        let drag = |v| egui::DragValue::new(v).speed(speed).max_decimals(4);
        let mut one = |v| ui.add(drag(v)).labelled_by(name.id).changed();
        value.iter_mut().fold(false, |changed, v| one(v) | changed)
    })
    .inner
}

/// A checkbox; true when it was changed.
fn check(ui: &mut Ui, label: &str, value: &mut bool) -> bool {
    tooltips::explain(ui.checkbox(value, label), label).changed()
}

/// A slider with a label behind it; true when it was changed.
fn slider(ui: &mut Ui, label: &str, value: &mut f32, range: std::ops::RangeInclusive<f32>) -> bool {
    tooltips::explain(ui.add(egui::Slider::new(value, range).text(label)), label).changed()
}

/// A share from 0 to 1 with a label behind it; true when it was changed.
fn share(ui: &mut Ui, label: &str, value: &mut f32) -> bool {
    slider(ui, label, value, 0.0..=1.0)
}

/// A list to choose from, with a label behind it.
fn choice(ui: &mut Ui, label: &str, selected: &str, entries: impl FnOnce(&mut Ui)) {
    let list = egui::ComboBox::from_label(label).selected_text(selected).show_ui(ui, entries);
    tooltips::explain(list.response, label);
}

/// A colour of any brightness, as a hue and a factor; true when it was changed.
fn bright_colour(ui: &mut Ui, label: &str, value: &mut [f32; 3], unit: &str) -> bool {
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
