//! Indices by which parts of a scene refer to each other.

/// Index into [`crate::Scene::meshes`].
pub type MeshId = u32;
/// Index into [`crate::Scene::instances`].
pub type InstanceId = u32;
/// Index into [`crate::Scene::materials`].
pub type MaterialId = u32;
/// Index into [`crate::Scene::textures`].
pub type TextureId = u32;
/// Index into [`crate::Scene::images`].
pub type ImageId = u32;
