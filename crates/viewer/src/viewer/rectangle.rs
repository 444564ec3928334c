//! A rectangle that is dragged over the picture: what is in it is selected, or it is all that is rendered.

use super::choosing::{Choosing, RectangleUse};
use super::state::Viewer;
use crate::queries::{Question, What};
use alhazen::InstanceId;
use egui::{Color32, Painter, PointerButton, Pos2, Rect, Response, Stroke, StrokeKind, Ui, pos2};

/// Rectangles that are smaller than this (points) are slips of the hand.
const LEAST: f32 = 3.0;

impl Viewer {
    /// Has the next drag of the picture be a rectangle; again ends that.
    pub(super) fn await_rectangle(&mut self, wanted: RectangleUse) {
        let ends = self.rectangle.awaits == Some(wanted);
        self.rectangle.awaits = (!ends).then_some(wanted);
        let text = match wanted {
            _ if ends => "the next drag turns the camera again",
            RectangleUse::Select => "drag a rectangle: Shift selects more, Alt takes away",
            RectangleUse::Crop => "drag a rectangle around what is to be rendered",
        };
        self.notice(text, false);
    }

    /// Gives up the rectangle that is being dragged or waited for.
    pub(super) fn give_up_rectangle(&mut self) {
        // The button may still be held.
        self.gizmo.spent = self.rectangle.drag.is_some();
        (self.rectangle.awaits, self.rectangle.drag) = (None, None);
    }

    /// Follows the pointer where it drags a rectangle: when one is waited for, or with Ctrl beside all handles. True where
    /// nothing else should follow it.
    pub fn drag_rectangle(&mut self, ui: &Ui, response: &Response) -> bool {
        let (modifiers, origin) = ui.input(|i| (i.modifiers, i.pointer.press_origin()));
        if response.drag_started_by(PointerButton::Primary)
            && let Some(origin) = origin
        {
            let on_handle = || crate::gizmo::nearest(&self.gizmo_shapes(), origin).is_some();
            let by_key = modifiers.command && !on_handle();
            let wanted = self.rectangle.awaits.or(by_key.then_some(RectangleUse::Select));
            self.rectangle.drag = wanted.map(|wanted| (wanted, origin, origin));
        }
        let Some((wanted, from, to)) = &mut self.rectangle.drag else { return false };
        *to = response.interact_pointer_pos().unwrap_or(*to);
        let (wanted, area) = (*wanted, Rect::from_two_pos(*from, *to));
        if !response.dragged() {
            (self.rectangle.drag, self.rectangle.awaits) = (None, None);
            if area.width().max(area.height()) >= LEAST {
                self.rectangle.choosing = match (modifiers.shift, modifiers.alt) {
                    (true, _) => Choosing::More,
                    (_, true) => Choosing::Less,
                    _ => Choosing::Only,
                };
                self.use_rectangle(wanted, area);
            }
        }
        true
    }

    /// Does what a rectangle of the window is for.
    pub fn use_rectangle(&mut self, wanted: RectangleUse, area: Rect) {
        let shares = |at: Pos2| (at - self.place.min) / self.place.size();
        let (low, high) = (shares(area.min), shares(area.max));
        let [left, top, right, bottom] = [low.x, low.y, high.x, high.y].map(|v| v.clamp(0.0, 1.0));
        if left >= right || top >= bottom {
            return self.notice("the rectangle is outside the picture", false);
        }
        match wanted {
            RectangleUse::Crop => self.crop_to(Some([left, top, right, bottom])),
            RectangleUse::Select => {
                let job = self.job();
                let (width, height) = super::paint::outline_size(&job);
                let what = What::Area([left, top, right, bottom]);
                self.queries.ask(Question { camera: job.camera, width, height, what });
            }
        }
    }

    /// Selects what was found in a rectangle.
    pub(super) fn take_area(&mut self, found: Vec<InstanceId>) {
        if found.is_empty() && self.rectangle.choosing == Choosing::Only {
            self.notice("no object is seen for the most part in the rectangle", false);
        }
        let is_new = !found.is_empty();
        self.choose_objects(found, self.rectangle.choosing);
        if is_new {
            self.open.tab = crate::panels::Tab::Objects;
        }
    }

    /// Renders only a part of the picture (left, top, right and bottom in shares of its size), or all of it again.
    pub fn crop_to(&mut self, crop: Option<[f32; 4]>) {
        match (crop, self.render.crop) {
            (None, None) => return self.notice("the whole picture is rendered already", false),
            (None, Some(_)) => self.notice("the whole picture is rendered", false),
            (Some(_), _) => {
                self.notice("only the rectangle is rendered and saved, until the crop is reset", false);
            }
        }
        self.render.crop = crop;
    }

    pub(super) fn paint_rectangle(&self, painter: &Painter, place: Rect) {
        let visible = place.intersect(painter.clip_rect());
        if let Some([left, top, right, bottom]) = self.render.crop {
            let at =
                |x: f32, y: f32| pos2(place.left() + x * place.width(), place.top() + y * place.height());
            frame(painter, Rect::from_min_max(at(left, top), at(right, bottom)), Color32::from_gray(200));
        }
        if let Some((_, from, to)) = self.rectangle.drag {
            let area = Rect::from_two_pos(from, to).intersect(visible);
            painter.rect_filled(area, 0.0, super::paint::HIGHLIGHT.gamma_multiply(0.12));
            frame(painter, area, super::paint::HIGHLIGHT);
        }
    }
}

/// A border that is seen on bright and on dark pictures.
fn frame(painter: &Painter, area: Rect, colour: Color32) {
    let dark = Stroke::new(3.0, Color32::from_black_alpha(120));
    painter.rect_stroke(area, 0.0, dark, StrokeKind::Outside);
    painter.rect_stroke(area, 0.0, Stroke::new(1.0, colour), StrokeKind::Outside);
}
