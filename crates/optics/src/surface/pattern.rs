//! Procedural patterns.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod pattern {
    use wgsl_rs::std::*;

    /// Integral of a square wave of period 2 that is +1 on `[0, 1)` and −1 on `[1, 2)`.
    pub fn square_wave_integral(x: f32) -> f32 {
        let p = x * 0.5;
        let f = p - floor(p);
        1.0 - abs(2.0 * f - 1.0)
    }

    /// Share of the odd squares of a unit checkerboard inside a box around `p`, in `[0, 1]`.
    ///
    /// - `p`: position in squares. `width`: side of the box, positive: the footprint of a pixel.
    ///
    /// The product of two box-filtered square waves. Source: I. Quílez, "Filtering the checkerboard pattern".
    pub fn checkerboard(p: Vec2f, width: f32) -> f32 {
        let w = max(width, 1e-4);
        let x = (square_wave_integral(p.x + 0.5 * w) - square_wave_integral(p.x - 0.5 * w)) / w;
        let y = (square_wave_integral(p.y + 0.5 * w) - square_wave_integral(p.y - 0.5 * w)) / w;
        0.5 - 0.5 * x * y
    }

    /// Width of a pixel's footprint on a surface: seen at an angle, it is longer than it is wide.
    ///
    /// - `radius`: of the ray's footprint, metres. `cos_theta`: between ray and surface normal.
    pub fn footprint_width(radius: f32, cos_theta: f32) -> f32 {
        2.0 * radius / max(cos_theta, 0.05)
    }

    /// Falls smoothly from 1 at distance `near` to 0 at distance `far`.
    pub fn distance_fade(distance: f32, near: f32, far: f32) -> f32 {
        let t = saturate((distance - near) / max(far - near, 1e-6));
        1.0 - t * t * (3.0 - 2.0 * t)
    }
}

#[cfg(test)]
mod tests {
    use super::pattern::*;
    use wgsl_rs::std::*;

    #[test]
    fn squares_alternate_and_blur_to_grey() {
        assert!(checkerboard(vec2f(0.5, 0.5), 0.01) < 1e-3);
        assert!(checkerboard(vec2f(1.5, 0.5), 0.01) > 0.999);
        assert!(checkerboard(vec2f(-0.5, 0.5), 0.01) > 0.999);
        assert!(checkerboard(vec2f(0.5, -3.5), 0.01) < 1e-3);
        for i in 0..50 {
            let grey = checkerboard(vec2f(i as f32 * 0.37, i as f32 * 0.11), 200.0);
            assert!((grey - 0.5).abs() < 0.01, "{grey}");
        }
    }

    /// A filtered value is the mean of unfiltered ones.
    #[test]
    fn filtering_averages() {
        let (center, width) = (vec2f(1.2, 2.9), 1.3);
        let mut sum = 0.0;
        for y in 0..200 {
            for x in 0..200 {
                let q =
                    vec2f((x as f32 + 0.5) / 200.0 - 0.5, (y as f32 + 0.5) / 200.0 - 0.5) * width + center;
                sum += checkerboard(q, 1e-3);
            }
        }
        let filtered = checkerboard(center, width);
        assert!((sum / 40_000.0 - filtered).abs() < 5e-3, "{} against {filtered}", sum / 40_000.0);
    }
}
