//! Everything around the picture, one file a panel. Panels show the viewer's state and change it; they keep none.

mod browser;
mod camera;
mod environment;
mod frames;
mod graph;
mod inspector;
mod lights;
mod material;
mod menu;
mod objects;
mod open;
mod palette;
mod performance;
mod record;
mod render;
mod report;
mod status;
mod textures;
mod time;
mod tooltips;
mod widgets;
mod windows;

pub use open::{Open, RecordChoice, Tab};

use crate::viewer::Viewer;
use egui::{CentralPanel, Frame, Panel, ScrollArea, Ui};

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
    browser::show(viewer, ui.ctx());
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
