//! The scene of many instances.

use super::{Build, camera, cuboid, emitter, lambert, quads, square};
use crate::Random;
use elementary::sin;
use glam::{Affine3A, Quat, Vec3};
use scene::{Instance, Mesh, Scene, Shape, TriangleMesh};
use std::collections::HashMap;

/// `side`³ instances of six dented spheres of `20 · 4^level` triangles. Level 7 and side 7 are 2 million stored and 112
/// million instanced triangles: what memory and speed are measured with.
///
/// The shared data's generator makes the same shape of scene from other random numbers.
#[must_use]
pub fn hairy(level: u32, side: u32) -> Scene {
    let mut scene = Scene { name: "hairy".into(), ..Scene::default() };
    let colors =
        [[0.8, 0.3, 0.2], [0.3, 0.7, 0.3], [0.25, 0.35, 0.8], [0.8, 0.7, 0.3], [0.7; 3], [0.5, 0.2, 0.6]];
    for (i, color) in colors.into_iter().enumerate() {
        let material = scene.add_material(lambert(&format!("m{i}"), color));
        let mesh = Shape::Triangles(blob(level, i as u64));
        scene.meshes.push(Mesh::single(format!("blob{i}"), mesh, material));
    }
    let mut random = Random::new(99);
    let middle = (side / 2) as f32;
    for k in 0..side.pow(3) {
        let turn = Quat::from_array([(); 4].map(|()| random.normal() as f32)).normalize();
        let cell = Vec3::new((k % side) as f32, (k / side % side) as f32, (k / side / side) as f32);
        let at = (cell - Vec3::new(middle, 0.0, middle)) * 2.4 + Vec3::Y * 1.3;
        let mesh = (random.uniform() * 6.0) as u32;
        let scale = Vec3::splat(0.8 + 0.3 * random.uniform_f32());
        let transform = Affine3A::from_scale_rotation_translation(scale, turn, at);
        scene.instances.push(Instance::new(format!("i{k}"), mesh, transform));
    }
    let floor = scene.add_material(lambert("floor", [0.6; 3]));
    scene.add_mesh("floor", square(40.0, 0.0), floor);
    let light = scene.add_material(emitter("light", [8.0; 3]));
    let (r, h) = (14.0, f64::from(side) * 2.4 + 8.0);
    scene.add_mesh("light", quads(&[[[r, h, -r], [r, h, r], [-r, h, r], [-r, h, -r]]]), light);
    scene.cameras.push(camera([19.0, 14.0, 24.0], [0.0, 7.0, 0.0], 45.0));
    scene
}

/// `count` dented spheres of 20·4^`level` triangles each, in rows of three, in a closed room of 10 m × 10 m × 5 m: what
/// the shared data's meshes for ray benchmarks show (`mesh2m` is level 7 and count 6), with other dents.
///
/// The camera stands in the room, so that every ray hits something.
#[must_use]
pub fn blobs_in_a_room(level: u32, count: u32) -> Scene {
    let mut scene = Scene { name: "blobs in a room".into(), ..Scene::default() };
    let grey = scene.add_material(lambert("grey", [0.6; 3]));
    let first_row = if count > 3 { 0.5 } else { 0.0 };
    for i in 0..count {
        let (column, row) = ((i % 3) as f32, (i / 3) as f32);
        let at = Vec3::new((column - 1.0) * 2.3, 1.25, (row - first_row) * -2.3);
        let mut mesh = blob(level, u64::from(i));
        mesh.positions.iter_mut().for_each(|p| *p += at);
        scene.add_mesh(&format!("blob{i}"), mesh, grey);
    }
    scene.add_mesh("room", cuboid([-5.0, 0.0, -5.0], [5.0, 5.0, 5.0]), grey);
    scene.cameras.push(camera([0.0, 2.4, 4.6], [0.0, 1.0, 0.0], 60.0));
    scene
}

/// A unit geodesic sphere, dented along its normals by 48 sine waves in four octaves.
fn blob(level: u32, seed: u64) -> TriangleMesh {
    let mut mesh = geodesic_sphere(level);
    let mut random = Random::new(seed);
    let mut dent = vec![0.0f32; mesh.positions.len()];
    for (frequency, amplitude) in [(2.5, 0.10), (6.0, 0.05), (15.0, 0.022), (40.0, 0.007)] {
        for _ in 0..12 {
            let direction = Vec3::from([(); 3].map(|()| random.normal() as f32)).normalize() * frequency;
            let phase = random.uniform_f32() * std::f32::consts::TAU;
            for (d, p) in dent.iter_mut().zip(&mesh.positions) {
                *d += amplitude / 3.46 * sin(p.dot(direction) * 2.0 + phase);
            }
        }
    }
    mesh.positions.iter_mut().zip(&dent).for_each(|(p, d)| *p *= 1.0 + d);
    mesh.normals = vec![Vec3::ZERO; mesh.positions.len()];
    for t in &mesh.indices {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        t.iter().for_each(|&i| mesh.normals[i as usize] += (b - a).cross(c - a));
    }
    mesh.normals.iter_mut().for_each(|n| *n = n.normalize());
    mesh
}

/// The unit sphere as an icosahedron of which each triangle is divided `level` times into four.
pub(super) fn geodesic_sphere(level: u32) -> TriangleMesh {
    let p = (1.0 + 5f32.sqrt()) / 2.0;
    #[rustfmt::skip]
    let corners = [
        [-1.0, p, 0.0], [1.0, p, 0.0], [-1.0, -p, 0.0], [1.0, -p, 0.0], [0.0, -1.0, p], [0.0, 1.0, p],
        [0.0, -1.0, -p], [0.0, 1.0, -p], [p, 0.0, -1.0], [p, 0.0, 1.0], [-p, 0.0, -1.0], [-p, 0.0, 1.0],
    ];
    #[rustfmt::skip]
    let mut indices = vec![
        [0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4], [11, 10, 2], [10, 7, 6],
        [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9], [4, 9, 5], [2, 4, 11], [6, 2, 10],
        [8, 6, 7], [9, 8, 1],
    ];
    let mut positions: Vec<Vec3> = corners.iter().map(|c| Vec3::from(*c).normalize()).collect();
    for _ in 0..level {
        let mut middles = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                positions.push((positions[a as usize] + positions[b as usize]).normalize());
                positions.len() as u32 - 1
            })
        };
        let divide = |[a, b, c]: [u32; 3]| {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
        };
        indices = indices.into_iter().flat_map(divide).collect();
    }
    TriangleMesh { positions, indices, ..TriangleMesh::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts() {
        let scene = hairy(2, 3);
        assert_eq!(scene.unique_triangles(), 6 * 320 + 4);
        assert_eq!(scene.instanced_triangles(), 27 * 320 + 4);
    }
}
