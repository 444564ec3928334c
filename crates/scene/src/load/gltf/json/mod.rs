//! The JSON of a glTF file, as far as this loader uses it: unknown fields are skipped, names are glTF's own.
//!
//! Every type mirrors the object of the same name in the specification or in an extension.

mod animations;
mod data;
mod lights;
mod list;
mod materials;

pub(super) use animations::*;
pub(super) use data::*;
pub(super) use lights::*;
pub(super) use list::*;
pub(super) use materials::*;

use serde::Deserialize;
use std::collections::BTreeMap;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Gltf<'a> {
    pub asset: Option<Asset>,
    pub scene: Option<u32>,
    #[serde(default)]
    pub scenes: List<Scene>,
    #[serde(default)]
    pub nodes: List<Node>,
    #[serde(default)]
    pub meshes: List<Mesh>,
    #[serde(default)]
    pub materials: List<Material>,
    #[serde(default)]
    pub textures: List<Texture>,
    #[serde(default, borrow)]
    pub images: List<Image<'a>>,
    #[serde(default)]
    pub samplers: List<Sampler>,
    #[serde(default)]
    pub cameras: List<Camera>,
    #[serde(default)]
    pub skins: List<Skin>,
    #[serde(default)]
    pub accessors: List<Accessor>,
    #[serde(default)]
    pub buffer_views: List<BufferView>,
    #[serde(default, borrow)]
    pub buffers: List<Buffer<'a>>,
    #[serde(default)]
    pub animations: List<Animation>,
    #[serde(default)]
    pub extensions: RootExtensions,
    #[serde(default)]
    pub extensions_used: List<String>,
    #[serde(default)]
    pub extensions_required: List<String>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Asset {
    pub version: Option<String>,
    pub min_version: Option<String>,
}

#[derive(Default, Deserialize)]
pub(super) struct RootExtensions {
    #[serde(rename = "KHR_lights_punctual")]
    pub lights: Option<Lights>,
    #[serde(rename = "EXT_lights_image_based")]
    pub image_based: Option<ImageBasedLights>,
    #[serde(rename = "EXT_lights_ies")]
    pub photometric: Option<PhotometricLights>,
    #[serde(rename = "KHR_materials_variants")]
    pub variants: Option<Variants>,
}

#[derive(Deserialize)]
pub(super) struct Variants {
    #[serde(default)]
    pub variants: List<Variant>,
}

#[derive(Deserialize)]
pub(super) struct Variant {
    #[serde(default)]
    pub name: String,
}

#[derive(Deserialize)]
pub(super) struct Scene {
    #[serde(default)]
    pub nodes: List<u32>,
    pub extras: Option<serde_json::Value>,
    #[serde(default)]
    pub extensions: SceneExtensions,
}

#[derive(Default, Deserialize)]
pub(super) struct SceneExtensions {
    #[serde(rename = "EXT_lights_image_based")]
    pub image_based: Option<NodeLight>,
}

#[derive(Deserialize)]
pub(super) struct Node {
    pub name: Option<String>,
    #[serde(default)]
    pub children: List<u32>,
    pub mesh: Option<u32>,
    pub skin: Option<u32>,
    pub camera: Option<u32>,
    pub matrix: Option<[f64; 16]>,
    pub translation: Option<[f64; 3]>,
    pub rotation: Option<[f64; 4]>,
    pub scale: Option<[f64; 3]>,
    pub weights: Option<Vec<f32>>,
    #[serde(default)]
    pub extensions: NodeExtensions,
}

#[derive(Default, Deserialize)]
pub(super) struct NodeExtensions {
    #[serde(rename = "KHR_lights_punctual")]
    pub light: Option<NodeLight>,
    #[serde(rename = "EXT_lights_ies")]
    pub photometric: Option<NodePhotometric>,
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    pub instancing: Option<Instancing>,
    #[serde(rename = "KHR_node_visibility")]
    pub visibility: Option<Visibility>,
}

#[derive(Deserialize)]
pub(super) struct NodeLight {
    pub light: u32,
}

#[derive(Deserialize)]
pub(super) struct Instancing {
    #[serde(default)]
    pub attributes: BTreeMap<String, u32>,
}

#[derive(Deserialize)]
pub(super) struct Visibility {
    pub visible: Option<bool>,
}

#[derive(Deserialize)]
pub(super) struct Mesh {
    pub name: Option<String>,
    #[serde(default)]
    pub primitives: List<Primitive>,
    pub weights: Option<Vec<f32>>,
}

#[derive(Deserialize)]
pub(super) struct Primitive {
    #[serde(default)]
    pub attributes: BTreeMap<String, u32>,
    pub indices: Option<u32>,
    pub material: Option<u32>,
    pub mode: Option<u32>,
    #[serde(default)]
    pub targets: List<BTreeMap<String, u32>>,
    #[serde(default)]
    pub extensions: PrimitiveExtensions,
}

#[derive(Default, Deserialize)]
pub(super) struct PrimitiveExtensions {
    #[serde(rename = "KHR_draco_mesh_compression")]
    pub draco: Option<Draco>,
    #[serde(rename = "KHR_materials_variants")]
    pub variants: Option<VariantMappings>,
}

#[derive(Deserialize)]
pub(super) struct VariantMappings {
    #[serde(default)]
    pub mappings: List<VariantMapping>,
}

#[derive(Deserialize)]
pub(super) struct VariantMapping {
    pub material: u32,
    #[serde(default)]
    pub variants: List<u32>,
}

/// Where a primitive's compressed data is, and the numbers of the attributes in it.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Draco {
    pub buffer_view: u32,
    #[serde(default)]
    pub attributes: BTreeMap<String, u32>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Skin {
    pub inverse_bind_matrices: Option<u32>,
    #[serde(default)]
    pub joints: List<u32>,
}

#[derive(Deserialize)]
pub(super) struct Camera {
    pub name: Option<String>,
    #[serde(rename = "type", default)]
    pub kind: String,
    pub perspective: Option<Perspective>,
    pub orthographic: Option<Orthographic>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Perspective {
    pub aspect_ratio: Option<f32>,
    pub yfov: Option<f32>,
}

#[derive(Deserialize)]
pub(super) struct Orthographic {
    pub xmag: Option<f32>,
    pub ymag: Option<f32>,
}
