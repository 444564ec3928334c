//! Vertices that wait until there are enough of them to fill the lanes.
//!
//! Most vertices of most pictures are on surfaces that scatter in one of a few ways and have one colour. They are collected by the
//! way in which they scatter; as soon as there are sixteen, [`crate::shade::scatter_lanes`] does for all of them what paths do at
//! vertices.

use crate::batch::departures::{ConnectionLanes, LightLanes, NextLanes};
use crate::batch::lanes::{LANES, Lanes, Pairs, Vectors, draw};
use crate::batch::streams::{Path, PathStream};
use crate::fetch::triangles::TriangleLanes;
use crate::simd::Instructions;
use bytemuck::Pod;
use optics::Vec3f;
use optics::offset::offset_ray_origin;

/// Lanes in use, and as many into which whole vectors may reach.
const ROOM: usize = 2 * LANES;

/// A number of each waiting vertex.
type Row<T> = Lanes<T, ROOM>;

/// What waiting vertices need to go on.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Vertices {
    /// See [`PlainPoint::position`].
    pub position: Vectors<ROOM>,
    /// See [`PlainPoint::clearance`].
    pub clearance: Row<f32>,
    /// See [`PlainPoint::normal`].
    pub normal: Vectors<ROOM>,
    /// Unit shading normal on that side.
    pub shading_normal: Vectors<ROOM>,
    /// Albedo or tint.
    pub color: Vectors<ROOM>,
    /// Unit direction back along the path.
    pub wo: Vectors<ROOM>,
    /// See [`PlainPoint::eta`].
    pub eta: Row<f32>,
    /// See [`PlainPoint::binding`].
    pub binding: Row<u32>,
    /// Throughput of the path up to here.
    pub throughput: Vectors<ROOM>,
    /// See [`optics::random::PixelSampler`].
    pub scramble: Row<u32>,
    /// See [`optics::random::PixelSampler`].
    pub index: Row<u32>,
    /// See [`optics::path::PathState::eta_scale`].
    pub eta_scale: Row<f32>,
    /// See [`Path::slot`].
    pub slot: Row<u32>,
    /// See [`Path::length`].
    pub length: Row<f32>,
    /// See [`Path::sampling_normal`].
    pub sampling_normal: Row<u32>,
}

/// A point on a plain surface.
pub(crate) struct PlainPoint {
    /// Where light is gathered: [`crate::fetch::surface::Surface::origin`].
    pub position: Vec3f,
    /// How far off the primitive rays must start: see `optics::offset`.
    pub clearance: f32,
    /// What can reach the surface is above the plane of this unit normal: [`crate::fetch::surface::Surface::horizon`].
    pub normal: Vec3f,
    /// Unit shading normal on that side.
    pub shading_normal: Vec3f,
    /// Albedo or tint.
    pub color: Vec3f,
    /// Unit direction back along the path.
    pub wo: Vec3f,
    /// Index of refraction of the far side over that of the side of `wo`.
    pub eta: f32,
    /// Whose hit record has the other parameters of the material.
    pub binding: u32,
}

/// What a path carries past its vertices unchanged, for sixteen lanes.
#[derive(Clone, Copy)]
pub(crate) struct PathLanes<'a> {
    pub scramble: &'a [u32; LANES],
    pub index: &'a [u32; LANES],
    pub slot: &'a [u32; LANES],
    pub length: &'a [f32; LANES],
    pub sampling_normal: &'a [u32; LANES],
}

/// Vertices on one kind of surface.
#[derive(Default)]
pub(crate) struct VertexQueue {
    pub vertices: Vertices,
    /// How many are waiting.
    len: usize,
    /// The numbers drawn last, and those that choose between lobes or play roulette.
    pub u: Pairs,
    pub u_lobe: Pairs,
    /// Where rays start that leave on the side of the viewer.
    pub above: Vectors,
    pub lights: LightLanes,
    pub connections: ConnectionLanes,
    pub next: NextLanes,
}

impl VertexQueue {
    /// Whether the lanes are full.
    #[inline(always)]
    pub fn is_full(&self) -> bool {
        self.len >= LANES
    }

    /// How many of the lanes have a vertex.
    #[inline(always)]
    pub fn waiting(&self) -> usize {
        self.len.min(LANES)
    }

    /// Puts a vertex into the next lane.
    #[inline(always)]
    pub fn push(&mut self, point: &PlainPoint, path: &Path) {
        debug_assert!(!self.is_full());
        let (v, lane) = (&mut self.vertices, self.len);
        v.position.set(lane, point.position);
        v.clearance.0[lane] = point.clearance;
        v.normal.set(lane, point.normal);
        v.shading_normal.set(lane, point.shading_normal);
        v.color.set(lane, point.color);
        v.wo.set(lane, point.wo);
        v.eta.0[lane] = point.eta;
        v.binding.0[lane] = point.binding;
        v.throughput.set(lane, path.throughput);
        v.scramble.0[lane] = path.scramble;
        v.index.0[lane] = path.index;
        v.eta_scale.0[lane] = path.eta_scale;
        v.slot.0[lane] = path.slot;
        v.length.0[lane] = path.length;
        v.sampling_normal.0[lane] = path.sampling_normal;
        self.len += 1;
    }

    /// Puts the vertices that paths from `first` on have at surfaces of triangles, and whose bits are set in `mask`, into the next lanes.
    #[inline(always)]
    pub fn append<I: Instructions>(
        &mut self,
        i: I,
        mask: u32,
        surfaces: &TriangleLanes,
        paths: &PathStream,
        first: usize,
    ) {
        debug_assert!(!self.is_full());
        let (v, at) = (&mut self.vertices, self.len);
        append_vectors(i, at, mask, &surfaces.origin, &mut v.position);
        append(i, at, mask, &surfaces.clearance.0, &mut v.clearance);
        append_vectors(i, at, mask, &surfaces.horizon, &mut v.normal);
        append_vectors(i, at, mask, &surfaces.shading_normal, &mut v.shading_normal);
        append_vectors(i, at, mask, &surfaces.color, &mut v.color);
        append_vectors(i, at, mask, &surfaces.wo, &mut v.wo);
        append(i, at, mask, &surfaces.eta.0, &mut v.eta);
        append(i, at, mask, &surfaces.binding.0, &mut v.binding);
        append(i, at, mask, paths.throughput.x.lanes(first), &mut v.throughput.x);
        append(i, at, mask, paths.throughput.y.lanes(first), &mut v.throughput.y);
        append(i, at, mask, paths.throughput.z.lanes(first), &mut v.throughput.z);
        append(i, at, mask, paths.scramble.lanes(first), &mut v.scramble);
        append(i, at, mask, paths.index.lanes(first), &mut v.index);
        append(i, at, mask, paths.eta_scale.lanes(first), &mut v.eta_scale);
        append(i, at, mask, paths.slot.lanes(first), &mut v.slot);
        append(i, at, mask, &surfaces.length.0, &mut v.length);
        append(i, at, mask, paths.sampling_normal.lanes(first), &mut v.sampling_normal);
        self.len += mask.count_ones() as usize;
    }

    /// Forgets those that were in the lanes. The others take their places.
    #[inline(always)]
    pub fn advance(&mut self) {
        self.len -= self.waiting();
        if self.len == 0 {
            return;
        }
        let v = &mut self.vertices;
        let vectors = [
            &mut v.position,
            &mut v.normal,
            &mut v.shading_normal,
            &mut v.color,
            &mut v.wo,
            &mut v.throughput,
        ];
        for vectors in vectors {
            [&mut vectors.x, &mut vectors.y, &mut vectors.z].into_iter().for_each(advance);
        }
        [&mut v.clearance, &mut v.eta, &mut v.eta_scale, &mut v.length].into_iter().for_each(advance);
        let rest = [&mut v.binding, &mut v.scramble, &mut v.index, &mut v.slot, &mut v.sampling_normal];
        rest.into_iter().for_each(advance);
    }

    /// Finds out where rays start that leave on the side of the viewer.
    #[inline(always)]
    pub fn find_above(&mut self) {
        let v = &self.vertices;
        for lane in 0..LANES {
            let (position, normal) = (v.position.get(lane), v.normal.get(lane));
            self.above.set(lane, offset_ray_origin(position, normal, v.clearance.0[lane]));
        }
    }

    /// Random numbers of one dimension pair for all lanes.
    #[inline(always)]
    pub fn draw(&mut self, sampler_kind: u32, pair: u32) {
        let v = &self.vertices;
        draw(sampler_kind, &v.scramble, &v.index, pair, &mut self.u);
    }

    /// The same that choose between lobes or play roulette.
    #[inline(always)]
    pub fn draw_lobes(&mut self, sampler_kind: u32, pair: u32) {
        let v = &self.vertices;
        draw(sampler_kind, &v.scramble, &v.index, pair, &mut self.u_lobe);
    }

    /// What paths carry past the vertices in the lanes.
    #[inline(always)]
    pub fn paths(&self) -> PathLanes<'_> {
        let v = &self.vertices;
        PathLanes {
            scramble: in_use(&v.scramble),
            index: in_use(&v.index),
            slot: in_use(&v.slot),
            length: in_use(&v.length),
            sampling_normal: in_use(&v.sampling_normal),
        }
    }
}

#[inline(always)]
fn in_use<T>(row: &Row<T>) -> &[T; LANES] {
    row.0.first_chunk().expect("a row is longer")
}

#[inline(always)]
fn append<T: Pod>(i: impl Instructions, at: usize, mask: u32, from: &[T; LANES], to: &mut Row<T>) {
    let to = to.0[at..].first_chunk_mut().expect("whole lanes fit behind fewer");
    i.compress(mask, bytemuck::cast_ref(from), bytemuck::cast_mut::<[T; LANES], [u32; LANES]>(to));
}

#[inline(always)]
fn append_vectors(i: impl Instructions, at: usize, mask: u32, from: &Vectors, to: &mut Vectors<ROOM>) {
    append(i, at, mask, &from.x.0, &mut to.x);
    append(i, at, mask, &from.y.0, &mut to.y);
    append(i, at, mask, &from.z.0, &mut to.z);
}

#[inline(always)]
fn advance<T: Copy>(row: &mut Row<T>) {
    row.0.copy_within(LANES.., 0);
}
