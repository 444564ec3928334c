//! What changed between two versions of a scene.

use super::{BindingRecord, InstanceRecord, MaterialRecord, SceneTables};

/// What is new in the tables of a scene whose triangles and textures are as they were. A back end that is given this with
/// the new tables need not build acceleration structures of meshes, or move vertices and texels, again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Changes {
    /// `materials`, `layers`, `layer_textures`, `graph_nodes`, `media`, `grids`, `densities`, `fog`, `nested`, `placements`, or which material is where in `bindings`.
    pub materials: bool,
    /// `lights`, `primitive_lights`, `profiles`, `light_alias`, `light_tree`, `bounding_sphere`, or which light is where in `bindings`.
    pub lights: bool,
    /// `environment`.
    pub environment: bool,
    /// The transforms in `instances`, or `motion`.
    pub transforms: bool,
    /// Where vertices are, and their attributes: meshes deform, and their structures are to be refitted.
    pub vertices: bool,
}

impl Changes {
    /// What turned `old` into `new`. `None` if more than that changed: then the scene has to be loaded as a new one.
    ///
    /// Instances move without a rebuild if [`crate::Instance::dynamic`] says so, or if they share their mesh. A
    /// material that gets or loses holes changes how its geometry is traced, so that is more.
    pub fn between(old: &SceneTables, new: &SceneTables) -> Option<Self> {
        let same_vertices = old.positions == new.positions
            && old.normals == new.normals
            && old.tangents == new.tangents
            && old.uv0 == new.uv0
            && old.uv1 == new.uv1
            && old.colors == new.colors;
        // The geometries say how many vertices there are, and which attributes they have.
        let same_geometry = old.indices == new.indices
            && old.positions.len() == new.positions.len()
            && old.spheres == new.spheres
            && old.geometries == new.geometries
            && old.blas == new.blas;
        let same_textures = old.textures == new.textures
            && old.graph_textures == new.graph_textures
            && old.texels == new.texels;
        let holes = |m: &MaterialRecord| m.has_alpha();
        let same_holes = old.materials.iter().map(holes).eq(new.materials.iter().map(holes));
        let placed = |i: &InstanceRecord| (i.blas, i.first_binding);
        let same_instances = old.instances.iter().map(placed).eq(new.instances.iter().map(placed));
        let bound_holes = |t: &SceneTables| -> Vec<bool> {
            t.bindings.iter().map(|b| t.materials[b.material as usize].has_alpha()).collect()
        };
        if !(same_geometry && same_textures && same_holes && same_instances)
            || bound_holes(old) != bound_holes(new)
            || old.motion.is_some() != new.motion.is_some()
        {
            return None;
        }
        let material = |b: &BindingRecord| (b.material, b.object, b.placement);
        let light = |b: &BindingRecord| b.first_light;
        Some(Self {
            materials: old.materials != new.materials
                || old.layers != new.layers
                || old.layer_textures != new.layer_textures
                || old.graph_nodes != new.graph_nodes
                || old.media != new.media
                || old.grids != new.grids
                || old.densities != new.densities
                || old.fog != new.fog
                || old.nested != new.nested
                || old.placements != new.placements
                || old.bindings.iter().map(material).ne(new.bindings.iter().map(material)),
            lights: old.lights != new.lights
                || old.motion != new.motion
                || old.primitive_lights != new.primitive_lights
                || old.profiles != new.profiles
                || old.light_alias != new.light_alias
                || old.light_tree != new.light_tree
                || old.bounding_sphere != new.bounding_sphere
                || old.bindings.iter().map(light).ne(new.bindings.iter().map(light)),
            environment: old.environment != new.environment,
            transforms: old.instances != new.instances || old.motion != new.motion,
            vertices: !same_vertices,
        })
    }

    /// Whether nothing changed.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}
