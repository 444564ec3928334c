//! Putting one scene into another.

use crate::animation::KeyedObject;
use crate::{Animation, ImageId, LightParameter, MaterialId, Mesh, MeshId, Scene, TextureId};
use glam::{Affine3A, Vec3};
use std::ops::Range;
use std::sync::Arc;

/// Where the objects of a merged scene ended up.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Merged {
    /// Meshes.
    pub meshes: Range<usize>,
    /// Instances.
    pub instances: Range<usize>,
    /// Materials.
    pub materials: Range<usize>,
    /// Textures.
    pub textures: Range<usize>,
    /// Images.
    pub images: Range<usize>,
    /// Lights.
    pub lights: Range<usize>,
    /// Cameras.
    pub cameras: Range<usize>,
    /// Animations.
    pub animations: Range<usize>,
}

impl Scene {
    /// Appends everything that stands in `other`, with its indices moved; returns where it went.
    ///
    /// An environment image comes along as an image, but `self` keeps its own name, environment and render defaults.
    /// Portals come along: light comes in there whatever light it is. What is relative to another
    /// [`Scene::origin`] is moved, so that it stays where it is in the world.
    pub fn merge(&mut self, mut other: Scene) -> Merged {
        other.shift((other.origin - self.origin).as_vec3());
        let offsets = Offsets {
            meshes: self.meshes.len() as u32,
            materials: self.materials.len() as u32,
            textures: self.textures.len() as u32,
            images: self.images.len() as u32,
            instances: self.instances.len() as u32,
            lights: self.lights.len() as u32,
            cameras: self.cameras.len() as u32,
        };
        offsets.apply(&mut other);
        self.portals.append(&mut other.portals);
        self.refinements.append(&mut other.refinements);
        let (first, count) = (self.instances.len() as u32, other.instances.len());
        if !other.groups.list.is_empty() {
            Arc::make_mut(&mut self.groups).append(&other.groups, first, count, None);
        }
        Merged {
            meshes: append(&mut self.meshes, other.meshes),
            instances: append(&mut self.instances, other.instances),
            materials: append(&mut self.materials, other.materials),
            textures: append(&mut self.textures, other.textures),
            images: append(&mut self.images, other.images),
            lights: append(&mut self.lights, other.lights),
            cameras: append(&mut self.cameras, other.cameras),
            animations: append(&mut self.animations, other.animations),
        }
    }
}

impl Scene {
    /// Moves everything by `by`, as if the origin were elsewhere.
    fn shift(&mut self, by: Vec3) {
        if by == Vec3::ZERO {
            return;
        }
        let motion = Affine3A::from_translation(by);
        self.instances.iter_mut().for_each(|i| i.transform = motion * i.transform);
        self.lights.iter_mut().for_each(|light| *light = light.moved(&motion));
        self.cameras.iter_mut().for_each(|camera| camera.shift(by));
        self.portals.iter_mut().for_each(|portal| portal.shift(by));
        for animation in &mut self.animations {
            let motion = glam::DAffine3::from_translation(by.as_dvec3());
            animation.instances.iter_mut().for_each(|i| i.root = motion * i.root);
            animation.lights.iter_mut().for_each(|l| l.root = motion * l.root);
            animation.keyed.iter_mut().for_each(|k| k.shift(&Affine3A::from_translation(by)));
        }
    }
}

/// How far the indices of a merged scene move.
struct Offsets {
    meshes: MeshId,
    materials: MaterialId,
    textures: TextureId,
    images: ImageId,
    instances: u32,
    lights: u32,
    cameras: u32,
}

impl Offsets {
    fn apply(&self, scene: &mut Scene) {
        for part in scene.meshes.iter_mut().flat_map(|mesh: &mut Mesh| &mut mesh.parts) {
            part.material += self.materials;
        }
        for instance in &mut scene.instances {
            instance.mesh += self.meshes;
            instance.materials.iter_mut().flatten().for_each(|m| *m += self.materials);
        }
        let moving = scene.animations.iter_mut().flat_map(|a| &mut a.materials).map(|m| &mut m.rest);
        for material in scene.materials.iter_mut().chain(moving) {
            material.textures_mut().into_iter().flatten().for_each(|t| t.texture += self.textures);
        }
        for (_, parameter) in scene.lights.iter_mut().flat_map(|light| light.kind.parameters()) {
            if let LightParameter::Picture(picture) = parameter {
                picture.texture += self.textures;
            }
        }
        for refinement in &mut scene.refinements {
            refinement.mesh += self.meshes;
            refinement.cage.materials.iter_mut().for_each(|material| *material += self.materials);
            if let Some(displacement) = &mut refinement.displacement {
                displacement.texture.texture += self.textures;
            }
        }
        scene.textures.iter_mut().for_each(|t| t.shift_references(self.images, self.textures));
        scene.animations.iter_mut().for_each(|animation| self.apply_to_animation(animation));
    }

    fn apply_to_animation(&self, animation: &mut Animation) {
        animation.instances.iter_mut().for_each(|i| i.instance += self.instances);
        animation.lights.iter_mut().for_each(|l| l.light += self.lights);
        animation.cameras.iter_mut().for_each(|c| c.camera += self.cameras);
        animation.materials.iter_mut().for_each(|m| m.material += self.materials);
        animation.deformations.iter_mut().for_each(|d| d.mesh += self.meshes);
        for keyed in &mut animation.keyed {
            match &mut keyed.object {
                KeyedObject::Instance(index) => *index += self.instances,
                KeyedObject::Camera(index) => *index += self.cameras,
            }
        }
    }
}

fn append<T>(all: &mut Vec<T>, added: Vec<T>) -> Range<usize> {
    let start = all.len();
    all.extend(added);
    start..all.len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Camera, ColorSpace, Image, Instance, Light, LightKind, Material, Pixels, Sampler, Shape, Texture,
        TextureRef,
    };

    /// A scene with one of everything, each referring to the one before.
    fn one_of_everything() -> Scene {
        let pixels = Pixels::Rgba8(vec![[0; 4]]);
        let mut textured = Material::default();
        for texture in textured.textures_mut() {
            *texture = Some(TextureRef::new(0));
        }
        let mut instance = Instance::new("i", 0, Affine3A::IDENTITY);
        instance.materials = Some(vec![0]);
        let kind = LightKind::Point { position: Vec3::ZERO, intensity: Vec3::ONE };
        Scene {
            meshes: vec![Mesh::single("m", Shape::Spheres(vec![]), 0)],
            instances: vec![instance],
            materials: vec![textured],
            textures: vec![Texture::image(0, Sampler::default(), ColorSpace::Srgb)],
            images: vec![Image { name: "p".into(), width: 1, height: 1, pixels }],
            lights: vec![Light::new("l", kind)],
            cameras: vec![Camera::perspective("c", Vec3::ZERO, Vec3::Z, 1.0)],
            ..Default::default()
        }
    }

    #[test]
    fn every_index_moves() {
        let mut scene = one_of_everything();
        let merged = scene.merge(one_of_everything());
        assert_eq!(merged.meshes, 1..2);
        assert_eq!(merged.cameras, 1..2);
        assert_eq!(scene.meshes[1].parts[0].material, 1);
        assert_eq!(scene.instances[1].mesh, 1);
        assert_eq!(scene.instances[1].materials, Some(vec![1]));
        assert_eq!(scene.textures[1].as_image().expect("an image").image, 1);
        let textures = scene.materials[1].textures_mut();
        assert!(textures.iter().all(|t| t.is_some_and(|t| t.texture == 1)));
        assert_eq!(scene.instances[0].mesh, 0, "the first scene is left alone");
    }
}
