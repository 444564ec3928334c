//! Colours of a thin film on a surface.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod iridescence {
    use crate::fresnel::*;
    use crate::math::*;
    use wgsl_rs::std::*;

    /// The Fourier transform of the eye's sensitivity, as linear Rec. 709 RGB: what interference of light whose paths
    /// differ by `path_difference` (nanometres) with phase shifts `shift` (half turns) adds for each channel.
    ///
    /// Source: Belcour and Barla, "A Practical Extension to Microfacet Theory for the Modeling of Varying Iridescence",
    /// SIGGRAPH 2017: Gaussians fitted to the CIE XYZ curves, here with their constants multiplied out.
    pub fn interference_color(path_difference: f32, shift: Vec3f) -> Vec3f {
        let d = path_difference;
        let d2 = d * d;
        // Positions of the Gaussians are turns a nanometre: 2π of the authors' phase is one turn.
        let wave_x = cos_sin_turns(1.6810e-3 * d + 0.5 * shift.x).x;
        let wave_x2 = cos_sin_turns(2.2399e-3 * d + 0.5 * shift.x).x;
        let wave_y = cos_sin_turns(1.7953e-3 * d + 0.5 * shift.y).x;
        let wave_z = cos_sin_turns(2.2084e-3 * d + 0.5 * shift.z).x;
        let x =
            0.84659000 * wave_x * exp(-1.70854696e-7 * d2) + 0.15386831 * wave_x2 * exp(-1.78766171e-7 * d2);
        let y = 1.00022189 * wave_y * exp(-3.67330884e-7 * d2);
        let z = 1.00112249 * wave_z * exp(-2.61035245e-7 * d2);
        vec3f(
            3.2404542 * x - 1.5371385 * y - 0.4985314 * z,
            -0.9692660 * x + 1.8760108 * y + 0.0415560 * z,
            0.0556434 * x - 0.2040259 * y + 1.0572252 * z,
        )
    }

    /// Schlick's approximation for one channel.
    pub fn schlick(f0: f32, cos_theta: f32) -> f32 {
        f0 + (1.0 - f0) * schlick_weight(cos_theta)
    }

    /// Reflectance at normal incidence between the film, of index `film_ior`, and a base that would reflect `f0` in air.
    pub fn base_reflectance_in_film(f0: f32, film_ior: f32) -> f32 {
        // A reflectance of 1 has no index of refraction.
        let root = sqrt(clamp(f0, 0.0, 0.9999));
        let base_ior = (1.0 + root) / (1.0 - root);
        sqr((base_ior - film_ior) / (base_ior + film_ior))
    }

    /// Phase shift, in half turns, of reflection at a base that would reflect `f0` in air: 1 at a less dense medium.
    pub fn base_phase(f0: f32, film_ior: f32) -> f32 {
        let root = sqrt(clamp(f0, 0.0, 0.9999));
        let base_ior = (1.0 + root) / (1.0 - root);
        select(0.0, 1.0, base_ior < film_ior)
    }

    /// Reflectance, for each channel, of a base under a thin film in air; in `[0, 1]`.
    ///
    /// - `cos_theta`: of the light's direction with the normal, in `[0, 1]`. `film_ior` ≥ 1. `thickness`: nanometres.
    /// - `f0`: reflectance of the base at normal incidence, in air.
    ///
    /// Source: Belcour and Barla 2017, in the form of `KHR_materials_iridescence` and of the Khronos sample viewer:
    /// Schlick's approximation at both interfaces and the first two orders of interference.
    pub fn iridescent_fresnel(cos_theta: f32, film_ior: f32, thickness: f32, f0: Vec3f) -> Vec3f {
        // A film that is thinner than any wave is none.
        let ior = mix(1.0, film_ior, smoothstep(0.0, 0.03, thickness));
        let cos2_film = 1.0 - (1.0 - cos_theta * cos_theta) / (ior * ior);
        if cos2_film < 0.0 {
            return vec3f(1.0, 1.0, 1.0);
        }
        let cos_film = sqrt(cos2_film);
        let r12 = fresnel_dielectric(cos_theta, ior).reflectance;
        let t121 = 1.0 - r12;
        let phase21 = select(1.0, 0.0, ior < 1.0);
        let r23 = vec3f(
            schlick(base_reflectance_in_film(f0.x, ior), cos_film),
            schlick(base_reflectance_in_film(f0.y, ior), cos_film),
            schlick(base_reflectance_in_film(f0.z, ior), cos_film),
        );
        let phase = vec3f(
            phase21 + base_phase(f0.x, ior),
            phase21 + base_phase(f0.y, ior),
            phase21 + base_phase(f0.z, ior),
        );
        let path_difference = 2.0 * ior * thickness * cos_film;
        let once = vec3f(min(r12 * r23.x, 0.9999), min(r12 * r23.y, 0.9999), min(r12 * r23.z, 0.9999));
        let root = vec3f(sqrt(once.x), sqrt(once.y), sqrt(once.z));
        let through = vec3f(
            t121 * t121 * r23.x / (1.0 - once.x),
            t121 * t121 * r23.y / (1.0 - once.y),
            t121 * t121 * r23.z / (1.0 - once.z),
        );
        // The mean over all phases, then orders of interference.
        let mut sum = through + vec3f(r12, r12, r12);
        let mut order = (through - vec3f(t121, t121, t121)) * root;
        sum = sum + order * interference_color(path_difference, phase) * 2.0;
        order = order * root;
        sum = sum + order * interference_color(2.0 * path_difference, phase * 2.0) * 2.0;
        // Colours of pure wavelengths lie outside of the colour space.
        vec3f(saturate(sum.x), saturate(sum.y), saturate(sum.z))
    }

    /// The reflectance at normal incidence with which Schlick's approximation gives `reflectance` at a cosine.
    pub fn schlick_to_f0(reflectance: f32, cos_theta: f32) -> f32 {
        let grazing = min(schlick_weight(cos_theta), 0.9999);
        saturate((reflectance - grazing) / (1.0 - grazing))
    }
}

#[cfg(test)]
mod tests {
    use super::iridescence::*;
    use crate::vec3f;

    /// Without a film, or with one of the index of air, there is only the base.
    #[test]
    fn no_film_is_the_base() {
        // Schlick's approximation takes any grazing interface for a mirror, even one that is none.
        for cos in [1.0, 0.8, 0.7] {
            for f0 in [0.04, 0.5, 0.95] {
                for (ior, thickness) in [(1.8, 0.0), (1.0, 400.0)] {
                    let f = iridescent_fresnel(cos, ior, thickness, vec3f(f0, f0, f0));
                    let expected = schlick(f0, cos);
                    // The first interface reflects next to nothing, not nothing: the clamp of the reference.
                    assert!((f.y - expected).abs() < 0.02, "{f:?} against {expected} at {cos}, {ior}");
                }
            }
        }
    }

    /// Colours change with thickness, and the mean over many thicknesses has next to none.
    #[test]
    fn films_are_coloured_and_thick_ones_are_not() {
        let spread = |thickness: f32| {
            let f = iridescent_fresnel(0.9, 1.3, thickness, vec3f(0.04, 0.04, 0.04));
            f.x.max(f.y).max(f.z) - f.x.min(f.y).min(f.z)
        };
        let coloured = (0..40).map(|i| spread(200.0 + 20.0 * i as f32)).fold(0.0, f32::max);
        assert!(coloured > 0.02, "{coloured}");
        assert!(spread(20_000.0) < 0.004, "{}", spread(20_000.0));
    }
}
