//! Movement over time: clips of keyframes that move nodes, joints, vertices, materials, lights and cameras.
//!
//! A loader describes what may move as an [`Animation`]: a [`Rig`] of nodes, what the nodes carry, and the [`Clip`]s.
//! [`crate::Scene::set_time`] then writes the scene as it is at a moment. It changes transforms, vertices and values only,
//! so that renderers need neither new textures nor new topology.

pub mod decompose;
mod deformation;
mod keyed;
mod moment;
mod objects;
mod open_shutter;
mod rig;
mod scene_motion;
mod track;

pub use deformation::{Deformation, Influence, Influences, Joints, MorphTarget};
pub use keyed::{Keyed, KeyedError, KeyedObject};
pub use moment::{Moment, frame_time};
pub use objects::{
    AnimatedCamera, AnimatedInstance, AnimatedLight, AnimatedMaterial, CameraValue, LightValue,
    MaterialValue, Punctual, PunctualKind, TextureMotion, TextureUse, view_of,
};
pub use rig::{Node, NodePose, Rig, Skin};
pub use scene_motion::SceneMotion;
pub use track::{Interpolation, Track, TrackError};

use crate::{MeshId, Photometry, Scene, Shape};
use glam::{DAffine3, Vec3};
use std::sync::Arc;

/// What a channel moves. Indices are into the rig or the lists of the [`Animation`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// Position of a node: three numbers.
    Translation(u32),
    /// Rotation of a node: a quaternion.
    Rotation(u32),
    /// Scale of a node: three numbers.
    Scale(u32),
    /// Whether a node is shown: one number, 0 is hidden.
    Visible(u32),
    /// All weights of a list of [`Rig::weights`].
    Weights(u32),
    /// One weight: the list, and which of its weights.
    Weight(u32, u32),
    /// A value of a material.
    Material(u32, MaterialValue),
    /// A value of a light.
    Light(u32, LightValue),
    /// A value of a camera.
    Camera(u32, CameraValue),
}

/// A track and what it moves.
#[derive(Clone, Debug)]
pub struct Channel {
    /// What is moved.
    pub target: Target,
    /// By which values. As wide as the target.
    pub track: Arc<Track>,
}

/// Movements that are played together.
#[derive(Clone, Debug, Default)]
pub struct Clip {
    /// Name from the file; may be empty.
    pub name: String,
    /// Its channels. Where two have the same target, the later one counts.
    pub channels: Vec<Channel>,
}

impl Clip {
    /// The moment of the last key, seconds.
    pub fn end(&self) -> f32 {
        self.channels.iter().map(|c| c.track.end()).fold(0.0, f32::max)
    }
}

/// Vertices that move against each other.
#[derive(Clone, Debug)]
pub struct DeformedPart {
    /// The mesh.
    pub mesh: MeshId,
    /// Index of the part.
    pub part: u32,
    /// How its vertices move.
    pub deformation: Arc<Deformation>,
    /// Which list of [`Rig::weights`] weighs its morph targets.
    pub weights: Option<u32>,
    /// Which of [`Rig::skins`] moves it, and the node for what has no joints.
    pub skin: Option<(u32, u32)>,
}

/// Everything of a file that moves.
#[derive(Clone, Debug, Default)]
pub struct Animation {
    /// What can be played, one at a time.
    pub clips: Arc<Vec<Clip>>,
    /// Index of the clip that [`Scene::set_time`] plays.
    pub playing: usize,
    /// Starts again after the end, instead of holding the last pose.
    pub repeat: bool,
    /// The nodes at rest.
    pub rig: Arc<Rig>,
    /// Instances that nodes carry.
    pub instances: Vec<AnimatedInstance>,
    /// Cameras that nodes carry.
    pub cameras: Vec<AnimatedCamera>,
    /// Lights that nodes carry.
    pub lights: Vec<AnimatedLight>,
    /// Materials whose values change.
    pub materials: Vec<AnimatedMaterial>,
    /// Meshes that change their shape.
    pub deformations: Vec<DeformedPart>,
    /// Transforms of what no node carries.
    pub keyed: Vec<Keyed>,
}

/// Everything that channels change, at one moment.
struct Pose {
    nodes: Vec<Node>,
    weights: Vec<Vec<f32>>,
    cameras: Vec<AnimatedCamera>,
    lights: Vec<AnimatedLight>,
    materials: Vec<AnimatedMaterial>,
}

impl Animation {
    /// Seconds from the start of the playing clip to its last key.
    pub fn duration(&self) -> f32 {
        let clip = self.clips.get(self.playing).map_or(0.0, Clip::end);
        self.keyed.iter().map(Keyed::end).fold(clip, f32::max)
    }

    /// The time of the clip at `time` seconds.
    fn wrapped(&self, time: f32) -> f32 {
        let duration = self.duration();
        if self.repeat && duration > 0.0 { time.rem_euclid(duration) } else { time }
    }

    /// Writes the scene as it is `time` seconds after the start of the playing clip.
    fn apply(&self, time: f32, scene: &mut Scene) {
        let (pose, placed) = self.place(time, scene);
        for material in pose.materials {
            if let Some(own) = scene.materials.get_mut(material.material as usize) {
                *own = material.rest;
            }
        }
        self.deform(&placed, &pose.weights, scene);
    }

    /// Puts instances, cameras and lights where they are; returns everything that there is to know
    /// of the moment.
    fn place(&self, time: f32, scene: &mut Scene) -> (Pose, Vec<NodePose>) {
        let time = self.wrapped(time);
        let pose = self.pose(time);
        let placed = self.rig.place(&pose.nodes);
        self.place_instances(&placed, scene);
        self.keyed.iter().for_each(|keyed| Self::place_keyed(keyed, time, scene));
        for camera in &pose.cameras {
            if let Some(own) = scene.cameras.get_mut(camera.camera as usize) {
                let shift = DAffine3::from_translation(self.rig.origin - scene.origin);
                camera.place(&(shift * placed[camera.node as usize].world), own);
            }
        }
        for light in &pose.lights {
            let Some(own) = scene.lights.get_mut(light.light as usize) else { continue };
            let NodePose { world, visible } = placed[light.node as usize];
            // A hidden light stays in its place in the lists, without strength.
            let intensity = if visible { light.source.intensity } else { 0.0 };
            let world = light.root * world;
            if let Some(kind) = (Punctual { intensity, ..light.source }).at(&world) {
                own.kind = kind;
                let profile = own.profile.take();
                own.profile = profile.map(|p| Photometry::at_node(p.profile, &world));
            }
        }
        (pose, placed)
    }

    fn pose(&self, time: f32) -> Pose {
        let mut pose = Pose {
            nodes: self.rig.nodes.clone(),
            weights: self.rig.weights.clone(),
            cameras: self.cameras.clone(),
            lights: self.lights.clone(),
            materials: self.materials.clone(),
        };
        let mut numbers = Vec::new();
        for channel in self.clips.get(self.playing).map(|c| &c.channels[..]).unwrap_or_default() {
            if let Target::Rotation(node) = channel.target {
                pose.nodes[node as usize].rotation = channel.track.sample_rotation(time).as_dquat();
                continue;
            }
            numbers.resize(channel.track.width(), 0.0);
            channel.track.sample(time, &mut numbers);
            pose.set(channel.target, &numbers);
        }
        pose
    }

    /// Puts what a transform at moments moves where it is at `time` seconds.
    fn place_keyed(keyed: &Keyed, time: f32, scene: &mut Scene) {
        let transform = keyed.at(time);
        match keyed.object {
            KeyedObject::Instance(index) => {
                if let Some(instance) = scene.instances.get_mut(index as usize) {
                    (instance.transform, instance.dynamic) = (transform, true);
                }
            }
            KeyedObject::Camera(index) => {
                let world = DAffine3 {
                    matrix3: glam::Mat3::from(transform.matrix3).as_dmat3(),
                    translation: Vec3::from(transform.translation).as_dvec3(),
                };
                let camera = scene.cameras.get_mut(index as usize);
                if let Some((camera, (eye, forward, up))) = camera.zip(view_of(&world)) {
                    (camera.eye, camera.target, camera.up) = (eye, eye + forward, up);
                }
            }
        }
    }

    /// Instances stand where their nodes are, and can be moved without building structures anew.
    fn place_instances(&self, placed: &[NodePose], scene: &mut Scene) {
        for bound in &self.instances {
            let Some(instance) = scene.instances.get_mut(bound.instance as usize) else { continue };
            let node = placed[bound.node as usize];
            let local = bound.local.map_or(DAffine3::IDENTITY, |local| node.world * local);
            let transform = (bound.root * local).as_affine3a();
            if transform.is_finite() {
                instance.transform = transform;
            }
            instance.visible = node.visible && !bound.hidden;
            instance.dynamic = true;
        }
    }

    fn deform(&self, placed: &[NodePose], weights: &[Vec<f32>], scene: &mut Scene) {
        for part in &self.deformations {
            let mesh = scene.meshes.get_mut(part.mesh as usize);
            let shape = mesh.and_then(|m| m.parts.get_mut(part.part as usize)).map(|p| &mut p.shape);
            let Some(Shape::Triangles(mesh)) = shape else { continue };
            let weights = part.weights.map_or(&[][..], |w| &weights[w as usize]);
            let world = |node: u32| placed[node as usize].world;
            let skin =
                part.skin.map(|(skin, node)| (self.rig.skins[skin as usize].matrices(world), world(node)));
            let unmoved = self.rig.root();
            let joints = skin.as_ref().map(|(matrices, node)| Joints { matrices, node: *node, unmoved });
            part.deformation.apply(weights, joints, mesh);
        }
    }
}

impl Pose {
    fn set(&mut self, target: Target, numbers: &[f32]) {
        let vector = || Vec3::from_slice(numbers).as_dvec3();
        match target {
            Target::Translation(node) => self.nodes[node as usize].translation = vector(),
            Target::Scale(node) => self.nodes[node as usize].scale = vector(),
            Target::Visible(node) => self.nodes[node as usize].visible = numbers[0] != 0.0,
            Target::Weights(list) => self.weights[list as usize].copy_from_slice(numbers),
            Target::Weight(list, weight) => self.weights[list as usize][weight as usize] = numbers[0],
            // What a scene leaves out of a file that it includes is not in the lists.
            Target::Material(material, value) => {
                self.materials.get_mut(material as usize).into_iter().for_each(|m| m.set(value, numbers));
            }
            Target::Light(light, value) => {
                self.lights.get_mut(light as usize).into_iter().for_each(|l| l.source.set(value, numbers));
            }
            Target::Camera(camera, value) => {
                self.cameras.get_mut(camera as usize).into_iter().for_each(|c| c.set(value, numbers[0]));
            }
            Target::Rotation(_) => {} // sampled as a rotation, not as numbers
        }
    }
}

impl Scene {
    /// Whether [`Scene::set_time`] has an effect.
    pub fn is_animated(&self) -> bool {
        !self.animations.is_empty()
    }

    /// Seconds until the last of the playing clips has ended; 0 without animations.
    pub fn duration(&self) -> f32 {
        self.animations.iter().map(Animation::duration).fold(0.0, f32::max)
    }

    /// Brings everything that is animated to where it is at `time` seconds. What moves becomes
    /// [`crate::Instance::dynamic`]. Cameras with a [`crate::CameraPath`] follow
    /// [`crate::Camera::at`] instead. It is an instant: nothing moves meanwhile, see
    /// [`Scene::open_shutter`].
    pub fn set_time(&mut self, time: f32) {
        self.motion = None;
        self.cameras.iter_mut().for_each(|camera| camera.keys.clear());
        let animations = std::mem::take(&mut self.animations);
        animations.iter().for_each(|animation| animation.apply(time, self));
        self.animations = animations;
    }

    /// Plays another clip of every animation that has it, by its name or, without such a name, its number. Returns
    /// whether any has it.
    pub fn play(&mut self, clip: &str) -> bool {
        let mut found = false;
        for animation in &mut self.animations {
            let named = animation.clips.iter().position(|c| c.name == clip);
            let number = || clip.parse().ok().filter(|n| *n < animation.clips.len());
            if let Some(index) = named.or_else(number) {
                (animation.playing, found) = (index, true);
            }
        }
        found
    }
}
