//! Paths over the picture that they belong to.

use super::Explained;
use crate::commands::render::check_output;
use crate::exit::Exit;
use alhazen::output::Format;
use alhazen::{
    Control, Denoiser, Image, Job, Limits, NoisyPicture, PathLineKind, PathRecord, ProtectedFiles, Renderer,
    View, path_lines,
};
use anyhow::{anyhow, ensure};
use glam::DVec2;
use std::path::Path;

/// Samples of the picture below.
const SPP: u32 = 8;
/// What is left of its light.
const DIMMED: f32 = 0.4;
/// Width of lines, pixels of a picture that is 640 wide.
const LINE: f64 = 1.6;

const SEGMENT: [f32; 3] = [0.35, 0.75, 1.0];
const TO_LIGHT: [f32; 3] = [1.0, 0.85, 0.25];
const OCCLUDED: [f32; 3] = [0.9, 0.25, 0.2];

/// Whether a drawing can be written there.
///
/// # Errors
/// For files that are no PNG, places that cannot be written, and files of the scene.
pub fn check(path: &Path, inputs: &ProtectedFiles) -> anyhow::Result<()> {
    check_output(path, false, inputs)?;
    let text = format!("--draw {}: give a .png", path.display());
    ensure!(matches!(Format::of(path)?, Format::Png), Exit::Usage.with(anyhow!(text)));
    Ok(())
}

/// Renders the picture with few samples, and draws the paths over it: segments bluish, the ways to lights that are seen
/// yellow, to those that are not, red.
pub fn write(
    path: &Path,
    explained: &Explained,
    job: &Job,
    time: f32,
    threads: Option<usize>,
) -> anyhow::Result<()> {
    let mut job = Job { crop: None, ..job.clone() };
    job.aovs = NoisyPicture::LAYERS.to_vec();
    let mut renderer = Renderer::cpu(threads)?;
    renderer.load(explained.scene)?;
    let view = job.view(time);
    let limits = Limits { spp: SPP, ..Limits::default() };
    renderer.render_view(&view, &limits, &Control::new(), &mut |_, _| {})?;
    let Some(film) = renderer.film()? else { return Ok(()) };
    let noisy = NoisyPicture::of_film(film)?;
    let clean = renderer.denoise(Denoiser::Network, &noisy)?.picture;
    let mut picture = job.tone.apply(&clean).to_rgb().map(|c| c * DIMMED);
    let width = LINE * f64::from(view.width) / 640.0;
    let mut canvas = Canvas { picture: &mut picture, view: &view, width: width.max(1.0) };
    for path in explained.samples.iter().flat_map(|sample| &sample.paths) {
        canvas.draw_path(path);
    }
    picture.write_png_encoded(path).map_err(|error| Exit::Output.with(error.into()))
}

/// A picture that lines of the scene are drawn on.
struct Canvas<'a> {
    picture: &'a mut Image,
    view: &'a View,
    /// Of lines, pixels.
    width: f64,
}

impl Canvas<'_> {
    fn draw_path(&mut self, path: &PathRecord) {
        for line in path_lines(path) {
            let color = match line.kind {
                PathLineKind::Segment => SEGMENT,
                PathLineKind::ToLight => TO_LIGHT,
                PathLineKind::Occluded => OCCLUDED,
            };
            // By the throughput, never so weakly that it cannot be seen.
            let strength = line.throughput.clamp(0.0, 1.0).sqrt().max(0.25);
            for [a, b] in line.in_picture(self.view) {
                self.draw_piece(a, b, color, strength);
            }
        }
    }

    /// Covers each pixel by how near its centre is to the piece.
    fn draw_piece(&mut self, a: DVec2, b: DVec2, color: [f32; 3], strength: f32) {
        let size = DVec2::new(f64::from(self.view.width), f64::from(self.view.height));
        let (low, high) = (a.min(b) - self.width, a.max(b) + self.width);
        if !(low.is_finite() && high.is_finite())
            || high.min_element() < 0.0
            || (low - size).max_element() > 0.0
        {
            return;
        }
        let (low, high) = (low.max(DVec2::ZERO), high.min(size - 1.0));
        for y in low.y as u32..=high.y as u32 {
            for x in low.x as u32..=high.x as u32 {
                let center = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                let along = ((center - a).dot(b - a) / (b - a).length_squared().max(1e-12)).clamp(0.0, 1.0);
                let away = (center - a.lerp(b, along)).length();
                let cover = (0.5 * self.width + 0.5 - away).clamp(0.0, 1.0) as f32 * strength;
                let first = 3 * (y as usize * self.view.width as usize + x as usize);
                let pixel = &mut self.picture.data_mut()[first..first + 3];
                // Pieces overlap at their ends: the brighter one counts.
                pixel
                    .iter_mut()
                    .zip(color)
                    .for_each(|(c, line)| *c = c.max(line * cover + *c * (1.0 - cover)));
            }
        }
    }
}
