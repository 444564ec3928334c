//! How much light an interface reflects.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod fresnel {
    use crate::math::*;
    use wgsl_rs::std::*;

    /// Reflectance at normal incidence of a dielectric of relative index of refraction `eta` (≥ 0, 1 reflects nothing).
    pub fn f0_from_ior(eta: f32) -> f32 {
        sqr((eta - 1.0) / (eta + 1.0))
    }

    /// Weight of the grazing colour in Schlick's approximation: (1 − |cos|)⁵.
    pub fn schlick_weight(cos_theta: f32) -> f32 {
        pow5(clamp(1.0 - abs(cos_theta), 0.0, 1.0))
    }

    /// What happens at a smooth dielectric interface.
    #[derive(Clone, Copy, Debug)]
    pub struct DielectricFresnel {
        /// Share of unpolarised light that is reflected, in `[0, 1]`; 1 under total internal reflection.
        pub reflectance: f32,
        /// Cosine of the transmitted direction with the normal on its side, in `[0, 1]`; 0 under total internal
        /// reflection.
        pub cos_transmitted: f32,
    }

    /// Fresnel's equations for unpolarised light.
    ///
    /// - `cos_incident`: cosine between the incident direction and the normal on its side, in `[0, 1]`.
    /// - `eta`: index of refraction of the far side divided by that of the near side, positive.
    pub fn fresnel_dielectric(cos_incident: f32, eta: f32) -> DielectricFresnel {
        let sin2_transmitted = (1.0 - cos_incident * cos_incident) / (eta * eta);
        if sin2_transmitted >= 1.0 {
            return DielectricFresnel { reflectance: 1.0, cos_transmitted: 0.0 };
        }
        let cos_transmitted = sqrt(1.0 - sin2_transmitted);
        let parallel = (eta * cos_incident - cos_transmitted) / (eta * cos_incident + cos_transmitted);
        let perpendicular = (cos_incident - eta * cos_transmitted) / (cos_incident + eta * cos_transmitted);
        let reflectance = 0.5 * (parallel * parallel + perpendicular * perpendicular);
        DielectricFresnel { reflectance: clamp(reflectance, 0.0, 1.0), cos_transmitted: cos_transmitted }
    }

    /// Reflectance of an infinitely thin dielectric sheet, with all reflections between its two faces:
    /// R + T²R + T²R³ + … = 2R / (1 + R), where R is the reflectance of one face.
    pub fn thin_sheet_reflectance(reflectance: f32) -> f32 {
        2.0 * reflectance / (1.0 + reflectance)
    }
}

#[cfg(test)]
mod tests {
    use super::fresnel::*;

    #[test]
    fn known_values() {
        assert!((f0_from_ior(1.5) - 0.04).abs() < 1e-7);
        assert!((fresnel_dielectric(1.0, 1.5).reflectance - 0.04).abs() < 1e-6);
        assert!((fresnel_dielectric(0.0, 1.5).reflectance - 1.0).abs() < 1e-6);
        // Total internal reflection from glass to air beyond 41.8°.
        assert_eq!(fresnel_dielectric(0.7, 1.0 / 1.5).reflectance, 1.0);
        assert!(fresnel_dielectric(0.75, 1.0 / 1.5).reflectance < 1.0);
        // Brewster's angle, tan θ = 1.5: parallel light is not reflected.
        let cos_brewster = 1.0 / (1.0f32 + 2.25).sqrt();
        let r = fresnel_dielectric(cos_brewster, 1.5).reflectance;
        assert!((r - 0.5 * (5.0f32 / 13.0).powi(2)).abs() < 1e-6, "{r}");
        assert!(fresnel_dielectric(0.3, 1.0).reflectance < 1e-12);
    }

    /// Helmholtz: the same share is reflected whichever side the light comes from.
    #[test]
    fn reflectance_is_the_same_from_both_sides() {
        for i in 1..100 {
            let there = fresnel_dielectric(i as f32 / 100.0, 1.7);
            let back = fresnel_dielectric(there.cos_transmitted, 1.0 / 1.7);
            assert!((there.reflectance - back.reflectance).abs() < 1e-5, "cos {i}/100: {there:?} {back:?}");
        }
    }
}
