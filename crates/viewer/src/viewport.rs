//! The picture in the middle of the window, and what the mouse does with it.

mod zoom;

pub use zoom::{Zoom, left_of, pixel_at, pixels_in};

use crate::panels::DraggedMaterial;
use crate::viewer::{Action, Viewer};
use alhazen::navigation;
use egui::{Color32, Key, PointerButton, Rect, Response, Sense, Ui, Vec2};

/// Shows the picture and follows mouse and keys.
pub fn show(viewer: &mut Viewer, ui: &mut Ui) {
    let room = ui.available_rect_before_wrap();
    let response = ui.allocate_rect(room, Sense::click_and_drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Picture"));
    let pixels_per_point = ui.ctx().pixels_per_point();
    viewer.set_room(room.size() * pixels_per_point);
    let aspect = viewer.aspect();
    let place = viewer.zoom.place(room, aspect);
    viewer.place = place;
    let painter = ui.painter_at(room);
    // Not where the picture hides it: software drivers take their time for every pixel.
    if viewer.shot().is_none() || !place.contains_rect(room) {
        painter.rect_filled(room, 0.0, Color32::from_gray(18));
    }
    viewer.paint(&painter, place);
    steer(viewer, ui, &response, room, aspect);
}

/// Mouse and keys over the picture.
fn steer(viewer: &mut Viewer, ui: &Ui, response: &Response, room: Rect, aspect: f32) {
    let (modifiers, scroll, pinch) = ui.input(|i| (i.modifiers, i.smooth_scroll_delta(), i.zoom_delta()));
    let height = viewer.place.height().max(1.0);
    let drag = response.drag_delta();
    let drag = glam::Vec2::new(drag.x, drag.y) / height;
    if viewer.split_dragged(response) {
        return;
    }
    viewer.pointer = response.hover_pos();
    let drops = response.dnd_release_payload::<DraggedMaterial>();
    if let (Some(material), Some(at)) = (drops, ui.input(|i| i.pointer.interact_pos())) {
        return viewer.act(Action::TakeMaterial(at, material.0));
    }
    let takes_pointer = viewer.click_compass(response) || viewer.drag_rectangle(ui, response);
    if takes_pointer || viewer.manipulate(ui, response) {
        return;
    }
    if drag != glam::Vec2::ZERO {
        let pans = response.dragged_by(PointerButton::Middle)
            || (response.dragged_by(PointerButton::Primary) && modifiers.shift);
        if modifiers.alt && viewer.zoom.factor > 1.0 {
            viewer.zoom.center -= response.drag_delta() / viewer.place.size();
        } else if pans {
            viewer.steer(|c| navigation::pan(c, drag));
        } else if response.dragged_by(PointerButton::Secondary) {
            viewer.steer(|c| navigation::look(c, drag));
        } else {
            viewer.steer(|c| navigation::orbit(c, drag));
        }
    }
    if let Some(pointer) = viewer.pointer {
        if pinch != 1.0 {
            // Ctrl and the wheel, or two fingers on a touchpad.
            viewer.zoom.by(pinch, pointer, room, aspect);
        } else if modifiers.shift && scroll != Vec2::ZERO {
            let by = glam::Vec2::new(scroll.x, scroll.y) / height;
            viewer.steer(|c| navigation::pan(c, by));
        } else if scroll.y != 0.0 {
            viewer.steer(|c| navigation::dolly(c, scroll.y / 50.0));
        }
    }
    if let Some(at) = response.interact_pointer_pos() {
        if response.double_clicked() {
            viewer.act(Action::FocusOn(at));
        } else if response.clicked() && modifiers.command {
            viewer.act(Action::FocusLens(at));
        } else if response.clicked() && modifiers.shift {
            viewer.act(Action::Toggle(at));
        } else if response.clicked() && viewer.gizmo.aims {
            viewer.act(Action::Aim(at));
        } else if response.clicked() {
            viewer.act(Action::Pick(at));
        }
    }
    if !ui.ctx().egui_wants_keyboard_input() {
        fly(viewer, ui);
    }
}

/// WASD, Q and E while they are held, at a speed that suits the scene.
fn fly(viewer: &mut Viewer, ui: &Ui) {
    let (motion, fast, dt) = ui.input(|i| {
        let axis = |plus: Key, minus: Key| {
            f32::from(u8::from(i.key_down(plus))) - f32::from(u8::from(i.key_down(minus)))
        };
        let free = !i.modifiers.command && !i.modifiers.alt;
        let motion = glam::Vec3::new(axis(Key::D, Key::A), axis(Key::E, Key::Q), axis(Key::W, Key::S));
        (if free { motion } else { glam::Vec3::ZERO }, i.modifiers.shift, i.stable_dt.min(0.1))
    });
    if motion != glam::Vec3::ZERO {
        let speed = viewer.scene_size() * 0.25 * if fast { 4.0 } else { 1.0 };
        viewer.steer(|c| navigation::fly(c, motion * speed * dt));
        ui.ctx().request_repaint();
    }
}
