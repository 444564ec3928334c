//! The structures: a [`Blas`] holds the primitives of one object, a [`Tlas`] holds instances of
//! objects. This floor is data only; [`crate::query`] traverses it.

mod blas;
mod instance;
mod motion;
mod planar_polygon;
mod primitives;
mod root_triangles;
mod tight_bounds;
mod tlas;
mod validate;

pub use blas::Blas;
pub(crate) use blas::LeafBlocks;
pub use instance::Instance;
pub(crate) use instance::inverse;
pub use motion::InstanceMotions;
pub(crate) use motion::motion_bounds;
pub(crate) use planar_polygon::{MAX_TOLERANCE, PlanarPolygon, PolygonTriangle};
pub use primitives::{Geometry, Sphere};
pub(crate) use primitives::{sphere_references, triangle_references};
pub(crate) use root_triangles::{ALL_CHILDREN, RootTriangles};
pub(crate) use tight_bounds::TightBounds;
pub use tlas::Tlas;
