//! Paths between vertices, and where those on plain surfaces wait for each other.

use crate::lane_lights::{ChoiceLanes, LightLanes};
use crate::lanes::{LANES, NextLanes, Pairs, PlainPoint, Vertices, draw};
use accel::Ray;
use optics::light_tree::ALL_SIDES;
use optics::path::{PathState, path_start};
use optics::{Vec3f, vec3f};

/// A path between two vertices: its state without what is elsewhere. The ray stands beside it in another array, the
/// depth is the same for all paths of a batch, and light found goes to the sample at once. Paths are copied at every
/// vertex, so their size counts.
#[derive(Clone, Copy)]
pub(crate) struct Path {
    pub throughput: Vec3f,
    /// See [`PathState::pdf`]; negative where the state is specular.
    pub pdf: f32,
    pub eta_scale: f32,
    /// See [`PixelSampler`].
    pub scramble: u32,
    pub index: u32,
    /// Which sample of the batch it belongs to.
    pub slot: u32,
    /// Length of the path so far, for footprints.
    pub length: f32,
    /// What the light samples of the last vertex knew of its surface; see `sample_light`.
    pub receiver: u32,
}

impl Path {
    /// A path that has just left the camera.
    #[inline(always)]
    pub fn start(slot: u32, scramble: u32, index: u32) -> Self {
        let path = Path {
            throughput: vec3f(1.0, 1.0, 1.0),
            pdf: 0.0,
            eta_scale: 1.0,
            scramble,
            index,
            slot,
            length: 0.0,
            receiver: ALL_SIDES,
        };
        path.with_state(&path_start())
    }

    /// The state as the optics know it, without the light found so far.
    #[inline(always)]
    pub fn state(&self, depth: u32) -> PathState {
        PathState {
            throughput: self.throughput,
            radiance: vec3f(0.0, 0.0, 0.0),
            pdf: self.pdf,
            specular: self.pdf < 0.0,
            eta_scale: self.eta_scale,
            depth,
        }
    }

    /// The path in another state.
    #[inline(always)]
    pub fn with_state(self, state: &PathState) -> Self {
        let pdf = if state.specular { -1.0 } else { state.pdf };
        Path { throughput: state.throughput, pdf, eta_scale: state.eta_scale, ..self }
    }
}

/// Vertices on one kind of plain surface that wait until there are enough of them to fill the lanes.
#[derive(Default)]
pub(crate) struct PlainQueue {
    pub vertices: Vertices,
    /// How many are waiting.
    pub len: usize,
    /// The numbers drawn last.
    pub u: Pairs,
    pub choices: ChoiceLanes,
    pub lights: LightLanes,
    pub next: NextLanes,
}

impl PlainQueue {
    /// Puts a vertex into the next lane; true if that was the last.
    #[inline(always)]
    pub fn push(&mut self, point: &PlainPoint, path: &Path) -> bool {
        self.vertices.set_point(self.len, point);
        self.vertices.set_path(self.len, path);
        self.len += 1;
        self.len == LANES
    }

    /// Random numbers of one dimension pair for all lanes.
    #[inline(always)]
    pub fn draw(&mut self, sampler_kind: u32, pair: u32) {
        let v = &self.vertices;
        draw(sampler_kind, &v.scramble, &v.index, pair, &mut self.u);
    }

    /// The ray and the path that leave the vertex of a lane.
    #[inline(always)]
    pub fn leave(&self, lane: usize) -> (Ray, Path) {
        let (v, next) = (&self.vertices, &self.next);
        let path = Path {
            throughput: next.throughput.get(lane),
            pdf: next.pdf.0[lane],
            eta_scale: next.eta_scale.0[lane],
            scramble: v.scramble.0[lane],
            index: v.index.0[lane],
            slot: v.slot.0[lane],
            length: v.length.0[lane],
            receiver: v.receiver.0[lane],
        };
        (Ray::new(next.origin.get(lane).to_array(), next.wi.get(lane).to_array()), path)
    }
}
