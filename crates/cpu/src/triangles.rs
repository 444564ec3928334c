//! Hit points of many triangles at once.
//!
//! Position and normals of sixteen hits are computed by one loop over lanes, which the compiler turns into vector
//! instructions. Spheres, and triangles with normal maps or in mirrored instances, take the general way of [`Surface::new`].

use crate::columns::Column;
use crate::lanes::{ALL_LANES, LANES, Lanes, Vectors};
use crate::scene::{CpuScene, transform_normal, transform_point, vec3};
use crate::simd::{Instructions, prefetch};
use crate::sites::{Arrival, Site};
use crate::streams::{HitLanes, HitStream, PathStream};
use crate::surface::{Surface, TexCoords, largest_coordinate, tex_coords, vertex_color};
use optics::frame::{Frame, bend_normal};
use optics::vector::{cross, dot};
use optics::{Vec3f, vec3f};
use scene::tables::NONE;

/// Sixteen hits in a row.
#[derive(Default)]
pub(crate) struct TriangleLanes {
    /// What each path has come to, see [`Arrival`].
    arrival: Lanes<u32>,
    /// Vertices of each triangle, as the tables number them within its geometry.
    indices: [[u32; 3]; LANES],
    /// Places of positions and normals in the tables.
    position_places: [Lanes<u32>; 3],
    normal_places: [Lanes<u32>; 3],
    corners: [Vectors; 3],
    normals: [Vectors; 3],
    /// Whether the triangle has vertex normals.
    smooth: Lanes<u32>,
    /// Whether its vertices are in the space of its object.
    moved: Lanes<u32>,
    u: Lanes<f32>,
    v: Lanes<f32>,
    ior: Lanes<f32>,
    front: Lanes<u32>,
    instance: Lanes<u32>,
    /// Number of the triangle in its geometry.
    primitive: Lanes<u32>,
    /// See [`crate::sites::Sites::binding`].
    pub binding: Lanes<u32>,
    /// The following are those of [`crate::vertices::PlainPoint`].
    pub wo: Vectors,
    pub position: Vectors,
    pub extent: Lanes<f32>,
    pub normal: Vectors,
    pub shading_normal: Vectors,
    pub color: Vectors,
    pub eta: Lanes<f32>,
    /// Length of the path up to here.
    pub length: Lanes<f32>,
}

/// The hits of a batch, a row of sixteen after the other. From a hit to its vertices memory is waited for twice, so rows are
/// under way at three stages: their triangles are asked for, their vertices are, and their surfaces are computed.
#[derive(Default)]
pub(crate) struct TriangleRows {
    /// See [`crate::sites::Sites::binding`], for each hit that has been asked for.
    bindings: Column<u32>,
    /// The row that is computed, and the next one.
    rows: [TriangleLanes; 2],
}

impl TriangleRows {
    /// Starts with new hits.
    #[inline(always)]
    pub fn begin<I: Instructions>(&mut self, i: I, scene: &CpuScene, hits: &HitStream, count: usize) {
        self.bindings.make_room(count);
        self.ask(i, scene, hits, 0, count);
        self.ask(i, scene, hits, LANES, count);
        self.locate(i, scene, hits, 0, count);
    }

    /// Computes the surfaces that the row of paths from `first` on has come to, of `count` in all.
    #[inline(always)]
    pub fn compute<I: Instructions>(
        &mut self,
        i: I,
        scene: &CpuScene,
        paths: &PathStream,
        hits: &HitStream,
        first: usize,
        count: usize,
    ) {
        self.ask(i, scene, hits, first + 2 * LANES, count);
        self.locate(i, scene, hits, first + LANES, count);
        self.rows[first / LANES % 2].compute(i, scene, paths, hits, first);
    }

    /// The row from `first` on.
    #[inline(always)]
    pub fn row(&self, first: usize) -> &TriangleLanes {
        &self.rows[first / LANES % 2]
    }

    /// Finds out in which geometries hits are, and asks for their triangles.
    #[inline(always)]
    fn ask<I: Instructions>(&mut self, i: I, scene: &CpuScene, hits: &HitStream, first: usize, count: usize) {
        if first >= count {
            return;
        }
        let hits = hits.lanes(first);
        let mut rest = first_lanes(count - first) & !i.equal(hits.primitive, NONE);
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize;
            rest &= rest - 1;
            let primitive = hits.primitive[lane];
            let binding = scene.sites.binding(hits.instance[lane], primitive);
            self.bindings.set(first + lane, binding);
            let site = scene.sites.site(binding);
            let triangle = site.first_primitive.wrapping_add(primitive).wrapping_sub(site.first_in_blas);
            prefetch(&scene.tables.indices, triangle as usize);
        }
    }

    /// Finds the triangles, and asks for their vertices.
    #[inline(always)]
    fn locate<I: Instructions>(
        &mut self,
        i: I,
        scene: &CpuScene,
        hits: &HitStream,
        first: usize,
        count: usize,
    ) {
        if first < count {
            let (hits, bindings) = (hits.lanes(first), self.bindings.lanes(first));
            self.rows[first / LANES % 2].locate(i, scene, &hits, bindings, first_lanes(count - first));
        }
    }
}

/// As many lanes, as bits, but not more than there are.
#[inline(always)]
fn first_lanes(count: usize) -> u32 {
    ALL_LANES >> (LANES - count.min(LANES))
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
        first: usize,
    ) {
        let (hits, directions, lengths) =
            (hits.lanes(first), paths.direction.lanes(first), paths.length.lanes(first));
        (self.u.0, self.v.0) = (*hits.u, *hits.v);
        for (lane, length) in self.length.0.iter_mut().enumerate() {
            self.wo.set(lane, -directions.get(lane));
            *length = lengths[lane] + hits.t[lane];
        }
        self.fetch_vertices(i, scene);
        for lane in 0..LANES {
            self.compute_lane(lane);
        }
    }

    /// Which lanes have come to this, as bits.
    #[inline(always)]
    pub fn which(&self, i: impl Instructions, arrival: Arrival) -> u32 {
        i.equal(&self.arrival.0, arrival as u32)
    }

    /// Finds the triangles of the hits in `mask`.
    #[inline(always)]
    fn locate<I: Instructions>(
        &mut self,
        i: I,
        scene: &CpuScene,
        hits: &HitLanes,
        bindings: &[u32; LANES],
        mask: u32,
    ) {
        self.arrival = Lanes::default();
        self.smooth = Lanes::default();
        self.moved = Lanes::default();
        let sky = mask & i.equal(hits.primitive, NONE);
        let mut rest = sky;
        while rest != 0 {
            self.arrival.0[rest.trailing_zeros() as usize] = Arrival::Sky as u32;
            rest &= rest - 1;
        }
        rest = mask & !sky;
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize;
            rest &= rest - 1;
            self.locate_lane(scene, lane, hits, bindings[lane]);
        }
    }

    #[inline(always)]
    fn locate_lane(&mut self, scene: &CpuScene, lane: usize, hits: &HitLanes, binding: u32) {
        let (instance, primitive) = (hits.instance[lane], hits.primitive[lane]);
        let site = scene.sites.site(binding);
        self.arrival.0[lane] = site.arrival as u32;
        if site.arrival == Arrival::General {
            return;
        }
        let primitive = primitive - site.first_in_blas;
        let indices = scene.tables.indices[(site.first_primitive + primitive) as usize];
        for (k, index) in indices.into_iter().enumerate() {
            let position = site.first_vertex + index;
            // Nobody looks at the normal's place where there are no normals, and asking for it does no harm.
            let normal = site.first_normal.wrapping_add(index);
            prefetch(&scene.tables.positions, position as usize);
            prefetch(&scene.tables.normals, normal as usize);
            self.position_places[k].0[lane] = position;
            self.normal_places[k].0[lane] = normal;
        }
        self.indices[lane] = indices;
        self.smooth.0[lane] = u32::from(site.first_normal != NONE);
        self.moved.0[lane] = u32::from(!site.identity);
        self.color.set(lane, vec3(site.color));
        self.ior.0[lane] = site.ior;
        self.instance.0[lane] = instance;
        self.binding.0[lane] = binding;
        self.primitive.0[lane] = primitive;
    }

    #[inline(always)]
    fn fetch_vertices<I: Instructions>(&mut self, i: I, scene: &CpuScene) {
        let tables = &*scene.tables;
        let elsewhere = [Arrival::Nothing, Arrival::Sky, Arrival::General];
        let here = elsewhere.into_iter().fold(ALL_LANES, |lanes, arrival| lanes & !self.which(i, arrival));
        let smooth = i.equal(&self.smooth.0, 1);
        for (places, Vectors { x, y, z }) in self.position_places.iter().zip(&mut self.corners) {
            i.fetch(&tables.positions, &places.0, here, [&mut x.0, &mut y.0, &mut z.0]);
        }
        if smooth != 0 {
            for (places, Vectors { x, y, z }) in self.normal_places.iter().zip(&mut self.normals) {
                i.fetch(&tables.normals, &places.0, smooth, [&mut x.0, &mut y.0, &mut z.0]);
            }
        }
        let mut moved = i.equal(&self.moved.0, 1);
        while moved != 0 {
            let lane = moved.trailing_zeros() as usize;
            moved &= moved - 1;
            self.place(scene, lane);
        }
    }

    /// Takes the vertices of a lane to world space.
    #[inline(always)]
    fn place(&mut self, scene: &CpuScene, lane: usize) {
        let instance = &scene.tables.instances[self.instance.0[lane] as usize];
        for k in 0..3 {
            let corner = transform_point(&instance.object_to_world, self.corners[k].get(lane));
            let normal = transform_normal(&instance.world_to_object, self.normals[k].get(lane));
            self.corners[k].set(lane, corner);
            self.normals[k].set(lane, normal);
        }
    }

    #[inline(always)]
    fn compute_lane(&mut self, lane: usize) {
        let [p0, p1, p2] = [0, 1, 2].map(|k| self.corners[k].get(lane));
        let [n0, n1, n2] = [0, 1, 2].map(|k| self.normals[k].get(lane));
        let (u, v) = (self.u.0[lane], self.v.0[lane]);
        let w = 1.0 - u - v;
        let wo = self.wo.get(lane);
        let outward = unit(cross(p1 - p0, p2 - p0));
        let interpolated = n0 * w + n1 * u + n2 * v;
        let smooth = self.smooth.0[lane] != 0 && dot(interpolated, interpolated) > 1e-20;
        let front = dot(outward, wo) >= 0.0;
        let side = if front { 1.0 } else { -1.0 };
        let normal = outward * side;
        let bent = bend_normal(wo, normal, unit(interpolated) * side);
        let choose = |smooth_component: f32, flat: f32| if smooth { smooth_component } else { flat };
        let shading = vec3f(choose(bent.x, normal.x), choose(bent.y, normal.y), choose(bent.z, normal.z));
        self.position.set(lane, p0 * w + p1 * u + p2 * v);
        self.extent.0[lane] = largest_coordinate([p0, p1, p2]);
        self.normal.set(lane, normal);
        self.shading_normal.set(lane, shading);
        self.front.0[lane] = u32::from(front);
        let ior = self.ior.0[lane];
        self.eta.0[lane] = if front { ior } else { 1.0 / ior };
    }

    /// The site of one lane, if the lane is done here.
    #[inline(always)]
    pub fn site<'s>(&self, scene: &'s CpuScene, lane: usize) -> Option<&'s Site> {
        (self.arrival.0[lane] >= Arrival::Surface as u32).then(|| scene.sites.site(self.binding.0[lane]))
    }

    /// The surface of one lane; `None` where it takes the general way.
    ///
    /// `wants_coordinates`: whether texture coordinates are asked for even if the material does not need them.
    #[inline(always)]
    pub fn surface(&self, scene: &CpuScene, lane: usize, wants_coordinates: bool) -> Option<Surface> {
        let site = self.site(scene, lane)?;
        let tables = &*scene.tables;
        let geometry = &tables.geometries[site.geometry as usize];
        let binding = &tables.bindings[self.binding.0[lane] as usize];
        let primitive = self.primitive.0[lane];
        let position = self.position.get(lane);
        let (mut coords, mut color) = (TexCoords::default(), [1.0; 4]);
        let material = &tables.materials[site.material as usize];
        if wants_coordinates || material.is_textured() || geometry.first_color != NONE {
            let corners = self.indices[lane];
            let (u, v) = (self.u.0[lane], self.v.0[lane]);
            let weights = [1.0 - u - v, u, v];
            coords = tex_coords(tables, geometry, corners, weights);
            color = vertex_color(tables, geometry, corners, weights);
        }
        let shading_normal = self.shading_normal.get(lane);
        Some(Surface {
            position,
            extent: self.extent.0[lane],
            normal: self.normal.get(lane),
            shading_normal,
            front: self.front.0[lane] != 0,
            wo: self.wo.get(lane),
            coords,
            color,
            material: site.material,
            light: tables.light_of(binding, primitive),
            object: binding.object,
            primitive,
            pattern_position: [position.x, position.z],
            layer_frame: Frame { tangent: shading_normal, bitangent: shading_normal, normal: shading_normal },
        })
    }
}

/// A vector of length 1 in the direction of `v`; not a number for zero, which the caller has excluded or ignores.
#[inline(always)]
fn unit(v: Vec3f) -> Vec3f {
    v * (1.0 / dot(v, v).sqrt())
}
