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
mod description;
mod displacement;
mod level;
mod masks;
mod normals;
mod output;
mod pending;
mod rate;
pub(crate) mod refinement;
mod rings;
mod split;
mod surface;

pub use cage::{Cage, CageReport};
pub use description::{Displacement, DisplacementSpace, Scheme};
pub(crate) use pending::RefineError;
pub use pending::Subdivided;
pub use rate::{PixelScale, Rate};
pub use refinement::Refinement;
pub use surface::{Tessellation, TessellationError, tessellate};
