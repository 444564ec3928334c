//! The grid on the ground: asked for with every picture that is shown, and drawn over it.

use super::state::Viewer;
use super::tools::Ground;
use crate::gizmo::grid::Grid;
use crate::queries::{Question, What};
use alhazen::Camera;
use egui::{Color32, ColorImage, Context, Painter, Rect, TextureOptions};

/// The grid has at most so many columns; while the camera moves, fewer.
const WIDTHS: [u32; 2] = [1280, 320];

impl Viewer {
    /// Shows or hides the grid.
    pub(super) fn toggle_ground(&mut self) {
        self.settings.ground_grid = !self.settings.ground_grid;
        let step = self.snap_length();
        self.notice(
            match self.settings.ground_grid {
                true => format!("the ground grid is shown: a line every {step} m, x is red, z is blue"),
                false => "the ground grid is hidden".to_owned(),
            },
            false,
        );
    }

    /// Has the grid made for the picture that is shown.
    pub(super) fn ask_for_ground(&mut self) {
        let shot = self.shot().filter(|shot| self.settings.ground_grid && shot.generation == self.generation);
        let Some(shot) = shot else {
            self.ground = Ground::default();
            return;
        };
        let job = &shot.job;
        let most = WIDTHS[usize::from(shot.preview)].min(job.width);
        let (width, height) = (most, (job.height * most / job.width.max(1)).max(1));
        let camera = Camera { path: None, ..job.camera.clone() };
        let grid = Grid { step: self.snap_length(), center: camera.target, reach: 1.5 * self.scene_size() };
        let question = Question { camera, width, height, what: What::Ground(grid) };
        if self.ground.asked.as_ref() != Some(&question) {
            self.queries.ask(question.clone());
            self.ground.asked = Some(question);
        }
    }

    /// Another scene hides other parts of it.
    pub(super) fn forget_ground(&mut self) {
        self.ground.asked = None;
    }

    pub(super) fn take_ground(&mut self, ctx: &Context, size: [u32; 2], pixels: Vec<Color32>) {
        let image = ColorImage::new(size.map(|side| side as usize), pixels);
        self.ground.texture = Some(ctx.load_texture("ground grid", image, TextureOptions::LINEAR));
    }

    pub(super) fn paint_ground(&self, painter: &Painter, place: Rect) {
        let is_shown = self.settings.ground_grid && !self.shows_difference();
        if let (true, Some(grid)) = (is_shown, &self.ground.texture) {
            let whole = Rect::from_min_max(egui::pos2(0.0, 0.0), egui::pos2(1.0, 1.0));
            painter.image(grid.id(), place, whole, Color32::WHITE);
        }
    }

    /// Whether the grid is there that belongs to the picture.
    pub fn has_ground(&self) -> bool {
        self.ground.texture.is_some()
    }
}
