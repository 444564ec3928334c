//! What moves while the shutter is open.

use super::decompose::motion_near;
use super::scene_motion::SceneMotion;
use super::{Animation, NodePose};
use crate::camera::CameraKey;
use crate::{Camera, LightKind, Projection, Scene, Shutter};
use glam::{Affine3A, Mat3, Quat, Vec3};

/// Moments, and one more, at which the scene is looked at. A power of two: see [`motion_near`].
const MOMENTS: usize = 16;

/// Where everything is at one moment.
struct Sample {
    instances: Vec<Affine3A>,
    lights: Vec<LightKind>,
    cameras: Vec<Camera>,
}

impl Scene {
    /// Opens the shutter around the moment `time`, in seconds: brings the scene to the middle of
    /// the time that it is open ([`Shutter::moment`] 0.5), and finds out how instances, lights and
    /// cameras move meanwhile, for [`crate::tables::SceneTables::build`]. An instant is
    /// [`Scene::set_time`].
    ///
    /// Meshes that deform, materials, strengths of lights and what is shown or hidden stay as they
    /// are in the middle; see [`SceneMotion::held`].
    pub fn open_shutter(&mut self, time: f32, shutter: &Shutter) {
        let animations = std::mem::take(&mut self.animations);
        let moment = |share: f32| time + shutter.moment(share);
        let samples: Vec<Sample> = (0..=MOMENTS)
            .map(|i| {
                let time = moment(i as f32 / MOMENTS as f32);
                for animation in &animations {
                    animation.place(time, self);
                }
                Sample {
                    instances: self.instances.iter().map(|instance| instance.transform).collect(),
                    lights: self.lights.iter().map(|light| light.kind).collect(),
                    cameras: self.cameras.clone(),
                }
            })
            .collect();
        let held = held(&animations, moment(0.0), moment(1.0), self);
        self.animations = animations;
        self.set_time(moment(0.5));
        if shutter.timing().is_none() {
            return;
        }
        let mut motion = SceneMotion { held, ..SceneMotion::default() };
        for index in 0..self.instances.len() {
            let keys: Vec<_> = samples.iter().map(|sample| sample.instances[index]).collect();
            if let Some(found) = motion_near(&keys) {
                motion.instances.insert(index as u32, found);
                self.instances[index].dynamic = true;
            }
        }
        for index in 0..self.lights.len() {
            let kinds: Vec<_> = samples.iter().map(|sample| sample.lights[index]).collect();
            let turns = self.lights[index].profile.is_none();
            if let Some(found) = motion_near(&frames(&kinds, turns)) {
                motion.lights.insert(index as u32, found);
            }
        }
        for index in 0..self.cameras.len() {
            let cameras: Vec<_> = samples.iter().map(|sample| &sample.cameras[index]).collect();
            self.cameras[index].keys = camera_keys(&cameras);
        }
        let moves = !(motion.instances.is_empty() && motion.lights.is_empty());
        self.motion = (moves || !motion.held.is_empty()).then(|| std::sync::Arc::new(motion));
    }
}

/// Keys of a camera; none if it stands still.
fn camera_keys(cameras: &[&Camera]) -> Vec<CameraKey> {
    let zooms = cameras.windows(2).any(|pair| pair[0].projection != pair[1].projection);
    let projection = |camera: &Camera| -> Option<Projection> { zooms.then_some(camera.projection) };
    let key = |c: &&Camera| CameraKey { eye: c.eye, target: c.target, up: c.up, projection: projection(c) };
    let keys: Vec<CameraKey> = cameras.iter().map(key).collect();
    if keys.windows(2).all(|pair| pair[0] == pair[1]) { Vec::new() } else { keys }
}

/// Spaces that a light carries along. `turns`: whether they turn as it does.
fn frames(kinds: &[LightKind], turns: bool) -> Vec<Affine3A> {
    let mut frame = Quat::IDENTITY;
    let mut last: Option<(Vec3, Vec3)> = None;
    let mut frames = Vec::with_capacity(kinds.len());
    for kind in kinds {
        let (position, aim) = match *kind {
            LightKind::Point { position, .. } => (position, None),
            LightKind::Spot { position, direction, .. } => (position, Some((direction, Vec3::ZERO))),
            LightKind::Projector { position, direction, up, .. } => (position, Some((direction, up))),
            LightKind::Directional { direction, .. } => (Vec3::ZERO, Some((direction, Vec3::ZERO))),
        };
        if let (Some(before), Some(now), true) = (last, aim, turns) {
            frame = (turn(before, now) * frame).normalize();
        }
        last = aim;
        frames.push(Affine3A::from_rotation_translation(frame, position));
    }
    frames
}

/// The rotation that takes a direction, and one across it if it is not zero, to others.
fn turn(before: (Vec3, Vec3), now: (Vec3, Vec3)) -> Quat {
    if before == now {
        return Quat::IDENTITY;
    }
    let axes = |(direction, up): (Vec3, Vec3)| {
        let aside = direction.cross(up).try_normalize()?;
        Some(Mat3::from_cols(aside, direction.cross(aside), direction))
    };
    match (axes(before), axes(now)) {
        (Some(a), Some(b)) => Quat::from_mat3(&(b * a.transpose())),
        _ => Quat::from_rotation_arc(before.0.normalize_or(Vec3::Z), now.0.normalize_or(Vec3::Z)),
    }
}

/// What changes between two moments but is held, for people.
fn held(animations: &[Animation], from: f32, to: f32, scene: &Scene) -> Vec<String> {
    let mut held = Vec::new();
    for animation in animations {
        let [before, after] = [from, to].map(|time| animation.pose(animation.wrapped(time)));
        let placed = [&before, &after].map(|pose| animation.rig.place(&pose.nodes));
        let moved = |node: u32| placed[0][node as usize].world != placed[1][node as usize].world;
        for part in &animation.deformations {
            let morphs =
                part.weights.is_some_and(|w| before.weights[w as usize] != after.weights[w as usize]);
            let skin = part.skin.map(|(skin, _)| &animation.rig.skins[skin as usize]);
            if morphs || skin.is_some_and(|skin| skin.joints.iter().any(|joint| moved(*joint))) {
                let name = scene.meshes.get(part.mesh as usize).map_or("", |mesh| &mesh.name);
                held.push(format!("the shape of mesh {name:?}"));
            }
        }
        for (a, b) in before.materials.iter().zip(&after.materials) {
            // Their text says every number exactly.
            if format!("{:?}", a.rest) != format!("{:?}", b.rest) {
                held.push(format!("material {:?}", a.rest.name));
            }
        }
        let shown = |pose: &[NodePose]| pose.iter().map(|node| node.visible).collect::<Vec<_>>();
        if shown(&placed[0]) != shown(&placed[1]) {
            held.push("which objects are shown".to_owned());
        }
        for (a, b) in before.lights.iter().zip(&after.lights) {
            let light = scene.lights.get(a.light as usize);
            if a.source != b.source {
                held.push(format!("the strength of light {:?}", light.map_or("", |l| &l.name)));
            }
            if moved(a.node) && light.is_some_and(|light| light.profile.is_some()) {
                held.push(format!(
                    "the direction of light {:?}, which has a profile",
                    light.map_or("", |l| &l.name)
                ));
            }
        }
    }
    held.sort();
    held.dedup();
    held
}
