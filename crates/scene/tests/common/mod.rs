//! What the tests of the mesh loaders share.
#![allow(dead_code, reason = "each test binary uses a part of it")]

use glam::Vec3;
use scene::{LoadError, LoadOptions, Loaded, Material, Part, Scene, Shape, TriangleMesh};
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::time::Duration;

/// What loading may cost.
pub struct Limits {
    /// Wall time.
    pub seconds: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Self { seconds: 60 }
    }
}

/// Loads a file in a thread of its own; panics if that takes too long, or if the loader does.
pub fn load_within(path: &Path, limits: Limits) -> Result<Loaded, LoadError> {
    let (sender, receiver) = mpsc::channel();
    let file = path.to_owned();
    let worker = std::thread::spawn(move || {
        let _ = sender.send(scene::load::load(&file, &LoadOptions::default())); // nobody listens after a timeout
    });
    match receiver.recv_timeout(Duration::from_secs(limits.seconds)) {
        Ok(result) => result,
        Err(mpsc::RecvTimeoutError::Timeout) => {
            panic!("{} takes more than {} s", path.display(), limits.seconds)
        }
        Err(mpsc::RecvTimeoutError::Disconnected) => {
            panic!("{}: the loader panicked: {:?}", path.display(), worker.join())
        }
    }
}

/// The files of a folder, and of those inside it, whose names have the ending, sorted.
pub fn files(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display())) {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path, ending));
        } else if path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending)) {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// The triangles of a part.
pub fn mesh(part: &Part) -> &TriangleMesh {
    match &part.shape {
        Shape::Triangles(mesh) => mesh,
        Shape::Spheres(_) => panic!("spheres instead of triangles"),
    }
}

/// Corners of all triangles of all meshes.
pub fn triangles(scene: &Scene) -> Vec<[Vec3; 3]> {
    let meshes = scene.meshes.iter().flat_map(|m| &m.parts).map(mesh);
    meshes.flat_map(|m| m.indices.iter().map(|t| t.map(|i| m.positions[i as usize]))).collect()
}

/// Base colour without alpha.
pub fn rgb(material: &Material) -> Vec3 {
    material.base_color.truncate()
}

/// Asserts what every scene promises: indices in range, attributes complete, finite and of unit length where due.
pub fn check(scene: &Scene) {
    for instance in &scene.instances {
        assert!((instance.mesh as usize) < scene.meshes.len());
    }
    for texture in scene.textures.iter().filter_map(|t| t.as_image()) {
        assert!((texture.image as usize) < scene.images.len());
    }
    for part in scene.meshes.iter().flat_map(|m| &m.parts) {
        assert!((part.material as usize) < scene.materials.len());
        let mesh = mesh(part);
        let count = mesh.positions.len();
        assert!(mesh.indices.iter().flatten().all(|i| (*i as usize) < count));
        for length in
            [mesh.normals.len(), mesh.uv0.len(), mesh.uv1.len(), mesh.colors.len(), mesh.tangents.len()]
        {
            assert!(length == 0 || length == count);
        }
        assert!(mesh.positions.iter().all(|p| p.is_finite()));
        assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-3));
        assert!(mesh.uv0.iter().all(|t| t.is_finite()));
        assert!(mesh.colors.iter().all(|c| c.is_finite() && c.min_element() >= 0.0));
    }
}
