//! Every shape is checked for what it promises.

use super::*;
use glam::{Vec2, Vec3};
use std::collections::HashMap;

/// A position as bits, with both zeros made equal.
fn key(p: Vec3) -> [u32; 3] {
    (p + Vec3::ZERO).to_array().map(|x| if x == 0.0 { 0 } else { x.to_bits() })
}

/// How often each directed edge occurs, by position.
fn edges(mesh: &TriangleMesh) -> HashMap<([u32; 3], [u32; 3]), i32> {
    let mut edges = HashMap::new();
    for t in &mesh.indices {
        let p = t.map(|i| key(mesh.positions[i as usize]));
        for k in 0..3 {
            *edges.entry((p[k], p[(k + 1) % 3])).or_default() += 1;
        }
    }
    edges
}

/// Whether every directed edge has its partner in the other direction.
fn is_watertight(mesh: &TriangleMesh) -> bool {
    let edges = edges(mesh);
    edges.iter().all(|((a, b), n)| edges.get(&(*b, *a)) == Some(n))
}

fn volume(mesh: &TriangleMesh) -> f32 {
    let signed = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        a.dot(b.cross(c)) / 6.0
    };
    mesh.indices.iter().map(signed).sum()
}

/// Attributes are complete and finite, indices in range, normals unit and on the front side of their triangles.
fn check(name: &str, mesh: &TriangleMesh) {
    assert!(!mesh.indices.is_empty(), "{name}: no triangles");
    let count = mesh.positions.len();
    assert!(mesh.normals.len() == count && mesh.uv0.len() == count, "{name}: attributes are incomplete");
    assert!(mesh.positions.iter().all(|p| p.is_finite()), "{name}: positions are not finite");
    assert!(mesh.uv0.iter().all(|p| p.is_finite()), "{name}: texture coordinates are not finite");
    assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-4), "{name}: normals are not unit");
    let mut wrong = 0;
    for t in &mesh.indices {
        assert!(t.iter().all(|i| (*i as usize) < count), "{name}: index out of range");
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        let face = (b - a).cross(c - a).normalize_or_zero();
        wrong += t.iter().filter(|i| mesh.normals[**i as usize].dot(face) < -0.05).count();
    }
    let share = wrong as f32 / (3 * mesh.indices.len()) as f32;
    assert!(share == 0.0, "{name}: {:.2} % of the normals are behind their triangle", share * 100.0);
}

/// Shapes that are closed, with the volume that they should have, where it is simple to tell.
fn closed_shapes() -> Vec<(&'static str, TriangleMesh, Option<f32>)> {
    use std::f32::consts::PI;
    let arch_panel = Arch {
        size: Vec3::new(3.0, 4.0, 0.5),
        opening: 2.0,
        spring: 2.0,
        rise: 1.0,
        segments: 64,
        moulding: 0.0,
    };
    let opening = 2.0 * 2.0 + PI / 2.0;
    let ball = Blob { radius: 1.0, level: 4, amplitude: 0.2, detail: 0.4, seed: 7 };
    let pillar = Column { height: 4.0, radius: 0.3, flutes: 20, segments: 160 };
    vec![
        ("box", cuboid(Vec3::new(1.0, 2.0, 3.0), 0.0, 1), Some(6.0)),
        ("rounded box", cuboid(Vec3::new(1.0, 2.0, 3.0), 0.1, 3), None),
        ("pill", cuboid(Vec3::new(1.0, 1.0, 1.0), 0.5, 16), Some(PI / 6.0)),
        ("uv sphere", uv_sphere(2.0, 96, 48), Some(4.0 / 3.0 * PI * 8.0)),
        ("icosphere", icosphere(2.0, 5), Some(4.0 / 3.0 * PI * 8.0)),
        ("cylinder", cylinder(1.0, 1.0, 2.0, 128), Some(2.0 * PI)),
        ("cone", cylinder(1.0, 0.0, 3.0, 128), Some(PI)),
        ("torus", torus(2.0, 0.5, 96, 48), Some(2.0 * PI * PI * 2.0 * 0.25)),
        ("knot", knot(2, 3, 1.0, 0.2, 256, 24), None),
        ("open tube", tube(&[Vec3::ZERO, Vec3::Y, Vec3::new(0.0, 2.0, 0.0)], false, 0.5, 64), Some(PI * 0.5)),
        ("blob", blob(&ball), None),
        ("arch", arch(&arch_panel), Some((3.0 * 4.0 - opening) * 0.5)),
        ("arch with moulding", arch(&Arch { moulding: 0.05, ..arch_panel }), None),
        ("column", column(&pillar), None),
        ("smooth column", column(&Column { flutes: 0, ..pillar }), None),
        ("baluster", baluster(0.9, 0.1, 24), None),
    ]
}

#[test]
fn closed_shapes_are_watertight_and_turned_outwards() {
    for (name, mesh, expected) in closed_shapes() {
        check(name, &mesh);
        assert!(is_watertight(&mesh), "{name}: has open edges");
        let volume = volume(&mesh);
        assert!(volume > 0.0, "{name}: volume {volume}");
        if let Some(expected) = expected {
            assert!((volume / expected - 1.0).abs() < 0.01, "{name}: volume {volume}, expected {expected}");
        }
    }
}

#[test]
fn open_shapes_keep_their_promises() {
    let ground = Terrain {
        size: Vec2::splat(10.0),
        divisions: [64, 32],
        height: 1.0,
        feature: 3.0,
        roughness: 0.5,
        octaves: 6,
        seed: 1,
    };
    let cloth = Curtain {
        size: Vec2::new(2.0, 3.0),
        folds: 6.0,
        depth: 0.1,
        gather: 0.5,
        divisions: [120, 60],
        seed: 3,
    };
    let vault = Coffers { size: Vec2::new(4.0, 8.0), rise: 2.0, count: [6, 10], depth: 0.1, segments: 3 };
    check("rectangle", &rectangle(Vec2::new(2.0, 3.0)));
    check("grid", &grid(Vec2::new(2.0, 3.0), [4, 5]));
    check("terrain", &terrain(&ground));
    check("curtain", &curtain(&cloth));
    check("vault", &coffers(&vault));
    check("flat ceiling", &coffers(&Coffers { rise: 0.0, ..vault }));
    check("quads", &quads(&[Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y]));
}

#[test]
fn a_hole_and_a_turned_triangle_are_noticed() {
    let mut mesh = cuboid(Vec3::ONE, 0.0, 1);
    mesh.indices[3].swap(0, 1);
    assert!(!is_watertight(&mesh));
    let mut mesh = cuboid(Vec3::ONE, 0.0, 1);
    mesh.indices.pop();
    assert!(!is_watertight(&mesh));
}

#[test]
#[should_panic(expected = "behind their triangle")]
fn wrong_normals_are_noticed() {
    let mut mesh = cuboid(Vec3::ONE, 0.0, 1);
    mesh.normals[0] = -mesh.normals[0];
    check("box", &mesh);
}

#[test]
fn generated_shapes_depend_on_their_seed_only() {
    let b = Blob { radius: 1.0, level: 2, amplitude: 0.2, detail: 0.4, seed: 7 };
    assert_eq!(blob(&b).positions, blob(&b).positions);
    assert_ne!(blob(&b).positions, blob(&Blob { seed: 8, ..b }).positions);
}

#[test]
fn sizes_of_zero_do_not_panic() {
    cuboid(Vec3::ZERO, 1.0, 4);
    cylinder(0.0, 0.0, 0.0, 0);
    torus(0.0, 0.0, 0, 0);
    knot(0, 0, 0.0, 0.0, 0, 0);
    tube(&[Vec3::ZERO; 4], true, 1.0, 8);
    uv_sphere(0.0, 0, 0);
    grid(Vec2::ZERO, [0, 0]);
    arch(&Arch { size: Vec3::ZERO, opening: 0.0, spring: 0.0, rise: 0.0, segments: 0, moulding: 0.0 });
    column(&Column { height: 0.0, radius: 0.0, flutes: 0, segments: 0 });
    lathe(&Lathe::new(vec![], 3));
    coffers(&Coffers { size: Vec2::ZERO, rise: 0.0, count: [0, 0], depth: 0.0, segments: 0 });
}
