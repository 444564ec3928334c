//! What goes from one stage of a batch to the next: paths under way, what they hit, and shadow rays.

use crate::batch::columns::{Column, VectorColumn};
use crate::batch::departures::{ConnectionLanes, NextLanes};
use crate::batch::lanes::{CameraLanes, LANES, Vectors};
use crate::batch::vertices::PathLanes;
use crate::simd::Instructions;
use accel::{Hit, HitColumns, Ray, RayColumns, RayTimes};
use optics::light_tree::ALL_SIDES;
use optics::path::{PathState, path_start};
use optics::vertex::SHADOW_END;
use optics::{Vec3f, vec3f};

/// A path between two vertices: its state without what is elsewhere. The ray stands beside it, the
/// depth is the same for all paths of a batch, and light found goes to the sample at once.
#[derive(Clone, Copy)]
pub(crate) struct Path {
    pub throughput: Vec3f,
    /// See [`PathState::pdf`]; negative where the state is specular.
    pub pdf: f32,
    pub eta_scale: f32,
    /// See [`optics::random::PixelSampler`].
    pub scramble: u32,
    pub index: u32,
    /// Where its light is summed, see [`PathBatch`](crate::shade::path_batch::PathBatch).
    pub slot: u32,
    /// Length of the path so far, for footprints.
    pub length: f32,
    /// What the light samples of the last vertex knew of its surface; see `sample_light`.
    pub sampling_normal: u32,
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
            sampling_normal: ALL_SIDES,
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

/// What a shadow ray brings if nothing is in its way.
#[derive(Clone, Copy)]
pub(crate) struct Connection {
    /// See [`Path::slot`].
    pub slot: u32,
    pub contribution: Vec3f,
}

/// Paths under way, with their rays. The fields of a path are those of [`Path`].
#[derive(Default)]
pub(crate) struct PathStream {
    len: usize,
    pub origin: VectorColumn,
    pub direction: VectorColumn,
    pub throughput: VectorColumn,
    pub pdf: Column<f32>,
    pub eta_scale: Column<f32>,
    pub scramble: Column<u32>,
    pub index: Column<u32>,
    pub slot: Column<u32>,
    pub length: Column<f32>,
    pub sampling_normal: Column<u32>,
}

impl PathStream {
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Forgets all paths.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.len = 0;
        self.make_room();
    }

    /// Keeps the first paths only.
    pub fn truncate(&mut self, len: usize) {
        self.len = self.len.min(len);
    }

    /// `times`: by slot, when the paths leave the camera; empty if nothing moves.
    #[inline(always)]
    pub fn rays<'a>(&'a self, times: &'a [f32]) -> RayColumns<'a> {
        let times = (!times.is_empty()).then(|| RayTimes { places: self.slot.first(self.len), times });
        RayColumns::new(self.origin.first(self.len), self.direction.first(self.len), None).at(times)
    }

    #[inline(always)]
    pub fn ray(&self, at: usize) -> Ray {
        Ray::new(self.origin.get(at).to_array(), self.direction.get(at).to_array())
    }

    #[inline(always)]
    pub fn path(&self, at: usize) -> Path {
        Path {
            throughput: self.throughput.get(at),
            pdf: self.pdf.get(at),
            eta_scale: self.eta_scale.get(at),
            scramble: self.scramble.get(at),
            index: self.index.get(at),
            slot: self.slot.get(at),
            length: self.length.get(at),
            sampling_normal: self.sampling_normal.get(at),
        }
    }

    /// Adds paths that leave the camera: those of the first `count` lanes. Each has `branches` slots, of which it takes the first.
    #[inline(always)]
    pub fn begin(&mut self, i: impl Instructions, camera: &CameraLanes, count: usize, branches: u32) {
        let (at, mask) = (self.len, (1 << count) - 1);
        let slots = std::array::from_fn(|lane| (at + lane) as u32 * branches);
        let path = Path::start(0, 0, 0);
        let weight = camera.weight;
        self.origin.append(i, at, mask, &camera.origin);
        self.direction.append(i, at, mask, &camera.direction);
        self.throughput.append(i, at, mask, &Vectors { x: weight, y: weight, z: weight });
        self.pdf.append(i, at, mask, &[path.pdf; LANES]);
        self.eta_scale.append(i, at, mask, &[path.eta_scale; LANES]);
        self.scramble.append(i, at, mask, &camera.scramble.0);
        self.index.append(i, at, mask, &camera.index.0);
        self.slot.append(i, at, mask, &slots);
        self.length.append(i, at, mask, &[path.length; LANES]);
        self.sampling_normal.append(i, at, mask, &[path.sampling_normal; LANES]);
        self.len += count;
        self.make_room();
    }

    /// Adds a path.
    #[inline(always)]
    pub fn push(&mut self, origin: Vec3f, direction: Vec3f, path: &Path) {
        self.set(self.len, origin, direction, path);
        self.len += 1;
        self.make_room();
    }

    /// Puts a path in the place of another.
    #[inline(always)]
    pub fn set(&mut self, at: usize, origin: Vec3f, direction: Vec3f, path: &Path) {
        self.origin.set(at, origin);
        self.direction.set(at, direction);
        self.throughput.set(at, path.throughput);
        self.pdf.set(at, path.pdf);
        self.eta_scale.set(at, path.eta_scale);
        self.scramble.set(at, path.scramble);
        self.index.set(at, path.index);
        self.slot.set(at, path.slot);
        self.length.set(at, path.length);
        self.sampling_normal.set(at, path.sampling_normal);
    }

    /// Adds the paths that leave the vertices of the lanes in `mask`.
    #[inline(always)]
    pub fn append(&mut self, i: impl Instructions, mask: u32, next: &NextLanes, from: PathLanes) {
        let at = self.len;
        self.origin.append(i, at, mask, &next.origin);
        self.direction.append(i, at, mask, &next.wi);
        self.throughput.append(i, at, mask, &next.throughput);
        self.pdf.append(i, at, mask, &next.pdf.0);
        self.eta_scale.append(i, at, mask, &next.eta_scale.0);
        self.scramble.append(i, at, mask, from.scramble);
        self.index.append(i, at, mask, from.index);
        self.slot.append(i, at, mask, from.slot);
        self.length.append(i, at, mask, from.length);
        self.sampling_normal.append(i, at, mask, from.sampling_normal);
        self.len += mask.count_ones() as usize;
        self.make_room();
    }

    /// Moves the paths of some lanes from `first` on behind the first `at`, see [`Column::move_lanes`].
    #[inline(always)]
    pub fn move_lanes(&mut self, i: impl Instructions, first: usize, mask: u32, at: usize) {
        self.origin.move_lanes(i, first, mask, at);
        self.direction.move_lanes(i, first, mask, at);
        self.throughput.move_lanes(i, first, mask, at);
        self.pdf.move_lanes(i, first, mask, at);
        self.eta_scale.move_lanes(i, first, mask, at);
        self.scramble.move_lanes(i, first, mask, at);
        self.index.move_lanes(i, first, mask, at);
        self.slot.move_lanes(i, first, mask, at);
        self.length.move_lanes(i, first, mask, at);
        self.sampling_normal.move_lanes(i, first, mask, at);
    }

    #[inline(always)]
    fn make_room(&mut self) {
        let count = self.len;
        self.origin.make_room(count);
        self.direction.make_room(count);
        self.throughput.make_room(count);
        self.pdf.make_room(count);
        self.eta_scale.make_room(count);
        self.scramble.make_room(count);
        self.index.make_room(count);
        self.slot.make_room(count);
        self.length.make_room(count);
        self.sampling_normal.make_room(count);
    }
}

/// What paths hit: the fields of [`Hit`].
#[derive(Default)]
pub(crate) struct HitStream {
    t: Column<f32>,
    u: Column<f32>,
    v: Column<f32>,
    primitive: Column<u32>,
    instance: Column<u32>,
}

/// Sixteen hits in a row.
#[derive(Clone, Copy)]
pub(crate) struct HitLanes<'a> {
    pub t: &'a [f32; LANES],
    pub u: &'a [f32; LANES],
    pub v: &'a [f32; LANES],
    pub primitive: &'a [u32; LANES],
    pub instance: &'a [u32; LANES],
}

impl HitStream {
    /// Room for `count` hits.
    #[inline(always)]
    pub fn columns(&mut self, count: usize) -> HitColumns<'_> {
        self.t.make_room(count);
        self.u.make_room(count);
        self.v.make_room(count);
        self.primitive.make_room(count);
        self.instance.make_room(count);
        HitColumns::new(
            self.t.first_mut(count),
            [self.u.first_mut(count), self.v.first_mut(count)],
            self.primitive.first_mut(count),
            self.instance.first_mut(count),
        )
    }

    #[inline(always)]
    pub fn get(&self, at: usize) -> Hit {
        Hit {
            t: self.t.get(at),
            u: self.u.get(at),
            v: self.v.get(at),
            primitive: self.primitive.get(at),
            instance: self.instance.get(at),
        }
    }

    /// As [`PathStream::move_lanes`].
    #[inline(always)]
    pub fn move_lanes(&mut self, i: impl Instructions, first: usize, mask: u32, at: usize) {
        self.t.move_lanes(i, first, mask, at);
        self.u.move_lanes(i, first, mask, at);
        self.v.move_lanes(i, first, mask, at);
        self.primitive.move_lanes(i, first, mask, at);
        self.instance.move_lanes(i, first, mask, at);
    }

    #[inline(always)]
    pub fn lanes(&self, at: usize) -> HitLanes<'_> {
        HitLanes {
            t: self.t.lanes(at),
            u: self.u.lanes(at),
            v: self.v.lanes(at),
            primitive: self.primitive.lanes(at),
            instance: self.instance.lanes(at),
        }
    }
}

/// Shadow rays, and what each brings to which sample if nothing is in its way.
#[derive(Default)]
pub(crate) struct ShadowStream {
    len: usize,
    origin: VectorColumn,
    direction: VectorColumn,
    t_max: Column<f32>,
    contribution: VectorColumn,
    slot: Column<u32>,
}

impl ShadowStream {
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.len
    }

    /// See [`PathStream::clear`].
    #[inline(always)]
    pub fn clear(&mut self) {
        self.len = 0;
        self.make_room();
    }

    /// `times`: by slot, when the paths leave the camera; empty if nothing moves.
    #[inline(always)]
    pub fn rays<'a>(&'a self, times: &'a [f32]) -> RayColumns<'a> {
        let t_max = self.t_max.first(self.len);
        let times = (!times.is_empty()).then(|| RayTimes { places: self.slot.first(self.len), times });
        RayColumns::new(self.origin.first(self.len), self.direction.first(self.len), Some(t_max)).at(times)
    }

    #[inline(always)]
    pub fn connection(&self, at: usize) -> Connection {
        Connection { slot: self.slot.get(at), contribution: self.contribution.get(at) }
    }

    /// Adds a ray, whose beginning is its origin.
    #[inline(always)]
    pub fn push(&mut self, ray: &Ray, connection: &Connection) {
        let at = self.len;
        let [origin, direction] = [ray.origin, ray.direction].map(|[x, y, z]| vec3f(x, y, z));
        self.origin.set(at, origin);
        self.direction.set(at, direction);
        self.t_max.set(at, ray.t_max);
        self.contribution.set(at, connection.contribution);
        self.slot.set(at, connection.slot);
        self.len += 1;
        self.make_room();
    }

    /// Adds the light samples of the lanes in `mask`.
    #[inline(always)]
    pub fn append(&mut self, i: impl Instructions, mask: u32, lights: &ConnectionLanes, from: PathLanes) {
        let at = self.len;
        self.origin.append(i, at, mask, &lights.origin);
        self.direction.append(i, at, mask, &lights.direction);
        self.t_max.append(i, at, mask, &lights.distance.0.map(|distance| distance * SHADOW_END));
        self.contribution.append(i, at, mask, &lights.contribution);
        self.slot.append(i, at, mask, from.slot);
        self.len += mask.count_ones() as usize;
        self.make_room();
    }

    #[inline(always)]
    fn make_room(&mut self) {
        let count = self.len;
        self.origin.make_room(count);
        self.direction.make_room(count);
        self.t_max.make_room(count);
        self.contribution.make_room(count);
        self.slot.make_room(count);
    }
}
