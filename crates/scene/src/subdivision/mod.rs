//! Subdivision surfaces and displacement, cut into triangles while a scene is loaded.
//!
//! A [`Cage`] is a mesh of polygons as it was modelled. [`tessellate`] makes triangles of the smooth surface that it
//! stands for: the limit of Catmull-Clark's subdivision (Catmull and Clark 1978) or Loop's (Loop 1987), with creases
//! that may be semi-sharp (DeRose, Kass, Truong, "Subdivision Surfaces in Character Animation", 1998). Vertices lie on the
//! limit itself and have its normals, by closed forms (Halstead, Kass, DeRose, "Efficient, Fair Interpolation using
//! Catmull-Clark Surfaces", 1993). A displacement moves them along the normal or by vectors.
//!
//! Faces are split level by level, where one of their edges is too long ([`Rate`]). Whether an edge is split is a
//! property of the edge, and every point of the surface is made once, so faces of different levels meet without cracks.
//! A level is derived from the one before by arithmetic on half edges, without a search (`split.rs`), and holds only
//! what is split further and the faces around that (`surface.rs`).

mod cage;
mod displacement;
mod level;
mod masks;
mod normals;
mod output;
mod pending;
mod rate;
mod rings;
mod split;
mod surface;

pub use cage::{Cage, CageReport};
pub use displacement::{Displacement, DisplacementSpace};
pub(crate) use pending::RefineError;
pub use pending::{Refinement, Subdivided};
pub use rate::{PixelScale, Rate};
pub use surface::{Tessellation, TessellationError, tessellate};

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
