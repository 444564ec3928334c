//! Light sources, and what makes shapes shine.

use super::Builder;
use super::parameters::{Parameters, Spectrum};
use super::state::AreaLight;
use crate::load::environment;
use crate::load::textures::Neutral;
use crate::{
    ColorSpace, Environment, Image, Light, LightKind, LoadError, Pixels, Portal, TextureRef, UvTransform,
    Wrap,
};
use elementary::{atan, cos, powi, sin};
use glam::{DAffine3, DMat3, DVec3, Vec2, Vec3};

/// Height of the picture that an environment map is turned into, pixels.
const MAX_ENVIRONMENT_HEIGHT: u32 = 2048;

/// An environment map on its way into the scene.
pub(super) struct PendingEnvironment {
    pub image: Image,
    pub scale: f32,
}

impl Builder<'_> {
    pub(super) fn add_light(&mut self, kind: &str, p: &Parameters) -> Result<(), LoadError> {
        if self.state.moves() {
            self.report.approximated(format!("{}: lights without a shape do not move", p.place));
        }
        let to_world = self.mirror * self.state.transform;
        let point = |v: Vec3| to_world.transform_point3(v.as_dvec3());
        let from = p.vector("from").unwrap_or(Vec3::ZERO);
        let to = p.vector("to").unwrap_or(Vec3::Z);
        let direction = (point(to) - point(from)).normalize_or(DVec3::NEG_Y).as_vec3();
        let position = Vec3::ZERO;
        let scale = p.number_or("scale", 1.0);
        let kind = match kind {
            "point" => {
                let intensity = self.color(p, "I") * scale * self.power(p, 4.0 * std::f32::consts::PI, "I");
                LightKind::Point { position, intensity }
            }
            "spot" => {
                let outer = p.number_or("coneangle", 30.0).clamp(0.01, 90.0);
                let inner = (outer - p.number_or("conedeltaangle", 5.0)).clamp(0.0, outer * 0.9999);
                let (outer_angle, inner_angle) = (outer.to_radians(), inner.to_radians());
                let cone = std::f32::consts::TAU * (1.0 - 0.5 * (cos(outer_angle) + cos(inner_angle)));
                let intensity = self.color(p, "I") * scale * self.power(p, cone, "I");
                LightKind::Spot { position, direction, intensity, inner_angle, outer_angle }
            }
            "projection" => self.projection(p, to_world.matrix3, scale)?,
            "distant" => {
                let mut irradiance = self.color(p, "L") * scale;
                if let Some(illuminance) = p.number("illuminance") {
                    irradiance *= illuminance / luminance(irradiance).max(f32::MIN_POSITIVE);
                }
                LightKind::Directional { direction, irradiance, angular_diameter: 0.0 }
            }
            "infinite" => return self.add_environment(p, scale),
            other => {
                self.report.ignored(format!("{}: the light source {other} is not supported", p.place));
                return Ok(());
            }
        };
        let name = format!("light {}", self.scene.lights.len());
        self.scene.lights.push(Light::new(name, kind));
        // A projection begins at the origin of its space.
        let from = if matches!(kind, LightKind::Projector { .. }) { Vec3::ZERO } else { from };
        self.light_positions.push(point(from));
        Ok(())
    }

    /// A picture that is thrown along +z, with its top towards +y and its right towards +x.
    fn projection(&mut self, p: &Parameters, to_world: DMat3, scale: f32) -> Result<LightKind, LoadError> {
        let Some(file) = p.text("filename") else {
            return Err(self.parser.error(&p.place, "a projection needs a `filename`"));
        };
        if p.number("power").is_some() {
            self.report
                .ignored(format!("{}: the power of a projection is not used, only its scale", p.place));
        }
        let image = self.images.file(&self.parser.resolve(&p.place, file), Neutral::White);
        let texture = self.texture(image, ColorSpace::Srgb, Wrap::ClampToEdge);
        let direction = to_world.z_axis.normalize_or(DVec3::NEG_Z);
        // What is mirrored throws a mirrored picture.
        let is_mirrored = direction.cross(to_world.y_axis).dot(to_world.x_axis) < 0.0;
        let mirrored = UvTransform { rows: [Vec2::NEG_X, Vec2::Y], offset: Vec2::X };
        let transform = if is_mirrored { mirrored } else { UvTransform::default() };
        Ok(LightKind::Projector {
            position: Vec3::ZERO,
            direction: direction.as_vec3(),
            up: to_world.y_axis.normalize_or(DVec3::Y).as_vec3(),
            intensity: Vec3::splat(scale),
            field_of_view: p.number_or("fov", 90.0).clamp(0.1, 170.0).to_radians(),
            picture: TextureRef { transform, ..TextureRef::new(texture) },
        })
    }

    /// The factor that gives a light the power that its file asks for; `extent` is its luminous solid angle.
    fn power(&self, p: &Parameters, extent: f32, name: &str) -> f32 {
        let Some(power) = p.number("power") else { return 1.0 };
        let color = match p.spectrum(name) {
            Some(Spectrum::Color(color)) => color,
            _ => Vec3::ONE,
        };
        power / (extent * luminance(color) * p.number_or("scale", 1.0)).max(f32::MIN_POSITIVE)
    }

    /// A colour of a light; white where it is not known.
    pub(super) fn color(&mut self, p: &Parameters, name: &str) -> Vec3 {
        match p.spectrum(name) {
            None => Vec3::ONE,
            Some(Spectrum::Color(color)) => color.max(Vec3::ZERO),
            Some(Spectrum::Named(spectrum)) => {
                if !spectrum.starts_with("stdillum-D65") {
                    self.report.approximated(format!(
                        "{}: the light's spectrum {spectrum} is taken as white",
                        p.place
                    ));
                }
                Vec3::ONE
            }
            Some(Spectrum::Texture(texture)) => {
                self.report.ignored(format!("{}: a light cannot have the texture {texture}", p.place));
                Vec3::ONE
            }
        }
    }

    fn add_environment(&mut self, p: &Parameters, mut scale: f32) -> Result<(), LoadError> {
        if !p.numbers("portal").is_empty() {
            self.add_portal(p)?;
        }
        if self.environment.is_some() || self.scene.environment != Environment::Black {
            self.report.ignored(format!("{}: of several infinite lights only the last is used", p.place));
        }
        let Some(name) = p.text("filename") else {
            let mut color = self.color(p, "L") * scale;
            if let Some(illuminance) = p.number("illuminance") {
                color *= illuminance / (std::f32::consts::PI * luminance(color)).max(f32::MIN_POSITIVE);
            }
            (self.scene.environment, self.environment) = (Environment::Constant(color), None);
            return Ok(());
        };
        let path = self.parser.resolve(&p.place, name);
        let image = environment::load(&path, self.options, &mut self.report)?;
        if image.width != image.height {
            let message = format!("{name} is not square, as environment maps of pbrt-v4 are");
            return Err(self.parser.error(&p.place, message));
        }
        let to_world = self.mirror * self.state.transform;
        let image = equirectangular(&image, &to_world);
        if let Some(illuminance) = p.number("illuminance") {
            scale *= illuminance / upward_illuminance(&image).max(f32::MIN_POSITIVE);
        }
        (self.scene.environment, self.environment) =
            (Environment::Black, Some(PendingEnvironment { image, scale }));
        Ok(())
    }

    /// The opening that an environment is seen through, four points in world space.
    fn add_portal(&mut self, p: &Parameters) -> Result<(), LoadError> {
        let corner =
            |c: &[f32]| self.mirror.transform_point3(DVec3::new(c[0].into(), c[1].into(), c[2].into()));
        let corners: Vec<DVec3> = p.numbers("portal").chunks_exact(3).map(corner).collect();
        let Ok(corners) = <[DVec3; 4]>::try_from(corners) else {
            return Err(self.parser.error(&p.place, "the portal of an infinite light needs four points"));
        };
        let relative = corners.map(|corner| (corner - corners[0]).as_vec3());
        Portal::new(relative).map_err(|e| self.parser.error(&p.place, e.to_string()))?;
        self.portal = Some(corners);
        // pbrt takes all other light away; here it comes in elsewhere, too, if there is a way.
        self.report
            .approximated(format!("{}: light of an environment comes in beside its portal, too", p.place));
        Ok(())
    }

    pub(super) fn set_area_light(&mut self, kind: &str, p: &Parameters) {
        if kind != "diffuse" {
            return self.report.ignored(format!("{}: the area light {kind} is not supported", p.place));
        }
        if p.text("filename").is_some() || p.number("power").is_some() {
            self.report.ignored(format!(
                "{}: pictures and power of area lights are not used, only their L",
                p.place
            ));
        }
        let emission = self.color(p, "L") * p.number_or("scale", 1.0);
        let two_sided = p.truth("twosided").unwrap_or(false);
        self.state.area_light = Some(AreaLight { emission, two_sided });
    }

    /// Puts the environment into the scene, after all other images.
    pub(super) fn finish_environment(&mut self) {
        let Some(PendingEnvironment { image, scale }) = self.environment.take() else { return };
        let number = self.scene.images.len() as u32;
        self.scene.images.push(image);
        self.scene.environment = Environment::Image { image: number, rotation: 0.0, intensity: scale };
    }
}

fn luminance(c: Vec3) -> f32 {
    c.dot(Vec3::new(0.212_6, 0.715_2, 0.072_2))
}

/// The square map of a sphere as an equirectangular picture; `to_world` turns directions of the map.
fn equirectangular(square: &Image, to_world: &DAffine3) -> Image {
    let Pixels::Rgb32F(pixels) = &square.pixels else { return square.clone() };
    let height = square.height.clamp(1, MAX_ENVIRONMENT_HEIGHT);
    let width = 2 * height;
    let to_map = to_world.matrix3.inverse();
    let mut out = Vec::with_capacity(width as usize * height as usize);
    for y in 0..height {
        for x in 0..width {
            let uv = optics::vec2f((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32);
            let direction = optics::sky::equirect_to_direction(uv, 0.0).to_array().map(f64::from);
            let [u, v] = equal_area_square((to_map * DVec3::from_array(direction)).normalize_or(DVec3::Z));
            let texel = |t: f64| ((t * f64::from(square.width)) as u32).min(square.width - 1);
            out.push(pixels[(texel(v) * square.width + texel(u)) as usize]);
        }
    }
    Image { name: square.name.clone(), width, height, pixels: Pixels::Rgb32F(out) }
}

/// Where a unit direction is in a square of equal areas, both coordinates in `[0, 1]`.
///
/// Source: Clarberg, "Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD", Journal of Graphics Tools 13, 2008.
fn equal_area_square(d: DVec3) -> [f64; 2] {
    let a = d.abs();
    let r = (1.0 - a.z).max(0.0).sqrt();
    let (long, short) = (a.x.max(a.y), a.x.min(a.y));
    let angle = if long > 0.0 { atan(short / long) * std::f64::consts::FRAC_2_PI } else { 0.0 };
    let angle = if a.x < a.y { 1.0 - angle } else { angle };
    let v = angle * r;
    let u = r - v;
    let (u, v) = if d.z < 0.0 { (1.0 - v, 1.0 - u) } else { (u, v) };
    [0.5 * (u.copysign(d.x) + 1.0), 0.5 * (v.copysign(d.y) + 1.0)]
}

/// Illuminance of a surface that faces upwards.
fn upward_illuminance(image: &Image) -> f32 {
    let Pixels::Rgb32F(pixels) = &image.pixels else { return 0.0 };
    let (width, height) = (image.width as usize, f64::from(image.height));
    let mut sum = 0.0;
    for (i, pixel) in pixels.iter().enumerate() {
        let theta = ((i / width) as f64 + 0.5) / height * std::f64::consts::PI;
        let area = sin(theta) * powi(std::f64::consts::PI / height, 2);
        sum += f64::from(luminance(Vec3::from_array(*pixel))) * cos(theta).max(0.0) * area;
    }
    sum as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_square_has_the_poles_in_the_middle_and_in_the_corners() {
        let at = |x, y, z| equal_area_square(DVec3::new(x, y, z));
        assert_eq!(at(0.0, 0.0, 1.0), [0.5, 0.5]);
        assert_eq!(at(1.0, 0.0, 0.0), [1.0, 0.5]);
        assert_eq!(at(0.0, -1.0, 0.0), [0.5, 0.0]);
        assert_eq!(at(0.0, 0.0, -1.0), [1.0, 1.0], "the lower pole is in all four corners");
    }

    /// Equal areas of the sphere have equal areas of the square.
    #[test]
    fn areas_are_kept() {
        let n = 400;
        let mut counts = [0u32; 16];
        for i in 0..n * n {
            // Equal areas of the sphere: equal steps of z and of the angle.
            let (z, phi) = ((f64::from(i / n) + 0.5) / f64::from(n) * 2.0 - 1.0, f64::from(i % n) + 0.5);
            let (sin, cos) = (phi / f64::from(n) * std::f64::consts::TAU).sin_cos();
            let r = (1.0 - z * z).sqrt();
            let [u, v] = equal_area_square(DVec3::new(r * cos, r * sin, z));
            counts[(u * 3.999) as usize + 4 * (v * 3.999) as usize] += 1;
        }
        let mean = f64::from(n * n) / 16.0;
        assert!(counts.iter().all(|c| (f64::from(*c) / mean - 1.0).abs() < 0.03), "{counts:?}");
    }
}
