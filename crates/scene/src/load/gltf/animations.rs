//! Animations: channels and samplers to clips of keyframes, in the file's own numbers.
//!
//! A channel that cannot be played is left out with a note: the file's own pose is still right.

use super::accessor::{Integers, Pick};
use super::document::Document;
use super::json::{self, Kind};
use super::pointers;
use crate::animation::{CameraValue, Interpolation, LightValue, MaterialValue, Track};
use crate::{LoadError, LoadReport};
use std::sync::Arc;

/// Movements that are played together.
pub(super) struct FileClip {
    pub name: String,
    pub channels: Vec<FileChannel>,
}

/// A track and what it moves.
pub(super) struct FileChannel {
    pub target: FileTarget,
    pub track: Arc<Track>,
}

/// What a channel moves; indices are into the file's arrays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FileTarget {
    Node(u32, NodeValue),
    /// All weights of a mesh, or one, for nodes without weights of their own.
    Mesh(u32, Option<u32>),
    Material(u32, MaterialValue),
    Light(u32, LightValue),
    Camera(u32, CameraValue),
}

/// A value of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NodeValue {
    Translation,
    Rotation,
    Scale,
    Visible,
    /// All weights of the node's mesh, or one of them.
    Weights(Option<u32>),
}

impl Document<'_> {
    /// All animations of the file that can be played, in order.
    pub fn clips(&self, report: &mut LoadReport) -> Vec<FileClip> {
        let mut clips = Vec::new();
        for (index, animation) in self.json.animations.iter().enumerate() {
            let name = animation.name.clone().unwrap_or_default();
            let object = || format!("animation {index} `{name}`");
            let mut channels = Vec::new();
            for (number, channel) in animation.channels.iter().enumerate() {
                match self.channel(animation, channel) {
                    Ok(Some(channel)) => channels.push(channel),
                    Ok(None) => {} // the specification has channels without a target ignored
                    Err(reason) => {
                        report.ignored(format!("{}, channel {number}: {reason}: it is left out", object()));
                    }
                }
            }
            if !channels.is_empty() {
                clips.push(FileClip { name, channels });
            }
        }
        clips
    }

    fn channel(
        &self,
        animation: &json::Animation,
        channel: &json::Channel,
    ) -> Result<Option<FileChannel>, String> {
        let Some(target) = self.target_of(&channel.target)? else { return Ok(None) };
        let sampler = animation.samplers.get(channel.sampler as usize).ok_or("its sampler does not exist")?;
        let interpolation = match sampler.interpolation.as_deref() {
            None | Some("LINEAR") => Interpolation::Linear,
            Some("STEP") => Interpolation::Step,
            Some("CUBICSPLINE") => Interpolation::CubicSpline,
            Some(other) => return Err(format!("the interpolation {other} does not exist")),
        };
        let width = self.width_of(target);
        let read = |e: LoadError| e.to_string();
        let times = self
            .read::<1, [f32; 1]>(sampler.input, Kind::Scalar, Integers::AsDeclared, Pick::All)
            .map_err(read)?;
        let values = self.read_numbers(sampler.output).map_err(read)?;
        let times = times.as_flattened().to_vec();
        let track = Track::new(times, values, width, interpolation).map_err(|e| e.to_string())?;
        Ok(Some(FileChannel { target, track: Arc::new(track) }))
    }

    fn target_of(&self, target: &json::ChannelTarget) -> Result<Option<FileTarget>, String> {
        let found = if target.path == "pointer" {
            let pointer = target.extensions.pointer.as_ref().ok_or("it has no pointer")?;
            let pointer = &pointer.pointer;
            pointers::parse(pointer).ok_or_else(|| format!("the pointer {pointer} is not supported"))?
        } else {
            let Some(node) = target.node else { return Ok(None) };
            let value = match target.path.as_str() {
                "translation" => NodeValue::Translation,
                "rotation" => NodeValue::Rotation,
                "scale" => NodeValue::Scale,
                "weights" => NodeValue::Weights(None),
                other => return Err(format!("the path {other} does not exist")),
            };
            FileTarget::Node(node, value)
        };
        self.check_target(found)?;
        Ok(Some(found))
    }

    fn check_target(&self, target: FileTarget) -> Result<(), String> {
        let missing = |what: &str, index: u32| Err(format!("{what} {index} does not exist"));
        let json = &self.json;
        let lights = json.extensions.lights.as_ref().map_or(0, |l| l.lights.len());
        match target {
            FileTarget::Node(index, value) => {
                let Some(node) = json.nodes.get(index as usize) else { return missing("node", index) };
                let weights = matches!(value, NodeValue::Weights(_));
                if node.matrix.is_some() && !weights && value != NodeValue::Visible {
                    return Err(format!("node {index} has a matrix and cannot be moved"));
                }
                let one = if let NodeValue::Weights(one) = value { one } else { None };
                if weights
                    && self.width_of(FileTarget::Node(index, NodeValue::Weights(None)))
                        <= one.unwrap_or(0) as usize
                {
                    return Err(format!("node {index} has no such morph target"));
                }
            }
            FileTarget::Mesh(index, one) => {
                if self.target_count(index) <= one.unwrap_or(0) as usize {
                    return Err(format!("mesh {index} has no such morph target"));
                }
            }
            FileTarget::Material(index, _) if index as usize >= json.materials.len() => {
                return missing("material", index);
            }
            FileTarget::Light(index, _) if index as usize >= lights => return missing("light", index),
            FileTarget::Camera(index, _) if index as usize >= json.cameras.len() => {
                return missing("camera", index);
            }
            FileTarget::Material(..) | FileTarget::Light(..) | FileTarget::Camera(..) => {}
        }
        Ok(())
    }

    /// How many numbers a target's value has.
    fn width_of(&self, target: FileTarget) -> usize {
        match target {
            FileTarget::Node(_, NodeValue::Translation | NodeValue::Scale) => 3,
            FileTarget::Node(_, NodeValue::Rotation) => 4,
            FileTarget::Node(_, NodeValue::Visible) => 1,
            FileTarget::Node(_, NodeValue::Weights(Some(_))) | FileTarget::Mesh(_, Some(_)) => 1,
            FileTarget::Node(node, NodeValue::Weights(None)) => {
                let mesh = self.json.nodes.get(node as usize).and_then(|n| n.mesh);
                mesh.map_or(0, |mesh| self.target_count(mesh))
            }
            FileTarget::Mesh(mesh, None) => self.target_count(mesh),
            FileTarget::Material(_, value) => value.width(),
            FileTarget::Light(_, value) => value.width(),
            FileTarget::Camera(..) => 1,
        }
    }

    /// The number of a mesh's morph targets.
    pub fn target_count(&self, mesh: u32) -> usize {
        let mesh = self.json.meshes.get(mesh as usize);
        let counts = mesh.into_iter().flat_map(|m| m.primitives.iter()).map(|p| p.targets.len());
        counts.max().unwrap_or(0)
    }

    /// All numbers of an accessor of any vector type, one element after the other.
    fn read_numbers(&self, accessor: u32) -> Result<Vec<f32>, LoadError> {
        let declared = Integers::AsDeclared;
        Ok(match self.accessor_kind(accessor)? {
            Kind::Vec2 => {
                self.read::<2, [f32; 2]>(accessor, Kind::Vec2, declared, Pick::All)?.into_flattened()
            }
            Kind::Vec3 => {
                self.read::<3, [f32; 3]>(accessor, Kind::Vec3, declared, Pick::All)?.into_flattened()
            }
            Kind::Vec4 => {
                self.read::<4, [f32; 4]>(accessor, Kind::Vec4, declared, Pick::All)?.into_flattened()
            }
            Kind::Scalar | Kind::Mat2 | Kind::Mat3 | Kind::Mat4 | Kind::Unknown => {
                self.read::<1, [f32; 1]>(accessor, Kind::Scalar, declared, Pick::All)?.into_flattened()
            }
        })
    }
}
