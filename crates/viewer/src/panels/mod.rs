//! Everything around the picture, one file a panel. Panels show the viewer's state and change it; they keep none.

mod browser;
mod camera;
mod compare;
mod distribution;
mod environment;
mod frames;
mod graph;
mod image;
mod inspector;
mod lights;
mod look;
mod material;
mod materials;
mod menu;
mod objects;
mod open;
mod outliner;
mod output;
mod palette;
mod performance;
mod record;
mod render;
mod report;
pub mod settings;
mod snapshots;
mod status;
mod textures;
mod time;
mod widgets;
mod windows;

pub use materials::DraggedMaterial;
pub use open::{Open, Overlay, PaletteChoice, RecordChoice, Sought, Tab};

use crate::viewer::{Top, Viewer};
use egui::{CentralPanel, Frame, Panel, ScrollArea, Ui, UiBuilder};

/// Width of the panel on the right, points: at first, and at least. All its tabs fit into a row.
const SIDE: [f32; 2] = [380.0, 340.0];

/// The whole window.
pub fn show(viewer: &mut Viewer, ui: &mut Ui) {
    look::apply(ui.ctx(), &viewer.settings);
    crate::numbers::write_in(ui);
    settings::begin(viewer, ui.ctx());
    // The tree says so itself, where it is shown.
    viewer.open.outliner.has_focus = false;
    Panel::top("menu").show(ui, |ui| menu::show(viewer, ui));
    Panel::bottom("status").show(ui, |ui| status::show(viewer, ui));
    if time::is_needed(viewer) {
        Panel::bottom("time").show(ui, |ui| time::show(viewer, ui));
    }
    if viewer.open.side {
        Panel::right("side").default_size(SIDE[0]).min_size(SIDE[1]).show(ui, |ui| side(viewer, ui));
    }
    CentralPanel::default().frame(Frame::NONE).show(ui, |ui| crate::viewport::show(viewer, ui));
    settings::end(viewer, ui.ctx());
    materials::paint_dragged(viewer, ui.ctx());
    match viewer.top() {
        Some(Top::Errors) => windows::notices(viewer, ui.ctx()),
        Some(Top::Question) => windows::elsewhere(viewer, ui.ctx()),
        Some(Top::Browser) => browser::show(viewer, ui.ctx()),
        Some(Top::Overlay(Overlay::Palette)) => palette::show(viewer, ui.ctx()),
        Some(Top::Overlay(Overlay::Help)) => windows::help(viewer, ui.ctx()),
        None => {}
    }
}

/// The panel on the right.
pub fn side(viewer: &mut Viewer, ui: &mut Ui) {
    ui.scope(|ui| {
        (ui.spacing_mut().item_spacing.x, ui.spacing_mut().button_padding.x) = (2.0, 3.0);
        ui.horizontal_wrapped(|ui| {
            for tab in Tab::ALL {
                ui.selectable_value(&mut viewer.open.tab, tab, tab.name());
            }
        });
    });
    ui.separator();
    ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
        // What is too wide for the panel does not push it wider.
        let (room, width) = (ui.available_rect_before_wrap(), ui.available_width());
        let mut inner = ui.new_child(UiBuilder::new().max_rect(room));
        page(viewer, &mut inner);
        ui.allocate_space(egui::vec2(width, inner.min_rect().height()));
    });
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
        Tab::Image => image::show(viewer, ui),
        Tab::File => report::show(viewer, ui),
    }
}
