//! Loaders: one file a format, chosen by the file name's ending.

mod cube_map;
pub mod environment;
pub mod gltf;
pub mod ies;
pub mod meshopt;
pub mod obj;
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

use crate::report::{Severity, plain, without_quotes};
use crate::{LoadReport, Scene, ShadowTerminator};
use session::Session;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// How a file is loaded.
#[derive(Clone, Debug)]
pub struct LoadOptions {
    /// Go on after problems that would otherwise be errors, such as unknown required glTF extensions; they are
    /// reported instead.
    pub lenient: bool,
    /// Where normals are missing, edges whose faces meet at more than this angle (radians) stay sharp.
    pub crease_angle: f32,
    /// Keep normals that oppose the winding of most faces of a mesh, instead of turning them round.
    pub keep_normals: bool,
    /// Textures larger than this (pixels along the longer side) are halved until they fit; reported.
    pub max_texture_size: u32,
    /// Files larger than this are refused, in bytes.
    pub max_file_size: u64,
    /// Which of a glTF file's material variants is shown; `None`: the default materials. Other formats have none.
    pub variant: Option<String>,
    /// Folders that the scene may read beside the one of the file that the user named, each with all below it. Files
    /// elsewhere are taken as missing.
    pub allowed_paths: Vec<PathBuf>,
    /// What the scene may take until it is rendered, in bytes: files, images, geometry, tables, acceleration structures.
    pub max_memory: u64,
    /// Loading that takes longer fails; `None`: it may take as long as it likes.
    pub max_load_time: Option<Duration>,
    /// The scene may be made to do harm: front ends load it in a sandbox where the system has one.
    pub untrusted: bool,
    /// Whether backs are culled whatever the scene says; see [`crate::RenderDefaults::cull_backs`].
    pub cull_backs: bool,
    /// Whether light is gathered on the triangles of smooth meshes whatever the scene says; see
    /// [`crate::RenderDefaults::shadow_terminator`].
    pub exact_terminator: bool,
    /// Every file that was read, to be kept from being overwritten. Clones share the list.
    pub files_read: FilesRead,
    /// Files that the scene asked for and that are there, but elsewhere than it may read: for whoever can be asked whether it
    /// may. Clones share the list.
    pub files_refused: FilesRead,
    /// The state of a call that is going on; [`Session::default`] before.
    pub session: Session,
}

/// Files that loading has read, or was refused, shared by all who load with the same options.
#[derive(Clone, Debug, Default)]
pub struct FilesRead(Arc<Mutex<BTreeSet<PathBuf>>>);

impl FilesRead {
    /// The files, in order.
    pub fn list(&self) -> Vec<PathBuf> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).iter().cloned().collect()
    }

    fn add(&self, path: &Path) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).insert(path.to_owned());
    }
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self {
            lenient: false,
            crease_angle: 40f32.to_radians(),
            keep_normals: false,
            max_texture_size: 8192,
            max_file_size: 8 << 30,
            variant: None,
            files_read: FilesRead::default(),
            files_refused: FilesRead::default(),
            allowed_paths: Vec::new(),
            max_memory: u64::MAX,
            max_load_time: None,
            untrusted: false,
            cull_backs: false,
            exact_terminator: false,
            session: Session::default(),
        }
    }
}

/// A scene and what was noticed while loading it.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The scene.
    pub scene: Scene,
    /// What was ignored, repaired or approximated.
    pub report: LoadReport,
}

/// Why a scene could not be loaded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LoadError {
    /// The file could not be opened or read.
    #[error("cannot read {}", shown(path))]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// No loader knows the file name's ending.
    #[error(
        "{}: unknown file type; known are .obj, .gltf, .glb, .pbrt, .ply, .stl, .alhazen and .toml scene files",
        shown(path)
    )]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// The file is larger than [`LoadOptions::max_file_size`] or asks for more memory than it can fill.
    #[error("{}: {what} is too large ({size} against a limit of {limit})", shown(path))]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// What is too large.
        what: String,
        /// Its size.
        size: u64,
        /// The limit.
        limit: u64,
    },
    /// The scene takes more memory than [`LoadOptions::max_memory`].
    #[error(
        "{}: with its {what} the scene takes {size} bytes of memory; {limit} are allowed (`--max-memory`)",
        shown(path)
    )]
    OverBudget {
        /// The scene's file.
        path: PathBuf,
        /// What went over the limit, a word in the plural.
        what: String,
        /// What the scene takes with it, in bytes.
        size: u64,
        /// The limit, in bytes.
        limit: u64,
    },
    /// The system has no memory left.
    #[error("{}: there is no memory for {what} of {size} bytes", shown(path))]
    OutOfMemory {
        /// The scene's file.
        path: PathBuf,
        /// What could not be allocated.
        what: String,
        /// Its size in bytes.
        size: u64,
    },
    /// Loading takes longer than [`LoadOptions::max_load_time`].
    #[error("{}: loading takes longer than {limit:?} (`--max-load-time`)", shown(path))]
    TookTooLong {
        /// The scene's file.
        path: PathBuf,
        /// The limit.
        limit: Duration,
    },
    /// The file does not follow its format.
    #[error("{}: {}: {}", shown(path), plain(object), plain(message))]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Where in the file: a line, an object, an accessor.
        object: String,
        /// What is wrong, with the offending value.
        message: String,
    },
    /// The file follows its format, but does not say where the data of something are.
    #[error("{}: {}: the file does not say where its data are", shown(path), plain(object))]
    NoData {
        /// The file.
        path: PathBuf,
        /// What has no data.
        object: String,
    },
    /// There is no built-in scene of this name.
    #[error("there is no built-in scene `{}`; known are {known}", plain(name))]
    UnknownScene {
        /// The name.
        name: String,
        /// The names that there are, separated by commas.
        known: String,
    },
    /// The file has no material variant of the name that was asked for.
    #[error(
        "{}: there is no material variant `{}`; there are: {}",
        shown(path),
        plain(variant),
        plain(known)
    )]
    UnknownVariant {
        /// The file.
        path: PathBuf,
        /// The name.
        variant: String,
        /// The names that there are, separated by commas.
        known: String,
    },
    /// The file requires an extension that is not known.
    #[error(
        "{}: requires the unknown extension {} (try --lenient to render without it)",
        shown(path),
        plain(extension)
    )]
    UnknownExtension {
        /// The file.
        path: PathBuf,
        /// Its name.
        extension: String,
    },
    /// The file's data needs an extension that is known but not supported, such as a compression.
    #[error("{}: {} needs the extension {extension}, which is not supported yet", shown(path), plain(object))]
    UnsupportedExtension {
        /// The file.
        path: PathBuf,
        /// What cannot be read without it.
        object: String,
        /// Its name.
        extension: String,
    },
}

impl LoadError {
    /// A [`LoadError::Malformed`].
    pub fn malformed(path: &Path, object: impl Into<String>, message: impl Into<String>) -> Self {
        let message = wording::without_types(&message.into()).into_owned();
        Self::Malformed { path: path.to_owned(), object: object.into(), message }
    }
}

/// A path as messages show it.
fn shown(path: &Path) -> String {
    plain(&path.to_string_lossy()).into_owned()
}

impl LoadError {
    /// The error without what it quotes of a file that the user did not name: whoever wrote the scene chose that file.
    fn discreet(self, is_named: impl Fn(&Path) -> bool) -> Self {
        match self {
            Self::Malformed { path, object, message } if !is_named(&path) => {
                let (object, message) = (without_quotes(&object), without_quotes(&message));
                Self::Malformed { path, object, message }
            }
            other => other,
        }
    }
}

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

impl LoadOptions {
    /// Lets the choices about surfaces win over what the scene says itself.
    pub(crate) fn choose_surface_rules(&self, scene: &mut Scene) {
        if self.cull_backs {
            scene.defaults.cull_backs = Some(true);
        }
        if self.exact_terminator {
            scene.defaults.shadow_terminator = Some(ShadowTerminator::Exact);
        }
    }
}

/// The content of a file, if the scene may read it.
///
/// # Errors
/// [`LoadError::Read`], [`LoadError::TooLarge`], [`LoadError::OverBudget`].
pub(crate) fn read_file(path: &Path, options: &LoadOptions) -> Result<Vec<u8>, LoadError> {
    options.read(path)
}
