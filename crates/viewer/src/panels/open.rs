//! Which panels are open, and what was chosen in them.

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
    Pixel,
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
        Self::Pixel,
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
            Self::Pixel => "Pixel",
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
    /// The list of all commands.
    pub palette: bool,
    /// What is typed there.
    pub palette_text: String,
    /// Mouse and keys.
    pub help: bool,
    /// What is typed to find objects.
    pub object_filter: String,
    /// How sequences are recorded.
    pub record: RecordChoice,
    /// Radius of a scene's automatic orbit is the camera's distance; this is how far it rises, metres.
    pub orbit_bob: f32,
}

impl Open {
    /// Closes what lies over the picture. Returns whether anything did.
    pub fn close_overlays(&mut self) -> bool {
        let was_open = self.palette || self.help;
        (self.palette, self.help) = (false, false);
        was_open
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
