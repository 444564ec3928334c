//! Weights with which neighbours count in a spatial filter.
//!
//! Source: Schied et al., "Spatiotemporal Variance-Guided Filtering", HPG 2017, section 4.4, after Dammertz et al.,
//! "Edge-Avoiding À-Trous Wavelet Transform for fast Global Illumination Filtering", HPG 2010.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod edge_stops {
    use wgsl_rs::std::*;

    /// One of the five weights of a cubic B-spline's wavelet: of the middle one, those beside it, those `away` by two.
    pub fn spline_weight(away: u32) -> f32 {
        select(select(0.0625, 0.25, away == 1u32), 0.375, away == 0u32)
    }

    /// One of the three weights of the smallest binomial filter: of the middle one and of those beside it.
    pub fn binomial_weight(away: u32) -> f32 {
        select(0.25, 0.5, away == 0u32)
    }

    /// Weight for the angle between normals: its cosine to a power.
    pub fn normal_weight(cos_between: f32, power: f32) -> f32 {
        pow(clamp(cos_between, 0.0, 1.0), power)
    }

    /// Weight for how far a neighbour lies off the surface's own plane.
    ///
    /// - `off_plane`: distance from the plane, metres. `allowed`: where the weight has fallen to 1/e, metres.
    pub fn plane_weight(off_plane: f32, allowed: f32) -> f32 {
        exp(-min(abs(off_plane) / max(allowed, 1e-20), 80.0))
    }

    /// Weight for a difference of luminance, in units of what noise makes of it: `deviation` is its standard deviation,
    /// `tolerance` how many of those leave 1/e.
    pub fn luminance_weight(difference: f32, deviation: f32, tolerance: f32) -> f32 {
        exp(-min(abs(difference) / (tolerance * deviation + 1e-6), 80.0))
    }

    /// Share of the filter's width that a reflection can bear: lobes of smooth surfaces show pictures, which have edges of
    /// their own. In `[0, 1]`.
    pub fn lobe_share(roughness: f32) -> f32 {
        smoothstep(0.0, 0.4, roughness)
    }
}

#[cfg(test)]
mod tests {
    use super::edge_stops::*;

    #[test]
    fn spline_weights_sum_to_one() {
        let sum: f32 = [2, 1, 0, 1, 2].map(spline_weight).iter().sum();
        assert!((sum - 1.0).abs() < 1e-6);
        assert_eq!([1, 0, 1].map(binomial_weight).iter().sum::<f32>(), 1.0);
        assert!(spline_weight(0) > spline_weight(1) && spline_weight(1) > spline_weight(2));
    }

    #[test]
    fn equals_count_in_full_and_others_less() {
        assert_eq!(normal_weight(1.0, 128.0), 1.0);
        assert_eq!(plane_weight(0.0, 0.01), 1.0);
        assert_eq!(luminance_weight(0.0, 0.0, 4.0), 1.0);
        assert!(normal_weight(0.9, 128.0) < 1e-4 && normal_weight(-1.0, 128.0) == 0.0);
        assert!((plane_weight(0.02, 0.02) - (-1f32).exp()).abs() < 1e-6);
        assert!(luminance_weight(1.0, 0.0, 4.0) < 1e-20, "nothing differs without noise");
        assert!(luminance_weight(1.0, 1.0, 4.0) > 0.7, "noise explains it");
        assert!(lobe_share(0.0) == 0.0 && lobe_share(1.0) == 1.0);
    }
}
