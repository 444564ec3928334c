//! Loaders: one file a format, chosen by the file name's ending.

mod cube_map;
pub mod environment;
mod error;
mod given;
pub mod gltf;
pub mod ies;
mod loaded;
pub mod meshopt;
pub mod obj;
mod options;
pub mod packed;
pub mod pbrt;
pub mod ply;
pub mod scene_file;
pub mod session;
pub mod stl;
mod text;
pub mod textures;
pub mod vol;
mod wording;

pub use error::LoadError;
pub use given::GivenFiles;
pub use loaded::Loaded;
pub use options::{FilesRead, LoadOptions};

use crate::report::Severity;
use std::path::Path;
use web_time::Instant;

/// Loads a scene from a file, by its name's ending.
///
/// Files that it refers to are read if they are below its folder or below [`LoadOptions::allowed_paths`].
///
/// # Errors
/// See [`LoadError`]; each names the file and the object.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded, LoadError> {
    let start = Instant::now();
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    let mut loaded = match extension.as_str() {
        "obj" => obj::load(path, options),
        "gltf" | "glb" => gltf::load(path, options),
        "pbrt" => pbrt::load(path, options),
        "ply" => ply::load(path, options),
        "stl" => stl::load(path, options),
        "toml" => scene_file::load(path, options),
        packed::ENDING => packed::load(path, options),
        _ => Err(LoadError::UnknownFormat { path: path.to_owned() }),
    }?;
    let is_empty = loaded.scene.instances.is_empty() && loaded.scene.lights.is_empty();
    if is_empty && !loaded.report.notes.iter().any(|note| note.severity == Severity::Ignored) {
        loaded.report.ignored("there is nothing in the file that can be drawn");
    }
    if loaded.scene.name.is_empty() {
        loaded.scene.name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    }
    options.choose_surface_rules(&mut loaded.scene);
    loaded.report.elapsed = start.elapsed();
    Ok(loaded)
}
