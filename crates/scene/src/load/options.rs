//! How a file is loaded.

use super::given::GivenFiles;
use super::session::Session;
use crate::scene::Scene;
use crate::settings::ShadowTerminator;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

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
    /// Files in memory, which come before those on disk.
    pub given_files: GivenFiles,
    /// Height of the picture, pixels, for surfaces that are subdivided until edges are short there; `None`: what the scene
    /// says, else 720.
    pub picture_height: Option<u32>,
    /// Keep the polygons of OBJ files in [`crate::Scene::refinements`]: for scene files, which say how they are subdivided.
    pub keep_polygons: bool,
    /// Every file that was read, to be kept from being overwritten. Clones share the list.
    pub files_read: FilesRead,
    /// Files that the scene asked for and that are there, but elsewhere than it may read: for whoever can be asked whether it
    /// may. Clones share the list.
    pub files_refused: FilesRead,
    /// The state of a call that is going on; [`Session::default`] before.
    pub session: Session,
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
            given_files: GivenFiles::default(),
            files_read: FilesRead::default(),
            files_refused: FilesRead::default(),
            allowed_paths: Vec::new(),
            max_memory: u64::MAX,
            max_load_time: None,
            untrusted: false,
            cull_backs: false,
            exact_terminator: false,
            picture_height: None,
            keep_polygons: false,
            session: Session::default(),
        }
    }
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

/// Files that loading has read, or was refused, shared by all who load with the same options.
#[derive(Clone, Debug, Default)]
pub struct FilesRead(Arc<Mutex<BTreeSet<PathBuf>>>);

impl FilesRead {
    /// The files, in order.
    pub fn list(&self) -> Vec<PathBuf> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).iter().cloned().collect()
    }

    pub(super) fn add(&self, path: &Path) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).insert(path.to_owned());
    }
}
