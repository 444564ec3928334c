//! Small windows over the picture: errors, and what mouse and keys do.

use crate::viewer::{COMMANDS, Viewer};
use egui::{Align2, Context, Grid, Window};

/// What the mouse does over the picture.
const MOUSE: [(&str, &str); 20] = [
    ("Drag", "orbit"),
    ("Shift and drag, middle drag", "pan"),
    ("Right drag", "look around"),
    ("Wheel, two fingers", "dolly"),
    ("Shift and two fingers", "pan"),
    ("Ctrl and wheel, pinch", "zoom the picture"),
    ("Alt and drag", "move the zoomed picture"),
    ("Click", "select"),
    ("Shift and click", "select as well, or no more"),
    ("Ctrl and drag; B, then drag", "select what is in a rectangle; Shift: more; Alt: less"),
    ("Drag a material onto an object", "give it the material"),
    ("Double click", "set the orbit centre"),
    ("Ctrl and click", "set the focus distance"),
    ("Drag a handle", "move, rotate or scale the selection"),
    ("Ctrl and drag a handle", "snap; a number can be typed; Escape gives up"),
    ("Click a light's sign", "select the light"),
    ("Drag the sun's sign", "move the sun through the sky"),
    ("Click the compass", "look along an axis"),
    ("W A S D, Q E", "fly"),
    ("Shift", "fly faster"),
];

/// Mouse and keys.
pub fn help(viewer: &mut Viewer, ctx: &Context) {
    let mut open = true;
    let window = Window::new("Mouse and keys").open(&mut open).collapsible(false).vscroll(true);
    window.anchor(Align2::CENTER_TOP, [0.0, 60.0]).default_height(480.0).show(ctx, |ui| {
        Grid::new("help").striped(true).show(ui, |ui| {
            for (what, does) in MOUSE {
                ui.strong(what);
                ui.label(does);
                ui.end_row();
            }
            for info in COMMANDS {
                if info.keys.is_some() {
                    ui.strong(info.shortcut_text(ctx));
                    ui.label(info.name);
                    ui.end_row();
                }
            }
        });
    });
    if !open {
        viewer.open.close_overlays();
    }
}

/// Folders that a question names.
const MOST_FOLDERS: usize = 12;

/// Asks whether a scene may read files that are not below its folder.
pub fn elsewhere(viewer: &mut Viewer, ctx: &Context) {
    let Some(elsewhere) = viewer.elsewhere.clone() else { return };
    let mut answer = None;
    let window = Window::new("Files elsewhere").collapsible(false);
    window.anchor(Align2::CENTER_CENTER, [0.0, 0.0]).default_width(460.0).show(ctx, |ui| {
        let (job, files) = (elsewhere.job.to_string(), elsewhere.files);
        ui.label(format!(
            "{} asks for files that are not below its folder ({files}). It does not get them. They are in:",
            alhazen::plain(&job)
        ));
        for folder in elsewhere.folders.iter().take(MOST_FOLDERS) {
            ui.monospace(alhazen::plain(&folder.display().to_string()));
        }
        if elsewhere.folders.len() > MOST_FOLDERS {
            ui.label(format!("and {} more folders", elsewhere.folders.len() - MOST_FOLDERS));
        }
        ui.horizontal(|ui| {
            if ui.button("Allow these folders").clicked() {
                answer = Some(true);
            }
            if ui.button("Leave them out").clicked() {
                answer = Some(false);
            }
        });
    });
    if let Some(allow) = answer {
        viewer.answer_elsewhere(allow);
    }
}

/// Errors, until they are dismissed.
pub fn notices(viewer: &mut Viewer, ctx: &Context) {
    if !viewer.notices.iter().any(|n| n.is_error) {
        return;
    }
    let mut open = true;
    let window = Window::new("Error").open(&mut open).collapsible(false);
    window.anchor(Align2::CENTER_CENTER, [0.0, 0.0]).default_width(460.0).show(ctx, |ui| {
        for notice in viewer.notices.iter().filter(|n| n.is_error) {
            ui.label(&notice.text);
            ui.separator();
        }
        if ui.button("Dismiss").clicked() {
            viewer.notices.retain(|n| !n.is_error);
        }
    });
    if !open {
        viewer.notices.retain(|n| !n.is_error);
    }
}
