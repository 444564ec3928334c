//! What things cost until they are rendered, in bytes: themselves, their rows in the tables, and their share of the
//! acceleration structures. Estimates from the sizes of the records, rounded up.

use crate::tables::{LightRecord, MaterialRecord};
use crate::{Instance, Light, Material, Scene, Shape};

/// A triangle of a mesh with its share of vertices: twice 40 bytes, and nodes and leaves of a hierarchy.
pub(crate) const TRIANGLE: u64 = 180;
/// Tangents of a triangle: of its corners while they are made, and of vertices that are split by them.
pub(crate) const TANGENTS: u64 = 320;
/// A pixel with eight bits a channel: in the image and as a texel.
pub(crate) const PIXEL: u64 = 8;
/// A pixel of single-precision numbers: as the file has it, in the image twice while it is turned into that, and as a texel.
pub(crate) const FLOAT_PIXEL: u64 = 48;
/// A material and its row.
pub(crate) const MATERIAL: u64 = (size_of::<Material>() + size_of::<MaterialRecord>()) as u64;

/// An instance with a name of `name` bytes: record, binding, node of the top level.
pub(crate) fn instance(name: usize) -> u64 {
    (size_of::<Instance>() + name) as u64 + 512
}

/// A light with a name of `name` bytes.
pub(crate) fn light(name: usize) -> u64 {
    (size_of::<Light>() + name) as u64
}

/// A light's record, its leaf in the light tree, its box, its row in the table of probabilities.
const LIGHT: u64 = size_of::<LightRecord>() as u64 + 160;

/// All lights of a scene: its own, and each triangle that shines, in each place where it stands.
pub(super) fn lights(scene: &Scene) -> u64 {
    let shines = |material: u32| {
        let material = scene.materials.get(material as usize);
        material.is_some_and(|m| m.emission.max_element() > 0.0)
    };
    let count = |shape: &Shape| match shape {
        Shape::Triangles(mesh) => mesh.indices.len() as u64,
        Shape::Spheres(spheres) => spheres.len() as u64,
    };
    let own: Vec<u64> = scene
        .meshes
        .iter()
        .map(|mesh| {
            mesh.parts.iter().filter(|part| shines(part.material)).map(|part| count(&part.shape)).sum()
        })
        .collect();
    let of_instance = |instance: &Instance| -> u64 {
        let Some(materials) = &instance.materials else {
            return own.get(instance.mesh as usize).copied().unwrap_or(0);
        };
        let parts = scene.meshes.get(instance.mesh as usize).map(|mesh| &mesh.parts[..]).unwrap_or_default();
        let material = |index: usize| materials.get(index).copied().unwrap_or(parts[index].material);
        parts
            .iter()
            .enumerate()
            .filter(|(i, _)| shines(material(*i)))
            .map(|(_, part)| count(&part.shape))
            .sum()
    };
    let shining =
        scene.instances.iter().map(of_instance).fold(scene.lights.len() as u64, u64::saturating_add);
    shining.saturating_mul(LIGHT)
}
