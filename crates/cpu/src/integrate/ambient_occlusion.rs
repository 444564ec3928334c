//! The integrator `ao`: the share of the hemisphere above the first hit that is open, weighted by
//! the cosine; white is all of it (pbrt-v4, `AOIntegrator`). Where a camera ray hits nothing, the
//! picture is black.

use super::camera_rays::{CameraRays, Draws};
use crate::batch::samples::SampleId;
use crate::fetch::surface::Surface;
use accel::{HitFilter, Ray};
use backend::AmbientOcclusion;
use film::AovSample;
use optics::frame::{frame_from_normal, to_world};
use optics::warp::sample_cosine_hemisphere;
use optics::{Vec3f, vec2f, vec3f};

/// The picture of one sample, and its first hit.
pub(crate) fn sample<F: HitFilter>(
    rays: &mut CameraRays<F>,
    settings: &AmbientOcclusion,
    id: &SampleId,
) -> (Vec3f, AovSample) {
    let (ray, mut draws, weight) = rays.camera(id);
    let hit = rays.closest(&ray);
    let Some(first) = rays.first_hit(&ray, &hit) else {
        return (vec3f(0.0, 0.0, 0.0), AovSample::default());
    };
    let open = open_share(rays, settings, &first.surface, &mut draws);
    (vec3f(open, open, open) * weight, rays.aovs(&first))
}

/// The share of the rays into the hemisphere about the surface's horizon that meet nothing within
/// the settings' distance.
fn open_share<F: HitFilter>(
    rays: &mut CameraRays<F>,
    settings: &AmbientOcclusion,
    surface: &Surface,
    draws: &mut Draws,
) -> f32 {
    let frame = frame_from_normal(surface.horizon);
    let origin = surface.ray_origin(true).to_array();
    let count = settings.samples.max(1);
    let mut open = 0;
    for _ in 0..count {
        let u = draws.pair();
        let wi = to_world(frame, sample_cosine_hemisphere(vec2f(u[0], u[1])));
        let ray = Ray { origin, t_min: 0.0, direction: wi.to_array(), t_max: settings.distance };
        open += u32::from(rays.visible(&ray));
    }
    open as f32 / count as f32
}
