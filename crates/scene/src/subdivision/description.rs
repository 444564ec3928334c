//! What users say of a surface: how faces are split, and how it is displaced.

use crate::TextureRef;
use serde::{Deserialize, Serialize};

/// How faces are split.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scheme {
    /// Catmull and Clark's: faces of any number of corners, smooth.
    #[default]
    CatmullClark,
    /// Loop's: triangles, smooth. Other faces are cut into triangles first.
    Loop,
    /// Faces of any number of corners are split where they are: for displacement alone.
    Linear,
}

impl Scheme {
    /// All of them, with their names in files.
    pub const ALL: [(Self, &'static str); 3] =
        [(Self::CatmullClark, "catmull-clark"), (Self::Loop, "loop"), (Self::Linear, "linear")];

    /// The scheme of a name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|(_, known)| *known == name).map(|(scheme, _)| *scheme)
    }
}

/// What the value of a displacement means.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DisplacementSpace {
    /// The red channel is a height along the normal.
    #[default]
    Normal,
    /// RGB is a vector: along the direction in which u grows, across it, along the normal.
    Tangent,
    /// RGB is a vector in the space of the object.
    Object,
}

impl DisplacementSpace {
    /// All of them, with their names in files.
    pub const ALL: [(Self, &'static str); 3] =
        [(Self::Normal, "normal"), (Self::Tangent, "tangent"), (Self::Object, "object")];

    /// The space of a name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|(_, known)| *known == name).map(|(space, _)| *space)
    }
}

/// A displacement.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Displacement {
    /// What its value is; bytes of images are linear numbers from 0 to 1 if the texture says so.
    pub texture: TextureRef,
    /// Factor on the value less `midlevel`, units of the object.
    pub scale: f32,
    /// The value that displaces nothing.
    pub midlevel: f32,
    /// What the value means.
    pub space: DisplacementSpace,
}
