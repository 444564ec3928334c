//! What the glTF tests share: finding the data, loading within a time limit, building small files.

use scene::{LoadError, LoadOptions, Loaded};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// No test file may take longer. Development builds and busy machines get slack.
const LIMIT: Duration = Duration::from_secs(if cfg!(debug_assertions) { 20 } else { 5 });

/// Runs `task` in a thread of its own.
///
/// # Panics
/// If the task panics or takes longer than the limit.
pub fn within_limit<T: Send + 'static>(what: &str, task: impl FnOnce() -> T + Send + 'static) -> T {
    let (sender, receiver) = channel();
    let thread = std::thread::spawn(move || sender.send(task()));
    match receiver.recv_timeout(LIMIT) {
        Ok(result) => result,
        Err(RecvTimeoutError::Timeout) => panic!("{what} takes longer than {LIMIT:?}"),
        Err(RecvTimeoutError::Disconnected) => panic!("{what} panicked: {:?}", thread.join().err()),
    }
}

/// Loads a file within the limit.
pub fn load(path: &Path, lenient: bool) -> Result<Loaded, LoadError> {
    let owned = path.to_owned();
    within_limit(&path.display().to_string(), move || {
        scene::load::load(&owned, &LoadOptions { lenient, ..LoadOptions::default() })
    })
}

/// Every .gltf and .glb below a folder, sorted.
pub fn gltf_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "gltf" || e == "glb") {
                files.push(path);
            }
        }
    }
    files.sort();
    files
}

/// Asserts what every loaded scene promises: indices in range, attribute arrays of equal length, finite numbers.
pub fn assert_sound(what: &str, loaded: &Loaded) {
    let scene = &loaded.scene;
    for instance in &scene.instances {
        assert!((instance.mesh as usize) < scene.meshes.len(), "{what}: mesh of instance {}", instance.name);
        assert!(instance.transform.is_finite(), "{what}: transform of instance {}", instance.name);
    }
    for part in scene.meshes.iter().flat_map(|m| &m.parts) {
        assert!((part.material as usize) < scene.materials.len(), "{what}: material {}", part.material);
        let scene::Shape::Triangles(mesh) = &part.shape else { panic!("{what}: glTF has no spheres") };
        let count = mesh.positions.len();
        let lengths =
            [mesh.normals.len(), mesh.tangents.len(), mesh.uv0.len(), mesh.uv1.len(), mesh.colors.len()];
        assert!(lengths.iter().all(|l| *l == 0 || *l == count), "{what}: {lengths:?} for {count} vertices");
        assert!(mesh.indices.as_flattened().iter().all(|i| (*i as usize) < count), "{what}: indices");
        assert!(mesh.positions.iter().all(|p| p.is_finite()), "{what}: positions");
        assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-3), "{what}: normals");
        assert!(mesh.tangents.iter().all(|t| (t.truncate().length() - 1.0).abs() < 1e-3), "{what}: tangents");
        assert!(mesh.uv0.iter().chain(&mesh.uv1).all(|uv| uv.is_finite()), "{what}: texture coordinates");
    }
    assert!(
        scene.textures.iter().filter_map(|t| t.as_image()).all(|t| (t.image as usize) < scene.images.len()),
        "{what}: images"
    );
    for material in &scene.materials {
        let textures = [
            material.base_color_texture,
            material.normal_texture,
            material.metallic_roughness_texture,
            material.emission_texture,
            material.transmission_texture,
        ];
        for texture in textures.into_iter().flatten() {
            assert!(
                (texture.texture as usize) < scene.textures.len() && texture.uv_set < 2,
                "{what}: {texture:?}"
            );
        }
    }
}
