//! Pictures that were kept to be compared with: snapshots of what is rendered, and files.

use super::compare::Comparison;
use super::state::Viewer;
use super::tools::Snapshot;
use crate::exr_layers::LayerChoice;
use crate::render_settings::RenderSettings;
use alhazen::{Camera, Image, ToneMapping};
use egui::{Color32, ColorImage};
use std::sync::Arc;

/// Width of small pictures, pixels.
const SMALL: u32 = 96;

/// A picture with at most [`SMALL`] columns: pixels of the original, evenly chosen.
fn small(image: &Image, tone: &ToneMapping) -> ColorImage {
    let width = image.width().clamp(1, SMALL);
    let height = (image.height() * width / image.width().max(1)).max(1);
    let middle = |i: u32, of: u32, size: u32| ((2 * i + 1) * size / (2 * of)).min(size.saturating_sub(1));
    let chosen = Image::from_fn(width, height, |x, y| {
        image.rgb(middle(x, width, image.width()), middle(y, height, image.height()))
    });
    let mapped = tone.apply(&chosen);
    let code = |v: f32| (v * 255.0 + 0.5) as u8;
    let pixel = |c: &[f32]| Color32::from_rgb(code(c[0]), code(c[1]), code(c[2]));
    let pixels = mapped.data().chunks_exact(3).map(pixel).collect();
    ColorImage::new([width as usize, height as usize], pixels)
}

impl Viewer {
    /// Keeps the picture as it is now.
    pub fn take_snapshot(&mut self) {
        let Some(shot) = self.shot().filter(|shot| !shot.preview) else {
            return self.notice("there is no full picture to keep yet", false);
        };
        let [width, height] = [shot.linear.width(), shot.linear.height()];
        let (image, spp, camera) = (shot.linear.clone(), shot.spp, shot.job.camera.clone());
        let name = format!("snapshot {}", 1 + self.tools.snapshots.len());
        let integrator = self.render.integrators.chosen().name();
        let arguments = self.render.arguments();
        let backend = &self.backend.name;
        let about = format!("{width}×{height}, {spp} spp, {backend}, {integrator} {arguments}");
        let made_by = Some((camera, self.render.clone()));
        let about = about.trim_end().to_owned();
        self.keep(name.clone(), image, false, about, made_by);
        self.notice(format!("kept {name}; it is on the Image page"), false);
    }

    /// Adds a picture to those that were kept.
    pub(super) fn keep(
        &mut self,
        name: String,
        image: Arc<Image>,
        encoded: bool,
        about: String,
        made_by: Option<(Camera, RenderSettings)>,
    ) {
        // Pictures of eight bits have had their exposure and curve.
        let tone = if encoded { ToneMapping::default() } else { self.shown.tone };
        let small = Arc::new(small(&image, &tone));
        let kept = Snapshot { name, image, encoded, layers: None, about, made_by, small, thumbnail: None };
        self.tools.snapshots.push(kept);
    }

    /// Shows another layer or channel of a file that was opened, also where it is compared with.
    pub fn choose_layer(&mut self, number: usize, choice: LayerChoice) {
        let tone = self.shown.tone;
        let Some(kept) = self.tools.snapshots.get_mut(number) else { return };
        let Some((layers, chosen)) = &mut kept.layers else { return };
        let Some(image) = layers.image(choice) else { return };
        *chosen = choice;
        let before = std::mem::replace(&mut kept.image, Arc::new(image));
        (kept.small, kept.thumbnail) = (Arc::new(small(&kept.image, &tone)), None);
        let is_compared = matches!(&self.comparison, Comparison::Stored { image, .. }
            if Arc::ptr_eq(image, &before));
        if is_compared {
            self.compare_with_snapshot(number);
        }
    }

    /// Compares with a picture that was kept.
    pub fn compare_with_snapshot(&mut self, number: usize) {
        let Some(snapshot) = self.tools.snapshots.get(number) else { return };
        let Snapshot { name, image, encoded, .. } = snapshot.clone();
        let split = self.comparison.split().unwrap_or(0.5);
        self.textures[1] = None;
        self.comparison = Comparison::Stored { name, image, encoded, split };
    }

    /// Forgets a picture that was kept. A comparison with it ends.
    pub fn forget_snapshot(&mut self, number: usize) {
        if number >= self.tools.snapshots.len() {
            return;
        }
        let snapshot = self.tools.snapshots.remove(number);
        let is_compared = matches!(&self.comparison, Comparison::Stored { image, .. }
            if Arc::ptr_eq(image, &snapshot.image));
        if is_compared {
            self.compare_nothing();
        }
    }

    /// Renders again what a snapshot was made with.
    pub fn return_to_snapshot(&mut self, number: usize) {
        let made_by = self.tools.snapshots.get(number).and_then(|s| s.made_by.clone());
        if let Some((camera, render)) = made_by {
            self.look_through(camera);
            self.render = render;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_pictures_show_the_whole_picture() {
        let ramp = Image::from_fn(1000, 500, |x, y| [x as f32 / 999.0, y as f32 / 499.0, 0.0]);
        let small = small(&ramp, &ToneMapping::default());
        assert_eq!(small.size, [96, 48]);
        let (first, last) = (small.pixels[0], small.pixels[96 * 48 - 1]);
        assert!(first.r() < 32 && first.g() < 32 && last.r() > 250 && last.g() > 250, "{first:?} {last:?}");
        let one = super::small(&Image::from_fn(1, 1, |_, _| [1.0; 3]), &ToneMapping::default());
        assert_eq!((one.size, one.pixels[0]), ([1, 1], Color32::WHITE));
    }
}
