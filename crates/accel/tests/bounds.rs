//! Bounds of instances: around all that is in them, and close to it.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

mod support;

use accel::encode::{EncodedScene, Object, TraversalCounts};
use accel::{Aabb, Blas, Instance, Quality, Ray, Tlas};
use support::{Mesh, Rng, amount, transform};

/// A transform without an order: turns, scales, shears and moves.
fn any_transform(rng: &mut Rng) -> [[f32; 4]; 3] {
    [0, 1, 2].map(|_| {
        let [x, y, z] = rng.point();
        [x, y, z, 10.0 * rng.signed()]
    })
}

/// A turn by a random angle about a random axis (Rodrigues).
fn turn(rng: &mut Rng) -> [[f32; 4]; 3] {
    let [x, y, z] = rng.point();
    let length = (x * x + y * y + z * z).sqrt();
    let axis = [x, y, z].map(|c| c / length);
    let (sin, cos) = (3.0 * rng.signed()).sin_cos();
    let cross = [[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]];
    let entry = |r: usize, c: usize| {
        let identity = if r == c { cos } else { 0.0 };
        identity + sin * cross[r][c] + (1.0 - cos) * axis[r] * axis[c]
    };
    [0, 1, 2].map(|r: usize| [entry(r, 0), entry(r, 1), entry(r, 2), 0.0])
}

/// The bounds of an instance.
fn bounds(blas: &std::sync::Arc<Blas>, object_to_world: [[f32; 4]; 3]) -> Aabb {
    Tlas::build(&[Instance { object_to_world, ..Instance::identity(0) }], vec![blas.clone()]).bounds()
}

/// The smallest box around the corners of the triangles under a transform.
fn tight(mesh: &Mesh, m: &[[f32; 4]; 3]) -> Aabb {
    let corners = mesh.indices.as_flattened().iter().map(|&i| mesh.positions[i as usize]);
    corners.fold(Aabb::EMPTY, |b, p| b.with_point(transform(m, p)))
}

/// The smallest box around a transformed box.
fn of_box(b: &Aabb, m: &[[f32; 4]; 3]) -> Aabb {
    (0..8).fold(Aabb::EMPTY, |all, corner| {
        let p = [0, 1, 2].map(|a: usize| if corner >> a & 1 == 0 { b.min[a] } else { b.max[a] });
        all.with_point(transform(m, p))
    })
}

#[test]
fn bounds_hold_all_of_an_instance() {
    let mut rng = Rng::new(31);
    let few = |rng: &mut Rng, count| Mesh::soup(rng, count, 0.4);
    let mut meshes = vec![Mesh::blob(if cfg!(miri) { 5 } else { 40 })];
    meshes.extend([1, 9, 500].map(|count| few(&mut rng, amount(count))));
    for mesh in meshes {
        for quality in [Quality::Fast, Quality::High] {
            let blas = std::sync::Arc::new(Blas::triangles(&[mesh.geometry(0)], quality));
            for _ in 0..amount(300) {
                let m = any_transform(&mut rng);
                let (bounds, tight) = (bounds(&blas, m), tight(&mesh, &m));
                assert!(bounds.contains(&tight), "{m:?}: {bounds:?} around {tight:?}");
                let outer = of_box(&blas.bounds(), &m);
                for a in 0..3 {
                    let room = (bounds.min[a] - outer.min[a]).min(outer.max[a] - bounds.max[a]);
                    assert!(room > -1e-4, "{m:?}, axis {a}: {bounds:?} in {outer:?}");
                }
            }
        }
    }
}

#[test]
#[cfg_attr(miri, ignore = "a large mesh; what it is built by is in the other tests")]
fn turned_balls_have_bounds_close_to_them() {
    let mut rng = Rng::new(32);
    let mesh = Mesh::blob(60);
    let blas = std::sync::Arc::new(Blas::triangles(&[mesh.geometry(0)], Quality::Balanced));
    let turns: Vec<_> = (0..100).map(|_| turn(&mut rng)).collect();
    let areas = |of: &dyn Fn(&[[f32; 4]; 3]) -> Aabb| turns.iter().map(|m| of(m).half_area()).sum::<f32>();
    let least = areas(&|m| tight(&mesh, m));
    let made = areas(&|m| bounds(&blas, *m)) / least;
    let boxes = areas(&|m| of_box(&blas.bounds(), m)) / least;
    assert!(made < 1.4 && boxes > 2.0, "{made} and {boxes} times the least area");
}

/// What is not turned has the bounds that it always had.
#[test]
fn objects_that_are_not_turned_keep_their_box() {
    let mut rng = Rng::new(33);
    let mesh = Mesh::soup(&mut rng, amount(400), 0.3);
    let blas = std::sync::Arc::new(Blas::triangles(&[mesh.geometry(0)], Quality::Balanced));
    let m = [[0.0, 2.0, 0.0, 3.0], [0.0, 0.0, -0.5, 1.0], [1.0, 0.0, 0.0, 0.0]];
    let (made, expected) = (bounds(&blas, m), of_box(&blas.bounds(), &m));
    for a in 0..3 {
        let off = (made.min[a] - expected.min[a]).abs().max((made.max[a] - expected.max[a]).abs());
        assert!(off < 2e-5, "axis {a}: {made:?} instead of {expected:?}");
    }
}

#[test]
fn bounds_follow_a_refit() {
    let mut rng = Rng::new(34);
    let mut mesh = Mesh::soup(&mut rng, amount(300), 0.3);
    let mut blas = Blas::triangles(&[mesh.geometry(0)], Quality::Balanced);
    for p in &mut mesh.positions {
        *p = [3.0 * p[0], p[1] + 2.0, -p[2]];
    }
    blas.refit(&[mesh.geometry(0)]);
    let blas = std::sync::Arc::new(blas);
    for _ in 0..amount(100) {
        let m = turn(&mut rng);
        let (bounds, tight) = (bounds(&blas, m), tight(&mesh, &m));
        assert!(bounds.contains(&tight), "{m:?}: {bounds:?} around {tight:?}");
    }
}

/// On GPUs, too, nobody enters a turned ball who passes it by.
#[test]
#[cfg_attr(miri, ignore = "a large mesh; what it is built by is in the other tests")]
fn encoded_balls_are_not_entered_at_their_corners() {
    let mut rng = Rng::new(35);
    let mesh = Mesh::blob(60);
    let unturned = tight(&mesh, &Instance::IDENTITY);
    let mut passed = 0;
    for _ in 0..20 {
        let m = turn(&mut rng);
        let instance = Instance { object_to_world: m, ..Instance::identity(0) };
        let object = Object::Triangles(vec![mesh.geometry(0)]);
        let scene = EncodedScene::build(&[object], &[instance], Quality::Balanced);
        let (ball, outer) = (tight(&mesh, &m), of_box(&unturned, &m));
        let center = |a: usize| 0.5 * (ball.min[a] + ball.max[a]);
        let entered = |x: f32| {
            let mut counts = TraversalCounts::default();
            let ray = Ray::new([x, -5.0, center(2)], [0.0, 1.0, 0.0]);
            let _ = scene.closest(&ray, |_| true, &mut counts);
            counts.instances
        };
        assert_eq!(entered(center(0)), 1);
        let beside = ball.max[0] + 0.12 * (ball.max[0] - ball.min[0]);
        if beside < outer.max[0] {
            assert_eq!(entered(beside), 0, "{m:?}");
            passed += 1;
        }
    }
    assert!(passed > 5, "only {passed} rays were between ball and box");
}

/// Near the largest numbers, sums over boxes overflow where those over the bounds do not. Then only
/// the latter count.
#[test]
fn what_overflows_does_not_hide_an_instance() {
    let mut mesh = Mesh::soup(&mut Rng::new(36), 60, 0.1);
    for p in &mut mesh.positions {
        *p = [2.0 + 0.1 * p[0], 2.0 + 0.1 * p[1], p[2]];
    }
    let blas = std::sync::Arc::new(Blas::triangles(&[mesh.geometry(0)], Quality::Balanced));
    // Sums of up to 4.4e38, which the translation brings back into range.
    let m = [[1e38, 1e38, 0.0, -3e38], [-1e38, 1e38, 0.0, 0.0], [0.0, 0.0, 1e38, 0.0]];
    let tlas = Tlas::build(&[Instance { object_to_world: m, ..Instance::identity(0) }], vec![blas]);
    assert_eq!(tlas.skipped_instances(), 0);
    let along = |p: &[f32; 3]| 1e38 * f64::from(p[0]) + 1e38 * f64::from(p[1]) - 3e38;
    let bounds = tlas.bounds();
    let inside = |x: f64| f64::from(bounds.min[0]) <= x && x <= f64::from(bounds.max[0]);
    assert!(mesh.positions.iter().all(|p| inside(along(p))), "{bounds:?}");
}
