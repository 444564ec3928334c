//! Another picture beside the one that is rendered, behind a line that can be dragged.

use super::state::Viewer;
use crate::exr_layers::{ExrLayers, LayerChoice};
use crate::render_settings::RenderSettings;
use alhazen::{Image, ImageError, Job, ToneMapping};
use std::path::Path;
use std::sync::Arc;

/// What the picture is compared with.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Comparison {
    /// Nothing.
    #[default]
    None,
    /// The same scene with other settings, rendered in turns.
    Settings {
        /// They.
        settings: Box<RenderSettings>,
        /// Where the line is, in shares of the width.
        split: f32,
    },
    /// A picture that was stored.
    Stored {
        /// What the user calls it.
        name: String,
        /// Its radiance, or its display values where the file has no more.
        image: Arc<Image>,
        /// Whether the values are display values already.
        encoded: bool,
        /// Where the line is, in shares of the width.
        split: f32,
    },
}

impl Comparison {
    /// The other picture to render.
    pub fn job(&self, viewer: &Viewer) -> Option<Job> {
        let Self::Settings { settings, .. } = self else { return None };
        let job = viewer.job();
        let size = [job.width, job.height];
        Some(settings.job(job.camera, size, &viewer.shown, ToneMapping::default()))
    }

    /// Where the line is.
    pub fn split(&self) -> Option<f32> {
        match self {
            Self::None => None,
            Self::Settings { split, .. } | Self::Stored { split, .. } => Some(*split),
        }
    }

    /// Moves the line.
    pub fn set_split(&mut self, to: f32) {
        match self {
            Self::None => {}
            Self::Settings { split, .. } | Self::Stored { split, .. } => *split = to.clamp(0.0, 1.0),
        }
    }
}

/// A picture from a file, with all its layers if it is an EXR file that has several.
fn open(path: &Path) -> Result<(Image, Option<ExrLayers>), ImageError> {
    if !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")) {
        return Ok((Image::open(path)?, None));
    }
    let layers = ExrLayers::read(path)?;
    Ok((layers.picture().clone(), Some(layers).filter(ExrLayers::has_choice)))
}

impl Viewer {
    /// Compares with the same scene under other settings, which begin as those that there are.
    pub fn compare_settings(&mut self) {
        (self.textures[1], self.tools.look) = (None, Default::default());
        self.comparison = Comparison::Settings { settings: Box::new(self.render.clone()), split: 0.5 };
    }

    /// Compares with the picture as it is now, which is kept as a snapshot.
    pub fn compare_with_now(&mut self) {
        let before = self.tools.snapshots.len();
        self.take_snapshot();
        if self.tools.snapshots.len() > before {
            self.compare_with_snapshot(before);
        }
    }

    /// Compares with a picture from a file, which is kept with the snapshots.
    pub fn compare_with_file(&mut self, path: &Path) {
        match open(path) {
            Ok((image, layers)) => {
                // Files of eight bits are decoded to linear values; EXR and HDR have radiance.
                let encoded = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
                let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
                let about = format!("{}×{}, {}", image.width(), image.height(), path.display());
                // A file that is opened again replaces what it was.
                self.tools.snapshots.retain(|kept| kept.made_by.is_some() || kept.about != about);
                self.keep(name, Arc::new(image.to_rgb()), encoded, about, None);
                if let Some(kept) = self.tools.snapshots.last_mut() {
                    kept.layers = layers.map(|layers| (Arc::new(layers), LayerChoice::default()));
                }
                self.compare_with_snapshot(self.tools.snapshots.len() - 1);
            }
            Err(error) => self.notice(crate::worker::full_text(&error), true),
        }
    }

    /// Ends comparing.
    pub fn compare_nothing(&mut self) {
        self.comparison = Comparison::None;
        self.tools.look = Default::default();
        (self.textures[1], self.shots[1]) = (None, None);
    }

    /// The other picture's value at a pixel of the first one's size.
    pub fn other_value(&self, x: u32, y: u32, [width, height]: [u32; 2]) -> Option<[f32; 3]> {
        let image = match &self.comparison {
            Comparison::None => return None,
            Comparison::Settings { .. } => &self.shots[1].as_ref()?.linear,
            Comparison::Stored { image, .. } => image,
        };
        let at = |v: u32, of: u32, size: u32| ((v * size) / of.max(1)).min(size - 1);
        Some(image.rgb(at(x, width, image.width()), at(y, height, image.height())))
    }
}
