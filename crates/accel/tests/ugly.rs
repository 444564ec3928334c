//! Inputs that nobody should make and somebody will.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

mod support;

use accel::{Blas, Coherence, Geometry, Instance, InstructionSet, MISS, Opaque, Quality, Ray, Sphere, Tlas};
use proptest::prelude::*;
use std::sync::Arc;
use support::{Everything, Mesh, Rng, alone, amount, random_rays};

/// Runs `f` with every instruction set.
fn each_kernel(mut tlas: Tlas, f: impl Fn(&Tlas)) {
    for isa in InstructionSet::available() {
        tlas.set_instruction_set(isa);
        // An object has an instruction set of its own; that of the top level is used here.
        f(&tlas);
    }
}

#[test]
fn nothing_is_never_hit() {
    let ray = Ray::new([0.0; 3], [0.0, 0.0, 1.0]);
    let empty = Blas::triangles(&[], Quality::Balanced);
    assert!(empty.closest(&ray, &Opaque).is_miss() && !empty.any(&ray, &Opaque) && empty.bounds().is_empty());
    let nothing = Mesh::default();
    each_kernel(alone(Blas::triangles(&[nothing.geometry(0)], Quality::High)), |t| {
        assert!(t.closest(&ray, &Opaque).is_miss() && !t.any(&ray, &Opaque));
        let mut hits = [MISS; 3];
        t.closest_stream(&[ray; 3][..], &mut hits[..], &Opaque, Coherence::Coherent);
        assert_eq!(hits, [MISS; 3]);
    });
    each_kernel(alone(Blas::spheres(&[], 0, Quality::Fast)), |t| assert!(!t.any(&ray, &Opaque)));
    each_kernel(Tlas::build(&[], vec![]), |t| {
        assert!(t.closest(&ray, &Opaque).is_miss() && t.bounds().is_empty())
    });
}

#[test]
fn what_cannot_be_hit_is_skipped_and_counted() {
    let (nan, inf) = (f32::NAN, f32::INFINITY);
    let mesh = Mesh {
        positions: vec![
            [0.0; 3],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [nan, 0.0, 0.0],
            [inf, 0.0, 0.0],
            [2.0, 0.0, 0.0],
        ],
        indices: vec![[0, 1, 2], [0, 1, 3], [0, 4, 2], [0, 0, 1], [0, 1, 5], [0, 1, 77]],
    };
    let blas = Blas::triangles(&[mesh.geometry(0)], Quality::Balanced);
    assert_eq!((blas.skipped_primitives(), blas.primitive_count()), (5, 1));
    assert_eq!(blas.closest(&Ray::new([0.2, 0.2, -1.0], [0.0, 0.0, 1.0]), &Opaque).primitive, 0);
    let sphere = |radius| Sphere { center: [0.0; 3], radius };
    let spheres = Blas::spheres(&[sphere(0.0), sphere(-1.0), sphere(nan), sphere(1.0)], 10, Quality::Fast);
    assert_eq!((spheres.skipped_primitives(), spheres.primitive_count()), (3, 1));
    assert_eq!(spheres.closest(&Ray::new([0.0, 0.0, -2.0], [0.0, 0.0, 0.5]), &Opaque).t, 2.0);
    let flat = Instance { object_to_world: [[0.0; 4]; 3], ..Instance::identity(0) };
    let tlas = Tlas::build(&[flat, Instance::identity(0)], vec![Arc::new(blas)]);
    assert_eq!(tlas.skipped_instances(), 1);
    assert_eq!(tlas.closest(&Ray::new([0.2, 0.2, -1.0], [0.0, 0.0, 1.0]), &Opaque).instance, 1);
}

#[test]
fn identical_triangles() {
    let count = if cfg!(miri) { 100 } else { 1_000_000 };
    let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let indices = vec![[0, 1, 2]; count];
    let geometry = Geometry { positions: &positions, indices: &indices, first_id: 0 };
    each_kernel(alone(Blas::triangles(&[geometry], Quality::Balanced)), |t| {
        // The first ray makes its way through all of them: once is enough.
        let hit = t.closest(&Ray::new([0.25, 0.25, 1.0], [0.0, 0.0, -1.0]), &Opaque);
        assert!((hit.t - 1.0).abs() < 1e-6 && (hit.primitive as usize) < count);
        assert!(!t.any(&Ray::new([0.75, 0.75, 1.0], [0.0, 0.0, -1.0]), &Opaque));
    });
}

#[test]
fn sizes_from_tiny_to_huge() {
    // Each triangle is twice as large as the one before: cuts by area peel them off one by one.
    let mut mesh = Mesh::default();
    for i in 0..200 {
        // 2^(i - 100) to the bit, which `powi` does not promise.
        let s = f32::from_bits((i + 27) << 23);
        let first = mesh.positions.len() as u32;
        mesh.positions.extend([[s, 0.0, 0.0], [0.0, s, 0.0], [0.0, 0.0, s]]);
        mesh.indices.push([first, first + 1, first + 2]);
    }
    let blas = Blas::triangles(&[mesh.geometry(0)], Quality::Balanced);
    blas.validate().unwrap();
    // The coordinates of most are too small or too large for the products of the test: what is hit
    // must be right.
    each_kernel(alone(blas), |t| {
        let hit = t.closest(&Ray::new([0.0; 3], [1.0, 1.0, 1.0]), &Opaque);
        let expected = mesh.corners(hit.primitive as usize)[0][0] / 3.0;
        assert!((hit.t - expected).abs() < 1e-5 * expected, "{hit:?}");
    });
}

#[test]
fn rays_that_are_not_rays_miss() {
    let mesh = Mesh::blob(if cfg!(miri) { 4 } else { 24 });
    let good = Ray::new([0.0; 3], [0.0, 1.0, 0.5]);
    let (nan, inf) = (f32::NAN, f32::INFINITY);
    let mut bad =
        vec![Ray { direction: [0.0; 3], ..good }, Ray { t_min: nan, ..good }, Ray { t_max: nan, ..good }];
    bad.push(Ray { t_min: 1.0, t_max: 0.5, ..good });
    for a in 0..3 {
        for x in [nan, inf, -inf] {
            let mut r = good;
            r.origin[a] = x;
            bad.push(r);
            r = good;
            r.direction[a] = x;
            bad.push(r);
        }
    }
    each_kernel(alone(Blas::triangles(&[mesh.geometry(0)], Quality::Balanced)), |t| {
        assert!(t.any(&good, &Opaque));
        for ray in &bad {
            assert!(t.closest(ray, &Opaque).is_miss() && !t.any(ray, &Opaque), "{ray:?}");
        }
        let mut mixed = vec![good; 40];
        mixed[7] = bad[5];
        let mut any = vec![false; 40];
        t.any_stream(&mixed[..], &mut any, &Opaque, Coherence::Coherent);
        assert!(any.iter().enumerate().all(|(i, &a)| a == (i != 7)));
    });
}

/// From inside of a closed mesh every ray hits, also those aimed at edges and vertices: of a large
/// one, and of one of so few triangles that all rays of a stream are tested with all of them.
#[test]
fn closed_meshes_do_not_leak() {
    for (size, repeats) in [(if cfg!(miri) { 4 } else { 40 }, 1), (6, amount(100))] {
        let mesh = Mesh::blob(size);
        let mut rng = Rng::new(11);
        let mut rays = Vec::new();
        for i in (0..mesh.indices.len()).cycle().take(repeats * mesh.indices.len()) {
            let [a, b, c] = mesh.corners(i);
            let s = (rng.signed() + 1.0) / 2.0;
            let origin = rng.point().map(|x| 0.2 * x);
            for target in [
                a,
                [0, 1, 2].map(|k: usize| a[k] + s * (b[k] - a[k])),
                [0, 1, 2].map(|k: usize| (b[k] + c[k]) / 2.0),
            ] {
                rays.push(Ray::new(origin, [0, 1, 2].map(|k: usize| target[k] - origin[k])));
                rays.push(Ray::new([0.0; 3], target));
            }
        }
        each_kernel(alone(Blas::triangles(&[mesh.geometry(0)], Quality::Balanced)), |t| {
            assert!(rays.iter().all(|r| !t.closest(r, &Opaque).is_miss()), "{:?} leaks", t.instruction_set());
            for coherence in [Coherence::Coherent, Coherence::Incoherent] {
                let mut any = vec![false; rays.len()];
                t.any_stream(&rays[..], &mut any, &Opaque, coherence);
                assert!(any.iter().all(|&a| a), "any hits of the stream of {:?} leak", t.instruction_set());
                let mut hits = vec![MISS; rays.len()];
                t.closest_stream(&rays[..], &mut hits[..], &Opaque, coherence);
                assert!(
                    hits.iter().all(|hit| !hit.is_miss()),
                    "the stream of {:?} leaks",
                    t.instruction_set()
                );
            }
        });
    }
}

/// Whether a ray hits a triangle, in double precision. Nothing where it passes an edge, or ends, so
/// closely that rounding decides, or where numbers leave the range.
fn hits_surely(ray: &Ray, triangle: &[[f32; 3]; 3]) -> Option<bool> {
    const CLOSE: f64 = 1e-4;
    let wide = |p: [f32; 3]| p.map(f64::from);
    let minus = |x: [f64; 3], y: [f64; 3]| [0, 1, 2].map(|k: usize| x[k] - y[k]);
    let cross = |x: [f64; 3], y: [f64; 3]| {
        [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]]
    };
    let dot = |x: [f64; 3], y: [f64; 3]| x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
    let ([a, b, c], d) = (triangle.map(wide), wide(ray.direction));
    let from = minus(wide(ray.origin), a);
    let (ab, ac) = (minus(b, a), minus(c, a));
    let normal = cross(ab, ac);
    let along = dot(normal, d);
    let t = -dot(normal, from) / along;
    let p = [0, 1, 2].map(|k: usize| from[k] + t * d[k]);
    let area = dot(normal, normal);
    let (v, w) = (dot(cross(p, ac), normal) / area, dot(cross(ab, p), normal) / area);
    let closest = v.min(w).min(1.0 - v - w);
    // How far rounding moves the point, in weights: more at grazing angles, for slender triangles,
    // and from far away.
    let reach =
        dot(from, from).max(t * t * dot(d, d)).sqrt() / (area.sqrt() / dot(ab, ab).max(dot(ac, ac)).sqrt());
    let grazing = (area * dot(d, d)).sqrt() / along.abs();
    let room = CLOSE * (1.0 + reach * grazing);
    let (begin, end) = (f64::from(ray.t_min.max(0.0)), f64::from(ray.t_max));
    let is_clear = |x: f64| (t - x).abs() > CLOSE * t.abs();
    (closest.abs() > room && is_clear(begin) && is_clear(end))
        .then_some(closest > 0.0 && begin < t && t < end)
}

/// Any float at all, often an awkward one.
fn float() -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => -2.0f32..2.0,
        1 => prop::sample::select(vec![0.0, -0.0, 1.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30, -1e30, 1e-30,
                                       f32::MAX, f32::MIN_POSITIVE, 1e-45]),
    ]
}

fn point() -> impl Strategy<Value = [f32; 3]> {
    [float(), float(), float()]
}

fn unit() -> impl Strategy<Value = [f32; 3]> {
    [-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: if cfg!(miri) { 4 } else { 256 }, failure_persistence: None, ..Default::default() })]

    #[test]
    fn anything_goes(points in prop::collection::vec([point(), point(), point()], 0..120),
                     rays in prop::collection::vec((point(), point(), float(), float()), 1..50),
                     quality in prop::sample::select(vec![Quality::Fast, Quality::Balanced, Quality::High])) {
        let mut mesh = Mesh::default();
        for p in &points {
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(p);
            mesh.indices.push([first, first + 1, first + 2]);
        }
        let rays: Vec<_> =
            rays.iter().map(|&(origin, direction, t_min, t_max)| Ray { origin, t_min, direction, t_max }).collect();
        let mut tlas = alone(Blas::triangles(&[mesh.geometry(0)], quality));
        for isa in InstructionSet::available() {
            tlas.set_instruction_set(isa);
            let mut hits = vec![MISS; rays.len()];
            tlas.closest_stream(&rays[..], &mut hits[..], &Opaque, Coherence::Coherent);
            for (ray, streamed) in rays.iter().zip(&hits) {
                let hit = tlas.closest(ray, &Opaque);
                prop_assert!(hit.is_miss() || (hit.t > ray.t_min.max(0.0) && hit.t < ray.t_max), "{hit:?}");
                prop_assert!(!hit.u.is_nan() && !hit.v.is_nan());
                prop_assert_eq!(tlas.any(ray, &Opaque), !hit.is_miss());
                // Streams of a few triangles let in rays that pass an edge by as much as rounding
                // may err.
                if streamed.is_miss() != hit.is_miss() {
                    let met = if hit.is_miss() { streamed } else { &hit };
                    let triangle = &points[met.primitive as usize];
                    let right = hits_surely(ray, triangle).is_none_or(|hits| hits != streamed.is_miss());
                    prop_assert!(right, "{hit:?} {streamed:?} {ray:?} {triangle:?}");
                }
                prop_assert!(!streamed.u.is_nan() && !streamed.v.is_nan());
                let ends = ray.t_min.max(0.0)..ray.t_max;
                prop_assert!(streamed.is_miss() || (streamed.t > ends.start && streamed.t < ends.end), "{streamed:?}");
            }
        }
    }

    #[test]
    fn moderate_numbers_give_the_right_hit(points in prop::collection::vec([unit(), unit(), unit()], 1..100),
                                           exponent in -12i32..12) {
        let scale = 2.0f32.powi(exponent);
        let mut mesh = Mesh::default();
        for p in &points {
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(p.map(|q| q.map(|x| x * scale)));
            mesh.indices.push([first, first + 1, first + 2]);
        }
        let mut all = Everything::default();
        all.add_mesh(0, 0, &mesh, &Instance::IDENTITY);
        let mut rng = Rng::new(exponent as u64);
        let mut rays = random_rays(&mut rng, amount(200), 2.0);
        for r in &mut rays {
            r.origin = r.origin.map(|x| x * scale);
        }
        let expected: Vec<_> = rays.iter().map(|r| all.closest(r, &Opaque)).collect();
        let mut tlas = alone(Blas::triangles(&[mesh.geometry(0)], Quality::Balanced));
        for isa in InstructionSet::available() {
            tlas.set_instruction_set(isa);
            let wrong = rays.iter().zip(&expected).filter(|(r, e)| {
                let h = tlas.closest(r, &Opaque);
                e.is_miss() != h.is_miss() || (!h.is_miss() && (h.t - e.t).abs() > 1e-3 * e.t)
            });
            prop_assert!(wrong.count() <= 1);
        }
    }
}
