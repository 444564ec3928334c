//! The fixed-cost renderer: direct light with shadows, reflection, refraction and ambient occlusion; no global
//! illumination. And the `aov` integrator, which stops at the first hit.
//!
//! At the first hit every light gets a fixed number of shadow rays, the lobes that are not diffuse a fixed number of
//! reflection rays, and the environment, as ambient light on the diffuse lobes, a fixed number of occlusion rays. What
//! reflection rays see is lit with one shadow ray a light. Mirrors and glass are followed until the depth is used up.

use crate::batch::samples::{SampleId, new_sampler};
use crate::fetch::surface::Surface;
use crate::scene::{CpuScene, vec3};
use crate::shade::aov::{aov_sample, headlight};
use crate::shade::closures::{Incoming, closure_at};
use crate::shade::lights::{distant_radiance, sample_one_light};
use crate::shade::material::{Shading, emission};
use crate::shade::scatter::shadow_ray;
use accel::{Hit, HitFilter, Ray};
use backend::{DirectSettings, Highlights, View};
use film::AovSample;
use optics::camera::{camera_pixel_spread, camera_ray};
use optics::closure::{
    Closure, closure_diffuse_albedo, closure_diffuse_albedo_below, closure_eval, closure_has_smooth_part,
    closure_is_interface, closure_phong_eval, closure_reflects, closure_sample, closure_scatters,
    closure_transmits, closure_without_diffuse,
};
use optics::direct_light::direct_contribution;
use optics::frame::{Frame, to_local, to_world};
use optics::light::{LIGHT_ENVIRONMENT, Light, LightSample, flat_light_is_above, light_is_flat};
use optics::random::{PixelSampler, sample_2d};
use optics::vector::dot;
use optics::vertex::{leaves_surface, light_side};
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
        (self.radiance(&ray, &hit, Way::of_camera(), &mut draws) * weight, aovs)
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

    /// Radiance back along a ray.
    fn radiance(&mut self, ray: &Ray, hit: &Hit, way: Way, draws: &mut Draws) -> Vec3f {
        if hit.is_miss() {
            let wi = vec3(ray.direction);
            return match way.sees {
                Sees::All => distant_radiance(self.scene, wi),
                Sees::NoLight => self.scene.tables.environment.radiance(wi),
            };
        }
        let surface = Surface::new(self.scene, ray, hit);
        if way.sees == Sees::NoLight && surface.light != scene::tables::NONE {
            return BLACK;
        }
        let tables: &SceneTables = &self.scene.tables;
        let material = &tables.materials[surface.material as usize];
        let way = Way { length: way.length + hit.t, ..way };
        let footprint = self.shading.pixel_spread * way.length;
        let [u_model, u_lobe] = draws.pair();
        let mut sum = emission(tables, material, &surface, footprint);
        let incoming = Incoming { footprint, ior: material.ior, throughput: way.throughput, u_model };
        let closure = closure_at(tables, material, &surface, &self.shading, incoming);
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
        if light_arrives == BLACK || !self.visible(&shadow_ray(surface, light, side.above)) {
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
        let occlusion_rays = if full { self.settings.ambient_samples } else { 0 };
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
            let t_max = self.settings.ambient_distance;
            let open = occlusion_rays == 0
                || self.visible(&Ray { origin, t_min: 0.0, direction: wi.to_array(), t_max });
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
        let hit = self.closest(&ray);
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
