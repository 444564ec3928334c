//! Which panels are open, and what was chosen in them.

use crate::outliner::Outliner;
use crate::presets::Preset;
use crate::viewer::Command;

/// A page of the panel on the right.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs, reason = "each has a file of its own")]
pub enum Tab {
    #[default]
    Render,
    Objects,
    Lights,
    Sky,
    Camera,
    Speed,
    Image,
    File,
}

impl Tab {
    /// All of them, in their order.
    pub const ALL: [Self; 8] = [
        Self::Render,
        Self::Objects,
        Self::Lights,
        Self::Sky,
        Self::Camera,
        Self::Speed,
        Self::Image,
        Self::File,
    ];

    /// What the user calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Render => "Render",
            Self::Objects => "Objects",
            Self::Lights => "Lights",
            Self::Sky => "Sky",
            Self::Camera => "Camera",
            Self::Speed => "Speed",
            Self::Image => "Image",
            Self::File => "File",
        }
    }
}

/// Which panels and windows are open.
#[derive(Clone, Debug, Default)]
pub struct Open {
    /// The panel on the right.
    pub side: bool,
    /// Its page.
    pub tab: Tab,
    /// What lies over the picture.
    pub overlay: Option<Overlay>,
    /// The list of all commands.
    pub palette: PaletteChoice,
    /// The setting that was found in the palette, until its page has shown it.
    pub sought: Option<Sought>,
    /// The tree of objects.
    pub outliner: Outliner,
    /// How sequences are recorded.
    pub record: RecordChoice,
    /// How pictures are rendered into files.
    pub output: OutputChoice,
    /// Radius of a scene's automatic orbit is the camera's distance; this is how far it rises, metres.
    pub orbit_bob: f32,
}

/// A window over the picture that a command opens and Escape closes. There is one at a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overlay {
    /// The list of all commands and settings.
    Palette,
    /// Mouse and keys.
    Help,
}

/// What was typed and marked in the list of all commands.
#[derive(Clone, Debug, Default)]
pub struct PaletteChoice {
    /// What was typed.
    pub text: String,
    /// Which of the entries found is marked, from 0.
    pub marked: usize,
}

/// A setting that is shown to the user.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sought {
    /// Its label.
    pub label: &'static str,
    /// When that began, seconds.
    pub since: f64,
    /// Whether it was on the page.
    pub found: bool,
}

impl Open {
    /// Closes what lies over the picture. Returns whether anything did.
    pub fn close_overlays(&mut self) -> bool {
        self.overlay.take().is_some()
    }

    /// Opens a window over the picture instead of the one that is open, or closes it if it is that.
    pub fn toggle(&mut self, overlay: Overlay) {
        let other = (self.overlay != Some(overlay)).then_some(overlay);
        (self.overlay, self.palette) = (other, PaletteChoice::default());
    }
}

/// How pictures are rendered into files.
#[derive(Clone, Debug, PartialEq)]
pub struct OutputChoice {
    /// Width and height, pixels; `None` is what is shown.
    pub size: Option<[u32; 2]>,
    /// The quality; `None` is that of the page.
    pub quality: Option<Preset>,
}

impl Default for OutputChoice {
    fn default() -> Self {
        Self { size: None, quality: Some(Preset::Final) }
    }
}

/// How sequences are recorded.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordChoice {
    /// Which of the recording commands.
    pub way: Command,
    /// Number of pictures.
    pub frames: usize,
    /// Pictures a second, where time counts.
    pub fps: f32,
    /// Samples per pixel.
    pub spp: u32,
}

impl Default for RecordChoice {
    fn default() -> Self {
        Self { way: Command::RecordTurntable, frames: 96, fps: 24.0, spp: 64 }
    }
}
