//! Phong's highlight, for comparison with microfacets.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod phong {
    use crate::constants::*;
    use crate::math::*;
    use crate::scatter::*;
    use wgsl_rs::std::*;

    /// Widths below this have the same exponent: `f32` cannot raise a cosine near 1 to any higher power.
    pub const MIN_PHONG_ALPHA: f32 = 0.01;

    /// The exponent whose highlight is about as wide as that of GGX with this `alpha`.
    ///
    /// Blinn's exponent for the half vector is 2/α² − 2 (Walter et al. 2007, section 5.2). The angle to the mirrored
    /// direction is about twice that to the half vector, so the same highlight needs a quarter of it.
    pub fn phong_exponent(alpha: f32) -> f32 {
        let a = clamp(alpha, MIN_PHONG_ALPHA, 1.0);
        0.5 / (a * a) - 0.5
    }

    /// Value of a Lambertian surface with Phong's highlight, times the cosine of `wi`.
    ///
    /// - `b`: a glossy BSDF. Colours and width are taken from it; nothing depends on Fresnel's equations.
    /// - `wo`, `wi`: unit vectors in the shading frame.
    ///
    /// Reciprocal, and reflects no more than arrives: the highlight is scaled by (n + 2) / 2π, and what it takes is left out
    /// of the diffuse part. Source: Phong, "Illumination for Computer Generated Pictures", CACM 18(6), 1975; scaled as in
    /// Lafortune and Willems, "Using the Modified Phong Reflectance Model for Physically Based Rendering", 1994.
    pub fn phong_eval(b: Bsdf, wo: Vec3f, wi: Vec3f) -> Vec3f {
        if wi.z <= 0.0 || wo.z <= 0.0 {
            return vec3f(0.0, 0.0, 0.0);
        }
        let specular = min(b.specular, vec3f(1.0, 1.0, 1.0));
        let exponent = phong_exponent(b.alpha);
        // wo mirrored at the normal, times wi.
        let cos_mirrored = clamp(wo.z * wi.z - wo.x * wi.x - wo.y * wi.y, 0.0, 1.0);
        let highlight = (exponent + 2.0) * 0.5 * INV_PI * pow(cos_mirrored, exponent);
        let diffuse = b.diffuse * ((1.0 - max_component(specular)) * INV_PI);
        (diffuse + specular * highlight) * wi.z
    }
}

#[cfg(test)]
mod tests {
    use super::phong::*;
    use crate::scatter::{BSDF_GLOSSY, Bsdf, black_bsdf};
    use crate::{Vec3f, vec3f};
    use std::f32::consts::TAU;

    fn surface(alpha: f32, diffuse: f32, specular: f32) -> Bsdf {
        let color = |c| vec3f(c, c, c);
        Bsdf { kind: BSDF_GLOSSY, alpha, diffuse: color(diffuse), specular: color(specular), ..black_bsdf() }
    }

    fn direction(cos: f32, phi: f32) -> Vec3f {
        let sin = (1.0 - cos * cos).sqrt();
        vec3f(sin * phi.cos(), sin * phi.sin(), cos)
    }

    /// ∫ value · cos dω by midpoints.
    fn albedo(b: Bsdf, wo: Vec3f) -> f32 {
        let n = 400;
        let step = |k: usize| (k as f32 + 0.5) / n as f32;
        let row =
            |i| (0..n).map(move |j| phong_eval(b, wo, direction(step(i), TAU * step(j))).x).sum::<f32>();
        (0..n).map(row).sum::<f32>() * TAU / (n * n) as f32
    }

    #[test]
    fn seen_from_above_a_white_surface_reflects_everything_and_never_more() {
        for alpha in [0.1, 0.3, 1.0] {
            for specular in [0.0, 0.5, 1.0] {
                let b = surface(alpha, 1.0, specular);
                let above = albedo(b, direction(1.0, 0.0));
                assert!((above - 1.0).abs() < 2e-3, "{above} with alpha {alpha} and specular {specular}");
                for cos in [0.7, 0.3, 0.05] {
                    let slanted = albedo(b, direction(cos, 1.0));
                    assert!(slanted < 1.002, "{slanted} with alpha {alpha} at cosine {cos}");
                }
            }
        }
    }

    #[test]
    fn light_goes_both_ways_alike() {
        let (b, wo, wi) = (surface(0.3, 0.6, 0.4), direction(0.8, 0.3), direction(0.4, 2.9));
        let (there, back) = (phong_eval(b, wo, wi).x / wi.z, phong_eval(b, wi, wo).x / wo.z);
        assert!(there > 0.0 && (there - back).abs() < 1e-6 * there, "{there} and {back}");
    }

    #[test]
    fn extremes_are_finite() {
        for alpha in [0.0, 1e-30, 1.0] {
            for cos in [1e-20, 0.5, 1.0] {
                let value = phong_eval(surface(alpha, 1.0, 3.0), direction(cos, 0.0), direction(cos, 3.14));
                assert!(
                    value.x.is_finite() && value.x >= 0.0,
                    "{value:?} with alpha {alpha} at cosine {cos}"
                );
            }
        }
    }
}
