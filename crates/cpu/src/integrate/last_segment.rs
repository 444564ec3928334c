//! The last segments of paths.
//!
//! Of a path's last segment nothing counts but light at its end. Where no surface that shines can be there, the segment is a shadow
//! ray to what is infinitely far away: a question that is cheaper than what the nearest surface is, and not asked at all where
//! the sky is black.

use crate::batch::streams::Connection;
use crate::scene::{CpuScene, vec3};
use crate::shade::lights::for_each_distant;
use crate::shade::path_batch::{Context, PathBatch};
use accel::{HitFilter, Ray};
use optics::intersect::{intersect_box, inverse_direction};
use optics::path::path_add_emission;
use optics::vec3f;

impl PathBatch {
    /// Leaves those paths of the batch, which are on their last segments, that may meet a surface that shines. The others gather
    /// what distant light they find, and end.
    #[inline(always)]
    pub(crate) fn follow_into_the_sky<F: HitFilter>(&mut self, context: &Context, filter: &F) {
        let scene = context.scene;
        let mut left = 0;
        for at in 0..self.paths.len() {
            let (ray, path) = (self.paths.ray(at), self.paths.path(at));
            if may_meet_emitter(scene, &ray) {
                self.paths.set(left, vec3(ray.origin), vec3(ray.direction), &path);
                left += 1;
                continue;
            }
            let mut contribution = vec3f(0.0, 0.0, 0.0);
            let (normal, time) = (path.sampling_normal, self.time_of(path.slot));
            for_each_distant(scene, vec3(ray.origin), normal, vec3(ray.direction), time, |d| {
                let state = path.state(context.depth);
                contribution += path_add_emission(state, d.radiance, d.pdf, context.mis()).radiance;
            });
            self.ask(Connection { slot: path.slot, contribution }, ray);
        }
        self.paths.truncate(left);
        self.connect(scene, filter);
    }
}

/// Whether a surface that shines may be in the way of a ray.
#[inline(always)]
pub(crate) fn may_meet_emitter(scene: &CpuScene, ray: &Ray) -> bool {
    let (origin, inverse) = (vec3(ray.origin), inverse_direction(vec3(ray.direction)));
    let meets = |[low, high]: &[[f32; 3]; 2]| {
        intersect_box(origin, inverse, vec3(*low), vec3(*high), 0.0, f32::INFINITY).hit
    };
    scene.tables.emitter_boxes.iter().any(meets)
}
