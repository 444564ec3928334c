//! What may be kept from the frame before: where a point was, whether the same surface was seen there, how much it still counts.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod history {
    use crate::light_tree::*;
    use crate::math::*;
    use wgsl_rs::std::*;

    /// Distances are compared in tenths of themselves.
    pub const DEPTH_SCALE: f32 = 0.1;

    /// Whether what the frame before saw at a place is the surface that is seen now.
    ///
    /// - `expected`: distance of the surface from the camera of the frame before, metres. `found`: the distance that it saw; 0
    ///   for none.
    /// - `depth_tolerance`: how far apart they may be, in tenths of the expected one: 0.3 allows 3 %.
    /// - `cos_between`: cosine between the normals now and then; `normal_tolerance`: the least that counts as equal.
    pub fn is_same_surface(
        expected: f32,
        found: f32,
        depth_tolerance: f32,
        cos_between: f32,
        normal_tolerance: f32,
    ) -> bool {
        let near = abs(found - expected) <= DEPTH_SCALE * depth_tolerance * expected;
        found > 0.0 && near && cos_between >= normal_tolerance
    }

    /// Weight of one of the four texels around a place, bilinear. `corner`: bit 0 right, bit 1 below. `fraction`: of the place
    /// from the upper left one, in `[0, 1)`.
    pub fn bilinear_weight(fraction: Vec2f, corner: u32) -> f32 {
        let x = select(1.0 - fraction.x, fraction.x, (corner & 1u32) != 0u32);
        let y = select(1.0 - fraction.y, fraction.y, (corner & 2u32) != 0u32);
        x * y
    }

    /// Weight of a frame's mean of `new_samples` against the mean of what `kept` samples, at most `most`, have made before.
    /// With no limit, the mean of all samples comes out.
    pub fn history_weight(kept: f32, new_samples: f32, most: f32) -> f32 {
        new_samples / max(min(kept, most) + new_samples, 1e-6)
    }

    /// How much of a reflection's direction is the mirror's: 1 for a mirror, 0 for the roughest surface.
    ///
    /// Source: Lagarde and de Rousiers, "Moving Frostbite to Physically Based Rendering 3.0", 2014, section 4.9.
    pub fn mirror_share(roughness: f32) -> f32 {
        let smooth_ = saturate(1.0 - roughness);
        saturate(smooth_ * (sqrt(smooth_) + roughness))
    }

    /// Where a flat mirror shows what lies `hit_distance` metres behind the reflection: straight on from the eye.
    ///
    /// - `eye`, `surface`: the camera and the surface, in one space. `share`: of [`mirror_share`], how far to go.
    pub fn virtual_point(eye: Vec3f, surface: Vec3f, hit_distance: f32, share: f32) -> Vec3f {
        let way = surface - eye;
        let length_ = max(length(way), 1e-20);
        surface + way * (max(hit_distance, 0.0) * share / length_)
    }

    /// A value moved straight towards the centre of a box until it lies in it.
    ///
    /// Source: Karis, "High Quality Temporal Supersampling", SIGGRAPH course 2014; with mean and standard deviation as the box,
    /// Salvi, "An Excursion in Temporal Supersampling", GDC 2016.
    pub fn clip_to_box(value: Vec3f, center: Vec3f, half_size: Vec3f) -> Vec3f {
        let offset = value - center;
        let reach = abs(offset) / max(half_size, vec3f(1e-12, 1e-12, 1e-12));
        center + offset / max(max_component(reach), 1.0)
    }

    /// Standard deviation from a mean and a mean of squares.
    pub fn deviation(mean: f32, mean_of_squares: f32) -> f32 {
        safe_sqrt(mean_of_squares - mean * mean)
    }

    /// Half the size of a box that reaches so many standard `deviations` from the mean, from means and means of squares.
    pub fn box_of_deviations(mean: Vec3f, squares: Vec3f, deviations: f32) -> Vec3f {
        vec3f(deviation(mean.x, squares.x), deviation(mean.y, squares.y), deviation(mean.z, squares.z))
            * deviations
    }

    /// Cosine between two unit vectors, by their codes of [`octahedral_encode`].
    pub fn cos_of_codes(a: u32, b: u32) -> f32 {
        dot(octahedral_decode(a), octahedral_decode(b))
    }

    /// From the camera of the frame before to where a surface's point was then, metres.
    ///
    /// - `distance`: of the point from the camera now, along its ray. `point`, `eye`: point and camera now; `…_before`: then.
    pub fn distance_before(
        distance: f32,
        point: Vec3f,
        eye: Vec3f,
        point_before: Vec3f,
        eye_before: Vec3f,
    ) -> f32 {
        distance + length(point_before - eye_before) - length(point - eye)
    }

    /// What a pixel's surface has received over frames, without its colour: means.
    #[derive(Clone, Copy, Debug)]
    pub struct History {
        /// Light of the diffuse lobe.
        pub diffuse: Vec3f,
        /// Samples that the diffuse mean is worth.
        pub diffuse_count: f32,
        /// Light of the other lobes.
        pub specular: Vec3f,
        /// Samples that the specular mean is worth.
        pub specular_count: f32,
        /// Means and means of squares of luminance: diffuse, diffuse², specular, specular².
        pub moments: Vec4f,
        /// Mean distance from the surface to what lights it specularly, metres.
        pub hit_distance: f32,
    }

    /// Nothing received.
    pub fn history_empty() -> History {
        History {
            diffuse: vec3f(0.0, 0.0, 0.0),
            diffuse_count: 0.0,
            specular: vec3f(0.0, 0.0, 0.0),
            specular_count: 0.0,
            moments: vec4f(0.0, 0.0, 0.0, 0.0),
            hit_distance: 0.0,
        }
    }

    /// Whether all numbers of a history are finite.
    pub fn history_is_sound(h: History) -> bool {
        is_finite3(h.diffuse)
            && is_finite3(h.specular)
            && is_finite(h.diffuse_count)
            && is_finite(h.specular_count)
            && is_finite3(vec3f(h.moments.x, h.moments.y, h.moments.z))
            && is_finite(h.moments.w)
            && is_finite(h.hit_distance)
    }

    /// A sum of weighted histories, and the sum of the weights.
    #[derive(Clone, Copy, Debug)]
    pub struct HistorySum {
        /// Times its weight.
        pub history: History,
        /// Its weight.
        pub weight: f32,
    }

    /// The sum of none.
    pub fn history_sum_empty() -> HistorySum {
        HistorySum { history: history_empty(), weight: 0.0 }
    }

    /// Adds a history.
    pub fn history_sum_add(sum: HistorySum, h: History, weight: f32) -> HistorySum {
        let s = sum.history;
        HistorySum {
            history: History {
                diffuse: s.diffuse + h.diffuse * weight,
                diffuse_count: s.diffuse_count + h.diffuse_count * weight,
                specular: s.specular + h.specular * weight,
                specular_count: s.specular_count + h.specular_count * weight,
                moments: s.moments + h.moments * weight,
                hit_distance: s.hit_distance + h.hit_distance * weight,
            },
            weight: sum.weight + weight,
        }
    }

    /// The mean of a sum.
    pub fn history_sum_mean(sum: HistorySum) -> History {
        history_sum_add(history_sum_empty(), sum.history, 1.0 / max(sum.weight, 1e-6)).history
    }
}

#[cfg(test)]
mod tests {
    use super::history::*;
    use crate::{vec2f, vec3f, vec4f};

    #[test]
    fn tests_know_surfaces_apart() {
        assert!(is_same_surface(10.0, 10.2, 0.3, 1.0, 0.95));
        assert!(!is_same_surface(10.0, 10.4, 0.3, 1.0, 0.95), "4 % away");
        assert!(!is_same_surface(10.0, 10.0, 0.3, 0.9, 0.95), "turned away");
        assert!(!is_same_surface(10.0, 0.0, 0.3, 1.0, 0.95), "the sky");
        assert!(!is_same_surface(10.0, f32::NAN, 0.3, 1.0, 0.95), "no number");
    }

    #[test]
    fn bilinear_weights_sum_to_one_and_find_the_place() {
        for (x, y) in [(0.0, 0.0), (0.25, 0.5), (0.9, 0.1)] {
            let w: Vec<f32> = (0..4).map(|c| bilinear_weight(vec2f(x, y), c)).collect();
            assert!((w.iter().sum::<f32>() - 1.0).abs() < 1e-6);
            assert!((w[1] + w[3] - x).abs() < 1e-6 && (w[2] + w[3] - y).abs() < 1e-6);
        }
    }

    /// Without a limit the running mean is the mean; with one, old samples fade.
    #[test]
    fn histories_are_means() {
        let samples = [3.0f32, 5.0, 1.0, 7.0];
        let (mut mean, mut kept) = (0.0, 0.0);
        for x in samples {
            mean += history_weight(kept, 1.0, 1e9) * (x - mean);
            kept += 1.0;
        }
        assert!((mean - 4.0).abs() < 1e-6);
        assert_eq!(history_weight(100.0, 1.0, 9.0), 0.1);
        assert_eq!(history_weight(0.0, 4.0, 32.0), 1.0);
        assert_eq!(history_weight(5.0, 0.0, 32.0), 0.0);
    }

    #[test]
    fn values_are_clipped_towards_the_centre_and_not_beyond() {
        let (center, half) = (vec3f(1.0, 1.0, 1.0), vec3f(0.5, 1.0, 2.0));
        let inside = clip_to_box(vec3f(1.2, 0.5, 2.0), center, half);
        assert_eq!((inside.x, inside.y, inside.z), (1.2, 0.5, 2.0));
        let clipped = clip_to_box(vec3f(3.0, 1.0, 1.0), center, half);
        assert!((clipped.x - 1.5).abs() < 1e-6 && clipped.y == 1.0);
        let flat = clip_to_box(vec3f(3.0, 1.0, 1.0), center, vec3f(0.0, 0.0, 0.0));
        assert!((flat.x - 1.0).abs() < 1e-5);
    }

    #[test]
    fn histories_are_mixed_by_their_weights() {
        let mut h = history_empty();
        h.diffuse = vec3f(1.0, 2.0, 3.0);
        h.moments = vec4f(1.0, 2.0, 3.0, 4.0);
        h.diffuse_count = 8.0;
        let sum = history_sum_add(history_sum_empty(), h, 0.75);
        let mean = history_sum_mean(history_sum_add(sum, history_empty(), 0.25));
        assert!((mean.diffuse.z - 2.25).abs() < 1e-6 && (mean.diffuse_count - 6.0).abs() < 1e-5);
        assert!((mean.moments.w - 3.0).abs() < 1e-6 && history_is_sound(mean));
        h.moments.w = f32::NAN;
        assert!(!history_is_sound(h));
    }

    #[test]
    fn mirrors_show_things_behind_themselves() {
        let p = virtual_point(vec3f(0.0, 0.0, 0.0), vec3f(0.0, 0.0, 2.0), 3.0, 1.0);
        assert!((p.z - 5.0).abs() < 1e-6);
        assert!(mirror_share(0.0) == 1.0 && mirror_share(1.0) == 0.0);
    }
}
