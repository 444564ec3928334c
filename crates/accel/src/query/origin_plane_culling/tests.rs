//! Tests of the culling table and of streams that use it.

use super::*;
use crate::bvh::LeafBlocks;
use crate::query::dispatch::find_culled_children;
use crate::ray::{Hit, MISS, Opaque, Ray};
use crate::{Blas, Coherence, Geometry, Instance, Quality, RayColumns, Tlas};
use crate::{InstructionSet, OriginSide};
use std::sync::Arc;

type Triangle = [[f32; 3]; 3];

/// Random numbers from -1 to 1.
fn numbers() -> impl FnMut() -> f32 {
    let mut bits = 7u32;
    move || {
        bits = bits.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        (bits >> 8) as f32 / 8_388_608.0 - 1.0
    }
}

/// A ball of so many rings, all triangles of which face outwards.
fn ball(center: [f32; 3], radius: f32, rings: u32) -> Vec<Triangle> {
    let point = |i: u32, j: u32| {
        let (theta, phi) = (f64::from(i) / f64::from(rings), f64::from(j % (2 * rings)) / f64::from(rings));
        let (theta, phi) = (theta * std::f64::consts::PI, phi * std::f64::consts::PI);
        // One point at each pole.
        let sine = if i.is_multiple_of(rings) { 0.0 } else { theta.sin() };
        let at = [sine * phi.cos(), theta.cos(), -sine * phi.sin()];
        [0, 1, 2].map(|k: usize| center[k] + radius * at[k] as f32)
    };
    let mut triangles = Vec::new();
    for (i, j) in (0..rings).flat_map(|i| (0..2 * rings).map(move |j| (i, j))) {
        let [a, b, c, d] = [point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)];
        triangles.extend([[a, b, c], [a, c, d]]);
    }
    triangles.retain(|[a, b, c]| a != b && b != c && c != a);
    triangles
}

fn object(triangles: &[Triangle]) -> Blas {
    let positions: Vec<[f32; 3]> = triangles.iter().flatten().copied().collect();
    let indices: Vec<[u32; 3]> = (0..triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    Blas::triangles(&[Geometry { positions: &positions, indices: &indices, first_id: 0 }], Quality::Balanced)
}

/// Balls that touch a floor of many triangles, a slanted wall of many, and rubble.
fn medley() -> Vec<Triangle> {
    let mut number = numbers();
    let mut triangles = ball([-1.5, 1.0, 0.0], 1.0, 12);
    triangles.extend(ball([1.5, 0.7, 0.3], 0.7, 9));
    let grid = |at: &dyn Fn(f32, f32) -> [f32; 3]| {
        let cells = (0..12).flat_map(|i| (0..12).map(move |j| (i as f32, j as f32)));
        let cell = |(i, j): (f32, f32)| {
            let [a, b, c, d] = [at(i, j), at(i, j + 1.0), at(i + 1.0, j + 1.0), at(i + 1.0, j)];
            [[a, b, c], [a, c, d]]
        };
        cells.flat_map(cell).collect::<Vec<_>>()
    };
    triangles.extend(grid(&|i, j| [0.5 * i - 3.0, 0.0, 0.5 * j - 3.0]));
    triangles.extend(grid(&|i, j| [0.5 * i - 3.0, 0.4 * j, -2.0 - 0.17 * j]));
    for _ in 0..300 {
        let center = [3.0 * number(), 1.5 + number(), 2.0 + number()];
        triangles.push([(); 3].map(|()| center.map(|x| x + 0.2 * number())));
    }
    triangles
}

fn blocks(object: &Blas) -> &[TriangleBlock] {
    match &object.leaves {
        LeafBlocks::Triangles(blocks) => blocks,
        LeafBlocks::Spheres(_) => panic!("it is made of triangles"),
    }
}

fn find(isa: InstructionSet, object: &Blas, triangles: usize) -> CullingTable {
    build_table(&object.nodes, blocks(object), triangles, |tree, block| {
        find_culled_children(isa, tree, block)
    })
}

#[test]
fn all_kernels_find_what_the_scalar_twin_finds() {
    let triangles = medley();
    let object = object(&triangles);
    let expected = find(InstructionSet::Scalar, &object, triangles.len()).0;
    let some = expected.iter().filter(|children| **children != CulledChildren::NONE).count();
    assert!(some > triangles.len() / 2, "{some} sides of {} triangles", triangles.len());
    for isa in InstructionSet::available() {
        assert_eq!(find(isa, &object, triangles.len()).0, expected, "{isa:?}");
    }
}

#[test]
fn a_ball_is_behind_its_triangles() {
    let triangles = ball([3.0, -1.0, 0.5], 2.0, 10);
    let object = object(&triangles);
    let table = find(InstructionSet::best(), &object, triangles.len());
    let all = CulledChildren::new(
        object.root,
        used_slots(&object.nodes[object.root as usize]).fold(0, |bits, slot| bits | 1 << slot),
    );
    let ids = || 0..triangles.len() as u32;
    let of_all = ids().filter(|id| table.get(OriginSide::of(*id, true)) == all).count();
    // Corners are rounded, so that a few planes cut off a part of the ball.
    assert!(of_all > triangles.len() * 9 / 10, "{of_all} of {}", triangles.len());
    for id in ids() {
        assert_eq!(
            table.get(OriginSide::of(id, true).other()),
            CulledChildren::NONE,
            "triangle {id} from within"
        );
    }
    assert_eq!(table.get(OriginSide::NONE), CulledChildren::NONE);
    assert_eq!(table.get(OriginSide::NONE.other()), CulledChildren::NONE);
}

/// Ids of the triangles in a subtree.
fn ids_below(object: &Blas, child: ChildRef, ids: &mut Vec<u32>) {
    if child & LEAF != 0 {
        ids.extend(blocks(object)[leaf_index(child)].ids.iter().filter(|id| **id != NO_PRIMITIVE));
        return;
    }
    let children = object.nodes[child as usize].children;
    children.into_iter().filter(|child| *child != EMPTY).for_each(|child| ids_below(object, child, ids));
}

/// In exact arithmetic, no culled geometry reaches as far above a triangle as rays start.
#[test]
fn what_lies_behind_is_not_above() {
    let triangles = medley();
    let object = object(&triangles);
    let table = find(InstructionSet::best(), &object, triangles.len());
    let mut compared = 0;
    for (id, triangle) in (0u32..).zip(&triangles) {
        let [a, b, c] = triangle.map(|p| p.map(f64::from));
        let (p, q) = ([0, 1, 2].map(|k: usize| b[k] - a[k]), [0, 1, 2].map(|k: usize| c[k] - a[k]));
        let n = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
        let length = n.iter().map(|x| x * x).sum::<f64>().sqrt();
        let largest = triangle.as_flattened().iter().fold(0.0f32, |m, x| m.max(x.abs()));
        for (sign, is_front) in [(1.0, true), (-1.0, false)] {
            let (node, which) = table.get(OriginSide::of(id, is_front)).parts();
            let (node, mut ids) = (&object.nodes[node], Vec::new());
            for slot in (0..WIDTH).filter(|slot| which >> slot & 1 != 0) {
                ids_below(&object, node.children[slot], &mut ids);
            }
            compared += ids.len();
            for point in ids.iter().flat_map(|id| triangles[*id as usize]) {
                let height: f64 = (0..3).map(|k| sign * n[k] / length * (f64::from(point[k]) - a[k])).sum();
                assert!(height <= f64::from(largest) / f64::from(1 << 22), "{height} above triangle {id}");
            }
        }
    }
    assert!(compared > 20 * triangles.len(), "{compared} triangles behind {}", triangles.len());
}

/// Rays from random points of all triangles, to both sides, with the sides that they leave.
fn leaving_rays(triangles: &[Triangle]) -> Vec<(Ray, OriginSide)> {
    let mut number = numbers();
    let mut rays = Vec::new();
    for (id, [a, b, c]) in (0u32..).zip(triangles) {
        for _ in 0..6 {
            let (u, v) = (0.5 + 0.5 * number(), 0.5 + 0.5 * number());
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let position = [0, 1, 2].map(|k: usize| (1.0 - u - v) * a[k] + u * b[k] + v * c[k]);
            let normal = OriginPlane::of([*a, *b, *c]).expect("it has an area").normal;
            let direction = [number(), number(), number()];
            let up: f32 = (0..3).map(|k| normal[k] * direction[k]).sum();
            let largest = [a, b, c].into_iter().flatten().fold(0.0f32, |m, x| m.max(x.abs()));
            let offset = largest * (2.0f32).powi(-19) * up.signum();
            let origin = [0, 1, 2].map(|k: usize| position[k] + offset * normal[k]);
            rays.push((Ray::new(origin, direction), OriginSide::of(id, up > 0.0)));
        }
    }
    rays
}

/// Where there is one object as it is, and where the same stands beside it and sides mean nothing.
#[test]
fn rays_that_say_what_they_leave_find_the_same() {
    let triangles = medley();
    let rays = leaving_rays(&triangles);
    let column = |number: &dyn Fn(&Ray) -> f32| rays.iter().map(|(ray, _)| number(ray)).collect::<Vec<_>>();
    let origin = [0, 1, 2].map(|k: usize| column(&|ray| ray.origin[k]));
    let direction = [0, 1, 2].map(|k: usize| column(&|ray| ray.direction[k]));
    let t_max = column(&|_| 3.0);
    let sides: Vec<OriginSide> = rays.iter().map(|(_, side)| *side).collect();
    let columns = |t_max| {
        let [o, d] = [&origin, &direction].map(|columns| columns.each_ref().map(|column| &column[..]));
        RayColumns::new(o, d, t_max)
    };
    let beside = [[1.0, 0.0, 0.0, 8.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
    let second = Instance { object_to_world: beside, ..Instance::identity(0) };
    for instances in [vec![Instance::identity(0)], vec![Instance::identity(0), second]] {
        let mut object = object(&triangles);
        object.build_culling_table();
        let mut tlas = Tlas::build(&instances, vec![Arc::new(object)]);
        assert_eq!(tlas.has_culling_table(), instances.len() == 1);
        for isa in InstructionSet::available() {
            tlas.set_instruction_set(isa);
            let mut hits = [vec![MISS; rays.len()], vec![MISS; rays.len()]];
            let mut any = [vec![false; rays.len()], vec![false; rays.len()]];
            for (at, is_said) in [false, true].into_iter().enumerate() {
                let (nearest, shadow) = (columns(None), columns(Some(&t_max[..])));
                let (nearest, shadow) = if is_said {
                    (nearest.with_origin_sides(&sides), shadow.with_origin_sides(&sides))
                } else {
                    (nearest, shadow)
                };
                tlas.closest_stream(&nearest, &mut hits[at][..], &Opaque, Coherence::Incoherent);
                tlas.any_stream(&shadow, &mut any[at], &Opaque, Coherence::Incoherent);
            }
            let found = hits[0].iter().filter(|hit: &&Hit| !hit.is_miss()).count();
            assert!(found > rays.len() / 4 && found < rays.len() * 3 / 4, "{found} of {}", rays.len());
            assert_eq!(hits[0], hits[1], "{isa:?}");
            assert_eq!(any[0], any[1], "{isa:?}");
        }
    }
}

#[test]
fn objects_that_change_forget_what_lies_behind() {
    let triangles = medley();
    let mut object = object(&triangles);
    assert!(!object.has_culling_table());
    object.build_culling_table();
    assert!(object.has_culling_table());
    let positions: Vec<[f32; 3]> = triangles.iter().flatten().map(|p| p.map(|x| 2.0 * x)).collect();
    let indices: Vec<[u32; 3]> = (0..triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    object.refit(&[Geometry { positions: &positions, indices: &indices, first_id: 0 }]);
    assert!(!object.has_culling_table());
}
