//! Switch by photons: light that comes by mirrors or through glass, stored where it arrives.
//!
//! A photon leaves a light, aimed at the specular surfaces, goes on by specular scattering alone, and is stored at each
//! surface behind. Camera paths gather the photons around the points where they scatter. A pass of photons serves some
//! samples of every pixel, and the radius shrinks from pass to pass, so that the mean converges to the picture.
//!
//! The same light is found by chance where a camera path goes through glass to a lamp. Both count by the balance
//! heuristic: how many photons were to be expected in the disc that is gathered, against the one sampled direction.
//!
//! Sources: Jensen, "Global Illumination using Photon Maps", 1996; Knaus and Zwicker, "Progressive Photon Mapping: A
//! Probabilistic Approach", 2011 (the radius); Georgiev et al., "Light Transport Simulation with Vertex Connection and
//! Merging", 2012 (the weights); Veach 1997, section 5.3 (what differs for light that goes the other way).

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod photons {
    use crate::constants::*;
    use crate::frame::*;
    use crate::light::*;
    use crate::random::*;
    use crate::warp::*;
    use wgsl_rs::std::*;

    /// Samples of each pixel that one pass of photons serves.
    pub const SAMPLES_PER_PASS: u32 = 4u32;
    /// Density of photons of lights that no path finds by chance: points, and suns without a disc.
    pub const ONLY_PHOTONS: f32 = 1e30;

    /// The pair that says at which point a photon leaves its light, or from which of a sun's or sky's directions it comes.
    pub const PAIR_EMISSION: u32 = 0u32;
    /// The pair that says where in a target a photon is aimed.
    pub const PAIR_AIM: u32 = 1u32;
    /// x: of which light a photon is. y: at which target it is aimed.
    pub const PAIR_CHOICE: u32 = 0xfffffffdu32;

    /// The random numbers of a photon of a pass.
    pub fn photon_sampler(seed: u32, pass_index: u32, photon: u32) -> PixelSampler {
        PixelSampler {
            kind: SAMPLER_SOBOL,
            scramble: hash_combine(hash_combine(seed, 0x70b07075u32), pass_index),
            index: reverse_bits(photon),
        }
    }

    /// The pass of photons that a sample of a pixel gathers from.
    pub fn photon_pass(sample_index: u32) -> u32 {
        sample_index / SAMPLES_PER_PASS
    }

    /// The square of a pass's radius, m². `first`: that of pass 0.
    ///
    /// It falls with the power α − 1 of the number of passes, α = 2/3: bias and variance of the mean of all passes then
    /// vanish at the best joint rate (Knaus and Zwicker 2011, section 5).
    pub fn photon_radius2(first: f32, pass_index: u32) -> f32 {
        first * pow(f32(pass_index) + 1.0, -0.33333334)
    }

    /// What a photon counts at a distance, m⁻²: Epanechnikov's kernel, whose integral over the disc is 1.
    ///
    /// `distance2`, `radius2`: squares of the distance and of the disc's radius, m².
    pub fn photon_kernel(distance2: f32, radius2: f32) -> f32 {
        max(1.0 - distance2 / radius2, 0.0) * 2.0 * INV_PI / radius2
    }

    /// Photons to be expected in a disc for each that is emitted per unit of étendue (m² sr), over the density with
    /// which a path would take the same direction.
    ///
    /// - `count`: photons of a pass. `radius2`: of the disc, m². `cos_theta`: of the direction with the geometric normal.
    /// - `pdf`: over solid angle, of the path's direction.
    pub fn expected_photons(count: f32, radius2: f32, cos_theta: f32, pdf: f32) -> f32 {
        count * PI * radius2 * abs(cos_theta) / max(pdf, 1e-20)
    }

    /// What light counts that photons have brought. `expected`: [`expected_photons`] times the density per étendue with
    /// which this one was emitted.
    pub fn photon_share(expected: f32) -> f32 {
        let most = min(expected, ONLY_PHOTONS);
        most / (1.0 + most)
    }

    /// What the same light counts where a path has found it by chance.
    pub fn chance_share(expected: f32) -> f32 {
        1.0 / (1.0 + min(expected, ONLY_PHOTONS))
    }

    /// By what étendue grows through an interface: the square of the relative index of refraction. `bends`: whether
    /// light is refracted there, and neither reflected nor let straight through.
    pub fn etendue_scale(eta: f32, bends: bool) -> f32 {
        select(1.0, eta * eta, bends)
    }

    /// What a BSDF counts more for photons than for paths, where the shading normal is not the surface's own (Veach
    /// 1997, equation 5.19).
    ///
    /// - `wo`, `wi`: unit directions back along the photon's way, and onwards. `shading`, `normal`: unit normals.
    pub fn adjoint_factor(wo: Vec3f, wi: Vec3f, shading: Vec3f, normal: Vec3f) -> f32 {
        let seen = abs(dot(wo, shading)) * abs(dot(wi, normal));
        let own = abs(dot(wo, normal)) * abs(dot(wi, shading));
        // Grazing, the quotient has no bound.
        clamp(seen / max(own, 1e-6), 0.0, 10.0)
    }

    /// The solid angle of the cone in which rays from `p` meet a sphere, sr; all directions from inside.
    pub fn target_solid_angle(center: Vec3f, radius: f32, p: Vec3f) -> f32 {
        let to_center = center - p;
        TAU * sphere_one_minus_cos(dot(to_center, to_center), radius)
    }

    /// A direction from `p` within the cone of [`target_solid_angle`], uniform.
    pub fn target_direction(center: Vec3f, radius: f32, p: Vec3f, u: Vec2f) -> Vec3f {
        let to_center = center - p;
        let distance2 = dot(to_center, to_center);
        let one_minus_cos = sphere_one_minus_cos(distance2, radius);
        if distance2 <= 0.0 {
            return sample_sphere(u);
        }
        to_world(frame_from_normal(to_center * (1.0 / sqrt(distance2))), sample_cone(u, one_minus_cos))
    }

    /// Whether a unit direction from `p` is in the cone of [`target_solid_angle`].
    pub fn target_is_ahead(center: Vec3f, radius: f32, p: Vec3f, direction: Vec3f) -> bool {
        let to_center = center - p;
        let distance2 = dot(to_center, to_center);
        let one_minus_cos = sphere_one_minus_cos(distance2, radius);
        let along = dot(to_center, direction);
        let aside = to_center - direction * along;
        one_minus_cos >= 2.0 || (along > 0.0 && dot(aside, aside) <= radius * radius)
    }

    /// Whether a line through `p` meets a sphere, which it does in its disc across the line.
    pub fn target_is_crossed(center: Vec3f, radius: f32, p: Vec3f, direction: Vec3f) -> bool {
        let to_center = center - p;
        let aside = to_center - direction * dot(to_center, direction);
        dot(aside, aside) <= radius * radius
    }

    /// A point of a sphere's disc across a unit direction, uniform in area.
    pub fn target_disc_point(center: Vec3f, radius: f32, direction: Vec3f, u: Vec2f) -> Vec3f {
        let d = sample_disk(u) * radius;
        center + to_world(frame_from_normal(direction), vec3f(d.x, d.y, 0.0))
    }

    /// The cell of a grid that a point is in; whole numbers. `per_metre`: 1 / edge of a cell.
    pub fn photon_cell(p: Vec3f, per_metre: f32) -> Vec3f {
        // The sum leaves no negative zeros, whose bits are others.
        floor(p * per_metre) + vec3f(0.0, 0.0, 0.0)
    }

    /// The bucket of a cell, of `count`, a power of two.
    pub fn photon_bucket(cell: Vec3f, count: u32) -> u32 {
        let x = hash_combine(bitcast_u32(cell.x), bitcast_u32(cell.y));
        hash_combine(x, bitcast_u32(cell.z)) & (count - 1u32)
    }
}

#[cfg(test)]
mod tests {
    use super::photons::*;
    use crate::vector::{dot, normalize};
    use crate::{vec2f, vec3f};

    #[test]
    fn the_kernel_counts_a_photon_once() {
        let (radius2, n) = (0.7f32, 20_000);
        let ring = |i: i32| {
            let r = (i as f32 + 0.5) / n as f32 * radius2.sqrt();
            photon_kernel(r * r, radius2) * std::f32::consts::TAU * r * radius2.sqrt() / n as f32
        };
        let whole: f32 = (0..n).map(ring).sum();
        assert!((whole - 1.0).abs() < 1e-3, "{whole}");
        assert_eq!(photon_kernel(0.71, radius2), 0.0);
    }

    #[test]
    fn shares_are_all_of_the_light() {
        for expected in [0.0, 1e-12, 0.3, 7.0, 1e20, ONLY_PHOTONS, f32::MAX] {
            let sum = photon_share(expected) + chance_share(expected);
            assert!((sum - 1.0).abs() < 1e-6, "{expected}: {sum}");
        }
        assert_eq!(photon_share(ONLY_PHOTONS), 1.0);
    }

    #[test]
    fn radii_shrink_by_the_sixth_root_of_passes() {
        assert_eq!(photon_radius2(0.5, 0), 0.5);
        assert!((photon_radius2(1.0, 63) - 0.25).abs() < 1e-5);
    }

    #[test]
    fn what_is_aimed_at_a_target_meets_it() {
        let (center, radius) = (vec3f(1.0, -2.0, 0.5), 0.4);
        for i in 0..1000 {
            let f = i as f32 / 1000.0;
            let (p, u) = (vec3f(3.0 * f, 1.0 - f, f), vec2f(f, (f * 37.0).fract()));
            let d = target_direction(center, radius * 0.999, p, u);
            assert!(target_is_ahead(center, radius, p, d), "{i}");
            assert!(!target_is_ahead(center, radius, p, d * -1.0), "{i}");
            let along = normalize(vec3f(f - 0.5, 1.0, 0.3));
            let q = target_disc_point(center, radius * 0.999, along, u);
            assert!(dot(q - center, along).abs() < 1e-5);
            assert!(target_is_crossed(center, radius, q + along * 9.0, along), "{i}");
        }
    }

    #[test]
    fn cells_are_told_apart_on_both_sides_of_zero() {
        let at = |x: f32| photon_cell(vec3f(x, 0.0, -0.0), 2.0);
        assert_eq!((at(-0.1).x, at(0.1).x, at(0.6).x), (-1.0, 0.0, 1.0));
        assert_eq!(photon_bucket(at(0.1), 64), photon_bucket(at(0.4), 64));
        let buckets: std::collections::HashSet<_> =
            (0..64).map(|i| photon_bucket(at(i as f32), 1 << 20)).collect();
        assert!(buckets.len() > 60);
    }
}
