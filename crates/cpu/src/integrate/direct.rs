//! The fixed-cost renderer: direct light with shadows, reflection, refraction and ambient occlusion; no global
//! illumination.
//!
//! At the first hit every light gets a fixed number of shadow rays, the lobes that are not diffuse a fixed number of
//! reflection rays, and the environment, as ambient light on the diffuse lobes, a fixed number of occlusion rays. What
//! reflection rays see is lit with one shadow ray a light. Mirrors and glass are followed until the depth is used up.

use super::camera_rays::{CameraRays, Draws};
use crate::batch::samples::SampleId;
use crate::fetch::surface::Surface;
use crate::scene::{CpuScene, vec3};
use crate::shade::closures::{Incoming, closure_at};
use crate::shade::lights::{distant_radiance, sample_one_light};
use crate::shade::material::emission;
use crate::shade::scatter::shadow_ray;
use accel::{Hit, HitFilter, Ray};
use backend::{DirectSettings, Highlights};
use film::AovSample;
use optics::closure::{
    Closure, closure_diffuse_albedo, closure_diffuse_albedo_below, closure_eval, closure_has_smooth_part,
    closure_is_interface, closure_phong_eval, closure_reflects, closure_sample, closure_scatters,
    closure_transmits, closure_without_diffuse,
};
use optics::direct_light::direct_contribution;
use optics::frame::{Frame, to_local, to_world};
use optics::light::{LIGHT_ENVIRONMENT, Light, LightSample, flat_light_is_above, light_is_flat};
use optics::vector::dot;
use optics::vertex::{leaves_surface, light_side};
use optics::warp::sample_cosine_hemisphere;
use optics::{Vec3f, vec2f, vec3f};
use scene::tables::SceneTables;

const BLACK: Vec3f = vec3f(0.0, 0.0, 0.0);

/// What a ray may see.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Sees {
    All,
    /// After a lobe for which lights were sampled already, what they are sampled on is black: surfaces that shine, and
    /// the sun.
    NoLight,
}

/// A path through mirrors, gloss and glass, at its next ray.
#[derive(Clone, Copy)]
struct Way {
    /// Length of the path before the ray, metres.
    length: f32,
    /// Segments, with that of the ray.
    depth: u32,
    sees: Sees,
    /// Whether the ray's vertex gets the whole number of rays, as all do that the camera sees directly, in mirrors or
    /// in polished glass.
    full: bool,
    /// Of the path before the ray; layers that disperse light depend on it.
    throughput: Vec3f,
}

impl Way {
    fn of_camera() -> Self {
        Self { length: 0.0, depth: 1, sees: Sees::All, full: true, throughput: vec3f(1.0, 1.0, 1.0) }
    }
}

/// The picture of one sample, and its first hit.
pub(crate) fn sample<F: HitFilter>(
    rays: &mut CameraRays<F>,
    settings: &DirectSettings,
    id: &SampleId,
) -> (Vec3f, AovSample) {
    let (ray, mut draws, weight) = rays.camera(id);
    let hit = rays.closest(&ray);
    let aovs = rays.first_hit(&ray, &hit).map_or_else(AovSample::default, |first| rays.aovs(&first));
    let mut tracer = DirectTracer { scene: rays.scene, rays, settings };
    (tracer.radiance(&ray, &hit, Way::of_camera(), &mut draws) * weight, aovs)
}

/// Follows the rays of a sample, a fixed number of them.
struct DirectTracer<'a, 'b, F> {
    scene: &'b CpuScene,
    rays: &'a mut CameraRays<'b, F>,
    settings: &'a DirectSettings,
}

impl<F: HitFilter> DirectTracer<'_, '_, F> {
    /// Radiance back along a ray.
    fn radiance(&mut self, ray: &Ray, hit: &Hit, way: Way, draws: &mut Draws) -> Vec3f {
        if hit.is_miss() {
            let wi = vec3(ray.direction);
            return match way.sees {
                Sees::All => distant_radiance(self.scene, wi, self.rays.time),
                Sees::NoLight => self.scene.tables.environment.radiance(wi),
            };
        }
        let surface = Surface::new(self.scene, ray, hit, self.rays.time);
        if way.sees == Sees::NoLight && surface.light != scene::tables::NONE {
            return BLACK;
        }
        let tables: &SceneTables = &self.scene.tables;
        let material = &tables.materials[surface.material as usize];
        let way = Way { length: way.length + hit.t, ..way };
        let footprint = self.rays.shading.pixel_spread * way.length;
        let [u_model, u_lobe] = draws.pair();
        let mut sum = emission(tables, material, &surface, footprint);
        let incoming = Incoming { footprint, ior: material.ior, throughput: way.throughput, u_model };
        let closure = closure_at(tables, material, &surface, &self.rays.shading, incoming);
        if !closure_scatters(closure) {
            return sum;
        }
        if closure_has_smooth_part(closure) {
            sum += self.direct_light(&surface, &closure, way.full, draws);
        }
        sum += self.ambient(&surface, &closure, way.full, draws);
        let deep = way.depth >= self.settings.max_depth;
        let others = closure_without_diffuse(closure);
        if closure_is_interface(closure) {
            if !deep {
                let u = draws.pair();
                sum += self.follow(&surface, &others, way, u_lobe, u, draws);
            }
        } else if way.full && !deep && closure_reflects(closure) {
            sum += self.reflections(&surface, &others, way, draws);
        }
        sum
    }

    /// Every light with its shadow rays.
    fn direct_light(&mut self, surface: &Surface, closure: &Closure, full: bool, draws: &mut Draws) -> Vec3f {
        let wo = to_local(closure.frame, surface.wo);
        let mut sum = BLACK;
        for index in 0..self.scene.tables.lights.len() as u32 {
            let light = self.scene.tables.light_at(index, self.rays.time);
            // The environment is ambient light here.
            if light.kind == LIGHT_ENVIRONMENT || !may_light(light, surface) {
                continue;
            }
            let extended = light.size > 0.0 || light_is_flat(light.kind);
            let soft = extended && self.settings.soft_shadows;
            let count = if soft && full { self.settings.shadow_samples.max(1) } else { 1 };
            for _ in 0..count {
                let u = if soft { draws.pair() } else { [0.5, 0.5] };
                let sample = sample_one_light(self.scene, index, surface.origin, u, self.rays.time);
                sum += self.light_sample(surface, closure, wo, &sample) * (1.0 / count as f32);
            }
        }
        sum
    }

    fn light_sample(
        &mut self,
        surface: &Surface,
        closure: &Closure,
        wo: Vec3f,
        light: &LightSample,
    ) -> Vec3f {
        let transmits = closure_transmits(*closure);
        let side = light_side(light.wi, light.pdf, closure.frame, surface.horizon, transmits);
        if !side.possible {
            return BLACK;
        }
        let value_cos = match self.settings.highlights {
            Highlights::Phong => closure_phong_eval(*closure, wo, side.wi),
            Highlights::Microfacets => closure_eval(*closure, wo, side.wi).value_cos,
        };
        let light_arrives = direct_contribution(value_cos, *light, self.settings.falloff.into());
        if light_arrives == BLACK || !self.rays.visible(&shadow_ray(surface, light, side.above)) {
            return BLACK;
        }
        light_arrives
    }

    /// The environment's light on the diffuse lobes, with occlusion.
    fn ambient(&mut self, surface: &Surface, closure: &Closure, full: bool, draws: &mut Draws) -> Vec3f {
        let (above, below) = (closure_diffuse_albedo(*closure), closure_diffuse_albedo_below(*closure));
        let mut sum = BLACK;
        if above != BLACK {
            sum += above * self.ambient_side(surface, closure.frame, 1.0, full, draws);
        }
        if below != BLACK {
            sum += below * self.ambient_side(surface, closure.frame, -1.0, full, draws);
        }
        sum
    }

    /// The mean of what the environment brings to one side of a surface, 1 or −1, by the cosine.
    fn ambient_side(
        &mut self,
        surface: &Surface,
        frame: Frame,
        side: f32,
        full: bool,
        draws: &mut Draws,
    ) -> Vec3f {
        let occlusion_rays = if full { self.settings.ambient.samples } else { 0 };
        let count = occlusion_rays.max(1);
        let mut sum = BLACK;
        for _ in 0..count {
            let u = draws.pair();
            let local = sample_cosine_hemisphere(vec2f(u[0], u[1])) * vec3f(1.0, 1.0, side);
            let wi = to_world(frame, local);
            if dot(wi, surface.horizon) * side <= 0.0 {
                continue;
            }
            let origin = surface.ray_origin(side > 0.0).to_array();
            let t_max = self.settings.ambient.distance;
            let open = occlusion_rays == 0
                || self.rays.visible(&Ray { origin, t_min: 0.0, direction: wi.to_array(), t_max });
            if open {
                sum += self.scene.tables.environment.radiance(wi);
            }
        }
        sum * (1.0 / count as f32)
    }

    /// Rays through the lobes that are not diffuse.
    fn reflections(&mut self, surface: &Surface, others: &Closure, way: Way, draws: &mut Draws) -> Vec3f {
        let mut sum = BLACK;
        for _ in 0..self.settings.reflection_samples {
            let u = draws.pair();
            let u_lobe = if others.layered { draws.pair()[0] } else { 0.0 };
            sum += self.follow(surface, others, way, u_lobe, u, draws);
        }
        sum * (1.0 / self.settings.reflection_samples.max(1) as f32)
    }

    /// One sampled direction.
    fn follow(
        &mut self,
        surface: &Surface,
        closure: &Closure,
        way: Way,
        u_lobe: f32,
        u: [f32; 2],
        draws: &mut Draws,
    ) -> Vec3f {
        let wo = to_local(closure.frame, surface.wo);
        let sample = closure_sample(*closure, wo, u_lobe, vec2f(u[0], u[1]));
        let wi = to_world(closure.frame, sample.wi);
        let above = dot(wi, surface.horizon) > 0.0;
        if !leaves_surface(sample, above) {
            return BLACK;
        }
        let ray = Ray::new(surface.ray_origin(above).to_array(), wi.to_array());
        let hit = self.rays.closest(&ray);
        let next = Way {
            depth: way.depth + 1,
            // Lights are in the direct term already, so one that such a lobe finds must not count again.
            sees: if sample.delta { Sees::All } else { Sees::NoLight },
            full: way.full && sample.delta,
            throughput: way.throughput * sample.weight,
            ..way
        };
        sample.weight * self.radiance(&ray, &hit, next, draws)
    }
}

/// Whether any of a light's corners, if it is flat, is on the surface's side.
fn may_light(light: Light, surface: &Surface) -> bool {
    !light_is_flat(light.kind) || flat_light_is_above(light, light.position - surface.origin, surface.horizon)
}
