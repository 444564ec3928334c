//! Scenes in one file, with all that they refer to: what front ends save and send to other
//! processes.
//!
//! A line that says what it is, then the [`Scene`] as CBOR (RFC 8949) with the names of its fields.
//! Fields that a reader does not know are an error, since the picture would be another. Animations
//! are left out: a scene is saved as it stands, with what moves while its shutter is open.

use super::session::TRIANGLE;
use super::{LoadError, LoadOptions, Loaded};
use crate::animation::SceneMotion;
use crate::{
    Camera, Environment, Fog, Groups, Image, Instance, Light, LoadReport, Material, Mesh, Part, Portal,
    RenderDefaults, Scene, Shape, Texture, TriangleMesh,
};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::Arc;

/// How a file begins.
const BEGINNING: &[u8] = b"alhazen scene 1\n";

/// The ending of the files' names.
pub const ENDING: &str = "alhazen";

/// A scene as it is written, without what moves.
#[derive(Serialize)]
struct Written<'s> {
    name: &'s str,
    origin: DVec3,
    meshes: &'s [Mesh],
    instances: &'s [Instance],
    groups: &'s Groups,
    materials: &'s [Material],
    textures: &'s [Texture],
    images: &'s [Image],
    lights: &'s [Light],
    cameras: &'s [Camera],
    environment: &'s Environment,
    portals: &'s [Portal],
    fog: &'s Option<Fog>,
    declares_light: bool,
    defaults: &'s RenderDefaults,
    /// What moves while the shutter is open.
    #[serde(skip_serializing_if = "Option::is_none")]
    motion: Option<&'s SceneMotion>,
}

/// The same as it is read.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Read {
    name: String,
    origin: DVec3,
    meshes: Vec<Mesh>,
    instances: Vec<Instance>,
    #[serde(default)]
    groups: Groups,
    materials: Vec<Material>,
    textures: Vec<Texture>,
    images: Vec<Image>,
    lights: Vec<Light>,
    cameras: Vec<Camera>,
    environment: Environment,
    portals: Vec<Portal>,
    fog: Option<Fog>,
    declares_light: bool,
    defaults: RenderDefaults,
    #[serde(default)]
    motion: Option<SceneMotion>,
}

/// The bytes of a file of a scene.
///
/// # Errors
/// What the encoder says.
pub fn pack(scene: &Scene) -> Result<Vec<u8>, String> {
    let written = Written {
        name: &scene.name,
        origin: scene.origin,
        meshes: &scene.meshes,
        instances: &scene.instances,
        groups: &scene.groups,
        materials: &scene.materials,
        textures: &scene.textures,
        images: &scene.images,
        lights: &scene.lights,
        cameras: &scene.cameras,
        environment: &scene.environment,
        portals: &scene.portals,
        fog: &scene.fog,
        declares_light: scene.declares_light,
        defaults: &scene.defaults,
        motion: scene.motion.as_deref(),
    };
    let mut bytes = BEGINNING.to_vec();
    ciborium::into_writer(&written, &mut bytes).map_err(|error| error.to_string())?;
    Ok(bytes)
}

/// Loads a file that holds what [`pack`] made.
///
/// # Errors
/// [`LoadError::Read`], [`LoadError::TooLarge`], [`LoadError::OverBudget`], and
/// [`LoadError::Malformed`] for what is none, or refers to what is not there.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded, LoadError> {
    options.scene_session(path, |options| {
        let bytes = options.read(path)?;
        let report = LoadReport { bytes_read: bytes.len() as u64, ..LoadReport::default() };
        // Numbers take about as much room in the file as in memory; small ones take less.
        options.budget().take((bytes.len() as u64).saturating_mul(4), "contents")?;
        let scene = unpack(path, &bytes)?;
        options.budget().take((scene.unique_triangles() as u64).saturating_mul(TRIANGLE), "triangles")?;
        Ok(Loaded { scene, report })
    })
}

/// The scene of bytes that [`pack`] made. `path`: what errors name.
///
/// # Errors
/// [`LoadError::Malformed`].
pub fn unpack(path: &Path, bytes: &[u8]) -> Result<Scene, LoadError> {
    let malformed = |object: &str, message: String| LoadError::malformed(path, object, message);
    let Some(rest) = bytes.strip_prefix(BEGINNING) else {
        return Err(malformed("beginning", "this is no scene saved by this version".into()));
    };
    let read: Read = ciborium::from_reader(rest).map_err(|error| malformed("contents", error.to_string()))?;
    let scene = Scene {
        name: read.name,
        origin: read.origin,
        meshes: read.meshes,
        instances: read.instances,
        groups: read.groups.into(),
        materials: read.materials,
        textures: read.textures,
        images: read.images,
        lights: read.lights,
        cameras: read.cameras,
        environment: read.environment,
        portals: read.portals,
        fog: read.fog,
        declares_light: read.declares_light,
        defaults: read.defaults,
        motion: read.motion.map(Arc::new),
        ..Scene::default()
    };
    check(&scene).map_err(|(object, message)| malformed(&object, message))?;
    Ok(scene)
}

/// What is wrong with a scene that was not made by a loader: an object and a message.
type Wrong = (String, String);

/// Whether everything that a scene refers to is there, and arrays fit each other.
fn check(scene: &Scene) -> Result<(), Wrong> {
    for (i, mesh) in scene.meshes.iter().enumerate() {
        for part in &mesh.parts {
            check_part(scene, part).map_err(|message| (format!("mesh {i}"), message))?;
        }
    }
    for (i, instance) in scene.instances.iter().enumerate() {
        check_instance(scene, instance).map_err(|message| (format!("instance {i}"), message))?;
    }
    for (i, image) in scene.images.iter().enumerate() {
        let pixels = u64::from(image.width) * u64::from(image.height);
        let there = image.pixels.len();
        if pixels == 0 || pixels != there as u64 {
            return Err((
                format!("image {i}"),
                format!("{there} pixels for {}×{}", image.width, image.height),
            ));
        }
    }
    for (i, texture) in scene.textures.iter().enumerate() {
        check_texture(scene, texture).map_err(|why| (format!("texture {i}"), why))?;
    }
    if let Some(problem) = scene.groups.problem() {
        return Err(("groups".into(), problem));
    }
    match scene.environment {
        Environment::Image { image, .. } if image as usize >= scene.images.len() => {
            Err(("environment".into(), "its image is not there".into()))
        }
        _ => Ok(()),
    }
}

fn check_texture(scene: &Scene, texture: &Texture) -> Result<(), String> {
    match texture {
        Texture::Image(t) if t.image as usize >= scene.images.len() => Err("its image is not there".into()),
        Texture::Image(_) => Ok(()),
        Texture::Graph(graph) => graph.check().map_err(|error| error.to_string()),
    }
}

fn check_part(scene: &Scene, part: &Part) -> Result<(), String> {
    if part.material as usize >= scene.materials.len().max(1) {
        return Err(format!("its material {} is not there", part.material));
    }
    match &part.shape {
        Shape::Triangles(mesh) => check_mesh(mesh),
        Shape::Spheres(spheres) => {
            let wrong = spheres
                .iter()
                .position(|s| !(s.center.is_finite() && s.radius > 0.0 && s.radius.is_finite()));
            wrong.map_or(Ok(()), |i| Err(format!("sphere {i} is none")))
        }
    }
}

fn check_mesh(mesh: &TriangleMesh) -> Result<(), String> {
    let vertices = mesh.positions.len();
    let attributes = [
        ("normals", mesh.normals.len()),
        ("tangents", mesh.tangents.len()),
        ("texture coordinates", mesh.uv0.len()),
        ("second texture coordinates", mesh.uv1.len()),
        ("colours", mesh.colors.len()),
    ];
    if let Some((name, count)) = attributes.into_iter().find(|(_, count)| *count != 0 && *count != vertices) {
        return Err(format!("{count} {name} for {vertices} vertices"));
    }
    let wrong = mesh.indices.iter().position(|t| t.iter().any(|i| *i as usize >= vertices));
    wrong.map_or(Ok(()), |i| Err(format!("triangle {i} has a vertex that is not there")))
}

fn check_instance(scene: &Scene, instance: &Instance) -> Result<(), String> {
    let Some(mesh) = scene.meshes.get(instance.mesh as usize) else {
        return Err(format!("its mesh {} is not there", instance.mesh));
    };
    if !instance.transform.is_finite() {
        return Err("its transform is not finite".into());
    }
    let Some(materials) = &instance.materials else { return Ok(()) };
    if materials.len() != mesh.parts.len() {
        return Err(format!("{} materials for {} parts", materials.len(), mesh.parts.len()));
    }
    let known = scene.materials.len().max(1);
    let wrong = materials.iter().find(|m| **m as usize >= known);
    wrong.map_or(Ok(()), |m| Err(format!("its material {m} is not there")))
}
