//! A scene as a file describes it.

use crate::animation::{Animation, SceneMotion};
use crate::camera::Camera;
use crate::environment::Environment;
use crate::groups::Groups;
use crate::image::Image;
use crate::light::Light;
use crate::material::Material;
use crate::medium::Fog;
use crate::mesh::{Instance, Mesh};
use crate::portal::Portal;
use crate::settings::RenderDefaults;
use crate::subdivision::refinement::Refinement;
use crate::texture::Texture;
use std::sync::Arc;

/// A scene as the user described it: named objects that refer to each other by index.
///
/// A mesh that stands in the world several times is stored once and instanced. The node hierarchy of a file is
/// flattened: every [`Instance`] has its full object-to-world transform. [`Scene::groups`] keeps its names.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Name of the scene, usually the file's stem.
    pub name: String,
    /// Where the scene's own zero is in the world of its file, metres. All positions in the scene are relative to it. Zero
    /// unless the scene is far from its file's origin.
    pub origin: glam::DVec3,
    /// Geometry, each stored once.
    pub meshes: Vec<Mesh>,
    /// Where meshes stand in the world.
    pub instances: Vec<Instance>,
    /// What instances are parts of. Nothing that is rendered depends on it.
    pub groups: Arc<Groups>,
    /// Materials; [`crate::Part::material`] refers to them.
    pub materials: Vec<Material>,
    /// Textures: images and how they are sampled, and graphs.
    pub textures: Vec<Texture>,
    /// Decoded pixels.
    pub images: Vec<Image>,
    /// Punctual and directional lights. Emissive surfaces are lights by virtue of their material.
    pub lights: Vec<Light>,
    /// Cameras in file order. May be empty: [`Scene::default_camera`] then frames the scene.
    pub cameras: Vec<Camera>,
    /// Light from infinitely far away.
    pub environment: Environment,
    /// Where that light comes in. None where it comes from everywhere.
    pub portals: Vec<Portal>,
    /// What fills the space between bodies; `None` is vacuum.
    pub fog: Option<Fog>,
    /// Whether the file is a complete description that says itself what light there is. It is then left as dark as it is;
    /// models are shown under a sky where their own light does not reach what is seen.
    pub declares_light: bool,
    /// What the file says about how it wants to be rendered; the command line overrides it.
    pub defaults: RenderDefaults,
    /// What moves: see [`Scene::set_time`]. One for each animated file.
    pub animations: Vec<Animation>,
    /// What moves while the shutter is open: see [`Scene::open_shutter`]. `None` is an instant.
    pub motion: Option<Arc<SceneMotion>>,
    /// Meshes that are still to be subdivided: see [`Scene::refine`]. Loaders leave none.
    pub refinements: Vec<Refinement>,
}

impl Scene {
    /// World-space bounds of everything visible, as (minimum, maximum); `None` for a scene without geometry.
    ///
    /// Vertices that are not finite are left out.
    pub fn bounds(&self) -> Option<(glam::Vec3, glam::Vec3)> {
        let local: Vec<_> = self.meshes.iter().map(Mesh::bounds).collect();
        let mut bounds: Option<(glam::Vec3, glam::Vec3)> = None;
        for instance in self.instances.iter().filter(|i| i.visible) {
            let Some(Some((low, high))) = local.get(instance.mesh as usize) else { continue };
            for corner in 0..8u32 {
                let pick = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
                let world = instance.transform.transform_point3(glam::vec3(pick(0), pick(1), pick(2)));
                let (a, b) = bounds.unwrap_or((world, world));
                bounds = Some((a.min(world), b.max(world)));
            }
        }
        bounds
    }

    /// Number of triangles stored (instances counted once).
    pub fn unique_triangles(&self) -> usize {
        self.meshes.iter().map(Mesh::triangle_count).sum()
    }

    /// Number of triangles in the world (every visible instance counted).
    pub fn instanced_triangles(&self) -> u64 {
        let visible = self.instances.iter().filter(|i| i.visible);
        visible.filter_map(|i| self.meshes.get(i.mesh as usize)).map(|m| m.triangle_count() as u64).sum()
    }
}
