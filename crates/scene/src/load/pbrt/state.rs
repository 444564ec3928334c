//! What attribute blocks save and restore.

use glam::{DAffine3, Vec3};

/// The state that shapes, lights and materials take their surroundings from.
#[derive(Clone, Debug, Default)]
pub(super) struct State {
    /// From where things are defined to pbrt's world, or to the object that is being defined.
    pub transform: DAffine3,
    /// The same at the end of the motion ([`Builder`](super::Builder) knows when that is).
    pub end: DAffine3,
    /// Which of the two transforms directives change.
    pub active: Active,
    /// Normals point to the other side.
    pub reversed: bool,
    /// Index into the scene's materials; `None` is the default one.
    pub material: Option<u32>,
    /// Shapes shine.
    pub area_light: Option<AreaLight>,
}

/// Which transforms directives change.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Active {
    /// Both.
    #[default]
    All,
    /// That of the beginning.
    Start,
    /// That of the end.
    End,
}

impl State {
    /// Changes the transforms that are active.
    pub fn change(&mut self, by: impl Fn(usize, &mut DAffine3)) {
        if self.active != Active::End {
            by(0, &mut self.transform);
        }
        if self.active != Active::Start {
            by(1, &mut self.end);
        }
    }

    /// Whether what is described moves.
    pub fn moves(&self) -> bool {
        self.transform != self.end
    }
}

/// What makes shapes shine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct AreaLight {
    /// Radiance, linear.
    pub emission: Vec3,
    pub two_sided: bool,
}
