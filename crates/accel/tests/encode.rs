//! The encoding for the GPU, walked by its scalar twin, against a loop over all primitives.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

mod support;

use accel::encode::{EncodedHit, EncodedScene, OWNER_SPHERE, Object, SphereGeometry, TraversalCounts};
use accel::{Hit, Instance, MISS, Opaque, Quality, Ray, Sphere};
use proptest::prelude::*;
use support::{Everything, Mesh, Rng, amount, random_rays, same_hit, transform};

fn as_hit(hit: Option<EncodedHit>) -> Hit {
    hit.map_or(MISS, |h| Hit { t: h.t, u: h.u, v: h.v, primitive: h.primitive, instance: h.instance })
}

fn encoded(mesh: &Mesh) -> EncodedScene {
    let object = Object::Triangles(vec![mesh.geometry(0)]);
    EncodedScene::build(&[object], &[Instance::identity(0)], Quality::Balanced)
}

/// Counts the rays for which the walk and the loop differ.
fn differences(scene: &EncodedScene, all: &Everything, rays: &[Ray]) -> usize {
    let mut counts = TraversalCounts::default();
    let mut differ = 0;
    for ray in rays {
        let expected = all.closest(ray, &Opaque);
        let hit = as_hit(scene.closest(ray, |_| true, &mut counts));
        let any = scene.any(ray, |_| true, &mut counts);
        differ += usize::from(!same_hit(&expected, &hit) || any == hit.is_miss());
    }
    assert!(counts.stack <= scene.stack_size(), "{counts:?} of {}", scene.stack_size());
    differ
}

fn check(scene: &EncodedScene, all: &Everything, rays: &[Ray]) {
    let differ = differences(scene, all, rays);
    assert!(differ * 1000 <= rays.len(), "{differ} of {} rays differ", rays.len());
}

fn everything(mesh: &Mesh) -> Everything {
    let mut all = Everything::default();
    all.add_mesh(0, 0, mesh, &Instance::IDENTITY);
    all
}

#[test]
fn one_mesh() {
    let mut rng = Rng::new(1);
    for count in [1, 2, 3, 4, 30, 3000] {
        let mesh = Mesh::soup(&mut rng, amount(count), 0.2);
        check(&encoded(&mesh), &everything(&mesh), &random_rays(&mut rng, amount(2000), 2.0));
    }
}

#[test]
#[should_panic(expected = "rays differ")]
fn a_lost_triangle_is_noticed() {
    let mut rng = Rng::new(2);
    let mesh = Mesh::soup(&mut rng, 50, 0.5);
    let mut scene = encoded(&mesh);
    for p in &mut scene.primitives {
        if p.primitive < 5 {
            p.b = p.a;
        }
    }
    check(&scene, &everything(&mesh), &random_rays(&mut rng, 2000, 2.0));
}

/// A scene of two meshes in one object, spheres in another, and instances of both; joined if they
/// have no more than `most_joined` primitives.
fn instances(rng: &mut Rng, most_joined: usize) -> (EncodedScene, Everything) {
    let meshes = [Mesh::soup(rng, 200, 0.2), Mesh::blob(12)];
    let first = [0, meshes[0].indices.len() as u32];
    let spheres: Vec<Sphere> =
        (0..40).map(|_| Sphere { center: rng.point(), radius: 0.05 + 0.1 * rng.signed().abs() }).collect();
    let objects = [
        Object::Triangles(vec![meshes[0].geometry(first[0]), meshes[1].geometry(first[1])]),
        Object::Spheres(vec![
            SphereGeometry { spheres: &spheres[..15], first_id: 0 },
            SphereGeometry { spheres: &spheres[15..], first_id: 15 },
        ]),
    ];
    let mut placed = vec![Instance::identity(0), Instance::identity(1)];
    let mut all = Everything::default();
    for (i, mesh) in meshes.iter().enumerate() {
        all.add_mesh(0, first[i], mesh, &Instance::IDENTITY);
    }
    all.spheres.extend((0..).zip(&spheres).map(|(i, s)| (1, i, *s)));
    for number in 2..40 {
        let mut m = Instance::IDENTITY;
        for row in &mut m {
            row[3] = 3.0 * rng.signed();
            (0..3).for_each(|c| row[c] += 0.2 * rng.signed());
        }
        placed.push(Instance { object_to_world: m, ..Instance::identity(0) });
        for (i, mesh) in meshes.iter().enumerate() {
            all.add_mesh(number, first[i], mesh, &m);
        }
    }
    // Spheres of half the size, turned about z by the angle of the triangle 3, 4, 5, and moved.
    let turned = [[0.3, -0.4, 0.0, 1.0], [0.4, 0.3, 0.0, -2.0], [0.0, 0.0, 0.5, 0.5]];
    placed.push(Instance { object_to_world: turned, ..Instance::identity(1) });
    all.spheres.extend((0..).zip(&spheres).map(|(i, s)| {
        let world = Sphere { center: transform(&turned, s.center), radius: 0.5 * s.radius };
        (40, i, world)
    }));
    (EncodedScene::build_flattened(&objects, &placed, Quality::Balanced, most_joined), all)
}

/// Far more than there is to join.
const ALL: usize = usize::MAX;

#[test]
fn instances_of_meshes_and_spheres() {
    let mut rng = Rng::new(3);
    let (scene, all) = instances(&mut rng, 0);
    assert_eq!(scene.kinds(), (true, true));
    assert!(!scene.is_single() && !scene.is_flattened());
    check(&scene, &all, &random_rays(&mut rng, amount(2000), 3.0));
}

#[test]
fn instances_that_stand_still_are_one_object() {
    let mut rng = Rng::new(3);
    let (scene, all) = instances(&mut rng, ALL);
    assert_eq!(scene.kinds(), (true, true));
    assert!(scene.is_single() && scene.is_flattened());
    let rays = random_rays(&mut rng, amount(2000), 3.0);
    check(&scene, &all, &rays);
    let nodes = |scene: &EncodedScene| {
        let mut counts = TraversalCounts::default();
        for ray in &rays {
            scene.closest(ray, |_| true, &mut counts);
        }
        counts.nodes
    };
    let (joined, apart) = (nodes(&scene), nodes(&instances(&mut Rng::new(3), 0).0));
    assert!(10 * joined < 8 * apart, "{joined} and {apart}");
}

#[test]
fn what_cannot_be_joined_stays_apart() {
    let spheres = [Sphere { center: [0.0; 3], radius: 1.0 }];
    let mesh = Mesh::blob(4);
    let triangles = || Object::Triangles(vec![mesh.geometry(0)]);
    let ball = || Object::Spheres(vec![SphereGeometry { spheres: &spheres, first_id: 0 }]);
    let scaled = |blas, x: f32, y: f32| {
        let m = [[x, 0.0, 0.0, 3.0], [0.0, y, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
        Instance { object_to_world: m, ..Instance::identity(blas) }
    };
    let unseen = Instance { mask: 0, ..scaled(0, 1.0, 1.0) };
    let count = mesh.indices.len();
    for (name, objects, instances, most, joined) in [
        ("two", vec![triangles()], vec![Instance::identity(0), scaled(0, 2.0, 1.0)], 2 * count, true),
        (
            "two, of which one is too many",
            vec![triangles()],
            vec![Instance::identity(0); 2],
            2 * count - 1,
            false,
        ),
        ("one at home", vec![triangles()], vec![Instance::identity(0)], ALL, false),
        (
            "one at home, and one that nobody sees",
            vec![triangles()],
            vec![Instance::identity(0), unseen],
            ALL,
            false,
        ),
        ("one elsewhere", vec![triangles()], vec![scaled(0, 1.0, -1.0)], ALL, true),
        ("none", vec![triangles()], vec![unseen], ALL, false),
        ("a sphere elsewhere", vec![ball()], vec![scaled(0, 1.0, -1.0)], ALL, true),
        (
            "an ellipsoid",
            vec![triangles(), ball()],
            vec![Instance::identity(0), scaled(1, 2.0, 1.0)],
            ALL,
            false,
        ),
    ] {
        let scene = EncodedScene::build_flattened(&objects, &instances, Quality::Balanced, most);
        assert_eq!(scene.is_flattened(), joined, "{name}");
        assert!(scene.is_single() || !joined, "{name}");
    }
}

#[test]
fn geometries_have_their_numbers() {
    for most_joined in [0, ALL] {
        let (scene, _) = instances(&mut Rng::new(3), most_joined);
        for p in &scene.primitives {
            let is_sphere = p.c == [0.0; 3];
            let first_of_second = if is_sphere { 15 } else { 200 };
            assert_eq!(p.geometry, u32::from(p.primitive >= first_of_second), "{p:?}");
            assert_eq!(p.owner & OWNER_SPHERE != 0, is_sphere && scene.is_flattened(), "{p:?}");
        }
    }
}

#[test]
fn candidates_can_be_refused() {
    struct Odd;
    impl accel::HitFilter for Odd {
        const OPAQUE: bool = false;
        fn accept(&self, c: &accel::Candidate) -> bool {
            (c.instance + c.primitive) % 2 == 1
        }
    }
    let accept = |h: &EncodedHit| (h.instance + h.primitive) % 2 == 1;
    for most_joined in [0, ALL] {
        let mut rng = Rng::new(4);
        let (scene, all) = instances(&mut rng, most_joined);
        let rays = random_rays(&mut rng, amount(2000), 3.0);
        let mut counts = TraversalCounts::default();
        let differ = rays.iter().filter(|ray| {
            let expected = all.closest(ray, &Odd);
            !same_hit(&expected, &as_hit(scene.closest(ray, accept, &mut counts)))
                || scene.any(ray, accept, &mut counts) == expected.is_miss()
        });
        let differ = differ.count();
        assert!(differ * 1000 <= rays.len(), "{differ} of {} rays differ", rays.len());
    }
}

/// A blob of small triangles with long, slanted ones about it.
fn blob_with_blades(rng: &mut Rng) -> Mesh {
    let mut mesh = Mesh::blob(12);
    for _ in 0..60 {
        let (first, p) = (mesh.positions.len() as u32, rng.point());
        let far = [0, 1, 2].map(|a: usize| -p[a]);
        let beside = [far[0] + 0.02, far[1], far[2] + 0.02];
        mesh.positions.extend([p, far, beside]);
        mesh.indices.push([first, first + 1, first + 2]);
    }
    mesh
}

#[test]
fn large_slanted_triangles_are_cut() {
    let mut rng = Rng::new(8);
    let mesh = blob_with_blades(&mut rng);
    let cut = encoded(&mesh);
    let object = Object::Triangles(vec![mesh.geometry(0)]);
    let whole = EncodedScene::build(&[object], &[Instance::identity(0)], Quality::Fast);
    assert_eq!(whole.primitives.len(), mesh.indices.len());
    assert!(cut.primitives.len() > mesh.indices.len() + 30, "{}", cut.primitives.len());
    assert!(cut.primitives.len() <= 2 * mesh.indices.len());
    let rays = random_rays(&mut rng, amount(2000), 2.0);
    check(&cut, &everything(&mesh), &rays);
    let tests = |scene: &EncodedScene| {
        let mut counts = TraversalCounts::default();
        for ray in &rays {
            scene.closest(ray, |_| true, &mut counts);
        }
        counts.primitives
    };
    let (tests_cut, tests_whole) = (tests(&cut), tests(&whole));
    assert!(5 * tests_cut < 3 * tests_whole, "{tests_cut} and {tests_whole}");
}

#[test]
fn triangles_that_are_alike_stay_whole() {
    let mesh = Mesh::blob(30);
    assert_eq!(encoded(&mesh).primitives.len(), mesh.indices.len());
    let few = Mesh { positions: mesh.positions.clone(), indices: mesh.indices[..40].to_vec() };
    assert_eq!(encoded(&few).primitives.len(), 40);
}

#[test]
fn moved_instances() {
    let mut rng = Rng::new(5);
    let mesh = Mesh::blob(10);
    let object = || Object::Triangles(vec![mesh.geometry(0)]);
    let at = |x: f32| {
        let mut m = Instance::IDENTITY;
        m[0][3] = x;
        Instance { object_to_world: m, ..Instance::identity(0) }
    };
    let mut scene = EncodedScene::build(&[object()], &[at(-1.0), at(1.0)], Quality::Balanced);
    let moved = [at(-0.3), at(0.8)];
    let changed = scene.update(&moved);
    assert!((1..=2).contains(&changed));
    let mut all = Everything::default();
    (0..).zip(&moved).for_each(|(i, m)| all.add_mesh(i, 0, &mesh, &m.object_to_world));
    check(&scene, &all, &random_rays(&mut rng, amount(2000), 3.0));
    // Alone and at home, an instance needs no upper level.
    scene.update(&[Instance::identity(0)]);
    assert!(scene.is_single());
    check(&scene, &everything(&mesh), &random_rays(&mut rng, amount(2000), 3.0));
}

#[test]
fn nothing_is_never_hit() {
    let ray = Ray::new([0.0; 3], [0.0, 0.0, 1.0]);
    let flat = Instance { object_to_world: [[0.0; 4]; 3], ..Instance::identity(0) };
    let unseen = Instance { mask: 0, ..Instance::identity(0) };
    let mesh = Mesh { positions: vec![[0.0; 3]], indices: vec![[0, 0, 0], [0, 1, 2]] };
    let some = Mesh::blob(4);
    let empty = Object::Triangles(vec![mesh.geometry(0)]);
    let full = Object::Triangles(vec![some.geometry(0)]);
    for (objects, instances, skipped) in [
        (vec![], vec![], 0),
        (vec![Object::Spheres(vec![])], vec![Instance::identity(0)], 0),
        (vec![empty], vec![Instance::identity(0); 3], 2),
        (vec![full], vec![flat, unseen], 0),
    ] {
        let scene = EncodedScene::build(&objects, &instances, Quality::Balanced);
        assert!(scene.is_empty());
        assert_eq!(scene.skipped_primitives(), skipped);
        assert_eq!(scene.closest(&ray, |_| true, &mut TraversalCounts::default()), None);
    }
    let scene = encoded(&some);
    for bad in [f32::NAN, f32::INFINITY] {
        let broken = Ray { origin: [bad, 0.0, 0.0], ..ray };
        assert_eq!(scene.closest(&broken, |_| true, &mut TraversalCounts::default()), None);
    }
}

#[test]
fn identical_triangles() {
    let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let mesh = Mesh { positions: positions.to_vec(), indices: vec![[0, 1, 2]; 10_000] };
    let scene = encoded(&mesh);
    let mut counts = TraversalCounts::default();
    let hit = scene.closest(&Ray::new([0.25, 0.25, 1.0], [0.0, 0.0, -1.0]), |_| true, &mut counts);
    assert!(hit.is_some_and(|h| (h.t - 1.0).abs() < 1e-6));
    assert!(counts.stack <= scene.stack_size());
    assert!(!scene.any(&Ray::new([0.75, 0.75, 1.0], [0.0, 0.0, -1.0]), |_| true, &mut counts));
}

#[test]
fn sizes_from_tiny_to_huge() {
    // Each triangle is twice as large as the one before, from 1e-12 to 1e12 and in all directions.
    let mut mesh = Mesh::default();
    for i in 0..80u32 {
        let s = 1e-12 * 2.0f32.powi(i as i32);
        let z = s * if i % 2 == 0 { 1.0 } else { -1.0 };
        mesh.positions.extend([[-s, -s, z], [s, -s, z], [0.0, s, z]]);
        mesh.indices.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    let scene = encoded(&mesh);
    let all = everything(&mesh);
    let mut rng = Rng::new(6);
    for scale in [1e-10f32, 1e-5, 1.0, 1e5, 1e10] {
        let rays: Vec<Ray> = random_rays(&mut rng, amount(500), 1.0)
            .into_iter()
            .map(|r| Ray {
                origin: r.origin.map(|x| x * scale),
                direction: r.direction.map(|x| x * scale),
                ..r
            })
            .collect();
        check(&scene, &all, &rays);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// A mesh far from the origin is as exact as its coordinates are, and no box may hide a
    /// triangle that is hit.
    #[test]
    fn no_box_hides_a_triangle(seed in any::<u64>(), log_ratio in -3.0f32..3.0, log_size in -3.0f32..3.0) {
        let mut rng = Rng::new(seed);
        let size = 10f32.powf(log_size);
        let offset = size * 10f32.powf(log_ratio);
        let mut mesh = Mesh::soup(&mut rng, 60, 0.4);
        let place = |p: [f32; 3]| [p[0] * size + offset, p[1] * size - offset, p[2] * size];
        mesh.positions.iter_mut().for_each(|p| *p = place(*p));
        let rays: Vec<Ray> = random_rays(&mut rng, 200, 3.0)
            .into_iter()
            .map(|r| Ray { origin: place(r.origin), direction: r.direction.map(|x| x * size), ..r })
            .collect();
        prop_assert_eq!(differences(&encoded(&mesh), &everything(&mesh), &rays), 0);
    }
}
