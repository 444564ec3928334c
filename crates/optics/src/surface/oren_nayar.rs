//! Rough diffuse reflection: EON, the energy-preserving model of Oren and Nayar.
//!
//! A rough surface is made of diffuse facets. Light that they reflect once is FON, Fujii's form of
//! Oren and Nayar's model: it returns towards where it came from, so edges are bright. The light
//! that it lacks is what facets pass on to each other; a second, reciprocal term gives it back, and
//! a white surface absorbs nothing.
//!
//! Source: Portsmouth, Kutz and Hill, "EON: A practical energy-preserving rough diffuse BRDF", JCGT
//! 14(1), 2025.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod oren_nayar {
    use crate::constants::*;
    use crate::warp::*;
    use wgsl_rs::std::*;

    /// What FON reflects less along the normal, for each unit of roughness: 1/2 − 2 / (3π).
    pub const FON_NORMAL: f32 = 0.2877934092;
    /// What FON reflects more on average than along the normal, for each unit of roughness: 2/3 −
    /// 28 / (15π).
    pub const FON_MEAN: f32 = 0.0724882125;
    /// Samples of the roughest surface that are uniform over the hemisphere. They keep weights
    /// below 10, where a surface seen at a grazing angle reflects more than cosines expect.
    pub const UNIFORM_DIFFUSE_SHARE: f32 = 0.2;

    /// A rough diffuse surface, prepared for one direction towards the viewer. Colours are albedos.
    #[derive(Clone, Copy, Debug)]
    pub struct RoughDiffuse {
        /// Roughness in `[0, 1]`; 0 is Lambert's surface.
        pub roughness: f32,
        /// Light that facets reflect once.
        pub single: Vec3f,
        /// Light that they reflect several times; multiplies what FON lacks towards the light.
        pub multiple: Vec3f,
    }

    /// Directional albedo of FON with white facets, by the paper's fit (error below 0.1 %).
    /// `cos_theta` in `[0, 1]`.
    pub fn fon_albedo(cos_theta: f32, roughness: f32) -> f32 {
        let x = 1.0 - cos_theta;
        let grazing = x * (0.0571085289 + x * (0.491881867 + x * (-0.332181442 + x * 0.0714429953)));
        (1.0 + roughness * grazing) / (1.0 + FON_NORMAL * roughness)
    }

    /// What FON with white facets lacks towards a direction, in `[0, 1]`.
    pub fn fon_lost(cos_theta: f32, roughness: f32) -> f32 {
        max(1.0 - fon_albedo(cos_theta, roughness), 0.0)
    }

    /// Mean albedo of FON with white facets, weighted by the cosine.
    pub fn fon_mean_albedo(roughness: f32) -> f32 {
        (1.0 + FON_MEAN * roughness) / (1.0 + FON_NORMAL * roughness)
    }

    /// Albedo of the light that facets of a colour reflect more than once.
    pub fn eon_multiple_albedo(color: Vec3f, roughness: f32) -> Vec3f {
        let mean = fon_mean_albedo(roughness);
        color * color * mean / (vec3f(1.0, 1.0, 1.0) - color * (1.0 - mean))
    }

    /// Directional albedo of the surface: what it reflects of uniform light, seen at `cos_o` in
    /// `[0, 1]`.
    ///
    /// - `color`: linear, in `[0, 1]`. `roughness`: in `[0, 1]`; with 0 the albedo is the colour.
    pub fn eon_albedo(color: Vec3f, roughness: f32, cos_o: f32) -> Vec3f {
        let lost = fon_lost(cos_o, roughness);
        color * (1.0 - lost) + eon_multiple_albedo(color, roughness) * lost
    }

    /// Prepares the surface for a viewer at `cos_o`; see [`eon_albedo`].
    pub fn rough_diffuse(color: Vec3f, roughness: f32, cos_o: f32) -> RoughDiffuse {
        let mean_lost = max(1.0 - fon_mean_albedo(roughness), 1e-7);
        let share = fon_lost(cos_o, roughness) / mean_lost;
        RoughDiffuse {
            roughness: roughness,
            single: color * (1.0 / (1.0 + FON_NORMAL * roughness)),
            multiple: eon_multiple_albedo(color, roughness) * share,
        }
    }

    /// The surface of which a share is left.
    pub fn scaled_rough_diffuse(d: RoughDiffuse, share: f32) -> RoughDiffuse {
        RoughDiffuse { roughness: d.roughness, single: d.single * share, multiple: d.multiple * share }
    }

    /// π times the BRDF: the albedo of Lambert's surface that reflects as much from `wi` to `wo`,
    /// both above the surface.
    pub fn rough_diffuse_factor(d: RoughDiffuse, wo: Vec3f, wi: Vec3f) -> Vec3f {
        let s = dot(wo, wi) - wo.z * wi.z;
        let towards_light = select(s, s / max(max(wo.z, wi.z), 1e-6), s > 0.0);
        d.single * (1.0 + d.roughness * towards_light) + d.multiple * fon_lost(wi.z, d.roughness)
    }

    /// A direction above the surface: most by the cosine, some uniform.
    pub fn sample_rough_diffuse(roughness: f32, u: Vec2f) -> Vec3f {
        let share = UNIFORM_DIFFUSE_SHARE * roughness;
        if u.x < share {
            return sample_cone(vec2f(min(u.x / share, ONE_MINUS_EPSILON), u.y), 1.0);
        }
        sample_cosine_hemisphere(vec2f(min((u.x - share) / (1.0 - share), ONE_MINUS_EPSILON), u.y))
    }

    /// Density over solid angle of [`sample_rough_diffuse`].
    pub fn pdf_rough_diffuse(roughness: f32, cos_i: f32) -> f32 {
        mix(pdf_cosine_hemisphere(cos_i), 0.5 * INV_PI, UNIFORM_DIFFUSE_SHARE * roughness)
    }
}

#[cfg(test)]
mod tests {
    use super::oren_nayar::*;
    use crate::{Vec3f, vec2f, vec3f};
    use std::f64::consts::PI;

    const COLOR: Vec3f = Vec3f::vec3(1.0, 0.5, 0.1);

    fn direction(cos: f32, turns: f32) -> Vec3f {
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let phi = turns * std::f32::consts::TAU;
        vec3f(sin * phi.cos(), sin * phi.sin(), cos)
    }

    /// ∫ factor / π · cos dω for all channels, by midpoints.
    fn reflected(color: Vec3f, roughness: f32, wo: Vec3f) -> [f64; 3] {
        let d = rough_diffuse(color, roughness, wo.z);
        let (rows, columns) = (400, 400);
        let mut sum = [0.0; 3];
        for i in 0..rows {
            // Rows of equal cos² weigh directions by the cosine.
            let cos = ((i as f32 + 0.5) / rows as f32).sqrt();
            for j in 0..columns {
                let wi = direction(cos, (j as f32 + 0.5) / columns as f32);
                let factor = rough_diffuse_factor(d, wo, wi).to_array();
                sum.iter_mut().zip(factor).for_each(|(sum, f)| *sum += f64::from(f));
            }
        }
        sum.map(|sum| sum / f64::from(rows * columns))
    }

    /// White stays white, and colours reflect the albedo that is told.
    #[test]
    fn the_albedo_is_the_integral() {
        for roughness in [0.0, 0.25, 0.5, 1.0] {
            for cos in [1.0, 0.6, 0.3, 0.1] {
                let integral = reflected(COLOR, roughness, direction(cos, 0.2));
                let told = eon_albedo(COLOR, roughness, cos).to_array();
                for (i, t) in integral.into_iter().zip(told) {
                    assert!(
                        (i - f64::from(t)).abs() < 1.5e-3,
                        "roughness {roughness}, cosine {cos}: {i} and {t}"
                    );
                }
                assert!(
                    (integral[0] - 1.0).abs() < 1.5e-3,
                    "roughness {roughness}, cosine {cos}: {integral:?}"
                );
            }
        }
    }

    /// The fit against the closed form (eq. 14 of the paper), and the mean against the fit.
    #[test]
    fn the_fit_is_the_closed_form() {
        for roughness in [0.1f64, 0.5, 1.0] {
            let a = 1.0 / (1.0 + (0.5 - 2.0 / (3.0 * PI)) * roughness);
            let mut mean = 0.0;
            for i in 0..1000 {
                let mu = (f64::from(i) + 0.5) / 1000.0;
                let sin = (1.0 - mu * mu).sqrt();
                let g = sin * (mu.acos() - sin * mu) + 2.0 / 3.0 * (sin / mu * (1.0 - sin.powi(3)) - sin);
                let exact = a * (1.0 + roughness * g / PI);
                let fit = f64::from(fon_albedo(mu as f32, roughness as f32));
                assert!((fit - exact).abs() < 1e-3, "roughness {roughness}, cosine {mu}: {fit} and {exact}");
                mean += 2.0 * mu * exact / 1000.0;
            }
            assert!((f64::from(fon_mean_albedo(roughness as f32)) - mean).abs() < 1e-4, "{mean}");
        }
    }

    #[test]
    fn it_is_reciprocal_and_never_negative() {
        for k in 0..4000u32 {
            let at = |step: f32| (step * k as f32).fract();
            let (wo, wi) = (direction(at(0.618) + 1e-3, at(0.377)), direction(at(0.755) + 1e-3, at(0.569)));
            let roughness = at(0.819);
            let value = |wo: Vec3f, wi: Vec3f| {
                rough_diffuse_factor(rough_diffuse(COLOR, roughness, wo.z), wo, wi).to_array()
            };
            for (there, back) in value(wo, wi).into_iter().zip(value(wi, wo)) {
                assert!((there - back).abs() < 1e-5 * (1.0 + there), "{there} and {back}: {wo:?} {wi:?}");
                assert!(there >= 0.0, "{there}: {wo:?} {wi:?} {roughness}");
            }
        }
    }

    /// Without roughness it is Lambert's surface, to the bit.
    #[test]
    fn no_roughness_is_lambert() {
        for cos in [1.0, 0.3, 1e-4] {
            let d = rough_diffuse(COLOR, 0.0, cos);
            let (wo, wi) = (direction(cos, 0.1), direction(0.4, 0.7));
            assert_eq!(rough_diffuse_factor(d, wo, wi).to_array(), COLOR.to_array());
            assert_eq!(eon_albedo(COLOR, 0.0, cos).to_array(), COLOR.to_array());
            let u = vec2f(0.3, 0.8);
            let lambert = crate::warp::sample_cosine_hemisphere(u);
            assert_eq!(sample_rough_diffuse(0.0, u).to_array(), lambert.to_array());
            assert_eq!(pdf_rough_diffuse(0.0, 0.4), crate::warp::pdf_cosine_hemisphere(0.4));
        }
    }

    /// Weights of samples are bounded, at grazing angles too.
    #[test]
    fn weights_are_bounded() {
        for roughness in [0.01, 0.1, 0.5, 1.0] {
            for wo in [1.0, 0.1, 1e-3, 1e-6].map(|cos| direction(cos, 0.0)) {
                let d = rough_diffuse(vec3f(1.0, 1.0, 1.0), roughness, wo.z);
                for k in 0..20_000 {
                    let u = vec2f((k as f32 + 0.5) / 20_000.0, (k as f32 * 0.618).fract());
                    let wi = sample_rough_diffuse(roughness, u);
                    let value = rough_diffuse_factor(d, wo, wi).x * wi.z / std::f32::consts::PI;
                    let weight = value / pdf_rough_diffuse(roughness, wi.z);
                    assert!((0.0..=11.0).contains(&weight), "{weight} of {wi:?} from {wo:?}, {roughness}");
                }
            }
        }
    }
}
