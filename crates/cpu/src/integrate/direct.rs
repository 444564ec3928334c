//! The fixed-cost renderer: direct light with shadows, reflection, refraction and ambient occlusion; no global
//! illumination. And the `aov` integrator, which stops at the first hit.
//!
//! At the first hit every light gets a fixed number of shadow rays, the specular lobe a fixed number of reflection
//! rays, and the environment, as ambient light on the diffuse lobe, a fixed number of occlusion rays. What reflection
//! rays see is lit with one shadow ray a light. Mirrors and glass are followed until the depth is used up.

use crate::fetch::surface::Surface;
use crate::integrate::aov::{aov_sample, headlight};
use crate::integrate::path::{SampleId, new_sampler};
use crate::scene::{CpuScene, vec3};
use crate::shade::lights::{distant_radiance, sample_one_light};
use crate::shade::material::{Shading, emission, shade};
use crate::shade::scatter::shadow_ray;
use accel::{Hit, HitFilter, Ray};
use backend::{DirectSettings, Highlights, View};
use film::AovSample;
use optics::bsdf::{bsdf_eval, bsdf_has_smooth_part, bsdf_sample, bsdf_transmits};
use optics::camera::{camera_pixel_spread, camera_ray};
use optics::falloff::falloff_factor;
use optics::frame::{to_local, to_world};
use optics::light::{LIGHT_ENVIRONMENT, Light, LightSample, flat_light_is_above, light_is_flat};
use optics::phong::phong_eval;
use optics::random::{PixelSampler, sample_2d};
use optics::scatter::{BSDF_GLOSSY, BSDF_NONE, Bsdf};
use optics::vector::dot;
use optics::warp::sample_cosine_hemisphere;
use optics::{Vec3f, vec2f, vec3f};
use scene::tables::SceneTables;

const BLACK: Vec3f = vec3f(0.0, 0.0, 0.0);

/// Draws pairs of random numbers one after the other.
struct Draws {
    sampler: PixelSampler,
    next_pair: u32,
}

impl Draws {
    fn pair(&mut self) -> [f32; 2] {
        self.next_pair += 1;
        let u = sample_2d(self.sampler, self.next_pair - 1);
        [u.x, u.y]
    }
}

/// Renders single samples with a fixed number of rays.
pub(crate) struct DirectTracer<'a, F> {
    pub scene: &'a CpuScene,
    pub view: &'a View,
    pub filter: &'a F,
    pub settings: DirectSettings,
    shading: Shading,
    /// Rays traced so far.
    pub rays_traced: u64,
}

impl<'a, F: HitFilter> DirectTracer<'a, F> {
    pub fn new(scene: &'a CpuScene, view: &'a View, filter: &'a F, settings: DirectSettings) -> Self {
        let pixel_spread = camera_pixel_spread(view.camera, view.height as f32);
        let shading = Shading { single_scatter: view.single_scatter, pixel_spread };
        Self { scene, view, filter, settings, shading, rays_traced: 0 }
    }

    /// The `direct` picture of one sample, and its first hit.
    pub fn sample(&mut self, id: &SampleId) -> (Vec3f, AovSample) {
        let (ray, mut draws, weight) = self.camera(id);
        let hit = self.closest(&ray);
        let aovs = self.first_hit(&ray, &hit).map_or_else(AovSample::default, |(surface, footprint)| {
            let tables = &*self.scene.tables;
            let material = &tables.materials[surface.material as usize];
            aov_sample(tables, material, &surface, hit.t, footprint)
        });
        (self.radiance(&ray, &hit, 0.0, 1, true, &mut draws) * weight, aovs)
    }

    /// The `aov` picture of one sample, and its first hit.
    pub fn sample_aov(&mut self, id: &SampleId) -> (Vec3f, AovSample) {
        let (ray, _, weight) = self.camera(id);
        let hit = self.closest(&ray);
        match self.first_hit(&ray, &hit) {
            None => (distant_radiance(self.scene, vec3(ray.direction)) * weight, AovSample::default()),
            Some((surface, footprint)) => {
                let tables = &*self.scene.tables;
                let material = &tables.materials[surface.material as usize];
                let color = headlight(tables, material, &surface, footprint);
                (color, aov_sample(tables, material, &surface, hit.t, footprint))
            }
        }
    }

    /// The camera ray of a sample, its random numbers, and the ray's weight.
    fn camera(&self, id: &SampleId) -> (Ray, Draws, f32) {
        let mut draws = Draws { sampler: new_sampler(self.view, id), next_pair: 0 };
        let (jitter, lens) = (draws.pair(), draws.pair());
        let film = vec2f(
            (id.x as f32 + jitter[0]) / self.view.width as f32,
            (id.y as f32 + jitter[1]) / self.view.height as f32,
        );
        let ray = camera_ray(self.view.camera, film, vec2f(lens[0], lens[1]));
        (Ray::new(ray.origin.to_array(), ray.direction.to_array()), draws, ray.weight)
    }

    fn first_hit(&self, ray: &Ray, hit: &Hit) -> Option<(Surface, f32)> {
        (!hit.is_miss()).then(|| (Surface::new(self.scene, ray, hit), self.shading.pixel_spread * hit.t))
    }

    fn closest(&mut self, ray: &Ray) -> Hit {
        self.rays_traced += 1;
        self.scene.tlas.closest(ray, self.filter)
    }

    fn visible(&mut self, ray: &Ray) -> bool {
        self.rays_traced += 1;
        !self.scene.tlas.any(ray, self.filter)
    }

    /// Radiance back along a ray. `length`: of the path before it; `full`: whether this vertex gets the whole number
    /// of rays, as everything does that the camera sees directly, in mirrors or through glass.
    fn radiance(
        &mut self,
        ray: &Ray,
        hit: &Hit,
        length: f32,
        depth: u32,
        full: bool,
        draws: &mut Draws,
    ) -> Vec3f {
        if hit.is_miss() {
            return distant_radiance(self.scene, vec3(ray.direction));
        }
        let surface = Surface::new(self.scene, ray, hit);
        let tables: &SceneTables = &self.scene.tables;
        let material = &tables.materials[surface.material as usize];
        let length = length + hit.t;
        let footprint = self.shading.pixel_spread * length;
        let [u_mix, u_lobe] = draws.pair();
        let mut sum = emission(tables, material, &surface, footprint);
        let bsdf = shade(tables, material, &surface, &self.shading, footprint, material.ior, u_mix);
        if bsdf.kind == BSDF_NONE {
            return sum;
        }
        if bsdf_has_smooth_part(bsdf) {
            sum += self.direct_light(&surface, &bsdf, full, draws);
        }
        if bsdf.kind == BSDF_GLOSSY {
            sum += self.ambient(&surface, &bsdf, full, draws);
            if full && depth < self.settings.max_depth {
                sum += self.reflections(&surface, &bsdf, length, depth, draws);
            }
        } else if depth < self.settings.max_depth {
            sum += self.follow(&surface, &bsdf, length, depth, full, u_lobe, draws);
        }
        sum
    }

    /// Every light with its shadow rays.
    fn direct_light(&mut self, surface: &Surface, bsdf: &Bsdf, full: bool, draws: &mut Draws) -> Vec3f {
        let wo = to_local(surface.frame(), surface.wo);
        let mut sum = BLACK;
        for index in 0..self.scene.tables.lights.len() as u32 {
            let light = self.scene.tables.lights[index as usize].light;
            // The environment is ambient light here.
            if light.kind == LIGHT_ENVIRONMENT || !may_light(light, surface) {
                continue;
            }
            let extended = light.size > 0.0 || light_is_flat(light.kind);
            let soft = extended && self.settings.soft_shadows;
            let count = if soft && full { self.settings.shadow_samples.max(1) } else { 1 };
            for _ in 0..count {
                let u = if soft { draws.pair() } else { [0.5, 0.5] };
                let sample = sample_one_light(self.scene, index, surface.origin, u);
                sum += self.light_sample(surface, bsdf, wo, &sample) * (1.0 / count as f32);
            }
        }
        sum
    }

    fn light_sample(&mut self, surface: &Surface, bsdf: &Bsdf, wo: Vec3f, light: &LightSample) -> Vec3f {
        let above = dot(light.wi, surface.horizon) > 0.0;
        let wi = to_local(surface.frame(), light.wi);
        if light.pdf <= 0.0 || above != (wi.z > 0.0) || !(above || bsdf_transmits(*bsdf)) {
            return BLACK;
        }
        let value_cos = match self.settings.highlights {
            Highlights::Phong if bsdf.kind == BSDF_GLOSSY => phong_eval(*bsdf, wo, wi),
            _ => bsdf_eval(*bsdf, wo, wi).value_cos,
        };
        let falloff = falloff_factor(self.settings.falloff.into(), light.distance);
        let light_arrives = value_cos * light.radiance * (falloff / light.pdf);
        if light_arrives == BLACK || !self.visible(&shadow_ray(surface, light, above)) {
            return BLACK;
        }
        light_arrives
    }

    /// The environment's light on the diffuse lobe, with occlusion.
    fn ambient(&mut self, surface: &Surface, bsdf: &Bsdf, full: bool, draws: &mut Draws) -> Vec3f {
        let albedo = bsdf.diffuse * bsdf.diffuse_scale;
        if albedo == BLACK {
            return BLACK;
        }
        let occlusion_rays = if full { self.settings.ambient_samples } else { 0 };
        let count = occlusion_rays.max(1);
        let mut sum = BLACK;
        for _ in 0..count {
            let u = draws.pair();
            let wi = to_world(surface.frame(), sample_cosine_hemisphere(vec2f(u[0], u[1])));
            if dot(wi, surface.horizon) <= 0.0 {
                continue;
            }
            let origin = surface.ray_origin(true).to_array();
            let t_max = self.settings.ambient_distance;
            let open = occlusion_rays == 0
                || self.visible(&Ray { origin, t_min: 0.0, direction: wi.to_array(), t_max });
            if open {
                sum += self.scene.tables.environment.radiance(wi);
            }
        }
        albedo * sum * (1.0 / count as f32)
    }

    /// Rays through the specular lobe.
    fn reflections(
        &mut self,
        surface: &Surface,
        bsdf: &Bsdf,
        length: f32,
        depth: u32,
        draws: &mut Draws,
    ) -> Vec3f {
        if bsdf.specular_probability <= 0.0 || self.settings.reflection_samples == 0 {
            return BLACK;
        }
        let mut specular = *bsdf;
        specular.diffuse = BLACK;
        specular.specular_probability = 1.0;
        let wo = to_local(surface.frame(), surface.wo);
        let mut sum = BLACK;
        for _ in 0..self.settings.reflection_samples {
            let u = draws.pair();
            let sample = bsdf_sample(specular, wo, 0.0, vec2f(u[0], u[1]));
            let wi = to_world(surface.frame(), sample.wi);
            if sample.pdf <= 0.0 || dot(wi, surface.horizon) <= 0.0 {
                continue;
            }
            let origin = surface.ray_origin(true);
            let ray = Ray::new(origin.to_array(), wi.to_array());
            let hit = self.closest(&ray);
            // Lights are in the direct term already, so a reflected light source itself must not count again.
            let seen = if hit.is_miss() {
                self.scene.tables.environment.radiance(wi)
            } else {
                self.radiance_without_lights(&ray, &hit, length, depth + 1, draws)
            };
            sum += sample.weight * seen;
        }
        sum * (1.0 / self.settings.reflection_samples as f32)
    }

    fn radiance_without_lights(
        &mut self,
        ray: &Ray,
        hit: &Hit,
        length: f32,
        depth: u32,
        draws: &mut Draws,
    ) -> Vec3f {
        let surface = Surface::new(self.scene, ray, hit);
        if surface.light != scene::tables::NONE {
            return BLACK;
        }
        self.radiance(ray, hit, length, depth, false, draws)
    }

    /// Mirrors and dielectrics: one sampled direction.
    #[allow(clippy::too_many_arguments, reason = "the recursion's state; a struct would only rename it")]
    fn follow(
        &mut self,
        surface: &Surface,
        bsdf: &Bsdf,
        length: f32,
        depth: u32,
        full: bool,
        u_lobe: f32,
        draws: &mut Draws,
    ) -> Vec3f {
        let u = draws.pair();
        let wo = to_local(surface.frame(), surface.wo);
        let sample = bsdf_sample(*bsdf, wo, u_lobe, vec2f(u[0], u[1]));
        let wi = to_world(surface.frame(), sample.wi);
        let above = dot(wi, surface.horizon) > 0.0;
        if sample.pdf <= 0.0 || above == sample.transmitted {
            return BLACK;
        }
        let origin = surface.ray_origin(above);
        let ray = Ray::new(origin.to_array(), wi.to_array());
        let hit = self.closest(&ray);
        let seen = if sample.delta || hit.is_miss() {
            self.radiance(&ray, &hit, length, depth + 1, full, draws)
        } else {
            self.radiance_without_lights(&ray, &hit, length, depth + 1, draws)
        };
        sample.weight * seen
    }
}

/// Whether any of a light's corners, if it is flat, is on the surface's side.
fn may_light(light: Light, surface: &Surface) -> bool {
    !light_is_flat(light.kind) || flat_light_is_above(light, light.position - surface.origin, surface.horizon)
}
