//! The gizmo at work: what its handles have hold of, and what becomes of that.

use super::state::Viewer;
use crate::gizmo::{self, Constraint, Drag, Frame, Handle, Held, Lens, Shape, Tool, Typed, nearest};
use alhazen::edits::Edits;
use egui::{Align2, Color32, FontId, Key, Painter, PointerButton, Pos2, Response, Stroke, Ui, vec2};
use gizmo::compass;
use glam::{Affine3A, Vec3};

/// The colours of the axes x, y and z.
const AXES: [Color32; 3] =
    [Color32::from_rgb(235, 80, 80), Color32::from_rgb(120, 205, 70), Color32::from_rgb(80, 140, 245)];
/// A handle that is held or pointed at.
const HOT: Color32 = Color32::from_rgb(255, 220, 60);

impl Viewer {
    /// The picture as it lies in the window.
    pub fn lens(&self) -> Lens {
        Lens { camera: self.job().camera, size: self.size(), place: self.place }
    }

    /// Where the gizmo stands; `None` where nothing is selected that its tool can change.
    pub fn gizmo_frame(&self) -> Option<Frame> {
        let world = [Vec3::X, Vec3::Y, Vec3::Z];
        if self.gizmo.tool == Tool::Select {
            return None;
        }
        let scene = self.document.as_ref()?.scene();
        if let Some(light) = self.gizmo.light {
            let place = super::light::place_of(&scene.lights.get(light)?.kind);
            return match (self.gizmo.tool, place) {
                (Tool::Move | Tool::Rotate, Some(pivot)) => Some(Frame { pivot, axes: world }),
                // It has no place: it turns about what is looked at.
                (Tool::Rotate, None) => Some(Frame { pivot: self.lens().camera.target, axes: world }),
                _ => None,
            };
        }
        if self.chosen_objects().is_empty() {
            return None;
        }
        let (low, high) = self.bounds_of_chosen()?;
        let own = self.selection.filter(|_| self.gizmo.local);
        let own = own.and_then(|s| scene.instances.get(s.object as usize)).map(|i| i.transform);
        let axes = own.map_or(world, |t| {
            let (_, rotation, _) = t.to_scale_rotation_translation();
            world.map(|axis| rotation * axis)
        });
        Some(Frame { pivot: (low + high) * 0.5, axes })
    }

    /// The gizmo's handles as they are seen.
    pub fn gizmo_shapes(&self) -> Vec<Shape> {
        self.gizmo_frame().map_or(Vec::new(), |frame| frame.shapes(self.gizmo.tool, &self.lens()))
    }

    /// Lengths snap to multiples of this, metres: a power of ten that suits the scene.
    pub fn snap_length(&self) -> f32 {
        10f32.powf((self.scene_size() * 0.05).log10().floor())
    }

    /// Follows the pointer where it is on a handle or a sign. True where nothing else should follow it.
    pub fn manipulate(&mut self, ui: &Ui, response: &Response) -> bool {
        let (down, origin) = ui.input(|i| (i.pointer.any_down(), i.pointer.press_origin()));
        if self.gizmo.spent {
            self.gizmo.spent = down;
            return true;
        }
        let pointer = response.interact_pointer_pos().or(response.hover_pos());
        if self.gizmo.held.is_some() || self.gizmo.carried.is_some() {
            if let Some(pointer) = pointer {
                self.drag_to(ui, pointer);
            }
            if !down {
                (self.gizmo.held, self.gizmo.carried) = (None, None);
            }
            return true;
        }
        let shapes = self.gizmo_shapes();
        self.gizmo.hovered = pointer.and_then(|pointer| nearest(&shapes, pointer));
        let plain = ui.input(|i| !i.modifiers.shift && !i.modifiers.alt);
        if response.drag_started_by(PointerButton::Primary) && plain {
            return origin.is_some_and(|origin| self.take_hold(&shapes, origin));
        }
        let Some(at) = pointer.filter(|_| response.clicked() && plain) else { return false };
        self.gizmo.hovered.is_some() || (!self.gizmo.aims && self.pick_marker(at))
    }

    /// Looks along the axis whose end in the compass is clicked. True where one was.
    pub fn click_compass(&mut self, response: &Response) -> bool {
        if !self.settings.compass || !response.clicked() {
            return false;
        }
        let ends = compass::ends(&self.job().camera, response.rect);
        let end = response.interact_pointer_pos().and_then(|at| compass::end_at(&ends, at));
        let Some(end) = end else { return false };
        self.steer(|camera| compass::look_from(camera, &end));
        true
    }

    pub(super) fn paint_compass(&self, painter: &Painter) {
        if self.settings.compass {
            let (room, camera) = (painter.clip_rect(), self.job().camera);
            compass::paint(painter, &compass::ends(&camera, room), room, self.pointer, AXES);
        }
    }

    /// Begins to drag what is at a point.
    fn take_hold(&mut self, shapes: &[Shape], at: Pos2) -> bool {
        self.gizmo.edits_before = self.edit_count;
        if let (Some(handle), Some(frame)) = (nearest(shapes, at), self.gizmo_frame()) {
            self.hold(handle, frame, at);
            return true;
        }
        let carried = self.marker_at(at).filter(|of| self.is_in_the_sky(*of));
        self.gizmo.carried = carried;
        carried.is_some()
    }

    fn hold(&mut self, handle: Handle, frame: Frame, at: Pos2) {
        let drag = Drag::new(self.gizmo.tool, handle, frame, self.lens(), at);
        let Some(document) = &self.document else { return };
        let scene = document.scene();
        let light = self.gizmo.light.and_then(|i| Some((i, scene.lights.get(i)?.clone())));
        let objects = if light.is_some() { Vec::new() } else { self.chosen_objects() };
        let transform = |object: u32| Some((object, scene.instances.get(object as usize)?.transform));
        let objects = objects.into_iter().filter_map(transform).collect();
        self.gizmo.held = Some(Held { drag, typed: Typed::default(), objects, light });
    }

    /// The pointer has dragged there.
    fn drag_to(&mut self, ui: &Ui, pointer: Pos2) {
        if let Some(of) = self.gizmo.carried {
            return self.carry(of, pointer);
        }
        let constraint = self.constraint(ui.ctx());
        let Some(held) = &mut self.gizmo.held else { return };
        held.drag.follow(pointer);
        let motion = held.drag.motion(&constraint);
        let (matrix, objects, light) = (held.drag.matrix(motion), held.objects.clone(), held.light.clone());
        if let Some((number, light)) = light {
            self.edit_lights("gizmo", |lights| {
                if let Some(edited) = lights.get_mut(number) {
                    *edited = light.moved(&matrix);
                }
            });
        } else {
            self.edit("gizmo", |edits| move_objects(edits, &objects, &matrix));
        }
        ui.ctx().request_repaint();
    }

    fn constraint(&self, ctx: &egui::Context) -> Constraint {
        let snaps = ctx.input(|i| i.modifiers.command);
        let typed = self.gizmo.held.as_ref().and_then(|held| held.typed.number());
        Constraint { snap: snaps.then(|| self.snap_length()), typed }
    }

    /// Keys while something is dragged: a number, Escape, Enter. True where they mean nothing else.
    pub(super) fn take_drag_keys(&mut self, ctx: &egui::Context) -> bool {
        if self.gizmo.held.is_none() && self.gizmo.carried.is_none() {
            return false;
        }
        let (events, gives_up, ends) =
            ctx.input(|i| (i.events.clone(), i.key_pressed(Key::Escape), i.key_pressed(Key::Enter)));
        if let Some(held) = &mut self.gizmo.held {
            held.typed.take(&events);
        }
        if gives_up || ends {
            (self.gizmo.held, self.gizmo.carried, self.gizmo.spent) = (None, None, true);
        }
        if gives_up {
            self.give_up_gesture();
        }
        true
    }

    /// Takes back what the drag has changed so far.
    fn give_up_gesture(&mut self) {
        let has_changed = self.edit_count > self.gizmo.edits_before;
        if has_changed && self.document.as_mut().is_some_and(|document| document.abandon()) {
            self.send_edits();
        }
    }

    /// Chooses what dragging does.
    pub(super) fn use_tool(&mut self, tool: Tool) {
        self.gizmo.tool = tool;
        let text = match tool {
            Tool::Select => "a click selects; there are no handles",
            _ if self.gizmo_frame().is_none() => "select an object or a light to see its handles",
            _ => return,
        };
        self.notice(format!("{}: {text}", tool.name()), false);
    }

    /// Draws the handles, and what the drag has come to.
    pub(super) fn paint_gizmo(&self, painter: &Painter, ctx: &egui::Context) {
        let held = self.gizmo.held.as_ref();
        let hot = held.map(|held| held.drag.handle).or(self.gizmo.hovered);
        for shape in self.gizmo_shapes() {
            // Other handles are in the way of what is dragged.
            if held.is_none_or(|held| held.drag.handle == shape.handle) {
                paint_handle(painter, &shape, self.gizmo.tool, hot == Some(shape.handle));
            }
        }
        let Some(held) = held else { return };
        let mut text = held.drag.motion(&self.constraint(ctx)).text();
        if !held.typed.text().is_empty() {
            text = format!("{text}   typed: {}", held.typed.text());
        }
        let at = self.place.intersect(painter.clip_rect()).center_bottom() - vec2(0.0, 14.0);
        outlined_text(painter, at, Align2::CENTER_BOTTOM, &text);
    }
}

/// Moves objects from where they were.
fn move_objects(edits: &mut Edits, objects: &[(u32, Affine3A)], matrix: &Affine3A) {
    for (object, transform) in objects {
        edits.object(*object).set_transform(&(*matrix * *transform));
    }
}

fn paint_handle(painter: &Painter, shape: &Shape, tool: Tool, is_hot: bool) {
    let own = match shape.handle {
        Handle::Axis(i) | Handle::Plane(i) | Handle::Ring(i) => AXES[i],
        Handle::ViewRing | Handle::Center => Color32::from_gray(230),
    };
    let colour = if is_hot { HOT } else { own };
    let edge = Stroke::new(4.5, Color32::from_black_alpha(110));
    let stroke = Stroke::new(2.5, colour);
    match shape.handle {
        Handle::Center => {
            painter.circle(shape.grip, 5.5, colour, Stroke::new(1.5, Color32::from_black_alpha(160)));
        }
        Handle::Plane(_) => {
            let fill = colour.gamma_multiply(0.55);
            painter.add(egui::Shape::convex_polygon(shape.points.clone(), fill, Stroke::new(1.0, colour)));
        }
        Handle::Axis(_) => {
            let [from, to] = [shape.points[0], shape.points[1]];
            painter.line_segment([from, to], edge);
            painter.line_segment([from, to], stroke);
            let along = (to - from).normalized();
            if tool == Tool::Scale {
                painter.rect_filled(egui::Rect::from_center_size(to, vec2(9.0, 9.0)), 1.0, colour);
            } else {
                let (tip, side) = (to + along * 9.0, along.rot90() * 5.0);
                let corners = vec![tip, to + side, to - side];
                painter.add(egui::Shape::convex_polygon(corners, colour, Stroke::NONE));
            }
        }
        Handle::Ring(_) | Handle::ViewRing => {
            painter.line(shape.points.clone(), edge);
            painter.line(shape.points.clone(), stroke);
        }
    }
}

/// Text that can be read over any picture.
pub fn outlined_text(painter: &Painter, at: Pos2, align: Align2, text: &str) {
    let font = FontId::proportional(14.0);
    let galley = painter.layout_no_wrap(text.to_owned(), font, Color32::WHITE);
    let rect = align.anchor_size(at, galley.size());
    painter.rect_filled(rect.expand2(vec2(6.0, 3.0)), 4.0, Color32::from_black_alpha(170));
    painter.galley(rect.min, galley, Color32::WHITE);
}
