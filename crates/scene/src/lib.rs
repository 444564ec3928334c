//! What the user described: meshes, instances, materials, textures, lights, cameras, environment.
//!
//! [`Scene`] is the description with names, as a file gave it. [`tables::SceneTables`] is the same scene as flat
//! arrays with `u32` indices: the only thing that back ends read. Loaders live in [`load`]; each returns a [`Scene`]
//! and a [`LoadReport`] that names everything which was ignored, repaired or approximated.
//!
//! Units are metres and radians, right-handed, +Y up; colours are linear with Rec. 709 primaries.

#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the standard library"))]
#![forbid(unsafe_code)]

pub mod animation;
pub mod builtin;
pub mod calibration;
pub mod camera;
pub mod daylight;
pub mod edits;
pub mod environment;
mod environment_preset;
pub mod framing;
mod groups;
mod ids;
pub mod image;
pub mod layers;
pub mod light;
pub mod load;
pub mod material;
pub mod medium;
pub mod merge;
pub mod mesh;
pub mod normals;
mod origin;
pub mod photometry;
pub mod portal;
mod projection;
pub mod report;
mod scene;
pub mod settings;
pub mod shapes;
pub mod shutter;
pub mod subdivision;
pub mod subsurface;
pub mod tables;
pub mod tangents;
mod texture;
pub mod texture_graph;
mod texture_slot;
pub mod triangulate;

pub use animation::{Animation, Clip};
pub use calibration::CalibrationError;
pub use camera::{Camera, CameraKey, CameraPath, Distortion};
pub use daylight::{Daylight, SunError, SunPosition};
pub use environment::{Environment, Sky, Sun};
pub use environment_preset::EnvironmentPreset;
pub use framing::{FilmWindow, Motion};
pub use groups::{Group, GroupId, Groups};
pub use ids::{ImageId, InstanceId, MaterialId, MeshId, TextureId};
pub use image::{ColorSpace, Filter, Image, ImageTexture, Pixels, Sampler, TextureRef, UvTransform, Wrap};
pub use layers::{
    Anisotropy, Clearcoat, DiffuseTransmission, Iridescence, LAYER_NUMBERS, LayerNumber, Layers, Sheen,
};
pub use light::{Light, LightKind, LightParameter};
pub use load::{GivenFiles, LoadError, LoadOptions, Loaded};
pub use material::{AlphaMode, Checkerboard, Interior, Material, Model};
pub use medium::{DensityGrid, Fog, Medium};
pub use mesh::{Instance, Mesh, Part, Shape, Sphere, TriangleMesh};
pub use photometry::{LightProfile, Photometry};
pub use portal::{Portal, PortalError};
pub use projection::{Projection, ProjectionParameter, Quantity};
pub use report::{LoadReport, Note, Severity};
pub use scene::Scene;
pub use settings::{RenderDefaults, ShadowTerminator, Switch, ToneMapper};
pub use shutter::{Lines, Rolling, Shutter, ShutterError, ShutterShape};
pub use subsurface::Subsurface;
pub use texture::Texture;
pub use texture_graph::{GraphInput, TextureGraph, TextureGraphNode};
pub use texture_slot::TextureSlot;
