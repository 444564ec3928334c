//! Every instruction set against a loop over all primitives.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

mod support;

use accel::{Blas, Candidate, HitFilter, Instance, Masked, Opaque, Quality, Ray, Sphere, Tlas};
use std::sync::Arc;
use support::*;

const QUALITIES: [Quality; 3] = [Quality::Fast, Quality::Balanced, Quality::High];

#[test]
fn triangle_soups() {
    let mut rng = Rng::new(1);
    // Around the sizes of a leaf, of a group of triangles and of a node.
    let counts: &[usize] = if cfg!(miri) { &[1, 9] } else { &[1, 2, 7, 8, 9, 38, 64, 100, 1000] };
    for &count in counts {
        for size in [0.05, 0.5] {
            let mesh = Mesh::soup(&mut rng, count, size);
            let mut all = Everything::default();
            all.add_mesh(0, 5, &mesh, &Instance::IDENTITY);
            let rays = random_rays(&mut rng, amount(2000), 3.0);
            for quality in QUALITIES {
                check(&mut alone(Blas::triangles(&[mesh.geometry(5)], quality)), &all, &rays, &Opaque);
            }
        }
    }
}

#[test]
fn camera_rays_of_a_blob() {
    let mesh = Mesh::blob(if cfg!(miri) { 5 } else { 60 });
    let mut all = Everything::default();
    all.add_mesh(0, 0, &mesh, &Instance::IDENTITY);
    let rays = camera_rays(if cfg!(miri) { 3 } else { 45 }, [0.3, 0.2, 4.0], 1.4);
    for quality in QUALITIES {
        check(&mut alone(Blas::triangles(&[mesh.geometry(0)], quality)), &all, &rays, &Opaque);
    }
}

#[test]
fn several_geometries_keep_their_ids() {
    let mut rng = Rng::new(2);
    let meshes: Vec<_> = (0..3).map(|_| Mesh::soup(&mut rng, amount(200), 0.2)).collect();
    let mut all = Everything::default();
    for (mesh, first) in meshes.iter().zip([1000, 0, 500]) {
        all.add_mesh(0, first, mesh, &Instance::IDENTITY);
    }
    let geometries = [meshes[0].geometry(1000), meshes[1].geometry(0), meshes[2].geometry(500)];
    let rays = random_rays(&mut rng, amount(3000), 2.0);
    let blas = Blas::triangles(&geometries, Quality::Balanced);
    assert_eq!(blas.primitive_count(), 3 * amount(200));
    check(&mut alone(blas), &all, &rays, &Opaque);
}

#[test]
fn spheres() {
    let mut rng = Rng::new(3);
    for count in [1, 5, 300] {
        let spheres: Vec<_> = (0..amount(count))
            .map(|_| Sphere { center: rng.point(), radius: 0.12 + 0.1 * rng.signed() })
            .collect();
        let placed = spheres.iter().enumerate().map(|(i, s)| (0, 7 + i as u32, *s));
        let all = Everything { spheres: placed.collect(), ..Everything::default() };
        let rays = random_rays(&mut rng, amount(3000), 2.0);
        check(&mut alone(Blas::spheres(&spheres, 7, Quality::Balanced)), &all, &rays, &Opaque);
        check(&mut alone(Blas::spheres(&spheres, 7, Quality::Balanced)), &all, &rays, &Holes);
    }
}

/// Some primitives are transparent, and all are in a part.
struct Holes;

impl HitFilter for Holes {
    const OPAQUE: bool = false;

    fn accept(&self, c: &Candidate) -> bool {
        // Spheres have no lower part, and nothing is seen on steep ways up.
        let (up, rises) = (c.outward[1], c.direction[1]);
        !(c.instance + c.primitive).is_multiple_of(3) && c.u + c.v < 0.7 && up > -0.3 && rises < 0.8
    }
}

#[test]
fn filters_decide() {
    let mut rng = Rng::new(4);
    let mesh = Mesh::soup(&mut rng, amount(400), 0.4);
    let mut all = Everything::default();
    all.add_mesh(0, 0, &mesh, &Instance::IDENTITY);
    let rays = random_rays(&mut rng, amount(3000), 2.0);
    check(&mut alone(Blas::triangles(&[mesh.geometry(0)], Quality::Balanced)), &all, &rays, &Holes);
}

/// Rotations, non-uniform scales, mirrors, some of them identities.
fn random_instance(rng: &mut Rng, blas: u32, index: usize) -> Instance {
    let mut m = Instance::IDENTITY;
    if !index.is_multiple_of(4) {
        for row in &mut m {
            for x in &mut row[..3] {
                *x = 0.4 * *x + 0.3 * rng.signed();
            }
            row[3] = 2.0 * rng.signed();
        }
    }
    Instance { blas, object_to_world: m, mask: 1 << (index % 3) }
}

#[test]
fn instances_with_any_transform_and_masks() {
    let mut rng = Rng::new(5);
    let meshes: Vec<_> = (0..2).map(|_| Mesh::soup(&mut rng, amount(60), 0.4)).collect();
    let blas: Vec<_> =
        meshes.iter().map(|m| Arc::new(Blas::triangles(&[m.geometry(10)], Quality::Balanced))).collect();
    let mut tlas = Tlas::build(&[], blas);
    for count in [0, 1, 2, 3, 40] {
        let instances: Vec<_> = (0..amount(count))
            .map(|i| random_instance(&mut rng, i as u32 % 2, i + usize::from(count == 1)))
            .collect();
        tlas.update(&instances);
        for mask in [u32::MAX, 1, 6, 0] {
            let mut all = Everything::default();
            for (i, instance) in instances.iter().enumerate().filter(|(_, i)| i.mask & mask != 0) {
                all.add_mesh(i as u32, 10, &meshes[instance.blas as usize], &instance.object_to_world);
            }
            let rays = random_rays(&mut rng, amount(2000), 5.0);
            check(&mut tlas, &all, &rays, &Masked(mask));
        }
    }
    assert!(tlas.memory_bytes() > 0 && !tlas.bounds().is_empty());
}

#[test]
fn only_instance_respects_masks() {
    let mesh = Mesh { positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], indices: vec![[0, 1, 2]] };
    let blas = Arc::new(Blas::triangles(&[mesh.geometry(0)], Quality::Fast));
    let tlas = Tlas::build(&[Instance { mask: 2, ..Instance::identity(0) }], vec![blas]);
    let ray = Ray::new([0.2, 0.2, 1.0], [0.0, 0.0, -2.0]);
    for (mask, seen) in [(1, false), (2, true), (u32::MAX, true)] {
        let hit = tlas.closest(&ray, &Masked(mask));
        assert_eq!((hit.t - 0.5).abs() < 1e-6, seen);
        assert_eq!(hit.is_miss(), !seen);
        assert_eq!(tlas.any(&ray, &Masked(mask)), seen);
    }
}

#[test]
fn refit_equals_rebuild() {
    let mut rng = Rng::new(6);
    let mut mesh = Mesh::blob(if cfg!(miri) { 4 } else { 30 });
    let mut blas = Blas::triangles(&[mesh.geometry(3)], Quality::Balanced);
    for p in &mut mesh.positions {
        let wave = (3.0 * p[0]).sin();
        *p = [2.0 * p[0] + 1.0, p[1] + 0.5 * wave, p[2] * (1.0 + 0.1 * rng.signed())];
    }
    blas.refit(&[mesh.geometry(3)]);
    let rebuilt = Blas::triangles(&[mesh.geometry(3)], Quality::Balanced);
    assert_eq!(blas.bounds(), rebuilt.bounds());
    let rays = random_rays(&mut rng, amount(4000), 4.0);
    let mut all = Everything::default();
    all.add_mesh(0, 3, &mesh, &Instance::IDENTITY);
    check(&mut alone(blas), &all, &rays, &Opaque);
    check(&mut alone(rebuilt), &all, &rays, &Opaque);
}

#[test]
#[should_panic(expected = "of 500 rays differ")]
fn the_comparison_notices_a_missing_triangle() {
    let mut rng = Rng::new(7);
    let mesh = Mesh::soup(&mut rng, 20, 0.8);
    let mut all = Everything::default();
    all.add_mesh(0, 0, &mesh, &Instance::IDENTITY);
    let fewer = Mesh { indices: mesh.indices[1..].to_vec(), ..mesh };
    let rays = random_rays(&mut rng, 500, 2.0);
    check(&mut alone(Blas::triangles(&[fewer.geometry(1)], Quality::Fast)), &all, &rays, &Opaque);
}
