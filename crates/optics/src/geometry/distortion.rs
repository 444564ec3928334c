//! Lenses that bend lines, as OpenCV's calibration describes them.
//!
//! A direction (x, y, 1), x to the right and y down, is seen at a distorted place of the film. A
//! camera needs the way back, which has no formula: Newton's method finds it within the field in
//! which the model is one to one. What lies outside of that field is not seen.
//!
//! Sources: Brown, "Decentering Distortion of Lenses", 1966, with the rational radial factor of
//! Claus and Fitzgibbon 2005, as in OpenCV's `projectPoints`; Kannala and Brandt, "A Generic Camera
//! Model", 2006, as in its `fisheye`.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod distortion {
    use crate::constants::*;
    use wgsl_rs::std::*;

    /// A pinhole.
    pub const DISTORTION_NONE: u32 = 0u32;
    /// Radial and tangential distortion; see [`brown_conrady`].
    pub const DISTORTION_BROWN_CONRADY: u32 = 1u32;
    /// A polynomial in the angle to the axis; see [`fisheye_radius`].
    pub const DISTORTION_FISHEYE: u32 = 2u32;
    /// Steps of Newton's method, rejected ones included. Real lenses need five.
    pub const NEWTON_STEPS: u32 = 24u32;

    /// How a lens differs from a pinhole.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Distortion {
        /// Which model: `DISTORTION_…`.
        pub model: u32,
        /// How far the film's columns lean: s / fx of a matrix of intrinsics.
        pub skew: f32,
        /// The end of the field in which the model is one to one: the tangent of the angle to the
        /// axis, or for a fisheye the angle, radians.
        pub limit: f32,
        /// k1, k2, k3, k4.
        pub radial: Vec4f,
        /// k5, k6, p1, p2; zero for a fisheye.
        pub rest: Vec4f,
    }

    /// Where a place of the film looks.
    #[derive(Clone, Copy, Debug)]
    pub struct LensDirection {
        /// To the right, down, along the axis. Brown's model has 1 along the axis, a fisheye unit
        /// length.
        pub direction: Vec3f,
        /// Whether the place is within the lens' field.
        pub valid: bool,
    }

    /// A pinhole.
    pub fn no_distortion() -> Distortion {
        Distortion {
            model: DISTORTION_NONE,
            skew: 0.0,
            limit: 0.0,
            radial: vec4f(0.0, 0.0, 0.0, 0.0),
            rest: vec4f(0.0, 0.0, 0.0, 0.0),
        }
    }

    /// Where Brown's model shows the direction (x, y, 1):
    /// x' = x R + 2 p1 x y + p2 (r² + 2 x²), y' = y R + p1 (r² + 2 y²) + 2 p2 x y, with
    /// R = (1 + k1 r² + k2 r⁴ + k3 r⁶) / (1 + k4 r² + k5 r⁴ + k6 r⁶).
    pub fn brown_conrady(d: Distortion, p: Vec2f) -> Vec2f {
        let r2 = p.x * p.x + p.y * p.y;
        let above = 1.0 + r2 * (d.radial.x + r2 * (d.radial.y + r2 * d.radial.z));
        let below = 1.0 + r2 * (d.radial.w + r2 * (d.rest.x + r2 * d.rest.y));
        let radial = above / below;
        let product = 2.0 * p.x * p.y;
        vec2f(
            p.x * radial + d.rest.z * product + d.rest.w * (r2 + 2.0 * p.x * p.x),
            p.y * radial + d.rest.z * (r2 + 2.0 * p.y * p.y) + d.rest.w * product,
        )
    }

    /// The derivatives of [`brown_conrady`]: of x' by x, of either by the other, of y' by y.
    pub fn brown_conrady_derivatives(d: Distortion, p: Vec2f) -> Vec3f {
        let r2 = p.x * p.x + p.y * p.y;
        let above = 1.0 + r2 * (d.radial.x + r2 * (d.radial.y + r2 * d.radial.z));
        let below = 1.0 + r2 * (d.radial.w + r2 * (d.rest.x + r2 * d.rest.y));
        let above_slope = d.radial.x + r2 * (2.0 * d.radial.y + r2 * 3.0 * d.radial.z);
        let below_slope = d.radial.w + r2 * (2.0 * d.rest.x + r2 * 3.0 * d.rest.y);
        let radial = above / below;
        // By r².
        let slope = (above_slope - radial * below_slope) / below;
        vec3f(
            radial + 2.0 * p.x * p.x * slope + 2.0 * d.rest.z * p.y + 6.0 * d.rest.w * p.x,
            2.0 * p.x * p.y * slope + 2.0 * d.rest.z * p.x + 2.0 * d.rest.w * p.y,
            radial + 2.0 * p.y * p.y * slope + 6.0 * d.rest.z * p.y + 2.0 * d.rest.w * p.x,
        )
    }

    /// The direction that Brown's model shows at `seen`.
    ///
    /// Newton's method in two dimensions. A step that does not come nearer is shortened, and none
    /// leaves the field.
    pub fn undistort_brown_conrady(d: Distortion, seen: Vec2f) -> LensDirection {
        let radius = length(seen);
        let accuracy = 1e-6 * (1.0 + radius);
        let mut p = seen * (min(radius, d.limit) / max(radius, 1e-20));
        let mut miss = brown_conrady(d, p) - seen;
        let mut share = 1.0;
        let mut step = 0u32;
        while step < NEWTON_STEPS && length(miss) > 0.1 * accuracy {
            step += 1u32;
            let j = brown_conrady_derivatives(d, p);
            let determinant = j.x * j.z - j.y * j.y;
            let divisor = select(determinant, 1e-12, abs(determinant) < 1e-12);
            let full = vec2f(j.z * miss.x - j.y * miss.y, j.x * miss.y - j.y * miss.x) * (1.0 / divisor);
            let mut next = p - full * share;
            let far = length(next);
            if far > d.limit {
                next = next * (d.limit / far);
            }
            let next_miss = brown_conrady(d, next) - seen;
            if length(next_miss) < length(miss) {
                p = next;
                miss = next_miss;
                share = min(2.0 * share, 1.0);
            } else {
                share = 0.25 * share;
            }
        }
        let j = brown_conrady_derivatives(d, p);
        let unfolded = j.x > 0.0 && j.z > 0.0 && j.x * j.z - j.y * j.y > 0.0;
        // Near the end of the field Newton's method is slow.
        let found = length(miss) <= 10.0 * accuracy;
        LensDirection { direction: vec3f(p.x, p.y, 1.0), valid: found && unfolded && length(p) < d.limit }
    }

    /// How far from the axis' image a fisheye shows what is at the angle `theta` to the axis,
    /// radians: θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸).
    pub fn fisheye_radius(d: Distortion, theta: f32) -> f32 {
        let t2 = theta * theta;
        theta * (1.0 + t2 * (d.radial.x + t2 * (d.radial.y + t2 * (d.radial.z + t2 * d.radial.w))))
    }

    /// The derivative of [`fisheye_radius`].
    pub fn fisheye_slope(d: Distortion, theta: f32) -> f32 {
        let t2 = theta * theta;
        1.0 + t2
            * (3.0 * d.radial.x + t2 * (5.0 * d.radial.y + t2 * (7.0 * d.radial.z + t2 * 9.0 * d.radial.w)))
    }

    /// The direction that a fisheye shows at `seen`.
    ///
    /// Newton's method between bounds, which are halved where it would leave them.
    pub fn undistort_fisheye(d: Distortion, seen: Vec2f) -> LensDirection {
        let radius = length(seen);
        let mut low = 0.0;
        let mut high = d.limit;
        let mut theta = min(radius, d.limit);
        let mut step = 0u32;
        while step < NEWTON_STEPS {
            step += 1u32;
            let miss = fisheye_radius(d, theta) - radius;
            if abs(miss) <= 1e-7 * (1.0 + radius) {
                break;
            }
            if miss > 0.0 {
                high = theta;
            } else {
                low = theta;
            }
            let newton = theta - miss / max(fisheye_slope(d, theta), 1e-6);
            theta = select(0.5 * (low + high), newton, newton > low && newton < high);
        }
        let scale = select(1.0, sin(theta) / radius, radius > 1e-12);
        LensDirection {
            direction: vec3f(seen.x * scale, seen.y * scale, cos(theta)),
            valid: radius < fisheye_radius(d, d.limit),
        }
    }

    /// Where a place of the film looks, which is in focal lengths from where the axis meets it: to
    /// the right and down.
    pub fn lens_direction(d: Distortion, film: Vec2f) -> LensDirection {
        let seen = vec2f(film.x - d.skew * film.y, film.y);
        if d.model == DISTORTION_FISHEYE {
            return undistort_fisheye(d, seen);
        }
        undistort_brown_conrady(d, seen)
    }

    /// Where a direction (to the right, down, along the axis) is seen on the film: the way back of
    /// [`lens_direction`]. `valid`: it is within the lens' field; the result's third component has
    /// no meaning.
    pub fn lens_film(d: Distortion, direction: Vec3f) -> LensDirection {
        let aside = length(vec2f(direction.x, direction.y));
        let p = vec2f(direction.x, direction.y) * (1.0 / max(direction.z, 1e-20));
        let mut seen = brown_conrady(d, p);
        let mut valid = direction.z > 0.0 && length(p) < d.limit;
        if d.model == DISTORTION_FISHEYE {
            let theta = atan2(aside, direction.z);
            seen = vec2f(direction.x, direction.y) * (fisheye_radius(d, theta) / max(aside, 1e-20));
            valid = theta < d.limit;
        }
        LensDirection { direction: vec3f(seen.x + d.skew * seen.y, seen.y, 1.0), valid: valid }
    }

    /// Where a ray starts that sees nothing: so far along the axis that all is behind it.
    pub fn beyond_everything(origin: Vec3f, axis: Vec3f) -> Vec3f {
        origin + axis * FAR
    }
}

use distortion::{DISTORTION_FISHEYE, DISTORTION_NONE, Distortion};

/// The largest tangent of an angle to the axis that Brown's model is asked for: 89.9°.
const WIDEST: f64 = 573.0;

impl Distortion {
    /// Brown's model or, where all coefficients are zero, a leaning film. `k`: k1 to k6. `p`: p1,
    /// p2. `skew`: s / fx.
    pub fn brown_conrady(k: [f32; 6], p: [f32; 2], skew: f32) -> Self {
        let [k1, k2, k3, k4, k5, k6] = k.map(f64::from);
        // What the radial factor is of an odd function of the radius: the field ends where that
        // falls, or has a pole.
        let grows = |r: f64| {
            let s = r * r;
            let (above, below) = (1.0 + s * (k1 + s * (k2 + s * k3)), 1.0 + s * (k4 + s * (k5 + s * k6)));
            let above_slope = k1 + s * (2.0 * k2 + s * 3.0 * k3);
            let below_slope = k4 + s * (2.0 * k5 + s * 3.0 * k6);
            let slope =
                above / below + 2.0 * s * (above_slope * below - above * below_slope) / (below * below);
            below > 0.0 && slope > 0.0
        };
        Self {
            model: distortion::DISTORTION_BROWN_CONRADY,
            skew,
            limit: end_of_growth(grows, |r| r + 0.002 * (1.0 + r), WIDEST),
            radial: wgsl_rs::std::vec4f(k[0], k[1], k[2], k[3]),
            rest: wgsl_rs::std::vec4f(k[4], k[5], p[0], p[1]),
        }
    }

    /// A fisheye. `k`: k1 to k4. `skew`: s / fx.
    pub fn fisheye(k: [f32; 4], skew: f32) -> Self {
        let [k1, k2, k3, k4] = k.map(f64::from);
        let grows = |t: f64| {
            let s = t * t;
            1.0 + s * (3.0 * k1 + s * (5.0 * k2 + s * (7.0 * k3 + s * 9.0 * k4))) > 0.0
        };
        Self {
            model: DISTORTION_FISHEYE,
            skew,
            limit: end_of_growth(grows, |t| t + 0.001, std::f64::consts::PI),
            radial: wgsl_rs::std::vec4f(k[0], k[1], k[2], k[3]),
            rest: wgsl_rs::std::vec4f(0.0, 0.0, 0.0, 0.0),
        }
    }

    /// Whether it is a pinhole.
    pub fn is_none(&self) -> bool {
        self.model == DISTORTION_NONE
    }
}

/// The end of the interval from 0 on which something holds that holds at 0, at most `last`. `next`:
/// the next place to look at.
fn end_of_growth(holds: impl Fn(f64) -> bool, next: impl Fn(f64) -> f64, last: f64) -> f32 {
    let mut low = 0.0;
    while low < last {
        let mut high = next(low).min(last);
        if holds(high) {
            low = high;
            continue;
        }
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if holds(middle) { low = middle } else { high = middle }
        }
        return low as f32;
    }
    last as f32
}

#[cfg(test)]
mod tests {
    use super::distortion::*;
    use wgsl_rs::std::*;

    /// A webcam, a wide angle, and one with all coefficients.
    const LENSES: [([f32; 6], [f32; 2]); 4] = [
        ([0.0; 6], [0.0; 2]),
        ([0.115, -0.21, 0.02, 0.0, 0.0, 0.0], [0.001, -0.002]),
        ([-0.38, 0.17, -0.04, 0.0, 0.0, 0.0], [0.0004, 0.0007]),
        ([12.1, 5.4, 0.31, 12.4, 9.6, 1.4], [-0.0002, 0.0003]),
    ];

    /// Values of the formulas, computed in double precision with another program.
    #[test]
    fn brown_conrady_is_the_published_formula() {
        let d = Distortion::brown_conrady([-0.3, 0.1, -0.02, 0.05, 0.01, 0.002], [0.003, -0.004], 0.0);
        let (x, y) = (0.5f64, -0.3f64);
        let r2 = x * x + y * y;
        let radial = (1.0 - 0.3 * r2 + 0.1 * r2 * r2 - 0.02 * r2 * r2 * r2)
            / (1.0 + 0.05 * r2 + 0.01 * r2 * r2 + 0.002 * r2 * r2 * r2);
        let expected = [
            x * radial + 2.0 * 0.003 * x * y - 0.004 * (r2 + 2.0 * x * x),
            y * radial + 0.003 * (r2 + 2.0 * y * y) - 2.0 * 0.004 * x * y,
        ];
        let actual = brown_conrady(d, vec2f(x as f32, y as f32));
        assert!((f64::from(actual.x) - expected[0]).abs() < 1e-6, "{actual:?} {expected:?}");
        assert!((f64::from(actual.y) - expected[1]).abs() < 1e-6, "{actual:?} {expected:?}");
        // By hand: on the axis x at r = 1, k1 = 0.1 and p2 = 0.01 give 1.1 + 0.03.
        let d = Distortion::brown_conrady([0.1, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0, 0.01], 0.0);
        assert!((brown_conrady(d, vec2f(1.0, 0.0)).x - 1.13).abs() < 1e-6);
        let d = Distortion::fisheye([0.1, -0.01, 0.001, 0.0001], 0.0);
        assert!((fisheye_radius(d, 1.0) - 1.0911).abs() < 1e-6);
    }

    #[test]
    fn derivatives_are_those_of_the_model() {
        for (k, p) in LENSES {
            let d = Distortion::brown_conrady(k, p, 0.0);
            let (at, h) = (vec2f(0.21, -0.34), 1e-2);
            let by = |v: Vec2f| (brown_conrady(d, at + v * h) - brown_conrady(d, at - v * h)) * (0.5 / h);
            let (x, y) = (by(vec2f(1.0, 0.0)), by(vec2f(0.0, 1.0)));
            let j = brown_conrady_derivatives(d, at);
            let expected = [x.x, x.y, y.x, y.y];
            for (a, b) in [j.x, j.y, j.y, j.z].into_iter().zip(expected) {
                assert!((a - b).abs() < 2e-3, "{k:?}: {j:?} instead of {expected:?}");
            }
        }
    }

    #[test]
    fn directions_come_back_within_the_field() {
        let fisheyes = [[0.0; 4], [-0.02, 0.005, -0.002, 0.0003], [0.1, 0.02, 0.0, 0.0]];
        let brown = LENSES.map(|(k, p)| Distortion::brown_conrady(k, p, 0.01));
        let fisheyes = fisheyes.map(|k| Distortion::fisheye(k, -0.02));
        for d in brown.into_iter().chain(fisheyes) {
            let most =
                if d.model == DISTORTION_FISHEYE { 0.98 * d.limit } else { (0.97 * d.limit).atan().min(1.4) };
            for i in 0..200 {
                let (theta, phi) = (most * (i as f32 + 0.5) / 200.0, 2.4 * i as f32);
                let direction = vec3f(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
                let film = lens_film(d, direction);
                assert!(film.valid, "{d:?}: {theta}");
                let back = lens_direction(d, vec2f(film.direction.x, film.direction.y));
                assert!(back.valid, "{d:?}: {direction:?} is at {:?}, which sees nothing", film.direction);
                let length = length(back.direction);
                let error = back.direction * (1.0 / length) - direction;
                assert!(self::length(error) < 1e-3, "{d:?}: {direction:?} came back as {:?}", back.direction);
            }
        }
    }

    fn length(v: Vec3f) -> f32 {
        (v.x * v.x + v.y * v.y + v.z * v.z).sqrt()
    }

    #[test]
    fn what_lies_outside_of_the_field_is_not_seen() {
        // r (1 − r²) has its maximum 0.3849 at r = 0.57735.
        let d = Distortion::brown_conrady([-1.0, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0; 2], 0.0);
        assert!((d.limit - 0.57735).abs() < 1e-4, "{}", d.limit);
        for i in 0..64 {
            let (sin, cos) = (0.1 * i as f32).sin_cos();
            let at = |r: f32| lens_direction(d, vec2f(r * cos, r * sin));
            assert!(at(0.38).valid && !at(0.39).valid && !at(3.0).valid && !at(1e6).valid);
        }
        assert!(!lens_film(d, vec3f(0.7, 0.0, 1.0)).valid && !lens_film(d, vec3f(0.0, 0.0, -1.0)).valid);
        // A fisheye sees what is behind it: an equidistant one all.
        let d = Distortion::fisheye([0.0; 4], 0.0);
        let back = lens_direction(d, vec2f(3.0, 0.0));
        assert!(back.valid && back.direction.z < -0.9 && !lens_direction(d, vec2f(3.2, 0.0)).valid);
        // The denominator's pole ends the field too.
        let d = Distortion::brown_conrady([0.0, 0.0, 0.0, -1.0, 0.0, 0.0], [0.0; 2], 0.0);
        assert!((d.limit - 1.0).abs() < 1e-3, "{}", d.limit);
    }
}
