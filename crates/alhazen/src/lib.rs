//! Alhazen, a physically based ray tracer: the library that all front ends use.
//!
//! Load a scene ([`Source::load`]), describe a picture ([`Job`]), render it ([`Renderer`]), write it
//! ([`output::write`]). Long work can be watched and cancelled through a [`Control`].
//!
//! ```
//! use alhazen::{Control, Job, Limits, LoadOptions, Renderer, Source};
//!
//! let loaded = Source::parse("cornell").load(&LoadOptions::default())?;
//! let mut renderer = Renderer::cpu(None)?;
//! renderer.load(&loaded.scene)?;
//! let job = Job { width: 32, height: 32, ..Job::for_scene(&loaded.scene) };
//! let limits = Limits { spp: 4, ..Limits::default() };
//! let summary = renderer.render(&job, &limits, &Control::new())?;
//! assert_eq!(summary.spp, 4);
//! let picture = renderer.film()?.expect("rendered").to_image();
//! assert_eq!((picture.width(), picture.height()), (32, 32));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the standard library"))]
#![forbid(unsafe_code)]

mod adaptive;
mod causes;
mod caustics;
mod checkpoint;
mod choice;
mod colour;
mod daylight;
mod denoise;
mod exr_camera;
mod fallback;
mod finished;
mod framing;
mod job;
mod memory;
mod memory_limit;
mod metadata;
pub mod navigation;
pub mod output;
mod part;
mod path_lines;
mod projection;
mod renderer;
mod sandbox;
mod sequence;
mod several_devices;
mod shutter;
mod source;
pub mod system;
mod tev;
mod together;

pub use accel::{Coherence, HugePages, Ray};
pub use adaptive::{Adaptive, Sampling};
pub use backend::{
    AllocationSettings, FrameSamples, FrameView, HistorySettings, RealtimeSettings, SpatialFilter,
    UnknownFrameView, UnknownSpatialFilter,
};
pub use backend::{
    AmbientOcclusion, Backend, BackendError, Control, DirectSettings, Highlights, HybridSettings,
    INVERSE_SQUARE, Integrator, LoadStats, Mis, PassTime, PathSettings, PixelSamples, Progress, SamplerKind,
    Stats as PassStats, Switch, View, ViewBatch, ViewLayer, ViewPictures, ViewShutter, ViewValues,
    Visibility,
};
pub use checkpoint::Checkpoint;
pub use choice::{BackendChoice, ChoiceError, Chosen, RendererOptions, UnknownBackend};
pub use colour::{hex_color, luminance, srgb_encode};
pub use cpu::{
    BeamEcho, FoundLight, Hits, LightSampleRecord, LightVisibility, PathEnd, PathRecord, RayError,
    RayQueries, Rays, SampleRecord, ScatteringRecord, SurfacePoint, SurfaceRecord, VertexPlace, VertexRecord,
};
pub use daylight::add_daylight_if_dark;
pub use denoise::{DenoiseFilmError, Denoised, Denoiser};
pub use fallback::{Fallback, Step};
pub use film::{
    Aov, AovData, AovKind, Block, CRYPTOMATTE_RANKS, Coverage, ExrChannel, ExrCompression, ExrFile,
    ExrSamples, Film, Image, ImageError, Merger, Part, PartError, PixelStats, Precision, ProtectedFiles,
    Rect, prove_writable, write_atomically,
};
pub use finished::{FinishedError, FinishedPicture, Guides, LayerNames, write_image};
pub use job::{Job, NoCamera, camera_frame, check_default_camera, picture_ray};
pub use memory::{available_memory_bytes, memory_bytes, open_files, peak_memory_bytes, total_memory_bytes};
pub use memory_limit::MemoryLimit;
pub use metadata::{Description, metadata};
pub use part::{PartJob, RenderPartError, Tile, UnknownTile, finish, tone_of};
pub use path_lines::{PathLine, PathLineKind, path_lines};
pub use post::{DenoiseError, Frame, FrameError, History, NoisyPicture, OidnError, Surface, ToneMapping};
pub use projection::{depth_along_axis, picture_point};
pub use renderer::{AfterPass, BACKENDS, Limits, Renderer, Summary};
/// A picture that a scene uses: a texture's or the environment's.
pub use scene::Image as SceneImage;
/// A piece of a mesh that has one material.
pub use scene::Part as MeshPart;
/// Text of a file as messages show it: without characters that steer terminals.
pub use scene::report::plain;
pub use scene::{
    AlphaMode, Animation, CalibrationError, Camera, CameraKey, CameraPath, Checkerboard, Clip, ColorSpace,
    Daylight, DensityGrid, Distortion, Environment, EnvironmentPreset, Fog, GivenFiles, Group, GroupId,
    Groups, Instance, InstanceId, Interior, LAYER_NUMBERS, LayerNumber, Layers, Light, LightKind,
    LightParameter, LightProfile, LoadError, LoadOptions, LoadReport, Loaded, Material, MaterialId, Medium,
    Mesh, Model, Motion, Note, Photometry, Pixels, Portal, PortalError, Projection, ProjectionParameter,
    Quantity, RenderDefaults, Rolling, Scene, Severity, Shape, Shutter, ShutterError, ShutterShape, Sky,
    Sphere, Subsurface, Sun, SunError, SunPosition, Texture, TextureGraph, TextureRef, TextureSlot,
    ToneMapper, TriangleMesh,
};
pub use sequence::{FrameFilm, Moment as FrameMoment, SequenceDenoiser, frame_seed};
pub use source::{Place, Source};
pub use tev::{Tev, TevAddress, TevChannel, TevError, UnknownTevAddress};
pub use together::Together;

/// Error metrics between pictures.
pub use film::metrics;
/// The GPU back ends.
pub use gpu;
pub use gpu::PathKernel;
/// A moment of a scene that moves, and when frames are.
pub use scene::animation::{Keyed, KeyedError, KeyedObject, Moment, frame_time};
/// The built-in scenes.
pub use scene::builtin;
/// The files that loading has read.
pub use scene::load::FilesRead;
/// Changes of a scene as values, and scene files that are made of them.
pub mod edits {
    pub use scene::edits::file::{EditedFile, WriteError};
    pub use scene::edits::*;
    pub use scene::load::scene_file::{Edited, open_edited};
}
/// Loads an equirectangular environment picture.
pub use scene::load::environment::load as load_environment;
/// Scenes in one file, with all that they refer to.
pub use scene::load::packed;
/// Loads a picture as materials have it.
pub use scene::load::textures::load_picture;
/// Subdivision surfaces and displacement.
pub use scene::subdivision;
/// The flat arrays that back ends read.
pub use scene::tables::SceneTables;
/// Textures that are computed.
pub use scene::texture_graph;
