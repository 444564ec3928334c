//! What the stages of a batch of paths share: its queues, and what is the same for all paths.

use crate::batch::samples::{Run, SampleId, time_of};
use crate::batch::streams::{Connection, HitStream, Path, PathStream, ShadowStream};
use crate::batch::vertices::VertexQueue;
use crate::fetch::triangles::TriangleRows;
use crate::guided::finds::Finds;
use crate::scene::CpuScene;
use crate::shade::glossy_lanes::GlossyLanes;
use crate::shade::material::Shading;
use accel::Ray;
use backend::PathSettings;
use film::AovSample;
use optics::mis::MisHeuristic;
use optics::random::{PixelSampler, sample_2d};
use optics::vertex::{Roulette, is_last_segment, vertex_pair};
use optics::{Vec2f, Vec3f};

/// Scratch memory of one worker. Everything is reused: a path allocates nothing.
#[derive(Default)]
pub(crate) struct PathBatch {
    pub(crate) paths: PathStream,
    pub(crate) hits: HitStream,
    pub(crate) next: PathStream,
    pub(crate) shadows: ShadowStream,
    pub(crate) occluded: Vec<bool>,
    pub(crate) triangles: TriangleRows,
    pub(crate) diffuse: VertexQueue,
    pub(crate) smooth: VertexQueue,
    pub(crate) glossy: VertexQueue,
    pub(crate) glossy_lanes: GlossyLanes,
    /// The samples being made; kept here between blocks for its memory only.
    pub ids: Vec<SampleId>,
    /// How `ids` is divided among pixels; kept for its memory, too.
    pub runs: Vec<Run>,
    /// Radiance of each sample of the batch. While samples are made, each branch of their paths has a sum, or slot, of its own: in
    /// which order vertices of several branches are done depends on the batch, and sums must not.
    pub radiance: Vec<Vec3f>,
    /// First hits, parallel to `radiance`, if the view asks for auxiliary layers.
    pub aovs: Vec<AovSample>,
    /// Whether the path of each slot has met nothing yet but mirrors and clear glass, so that what guides denoisers is still to be
    /// found; empty if nobody asks for that.
    pub(crate) looking: Vec<bool>,
    /// When the path of each slot leaves the camera; empty if nothing moves.
    pub(crate) times: Vec<f32>,
    /// What `radiance` was before the current step, where indirect light is limited.
    pub(crate) gathered: Vec<Vec3f>,
    /// What paths find in the directions that they sample, where somebody learns from it.
    pub(crate) finds: Finds,
    /// Rays traced since the batch was made.
    pub rays_traced: u64,
}

/// What all paths of a batch share.
pub(crate) struct Context<'a> {
    pub scene: &'a CpuScene,
    pub sampler_kind: u32,
    /// Segments of the paths so far: 1 after the camera ray.
    pub depth: u32,
    /// How many branches a path has from its first vertex on.
    pub branches: u32,
    pub settings: &'a PathSettings,
    pub shading: Shading,
    pub wants_aovs: bool,
    /// Whether of these somebody wants what guides denoisers.
    pub wants_features: bool,
}

impl Context<'_> {
    /// The first dimension pair of this vertex.
    #[inline(always)]
    pub fn pair(&self) -> u32 {
        vertex_pair(self.depth)
    }

    /// Random numbers of a path's vertex.
    #[inline(always)]
    pub fn draw(&self, path: &Path, pair: u32) -> Vec2f {
        let sampler = PixelSampler { kind: self.sampler_kind, scramble: path.scramble, index: path.index };
        sample_2d(sampler, self.pair() + pair)
    }

    /// Whether paths end where they arrive, and nobody looks at that place for anything but its light: layers show first surfaces, and
    /// the filters of GPUs, which trace the same rays, want to know how far away from them second ones are.
    #[inline(always)]
    pub fn are_last_segments(&self) -> bool {
        is_last_segment(self.depth, self.settings.max_depth)
    }

    /// How paths end by chance.
    #[inline(always)]
    pub fn roulette(&self) -> Roulette {
        roulette(self.settings)
    }

    /// How light counts that is found in two ways.
    #[inline(always)]
    pub fn mis(&self) -> MisHeuristic {
        self.settings.mis.heuristic()
    }

    /// Whether Russian roulette may end paths at this vertex.
    #[inline(always)]
    pub fn meets_roulette(&self) -> bool {
        self.depth + 1 >= self.settings.roulette_start
    }
}

impl PathBatch {
    /// When the path of a slot leaves the camera.
    #[inline(always)]
    pub(crate) fn time_of(&self, slot: u32) -> f32 {
        time_of(&self.times, slot)
    }

    /// Queues a shadow ray, unless it brings nothing.
    #[inline(always)]
    pub(crate) fn ask(&mut self, connection: Connection, ray: Ray) {
        let Vec3f { x, y, z } = connection.contribution;
        // Not `> 0`: NaN must reach the film, where it is counted.
        if x + y + z != 0.0 {
            self.shadows.push(&ray, &connection);
        }
    }
}

/// How the settings end paths by chance, as the optics know it.
#[inline(always)]
pub(crate) fn roulette(settings: &PathSettings) -> Roulette {
    Roulette { start: settings.roulette_start, min_survival: settings.roulette_min_survival }
}
