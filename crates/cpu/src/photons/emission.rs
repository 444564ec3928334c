//! How photons leave lights: aimed at the surfaces that mirror or refract, and with what density.
//!
//! The density of a ray is a mixture over the targets, each with a probability in proportion to its solid angle, or to
//! the area of its disc for lights that are infinitely far away. So it is the number of targets that the ray meets over
//! the sum of their measures, and rays that meet several are counted right.

use crate::integrate::volume::interiors::interiors_around;
use crate::scene::{CpuScene, vec3};
use crate::shade::lights::{point_intensity, surface_emission};
use accel::Ray;
use optics::interiors::{Interiors, interiors_nothing};
use optics::light::{
    LIGHT_DIRECTIONAL, LIGHT_ENVIRONMENT, LIGHT_RECTANGLE, LIGHT_SPHERE, Light, directional_light_sample,
    light_is_point,
};
use optics::math::max_component;
use optics::motion::MOTION_MIDDLE;
use optics::photons::{
    ONLY_PHOTONS, PAIR_AIM, PAIR_CHOICE, PAIR_EMISSION, target_direction, target_disc_point, target_is_ahead,
    target_is_crossed, target_solid_angle,
};
use optics::random::{PixelSampler, sample_2d};
use optics::vector::{cross, dot, length};
use optics::warp::{pdf_cone, sample_sphere, sample_triangle};
use optics::{Vec2f, Vec3f, vec2f};
use scene::tables::LightRecord;
use std::f32::consts::PI;

/// The share of a light's size by which photons begin off its surface.
const OFF_SURFACE: f32 = 1e-4;

/// A photon that has just left its light.
pub(crate) struct Emitted {
    pub ray: Ray,
    /// Power, W, as if it were the only photon.
    pub flux: Vec3f,
    /// Density per étendue, m⁻² sr⁻¹; [`ONLY_PHOTONS`] of lights that paths cannot find.
    pub density: f32,
    /// What it begins in.
    pub inside: Interiors,
}

/// The lights of a scene, as photons choose them, and what they are aimed at.
#[derive(Default)]
pub(crate) struct PhotonLights {
    /// Centre and radius.
    targets: Vec<[f32; 4]>,
    /// Area of all targets' discs, m².
    discs: f32,
    /// Of each light, the probability of it and all before it.
    cumulative: Vec<f32>,
    /// What each light is in.
    around: Vec<Interiors>,
    /// Centre and radius of a sphere around everything.
    bounds: [f32; 4],
}

impl PhotonLights {
    /// `None` if no photon would arrive anywhere.
    pub fn new(scene: &CpuScene) -> Option<Self> {
        let tables = &*scene.tables;
        let targets = tables.specular_targets();
        let has_image = tables.environment.width > 0;
        let flux = tables.lights.iter().map(|light| {
            let dark = light.light.kind == LIGHT_ENVIRONMENT && !has_image;
            if dark { 0.0 } else { f64::from(light.flux_towards(&targets)) }
        });
        let flux: Vec<f64> = flux.collect();
        let all: f64 = flux.iter().sum();
        if all.is_nan() || all <= 0.0 || tables.motion.is_some() {
            return None;
        }
        let mut sum = 0.0;
        let cumulative = flux.iter().map(|f| {
            sum += f / all;
            sum as f32
        });
        let around = tables.lights.iter().map(|l| match l.light.kind {
            LIGHT_DIRECTIONAL | LIGHT_ENVIRONMENT => interiors_nothing(),
            _ => interiors_around(scene, center(&l.light), MOTION_MIDDLE),
        });
        Some(Self {
            discs: targets.iter().map(|t| PI * t[3] * t[3]).sum(),
            cumulative: cumulative.collect(),
            around: around.collect(),
            bounds: tables.bounding_sphere,
            targets,
        })
    }

    /// The sum of the squares of the targets' radii, m².
    pub fn targets_radius2(&self) -> f32 {
        self.discs / PI
    }

    /// Probability with which a photon is one of light `index`.
    fn probability(&self, index: u32) -> f32 {
        let index = index as usize;
        let before = if index == 0 { 0.0 } else { self.cumulative[index - 1] };
        self.cumulative.get(index).map_or(0.0, |up_to| up_to - before)
    }

    /// Sends a photon out; `None` if its light does not shine that way.
    pub fn emit(&self, scene: &CpuScene, sampler: PixelSampler) -> Option<Emitted> {
        let [choice, emission, aim] =
            [PAIR_CHOICE, PAIR_EMISSION, PAIR_AIM].map(|pair| sample_2d(sampler, pair));
        let last = self.cumulative.len() - 1;
        let index = self.cumulative.partition_point(|up_to| *up_to <= choice.x).min(last) as u32;
        let probability = self.probability(index);
        let light = &scene.tables.lights[index as usize].light;
        let emitted = match light.kind {
            LIGHT_DIRECTIONAL | LIGHT_ENVIRONMENT => self.emit_distant(scene, index, emission, choice.y, aim),
            _ => self.emit_local(scene, index, emission, choice.y, aim),
        }?;
        let Emitted { flux, density, .. } = emitted;
        let shines = probability > 0.0 && max_component(flux) > 0.0 && max_component(flux).is_finite();
        shines.then(|| Emitted {
            flux: flux * (1.0 / probability),
            density: density * probability,
            ..emitted
        })
    }

    /// From a sun or the sky, parallel to a sampled direction, through the disc of a target.
    fn emit_distant(
        &self,
        scene: &CpuScene,
        index: u32,
        emission: Vec2f,
        choice: f32,
        aim: Vec2f,
    ) -> Option<Emitted> {
        let environment = &scene.tables.environment;
        let LightRecord { light, visible, .. } = &scene.tables.lights[index as usize];
        let (wi, radiance, pdf, delta) = if light.kind == LIGHT_ENVIRONMENT {
            let (wi, pdf) = environment.sample_image([emission.x, emission.y]);
            (wi, environment.radiance(wi), pdf, false)
        } else {
            let sample = directional_light_sample(*light, emission);
            (sample.wi, sample.radiance, sample.pdf, sample.delta || !visible)
        };
        let target = self.choose(choice, |t| PI * t[3] * t[3]);
        let at = target_disc_point(target_center(&target), target[3], wi, aim);
        let density = pdf * self.crossed(at, wi) as f32 / self.discs;
        let back = length(at - target_center(&self.bounds)) + 1.01 * self.bounds[3];
        let ray = Ray::new((at + wi * back).to_array(), (-wi).to_array());
        let flux = radiance * (1.0 / density);
        let density = if delta { ONLY_PHOTONS } else { density };
        (pdf > 0.0).then_some(Emitted { ray, flux, density, inside: interiors_nothing() })
    }

    /// From a point of a light that has a place, towards a target.
    fn emit_local(
        &self,
        scene: &CpuScene,
        index: u32,
        emission: Vec2f,
        choice: f32,
        aim: Vec2f,
    ) -> Option<Emitted> {
        let record = &scene.tables.lights[index as usize];
        let light = &record.light;
        let (from, normal, place) = point_of(light, emission);
        let target = self.choose(choice, |t| target_solid_angle(target_center(t), t[3], from));
        let direction = target_direction(target_center(&target), target[3], from, aim);
        let (all, ahead) = self.seen(from, direction);
        let per_angle = ahead.max(1) as f32 / all;
        let inside = self.around[index as usize];
        if light_is_point(light.kind) {
            let flux = point_intensity(scene, record, direction) * (1.0 / per_angle);
            let ray = Ray::new(from.to_array(), direction.to_array());
            return Some(Emitted { ray, flux, density: ONLY_PHOTONS, inside });
        }
        let cosine = dot(normal, direction);
        if cosine == 0.0 || (cosine < 0.0 && !light.two_sided) {
            return None;
        }
        let density = per_angle / (area(light) * cosine.abs());
        let flux = surface_emission(scene, record, from, place) * (1.0 / density);
        let off = normal * (cosine.signum() * OFF_SURFACE * area(light).sqrt());
        let ray = Ray::new((from + off).to_array(), direction.to_array());
        Some(Emitted { ray, flux, density, inside })
    }

    /// The density per étendue with which photons leave a point `from` of a light in unit direction `direction`.
    ///
    /// `cosine`: of the direction with the light's normal.
    pub fn surface_density(
        &self,
        scene: &CpuScene,
        index: u32,
        from: Vec3f,
        direction: Vec3f,
        cosine: f32,
    ) -> f32 {
        let Some(record) = scene.tables.lights.get(index as usize) else { return 0.0 };
        let (all, ahead) = self.seen(from, direction);
        let cosine = cosine.abs().max(1e-6);
        self.probability(index) * ahead as f32 / (all * area(&record.light) * cosine)
    }

    /// The same of a sun or the sky: `wi` is the direction towards it, from `p`.
    pub fn distant_density(&self, scene: &CpuScene, index: u32, p: Vec3f, wi: Vec3f) -> f32 {
        let Some(record) = scene.tables.lights.get(index as usize) else { return 0.0 };
        let probability = self.probability(index);
        if probability <= 0.0 {
            return 0.0;
        }
        let pdf = match record.light.kind {
            LIGHT_ENVIRONMENT => scene.tables.environment.image_pdf(wi),
            _ => pdf_cone(record.light.size.max(1e-20)),
        };
        probability * pdf * self.crossed(p, wi) as f32 / self.discs
    }

    /// Chooses a target in proportion to a measure.
    fn choose(&self, u: f32, measure: impl Fn(&[f32; 4]) -> f32) -> [f32; 4] {
        let mut left = u * self.targets.iter().map(&measure).sum::<f32>();
        for target in &self.targets {
            left -= measure(target);
            if left < 0.0 {
                return *target;
            }
        }
        self.targets[self.targets.len() - 1]
    }

    /// Sum of the targets' solid angles from a point, and how many of them are in a direction.
    fn seen(&self, from: Vec3f, direction: Vec3f) -> (f32, u32) {
        let (mut all, mut ahead) = (0.0, 0);
        for target in &self.targets {
            all += target_solid_angle(target_center(target), target[3], from);
            ahead += u32::from(target_is_ahead(target_center(target), target[3], from, direction));
        }
        (all, ahead)
    }

    /// How many targets a line meets; at least one, since rounding may put it beside the one that it was made for.
    fn crossed(&self, p: Vec3f, direction: Vec3f) -> u32 {
        let meets = |t: &&[f32; 4]| target_is_crossed(target_center(t), t[3], p, direction);
        (self.targets.iter().filter(meets).count() as u32).max(1)
    }
}

fn target_center(target: &[f32; 4]) -> Vec3f {
    vec3([target[0], target[1], target[2]])
}

/// A point of a light, uniform in area, the unit normal there, and its place on the edges of a flat one.
fn point_of(light: &Light, u: Vec2f) -> (Vec3f, Vec3f, Vec2f) {
    if light_is_point(light.kind) {
        return (light.position, light.edge1, u);
    }
    if light.kind == LIGHT_SPHERE {
        let normal = sample_sphere(u);
        return (light.position + normal * light.size, normal, u);
    }
    let place = if light.kind == LIGHT_RECTANGLE { u } else { sample_triangle(u) };
    let normal = cross(light.edge1, light.edge2);
    let normal = normal * (1.0 / length(normal).max(1e-30));
    (light.position + light.edge1 * place.x + light.edge2 * place.y, normal, place)
}

fn center(light: &Light) -> Vec3f {
    if light.kind == LIGHT_SPHERE || light_is_point(light.kind) {
        return light.position;
    }
    let (at, normal, _) = point_of(light, vec2f(0.4, 0.4));
    at + normal * (OFF_SURFACE * area(light).sqrt())
}

/// The area of a surface that shines, m².
fn area(light: &Light) -> f32 {
    match light.kind {
        LIGHT_SPHERE => 4.0 * PI * light.size * light.size,
        LIGHT_RECTANGLE => length(cross(light.edge1, light.edge2)),
        _ => 0.5 * length(cross(light.edge1, light.edge2)),
    }
}
