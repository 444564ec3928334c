//! When camera rays leave while the shutter is open.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod shutter {
    use wgsl_rs::std::*;

    /// The pair of random numbers whose first says when a camera ray leaves, where anything moves
    /// while the shutter is open. It is beyond all vertices, so that no other number depends on
    /// whether it is drawn.
    pub const PAIR_TIME: u32 = 0xffffffffu32;

    /// A shutter in the time of a motion, which runs from 0 to 1.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Shutter {
        /// When the first row (or column) opens.
        pub open: f32,
        /// For how long each is open.
        pub duration: f32,
        /// Share of the duration in which it opens, and in which it closes; in `[0, 1]`, together
        /// at most 1.
        pub rise: f32,
        /// See `rise`.
        pub fall: f32,
        /// By how much the last row opens later than the first.
        pub row_delay: f32,
        /// The same for columns.
        pub column_delay: f32,
    }

    /// Where in the duration a ray leaves, in `[0, 1]`: the inverse of the distribution function of
    /// a trapezoid.
    ///
    /// - `u`: uniform number in `[0, 1)`.
    pub fn shutter_fraction(rise: f32, fall: f32, u: f32) -> f32 {
        let a = u * (1.0 - 0.5 * (rise + fall));
        let left = max(1.0 - 0.5 * (rise + fall) - a, 0.0);
        if a < 0.5 * rise {
            return sqrt(2.0 * rise * a);
        }
        if left < 0.5 * fall {
            return 1.0 - sqrt(2.0 * fall * left);
        }
        a + 0.5 * rise
    }

    /// When the ray of a pixel leaves.
    ///
    /// - `at`: the pixel's column and row. `size`: of the picture, pixels. `u`: uniform number in
    ///   `[0, 1)`.
    pub fn shutter_time(s: Shutter, at: Vec2f, size: Vec2f, u: f32) -> f32 {
        let delay = s.column_delay * ((at.x + 0.5) / size.x) + s.row_delay * ((at.y + 0.5) / size.y);
        s.open + delay + s.duration * shutter_fraction(s.rise, s.fall, u)
    }
}

#[cfg(test)]
mod tests {
    use super::shutter::*;
    use crate::vec2f;

    /// Samples follow the trapezoid's density.
    #[test]
    fn fractions_follow_the_shape() {
        for (rise, fall) in [(0.0, 0.0), (0.5, 0.5), (0.25, 0.5), (0.0, 1.0), (1.0, 0.0), (0.1, 0.2)] {
            let density = |x: f32| {
                let up = if rise > 0.0 { (x / rise).min(1.0) } else { 1.0 };
                let down = if fall > 0.0 { ((1.0 - x) / fall).min(1.0) } else { 1.0 };
                up.min(down) / (1.0 - 0.5 * (rise + fall))
            };
            let (n, bins) = (100_000u32, 20usize);
            let mut counts = vec![0.0f32; bins];
            for i in 0..n {
                let x = shutter_fraction(rise, fall, (i as f32 + 0.5) / n as f32);
                assert!((0.0..=1.0).contains(&x), "{x}");
                counts[((x * bins as f32) as usize).min(bins - 1)] += 1.0 / n as f32;
            }
            for (bin, count) in counts.iter().enumerate() {
                let steps = 100;
                let inside = |k: usize| density((bin as f32 + (k as f32 + 0.5) / steps as f32) / bins as f32);
                let expected = (0..steps).map(inside).sum::<f32>() / (steps * bins) as f32;
                assert!((count - expected).abs() < 2e-4, "{rise} {fall}: bin {bin}: {count}, not {expected}");
            }
        }
    }

    #[test]
    fn rows_open_one_after_the_other() {
        let s = Shutter { open: 0.1, duration: 0.2, rise: 0.0, fall: 0.0, row_delay: 0.7, column_delay: 0.0 };
        let time = |y: f32, u| shutter_time(s, vec2f(3.0, y), vec2f(8.0, 4.0), u);
        assert!((time(0.0, 0.0) - (0.1 + 0.7 / 8.0)).abs() < 1e-6);
        assert!((time(3.0, 0.5) - (0.1 + 0.7 * 7.0 / 8.0 + 0.1)).abs() < 1e-6);
    }
}
