//! The state of a path and its update: path tracing with next-event estimation and multiple importance sampling.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod path {
    use crate::math::*;
    use crate::mis::*;
    use crate::scatter::*;
    use wgsl_rs::std::*;

    /// A path between two vertices.
    #[derive(Clone, Copy, Debug)]
    pub struct PathState {
        /// What light found now contributes to the pixel, relative to its radiance.
        pub throughput: Vec3f,
        /// Radiance gathered so far.
        pub radiance: Vec3f,
        /// Density over solid angle with which the current direction was sampled; only meaningful if not `specular`.
        pub pdf: f32,
        /// Whether the current direction comes from the camera or a delta lobe: light it finds then counts in full.
        pub specular: bool,
        /// Product of the squares of the relative indices of refraction passed: undoes radiance compression when
        /// roulette judges the throughput.
        pub eta_scale: f32,
        /// Number of segments so far: 1 after the camera ray.
        pub depth: u32,
    }

    /// The state of a path that has just left the camera.
    pub fn path_start() -> PathState {
        PathState {
            throughput: vec3f(1.0, 1.0, 1.0),
            radiance: vec3f(0.0, 0.0, 0.0),
            pdf: 0.0,
            specular: true,
            eta_scale: 1.0,
            depth: 1u32,
        }
    }

    /// Light found by following the path's own direction.
    ///
    /// - `emitted`: radiance towards the path. `light_pdf`: density over solid angle with which next-event estimation
    ///   would have sampled this direction from the previous vertex, 0 if it could not have.
    pub fn path_add_emission(
        path: PathState,
        emitted: Vec3f,
        light_pdf: f32,
        mis: MisHeuristic,
    ) -> PathState {
        let counts_in_full = path.specular || light_pdf <= 0.0;
        let weight = select(bsdf_sample_weight(mis, path.pdf, light_pdf), 1.0, counts_in_full);
        let mut next = path;
        next.radiance = path.radiance + path.throughput * emitted * weight;
        next
    }

    /// What an unoccluded light sample adds to the pixel: next-event estimation.
    ///
    /// - `radiance`, `light_pdf`, `delta`: of the light sample, its density including the choice of the light.
    /// - `bsdf`: value times cosine and density for the sampled direction.
    pub fn path_light_contribution(
        throughput: Vec3f,
        bsdf: BsdfValue,
        radiance: Vec3f,
        light_pdf: f32,
        delta: bool,
        mis: MisHeuristic,
    ) -> Vec3f {
        if light_pdf <= 0.0 {
            return vec3f(0.0, 0.0, 0.0);
        }
        let weight = select(light_sample_weight(mis, light_pdf, bsdf.pdf), 1.0, delta);
        throughput * bsdf.value_cos * radiance * (weight / light_pdf)
    }

    /// Light that a path has found, of which no more than `most` counts if it is indirect: if it has come by more than two
    /// segments. The colour stays; the largest component becomes `most`.
    ///
    /// - `segments`: of the path, that to the light included.
    pub fn limit_indirect(found: Vec3f, segments: u32, most: f32) -> Vec3f {
        let largest = max_component(found);
        if segments > 2u32 && largest > most {
            return found * (most / largest);
        }
        found
    }

    /// A path after a step on which it may have found light, limited as [`limit_indirect`] says. `before`: what it had
    /// gathered before the step.
    pub fn path_limit_found(path: PathState, before: Vec3f, most: f32) -> PathState {
        let found = path.radiance - before;
        if path.depth <= 2u32 || max_component(found) <= most {
            return path;
        }
        let mut next = path;
        next.radiance = before + limit_indirect(found, path.depth, most);
        next
    }

    /// Follows a sampled direction to the next vertex. `eta`: relative index of refraction of a transmitted direction.
    pub fn path_scatter(path: PathState, s: BsdfSample, eta: f32) -> PathState {
        let mut next = path;
        next.throughput = path.throughput * s.weight;
        next.pdf = s.pdf;
        next.specular = s.delta;
        next.eta_scale = path.eta_scale * select(1.0, eta * eta, s.transmitted);
        next.depth = path.depth + 1u32;
        next
    }

    /// Probability with which Russian roulette lets a path live.
    ///
    /// - `start`: paths shorter than this many segments always live. `min_survival`: lower bound, in `(0, 1]`.
    ///
    /// A path is judged by its largest throughput, freed of radiance compression (as pbrt and Mitsuba do); survivors
    /// are divided by the probability, so the expected picture does not change.
    pub fn roulette_survival(path: PathState, start: u32, min_survival: f32) -> f32 {
        if path.depth < start {
            return 1.0;
        }
        max(min(max_component(path.throughput) * path.eta_scale, 0.95), min_survival)
    }
}
