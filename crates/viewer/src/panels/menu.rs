//! The menu at the top.

use crate::viewer::{COMMANDS, Command, Viewer};
use egui::{MenuBar, Ui};

/// Shows it.
pub fn show(viewer: &mut Viewer, ui: &mut Ui) {
    use Command::*;
    MenuBar::new().ui(ui, |ui| {
        ui.menu_button("File", |ui| {
            item(viewer, ui, Open);
            recent(viewer, ui);
            builtin(viewer, ui);
            items(viewer, ui, &[Reload, CancelLoading]);
            ui.separator();
            items(viewer, ui, &[Save, SaveAs, Screenshot, SavePicture, RenderToFile, CopyCommandLine]);
            ui.separator();
            item(viewer, ui, Quit);
        });
        ui.menu_button("Edit", |ui| {
            items(viewer, ui, &[Undo, Redo]);
            ui.separator();
            items(viewer, ui, &[SelectArea, Duplicate, Delete, Rename, Hide, Isolate, ShowAll, Deselect]);
            ui.separator();
            items(viewer, ui, &[CopyMaterial, PasteMaterial]);
            ui.separator();
            items(viewer, ui, &[ToolSelect, ToolMove, ToolRotate, ToolScale, LocalAxes, Aim]);
            ui.separator();
            items(viewer, ui, &[AddModel, AddLamp, AddPointLight]);
        });
        ui.menu_button("View", |ui| {
            items(viewer, ui, &[Frame, Home, ToggleProjection, Play, KeepView]);
            ui.separator();
            items(viewer, ui, &[PlayTime, StepOn, StepBack, Rest]);
            ui.separator();
            items(viewer, ui, &[ResetZoom, FullScreen, SidePanel, Icons, Compass, Ground]);
            ui.checkbox(&mut viewer.settings.dark, "Dark theme");
            ui.checkbox(&mut viewer.settings.high_contrast, "High contrast");
            ui.checkbox(&mut viewer.settings.reduced_motion, "Reduced motion");
            ui.add(egui::Slider::new(&mut viewer.settings.zoom, 0.5..=3.0).text("Panel scale"));
        });
        ui.menu_button("Picture", |ui| {
            items(viewer, ui, &[Pause, Restart, Brighter, Darker, NextLayer, Picture]);
            ui.separator();
            items(viewer, ui, &[Snapshot, CopyPicture, SendToTev, CropArea, CropNothing, Zebra, PixelGrid]);
            ui.separator();
            items(viewer, ui, &[CompareSettings, CompareNow, CompareFile, CompareNothing, NextLook]);
            ui.separator();
            items(viewer, ui, &[PresetDraft, PresetPreview, PresetFinal]);
            ui.separator();
            items(viewer, ui, &[RecordTurntable, RecordPath, RecordOrbit, StopRecording]);
        });
        ui.menu_button("Help", |ui| items(viewer, ui, &[Palette, Help, ExportStatistics]));
    });
}

fn items(viewer: &mut Viewer, ui: &mut Ui, commands: &[Command]) {
    commands.iter().for_each(|command| item(viewer, ui, *command));
}

/// A command with its keys.
fn item(viewer: &mut Viewer, ui: &mut Ui, command: Command) {
    let Some(info) = COMMANDS.iter().find(|info| info.command == command) else { return };
    let keys = info.shortcut_text(ui.ctx());
    if ui.add(egui::Button::new(info.name).shortcut_text(keys)).clicked() {
        ui.close();
        viewer.run(command, &ui.ctx().clone());
    }
}

fn recent(viewer: &mut Viewer, ui: &mut Ui) {
    ui.menu_button("Recent", |ui| {
        for name in viewer.settings.recent.clone() {
            if ui.button(&name).clicked() {
                viewer.open_source(alhazen::Source::parse(&name));
                ui.close();
            }
        }
        if viewer.settings.recent.is_empty() {
            ui.weak("none");
        }
    });
}

fn builtin(viewer: &mut Viewer, ui: &mut Ui) {
    ui.menu_button("Built-in scenes", |ui| {
        for scene in alhazen::builtin::list() {
            if ui.button(scene.name).on_hover_text(&scene.about).clicked() {
                viewer.open_source(alhazen::Source::parse(scene.name));
                ui.close();
            }
        }
    });
}
