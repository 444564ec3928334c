//! Drawing the picture, the line between two pictures, and the outline of what is selected.

use super::compare::Comparison;
use super::state::Viewer;
use super::tools::Look;
use crate::queries::{Outline, Question, What};
use crate::viewport::left_of;
use crate::worker::{Layer, display};
use alhazen::{Film, FrameView, Job, camera_frame, picture_point};
use egui::{Color32, ColorImage, Painter, Pos2, Rect, Response, Stroke, TextureOptions, pos2, vec2};
use glam::Vec3;

/// How near to the line (points) the pointer takes hold of it.
const GRIP: f32 = 8.0;
/// The colour of what is selected.
pub(super) const HIGHLIGHT: Color32 = Color32::from_rgb(255, 170, 30);
/// Outlines are found in pictures that are at most so wide.
const OUTLINE_WIDTH: u32 = 960;

/// So many selected things have a box each.
const MOST_BOXES: usize = 64;

const WHOLE: Rect = Rect { min: Pos2::ZERO, max: pos2(1.0, 1.0) };

impl Viewer {
    /// How the picture's texture is sampled: pixels that are looked at closely have edges.
    pub(super) fn texture_options(&self) -> TextureOptions {
        if self.zoom.factor >= 3.0 { TextureOptions::NEAREST } else { TextureOptions::LINEAR }
    }

    /// Draws everything that lies in the picture's place.
    pub fn paint(&mut self, painter: &Painter, place: Rect) {
        self.sharpen();
        match &self.textures[0] {
            Some(_) if self.shows_difference() => self.paint_difference(painter, place),
            Some(texture) => {
                painter.image(texture.id(), place, WHOLE, Color32::WHITE);
                self.paint_comparison(painter, place);
            }
            None => {}
        }
        self.paint_ground(painter, place);
        self.paint_overlays(painter, place);
        self.paint_names(painter, place);
        self.paint_selection(painter, place);
        self.paint_rectangle(painter, place);
        self.paint_markers(painter);
        self.paint_gizmo(painter, painter.ctx());
        self.paint_compass(painter);
    }

    /// Has the picture's texture sampled as it is looked at now.
    fn sharpen(&mut self) {
        let has_edges = self.texture_options() == TextureOptions::NEAREST;
        if std::mem::replace(&mut self.tools.has_edges, has_edges) == has_edges {
            return;
        }
        let options = self.texture_options();
        for (texture, shot) in self.textures.iter_mut().zip(&self.shots) {
            if let (Some(texture), Some(shot)) = (texture, shot.as_ref().filter(|shot| !shot.preview)) {
                texture.set(shot.image.clone(), options);
            }
        }
        if matches!(self.comparison, Comparison::Stored { .. }) {
            self.textures[1] = None;
        }
    }

    fn paint_difference(&self, painter: &Painter, place: Rect) {
        if let Some(map) = &self.tools.error_map {
            painter.image(map.id(), place, WHOLE, Color32::WHITE);
        }
    }

    fn paint_comparison(&mut self, painter: &Painter, place: Rect) {
        let Some(split) = self.comparison.split() else { return };
        self.show_stored(painter.ctx());
        let split = match self.tools.look {
            Look::Split => split,
            // While the difference is not there yet, A is.
            Look::A | Look::Difference => 1.0,
            Look::B => 0.0,
        };
        let (left, _) = left_of(place, split);
        let right = Rect::from_min_max(pos2(left.right(), place.top()), place.max);
        if let Some(texture) = &self.textures[1] {
            let uv = Rect::from_min_max(pos2(split, 0.0), pos2(1.0, 1.0));
            painter.image(texture.id(), right, uv, Color32::WHITE);
        }
        if self.tools.look == Look::Split {
            let line = [pos2(left.right(), place.top()), pos2(left.right(), place.bottom())];
            painter.line_segment(line, Stroke::new(2.0, Color32::WHITE));
            painter.circle_filled(pos2(left.right(), place.center().y), 6.0, Color32::WHITE);
        }
    }

    /// Says which picture is A and which is B.
    fn paint_names(&self, painter: &Painter, place: Rect) {
        if self.comparison.split().is_none() || self.shows_difference() {
            return;
        }
        let visible = place.intersect(painter.clip_rect());
        if self.tools.look != Look::B {
            let at = visible.left_top() + vec2(8.0, 6.0);
            super::manipulate::outlined_text(painter, at, egui::Align2::LEFT_TOP, "A");
        }
        if matches!(self.tools.look, Look::Split | Look::B) {
            let name = match &self.comparison {
                Comparison::Stored { name, .. } => format!("B: {name}"),
                _ => "B".to_owned(),
            };
            let at = visible.right_top() + vec2(-8.0, 6.0);
            super::manipulate::outlined_text(painter, at, egui::Align2::RIGHT_TOP, &name);
        }
    }

    /// Makes the texture of a stored picture, with the exposure and the curve that there are now.
    fn show_stored(&mut self, ctx: &egui::Context) {
        let Comparison::Stored { image, encoded, .. } = &self.comparison else { return };
        let key = egui::Id::unique("stored picture");
        let state = (std::sync::Arc::as_ptr(image) as usize, self.shown);
        if self.textures[1].is_some() && ctx.data(|d| d.get_temp(key)) == Some(state) {
            return;
        }
        // Only its numbers are shown, not its statistics.
        let Ok(film) = Film::new(1, 1) else { return };
        let layer = match self.shown.layer {
            Layer::Noise => Layer::Picture,
            other => other,
        };
        // Pictures of eight bits have had their exposure and curve.
        let tone = if *encoded { alhazen::ToneMapping::default() } else { self.shown.tone };
        let picture =
            display(image, &film, &crate::worker::Shown { layer, tone, ..self.shown }, FrameView::Picture);
        let options = self.texture_options();
        self.textures[1] = Some(ctx.load_texture("stored picture", picture, options));
        ctx.data_mut(|d| d.insert_temp(key, state));
    }

    /// Whether the pointer drags the line between two pictures; moves it.
    pub fn split_dragged(&mut self, response: &Response) -> bool {
        let is_split = self.tools.look == Look::Split;
        let split = self.comparison.split().filter(|_| is_split);
        let (Some(split), Some(at)) = (split, response.interact_pointer_pos()) else { return false };
        let id = egui::Id::unique("split is dragged");
        let ctx = &response.ctx;
        let x = self.place.left() + self.place.width() * split;
        if response.drag_started() {
            let from = ctx.input(|i| i.pointer.press_origin()).unwrap_or(at);
            ctx.data_mut(|d| d.insert_temp(id, (from.x - x).abs() <= GRIP));
        }
        let dragged = response.dragged() && ctx.data(|d| d.get_temp::<bool>(id)).unwrap_or(false);
        if dragged {
            self.comparison.set_split((at.x - self.place.left()) / self.place.width().max(1.0));
        }
        dragged
    }

    fn paint_selection(&self, painter: &Painter, place: Rect) {
        let Some(document) = &self.document else { return };
        let chosen = self.chosen_objects();
        let fresh = self.outline.as_ref().filter(|(question, outline, _)| {
            outline.instances == chosen && question.camera == self.job().camera
        });
        if let Some((_, _, Some(texture))) = fresh
            && self.asked_outline.as_ref().is_some_and(|(_, edits)| *edits == self.edit_count)
        {
            painter.image(texture.id(), place, WHOLE, Color32::WHITE);
            return;
        }
        // While everything moves, boxes are quicker; of many things one around all of them.
        let boxes: Vec<_> = match chosen.len() {
            0 => return,
            1..=MOST_BOXES => chosen.iter().filter_map(|object| document.bounds_of(*object)).collect(),
            _ => self.bounds_of_chosen().into_iter().collect(),
        };
        boxes.into_iter().for_each(|(low, high)| self.paint_box(painter, place, low, high));
    }

    fn paint_box(&self, painter: &Painter, place: Rect, low: Vec3, high: Vec3) {
        let job = self.job();
        let frame = camera_frame(&job.camera, job.width, job.height);
        let project = |p: Vec3| {
            let offset = (p - job.camera.eye).as_dvec3();
            let at = picture_point(&frame, job.width, job.height, offset)?.as_vec2();
            let at = vec2(at.x / job.width as f32, at.y / job.height as f32);
            Some(place.min + at * place.size())
        };
        let corner = |i: usize| {
            let pick = |axis: usize| if i >> axis & 1 == 0 { low[axis] } else { high[axis] };
            project(Vec3::new(pick(0), pick(1), pick(2)))
        };
        for a in 0..8usize {
            for axis in 0..3 {
                let b = a | 1 << axis;
                if let (true, Some(from), Some(to)) = (b != a, corner(a), corner(b)) {
                    painter.line_segment([from, to], Stroke::new(1.0, HIGHLIGHT));
                }
            }
        }
    }

    /// Has the outline of what is selected found, once nothing moves.
    pub(super) fn ask_for_outline(&mut self, moving: bool) {
        let chosen = self.chosen_objects();
        if moving || chosen.is_empty() {
            return;
        }
        let job = self.job();
        let (width, height) = outline_size(&job);
        let what = What::Outline(chosen);
        let question = (Question { camera: job.camera, width, height, what }, self.edit_count);
        if self.asked_outline.as_ref() != Some(&question) {
            self.outline = None;
            self.queries.ask(question.0.clone());
            self.asked_outline = Some(question);
        }
    }

    pub(super) fn take_outline(&mut self, ctx: &egui::Context, outline: Outline) {
        let Some((question, _)) = self.asked_outline.clone() else { return };
        if question.what != What::Outline(outline.instances.clone()) {
            return;
        }
        let pixel = |on: &bool| if *on { HIGHLIGHT } else { Color32::TRANSPARENT };
        let pixels = outline.mask.iter().map(pixel).collect();
        let image = ColorImage::new([outline.width as usize, outline.height as usize], pixels);
        let texture = ctx.load_texture("outline", image, TextureOptions::LINEAR);
        self.outline = Some((question, outline, Some(texture)));
    }
}

/// Width and height of the pictures in which outlines are found.
pub(super) fn outline_size(job: &Job) -> (u32, u32) {
    let scale = (OUTLINE_WIDTH as f32 / job.width as f32).min(1.0);
    let side = |n: u32| ((n as f32 * scale) as u32).max(1);
    (side(job.width), side(job.height))
}
