//! The upper level from the device against the one from the host: the same rays hit the same things.

use super::*;
use crate::backend::tracing::ComputeTracing;
use crate::kernel::Tracing;
use crate::layout::layout_of;
use crate::rays::{RayBuffers, RayQuestion};
use crate::shader::check;
use crate::timing::Timer;
use crate::tracer::bvh::{self, BvhTracer};
use crate::{GpuOptions, open_for_test};
use accel::encode::{EncodedInstance, EncodedNode, TraversalCounts};
use accel::{Quality, Ray};
use glam::{Affine3A, Quat, Vec3};
use scene::tables::SceneTables;
use scene::{Scene, Shape, Sphere};
use std::mem::offset_of;
use std::sync::Arc;
use testkit::Random;
use testkit::scenes::{Build, cuboid, lambert};

#[test]
fn layouts_match_the_shader() {
    let module = check::module("bvh_upper");
    crate::layout::assert_layout!(
        module,
        UpperInfo { count, sorted, levels, level, size, distance, padding0, padding1 }
    );
    crate::layout::assert_layout!(module, UpperObject { low, root, high, flags });
    use EncodedInstance as UpperInstance;
    crate::layout::assert_layout!(
        module,
        UpperInstance { world_to_object, extent, root, index, flags, unused }
    );
    use crate::scene::records::Instance;
    let scene = check::module("scene");
    assert_eq!(layout_of(&module, "SceneInstance"), layout_of(&scene, "Instance"));
    assert_eq!(layout_of(&scene, "Instance").1, size_of::<Instance>());
    let (_, node_size) = layout_of(&module, "UpperNode");
    assert_eq!((node_size, offset_of!(EncodedNode, planes)), (size_of::<EncodedNode>(), 32));
    assert_eq!(layout_of(&module, "UpperPlace").1, size_of::<Place>());
    assert_eq!(layout_of(&module, "UpperBox").1, 32);
}

/// Every pair of neighbours that a merge needs is compared, for any number of instances.
#[test]
fn steps_sort_everything() {
    let mut random = Random::new(3);
    for count in [1, 8, 9, 511, 513, 3000] {
        let steps = steps(count, UpperUpdate::Rebuild);
        let sorted = steps[0].info.sorted as usize;
        let mut order: Vec<u64> = (0..sorted).map(|_| random.bits()).collect();
        let compare = |order: &mut [u64], size: usize, distance: usize| {
            for at in (0..order.len()).filter(|at| at & distance == 0) {
                if (order[at] > order[at + distance]) == (at & size == 0) {
                    order.swap(at, at + distance);
                }
            }
        };
        for step in &steps {
            let (size, distance) = (step.info.size as usize, step.info.distance as usize);
            let near = |order: &mut [u64], size: usize| {
                let mut distance = size.min(SORTED_TOGETHER as usize) / 2;
                while distance > 0 {
                    compare(order, size, distance);
                    distance /= 2;
                }
            };
            match step.shader {
                "sort_small" => (1..=9).for_each(|log| near(&mut order, 1 << log)),
                "sort_far" => compare(&mut order, size, distance),
                "sort_near" => near(&mut order, size),
                _ => {}
            }
        }
        assert!(order.is_sorted(), "{count}");
        let made: u32 = (0..depth(count)).map(|level| count.div_ceil(8u32.pow(level + 1)).max(1)).sum();
        assert_eq!(made, node_count(count));
        assert_eq!(steps.iter().filter(|s| s.shader == "make_nodes").count() as u32, depth(count));
    }
}

/// Boxes and spheres in as many places.
fn crowd(places: &[Affine3A]) -> SceneTables {
    let mut scene = Scene::default();
    let grey = scene.add_material(lambert("grey", [0.5; 3]));
    let cube =
        scene.add_shape("box", Shape::Triangles(cuboid([-0.5; 3], [0.5; 3])), grey, Affine3A::IDENTITY);
    let ball = Sphere { center: Vec3::new(0.1, 0.0, 0.0), radius: 0.6 };
    let ball = scene.add_shape("ball", Shape::Spheres(vec![ball]), grey, Affine3A::IDENTITY);
    scene.instances.clear();
    for (number, &place) in places.iter().enumerate() {
        let mesh = if number % 3 == 0 { ball } else { cube };
        let mut instance = scene::Instance::new(format!("{number}"), mesh, place);
        instance.dynamic = true;
        scene.instances.push(instance);
    }
    SceneTables::build(&scene)
}

fn random_places(random: &mut Random, count: usize) -> Vec<Affine3A> {
    let mut u = |low: f32, high: f32| low + (high - low) * random.uniform_f32();
    let mut place = || {
        let turn = Quat::from_euler(glam::EulerRot::XYZ, u(0.0, 6.0), u(0.0, 6.0), u(0.0, 6.0));
        let size = Vec3::new(u(0.2, 1.0), u(0.2, 1.0), u(0.2, 1.0));
        let at = Vec3::new(u(-10.0, 10.0), u(-2.0, 2.0), u(-10.0, 10.0));
        Affine3A::from_scale_rotation_translation(size, turn, at)
    };
    (0..count).map(|_| place()).collect()
}

fn rows(place: &Affine3A) -> Place {
    let m = place.matrix3.transpose();
    let row = |axis: glam::Vec3A, w: f32| [axis.x, axis.y, axis.z, w];
    let t = place.translation;
    [row(m.x_axis, t.x), row(m.y_axis, t.y), row(m.z_axis, t.z)]
}

/// After random movements, instances that vanish and come back included, by rebuild and by refit.
#[test]
fn moved_instances_are_hit_where_they_are() {
    let name = "moved_instances_are_hit_where_they_are";
    let Some(gpu) = open_for_test(name, &GpuOptions::default()) else { return };
    let mut random = Random::new(11);
    const COUNT: usize = 700;
    let first = random_places(&mut random, COUNT);
    let scene = GpuScene::upload(&gpu, Arc::new(crowd(&first))).expect("upload");
    let (tracer, builder) = BvhTracer::dynamic(&gpu, &scene).expect("structures");
    let builder = builder.expect("many instances");
    let tracing = ComputeTracing(Box::new(tracer));
    let rays: Vec<Ray> = {
        let mut point = || {
            let mut u = |size: f32| size * (2.0 * random.uniform_f32() - 1.0);
            [u(12.0), u(3.0), u(12.0)]
        };
        let mut ray = || {
            let (from, to) = (point(), point());
            Ray { t_max: 2.0, ..Ray::new(from, [0, 1, 2].map(|a: usize| to[a] - from[a])) }
        };
        (0..4000).map(|_| ray()).collect()
    };
    let list = RayBuffers::new(&gpu, &rays, 50).expect("rays");
    let mut kernel = tracing.ray_kernel(&gpu, RayQuestion::Closest, &scene).expect("a kernel");
    let mut timer = Timer::new(&gpu).expect("timer");
    let mut places = first;
    for (round, update) in
        [UpperUpdate::Rebuild, UpperUpdate::Refit, UpperUpdate::Rebuild].into_iter().enumerate()
    {
        if round > 0 {
            places = random_places(&mut random, COUNT);
        }
        let mut given: Vec<Place> = places.iter().map(rows).collect();
        // Every fifth one is gone, another fifth in each round; where it stood there is nothing.
        let gone = |i: usize| i % 5 == round;
        given.iter_mut().enumerate().filter(|(i, _)| gone(*i)).for_each(|(_, p)| *p = [[0.0; 4]; 3]);
        builder.set_places(&gpu, &given).expect("memory");
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        builder.record(&mut encoder, &mut timer, update);
        gpu.queue.submit([encoder.finish()]);
        kernel.submit(&gpu, &list, &mut timer).expect("submit");
        let hits = list.read_hits(&gpu).expect("hits");
        let far = |i: usize| Affine3A::from_translation(Vec3::new(1e4 + i as f32, 0.0, 0.0));
        let expected: Vec<Affine3A> =
            places.iter().enumerate().map(|(i, p)| if gone(i) { far(i) } else { *p }).collect();
        let twin = bvh::encode(&crowd(&expected), Quality::Balanced);
        let mut found = 0;
        let differ = rays.iter().zip(&hits).filter(|(ray, hit)| {
            match twin.closest(ray, |_| true, &mut TraversalCounts::default()) {
                None => !hit.is_miss(),
                Some(_) if hit.is_miss() => true,
                Some(e) => {
                    found += 1;
                    (e.t - hit.t).abs() > 1e-3 * e.t.max(1e-2)
                }
            }
        });
        let differ = differ.count();
        println!("{update:?}: {differ} of {found} hits differ");
        assert!(found > 500 && found < rays.len(), "{found}");
        // Rays that graze an edge may see it or not.
        assert!(differ * 500 <= rays.len(), "{update:?}: {differ} differ");
    }
    let error = builder.set_places(&gpu, &[]).expect_err("too few");
    assert!(error.to_string().contains("0 matrices for 700"), "{error}");
}
