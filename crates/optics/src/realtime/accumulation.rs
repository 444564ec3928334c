//! How a frame's samples join what was kept of those before, and how far the past may be from the present.
//!
//! Source: Schied et al., "Spatiotemporal Variance-Guided Filtering", HPG 2017, sections 4.1 and 4.2.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod accumulation {
    use crate::allocation::*;
    use crate::history::*;
    use crate::math::*;
    use crate::signal::*;
    use wgsl_rs::std::*;

    /// Histories of fewer samples have no variance of their own that could be trusted.
    pub const TRUSTED_HISTORY: f32 = 4.0;
    /// Fewer pixels than that say nothing about how far the past may be from the present.
    pub const LEAST_NEIGHBOURS: f32 = 4.0;

    /// The pixels around one that show the same surface, of one signal: sums, then means.
    #[derive(Clone, Copy, Debug)]
    pub struct Neighbourhood {
        /// Of the colours, by [`ycocg_encode`].
        pub mean: Vec3f,
        /// Of their squares.
        pub mean_of_squares: Vec3f,
        /// Largest luminance of the others.
        pub brightest: f32,
        /// Of the luminance, and of its square.
        pub luminance: Vec2f,
        /// Number of the pixels.
        pub count: f32,
    }

    /// No pixels yet.
    pub fn neighbourhood_empty() -> Neighbourhood {
        Neighbourhood {
            mean: vec3f(0.0, 0.0, 0.0),
            mean_of_squares: vec3f(0.0, 0.0, 0.0),
            brightest: 0.0,
            luminance: vec2f(0.0, 0.0),
            count: 0.0,
        }
    }

    /// Adds a pixel's colour to sums. `is_other`: whether it is not the one in the middle.
    pub fn neighbourhood_add(sum: Neighbourhood, c: Vec3f, is_other: bool) -> Neighbourhood {
        let mut next = sum;
        let y = luminance(c);
        let encoded = ycocg_encode(c);
        next.mean = sum.mean + encoded;
        next.mean_of_squares = sum.mean_of_squares + encoded * encoded;
        next.luminance = sum.luminance + vec2f(y, y * y);
        next.brightest = max(sum.brightest, select(0.0, y, is_other));
        next.count = sum.count + 1.0;
        next
    }

    /// Means of sums.
    pub fn neighbourhood_mean(sum: Neighbourhood) -> Neighbourhood {
        let scale = 1.0 / max(sum.count, 1.0);
        Neighbourhood {
            mean: sum.mean * scale,
            mean_of_squares: sum.mean_of_squares * scale,
            brightest: sum.brightest,
            luminance: sum.luminance * scale,
            count: sum.count,
        }
    }

    /// The past moved to within `deviations` standard deviations of the colours around; few colours leave it as it is.
    pub fn clip_to_neighbourhood(past: Vec3f, around: Neighbourhood, deviations: f32) -> Vec3f {
        if around.count < LEAST_NEIGHBOURS {
            return past;
        }
        let reach = box_of_deviations(around.mean, around.mean_of_squares, deviations);
        max(ycocg_decode(clip_to_box(ycocg_encode(past), around.mean, reach)), vec3f(0.0, 0.0, 0.0))
    }

    /// Variance of a mean's luminance: by the pixel's own moments, or by the pixels around it while those are few.
    ///
    /// - `moments`: mean and mean of squares of luminance of `count` samples. `fresh`: samples of this frame, of each of which the
    ///   pixels `around` are means.
    pub fn variance_of_mean(moments: Vec2f, count: f32, fresh: f32, around: Neighbourhood) -> f32 {
        let own = sample_variance(moments.x, moments.y, count);
        let spatial =
            max(around.luminance.y - around.luminance.x * around.luminance.x, 0.0) * max(fresh, 1.0);
        select(own, max(own, spatial), count < TRUSTED_HISTORY) / max(count, 1.0)
    }

    /// One signal's share of a history.
    #[derive(Clone, Copy, Debug)]
    pub struct SignalMean {
        /// Mean of the samples, without the surface's colour.
        pub color: Vec3f,
        /// Samples that it is worth.
        pub count: f32,
        /// Mean and mean of squares of luminance.
        pub moments: Vec2f,
    }

    /// A frame's mean of `count` samples joins the past, which counts as at most `most` samples. `square`: mean of squares of the
    /// frame's samples' luminance.
    pub fn signal_mean_join(past: SignalMean, now: Vec3f, count: f32, square: f32, most: f32) -> SignalMean {
        if count <= 0.0 {
            return past;
        }
        let weight = history_weight(past.count, count, most);
        SignalMean {
            color: past.color + (now - past.color) * weight,
            count: min(past.count, most) + count,
            moments: past.moments + (vec2f(luminance(now), square) - past.moments) * weight,
        }
    }

    /// The same for the mean distance to what lights a surface, metres. `sum`: of the frame's `count` samples.
    pub fn hit_distance_join(past: f32, past_count: f32, sum: f32, count: f32, most: f32) -> f32 {
        if count <= 0.0 {
            return past;
        }
        past + (sum / count - past) * history_weight(past_count, count, most)
    }

    /// What is filtered: means and standard deviations, from variances of luminance, relative to the luminance `white`.
    pub fn signal_of_means(
        diffuse: Vec3f,
        diffuse_variance: f32,
        specular: Vec3f,
        specular_variance: f32,
        white: f32,
    ) -> Signal {
        let scale = 1.0 / white;
        Signal {
            diffuse: diffuse * scale,
            diffuse_deviation: sqrt(max(diffuse_variance, 0.0)) * scale,
            specular: specular * scale,
            specular_deviation: sqrt(max(specular_variance, 0.0)) * scale,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::accumulation::*;
    use crate::{vec2f, vec3f};

    fn around(levels: &[f32]) -> Neighbourhood {
        let add = |sum, y: &f32| neighbourhood_add(sum, vec3f(*y, *y, *y), true);
        neighbourhood_mean(levels.iter().fold(neighbourhood_empty(), add))
    }

    #[test]
    fn the_past_is_brought_near_the_present() {
        let a = around(&[1.0, 2.0, 3.0, 2.0]);
        assert!((a.luminance.x - 2.0).abs() < 1e-6 && a.count == 4.0 && (a.brightest - 3.0).abs() < 1e-6);
        let far = clip_to_neighbourhood(vec3f(9.0, 9.0, 9.0), a, 1.0);
        assert!((far.x - (2.0 + 0.5f32.sqrt())).abs() < 1e-4, "{}", far.x);
        let near = clip_to_neighbourhood(vec3f(2.1, 2.1, 2.1), a, 1.0);
        assert!((near.x - 2.1).abs() < 1e-6);
        assert_eq!(clip_to_neighbourhood(vec3f(9.0, 9.0, 9.0), around(&[1.0]), 1.0).x, 9.0, "too few");
    }

    #[test]
    fn young_histories_ask_their_neighbours() {
        let a = around(&[1.0, 3.0]);
        assert!((variance_of_mean(vec2f(2.0, 4.0), 2.0, 1.0, a) - 0.5).abs() < 1e-5);
        assert!(variance_of_mean(vec2f(2.0, 4.0), 8.0, 1.0, a).abs() < 1e-6);
    }

    #[test]
    fn frames_join_as_their_samples_would() {
        let past = SignalMean { color: vec3f(1.0, 1.0, 1.0), count: 3.0, moments: vec2f(1.0, 1.0) };
        let next = signal_mean_join(past, vec3f(5.0, 5.0, 5.0), 1.0, 25.0, 100.0);
        assert!((next.color.x - 2.0).abs() < 1e-6 && next.count == 4.0);
        assert!((next.moments.x - 2.0).abs() < 1e-5 && (next.moments.y - 7.0).abs() < 1e-5);
        assert_eq!(signal_mean_join(past, vec3f(5.0, 5.0, 5.0), 0.0, 0.0, 100.0).count, 3.0);
        assert_eq!(hit_distance_join(4.0, 1.0, 6.0, 1.0, 100.0), 5.0);
        assert_eq!(hit_distance_join(4.0, 1.0, 6.0, 0.0, 100.0), 4.0);
    }
}
