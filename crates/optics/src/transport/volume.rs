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
    use crate::random::*;
    use crate::scatter::*;
    use crate::vertex::*;
    use wgsl_rs::std::*;

    /// Segments of a path through media, those between boundaries included: paths that never end otherwise end here.
    pub const MOST_SEGMENTS: u32 = 65536u32;
    /// Boundaries that light is followed through; what is behind more is dark.
    pub const MOST_CROSSINGS: u32 = 256u32;
    /// Pairs of random numbers for each segment: those of every vertex, and one for the distance.
    pub const PAIRS_PER_SEGMENT: u32 = 5u32;
    /// Which of these the distance is drawn with.
    pub const PAIR_DISTANCE: u32 = 4u32;
    /// What a stream of random numbers is for: the distances of a path.
    pub const STREAM_PATH: u32 = 0u32;
    /// The transmittance of the way to a light.
    pub const STREAM_SHADOW: u32 = 1u32;
    /// Tentative collisions of a segment; a path that has had more goes on as if there were nothing any more.
    pub const MOST_COLLISIONS: u32 = 65536u32;
    /// Tentative collisions along the diagonal of a grid that shines, at least.
    pub const FEWEST_COLLISIONS: f32 = 16.0;
    /// Transmittances that are less than this share are left to chance: a ray ends or counts more.
    pub const LITTLE_LIGHT: f32 = 0.05;

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

    /// A place among the centres of cells along an axis of a grid.
    #[derive(Clone, Copy, Debug)]
    pub struct GridPlace {
        /// The cell whose centre is before it.
        pub cell: u32,
        /// The next cell, or the same if there is only one.
        pub next: u32,
        /// How far it is beyond the first centre, in cells, in `[0, 1]`.
        pub beyond: f32,
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

    /// The first pair of random numbers of a segment of a path through media, and of the vertex at its end.
    ///
    /// - `segment`: how many the path has had with this one, ≥ 1.
    pub fn segment_pair(segment: u32) -> u32 {
        PAIRS_BEFORE_VERTICES + PAIRS_PER_SEGMENT * (segment - 1u32)
    }

    /// The path's continuation at a point of a medium.
    ///
    /// - `wi`: of the sample, which is in world space. `u`: uniform number for Russian roulette.
    /// - `walk`: 0, or, where the medium is the inside of what looks like a surface, the path's segments so far. Steps of
    ///   such a random walk are no vertices: they do not count for the path's depth, but long walks of what is nearly
    ///   absorbed end by roulette as long paths do.
    pub fn continue_in_medium(
        path: PathState,
        s: BsdfSample,
        walk: u32,
        roulette: Roulette,
        u: f32,
    ) -> Continuation {
        let mut state = path;
        if walk > 0u32 {
            state.depth = walk;
        }
        let mut next = path_scatter(state, s, 1.0);
        let survival = medium_survival(next, roulette.start, roulette.min_survival);
        next.throughput = next.throughput * (1.0 / survival);
        let mut alive = u < survival;
        if walk > 0u32 {
            next.depth = path.depth;
            alive = alive && next.throughput.x + next.throughput.y + next.throughput.z > 0.0;
        }
        Continuation { state: next, wi: s.wi, above: true, alive: alive }
    }

    /// A density between two cells along an axis.
    pub fn grid_mix(p: GridPlace, cell: f32, next: f32) -> f32 {
        cell * (1.0 - p.beyond) + next * p.beyond
    }

    /// The index of refraction of a body over that of what is around it.
    pub fn ior_across(inside: f32, around: f32) -> f32 {
        inside / around
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

    /// The extinction that paths are given in a grid's medium, m⁻¹: what the densest cell has in its densest channel. Zero
    /// or infinite if there is nothing to go through.
    ///
    /// - `m`: where the density is 1. `largest`: the largest density. `diagonal`: of the grid's bounds, metres.
    pub fn grid_majorant(m: Medium, largest: f32, diagonal: f32) -> f32 {
        let most = max_component(medium_extinction(m));
        if largest > 0.0 && max_component(m.emission) > 0.0 {
            // What shines must be met to be seen: some times on the way through, however thin it is.
            return max(most, FEWEST_COLLISIONS / (diagonal * largest)) * largest;
        }
        most * largest
    }

    /// Where the coordinate `x` is in a grid from `low` to `high` of so many cells; from the centres of the first and the
    /// last cell on to the bounds, nothing changes.
    pub fn grid_place(x: f32, low: f32, high: f32, cells: u32) -> GridPlace {
        let last = cells - 1u32;
        let scaled = (x - low) / (high - low) * f32(cells) - 0.5;
        let inside = clamp(scaled, 0.0, f32(last));
        let cell = min(u32(inside), max(last, 1u32) - 1u32);
        GridPlace { cell: cell, next: min(cell + 1u32, last), beyond: inside - f32(cell) }
    }

    /// Metres to the next tentative collision, of which there are `majorant` a metre; `u`: uniform number.
    pub fn collision_distance(majorant: f32, u: f32) -> f32 {
        -log(1.0 - u) / majorant
    }

    /// The first state of a stream of uniform numbers without end, the same ones for the same segment of the same sample.
    /// `purpose`: `STREAM_…`.
    pub fn stream_start(sampler: PixelSampler, segment: u32, purpose: u32) -> u32 {
        let of_sample = hash_combine(hash_combine(sampler.scramble, sampler.index), segment);
        hash_combine(of_sample, purpose)
    }

    /// The next state of a stream; `unit_float` of it is the next number.
    pub fn stream_next(state: u32) -> u32 {
        hash_combine(state, 0x6d2b79f5u32)
    }

    /// Where a path that scatters stops, metres along its ray: rounding must not put the point on the other side of what its
    /// segment ends at.
    ///
    /// - `origin`: of the ray. `end`: of the segment, metres.
    pub fn stopping_distance(origin: Vec3f, distance: f32, end: f32) -> f32 {
        let size = abs(origin);
        let rounding = (max_component(size) + distance) * 1.0e-6;
        max(min(distance, end - rounding), 0.0)
    }

    /// Where a ray is below a height: from `x` to `y` metres along it; nowhere if `y` is not more than `x`.
    ///
    /// - `height`: of the ray's origin; `slope`: y of its unit direction; `end`: its length, metres, or less than zero if rounding has
    ///   left nothing of it.
    pub fn below_height(height: f32, slope: f32, top: f32, end: f32) -> Vec2f {
        let crossing = select((top - height) / slope, end, slope == 0.0);
        let inside = max(min(crossing, end), 0.0);
        if height <= top {
            return vec2f(0.0, select(end, inside, slope > 0.0));
        }
        vec2f(select(end, inside, slope < 0.0), end)
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

    /// The phase function as what scatters light from `wi` to `wo`.
    pub fn phase_value(wo: Vec3f, wi: Vec3f, g: f32) -> BsdfValue {
        let value = phase_eval(dot(wo, wi), g);
        BsdfValue { value_cos: vec3f(value, value, value), pdf: value }
    }

    /// A direction sampled by the phase function, for a path.
    ///
    /// - `alone`: whether light is found in no other way, so that what the path comes upon counts in full.
    pub fn phase_scatter(wo: Vec3f, g: f32, alone: bool, u: Vec2f) -> BsdfSample {
        let wi = phase_sample(wo, g, u);
        let pdf = select(phase_eval(dot(wo, wi), g), 1.0, alone);
        BsdfSample { wi: wi, weight: vec3f(1.0, 1.0, 1.0), pdf: pdf, delta: alone, transmitted: false }
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
