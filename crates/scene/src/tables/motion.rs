//! From the motions of a scene to those of its tables, and where things are at a time.

use super::motion_table::{LightMotion, MotionRange, MotionTable};
use super::transform::affine;
use super::{InstanceRecord, LightRecord, SceneTables};
use crate::animation::SceneMotion;
use crate::animation::decompose::transform_of;
use glam::{Affine3A, Vec3};
use optics::constants::NONE;
use optics::light::{LIGHT_SPHERE, Light};
use optics::motion::{AffineRows, MOTION_MIDDLE, MotionSegment, affine_inverse, motion_at};
use optics::moving_light::moved_light;
use std::sync::Arc;

impl SceneTables {
    /// The instance at `time` in `[0, 1]` of the shutter; `None` if it stands still.
    #[inline]
    pub fn moved_instance(&self, index: u32, time: f32) -> Option<InstanceRecord> {
        let motion = self.motion.as_ref()?;
        let segments = motion.of(motion.instances[index as usize]);
        if segments.is_empty() {
            return None;
        }
        let object_to_world = AffineRows::of_motion(segments, time);
        Some(InstanceRecord {
            object_to_world: object_to_world.rows(),
            world_to_object: affine_inverse(object_to_world).rows(),
            ..self.instances[index as usize]
        })
    }

    /// Light `index` at `time` in `[0, 1]` of the shutter.
    #[inline]
    pub fn light_at(&self, index: u32, time: f32) -> Light {
        let light = self.lights[index as usize].light;
        let transform = self.motion.as_ref().and_then(|motion| motion.light_transform(index, time));
        transform.map_or(light, |transform| moved_light(light, transform))
    }

    /// As [`SceneTables::light_at`], with all that belongs to the light.
    #[inline]
    pub fn light_record_at(&self, index: u32, time: f32) -> LightRecord {
        let mut record = self.lights[index as usize];
        let Some(motion) = &self.motion else { return record };
        let Some(transform) = motion.light_transform(index, time) else { return record };
        record.light = moved_light(record.light, transform);
        if record.light.kind == LIGHT_SPHERE && record.textured_material != NONE {
            let to_object = AffineRows::of_motion(motion.of(motion.lights[index as usize].segments), time);
            let rows = affine_inverse(to_object).rows();
            record.texture_places[..12].copy_from_slice(rows.as_flattened());
        }
        record
    }

    /// Notes how the instances move, and puts them where they are in the middle. `scene`: what they
    /// were made of.
    pub(super) fn add_motion(&mut self, scene: &SceneMotion) {
        let mut table = MotionTable::default();
        let mut segments: Vec<MotionSegment> = Vec::new();
        for index in 0..self.instances.len() {
            let binding = self.instances[index].first_binding as usize;
            // A structure of parts in world space has none that moves.
            let found = scene.instances.get(&self.bindings[binding].object).filter(|found| !found.is_empty());
            table.instances.push(found.map_or(MotionRange::default(), |found| append(&mut segments, found)));
            if let Some(found) = found {
                let record = &mut self.instances[index];
                let middle = AffineRows::of_motion(found, MOTION_MIDDLE);
                record.object_to_world = middle.rows();
                record.world_to_object = affine_inverse(middle).rows();
                record.identity = false;
            }
        }
        table.segments = segments.into();
        self.motion = Some(Arc::new(table));
    }

    /// Notes how light sources of `scene` move, which are `lights` from `first` on.
    pub(super) fn add_light_motions(&mut self, scene: &SceneMotion, first: usize) {
        let Some(table) = self.motion.as_mut().map(Arc::make_mut) else { return };
        let mut segments = table.segments.to_vec();
        table.lights.resize(self.lights.len(), LightMotion::STILL);
        for (index, found) in scene.lights.iter().filter(|(_, found)| !found.is_empty()) {
            if let Some(light) = table.lights.get_mut(first + *index as usize) {
                let rest = affine_inverse(AffineRows::of_motion(found, MOTION_MIDDLE));
                *light = LightMotion { segments: append(&mut segments, found), rest };
            }
        }
        table.segments = segments.into();
    }

    /// Notes that the lights from `first` on move with an instance, if it does.
    pub(super) fn bind_lights(&mut self, instance: usize, first: usize) {
        let count = self.lights.len();
        let record = &self.instances[instance];
        let Some(table) = self.motion.as_mut().map(Arc::make_mut) else { return };
        table.lights.resize(first, LightMotion::STILL);
        let segments = table.instances[instance];
        let rest = AffineRows::from_rows(record.world_to_object);
        let motion = if segments.is_empty() { LightMotion::STILL } else { LightMotion { segments, rest } };
        table.lights.resize(count, motion);
    }

    /// The segments of an instance; none if it stands still.
    pub(super) fn instance_segments(&self, instance: usize) -> &[MotionSegment] {
        self.motion.as_ref().map_or(&[], |motion| motion.of(motion.instances[instance]))
    }

    /// Transforms that a motion passes, each with how far what they move strays from them at most,
    /// metres: it is between where neighbours take it. `low` and `high`: its corners in its own
    /// space.
    pub(super) fn poses(segments: &[MotionSegment], low: Vec3, high: Vec3) -> Vec<(Affine3A, f32)> {
        let far = low.abs().max(high.abs()).to_array();
        let mut poses = Vec::new();
        for segment in segments {
            let (pieces, room) = segment.pieces(far);
            let at = |piece: u32| affine(&motion_at(*segment, piece as f32 / pieces as f32).rows());
            poses.extend((0..=pieces).map(|piece| (at(piece), room)));
        }
        poses
    }
}

/// Appends segments; returns where they are.
fn append(all: &mut Vec<MotionSegment>, some: &[MotionSegment]) -> MotionRange {
    all.extend_from_slice(some);
    MotionRange { first: (all.len() - some.len()) as u32, count: some.len() as u32 }
}

impl SceneMotion {
    /// Where an instance is at the ends of its segments; empty if it stands still.
    pub(super) fn transforms(&self, instance: u32) -> Vec<Affine3A> {
        let segments = self.instances.get(&instance).map_or(&[][..], |segments| &segments[..]);
        let ends = segments.iter().flat_map(|s| [motion_at(*s, 0.0), motion_at(*s, 0.5), motion_at(*s, 1.0)]);
        ends.map(|rows| transform_of(&rows)).collect()
    }
}
