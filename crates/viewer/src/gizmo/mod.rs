//! The gizmo: handles over the picture that move, turn and scale what is selected.
//!
//! `lens` says where the world is in the window, `handle` which handles there are, `motion` what a drag of one means,
//! [`markers`] how lights and cameras are seen,
//! [`compass`] where the world's axes point, [`grid`] what the ground's grid looks like. Nothing here changes a scene; [`crate::viewer`] does.

pub mod compass;
pub mod grid;
mod handle;
mod lens;
pub mod markers;
mod motion;
mod typed;

pub use handle::{Frame, Handle, Shape, nearest};
pub use lens::{Lens, Line};
pub use motion::{ANGLE_STEP, Constraint, Drag, Motion, SCALE_STEP};
pub use typed::Typed;

use alhazen::Light;
use glam::Affine3A;

/// What dragging the selection does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tool {
    /// Nothing: there are no handles.
    Select,
    /// Moves it.
    #[default]
    Move,
    /// Turns it about the middle of its bounds.
    Rotate,
    /// Makes it larger and smaller.
    Scale,
}

impl Tool {
    /// All of them, in the order of their keys.
    pub const ALL: [Self; 4] = [Self::Select, Self::Move, Self::Rotate, Self::Scale];

    /// What the user calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Select => "Select",
            Self::Move => "Move",
            Self::Rotate => "Rotate",
            Self::Scale => "Scale",
        }
    }
}

/// What a drag has hold of, as it was when the drag began.
#[derive(Clone, Debug)]
pub struct Held {
    /// What the pointer does.
    pub drag: Drag,
    /// What was typed meanwhile.
    pub typed: Typed,
    /// Objects with their transforms.
    pub objects: Vec<(u32, Affine3A)>,
    /// A light with its number.
    pub light: Option<(usize, Light)>,
}

/// The state of the gizmo.
#[derive(Clone, Debug, Default)]
pub struct Gizmo {
    /// What dragging does.
    pub tool: Tool,
    /// Along the axes of the object instead of those of the world.
    pub local: bool,
    /// The drag of a handle that goes on.
    pub held: Option<Held>,
    /// A sign that is dragged through the sky.
    pub carried: Option<markers::Of>,
    /// How often the scene had been changed when the drag began.
    pub edits_before: u64,
    /// A drag was given up, and its button is still held.
    pub spent: bool,
    /// The handle that the pointer is on.
    pub hovered: Option<Handle>,
    /// The next click says where the light should fall.
    pub aims: bool,
    /// The light that is selected, by number.
    pub light: Option<usize>,
}
