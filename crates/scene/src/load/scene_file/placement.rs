//! Where objects stand in the world, in `f64`, until it is known what the scene is stored relative to.

use crate::animation::{Keyed, KeyedObject};
use crate::origin::{Bounds, stored};
use crate::{Animation, Camera, CameraPath, LoadReport, Portal, Scene};
use glam::{DAffine3, DVec3, Vec3};
use std::sync::Arc;

/// Places of what is in the lists of the scene that is being put together; each list is parallel to the scene's.
///
/// The roots of the scene's animations are transforms to the world meanwhile.
#[derive(Default)]
pub(super) struct Placement {
    /// Mesh to world.
    pub instances: Vec<DAffine3>,
    /// From where the light of the scene is described to the world.
    pub lights: Vec<DAffine3>,
    pub cameras: Vec<View>,
    /// Corners.
    pub portals: Vec<[DVec3; 4]>,
    /// What moves, with where it was described.
    pub keys: Vec<(KeyedObject, Keys, String)>,
}

/// Where something is over time.
pub(super) struct Keys {
    /// Seconds.
    pub times: Vec<f32>,
    /// To the world.
    pub worlds: Vec<DAffine3>,
}

/// The points of a camera in the world.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    pub eye: DVec3,
    pub target: DVec3,
    /// The centre of the circle on which it moves.
    pub center: Option<DVec3>,
}

impl View {
    /// The points of a camera of a scene with this origin.
    pub fn of(camera: &Camera, origin: DVec3) -> Self {
        let world = |point: Vec3| origin + point.as_dvec3();
        let center = camera.path.map(|CameraPath::Orbit { center, .. }| world(center));
        Self { eye: world(camera.eye), target: world(camera.target), center }
    }

    fn place(&self, origin: DVec3, camera: &mut Camera) {
        camera.eye = (self.eye - origin).as_vec3();
        camera.target = (self.target - origin).as_vec3();
        if let (Some(CameraPath::Orbit { center, .. }), Some(world)) = (&mut camera.path, self.center) {
            *center = (world - origin).as_vec3();
            camera.eye = camera.at(0.0).eye;
        }
    }
}

impl Placement {
    /// Gives the scene its origin, and everything in it its place relative to it.
    pub fn settle(self, scene: &mut Scene, report: &mut LoadReport) {
        let origin = self.origin(scene);
        scene.set_origin(origin, report);
        for (instance, world) in scene.instances.iter_mut().zip(&self.instances) {
            instance.transform = stored(world, origin);
        }
        for (light, world) in scene.lights.iter_mut().zip(&self.lights) {
            *light = light.moved(&stored(world, origin));
        }
        for (camera, view) in scene.cameras.iter_mut().zip(&self.cameras) {
            view.place(origin, camera);
        }
        let shift = DAffine3::from_translation(-origin);
        for animation in &mut scene.animations {
            animation.instances.iter_mut().for_each(|i| i.root = shift * i.root);
            animation.lights.iter_mut().for_each(|l| l.root = shift * l.root);
            animation.keyed.iter_mut().for_each(|k| k.shift(&shift.as_affine3a()));
        }
        let mut keyed = Vec::new();
        for (object, keys, what) in self.keys {
            let transforms = keys.worlds.iter().map(|world| stored(world, origin)).collect();
            match Keyed::new(object, keys.times, transforms) {
                Ok(motion) => keyed.push(motion),
                Err(error) => report.ignored(format!("the motion of {what}: {error}")),
            }
        }
        if !keyed.is_empty() {
            scene.animations.push(Animation { keyed, ..Animation::default() });
        }
        let portals = self.portals.iter().map(|corners| corners.map(|corner| (corner - origin).as_vec3()));
        // They were portals when they were read.
        scene.portals = portals.filter_map(|corners| Portal::new(corners).ok()).collect();
        move_media(scene, -origin);
    }

    fn origin(&self, scene: &Scene) -> DVec3 {
        let boxes: Vec<_> = scene.meshes.iter().map(crate::Mesh::bounds).collect();
        let mut bounds = Bounds::default();
        for (instance, world) in scene.instances.iter().zip(&self.instances) {
            if let Some(Some((low, high))) = boxes.get(instance.mesh as usize) {
                bounds.add_box(world, low.as_dvec3(), high.as_dvec3());
            }
        }
        bounds.anchor()
    }
}

/// Moves what media know of the world.
pub(super) fn move_media(scene: &mut Scene, by: DVec3) {
    if by == DVec3::ZERO {
        return;
    }
    if let Some(fog) = &mut scene.fog {
        fog.top = (f64::from(fog.top) + by.y) as f32;
    }
    for medium in scene.materials.iter_mut().filter_map(|material| material.medium.as_mut()) {
        let placed = medium
            .density
            .as_ref()
            .and_then(|grid| grid.placed(grid.bounds().map(|corner| (corner.as_dvec3() + by).as_vec3())));
        medium.density = placed.map(Arc::new).or(medium.density.take());
    }
}
