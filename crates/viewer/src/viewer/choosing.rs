//! What is being chosen: how a selection changes, a rectangle that is dragged, a material that was copied.

use alhazen::MaterialId;
use egui::Pos2;

/// How a selection follows from what there was and what was found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Choosing {
    /// What was found, and nothing else.
    #[default]
    Only,
    /// What was found as well.
    More,
    /// No more what was found.
    Less,
}

/// What a rectangle is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RectangleUse {
    /// What is seen in it is selected.
    Select,
    /// Nothing else is rendered.
    Crop,
}

/// The state of the rectangle.
#[derive(Clone, Debug, Default)]
pub struct Rectangle {
    /// What the next drag of the picture is for; `None` has it turn the camera.
    pub awaits: Option<RectangleUse>,
    /// The drag that goes on, and where in the window it began and is.
    pub(super) drag: Option<(RectangleUse, Pos2, Pos2)>,
    /// How what was asked for last changes the selection.
    pub(super) choosing: Choosing,
}

impl Rectangle {
    /// Whether Escape has something to give up.
    pub(super) fn is_active(&self) -> bool {
        self.awaits.is_some() || self.drag.is_some()
    }
}

/// A material that was copied.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CopiedMaterial {
    /// Its number.
    pub id: MaterialId,
    /// The scene that it is of; see `Viewer::generation`.
    pub generation: u64,
}
