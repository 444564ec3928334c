//! What sensors would measure in a scene, on top of ray queries.
//!
//! - [`Lidar`]: a spinning laser scanner, to [`PointCloud`]s.
//! - [`GroundTruth`]: depth, normals, motion and ids, exact at the centres of a camera's pixels.
//! - [`object_box`]: three-dimensional boxes around instances.
//! - [`dataset`]: pictures with all that from a list of poses, described as COCO does.
//!
//! Units are metres and radians; the world has +Y up.

#![forbid(unsafe_code)]

mod boxes;
mod camera;
mod categories;
mod cloud;
pub mod dataset;
mod error;
mod lidar;
mod npz;
mod returns;

pub use alhazen::picture_point;
pub use boxes::{ObjectBox, object_box};
pub use camera::{GroundTruth, Motion};
pub use categories::Categories;
pub use cloud::PointCloud;
pub use error::SensorError;
pub use lidar::{Lidar, level_pose};
pub use returns::ReturnMode;
