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
mod caustics;
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
mod light_pictures;
mod light_tree;
mod material;
mod media;
mod medium;
mod motion;
mod motion_table;
mod near_lights;
mod portals;
mod rectangles;
mod scene_tables;
mod surface_lights;
mod texture_graphs;
mod transform;

pub use caustics::{CausticsAdvice, MOST_TARGETS};
pub use changes::Changes;
pub use emitter_boxes::{EmitterBox, MOST_BOXES};
pub use environment::EnvironmentTable;
pub use geometry::{BindingRecord, BlasRecord, GeometryKind, GeometryRecord, InstanceRecord};
pub use light::LightRecord;
pub use light_tree::{LightChoice, LightTree};
pub use material::{
    MATERIAL_ALPHA_BLEND, MATERIAL_ALPHA_MASK, MATERIAL_BODY, MATERIAL_CHECKERBOARD,
    MATERIAL_CHECKERBOARD_FADES, MATERIAL_CULLS_BACKS, MATERIAL_EMISSION_TWO_SIDED, MATERIAL_EMISSIVE,
    MATERIAL_GRAPHS, MATERIAL_SMOOTH_TERMINATOR, MATERIAL_TANGENTS, MATERIAL_TANGENTS_MIRRORED,
    MATERIAL_THIN, MaterialRecord, ModelTag, TextureUse,
};
pub use medium::{FogRecord, GridRecord, MediumRecord};
pub use motion_table::{LightMotion, MotionRange, MotionTable};
pub use optics::alias_table::{AliasEntry, build_alias_table};
pub use optics::constants::NONE;
pub use optics::layers::{LAYER_TEXTURES, LAYERS_GLOSSINESS, LayersRecord};
pub use optics::light_node::LightNode;
pub use optics::portal_triangle::PortalTriangle;
pub use scene_tables::{LayerTextures, SceneTables};
pub use texture_graphs::TextureNode;
