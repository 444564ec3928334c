//! Instances that move while rays leave: every kernel finds at a ray's time what stands there then.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

mod support;

use accel::{
    Blas, Coherence, Hit, Instance, InstanceMotions, InstructionSet, MISS, Opaque, Quality, Ray, RayColumns,
    RayTimes, Tlas,
};
use optics::motion::{AffineRows, MotionSegment};
use optics::vec4f;
use std::sync::Arc;
use support::{Mesh, Rng, amount, random_rays, same_hit};

/// A motion between random places, turns and stretches.
fn segment(rng: &mut Rng, angle: f32) -> MotionSegment {
    let mut vector = |scale: f32| {
        let [x, y, z] = rng.point();
        [x * scale, y * scale, z * scale]
    };
    let [[x, y, z], [dx, dy, dz], [a, b, c]] = [vector(2.0), vector(2.0), vector(0.3)];
    let axis = vector(1.0);
    let length = axis.iter().map(|v| v * v).sum::<f32>().sqrt().max(1e-3);
    let [i, j, k] = axis.map(|v| v / length);
    MotionSegment {
        translation: vec4f(x, y, z, angle * 0.5),
        translation_step: vec4f(dx, dy, dz, 0.0),
        rotation: vec4f(0.0, 0.0, 0.0, 1.0),
        rotation_step: vec4f(i, j, k, 0.0),
        stretch: vec4f(1.0, 1.2, 0.8, 0.0),
        stretch_step: vec4f(a, b, c, 0.0),
        shear: vec4f(0.1, 0.0, 0.0, 0.0),
        shear_step: vec4f(0.0, 0.1, 0.0, 0.0),
    }
}

/// Instances of which every third stands still.
fn moving(rng: &mut Rng, count: u32) -> (Vec<Instance>, InstanceMotions) {
    let (mut segments, mut of_instances) = (Vec::new(), Vec::new());
    for i in 0..count {
        let first = segments.len() as u32;
        if i % 3 != 2 {
            segments.extend((0..=i % 2).map(|k| segment(rng, 3.0 * (k + 1) as f32 / 2.0)));
        }
        of_instances.push(first..segments.len() as u32);
    }
    let instances = (0..count).map(|i| Instance::identity(i % 2)).collect();
    (instances, InstanceMotions { segments: segments.into(), of_instances })
}

/// The instances as they stand at a time.
fn standing(instances: &[Instance], motions: &InstanceMotions, time: f32) -> Vec<Instance> {
    let place = |(i, instance): (usize, &Instance)| match motions.of(i) {
        [] => *instance,
        motion => Instance { object_to_world: AffineRows::of_motion(motion, time).rows(), ..*instance },
    };
    instances.iter().enumerate().map(place).collect()
}

fn columns(rays: &[Ray]) -> [Vec<f32>; 6] {
    let column = |of: fn(&Ray) -> f32| rays.iter().map(of).collect();
    [
        column(|r| r.origin[0]),
        column(|r| r.origin[1]),
        column(|r| r.origin[2]),
        column(|r| r.direction[0]),
        column(|r| r.direction[1]),
        column(|r| r.direction[2]),
    ]
}

#[test]
fn rays_find_what_stands_there_at_their_time() {
    let mut rng = Rng::new(11);
    let meshes: Vec<_> = (0..2).map(|_| Mesh::soup(&mut rng, amount(60), 0.5)).collect();
    let blas: Vec<_> =
        meshes.iter().map(|m| Arc::new(Blas::triangles(&[m.geometry(0)], Quality::Balanced))).collect();
    let (instances, motions) = moving(&mut rng, 12);
    let mut tlas = Tlas::build(&[], blas.clone());
    tlas.update_moving(&instances, motions.clone());
    let times = [0.0, 0.2, 0.5, 0.77, 1.0];
    let rays = random_rays(&mut rng, amount(1000), 5.0);
    let rays: Vec<Ray> = rays.into_iter().map(|r| Ray::new(r.origin, r.direction)).collect();
    // Ray `i` leaves at the time of its place.
    let places: Vec<u32> = (0..rays.len() as u32).map(|i| i % times.len() as u32).collect();
    let then: Vec<Tlas> =
        times.iter().map(|&t| Tlas::build(&standing(&instances, &motions, t), blas.clone())).collect();
    let expected: Vec<Hit> =
        rays.iter().zip(&places).map(|(ray, &place)| then[place as usize].closest(ray, &Opaque)).collect();
    assert!(expected.iter().filter(|hit| !hit.is_miss()).count() * 4 > rays.len(), "most rays miss");
    let [ox, oy, oz, dx, dy, dz] = &columns(&rays);
    let stream = RayColumns::new([ox, oy, oz], [dx, dy, dz], None);
    let stream = stream.at(Some(RayTimes { places: &places, times: &times }));
    for isa in InstructionSet::available() {
        tlas.set_instruction_set(isa);
        let mut hits = vec![MISS; rays.len()];
        let mut any = vec![false; rays.len()];
        tlas.closest_stream(&stream, &mut hits[..], &Opaque, Coherence::Incoherent);
        tlas.any_stream(&stream, &mut any, &Opaque, Coherence::Coherent);
        let mut wrong = 0;
        for (i, expected) in expected.iter().enumerate() {
            let time = times[places[i] as usize];
            let alone = tlas.closest_at(&rays[i], time, &Opaque);
            assert_eq!(tlas.any_at(&rays[i], time, &Opaque), !alone.is_miss(), "{isa:?}: ray {i}");
            assert_eq!(any[i], !hits[i].is_miss(), "{isa:?}: ray {i}");
            wrong += usize::from(!same_hit(expected, &alone) || !same_hit(expected, &hits[i]));
        }
        // Inverse transforms are rounded in other ways: rays that graze an edge may miss it.
        assert!(wrong * 200 <= rays.len(), "{isa:?}: {wrong} of {} rays", rays.len());
    }
}
