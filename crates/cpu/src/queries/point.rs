//! What there is to know of a point that a ray reached.

use super::RayQueries;
use crate::fetch::surface::Surface;
use crate::shade::material::{Shading, base_color, mixes_models, shade};
use accel::{Hit, Ray};
use optics::bsdf::bsdf_eval;
use optics::constants::PI;
use optics::frame::to_local;
use optics::motion::MOTION_MIDDLE;
use optics::vector::dot;
use optics::{Vec3f, vec3f};

/// A point of a surface that a ray reached.
pub struct SurfacePoint<'a> {
    queries: &'a RayQueries,
    surface: Surface,
    t: f32,
    primitive: u32,
}

/// Over so many chances a material is averaged that is either glass or not.
const MIXTURE: u32 = 16;

impl<'a> SurfacePoint<'a> {
    pub(super) fn new(queries: &'a RayQueries, ray: &Ray, hit: &Hit) -> Self {
        let (_, primitive) = queries.instance_and_primitive(hit);
        Self { queries, surface: Surface::new(&queries.scene, ray, hit, MOTION_MIDDLE), t: hit.t, primitive }
    }

    /// Distance along the ray, metres.
    pub fn distance(&self) -> f32 {
        self.t
    }

    /// World position, metres.
    pub fn position(&self) -> [f32; 3] {
        self.surface.position.to_array()
    }

    /// Unit shading normal (normal map applied), world space, on the side of the ray's origin.
    pub fn normal(&self) -> [f32; 3] {
        self.surface.shading_normal.to_array()
    }

    /// Unit normal of the geometry, world space, on the side of the ray's origin.
    pub fn geometric_normal(&self) -> [f32; 3] {
        self.surface.normal.to_array()
    }

    /// Index into the scene's instances.
    pub fn instance(&self) -> u32 {
        self.surface.object
    }

    /// Number of the triangle in its mesh, or of the sphere among its spheres.
    pub fn primitive(&self) -> u32 {
        self.primitive
    }

    /// Index into the scene's materials.
    pub fn material(&self) -> u32 {
        self.surface.material
    }

    /// Linear base colour.
    pub fn base_color(&self) -> [f32; 3] {
        let tables = self.queries.tables();
        base_color(tables, &tables.materials[self.surface.material as usize], &self.surface, 0.0).to_array()
    }

    /// How much light comes back the way the ray came, linear RGB: π times the BSDF for equal directions, times the cosine. A
    /// white diffuse surface that faces the ray has 1. Ideal mirrors and smooth glass send back nothing: only a surface that
    /// faces the ray exactly would.
    pub fn backscatter(&self) -> [f32; 3] {
        let (tables, surface) = (self.queries.tables(), &self.surface);
        let material = &tables.materials[surface.material as usize];
        let wo = to_local(surface.frame(), surface.wo);
        if dot(surface.wo, surface.shading_normal) <= 0.0 {
            return [0.0; 3];
        }
        let shading = Shading { single_scatter: false, pixel_spread: 0.0 };
        let strata = if mixes_models(material) { MIXTURE } else { 1 };
        let mut sum = vec3f(0.0, 0.0, 0.0);
        for i in 0..strata {
            let u_mix = (i as f32 + 0.5) / strata as f32;
            let bsdf = shade(tables, material, surface, &shading, 0.0, material.ior, u_mix);
            let value: Vec3f = bsdf_eval(bsdf, wo, wo).value_cos;
            sum += value;
        }
        (sum * (PI / strata as f32)).to_array()
    }
}
