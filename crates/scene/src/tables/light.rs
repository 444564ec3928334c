//! Records of lights.

use crate::light::WIDEST_PROJECTION;
use crate::{LightKind, Photometry, Portal};
use elementary::{asin, cos, sin, tan};
use optics::constants::NONE;
use optics::light::{
    LIGHT_DIRECTIONAL, LIGHT_ENVIRONMENT, LIGHT_POINT, LIGHT_PROJECTOR, LIGHT_RECTANGLE, LIGHT_SPHERE,
    LIGHT_SPOT, LIGHT_TRIANGLE, Light, spot_falloff,
};
use optics::{Vec3f, vec3f};
use std::f32::consts::PI;

/// Something that next-event estimation can sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightRecord {
    /// The light itself, world space.
    pub light: Light,
    /// Material whose textures modulate a surface's emission or leave holes in it, or [`NONE`].
    pub textured_material: u32,
    /// What a sampled point of a textured surface is found on the textures by. Of a triangle
    /// texture coordinates: of the first and the second set the pairs of the three vertices. Of a
    /// sphere rows of the matrix from world to object space, whose fourth numbers are zero.
    pub texture_places: [f32; 21],
    /// How bright it is as a source of irradiance, in the strongest channel, so that no colour
    /// counts less than another. Of lights that have a place the greatest radiant intensity, W/sr:
    /// irradiance times squared distance. Of others irradiance, W/m².
    pub strength: f32,
    /// Total power in the strongest channel, relative to the other lights only. A sun's grows with
    /// the scene.
    pub power: f32,
    /// Centre and radius of a sphere around the portals that the environment is sampled through;
    /// radius 0 if there are none.
    pub portals: [f32; 4],
    /// Whether a directional light's disc is seen by camera and mirrors.
    pub visible: bool,
    /// Where a point's or spot's profile begins in [`super::SceneTables::profiles`], or [`NONE`].
    /// The light then has the profile's axis in `edge1`, and in `edge2.z` the azimuth of its
    /// horizontal angle 0.
    pub profile: u32,
}

/// A rectangle in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rectangle {
    /// A corner.
    pub first: glam::Vec3,
    /// The longer edge from there.
    pub edge1: glam::Vec3,
    /// The other edge. The front is where `edge1` × `edge2` points to.
    pub edge2: glam::Vec3,
}

impl LightRecord {
    fn new(light: Light, strength: f32, power: f32) -> Self {
        Self {
            light,
            textured_material: NONE,
            texture_places: [0.0; 21],
            strength,
            power,
            portals: [0.0; 4],
            visible: false,
            profile: NONE,
        }
    }

    /// A triangle or rectangle of an `area`, m².
    fn flat(light: Light, area: f32, mean_texture: f32) -> Self {
        let strength = area * strongest(light.emission) * mean_texture;
        let sides = if light.two_sided { 2.0 } else { 1.0 };
        Self::new(light, strength, PI * sides * strength)
    }

    /// A triangle that emits `emission` on its front, and on its back if `two_sided`.
    pub fn triangle(v: [glam::Vec3; 3], emission: glam::Vec3, two_sided: bool, mean_texture: f32) -> Self {
        let (edge1, edge2) = (v[1] - v[0], v[2] - v[0]);
        let area = edge1.cross(edge2).length() * 0.5;
        let light = flat(LIGHT_TRIANGLE, [v[0], edge1, edge2], emission, two_sided);
        Self::flat(light, area, mean_texture)
    }

    /// A rectangle that emits `emission` on its front, and on its back if `two_sided`.
    pub(super) fn rectangle(r: &Rectangle, emission: glam::Vec3, two_sided: bool) -> Self {
        let light = flat(LIGHT_RECTANGLE, [r.first, r.edge1, r.edge2], emission, two_sided);
        Self::flat(light, r.edge1.cross(r.edge2).length(), 1.0)
    }

    /// A sphere that emits outwards, and inwards if `two_sided`. `mean_texture`: of its emission's
    /// texture.
    pub fn sphere(
        center: glam::Vec3,
        radius: f32,
        emission: glam::Vec3,
        two_sided: bool,
        mean_texture: f32,
    ) -> Self {
        let mut light = blank(LIGHT_SPHERE, center, emission);
        light.size = radius;
        light.two_sided = two_sided;
        let strength = PI * radius * radius * strongest(light.emission) * mean_texture;
        Self::new(light, strength, 4.0 * PI * strength)
    }

    /// A light without a surface. `scene_radius`: turns irradiance into power; `aspect`: width over
    /// height of the picture that it shows.
    pub(super) fn of(kind: LightKind, scene_radius: f32, aspect: f32) -> Self {
        match kind {
            LightKind::Point { position, intensity } => Self::point(position, intensity),
            LightKind::Spot { position, direction, intensity, inner_angle, outer_angle } => {
                Self::spot(position, direction, intensity, inner_angle, outer_angle)
            }
            LightKind::Projector { position, direction, up, intensity, field_of_view, picture: _ } => {
                Self::projector(position, [direction, up], intensity, field_of_view, aspect)
            }
            LightKind::Directional { direction, irradiance, angular_diameter } => {
                Self::directional(-direction, irradiance, angular_diameter * 0.5, false, scene_radius)
            }
        }
    }

    /// A point.
    pub fn point(position: glam::Vec3, intensity: glam::Vec3) -> Self {
        let light = blank(LIGHT_POINT, position, intensity);
        let strength = strongest(light.emission);
        Self::new(light, strength, 4.0 * PI * strength)
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
        let falloff = optics::light::spot_falloff_parameters(cos(inner), cos(outer));
        light.edge1 = to_optics(direction);
        light.edge2 = vec3f(falloff.x, falloff.y, 0.0);
        let cone = 2.0 * PI * (1.0 - 0.5 * (cos(inner) + cos(outer)));
        let strength = strongest(light.emission);
        Self::new(light, strength, cone * strength)
    }

    /// A projector. `aim`: where it is aimed, and the direction of its picture's top;
    /// `field_of_view`: of the picture's shorter side, radians; `aspect`: its width over its
    /// height.
    fn projector(
        position: glam::Vec3,
        [direction, up]: [glam::Vec3; 2],
        intensity: glam::Vec3,
        field_of_view: f32,
        aspect: f32,
    ) -> Self {
        let right = direction.cross(up).try_normalize().unwrap_or_else(|| direction.any_orthonormal_vector());
        let down = direction.cross(right);
        let shorter = 2.0 * tan(0.5 * field_of_view.clamp(1e-3, WIDEST_PROJECTION));
        let (width, height) = (shorter * aspect.max(1.0), shorter / aspect.min(1.0));
        let mut light = blank(LIGHT_PROJECTOR, position, intensity);
        (light.edge1, light.edge2) = (to_optics(right * width), to_optics(down * height));
        let strength = strongest(light.emission);
        // Solid angle of a rectangle that is seen from in front of its centre.
        let solid_angle =
            4.0 * asin(width * height / (4.0 + width * width).sqrt() / (4.0 + height * height).sqrt());
        Self::new(light, strength, solid_angle * strength)
    }

    /// A point or spot with a profile that begins at `place`. A spot's profile is aimed as the spot
    /// is.
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
        self.power = photometry.profile.integral(within) * strongest(light.emission);
        self.profile = place;
        self
    }

    /// A light infinitely far away, in unit direction `towards`; `scene_radius` turns irradiance
    /// into power.
    pub fn directional(
        towards: glam::Vec3,
        irradiance: glam::Vec3,
        angular_radius: f32,
        visible: bool,
        scene_radius: f32,
    ) -> Self {
        let strength = strongest(to_optics(irradiance));
        let power = PI * scene_radius * scene_radius * strength;
        let half_sine = sin(angular_radius * 0.5);
        let one_minus_cos = 2.0 * half_sine * half_sine;
        let mut light = blank(LIGHT_DIRECTIONAL, towards, irradiance);
        if one_minus_cos > 0.0 {
            // Irradiance of a disc that faces the surface: radiance · π sin². The cosine inside it
            // is counted.
            let sin2 = one_minus_cos * (2.0 - one_minus_cos);
            light.size = one_minus_cos;
            light.emission = to_optics(irradiance / (PI * sin2));
        }
        Self { visible: visible && one_minus_cos > 0.0, ..Self::new(light, strength, power) }
    }

    /// The environment behind portals: what comes in through them. `mean`: of its radiance, in the
    /// strongest channel.
    pub fn portals(mean: f32, portals: &[Portal]) -> Self {
        let corners = || portals.iter().flat_map(Portal::corners);
        let low = corners().fold(glam::Vec3::INFINITY, glam::Vec3::min);
        let high = corners().fold(glam::Vec3::NEG_INFINITY, glam::Vec3::max);
        let center = (low + high) * 0.5;
        let radius = corners().map(|corner| corner.distance(center)).fold(f32::MIN_POSITIVE, f32::max);
        let strength = mean * portals.iter().map(Portal::area).sum::<f32>();
        let light = blank(LIGHT_ENVIRONMENT, glam::Vec3::ZERO, glam::Vec3::ZERO);
        Self { portals: center.extend(radius).to_array(), ..Self::new(light, strength, PI * strength) }
    }

    /// The environment image, whose own table samples it. `mean`: of its radiance, in the strongest
    /// channel.
    pub fn environment(mean: f32, scene_radius: f32) -> Self {
        let light = blank(LIGHT_ENVIRONMENT, glam::Vec3::ZERO, glam::Vec3::ZERO);
        // What an environment gives to surfaces of all directions on average.
        let strength = PI * mean;
        Self::new(light, strength, 4.0 * PI * scene_radius * scene_radius * strength)
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

fn to_optics(v: glam::Vec3) -> Vec3f {
    vec3f(v.x, v.y, v.z)
}

/// The strongest channel of a colour: what weighs lights against each other. Luminance would let
/// blue ones starve.
pub(super) fn strongest(c: Vec3f) -> f32 {
    optics::math::max_component(c)
}
