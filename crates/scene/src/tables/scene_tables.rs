//! The arrays of a scene, and how things are found in them.

use super::emitter_boxes::EmitterBox;
use super::environment::EnvironmentTable;
use super::geometry::{BindingRecord, BlasRecord, GeometryRecord, InstanceRecord};
use super::light::LightRecord;
use super::light_tree::LightTree;
use super::medium::{FogRecord, GridRecord, MediumRecord};
use super::motion_table::MotionTable;
use optics::alias_table::AliasEntry;
use optics::constants::NONE;
use optics::image_texture::TextureUse;
use optics::layers::{LAYER_TEXTURES, LayersRecord};
use optics::material::MaterialRecord;
use optics::texture_node::TextureNode;
use std::sync::Arc;

/// The textures of a material's layers, by `LAYER_…` of the optics.
pub type LayerTextures = [TextureUse; LAYER_TEXTURES as usize];

/// A scene as flat arrays.
#[derive(Clone, Debug, Default)]
pub struct SceneTables {
    /// Vertex positions: world space for the first bottom-level structure, object space for the others.
    pub positions: Vec<[f32; 3]>,
    /// Vertex normals, in the space of the positions. Of unit length but where a static transform changes shapes: there of
    /// lengths up to 1 that interpolate as the transform makes them.
    pub normals: Vec<[f32; 3]>,
    /// Tangents, with lengths as the normals', and the bitangent's handedness, in the space of the positions.
    pub tangents: Vec<[f32; 4]>,
    /// First texture coordinates.
    pub uv0: Vec<[f32; 2]>,
    /// Second texture coordinates.
    pub uv1: Vec<[f32; 2]>,
    /// Linear vertex colours.
    pub colors: Vec<[f32; 4]>,
    /// Vertex indices of triangles, relative to the geometry's first vertex.
    pub indices: Vec<[u32; 3]>,
    /// Spheres: centre and radius.
    pub spheres: Vec<[f32; 4]>,
    /// Pieces of one material.
    pub geometries: Vec<GeometryRecord>,
    /// Bottom-level structures.
    pub blas: Vec<BlasRecord>,
    /// Instances of bottom-level structures.
    pub instances: Vec<InstanceRecord>,
    /// One for each geometry of each instance.
    pub bindings: Vec<BindingRecord>,
    /// Rows of 3×4 matrices from world to object space, of what was moved into world space and has something that lies in
    /// the space of its object: procedural patterns, and texture coordinates of spheres.
    pub placements: Vec<[[f32; 4]; 3]>,
    /// Materials, parallel to [`crate::Scene::materials`]; then those of lights that show a picture.
    pub materials: Vec<MaterialRecord>,
    /// What lies on the base of layered materials.
    pub layers: Vec<LayersRecord>,
    /// The textures of layers, parallel to `layers`.
    pub layer_textures: Vec<LayerTextures>,
    /// Media inside of bodies and between them.
    pub media: Vec<MediumRecord>,
    /// Grids of densities of media.
    pub grids: Vec<GridRecord>,
    /// The densities of all grids.
    pub densities: Vec<f32>,
    /// What is between bodies.
    pub fog: FogRecord,
    /// Whether bodies have priorities, and refract by what is on both of their sides.
    pub nested: bool,
    /// Textures as they are used without a transform of coordinates, parallel to [`crate::Scene::textures`].
    pub textures: Vec<TextureUse>,
    /// Nodes of all texture graphs, one graph after the other.
    pub graph_nodes: Vec<TextureNode>,
    /// The images that they show.
    pub graph_textures: Vec<TextureUse>,
    /// Texels of all images, RGBA: four bytes, or four half floats in two places, low bytes first.
    pub texels: Vec<[u8; 4]>,
    /// Everything that next-event estimation can sample.
    pub lights: Vec<LightRecord>,
    /// Which light each primitive of emissive geometries is a part of: two triangles may be one rectangle. See
    /// [`BindingRecord::first_light`].
    pub primitive_lights: Vec<u32>,
    /// Profiles of lights, one after the other: rows, columns, and the bits of the values, row by row.
    pub profiles: Vec<u32>,
    /// Chooses a light by power where there is no `light_tree`; as long as `lights`.
    pub light_alias: Vec<AliasEntry>,
    /// Chooses a light by the irradiance that it can bring, if there are several.
    pub light_tree: LightTree,
    /// Whether an instance says that it will be moved ([`crate::Instance::dynamic`]).
    pub has_dynamic_instances: bool,
    /// Boxes around all surfaces that a path may find light on; at most [`super::MOST_BOXES`]. They follow from the rest.
    pub emitter_boxes: Vec<EmitterBox>,
    /// What is infinitely far away.
    pub environment: EnvironmentTable,
    /// World-space centre and radius of a sphere around everything finite; radius 0 if there is nothing.
    pub bounding_sphere: [f32; 4],
    /// Whether any surface has holes (alpha mask or blend).
    pub has_alpha: bool,
    /// What moves while the shutter is open; `None` if nothing does.
    pub motion: Option<Arc<MotionTable>>,
}

impl SceneTables {
    /// Bytes in all arrays.
    pub fn memory_bytes(&self) -> usize {
        fn bytes<T>(v: &[T]) -> usize {
            size_of_val(v)
        }
        bytes(&self.positions)
            + bytes(&self.normals)
            + bytes(&self.tangents)
            + bytes(&self.uv0)
            + bytes(&self.uv1)
            + bytes(&self.colors)
            + bytes(&self.indices)
            + bytes(&self.spheres)
            + bytes(&self.geometries)
            + bytes(&self.instances)
            + bytes(&self.bindings)
            + bytes(&self.placements)
            + bytes(&self.materials)
            + bytes(&self.layers)
            + bytes(&self.layer_textures)
            + bytes(&self.media)
            + bytes(&self.grids)
            + bytes(&self.densities)
            + bytes(&self.graph_nodes)
            + bytes(&self.graph_textures)
            + bytes(&self.texels)
            + bytes(&self.lights)
            + bytes(&self.primitive_lights)
            + bytes(&self.profiles)
            + bytes(&self.light_alias)
            + self.light_tree.memory_bytes()
            + bytes(&self.emitter_boxes)
            + self.environment.memory_bytes()
            + self.motion.as_ref().map_or(0, |m| bytes(&m.segments) + bytes(&m.instances) + bytes(&m.lights))
    }

    /// The light that a primitive of a binding's geometry is a part of, as an index into `lights`; [`NONE`] if its light cannot be
    /// sampled. `primitive`: its number within the geometry.
    #[inline(always)]
    pub fn light_of(&self, binding: &BindingRecord, primitive: u32) -> u32 {
        match binding.first_light {
            NONE => NONE,
            first => self.primitive_lights[(first + primitive) as usize],
        }
    }

    /// From world space to that of the user's object, of a binding whose geometry was moved into world space; `None` where
    /// nothing asks, or where both are the same.
    #[inline(always)]
    pub fn placement(&self, binding: &BindingRecord) -> Option<&[[f32; 4]; 3]> {
        self.placements.get(binding.placement as usize)
    }

    /// Number of triangles stored.
    pub fn unique_triangles(&self) -> usize {
        self.indices.len()
    }
}
