//! Image tools: which are on, what they have found, and the pictures that were kept.

use crate::analysis::{Difference, Findings, Wanted};
use crate::exr_layers::{ExrLayers, LayerChoice};
use crate::queries::Question;
use crate::render_settings::RenderSettings;
use alhazen::{Camera, Image};
use egui::{ColorImage, Context, TextureHandle, TextureOptions};
use std::sync::Arc;

/// How a picture and the one that it is compared with are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Look {
    /// A to the left of a line, B to the right.
    #[default]
    Split,
    /// A alone.
    A,
    /// B alone.
    B,
    /// How far A is from B.
    Difference,
}

impl Look {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Split, Self::A, Self::B, Self::Difference];

    /// What the user calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Split => "split",
            Self::A => "A",
            Self::B => "B",
            Self::Difference => "difference",
        }
    }
}

/// What findings are of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Asked {
    pub(super) shots: u64,
    pub(super) exposure: f32,
    pub(super) wanted: Wanted,
    pub(super) reference: Option<usize>,
}

/// A picture that was kept.
#[derive(Clone)]
pub struct Snapshot {
    /// What the user calls it.
    pub name: String,
    /// Its linear values, or what a file of eight bits stands for.
    pub image: Arc<Image>,
    /// Whether its values are display values already.
    pub encoded: bool,
    /// Layers of the EXR file that it is from, and which of them it is.
    pub layers: Option<(Arc<ExrLayers>, LayerChoice)>,
    /// How it was made: sizes, samples, options.
    pub about: String,
    /// The camera and the settings that it was rendered with; files have none.
    pub made_by: Option<(Camera, RenderSettings)>,
    /// It in small, with the exposure and the curve of when it was kept.
    pub small: Arc<ColorImage>,
    /// The same as a texture, once it was shown.
    pub thumbnail: Option<TextureHandle>,
}

impl Snapshot {
    /// Its small picture.
    pub fn thumbnail(&mut self, ctx: &Context) -> &TextureHandle {
        let (small, name) = (&self.small, &self.name);
        let load = || ctx.load_texture(format!("kept {name}"), small.clone(), TextureOptions::LINEAR);
        self.thumbnail.get_or_insert_with(load)
    }
}

/// Image tools: which are on, and what they have found.
#[derive(Default)]
pub struct Tools {
    /// Zebra stripes over what is clipped.
    pub zebra: bool,
    /// How two pictures are shown.
    pub look: Look,
    /// What is shown of their difference.
    pub difference: Difference,
    /// Pictures that were kept, the oldest first.
    pub snapshots: Vec<Snapshot>,
    /// What was last found.
    pub findings: Option<Findings>,
    /// The waveform as it is drawn.
    pub waveform: Option<TextureHandle>,
    pub(super) stripes: Option<TextureHandle>,
    pub(super) error_map: Option<TextureHandle>,
    pub(super) asked: Option<Asked>,
    /// Whether the answer is still to come.
    pub(super) waits: bool,
    /// Not before this time, seconds.
    pub(super) not_before: f64,
    pub(super) number: u64,
    /// How the picture's texture was sampled when it was made.
    pub(super) has_edges: bool,
}

/// The grid on the ground as it was last drawn.
#[derive(Default)]
pub(super) struct Ground {
    pub(super) asked: Option<Question>,
    pub(super) texture: Option<TextureHandle>,
}
