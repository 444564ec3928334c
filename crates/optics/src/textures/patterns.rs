//! Patterns of two-dimensional space, filtered over the square footprint of a ray.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod patterns {
    use crate::constants::*;
    use crate::math::*;
    use crate::noise::*;
    use crate::pattern::*;
    use crate::random::*;
    use wgsl_rs::std::*;

    /// A gradient: x.
    pub const GRADIENT_LINEAR: u32 = 0u32;
    /// A gradient: x².
    pub const GRADIENT_QUADRATIC: u32 = 1u32;
    /// A gradient: x, smooth at both ends.
    pub const GRADIENT_EASING: u32 = 2u32;
    /// A gradient: (x + y) / 2.
    pub const GRADIENT_DIAGONAL: u32 = 3u32;
    /// A gradient: 1 at the origin, 0 at distance 1 from it.
    pub const GRADIENT_SPHERICAL: u32 = 4u32;
    /// A gradient: the angle around z, in turns.
    pub const GRADIENT_RADIAL: u32 = 5u32;

    /// A wall of bricks; see [`brick_wall`]. Lengths are in the units of its coordinates.
    #[derive(Clone, Copy, Debug)]
    pub struct Bricks {
        /// Of a brick with its joint, positive.
        pub width: f32,
        /// Of a row with its joint, positive.
        pub height: f32,
        /// Width of joints.
        pub mortar: f32,
        /// By how much of a brick every second row is shifted.
        pub shift: f32,
        /// Changes the tints.
        pub seed: u32,
    }

    /// A share of brick and the tint of that brick.
    #[derive(Clone, Copy, Debug)]
    pub struct BrickShare {
        /// Share of brick within the footprint, in `[0, 1]`; the rest is mortar.
        pub brick: f32,
        /// A uniform number for each brick, in `[0, 1)`; the mean ½ where bricks are too small to be seen.
        pub tint: f32,
    }

    /// Mean over `[x - w/2, x + w/2]` of a wave of period 1 that is 1 in the first `duty` of its period and 0 after it.
    pub fn pulse_mean(x: f32, width: f32, duty: f32) -> f32 {
        let w = max(width, 1e-4);
        duty + (pulse_deviation(x + 0.5 * w, duty) - pulse_deviation(x - 0.5 * w, duty)) / w
    }

    /// Integral of the wave of [`pulse_mean`] from 0 to `x`, less that of its mean: periodic, so exact far from the origin.
    pub fn pulse_deviation(x: f32, duty: f32) -> f32 {
        let f = x - floor(x);
        min(f, duty) - duty * f
    }

    /// Mean over `[x - w/2, x + w/2]` of `x - floor(x)`.
    pub fn saw_mean(x: f32, width: f32) -> f32 {
        let w = max(width, 1e-4);
        0.5 + (saw_deviation(x + 0.5 * w) - saw_deviation(x - 0.5 * w)) / w
    }

    /// Integral of the saw of [`saw_mean`] from 0 to `x`, less that of its mean.
    pub fn saw_deviation(x: f32) -> f32 {
        let f = x - floor(x);
        0.5 * f * (f - 1.0)
    }

    /// Mean over `[x - w/2, x + w/2]` of ½ + ½ sin(2πx).
    pub fn sine_mean(x: f32, width: f32) -> f32 {
        let phase = x - floor(x);
        let a = PI * min(width, 1e4);
        let left = select(sin(a) / max(a, 1e-6), 1.0 - a * a * (1.0 / 6.0), a < 0.01);
        0.5 + 0.5 * left * cos_sin_turns(phase).y
    }

    /// Share of the odd cells of a unit checkerboard in space inside a cube around `p`, in `[0, 1]`. See [`checkerboard`].
    pub fn checkerboard_3d(p: Vec3f, width: f32) -> f32 {
        let w = max(width, 1e-4);
        let x = (square_wave_integral(p.x + 0.5 * w) - square_wave_integral(p.x - 0.5 * w)) / w;
        let y = (square_wave_integral(p.y + 0.5 * w) - square_wave_integral(p.y - 0.5 * w)) / w;
        let z = (square_wave_integral(p.z + 0.5 * w) - square_wave_integral(p.z - 0.5 * w)) / w;
        0.5 - 0.5 * x * y * z
    }

    /// The wall at `p`, x along the rows and y across them. `width`: of the footprint.
    pub fn brick_wall(b: Bricks, p: Vec2f, width: f32) -> BrickShare {
        let y = p.y / b.height;
        let row = floor(y);
        let odd = row - 2.0 * floor(0.5 * row);
        let x = p.x / b.width + odd * b.shift;
        let along = width / b.width;
        let across = width / b.height;
        // Half a joint on either side.
        let joint_x = 0.5 * b.mortar / b.width;
        let joint_y = 0.5 * b.mortar / b.height;
        let in_x = pulse_mean(x - joint_x, along, saturate(1.0 - 2.0 * joint_x));
        let in_y = pulse_mean(y - joint_y, across, saturate(1.0 - 2.0 * joint_y));
        let tint = unit_float(lattice_hash(lattice_floor(x), lattice_floor(row), 0, b.seed));
        let seen = octave_share(0.5 * max(along, across));
        BrickShare { brick: in_x * in_y, tint: 0.5 + (tint - 0.5) * seen }
    }

    /// Share of dots inside the footprint at `p`. In each square of side 1 there may be one dot, somewhere.
    ///
    /// - `radius`: of a dot, at most ½. `share`: of squares that have one. `width`: of the footprint.
    pub fn dot_share(p: Vec2f, width: f32, radius: f32, share: f32, seed: u32) -> f32 {
        let hash = lattice_hash(lattice_floor(p.x), lattice_floor(p.y), 0, seed);
        let mean = share * PI * radius * radius;
        let seen = octave_share(0.5 * width);
        let next = pcg_hash(hash);
        let room = max(0.5 - radius, 0.0);
        let shift = vec2f(unit_float(next) - 0.5, unit_float(pcg_hash(next)) - 0.5) * (2.0 * room);
        let inside = vec2f(p.x - floor(p.x) - 0.5, p.y - floor(p.y) - 0.5) - shift;
        let w = max(width, 1e-4);
        let covered = saturate((radius - length(inside)) / w + 0.5);
        let dot_here = select(0.0, covered, unit_float(hash) < share);
        mean + (dot_here - mean) * seen
    }

    /// A gradient, in `[0, 1]`. `kind`: `GRADIENT_…`.
    pub fn gradient_value(p: Vec3f, kind: u32) -> f32 {
        let x = saturate(p.x);
        if kind == GRADIENT_QUADRATIC {
            return x * x;
        }
        if kind == GRADIENT_EASING {
            return x * x * (3.0 - 2.0 * x);
        }
        if kind == GRADIENT_DIAGONAL {
            return saturate(0.5 * (p.x + p.y));
        }
        if kind == GRADIENT_SPHERICAL {
            return saturate(1.0 - length(p));
        }
        if kind == GRADIENT_RADIAL {
            // There is no angle in the middle, and machines differ in what they call it.
            if p.x == 0.0 && p.y == 0.0 {
                return 0.0;
            }
            let turns = atan2(p.y, p.x) * (0.5 / PI);
            return select(turns, turns + 1.0, turns < 0.0);
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use super::patterns::*;
    use wgsl_rs::std::*;

    /// Filtered values are means of unfiltered ones.
    #[test]
    fn filters_are_means() {
        let n = 4_000;
        let mean = |f: &dyn Fn(f32) -> f32, x: f32, w: f32| {
            (0..n).map(|i| f(x + w * ((i as f32 + 0.5) / n as f32 - 0.5))).sum::<f32>() / n as f32
        };
        for (x, w) in [(0.3, 0.5), (-1.2, 2.3), (7.9, 0.1), (0.0, 40.0)] {
            let cases: [(f32, f32); 3] = [
                (pulse_mean(x, w, 0.7), mean(&|x| f32::from(u8::from(x - x.floor() < 0.7)), x, w)),
                (saw_mean(x, w), mean(&|x| x - x.floor(), x, w)),
                (sine_mean(x, w), mean(&|x| 0.5 + 0.5 * (x * std::f32::consts::TAU).sin(), x, w)),
            ];
            for (i, (filtered, averaged)) in cases.into_iter().enumerate() {
                assert!((filtered - averaged).abs() < 2e-3, "{i} at {x} over {w}: {filtered} {averaged}");
            }
        }
    }

    #[test]
    fn far_away_patterns_are_their_means() {
        let wall = Bricks { width: 0.5, height: 0.25, mortar: 0.02, shift: 0.5, seed: 1 };
        let n = 200;
        let (mut bricks, mut dotted) = (0.0, 0.0);
        for i in 0..n * n {
            let p = vec2f((i % n) as f32, (i / n) as f32) * 0.1037;
            bricks += brick_wall(wall, p, 0.0).brick;
            dotted += dot_share(p, 0.0, 0.35, 0.5, 3);
        }
        let far = brick_wall(wall, vec2f(0.3, 0.4), 100.0);
        let (bricks, dotted) = (bricks / (n * n) as f32, dotted / (n * n) as f32);
        assert!((bricks - far.brick).abs() < 0.01, "{bricks} {}", far.brick);
        assert!((far.tint - 0.5).abs() < 1e-5);
        let dots_far = dot_share(vec2f(0.3, 0.4), 100.0, 0.35, 0.5, 3);
        assert!((dotted - dots_far).abs() < 0.02, "{dotted} {dots_far}");
        assert!((checkerboard_3d(vec3f(0.2, 0.7, 5.1), 100.0) - 0.5).abs() < 0.01);
    }

    #[test]
    fn cells_of_a_checkerboard_alternate_in_three_directions() {
        let at = |x: f32, y: f32, z: f32| checkerboard_3d(vec3f(x, y, z), 0.0).round();
        assert_eq!(
            [at(0.5, 0.5, 0.5), at(1.5, 0.5, 0.5), at(1.5, 1.5, 0.5), at(1.5, 1.5, 1.5)],
            [0.0, 1.0, 0.0, 1.0]
        );
    }

    #[test]
    fn gradients_go_from_zero_to_one() {
        for kind in 0..6 {
            for x in [-3.0, 0.0, 0.4, 1.0, 9.0] {
                let g = gradient_value(vec3f(x, 0.5 * x, 0.1), kind);
                assert!((0.0..=1.0).contains(&g), "{kind} at {x}: {g}");
            }
        }
    }
}
