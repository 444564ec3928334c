//! The spatial filter: a pixel's mean with its neighbours, by the weights of [`crate::edge_stops`].
//!
//! Source: Schied et al., "Spatiotemporal Variance-Guided Filtering", HPG 2017, sections 4.3 and 4.4.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod spatial_filter {
    use crate::edge_stops::*;
    use crate::signal::*;
    use wgsl_rs::std::*;

    /// Power of the cosine between normals.
    pub const NORMAL_POWER: f32 = 64.0;
    /// Standard deviations of luminance that leave 1/e of a weight.
    pub const LUMINANCE_TOLERANCE: f32 = 4.0;
    /// Radii of a pixel's footprint by which neighbours one pixel away may be off the plane.
    pub const PLANE_TOLERANCE: f32 = 1.0;

    /// Weight of a pixel so far across and down in the smallest binomial filter.
    pub fn binomial_product(across: u32, down: u32) -> f32 {
        binomial_weight(across) * binomial_weight(down)
    }

    /// The same in the filter of a cubic B-spline.
    pub fn spline_product(across: u32, down: u32) -> f32 {
        spline_weight(across) * spline_weight(down)
    }

    /// Variances of both signals, times a weight.
    pub fn weighted_variances(s: Signal, weight: f32) -> Vec2f {
        let deviations = vec2f(s.diffuse_deviation, s.specular_deviation);
        deviations * deviations * weight
    }

    /// Standard deviations from a weighted sum of variances, and the sum of the weights.
    pub fn smoothed_deviations(variances: Vec2f, weights: f32) -> Vec2f {
        sqrt(variances / weights)
    }

    /// How far neighbours may be off a surface's plane, metres.
    ///
    /// - `pixel_spread`: radius of a pixel's footprint per metre. `distance`: of the surface, metres. `step`: pixels between those
    ///   that are looked at.
    pub fn allowed_off_plane(pixel_spread: f32, distance: f32, step: f32) -> f32 {
        PLANE_TOLERANCE * pixel_spread * distance * sqrt(step) + 1e-4 * distance
    }

    /// Weight of a neighbour by where it lies.
    ///
    /// - `step`: by how many pixels it is away. `normal`, `position`: of the surface; `other_…`: of the neighbour. `allowed`: of
    ///   [`allowed_off_plane`].
    pub fn surface_weight(
        step: f32,
        normal: Vec3f,
        position: Vec3f,
        other_normal: Vec3f,
        other_position: Vec3f,
        allowed: f32,
    ) -> f32 {
        step * normal_weight(dot(normal, other_normal), NORMAL_POWER)
            * plane_weight(dot(normal, other_position - position), allowed)
    }

    /// Weights of a neighbour's two signals.
    ///
    /// - `geometry`: of [`surface_weight`]. `differences`: of the luminances. `deviations`: standard deviations of these. `lobe`: what
    ///   the specular signal's counts for.
    pub fn signal_weights(geometry: f32, differences: Vec2f, deviations: Vec2f, lobe: f32) -> Vec2f {
        geometry
            * vec2f(
                luminance_weight(differences.x, deviations.x, LUMINANCE_TOLERANCE),
                luminance_weight(differences.y, deviations.y, LUMINANCE_TOLERANCE) * lobe,
            )
    }

    /// Sums of weighted signals.
    #[derive(Clone, Copy, Debug)]
    pub struct FilterSum {
        /// Of the diffuse signal; w: of the squares of the weighted deviations.
        pub diffuse: Vec4f,
        /// The same of the specular one.
        pub specular: Vec4f,
        /// Of the weights of both.
        pub weights: Vec2f,
    }

    /// Adds a pixel.
    pub fn filter_sum_add(sum: FilterSum, s: Signal, weight: Vec2f) -> FilterSum {
        let deviations = vec2f(s.diffuse_deviation, s.specular_deviation) * weight;
        let d = s.diffuse * weight.x;
        let r = s.specular * weight.y;
        FilterSum {
            diffuse: sum.diffuse + vec4f(d.x, d.y, d.z, deviations.x * deviations.x),
            specular: sum.specular + vec4f(r.x, r.y, r.z, deviations.y * deviations.y),
            weights: sum.weights + weight,
        }
    }

    /// The mean, and what is left of its deviation. No weight may be zero.
    pub fn filter_sum_mean(sum: FilterSum) -> Signal {
        Signal {
            diffuse: vec3f(sum.diffuse.x, sum.diffuse.y, sum.diffuse.z) / sum.weights.x,
            diffuse_deviation: sqrt(sum.diffuse.w) / sum.weights.x,
            specular: vec3f(sum.specular.x, sum.specular.y, sum.specular.z) / sum.weights.y,
            specular_deviation: sqrt(sum.specular.w) / sum.weights.y,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::spatial_filter::*;
    use crate::signal::Signal;
    use crate::{vec2f, vec3f, vec4f};

    /// The mean of four equal pixels has half their deviation.
    #[test]
    fn filters_take_noise_away() {
        let s = Signal {
            diffuse: vec3f(1.0, 2.0, 3.0),
            diffuse_deviation: 1.0,
            specular: vec3f(4.0, 5.0, 6.0),
            specular_deviation: 2.0,
        };
        let zero = vec4f(0.0, 0.0, 0.0, 0.0);
        let mut sum = FilterSum { diffuse: zero, specular: zero, weights: vec2f(0.0, 0.0) };
        for _ in 0..4 {
            sum = filter_sum_add(sum, s, vec2f(0.3, 0.1));
        }
        let mean = filter_sum_mean(sum);
        assert!((mean.diffuse.y - 2.0).abs() < 1e-5 && (mean.specular.z - 6.0).abs() < 1e-5);
        assert!((mean.diffuse_deviation - 0.5).abs() < 1e-5 && (mean.specular_deviation - 1.0).abs() < 1e-5);
    }
}
