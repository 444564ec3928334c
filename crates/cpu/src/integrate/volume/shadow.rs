//! What is left of light on its way through media and their boundaries.

use super::interiors::{Segment, crossed, passes, segment};
use super::{BLACK, VolumeTracer};
use crate::fetch::surface::Surface;
use accel::Ray;
use optics::interiors::Interiors;
use optics::medium::transmittance;
use optics::vector::dot;
use optics::volume::{MOST_CROSSINGS, medium_extinction};
use optics::{Vec3f, vec3f};
use scene::tables::NONE;

impl VolumeTracer<'_> {
    /// The transmittance of a shadow ray, all of it; black if a surface is in the way.
    ///
    /// - `inside`: what the ray's origin is in. `stream`: state of a stream of numbers for media whose density varies.
    pub(super) fn visibility(
        &mut self,
        mut ray: Ray,
        time: f32,
        mut inside: Interiors,
        stream: &mut u32,
    ) -> Vec3f {
        let mut left = vec3f(1.0, 1.0, 1.0);
        for _ in 0..MOST_CROSSINGS {
            let hit = self.closest(&ray, time);
            let surface = (!hit.is_miss()).then(|| Surface::new(self.scene, &ray, &hit, time));
            let end = if hit.is_miss() { ray.t_max } else { hit.t };
            if surface.as_ref().is_some_and(|s| !passes(&self.scene.tables, s, inside)) {
                return BLACK;
            }
            if let Some(segment) = segment(inside, &self.scene.tables, &ray, end, surface.as_ref()) {
                left *= self.segment_transmittance(&ray, &segment, stream);
            }
            let Some(surface) = surface else { return left };
            if left.x + left.y + left.z <= 0.0 {
                return BLACK;
            }
            inside = crossed(inside, &self.scene.tables, &surface);
            let origin = surface.ray_origin(false);
            let way = dot(origin - super::vec3(ray.origin), super::vec3(ray.direction));
            ray.origin = origin.to_array();
            ray.t_max -= way;
        }
        BLACK
    }

    /// The transmittance of a part of a ray. `stream`: as for [`VolumeTracer::visibility`].
    pub(super) fn segment_transmittance(&self, ray: &Ray, segment: &Segment, stream: &mut u32) -> Vec3f {
        if segment.grid != NONE {
            return self.ratio_track(ray, segment, stream);
        }
        transmittance(medium_extinction(segment.medium), segment.end - segment.start)
    }
}
