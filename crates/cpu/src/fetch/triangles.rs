//! Hit points of many triangles at once.
//!
//! Position and normals of sixteen hits are computed by one loop over lanes, which the compiler turns into vector
//! instructions. Spheres, and triangles with normal maps or in mirrored instances, take the general way of [`Surface::new`].

use crate::batch::lanes::{LANES, Lanes, Vectors, first_lanes};
use crate::batch::samples::time_of;
use crate::batch::streams::{HitLanes, HitStream, PathStream};
use crate::fetch::hit_records::{HitRecord, ShadingClass, form};
use crate::fetch::surface::{GraphPlace, Surface, tex_coords, transformed_extent, vertex_color};
use crate::scene::{CpuScene, transform_normal, transform_point};
use crate::simd::{Instructions, prefetch};
use optics::frame::{Frame, bend_normal};
use optics::offset::triangle_clearance;
use optics::terminator::terminator_lift;
use optics::vector::{cross, dot};
use optics::{Vec3f, vec3f, vec4f};
use scene::tables::{InstanceRecord, NONE};

/// Sixteen hits in a row.
#[derive(Default)]
pub(crate) struct TriangleLanes {
    /// What each path has come to, see [`ShadingClass`].
    shading_class: Lanes<u32>,
    /// Which lanes have come to a triangle that is computed here, as bits.
    here: u32,
    /// The following are those of [`HitRecord`].
    first_vertex: Lanes<u32>,
    first_normal: Lanes<u32>,
    form: Lanes<u32>,
    ior: Lanes<f32>,
    inverse_ior: Lanes<f32>,
    pub color: Vectors,
    /// Places of the triangles in the table of indices.
    triangle: Lanes<u32>,
    /// Vertices of each triangle, as the tables number them within its geometry.
    indices: [Lanes<u32>; 3],
    /// Places of positions and normals in the tables.
    position_places: [Lanes<u32>; 3],
    normal_places: [Lanes<u32>; 3],
    corners: [Vectors; 3],
    normals: [Vectors; 3],
    /// See [`transformed_extent`]; 0 where the instance has no transform.
    transformed: Lanes<f32>,
    u: Lanes<f32>,
    v: Lanes<f32>,
    front: Lanes<u32>,
    instance: Lanes<u32>,
    /// Number of the triangle in its geometry, and in its object.
    primitive: Lanes<u32>,
    id: Lanes<u32>,
    /// See [`crate::fetch::hit_records::HitRecordTable::binding`].
    pub binding: Lanes<u32>,
    /// The following are those of [`crate::batch::vertices::PlainPoint`].
    pub wo: Vectors,
    pub position: Vectors,
    pub clearance: Lanes<f32>,
    pub normal: Vectors,
    pub shading_normal: Vectors,
    /// See [`Surface::origin`] and [`Surface::horizon`].
    pub origin: Vectors,
    pub horizon: Vectors,
    pub eta: Lanes<f32>,
    /// Length of the path up to here.
    pub length: Lanes<f32>,
}

/// Rows that are under way.
const ROWS: usize = 3;

/// The hits of a batch, a row of sixteen after the other. From a hit to its vertices memory is waited for twice, so rows are
/// under way at three stages: their triangles are asked for, their vertices are, and their surfaces are computed.
#[derive(Default)]
pub(crate) struct TriangleRows([TriangleLanes; ROWS]);

impl TriangleRows {
    /// Starts with new hits.
    #[inline(always)]
    pub fn begin<I: Instructions>(&mut self, i: I, scene: &CpuScene, hits: &HitStream, count: usize) {
        self.ask(i, scene, hits, 0, count);
        self.ask(i, scene, hits, LANES, count);
        self.locate(i, scene, 0, count);
    }

    /// Computes the surfaces that the row of paths from `first` on has come to, of `count` in all.
    /// `times`: by slot, if anything moves.
    #[inline(always)]
    pub fn compute<I: Instructions>(
        &mut self,
        i: I,
        scene: &CpuScene,
        paths: &PathStream,
        hits: &HitStream,
        times: &[f32],
        first: usize,
        count: usize,
    ) {
        self.ask(i, scene, hits, first + 2 * LANES, count);
        self.locate(i, scene, first + LANES, count);
        self.0[first / LANES % ROWS].compute(i, scene, paths, hits, times, first);
    }

    /// The row from `first` on.
    #[inline(always)]
    pub fn row(&self, first: usize) -> &TriangleLanes {
        &self.0[first / LANES % ROWS]
    }

    /// Finds out in which geometries hits are, and asks for their triangles.
    #[inline(always)]
    fn ask<I: Instructions>(&mut self, i: I, scene: &CpuScene, hits: &HitStream, first: usize, count: usize) {
        if first < count {
            let row = &mut self.0[first / LANES % ROWS];
            row.ask(i, scene, &hits.lanes(first), first_lanes(count - first));
        }
    }

    /// Finds the triangles, and asks for their vertices.
    #[inline(always)]
    fn locate<I: Instructions>(&mut self, i: I, scene: &CpuScene, first: usize, count: usize) {
        if first < count {
            self.0[first / LANES % ROWS].locate(i, scene);
        }
    }
}

/// The lanes whose bits are set.
#[inline(always)]
fn lanes(mut mask: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        if mask == 0 {
            return None;
        }
        let lane = mask.trailing_zeros() as usize % LANES;
        mask &= mask - 1;
        Some(lane)
    })
}

impl TriangleLanes {
    /// Computes the surfaces that have been located for the paths from `first` on.
    #[inline(always)]
    fn compute<I: Instructions>(
        &mut self,
        i: I,
        scene: &CpuScene,
        paths: &PathStream,
        hits: &HitStream,
        times: &[f32],
        first: usize,
    ) {
        let slots = paths.slot.lanes(first);
        let (hits, directions, lengths) =
            (hits.lanes(first), paths.direction.lanes(first), paths.length.lanes(first));
        (self.u.0, self.v.0, self.id.0) = (*hits.u, *hits.v, *hits.primitive);
        for (lane, length) in self.length.0.iter_mut().enumerate() {
            self.wo.set(lane, -directions.get(lane));
            *length = lengths[lane] + hits.t[lane];
        }
        let smooth = self.having(i, form::SMOOTH);
        self.fetch_vertices(i, scene, smooth, |lane| time_of(times, slots[lane]));
        for lane in 0..LANES {
            self.compute_lane(lane);
        }
        // On its own, because a choice between two numbers in memory keeps the compiler from taking all lanes together.
        for lane in 0..LANES {
            let front = self.front.0[lane] != 0;
            self.eta.0[lane] = if front { self.ior.0[lane] } else { self.inverse_ior.0[lane] };
        }
        if smooth != 0 {
            for lane in 0..LANES {
                self.bend_lane(lane);
            }
            if self.having(i, form::SMOOTH | form::LIFTED) != 0 {
                for lane in 0..LANES {
                    self.lift_lane(lane);
                }
            }
        }
    }

    /// Which lanes have come to this, as bits.
    #[inline(always)]
    pub fn which(&self, i: impl Instructions, shading_class: ShadingClass) -> u32 {
        i.equal(&self.shading_class.0, shading_class as u32)
    }

    /// Which of the lanes that are computed here have triangles with all these bits of [`form`], as bits.
    #[inline(always)]
    fn having(&self, i: impl Instructions, bits: u32) -> u32 {
        let mut these = Lanes::<u32>::default();
        for lane in 0..LANES {
            these.0[lane] = self.form.0[lane] & bits;
        }
        self.here & i.equal(&these.0, bits)
    }

    /// Finds out in which geometries the hits in `mask` are, and asks for their triangles.
    #[inline(always)]
    fn ask<I: Instructions>(&mut self, i: I, scene: &CpuScene, hits: &HitLanes, mask: u32) {
        let sky = i.equal(hits.primitive, NONE);
        let hit = mask & !sky;
        scene.hit_records.bindings(hits.instance, hits.primitive, hit, &mut self.binding);
        let (mut shading_class, mut first_in_blas, mut first_primitive) =
            (Lanes::<u32>::default(), Lanes::<u32>::default(), Lanes::<u32>::default());
        let mut others = [[0u32; LANES]; 5];
        let [geometry, material, metallic, roughness, specular] = &mut others;
        let Vectors { x, y, z } = &mut self.color;
        // In the order of the fields of `HitRecord`.
        let fields = [
            &mut first_in_blas.0,
            &mut first_primitive.0,
            &mut self.first_vertex.0,
            &mut self.first_normal.0,
            geometry,
            material,
            &mut shading_class.0,
            &mut self.form.0,
            bytemuck::cast_mut(&mut x.0),
            bytemuck::cast_mut(&mut y.0),
            bytemuck::cast_mut(&mut z.0),
            bytemuck::cast_mut(&mut self.ior.0),
            bytemuck::cast_mut(&mut self.inverse_ior.0),
            metallic,
            roughness,
            specular,
        ];
        scene.hit_records.fetch(i, &self.binding.0, hit, fields);
        self.here = hit & !i.equal(&shading_class.0, ShadingClass::General as u32);
        self.instance.0 = *hits.instance;
        for lane in 0..LANES {
            let elsewhere = if mask & 1 << lane != 0 { ShadingClass::Sky } else { ShadingClass::Nothing };
            self.shading_class.0[lane] =
                if hit & 1 << lane != 0 { shading_class.0[lane] } else { elsewhere as u32 };
            self.primitive.0[lane] = hits.primitive[lane].wrapping_sub(first_in_blas.0[lane]);
            self.triangle.0[lane] = first_primitive.0[lane].wrapping_add(self.primitive.0[lane]);
        }
        for lane in lanes(self.having(i, form::MANY)) {
            prefetch(&scene.tables.indices, self.triangle.0[lane] as usize);
        }
    }

    /// Finds the triangles, and asks for their vertices.
    #[inline(always)]
    fn locate<I: Instructions>(&mut self, i: I, scene: &CpuScene) {
        let [a, b, c] = &mut self.indices;
        let indices = [a, b, c].map(|lanes| bytemuck::cast_mut::<[u32; LANES], [f32; LANES]>(&mut lanes.0));
        i.fetch(bytemuck::cast_slice(&scene.tables.indices), &self.triangle.0, self.here, indices);
        for (k, indices) in self.indices.iter().enumerate() {
            for lane in 0..LANES {
                self.position_places[k].0[lane] = self.first_vertex.0[lane].wrapping_add(indices.0[lane]);
                self.normal_places[k].0[lane] = self.first_normal.0[lane].wrapping_add(indices.0[lane]);
            }
        }
        for lane in lanes(self.having(i, form::MANY)) {
            for places in &self.position_places {
                prefetch(&scene.tables.positions, places.0[lane] as usize);
            }
        }
        for lane in lanes(self.having(i, form::MANY | form::SMOOTH)) {
            for places in &self.normal_places {
                prefetch(&scene.tables.normals, places.0[lane] as usize);
            }
        }
    }

    #[inline(always)]
    fn fetch_vertices<I: Instructions>(
        &mut self,
        i: I,
        scene: &CpuScene,
        smooth: u32,
        time: impl Fn(usize) -> f32,
    ) {
        let tables = &*scene.tables;
        for (places, Vectors { x, y, z }) in self.position_places.iter().zip(&mut self.corners) {
            i.fetch(&tables.positions, &places.0, self.here, [&mut x.0, &mut y.0, &mut z.0]);
        }
        if smooth != 0 {
            for (places, Vectors { x, y, z }) in self.normal_places.iter().zip(&mut self.normals) {
                i.fetch(&tables.normals, &places.0, smooth, [&mut x.0, &mut y.0, &mut z.0]);
            }
        }
        self.transformed = Lanes::default();
        for lane in lanes(self.having(i, form::MOVED)) {
            match scene.tables.moved_instance(self.instance.0[lane], time(lane)) {
                Some(moved) => self.place(&moved, lane),
                None => self.place(&scene.tables.instances[self.instance.0[lane] as usize], lane),
            }
        }
    }

    /// Takes the vertices of a lane to world space.
    #[inline(always)]
    fn place(&mut self, instance: &InstanceRecord, lane: usize) {
        for k in 0..3 {
            let corner = transform_point(&instance.object_to_world, self.corners[k].get(lane));
            let normal = transform_normal(&instance.world_to_object, self.normals[k].get(lane));
            self.corners[k].set(lane, corner);
            self.normals[k].set(lane, normal);
        }
        let corners = of_lane(&self.corners, lane);
        self.transformed.0[lane] = transformed_extent(&instance.object_to_world, corners);
    }

    /// The point on a flat triangle.
    #[inline(always)]
    fn compute_lane(&mut self, lane: usize) {
        let [p0, p1, p2] = of_lane(&self.corners, lane);
        let (u, v) = (self.u.0[lane], self.v.0[lane]);
        let outward = unit(cross(p1 - p0, p2 - p0));
        let front = dot(outward, self.wo.get(lane)) >= 0.0;
        let normal = outward * if front { 1.0 } else { -1.0 };
        let position = p0 * (1.0 - u - v) + p1 * u + p2 * v;
        self.position.set(lane, position);
        self.origin.set(lane, position);
        self.horizon.set(lane, normal);
        self.clearance.0[lane] = triangle_clearance(p0, p1, p2, outward, self.transformed.0[lane]);
        self.normal.set(lane, normal);
        self.shading_normal.set(lane, normal);
        self.front.0[lane] = u32::from(front);
    }

    /// The shading normal, if the triangle has vertex normals.
    #[inline(always)]
    fn bend_lane(&mut self, lane: usize) {
        let [n0, n1, n2] = of_lane(&self.normals, lane);
        let (u, v) = (self.u.0[lane], self.v.0[lane]);
        let interpolated = n0 * (1.0 - u - v) + n1 * u + n2 * v;
        let smooth = self.form.0[lane] & form::SMOOTH != 0 && dot(interpolated, interpolated) > 1e-20;
        let side = if self.front.0[lane] != 0 { 1.0 } else { -1.0 };
        let normal = self.normal.get(lane);
        let bent = bend_normal(self.wo.get(lane), normal, unit(interpolated) * side);
        let choose = |smooth_component: f32, flat: f32| if smooth { smooth_component } else { flat };
        let shading = vec3f(choose(bent.x, normal.x), choose(bent.y, normal.y), choose(bent.z, normal.z));
        self.shading_normal.set(lane, shading);
    }

    /// Where light is gathered, if the triangle has vertex normals and is lifted.
    #[inline(always)]
    fn lift_lane(&mut self, lane: usize) {
        const LIFTED: u32 = form::SMOOTH | form::LIFTED;
        let [p0, p1, p2] = of_lane(&self.corners, lane);
        let [n0, n1, n2] = of_lane(&self.normals, lane);
        let (u, v) = (self.u.0[lane], self.v.0[lane]);
        let (position, normal) = (self.position.get(lane), self.normal.get(lane));
        let weights = vec3f(1.0 - u - v, u, v);
        let side = if self.front.0[lane] != 0 { 1.0 } else { -1.0 };
        let lift = terminator_lift(position, p0, p1, p2, n0, n1, n2, side, normal, weights);
        let smooth = unit(n0 * weights.x + n1 * weights.y + n2 * weights.z) * side;
        let lifted = self.form.0[lane] & LIFTED == LIFTED && lift.share > 0.0;
        let choose = |smooth: f32, flat: f32| if lifted { smooth } else { flat };
        let (x, h) = (position + lift.offset, smooth);
        let origin = vec3f(choose(x.x, position.x), choose(x.y, position.y), choose(x.z, position.z));
        let horizon = vec3f(choose(h.x, normal.x), choose(h.y, normal.y), choose(h.z, normal.z));
        self.origin.set(lane, origin);
        self.horizon.set(lane, horizon);
    }

    /// The hit record of one lane, if the lane is done here.
    #[inline(always)]
    pub fn hit_record<'s>(&self, scene: &'s CpuScene, lane: usize) -> Option<&'s HitRecord> {
        (self.shading_class.0[lane] >= ShadingClass::Surface as u32)
            .then(|| scene.hit_records.hit_record(self.binding.0[lane]))
    }

    /// The surface of one lane; `None` where it takes the general way.
    ///
    /// `wants_coordinates`: whether texture coordinates are asked for even if the material does not need them.
    #[inline(always)]
    pub fn surface(&self, scene: &CpuScene, lane: usize, wants_coordinates: bool) -> Option<Surface> {
        let hit_record = self.hit_record(scene, lane)?;
        let tables = &*scene.tables;
        let geometry = &tables.geometries[hit_record.geometry as usize];
        let binding = &tables.bindings[self.binding.0[lane] as usize];
        let primitive = self.primitive.0[lane];
        let position = self.position.get(lane);
        let (mut coords, mut color) = (vec4f(0.0, 0.0, 0.0, 0.0), vec4f(1.0, 1.0, 1.0, 1.0));
        let material = &tables.materials[hit_record.material as usize];
        if wants_coordinates || material.is_textured() || geometry.first_color != NONE {
            let corners = [0, 1, 2].map(|k: usize| self.indices[k].0[lane]);
            let (u, v) = (self.u.0[lane], self.v.0[lane]);
            let weights = [1.0 - u - v, u, v];
            coords = tex_coords(tables, geometry, corners, weights);
            color = vertex_color(tables, geometry, corners, weights);
        }
        let shading_normal = self.shading_normal.get(lane);
        Some(Surface {
            position,
            clearance: self.clearance.0[lane],
            normal: self.normal.get(lane),
            shading_normal,
            origin: self.origin.get(lane),
            horizon: self.horizon.get(lane),
            front: self.front.0[lane] != 0,
            wo: self.wo.get(lane),
            coords,
            color,
            material: hit_record.material,
            light: tables.light_of(binding, primitive),
            object: binding.object,
            primitive,
            object_position: position,
            graph: GraphPlace::NONE,
            layer_frame: Frame { tangent: shading_normal, bitangent: shading_normal, normal: shading_normal },
        })
    }
}

/// The three vectors of a lane. Not by `map`: compiled by itself, its closure lacks the lanes' instructions.
#[inline(always)]
fn of_lane(vectors: &[Vectors; 3], lane: usize) -> [Vec3f; 3] {
    let [a, b, c] = vectors;
    [a.get(lane), b.get(lane), c.get(lane)]
}

/// A vector of length 1 in the direction of `v`; not a number for zero, which the caller has excluded or ignores.
#[inline(always)]
fn unit(v: Vec3f) -> Vec3f {
    v * (1.0 / dot(v, v).sqrt())
}
