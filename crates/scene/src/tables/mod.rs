//! The scene as flat arrays: what back ends read.
//!
//! Everything is plain data with `u32` indices. Meshes that stand in the world once and never move are moved into
//! world space and share one bottom-level structure (the first); every other mesh has a structure of its own and is
//! instanced. So a scene of a thousand different walls costs no more to trace than one mesh.
//!
//! Finding what was hit: a hit names an instance and a primitive of its bottom-level structure. The structure's
//! [`GeometryRecord`]s cover consecutive primitives; geometry `g` of instance `i` has the
//! [`BindingRecord`] `i.first_binding + g`, which names material, lights and the user's instance.

mod build;
mod changes;
mod emitter_boxes;
mod environment;
mod features;
mod fingerprint;
mod geometry;
mod layers;
mod light;
mod light_bounds;
mod light_groups;
mod light_tree;
mod material;
mod medium;
mod near_lights;
mod portals;
mod rectangles;
mod surface_lights;
mod texture_graphs;

pub use changes::Changes;
pub use emitter_boxes::{EmitterBox, MOST_BOXES};
pub use environment::EnvironmentTable;
pub use geometry::{BindingRecord, BlasRecord, GeometryKind, GeometryRecord, InstanceRecord};
pub use layers::{LAYER_TEXTURES, LAYERS_GLOSSINESS, LayerTextures, LayersRecord};
pub use light::LightRecord;
pub use light_tree::{LightChoice, LightTree};
pub use material::{
    MATERIAL_ALPHA_BLEND, MATERIAL_ALPHA_MASK, MATERIAL_BODY, MATERIAL_CHECKERBOARD,
    MATERIAL_CHECKERBOARD_FADES, MATERIAL_CULLS_BACKS, MATERIAL_EMISSION_TWO_SIDED, MATERIAL_EMISSIVE,
    MATERIAL_GRAPHS, MATERIAL_SMOOTH_TERMINATOR, MATERIAL_TANGENTS, MATERIAL_TANGENTS_MIRRORED,
    MATERIAL_THIN, MaterialRecord, ModelTag, TextureUse,
};
pub use medium::{FogRecord, GridRecord, MediumRecord};
pub use optics::alias_table::{AliasEntry, build_alias_table};
pub use optics::light_node::LightNode;
pub use optics::portal_triangle::PortalTriangle;
pub use texture_graphs::TextureNode;

/// "No index".
pub const NONE: u32 = u32::MAX;

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
    /// Materials, parallel to [`crate::Scene::materials`].
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
    /// Boxes around all surfaces that a path may find light on; at most [`MOST_BOXES`]. They follow from the rest.
    pub emitter_boxes: Vec<EmitterBox>,
    /// What is infinitely far away.
    pub environment: EnvironmentTable,
    /// World-space centre and radius of a sphere around everything finite; radius 0 if there is nothing.
    pub bounding_sphere: [f32; 4],
    /// Whether any surface has holes (alpha mask or blend).
    pub has_alpha: bool,
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
