//! From a file's clips to an [`Animation`] of the scene that was made of the file.

use super::animations::{FileChannel, FileClip, FileTarget, NodeValue};
use super::document::Document;
use super::instances::{Job, Pose};
use super::json;
use super::materials::Materials;
use super::meshes::JobDeformation;
use super::motion::Motion;
use super::nodes::Hierarchy;
use super::textures::texture_motion;
use crate::animation::{
    AnimatedCamera, AnimatedInstance, AnimatedLight, AnimatedMaterial, Animation, Channel, Clip,
    DeformedPart, Rig, Skin, Target, TextureUse,
};
use crate::{LoadError, LoadReport, Material};
use glam::Vec3;
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

/// What was made of the file's objects, and where it is in the scene.
pub(super) struct Made<'m> {
    pub jobs: &'m [Job],
    /// The scene's mesh of each job, if it has anything to show.
    pub meshes: &'m [Option<u32>],
    /// Instances that move.
    pub instances: Vec<AnimatedInstance>,
    pub deformations: Vec<JobDeformation>,
    pub materials: &'m Materials,
    /// All cameras, each with its number in the file.
    pub cameras: Vec<(u32, AnimatedCamera)>,
    /// All lights, each with its number in the file.
    pub lights: Vec<(u32, AnimatedLight)>,
}

/// Numbers of the file's objects in the lists of the animation.
#[derive(Default)]
struct Numbers {
    /// By skin.
    skins: BTreeMap<u32, u32>,
    /// Lists of weights, by node.
    weights: BTreeMap<u32, u32>,
    /// By material.
    materials: BTreeMap<u32, u32>,
    /// By light; one may shine at several nodes.
    lights: HashMap<u32, Vec<u32>>,
    /// By camera.
    cameras: HashMap<u32, Vec<u32>>,
}

impl Document<'_> {
    /// The scene's animation; `None` if nothing in it moves.
    ///
    /// # Errors
    /// Broken skins.
    pub fn animation(
        &self,
        clips: &[FileClip],
        hierarchy: Hierarchy,
        motion: &Motion,
        made: Made<'_>,
        report: &mut LoadReport,
    ) -> Result<Option<Animation>, LoadError> {
        if clips.is_empty() {
            return Ok(None);
        }
        let mut numbers = Numbers::default();
        let mut rig = Rig {
            origin: hierarchy.origin,
            nodes: hierarchy.nodes,
            order: hierarchy.order,
            ..Rig::default()
        };
        let mut animation = Animation { instances: made.instances, ..Animation::default() };
        for part in made.deformations {
            let job = &made.jobs[part.job];
            let Some(mesh) = made.meshes[part.job] else { continue };
            let weights = Some(self.weight_list(job, &mut rig, &mut numbers));
            let skin = self.skin_of(job, &mut rig, &mut numbers)?.map(|skin| (skin, job.node));
            let deformation = Arc::new(part.deformation);
            animation.deformations.push(DeformedPart { mesh, part: part.part, deformation, weights, skin });
        }
        let targets = || clips.iter().flat_map(|clip| &clip.channels).map(|channel| channel.target);
        for (source, light) in made.lights {
            let targeted = || targets().any(|t| matches!(t, FileTarget::Light(l, _) if l == source));
            if motion.moves(light.node) || targeted() {
                numbers.lights.entry(source).or_default().push(animation.lights.len() as u32);
                animation.lights.push(light);
            }
        }
        for (source, camera) in made.cameras {
            let targeted = || targets().any(|t| matches!(t, FileTarget::Camera(c, _) if c == source));
            if motion.moves(camera.node) || targeted() {
                numbers.cameras.entry(source).or_default().push(animation.cameras.len() as u32);
                animation.cameras.push(camera);
            }
        }
        for target in targets() {
            let FileTarget::Material(source, _) = target else { continue };
            let Some(number) = made.materials.number(source) else { continue };
            let next = animation.materials.len() as u32;
            if *numbers.materials.entry(source).or_insert(next) == next {
                let rest = &made.materials.list[number as usize];
                let source = &self.json.materials[source as usize];
                animation.materials.push(animated_material(number, rest, source));
            }
        }
        let clips = clips.iter().map(|clip| self.clip(clip, &numbers)).filter(|c| !c.channels.is_empty());
        animation.clips = Arc::new(clips.collect());
        animation.rig = Arc::new(rig);
        note(&animation, report);
        Ok((!animation.clips.is_empty()).then_some(animation))
    }

    /// The list of weights of a job's node.
    fn weight_list(&self, job: &Job, rig: &mut Rig, numbers: &mut Numbers) -> u32 {
        *numbers.weights.entry(job.node).or_insert_with(|| {
            let mut weights = job.weights.to_vec();
            weights.resize(self.target_count(job.mesh), 0.0);
            rig.weights.push(weights);
            rig.weights.len() as u32 - 1
        })
    }

    /// The skin that moves a job's vertices into world space.
    fn skin_of(&self, job: &Job, rig: &mut Rig, numbers: &mut Numbers) -> Result<Option<u32>, LoadError> {
        let mut add = |skin: Skin| {
            rig.skins.push(skin);
            rig.skins.len() as u32 - 1
        };
        Ok(match job.pose {
            Pose::Rest => None,
            // The node itself moves what has no joints.
            Pose::Baked(_) => Some(add(Skin::default())),
            Pose::Skinned { skin, .. } => Some(match numbers.skins.get(&skin) {
                Some(known) => *known,
                None => {
                    let number = add(self.skin(skin)?);
                    numbers.skins.insert(skin, number);
                    number
                }
            }),
        })
    }

    fn clip(&self, clip: &FileClip, numbers: &Numbers) -> Clip {
        let mut channels = Vec::new();
        for FileChannel { target, track } in &clip.channels {
            for target in self.targets(*target, numbers) {
                channels.push(Channel { target, track: track.clone() });
            }
        }
        Clip { name: clip.name.clone(), channels }
    }

    /// What a target of the file is in the scene: nothing if it is not shown, several if it is there several times.
    fn targets(&self, target: FileTarget, numbers: &Numbers) -> Vec<Target> {
        let weights = |list: u32, one: Option<u32>| match one {
            None => Target::Weights(list),
            Some(one) => Target::Weight(list, one),
        };
        let all = |numbers: Option<&Vec<u32>>| numbers.cloned().unwrap_or_default();
        match target {
            FileTarget::Node(node, NodeValue::Translation) => vec![Target::Translation(node)],
            FileTarget::Node(node, NodeValue::Rotation) => vec![Target::Rotation(node)],
            FileTarget::Node(node, NodeValue::Scale) => vec![Target::Scale(node)],
            FileTarget::Node(node, NodeValue::Visible) => vec![Target::Visible(node)],
            FileTarget::Node(node, NodeValue::Weights(one)) => {
                numbers.weights.get(&node).map(|list| weights(*list, one)).into_iter().collect()
            }
            FileTarget::Mesh(mesh, one) => {
                let uses = |node: &u32| {
                    let node = &self.json.nodes[*node as usize];
                    node.mesh == Some(mesh) && node.weights.is_none()
                };
                numbers.weights.iter().filter(|(node, _)| uses(node)).map(|(_, l)| weights(*l, one)).collect()
            }
            FileTarget::Material(material, value) => {
                let number = numbers.materials.get(&material);
                number.map(|number| Target::Material(*number, value)).into_iter().collect()
            }
            FileTarget::Light(light, value) => {
                all(numbers.lights.get(&light)).into_iter().map(|l| Target::Light(l, value)).collect()
            }
            FileTarget::Camera(camera, value) => {
                all(numbers.cameras.get(&camera)).into_iter().map(|c| Target::Camera(c, value)).collect()
            }
        }
    }
}

fn animated_material(material: u32, rest: &Material, source: &json::Material) -> AnimatedMaterial {
    let pbr = source.pbr_metallic_roughness.as_ref();
    let textures = TextureUse::ALL.map(|texture| {
        let info = match texture {
            TextureUse::BaseColor => pbr.and_then(|p| p.base_color_texture.as_ref()),
            TextureUse::MetallicRoughness => pbr.and_then(|p| p.metallic_roughness_texture.as_ref()),
            TextureUse::Normal => source.normal_texture.as_ref(),
            TextureUse::Emission => source.emissive_texture.as_ref(),
            TextureUse::Transmission => {
                let transmission = source.extensions.transmission.as_ref();
                transmission.and_then(|t| t.transmission_texture.as_ref())
            }
        };
        texture_motion(info.and_then(|i| i.extensions.transform.as_ref()))
    });
    let strength = source.extensions.emissive_strength.as_ref().and_then(|e| e.emissive_strength);
    AnimatedMaterial {
        material,
        rest: rest.clone(),
        emissive_factor: Vec3::from(source.emissive_factor.unwrap_or_default()),
        emissive_strength: strength.unwrap_or(1.0),
        textures,
    }
}

/// Says what can be played.
fn note(animation: &Animation, report: &mut LoadReport) {
    const NAMED: usize = 8;
    let clips = &animation.clips;
    let name = |(index, clip): (usize, &Clip)| {
        let name = if clip.name.is_empty() { format!("number {index}") } else { format!("`{}`", clip.name) };
        format!("{name} ({:.2} s)", clip.end())
    };
    let names: Vec<String> = clips.iter().enumerate().take(NAMED).map(name).collect();
    let more = clips.len().saturating_sub(NAMED);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    match clips.len() {
        0 => {}
        1 => report.info(format!("the animation {} can be played", names.join(""))),
        _ => report.info(format!(
            "the animations {}{more} can be played, one at a time; the first unless another is chosen",
            names.join(", ")
        )),
    }
}
