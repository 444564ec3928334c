//! The scalar kernels: the same traversal, one box and one primitive at a time, with the formulas
//! of `optics`. They run on processors without SIMD support, and tests compare the SIMD kernels
//! with them.

use super::closest_hit::{ClosestHit, can_hit};
use super::hit_sink::HitSink;
use super::packet::Packet;
use super::ray_stream::RayStream;
use super::slabs::Slabs;
use super::traversal_stack::STACK_SIZE;
use crate::bvh::{Blas, LeafBlocks, Tlas};
use crate::layout::{ChildRef, EMPTY, LEAF, LeafBlock, NO_PRIMITIVE, Node, TriangleBlock, WIDTH, leaf_index};
use crate::ray::{Candidate, Hit, HitFilter, Ray};
use optics::intersect::{RayShear, intersect_sphere, intersect_triangle, ray_shear};
use std::ops::Range;
use wgsl_rs::std::{Vec3f, vec3f};

fn vector(a: [f32; 3]) -> Vec3f {
    vec3f(a[0], a[1], a[2])
}

/// Visits leaves in order of distance. `leaf` returns the new `t_max`, or `None` to stop.
fn traverse(
    nodes: &[Node],
    root: ChildRef,
    slabs: &Slabs,
    mut t_max: f32,
    mut leaf: impl FnMut(usize, f32) -> Option<f32>,
) -> bool {
    let mut stack = [(0.0f32, EMPTY); STACK_SIZE];
    stack[0] = (slabs.t_min, root);
    let mut size = 1;
    while size > 0 {
        size -= 1;
        let (distance, child) = stack[size];
        // Coordinates near the limits of floats may let a ray hit unused boxes.
        if distance >= t_max || child == EMPTY {
            continue;
        }
        if child & LEAF != 0 {
            match leaf(leaf_index(child), t_max) {
                Some(t) => t_max = t,
                None => return true,
            }
            continue;
        }
        let node = &nodes[child as usize];
        let first = size;
        for lane in 0..WIDTH {
            let (mut near, mut far) = (slabs.t_min, t_max);
            for a in 0..3 {
                let side = slabs.near_plane[a].side();
                let enter = node.planes[a][side][lane].mul_add(slabs.inverse[a], slabs.near_offset[a]);
                let leave = node.planes[a][side ^ 1][lane].mul_add(slabs.inverse[a], slabs.far_offset[a]);
                // Comparisons with NaN are false, so an axis that gives NaN has no effect.
                near = if enter > near { enter } else { near };
                far = if leave < far { leave } else { far };
            }
            if near <= far {
                let mut at = size;
                while at > first && stack[at - 1].0 < near {
                    stack[at] = stack[at - 1];
                    at -= 1;
                }
                stack[at] = (near, node.children[lane]);
                size += 1;
            }
        }
    }
    false
}

/// Calls `found` with the ray parameter of every hit in a leaf between the ray's start and `t_max`,
/// until it returns true.
fn leaf_hits(
    blas: &Blas,
    index: usize,
    ray: &Ray,
    shear: RayShear,
    t_max: f32,
    instance: u32,
    mut found: impl FnMut(f32, &Candidate) -> bool,
) -> bool {
    let (t_min, direction) = (ray.t_min.max(0.0), ray.direction);
    let (o, d) = (vector(ray.origin), vector(ray.direction));
    match &blas.leaves {
        LeafBlocks::Triangles(blocks) => {
            let block = &blocks[index];
            (0..WIDTH).any(|lane| {
                let [a, b, c] = block.triangle(lane).map(vector);
                let h = intersect_triangle(o, shear, a, b, c, t_min, t_max);
                let (primitive, outward) = (block.ids[lane], [0.0; 3]);
                let candidate = Candidate { instance, primitive, u: h.u, v: h.v, direction, outward };
                primitive != NO_PRIMITIVE && h.hit && found(h.t, &candidate)
            })
        }
        LeafBlocks::Spheres(blocks) => {
            let block = &blocks[index];
            (0..WIDTH).any(|lane| {
                let [x, y, z, r] = block.spheres.map(|c| c[lane]);
                let h = intersect_sphere(o, d, vec3f(x, y, z), r);
                h.hit
                    && [h.near, h.far].iter().any(|&t| {
                        let outward = ((o + d * t - vec3f(x, y, z)) * (1.0 / r)).to_array();
                        let primitive = block.ids()[lane];
                        let candidate = Candidate { instance, primitive, u: 0.0, v: 0.0, direction, outward };
                        t > t_min && t < t_max && found(t, &candidate)
                    })
            })
        }
    }
}

/// There are no scalar packets: the caller traces the rays one by one.
pub(super) fn packet<F: HitFilter, R: RayStream + ?Sized, const ANY: bool>(
    _: &mut Packet,
    _: &Blas,
    _: &[TriangleBlock],
    _: &R,
    _: Range<usize>,
    _: &F,
) -> bool {
    false
}

pub(super) fn blas_closest<F: HitFilter>(
    blas: &Blas,
    ray: &Ray,
    instance: u32,
    filter: &F,
    best: &mut ClosestHit,
) {
    let slabs = Slabs::new(ray, &blas.extent);
    let shear = ray_shear(vector(ray.direction));
    traverse(&blas.nodes, blas.root, &slabs, best.t_max, |index, t_max| {
        leaf_hits(blas, index, ray, shear, t_max, instance, |t, candidate| {
            if t < best.t_max && (F::OPAQUE || filter.accept(candidate)) {
                let Candidate { primitive, u, v, .. } = *candidate;
                *best = ClosestHit { hit: Hit { t, u, v, primitive, instance }, t_max: t };
            }
            false
        });
        Some(best.t_max)
    });
}

pub(super) fn blas_any<F: HitFilter>(blas: &Blas, ray: &Ray, instance: u32, filter: &F) -> bool {
    let slabs = Slabs::new(ray, &blas.extent);
    let shear = ray_shear(vector(ray.direction));
    traverse(&blas.nodes, blas.root, &slabs, ray.t_max, |index, t_max| {
        let hit = leaf_hits(blas, index, ray, shear, t_max, instance, |_, candidate| {
            F::OPAQUE || filter.accept(candidate)
        });
        if hit { None } else { Some(t_max) }
    })
}

pub(super) fn tlas_closest<F: HitFilter>(
    tlas: &Tlas,
    ray: &Ray,
    time: f32,
    filter: &F,
    best: &mut ClosestHit,
) {
    if let Some(blas) = tlas.single_object(filter.ray_mask()) {
        return blas_closest(blas, ray, 0, filter, best);
    }
    let slabs = Slabs::new(ray, &tlas.extent);
    traverse(&tlas.nodes, tlas.root, &slabs, best.t_max, |index, _| {
        if let Some((blas, instance, ray)) = tlas.enter(index, ray, || time, filter.ray_mask()) {
            blas_closest(blas, &ray, instance, filter, best);
        }
        Some(best.t_max)
    });
}

pub(super) fn tlas_any<F: HitFilter>(tlas: &Tlas, ray: &Ray, time: f32, filter: &F) -> bool {
    if let Some(blas) = tlas.single_object(filter.ray_mask()) {
        return blas_any(blas, ray, 0, filter);
    }
    let slabs = Slabs::new(ray, &tlas.extent);
    traverse(&tlas.nodes, tlas.root, &slabs, ray.t_max, |index, t_max| {
        match tlas.enter(index, ray, || time, filter.ray_mask()) {
            Some((blas, instance, ray)) if blas_any(blas, &ray, instance, filter) => None,
            _ => Some(t_max),
        }
    })
}

/// The closest hit of each ray.
pub(super) fn stream_closest<F: HitFilter>(
    tlas: &Tlas,
    rays: &(impl RayStream + ?Sized),
    hits: &mut (impl HitSink + ?Sized),
    filter: &F,
) {
    for i in 0..rays.len() {
        let ray = rays.ray(i);
        let mut best = ClosestHit::new(&ray);
        if can_hit(tlas.root, &ray) {
            tlas_closest(tlas, &ray, rays.time(i), filter, &mut best);
        }
        hits.set(i, &best.hit);
    }
}

/// Any hit of each ray.
pub(super) fn stream_any<F: HitFilter>(
    tlas: &Tlas,
    rays: &(impl RayStream + ?Sized),
    any: &mut [bool],
    filter: &F,
) {
    for (i, any) in any.iter_mut().enumerate() {
        let ray = rays.ray(i);
        *any = can_hit(tlas.root, &ray) && tlas_any(tlas, &ray, rays.time(i), filter);
    }
}
