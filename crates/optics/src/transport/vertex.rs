//! What every follower of paths does at a vertex: which random numbers it draws, whether a light sample may count, and
//! how the path goes on.
//!
//! A follower fetches the surface and its closure, asks these functions, and traces the rays that they speak of. It may
//! do so path by path or in queues, on any device: the numbers are the same.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod vertex {
    use crate::frame::*;
    use crate::light::*;
    use crate::path::*;
    use crate::scatter::*;
    use wgsl_rs::std::*;

    // The table of random numbers. They come in pairs. That of time is `PAIR_TIME` of the module
    // `shutter`.

    /// The pair that says where on the pixel a sample is.
    pub const PAIR_FILM: u32 = 0u32;
    /// The pair that says where on the lens.
    pub const PAIR_LENS: u32 = 1u32;
    /// Pairs of a camera ray, before those of the first vertex.
    pub const PAIRS_BEFORE_VERTICES: u32 = 2u32;
    /// Pairs of each vertex.
    pub const PAIRS_PER_VERTEX: u32 = 4u32;
    /// Of those of a vertex, the pair that the next direction is sampled with.
    pub const PAIR_BSDF: u32 = 0u32;
    /// The pair that a light is chosen and sampled with.
    pub const PAIR_LIGHT: u32 = 1u32;
    /// x: which lobe. y: Russian roulette.
    pub const PAIR_LOBE: u32 = 2u32;
    /// x: which of the models that a material mixes, or which colour is refracted. y: which of the lights that a tile of
    /// a real-time frame offers.
    pub const PAIR_MODEL: u32 = 3u32;

    /// Shadow rays end this share of the way before the light, so that they do not hit the light itself.
    pub const SHADOW_END: f32 = 0.9999;

    /// Segments of which it is always asked where they end: layers show first surfaces, and filters want to know how far
    /// away from them second ones are.
    pub const SEGMENTS_LOOKED_AT: u32 = 2u32;

    /// The first pair of a vertex's random numbers. `depth`: of the path that arrives there, ≥ 1.
    pub fn vertex_pair(depth: u32) -> u32 {
        PAIRS_BEFORE_VERTICES + PAIRS_PER_VERTEX * (depth - 1u32)
    }

    /// Whether nothing of the segment that a path is on counts but light at its end.
    pub fn is_last_segment(depth: u32, max_depth: u32) -> bool {
        depth >= max_depth && depth > SEGMENTS_LOOKED_AT
    }

    /// How Russian roulette ends paths: see [`roulette_survival`].
    #[derive(Clone, Copy, Debug)]
    pub struct Roulette {
        /// Paths shorter than this many segments always live.
        pub start: u32,
        /// Least probability of living, in `(0, 1]`.
        pub min_survival: f32,
    }

    /// A light sample, as a surface sees it.
    #[derive(Clone, Copy, Debug)]
    pub struct LightSide {
        /// Direction towards the light in the shading frame.
        pub wi: Vec3f,
        /// Whether the light is on the side of the geometric normal.
        pub above: bool,
        /// Whether the light can contribute.
        pub possible: bool,
    }

    /// How a path goes on from a vertex.
    #[derive(Clone, Copy, Debug)]
    pub struct Continuation {
        /// The state on the next segment.
        pub state: PathState,
        /// Unit direction of the next segment, world space.
        pub wi: Vec3f,
        /// Whether that is on the side of the geometric normal.
        pub above: bool,
        /// Whether the path goes on. If not, the rest means nothing.
        pub alive: bool,
    }

    /// The path at its first vertex where it parts in several: the branches share what comes.
    pub fn path_branch(path: PathState, branches: u32) -> PathState {
        let mut next = path;
        next.throughput = path.throughput * (1.0 / f32(branches));
        next
    }

    /// What guides denoisers where a path arrives that has met nothing yet but mirrors and clear glass: the surface's
    /// `albedo` as it is seen in them, in `[0, 1]`.
    ///
    /// - `throughput`: of the path as it arrives, `depth` its segments. `branches`: paths that go on from the first vertex,
    ///   which have divided the throughput among them.
    pub fn seen_albedo(throughput: Vec3f, depth: u32, branches: u32, albedo: Vec3f) -> Vec3f {
        let seen = throughput * select(1.0, f32(branches), depth > 1u32);
        let black = vec3f(0.0, 0.0, 0.0);
        clamp(seen * albedo, black, vec3f(1.0, 1.0, 1.0))
    }

    /// Where a light sample is for a surface, and whether it can contribute.
    ///
    /// - `wi`, `pdf`: of the sample, world space. `frame`: for shading. `horizon`: unit normal that says which side of the
    ///   surface a direction is on. `transmits`: whether light can arrive from below.
    pub fn light_side(wi: Vec3f, pdf: f32, frame: Frame, horizon: Vec3f, transmits: bool) -> LightSide {
        let above = dot(wi, horizon) > 0.0;
        let local = to_local(frame, wi);
        // Directions between shading and geometric normal would leak through the surface.
        let one_side = above == (local.z > 0.0);
        LightSide { wi: local, above: above, possible: pdf > 0.0 && (above || transmits) && one_side }
    }

    /// As [`light_side`], for who asks only whether the sample can contribute. `normal`: for shading, unit.
    pub fn light_is_possible(wi: Vec3f, pdf: f32, normal: Vec3f, horizon: Vec3f, transmits: bool) -> bool {
        let above = dot(wi, horizon) > 0.0;
        pdf > 0.0 && (above || transmits) && above == (dot(wi, normal) > 0.0)
    }

    /// The shadow ray to a light sample. `offset`: from the point that the sample was made for to the ray's origin, metres.
    pub fn shadow_way(wi: Vec3f, distance: f32, offset: Vec3f) -> LightWay {
        let way = light_way(wi, distance, offset);
        LightWay { direction: way.direction, distance: way.distance * SHADOW_END }
    }

    /// Whether a sampled direction leaves the surface on the side where its lobe is. Between shading and geometric normal
    /// there are others, which would leak through the surface.
    pub fn leaves_surface(s: BsdfSample, above: bool) -> bool {
        let nowhere = s.pdf <= 0.0;
        !nowhere && above != s.transmitted
    }

    /// The path's continuation at a surface.
    ///
    /// - `frame`, `horizon`: as for [`light_side`]. `eta`: relative index of refraction of a transmitted direction.
    /// - `u`: uniform number for Russian roulette.
    pub fn continue_from_surface(
        path: PathState,
        s: BsdfSample,
        frame: Frame,
        horizon: Vec3f,
        eta: f32,
        roulette: Roulette,
        u: f32,
    ) -> Continuation {
        let wi = to_world(frame, s.wi);
        let above = dot(wi, horizon) > 0.0;
        if !leaves_surface(s, above) {
            return Continuation { state: path, wi: wi, above: above, alive: false };
        }
        let mut next = path_scatter(path, s, eta);
        let survival = roulette_survival(next, roulette.start, roulette.min_survival);
        next.throughput = next.throughput * (1.0 / survival);
        Continuation { state: next, wi: wi, above: above, alive: u < survival }
    }
}

#[cfg(test)]
mod tests {
    use super::vertex::*;
    use crate::frame::frame_from_normal;
    use crate::path::path_start;
    use crate::scatter::BsdfSample;
    use crate::{Vec3f, vec3f};

    const UP: Vec3f = Vec3f::vec3(0.0, 0.0, 1.0);

    fn direction(z: f32, transmitted: bool) -> BsdfSample {
        let x = (1.0 - z * z).sqrt();
        BsdfSample { wi: vec3f(x, 0.0, z), weight: vec3f(0.5, 0.5, 0.5), pdf: 1.0, delta: false, transmitted }
    }

    #[test]
    fn vertices_share_no_random_numbers() {
        assert_eq!(vertex_pair(1), PAIRS_BEFORE_VERTICES);
        assert!(PAIR_FILM < vertex_pair(1) && PAIR_LENS < vertex_pair(1));
        for pair in [PAIR_BSDF, PAIR_LIGHT, PAIR_LOBE, PAIR_MODEL] {
            assert!(vertex_pair(7) + pair < vertex_pair(8));
        }
    }

    #[test]
    fn nothing_leaks_between_shading_and_geometric_normal() {
        let horizon = vec3f(0.6, 0.0, 0.8);
        let frame = frame_from_normal(UP);
        let roulette = Roulette { start: 9, min_survival: 0.1 };
        let between = vec3f(-0.95, 0.0, 0.3122499);
        for transmits in [false, true] {
            assert!(!light_side(between, 1.0, frame, horizon, transmits).possible);
            let side = light_side(between * -1.0, 1.0, frame, horizon, transmits);
            assert!(side.above && side.wi.z < 0.0 && !side.possible);
        }
        assert!(light_side(UP, 1.0, frame, horizon, false).possible);
        assert!(!light_side(UP, 0.0, frame, horizon, false).possible);
        assert!(!light_side(UP * -1.0, 1.0, frame, horizon, false).possible);
        assert!(light_side(UP * -1.0, 1.0, frame, horizon, true).possible);
        let go_on = |s| continue_from_surface(path_start(), s, frame, horizon, 1.5, roulette, 0.5);
        for (z, transmitted) in [(1.0, false), (-1.0, true)] {
            assert!(go_on(direction(z, transmitted)).alive);
            assert!(!go_on(direction(z, !transmitted)).alive);
            assert!(!go_on(BsdfSample { pdf: 0.0, ..direction(z, transmitted) }).alive);
        }
    }

    #[test]
    fn roulette_keeps_the_expected_throughput() {
        let frame = frame_from_normal(UP);
        let roulette = Roulette { start: 1, min_survival: 0.05 };
        let n = 1000;
        let mean = (0..n)
            .map(|i| {
                let u = (i as f32 + 0.5) / n as f32;
                let c =
                    continue_from_surface(path_start(), direction(1.0, false), frame, UP, 1.0, roulette, u);
                if c.alive { c.state.throughput.x / n as f32 } else { 0.0 }
            })
            .sum::<f32>();
        assert!((mean - 0.5).abs() < 1e-3, "{mean}");
    }
}
