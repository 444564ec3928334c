//! Media that scatter and emit light.
//!
//! A path through a medium goes straight for a distance that [`medium_sample`] draws, and there scatters by the phase
//! function of Henyey and Greenstein. Colours have different extinctions but share a path, so the distance is drawn for
//! one of the three, and its weight is that of all three together: the balance heuristic over the channels.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod volume {
    use crate::constants::*;
    use crate::frame::*;
    use crate::math::*;
    use crate::medium::*;
    use crate::path::*;
    use wgsl_rs::std::*;

    /// A medium at one point; the same at all points where it is homogeneous. Coefficients are m⁻¹ and ≥ 0.
    #[derive(Clone, Copy, Debug)]
    pub struct Medium {
        /// Absorption coefficient.
        pub absorption: Vec3f,
        /// Scattering coefficient.
        pub scattering: Vec3f,
        /// Radiance that a metre of the medium emits, W·sr⁻¹·m⁻³.
        pub emission: Vec3f,
        /// Mean cosine of the angle by which light turns, in `(−1, 1)`; 0 is isotropic, positive forwards.
        pub anisotropy: f32,
    }

    /// How far a path gets in a medium.
    #[derive(Clone, Copy, Debug)]
    pub struct MediumSample {
        /// Metres to the point where it scatters, or all the way.
        pub distance: f32,
        /// Whether it scatters before the end of the way.
        pub scattered: bool,
        /// Transmittance, times the scattering coefficient where it scatters, over the density of the distance.
        pub weight: Vec3f,
    }

    /// What a path does at a tentative collision with a medium; see [`collide`].
    #[derive(Clone, Copy, Debug)]
    pub struct Collision {
        /// Whether it scatters; otherwise it goes on as if there had been nothing.
        pub scattered: bool,
        /// Factor on the throughput.
        pub weight: Vec3f,
    }

    /// A medium that does nothing.
    pub fn vacuum() -> Medium {
        Medium {
            absorption: vec3f(0.0, 0.0, 0.0),
            scattering: vec3f(0.0, 0.0, 0.0),
            emission: vec3f(0.0, 0.0, 0.0),
            anisotropy: 0.0,
        }
    }

    /// The extinction coefficient, m⁻¹: light that is absorbed or scattered leaves its way.
    pub fn medium_extinction(m: Medium) -> Vec3f {
        m.absorption + m.scattering
    }

    /// Whether light changes its direction in the medium.
    pub fn medium_scatters(m: Medium) -> bool {
        m.scattering.x + m.scattering.y + m.scattering.z > 0.0
    }

    /// Probabilities of drawing a distance for each channel: its share of the path's throughput. So no channel's
    /// throughput ever becomes more than the sum of all, however different the extinctions are.
    pub fn channel_probabilities(throughput: Vec3f) -> Vec3f {
        let sum = throughput.x + throughput.y + throughput.z;
        if sum > 0.0 && is_finite(sum) {
            return throughput * (1.0 / sum);
        }
        vec3f(0.33333334, 0.33333334, 0.33333334)
    }

    /// The channel that a uniform number chooses, by its coefficient.
    pub fn choose_channel(values: Vec3f, probabilities: Vec3f, u: f32) -> f32 {
        if u < probabilities.x {
            return values.x;
        }
        // Rounding must not choose a channel that cannot be chosen.
        if u < probabilities.x + probabilities.y || probabilities.z <= 0.0 {
            return select(values.x, values.y, probabilities.y > 0.0);
        }
        values.z
    }

    /// Draws how far a path gets in a homogeneous medium.
    ///
    /// - `throughput`: of the path, which decides the channel; `end`: length of the way, metres.
    /// - `u`: `u.x` chooses the channel, `u.y` the distance.
    pub fn medium_sample(m: Medium, throughput: Vec3f, end: f32, u: Vec2f) -> MediumSample {
        let extinction = medium_extinction(m);
        let p = channel_probabilities(throughput);
        let chosen = choose_channel(extinction, p, u.x);
        // A channel that nothing happens to goes all the way.
        let drawn = select(FAR, -log(1.0 - u.y) / chosen, chosen > 0.0);
        let scattered = drawn < end;
        let distance = min(drawn, end);
        let left = transmittance(extinction, distance);
        if scattered {
            let pdf = dot(p, extinction * left);
            return MediumSample {
                distance: distance,
                scattered: true,
                weight: m.scattering * left * (1.0 / max(pdf, 1.0e-30)),
            };
        }
        MediumSample {
            distance: distance,
            scattered: false,
            weight: left * (1.0 / max(dot(p, left), 1.0e-30)),
        }
    }

    /// Radiance that the medium emits along a way of `distance` metres towards its beginning: (1 − exp(−σ d)) / σ metres
    /// of it arrive.
    pub fn medium_emitted(m: Medium, distance: f32) -> Vec3f {
        let s = medium_extinction(m);
        m.emission
            * vec3f(
                effective_length(s.x, distance),
                effective_length(s.y, distance),
                effective_length(s.z, distance),
            )
    }

    /// The integral of the transmittance over a way: (1 − exp(−σ d)) / σ metres.
    pub fn effective_length(extinction: f32, distance: f32) -> f32 {
        let depth = extinction * distance;
        // Of a small optical depth the difference from 1 has no digits left.
        if depth < 1.0e-3 {
            return distance * (1.0 - 0.5 * depth);
        }
        (1.0 - exp(-depth)) / extinction
    }

    /// Probability with which Russian roulette lets a path live that has scattered in a medium; otherwise
    /// as `roulette_survival`.
    ///
    /// Here it may be 1: of a long way through what absorbs next to nothing, a bound below 1 would leave few paths that count
    /// for very many.
    pub fn medium_survival(path: PathState, start: u32, min_survival: f32) -> f32 {
        if path.depth < start {
            return 1.0;
        }
        clamp(max_component(path.throughput) * path.eta_scale, min_survival, 1.0)
    }

    /// The medium at a point where it has a density.
    pub fn diluted(m: Medium, density: f32) -> Medium {
        Medium {
            absorption: m.absorption * density,
            scattering: m.scattering * density,
            emission: m.emission * density,
            anisotropy: m.anisotropy,
        }
    }

    /// Decides whether a path scatters at a tentative collision, of which there are `majorant` a metre.
    ///
    /// - `m`: the medium at the point; its extinction is at most `majorant`, m⁻¹. `u`: uniform number.
    ///
    /// Absorption is in the weight. The choice goes by the channel that each event brings most for.
    /// Source: Kutz, Habel, Li and Novák, "Spectral and Decomposition Tracking", SIGGRAPH 2017, section 5.
    pub fn collide(m: Medium, majorant: f32, throughput: Vec3f, u: f32) -> Collision {
        let missing = vec3f(majorant, majorant, majorant) - medium_extinction(m);
        let none = max(missing, vec3f(0.0, 0.0, 0.0));
        let scatters = max_component(throughput * m.scattering);
        let goes_on = max_component(throughput * none);
        let sum = scatters + goes_on;
        if sum <= 0.0 {
            return Collision { scattered: false, weight: vec3f(0.0, 0.0, 0.0) };
        }
        if u * sum < scatters {
            return Collision { scattered: true, weight: m.scattering * (sum / (majorant * scatters)) };
        }
        Collision { scattered: false, weight: none * (sum / (majorant * max(goes_on, 1.0e-30))) }
    }

    /// What a tentative collision leaves of the transmittance of a way: the probability of having met nothing.
    /// Source: Novák, Selle and Jarosz, "Residual Ratio Tracking for Estimating Attenuation in Participating Media", SIGGRAPH
    /// Asia 2014.
    pub fn ratio_tracking_factor(extinction: Vec3f, majorant: f32) -> Vec3f {
        max(vec3f(1.0, 1.0, 1.0) - extinction * (1.0 / majorant), vec3f(0.0, 0.0, 0.0))
    }

    /// Where a ray is below a height: from `x` to `y` metres along it; nowhere if `y` is not more than `x`.
    ///
    /// - `height`: of the ray's origin; `slope`: y of its unit direction; `end`: its length, metres.
    pub fn below_height(height: f32, slope: f32, top: f32, end: f32) -> Vec2f {
        let crossing = select((top - height) / slope, end, slope == 0.0);
        if height <= top {
            return vec2f(0.0, select(end, clamp(crossing, 0.0, end), slope > 0.0));
        }
        vec2f(select(end, clamp(crossing, 0.0, end), slope < 0.0), end)
    }

    /// The phase function of Henyey and Greenstein, sr⁻¹; it is also the density over solid angle of [`phase_sample`].
    ///
    /// - `cos_theta`: between `wo` and `wi`, which both point away: −1 is light that goes straight on.
    /// - `g`: mean cosine of the angle by which light turns, in `(−1, 1)`.
    ///
    /// Source: Henyey and Greenstein, "Diffuse Radiation in the Galaxy", 1941.
    pub fn phase_eval(cos_theta: f32, g: f32) -> f32 {
        let d = max(1.0 + g * g + 2.0 * g * cos_theta, 1.0e-12);
        0.25 * INV_PI * (1.0 - g * g) / (d * sqrt(d))
    }

    /// Samples a direction by [`phase_eval`].
    ///
    /// - `wo`: unit direction back along the path. `u`: uniform numbers. Returns a unit vector.
    pub fn phase_sample(wo: Vec3f, g: f32, u: Vec2f) -> Vec3f {
        // Of the angle by which light turns; for small g the formula cancels, and the phase function is nearly flat.
        let ratio = (1.0 - g * g) / (1.0 - g + 2.0 * g * u.x);
        let forward = (1.0 + g * g - ratio * ratio) / (2.0 * g);
        let flat = 2.0 * u.x - 1.0;
        // To first order in g; the next one is g² (3 c² − 1) and smaller.
        let nearly_flat = flat + 1.5 * g * (1.0 - flat * flat);
        let cos_turn = clamp(select(forward, nearly_flat, abs(g) < 1.0e-3), -1.0, 1.0);
        let sin_turn = safe_sqrt(1.0 - cos_turn * cos_turn);
        let phi = TAU * u.y;
        to_world(frame_from_normal(-wo), vec3f(sin_turn * cos(phi), sin_turn * sin(phi), cos_turn))
    }
}
