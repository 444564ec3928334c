//! The integrator `aov`, which stops at the first hit: the surface's colour under a light at the
//! camera.

use super::camera_rays::CameraRays;
use crate::batch::samples::SampleId;
use crate::scene::vec3;
use crate::shade::aov::headlight;
use crate::shade::lights::distant_radiance;
use accel::HitFilter;
use film::AovSample;
use optics::Vec3f;

/// The picture of one sample, and its first hit.
pub(crate) fn sample<F: HitFilter>(rays: &mut CameraRays<F>, id: &SampleId) -> (Vec3f, AovSample) {
    let (ray, _, weight) = rays.camera(id);
    let hit = rays.closest(&ray);
    let Some(first) = rays.first_hit(&ray, &hit) else {
        return (distant_radiance(rays.scene, vec3(ray.direction), rays.time) * weight, AovSample::default());
    };
    let tables = &*rays.scene.tables;
    let material = &tables.materials[first.surface.material as usize];
    (headlight(tables, material, &first.surface, first.footprint), rays.aovs(&first))
}
