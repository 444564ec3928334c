//! Records of lights.

use super::NONE;
use super::rectangles::Rectangle;
use crate::Photometry;
use optics::light::{
    LIGHT_DIRECTIONAL, LIGHT_ENVIRONMENT, LIGHT_POINT, LIGHT_RECTANGLE, LIGHT_SPHERE, LIGHT_SPOT,
    LIGHT_TRIANGLE, Light, spot_falloff,
};
use optics::{Vec3f, vec3f};

/// Something that next-event estimation can sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightRecord {
    /// The light itself, world space.
    pub light: Light,
    /// Material whose textures modulate a surface's emission or leave holes in it, or [`NONE`].
    pub textured_material: u32,
    /// Texture coordinates (first and second set) of a textured triangle's vertices.
    pub uv: [[[f32; 2]; 3]; 2],
    /// Total power, as far as selection is concerned; relative to the other lights only.
    pub power: f32,
    /// Whether a directional light's disc is seen by camera and mirrors.
    pub visible: bool,
    /// Where a point's or spot's profile begins in [`super::SceneTables::profiles`], or [`NONE`]. The light then has the profile's axis in
    /// `edge1`, and in `edge2.z` the azimuth of its horizontal angle 0.
    pub profile: u32,
}

impl LightRecord {
    fn new(light: Light, power: f32) -> Self {
        Self { light, textured_material: NONE, uv: [[[0.0; 2]; 3]; 2], power, visible: false, profile: NONE }
    }

    /// A triangle that emits `emission` on its front, and on its back if `two_sided`.
    pub fn triangle(v: [glam::Vec3; 3], emission: glam::Vec3, two_sided: bool, mean_texture: f32) -> Self {
        let (edge1, edge2) = (v[1] - v[0], v[2] - v[0]);
        let area = edge1.cross(edge2).length() * 0.5;
        let light = flat(LIGHT_TRIANGLE, [v[0], edge1, edge2], emission, two_sided);
        Self::new(light, flat_power(&light, area) * mean_texture)
    }

    /// A rectangle that emits `emission` on its front, and on its back if `two_sided`.
    pub(super) fn rectangle(r: &Rectangle, emission: glam::Vec3, two_sided: bool) -> Self {
        let light = flat(LIGHT_RECTANGLE, [r.first, r.edge1, r.edge2], emission, two_sided);
        Self::new(light, flat_power(&light, r.edge1.cross(r.edge2).length()))
    }

    /// A sphere that emits outwards, and inwards if `two_sided`.
    pub fn sphere(center: glam::Vec3, radius: f32, emission: glam::Vec3, two_sided: bool) -> Self {
        let area = 4.0 * std::f32::consts::PI * radius * radius;
        let mut light = blank(LIGHT_SPHERE, center, emission);
        light.size = radius;
        light.two_sided = two_sided;
        Self::new(light, std::f32::consts::PI * area * luminance(emission))
    }

    /// A point.
    pub fn point(position: glam::Vec3, intensity: glam::Vec3) -> Self {
        Self::new(blank(LIGHT_POINT, position, intensity), 4.0 * std::f32::consts::PI * luminance(intensity))
    }

    /// A spot; angles from its axis, radians.
    pub fn spot(
        position: glam::Vec3,
        direction: glam::Vec3,
        intensity: glam::Vec3,
        inner: f32,
        outer: f32,
    ) -> Self {
        let mut light = blank(LIGHT_SPOT, position, intensity);
        let falloff = optics::light::spot_falloff_parameters(inner.cos(), outer.cos());
        light.edge1 = to_optics(direction);
        light.edge2 = vec3f(falloff.x, falloff.y, 0.0);
        let cone = 2.0 * std::f32::consts::PI * (1.0 - 0.5 * (inner.cos() + outer.cos()));
        Self::new(light, cone * luminance(intensity))
    }

    /// A point or spot with a profile that begins at `place`. A spot's profile is aimed as the spot is.
    #[must_use]
    pub fn with_profile(mut self, photometry: &Photometry, place: u32) -> Self {
        let light = &mut self.light;
        let photometry = match light.kind {
            LIGHT_SPOT => photometry.aimed_along(glam::Vec3::from(light.edge1.to_array())),
            _ => photometry.clone(),
        };
        light.edge1 = to_optics(photometry.axis);
        light.edge2.z = photometry.azimuth_of_zero();
        let (is_spot, scale, offset) = (light.kind == LIGHT_SPOT, light.edge2.x, light.edge2.y);
        let within = |cos: f32| if is_spot { spot_falloff(cos, scale, offset) } else { 1.0 };
        self.power = photometry.profile.integral(within) * optics::math::luminance(light.emission);
        self.profile = place;
        self
    }

    /// A light infinitely far away, in unit direction `towards`; `scene_radius` turns irradiance into power.
    pub fn directional(
        towards: glam::Vec3,
        irradiance: glam::Vec3,
        angular_radius: f32,
        visible: bool,
        scene_radius: f32,
    ) -> Self {
        let power = std::f32::consts::PI * scene_radius * scene_radius * luminance(irradiance);
        let half_sine = (angular_radius * 0.5).sin();
        let one_minus_cos = 2.0 * half_sine * half_sine;
        let mut light = blank(LIGHT_DIRECTIONAL, towards, irradiance);
        if one_minus_cos > 0.0 {
            // Irradiance of a disc that faces the surface: radiance · π sin². The cosine inside it is counted.
            let sin2 = one_minus_cos * (2.0 - one_minus_cos);
            light.size = one_minus_cos;
            light.emission = to_optics(irradiance / (std::f32::consts::PI * sin2));
        }
        Self { visible: visible && one_minus_cos > 0.0, ..Self::new(light, power) }
    }

    /// The environment behind portals of an `area`, m²: what comes in through them.
    pub fn portals(mean_luminance: f32, area: f32) -> Self {
        let power = std::f32::consts::PI * mean_luminance * area;
        Self::new(blank(LIGHT_ENVIRONMENT, glam::Vec3::ZERO, glam::Vec3::ZERO), power)
    }

    /// The environment image, whose own table samples it.
    pub fn environment(mean_luminance: f32, scene_radius: f32) -> Self {
        let sphere = 4.0 * std::f32::consts::PI;
        let power = sphere * mean_luminance * std::f32::consts::PI * scene_radius * scene_radius;
        Self::new(blank(LIGHT_ENVIRONMENT, glam::Vec3::ZERO, glam::Vec3::ZERO), power)
    }
}

fn blank(kind: u32, position: glam::Vec3, emission: glam::Vec3) -> Light {
    let zero = vec3f(0.0, 0.0, 0.0);
    let (position, emission) = (to_optics(position), to_optics(emission));
    Light { kind, position, edge1: zero, edge2: zero, emission, size: 0.0, two_sided: false }
}

/// A triangle or rectangle: its first corner and the edges from there.
fn flat(kind: u32, [first, edge1, edge2]: [glam::Vec3; 3], emission: glam::Vec3, two_sided: bool) -> Light {
    let (edge1, edge2) = (to_optics(edge1), to_optics(edge2));
    Light { edge1, edge2, two_sided, ..blank(kind, first, emission) }
}

/// Power of a flat light of an `area`, m².
fn flat_power(light: &Light, area: f32) -> f32 {
    let sides = if light.two_sided { 2.0 } else { 1.0 };
    std::f32::consts::PI * area * sides * optics::math::luminance(light.emission)
}

fn to_optics(v: glam::Vec3) -> Vec3f {
    vec3f(v.x, v.y, v.z)
}

pub(super) fn luminance(c: glam::Vec3) -> f32 {
    optics::math::luminance(to_optics(c))
}
