//! Subdivision surfaces against closed forms, and what must hold of any.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

use glam::{Affine3A, Vec2, Vec3, vec2, vec3};
use scene::subdivision::{
    Cage, CageReport, Displacement, DisplacementSpace, PixelScale, Rate, Refinement, Scheme, tessellate,
};
use scene::{
    Camera, ColorSpace, Image, Instance, LoadReport, Mesh, Pixels, Sampler, Scene, Shape, Texture,
    TextureRef, TriangleMesh, shapes,
};
use std::collections::HashMap;

/// A cage of faces with positions only.
fn cage(positions: Vec<Vec3>, faces: &[&[u32]]) -> Cage {
    let mut cage = Cage { positions, ..Cage::default() };
    for face in faces {
        cage.positions_of.extend_from_slice(face);
        cage.ends.push(cage.positions_of.len() as u32);
    }
    cage
}

/// A cube from −1 to 1.
fn cube() -> Cage {
    let sign = |bit: u32| if bit & 1 == 1 { 1.0 } else { -1.0 };
    let positions = (0..8u32).map(|i| vec3(sign(i), sign(i >> 1), sign(i >> 2))).collect();
    let faces: [&[u32]; 6] =
        [&[0, 4, 6, 2], &[1, 3, 7, 5], &[0, 1, 5, 4], &[2, 6, 7, 3], &[0, 2, 3, 1], &[4, 5, 7, 6]];
    cage(positions, &faces)
}

fn tetrahedron() -> Cage {
    let positions =
        vec![vec3(1.0, 1.0, 1.0), vec3(1.0, -1.0, -1.0), vec3(-1.0, 1.0, -1.0), vec3(-1.0, -1.0, 1.0)];
    cage(positions, &[&[0, 1, 2], &[0, 3, 1], &[0, 2, 3], &[1, 3, 2]])
}

/// A torus of `n` × `m` faces around y, quadrilaterals or triangles.
fn torus(n: u32, m: u32, triangles: bool) -> Cage {
    let point = |i: u32, j: u32| {
        let (a, b) =
            (i as f32 / n as f32 * std::f32::consts::TAU, j as f32 / m as f32 * std::f32::consts::TAU);
        let r = 2.0 + 0.8 * b.cos() + 0.2 * (2.0 * a).sin();
        vec3(r * a.cos(), 0.8 * b.sin(), r * a.sin())
    };
    let positions = (0..n * m).map(|k| point(k / m, k % m)).collect();
    let at = |i: u32, j: u32| (i % n) * m + j % m;
    let mut cage = cage(positions, &[]);
    for (i, j) in (0..n * m).map(|k| (k / m, k % m)) {
        let quad = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
        let faces: &[&[usize]] = if triangles { &[&[0, 1, 2], &[0, 2, 3]] } else { &[&[0, 1, 2, 3]] };
        for face in faces {
            cage.positions_of.extend(face.iter().map(|c| quad[*c]));
            cage.ends.push(cage.positions_of.len() as u32);
        }
    }
    cage
}

/// A square grid of `n` × `n` faces in the plane y = 0, with texture coordinates that are x and z.
fn grid(n: u32, triangles: bool) -> Cage {
    let at = |i: u32, j: u32| i * (n + 1) + j;
    let all = || (0..(n + 1) * (n + 1)).map(|k| vec2((k / (n + 1)) as f32, (k % (n + 1)) as f32));
    let mut cage = cage(all().map(|p| vec3(p.x, 0.0, p.y)).collect(), &[]);
    cage.uvs[0] = all().collect();
    for (i, j) in (0..n * n).map(|k| (k / n, k % n)) {
        let quad = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
        let faces: &[&[usize]] = if triangles { &[&[0, 1, 2], &[0, 2, 3]] } else { &[&[0, 1, 2, 3]] };
        for face in faces {
            cage.positions_of.extend(face.iter().map(|c| quad[*c]));
            cage.ends.push(cage.positions_of.len() as u32);
        }
    }
    cage.uvs_of[0] = cage.positions_of.clone();
    // Corners of one face are sharp by themselves; two of the grid have two triangles.
    cage.corners = [at(0, 0), at(n, n)].map(|corner| (corner, Cage::ENDLESS)).to_vec();
    cage
}

fn levels(cage: &Cage, scheme: Scheme, levels: u32) -> TriangleMesh {
    let mut made = tessellate(cage, scheme, Rate::Levels(levels), None).expect("few faces");
    assert_eq!(made.report, CageReport::default());
    made.parts.swap_remove(0)
}

/// The normals that a mesh has at a position; fails if it has no vertex there.
fn normals_at(mesh: &TriangleMesh, position: Vec3) -> Vec<Vec3> {
    let found: Vec<Vec3> = mesh
        .positions
        .iter()
        .zip(&mesh.normals)
        .filter(|(p, _)| p.distance(position) < 2e-6 * (1.0 + position.length()))
        .map(|(_, n)| *n)
        .collect();
    assert!(!found.is_empty(), "there is no vertex at {position}");
    found
}

/// How many directed edges of meshes, by the bits of their ends, have not exactly one edge that goes back.
fn open_edges(meshes: &[TriangleMesh]) -> usize {
    let bits = |p: Vec3| (p + Vec3::ZERO).to_array().map(f32::to_bits);
    let mut edges: HashMap<_, u32> = HashMap::new();
    for mesh in meshes {
        for t in &mesh.indices {
            for k in 0..3 {
                let [a, b] = [t[k], t[(k + 1) % 3]].map(|i| bits(mesh.positions[i as usize]));
                *edges.entry((a, b)).or_default() += 1;
            }
        }
    }
    edges.iter().filter(|((a, b), n)| **n != 1 || edges.get(&(*b, *a)) != Some(&1)).count()
}

#[test]
fn a_cube_has_its_known_limit() {
    for level in [0, 1, 2, 4] {
        let mesh = levels(&cube(), Scheme::CatmullClark, level);
        assert_eq!(mesh.indices.len(), 12 << (2 * level));
        assert_eq!(open_edges(std::slice::from_ref(&mesh)), 0);
        // (n² v + 4 Σ e + Σ d) / (n (n + 5)) = (9 + 4 − 1) / 24.
        let normal = normals_at(&mesh, Vec3::splat(0.5));
        assert!(normal.len() == 1 && normal[0].distance(Vec3::splat(1.0 / 3f32.sqrt())) < 1e-6, "{normal:?}");
        if level > 0 {
            // The middle of a face: (16 · 1 + 4 · 3 + 20/9) / 36.
            let normal = normals_at(&mesh, vec3(0.0, 0.0, (28.0 + 20.0 / 9.0) / 36.0));
            assert!(normal[0].distance(Vec3::Z) < 1e-6, "{normal:?}");
        }
    }
}

#[test]
fn a_tetrahedron_has_its_known_limit() {
    for level in [0, 1, 3] {
        let mesh = levels(&tetrahedron(), Scheme::Loop, level);
        assert_eq!(mesh.indices.len(), 4 << (2 * level));
        assert_eq!(open_edges(std::slice::from_ref(&mesh)), 0);
        for v in tetrahedron().positions {
            // A weight of 1/5 for each neighbour; they sum to −v.
            let normal = normals_at(&mesh, v / 5.0)[0];
            assert!(normal.distance(v.normalize()) < 1e-6, "{normal}");
        }
    }
}

#[test]
fn regular_meshes_are_bicubic_splines() {
    let (n, m, level) = (6u32, 5u32, 2);
    let cage = torus(n, m, false);
    let mesh = levels(&cage, Scheme::CatmullClark, level);
    // Weights of four neighbours at a fraction of a cell, and their derivatives.
    let weights = |t: f32| {
        let s = 1.0 - t;
        let value = [
            s * s * s / 6.0,
            (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0,
            (3.0 * s * s * s - 6.0 * s * s + 4.0) / 6.0,
            t * t * t / 6.0,
        ];
        let slope =
            [-0.5 * s * s, 0.5 * (3.0 * t * t - 4.0 * t), -0.5 * (3.0 * s * s - 4.0 * s), 0.5 * t * t];
        (value, slope)
    };
    let fine = 1 << level;
    for (x, y) in (0..n * fine * m * fine).map(|k| (k / (m * fine), k % (m * fine))) {
        let (u, du) = weights((x % fine) as f32 / fine as f32);
        let (v, dv) = weights((y % fine) as f32 / fine as f32);
        let (mut point, mut along, mut across) = (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
        for (i, j) in (0..16usize).map(|k| (k / 4, k % 4)) {
            let (row, column) = ((x / fine + n - 1 + i as u32) % n, (y / fine + m - 1 + j as u32) % m);
            let p = cage.positions[(row * m + column) as usize];
            point += p * u[i] * v[j];
            along += p * du[i] * v[j];
            across += p * u[i] * dv[j];
        }
        let normal = normals_at(&mesh, point)[0];
        assert!(normal.distance(across.cross(along).normalize()) < 1e-5, "{point}: {normal}");
    }
}

#[test]
fn planes_reproduce_themselves_with_their_coordinates() {
    for (scheme, triangles) in
        [(Scheme::CatmullClark, false), (Scheme::Loop, true), (Scheme::Linear, false), (Scheme::Linear, true)]
    {
        let mesh = levels(&grid(3, triangles), scheme, 3);
        assert_eq!(mesh.positions.len(), 25 * 25);
        for ((p, n), uv) in mesh.positions.iter().zip(&mesh.normals).zip(&mesh.uv0) {
            assert!(p.y == 0.0 && n.distance(Vec3::Y) < 1e-5, "{scheme:?} {p} {n}");
            assert!(uv.distance(vec2(p.x, p.z)) < 1e-5, "{scheme:?} {p} {uv}");
            assert!((p.x * 8.0 - (p.x * 8.0).round()).abs() < 1e-4, "{scheme:?} {p}");
        }
    }
}

#[test]
fn borders_and_creases_are_cubic_splines() {
    // The edges of the upper face of a cube: (e₁ + 4 v + e₂) / 6 on the square.
    let mut creased = cube();
    creased.creases = [[2, 6], [6, 7], [7, 3], [3, 2]].map(|edge| (edge, 10.0)).to_vec();
    let closed = levels(&creased, Scheme::CatmullClark, 3);
    assert_eq!(open_edges(std::slice::from_ref(&closed)), 0);
    let corner = vec3(2.0 / 3.0, 1.0, 2.0 / 3.0);
    let normals = normals_at(&closed, corner);
    assert_eq!(normals.len(), 2, "one on each side: {normals:?}");
    assert!(normals.iter().any(|n| n.distance(Vec3::Y) < 1e-5), "{normals:?}");
    // Without the upper face, the same curve is a border.
    let faces: [&[u32]; 5] = [&[0, 4, 6, 2], &[1, 3, 7, 5], &[0, 1, 5, 4], &[0, 2, 3, 1], &[4, 5, 7, 6]];
    let open = levels(&cage(cube().positions, &faces), Scheme::CatmullClark, 3);
    let side = normals_at(&open, corner)[0];
    assert!(normals.iter().any(|n| n.distance(side) < 1e-5), "{normals:?} {side}");
    let on_top = |mesh: &TriangleMesh| mesh.positions.iter().filter(|p| (p.y - 1.0).abs() < 1e-6).count();
    assert_eq!(on_top(&open), 4 * 8);
}

#[test]
fn sharp_edges_stay_and_semi_sharp_ones_do_not() {
    let edges =
        [[0, 4], [4, 6], [6, 2], [2, 0], [1, 3], [3, 7], [7, 5], [5, 1], [0, 1], [4, 5], [6, 7], [2, 3]];
    let mut sharp = cube();
    sharp.creases = edges.map(|edge| (edge, Cage::ENDLESS)).to_vec();
    let mesh = levels(&sharp, Scheme::CatmullClark, 2);
    for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
        assert!((p.abs().max_element() - 1.0).abs() < 1e-6, "{p}");
        assert!((n.abs().max_element() - 1.0).abs() < 1e-6 && p.dot(*n) > 0.999, "{p} {n}");
    }
    assert_eq!(normals_at(&mesh, Vec3::ONE).len(), 3);
    // Sharpness lets the corner go outwards, and more levels than sharpness do not move it.
    let corner = |sharpness: f32, level: u32| {
        let mut cage = cube();
        cage.creases = edges.map(|edge| (edge, sharpness)).to_vec();
        let mesh = levels(&cage, Scheme::CatmullClark, level);
        mesh.positions.iter().map(|p| p.dot(Vec3::ONE) / 3.0).fold(0.0, f32::max)
    };
    let found = [0.0, 0.5, 1.0, 1.5, 2.0].map(|s| corner(s, 3));
    assert!(found.is_sorted() && (found[0] - 0.5).abs() < 1e-6 && found[4] < 1.0, "{found:?}");
    for sharpness in [0.5, 1.0, 1.5] {
        assert!((corner(sharpness, 3) - corner(sharpness, 5)).abs() < 1e-6, "{sharpness}");
    }
}

#[test]
fn vertices_can_be_corners() {
    let mut cage = cube();
    cage.corners = vec![(7, Cage::ENDLESS), (0, 1.0)];
    let mesh = levels(&cage, Scheme::CatmullClark, 3);
    normals_at(&mesh, Vec3::ONE);
    let farthest = mesh.positions.iter().map(|p| -p.dot(Vec3::ONE) / 3.0).fold(0.0, f32::max);
    assert!(farthest > 0.51 && farthest < 0.99, "{farthest}");
}

#[test]
fn coordinates_have_seams_and_surfaces_do_not() {
    // Each side of the cube is a whole texture.
    let mut cage = cube();
    cage.uvs[0] = vec![vec2(0.0, 0.0), vec2(1.0, 0.0), vec2(1.0, 1.0), vec2(0.0, 1.0)];
    cage.uvs_of[0] = (0..24).map(|c| c % 4).collect();
    let mesh = levels(&cage, Scheme::CatmullClark, 2);
    assert_eq!(open_edges(std::slice::from_ref(&mesh)), 0);
    assert_eq!(normals_at(&mesh, Vec3::splat(0.5)).len(), 3, "three coordinates at a corner");
    let (low, high) = mesh.uv0.iter().fold((Vec2::ONE, Vec2::ZERO), |(l, h), uv| (l.min(*uv), h.max(*uv)));
    assert_eq!((low, high), (Vec2::ZERO, Vec2::ONE));
    // A side alone is a chart of one face, whose corners are sharp: its coordinates are a regular grid.
    assert!(mesh.uv0.iter().all(|uv| (*uv * 4.0 - (*uv * 4.0).round()).length() < 1e-5));
}

/// A camera that sees the torus from nearby.
fn near_the_torus() -> Camera {
    Camera::perspective("near", vec3(3.6, 0.6, 0.0), vec3(2.0, 0.0, 0.0), 0.9)
}

#[test]
fn edges_are_as_long_in_pixels_as_asked_and_nothing_cracks() {
    let camera = near_the_torus();
    let bounds = [Vec3::splat(-3.0), Vec3::splat(3.0)];
    let places = [Affine3A::IDENTITY, Affine3A::from_translation(vec3(0.0, 0.0, 9.0))];
    let scale = PixelScale::new(&camera, 480, &places, bounds);
    for (scheme, triangles) in [(Scheme::CatmullClark, false), (Scheme::Loop, true), (Scheme::Linear, true)] {
        let cage = torus(9, 6, triangles);
        let rate = Rate::Pixels { most: 12.0, levels: 8 };
        let made = tessellate(&cage, scheme, rate, Some(&scale)).expect("few faces");
        assert!(!made.is_coarse);
        assert_eq!(open_edges(&made.parts), 0, "{scheme:?}");
        let mesh = &made.parts[0];
        let mut longest: f32 = 0.0;
        let mut areas: Vec<f32> = Vec::new();
        for t in &mesh.indices {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            let mut sides = [scale.pixels(a, b), scale.pixels(b, c), scale.pixels(c, a)];
            sides.sort_by(f32::total_cmp);
            // The longest one may be a diagonal of a face.
            longest = longest.max(sides[1]).max(sides[2] / 1.5);
            areas.push((b - a).cross(c - a).length());
            let normal: Vec3 = t.iter().map(|i| mesh.normals[*i as usize]).sum();
            assert!((b - a).cross(c - a).dot(normal) > 0.0, "{scheme:?}: a triangle is turned round");
        }
        assert!(longest <= 12.0 && longest > 10.0, "{scheme:?}: {longest}");
        areas.sort_by(f32::total_cmp);
        assert!(areas[areas.len() - 1] > 8.0 * areas[areas.len() / 20], "{scheme:?}: all are as large");
        let uniform = levels(&cage, scheme, 7).indices.len();
        assert!(mesh.indices.len() < uniform / 8, "{scheme:?}: {} of {uniform}", mesh.indices.len());
    }
}

/// A scene of one mesh that is displaced by an image of one row.
fn displaced(cage: Cage, scheme: Scheme, rate: Rate, row: &[f32], space: DisplacementSpace) -> Scene {
    let pixels = Pixels::Rgb32F(row.iter().map(|v| [*v, 0.5 * v, 0.25 * v]).collect());
    let mut scene = Scene {
        images: vec![Image { name: "row".into(), width: row.len() as u32, height: 1, pixels }],
        textures: vec![Texture::image(0, Sampler::default(), ColorSpace::Linear)],
        meshes: vec![Mesh::single("m", Shape::Triangles(TriangleMesh::default()), 0)],
        instances: vec![Instance::new("m", 0, Affine3A::IDENTITY)],
        cameras: vec![near_the_torus()],
        ..Scene::default()
    };
    let texture = TextureRef::new(0);
    let displacement = Displacement { texture, scale: 0.5, midlevel: 0.25, space };
    scene.refinements = vec![Refinement { mesh: 0, cage, scheme, rate, displacement: Some(displacement) }];
    scene
}

fn refined(mut scene: Scene) -> (TriangleMesh, LoadReport) {
    let mut report = LoadReport::default();
    scene.refine(480, &mut report).expect("few faces");
    let Shape::Triangles(mesh) = scene.meshes.remove(0).parts.remove(0).shape else { panic!("triangles") };
    (mesh, report)
}

#[test]
fn displacement_moves_along_the_normal_of_the_limit() {
    for (scheme, triangles) in [(Scheme::CatmullClark, false), (Scheme::Loop, true)] {
        let cage = torus(8, 6, triangles);
        let rate = Rate::Levels(2);
        let plain = levels(&cage, scheme, 2);
        let scene = displaced(cage, scheme, rate, &[0.45], DisplacementSpace::Normal);
        let (moved, _) = refined(scene);
        assert_eq!(moved.indices.len(), plain.indices.len());
        for ((p, n), q) in plain.positions.iter().zip(&plain.normals).zip(&moved.positions) {
            assert!(q.distance(*p + 0.1 * *n) < 1e-5, "{p} {q}");
        }
        // The surface at a distance has about the same normals.
        let differ =
            plain.normals.iter().zip(&moved.normals).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
        assert!(differ > 1e-4 && differ < 0.1, "{differ}");
    }
}

#[test]
fn vectors_are_in_the_space_of_the_object_or_of_the_surface() {
    let offset = 0.5 * (vec3(1.0, 0.5, 0.25) - 0.25);
    let (mesh, _) = refined(displaced(
        grid(2, false),
        Scheme::CatmullClark,
        Rate::Levels(1),
        &[1.0],
        DisplacementSpace::Object,
    ));
    assert!(mesh.positions.iter().any(|p| p.distance(vec3(1.0, 0.0, 1.0) + offset) < 1e-6));
    // u grows along x, v along z, which is to the right of it as seen from above.
    let (mesh, _) = refined(displaced(
        grid(2, false),
        Scheme::CatmullClark,
        Rate::Levels(1),
        &[1.0],
        DisplacementSpace::Tangent,
    ));
    let expected = vec3(1.0, 0.0, 1.0) + vec3(offset.x, offset.z, offset.y);
    assert!(mesh.positions.iter().any(|p| p.distance(expected) < 1e-5), "{:?}", mesh.positions);
}

#[test]
fn displaced_bodies_stay_closed_over_seams_creases_and_levels() {
    let row = [0.0, 1.0, 0.2, 0.7, 0.1, 0.9, 0.3, 0.5];
    for scheme in [Scheme::CatmullClark, Scheme::Loop, Scheme::Linear] {
        let mut cage = cube();
        cage.uvs[0] = vec![vec2(0.0, 0.0), vec2(1.0, 0.3), vec2(1.0, 1.0), vec2(0.1, 1.0)];
        cage.uvs_of[0] = (0..24).map(|c| c % 4).collect();
        cage.creases = vec![([2, 6], 10.0), ([6, 7], 10.0), ([0, 4], 1.4)];
        let rate = Rate::Pixels { most: 9.0, levels: 7 };
        let (mesh, report) = refined(displaced(cage, scheme, rate, &row, DisplacementSpace::Normal));
        assert_eq!(open_edges(std::slice::from_ref(&mesh)), 0, "{scheme:?}");
        assert!(mesh.indices.len() > 1000, "{scheme:?}: {}", mesh.indices.len());
        assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-4));
        let loops = report.notes.iter().filter(|n| n.message.contains("polygons became triangles")).count();
        assert_eq!(loops, usize::from(scheme == Scheme::Loop), "{:?}", report.notes);
    }
}

#[test]
fn the_same_bits_come_out_again_and_on_any_number_of_threads() {
    let make = || {
        let row = [0.0, 1.0, 0.2, 0.7];
        let rate = Rate::Pixels { most: 14.0, levels: 7 };
        refined(displaced(torus(9, 6, false), Scheme::CatmullClark, rate, &row, DisplacementSpace::Normal)).0
    };
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let (one, other) = (make(), alone.install(make));
    assert_eq!(one.indices, other.indices);
    assert_eq!(one.positions, other.positions);
    assert_eq!(one.normals, other.normals);
}

#[test]
fn broken_cages_are_mended_and_said() {
    // Three faces at an edge, one wound against its neighbour, one with a corner twice, one with a hole of a number.
    let mut positions = cube().positions;
    positions.push(vec3(f32::NAN, 0.0, 0.0));
    let faces: [&[u32]; 7] =
        [&[0, 4, 6, 2], &[0, 4, 5, 1], &[4, 0, 3], &[2, 6, 7, 3], &[0, 0, 1], &[0, 1, 8], &[0, 2, 0, 3]];
    for scheme in [Scheme::CatmullClark, Scheme::Loop, Scheme::Linear] {
        let made =
            tessellate(&cage(positions.clone(), &faces), scheme, Rate::Levels(2), None).expect("few faces");
        assert_eq!((made.report.broken_faces, made.report.cut_edges), (3, 1), "{scheme:?}");
        assert!(made.parts[0].positions.iter().all(|p| p.is_finite()));
        assert!(!made.parts[0].indices.is_empty());
    }
    for scheme in [Scheme::CatmullClark, Scheme::Loop, Scheme::Linear] {
        let nothing = tessellate(&Cage::default(), scheme, Rate::Levels(3), None).expect("nothing");
        assert!(nothing.parts[0].indices.is_empty());
    }
}

#[test]
fn any_cage_gives_a_mesh() {
    let mut state = 12345u32;
    let mut random = |n: u32| {
        state = state.wrapping_mul(1664525).wrapping_add(1013904223);
        (state >> 8) % n
    };
    for round in 0..400 {
        let count = 3 + random(7);
        let values = [0.0, 1.0, -1.0, 1e-30, 1e30, f32::NAN, 0.5];
        let range = if round % 2 == 0 { 7 } else { 3 };
        let mut value = || values[random(range) as usize];
        let positions = (0..count).map(|_| vec3(value(), value(), value())).collect();
        let mut cage = cage(positions, &[]);
        for _ in 0..1 + random(8) {
            let sides = 2 + random(4);
            // Now and then an index of nothing.
            cage.positions_of.extend((0..sides).map(|_| random(count + u32::from(round % 5 == 0))));
            cage.ends.push(cage.positions_of.len() as u32);
        }
        cage.uvs[0] = vec![Vec2::ZERO, Vec2::X, Vec2::NAN];
        cage.uvs_of[0] = cage.positions_of.iter().map(|p| p % 3).collect();
        cage.creases = vec![([random(count), random(count)], 0.7 * random(5) as f32)];
        cage.corners = vec![(random(count), 0.6 * random(4) as f32)];
        cage.round_corners = random(2) == 0;
        for scheme in [Scheme::CatmullClark, Scheme::Loop, Scheme::Linear] {
            let rate = if random(2) == 0 { Rate::Levels(2) } else { Rate::Length { most: 0.3, levels: 4 } };
            let made = tessellate(&cage, scheme, rate, None).expect("few faces");
            let mesh = &made.parts[0];
            let count = mesh.positions.len();
            assert!(mesh.normals.len() == count && mesh.uv0.len() == if count > 0 { count } else { 0 });
            assert!(mesh.indices.iter().flatten().all(|i| (*i as usize) < count));
        }
    }
}

#[test]
fn triangle_meshes_become_cages() {
    let side = shapes::cuboid(Vec3::splat(2.0), 0.0, 1);
    let cage = Cage::from_triangles(&[(&side, 3)], true);
    assert_eq!((cage.faces(), cage.positions.len(), cage.materials.as_slice()), (6, 8, &[3][..]));
    let mesh = levels(&cage, Scheme::CatmullClark, 2);
    assert_eq!(open_edges(std::slice::from_ref(&mesh)), 0);
    normals_at(&mesh, Vec3::splat(0.5));
    let unpaired = Cage::from_triangles(&[(&side, 3)], false);
    assert_eq!(unpaired.faces(), 12);
    // Creases by angle: all edges of a box, none of a ball.
    let mut sharp = cage.clone();
    sharp.crease_by_angle(0.5, 10.0);
    assert_eq!(sharp.creases.len(), 12);
    let mut ball = Cage::from_triangles(&[(&shapes::icosphere(1.0, 2), 0)], true);
    ball.crease_by_angle(0.5, 10.0);
    assert!(ball.creases.is_empty());
}

/// Prints how many triangles a second come out, for docs/subdivision.md.
#[test]
#[ignore = "measures, and takes some gigabytes"]
fn speed() {
    for (scheme, triangles) in [(Scheme::CatmullClark, false), (Scheme::Loop, true)] {
        let cage = torus(32, 16, triangles);
        for rate in [Rate::Levels(5), Rate::Levels(6), Rate::Length { most: 0.008, levels: 9 }] {
            let begin = std::time::Instant::now();
            let made = tessellate(&cage, scheme, rate, None).expect("few faces");
            let (seconds, count) = (begin.elapsed().as_secs_f64(), made.parts[0].indices.len());
            println!(
                "{scheme:?} {rate:?}: {count} in {seconds:.2} s, {:.2} M/s",
                count as f64 / seconds / 1e6
            );
        }
    }
}
