//! Lists of rays on every tracer against the hierarchy's scalar twin; layouts.

use super::*;
use crate::layout::layout_of;
use crate::shader::check;
use crate::tracer::{Instances, TracerKind, bvh};
use crate::{GpuOptions, GpuScene, open_for_test};
use accel::Quality;
use accel::encode::{EncodedScene, TraversalCounts};
use scene::tables::SceneTables;
use std::sync::Arc;
use testkit::Random;

#[test]
fn layouts_match_the_shader() {
    let module = check::module("ray_list");
    crate::layout::assert_layout!(module, Ray { origin, t_min, direction, t_max });
    crate::layout::assert_layout!(module, RayList { count, width });
    let rust = ["t", "u", "v", "instance", "geometry", "primitive"];
    let rust = rust.iter().enumerate().map(|(i, name)| ((*name).to_owned(), 4 * i)).collect();
    assert_eq!(layout_of(&module, "Hit"), (rust, size_of::<RayHit>()));
}

/// Rays between random points around and in a scene.
fn rays_in(tables: &SceneTables, count: usize) -> Vec<Ray> {
    let [x, y, z, r] = tables.bounding_sphere;
    let mut random = Random::new(5);
    let mut point = || [x, y, z].map(|c| c + r * (2.0 * random.uniform_f32() - 1.0));
    let mut ray = || {
        let (from, to) = (point(), point());
        Ray { t_max: 2.0, ..Ray::new(from, [0, 1, 2].map(|a: usize| to[a] - from[a])) }
    };
    (0..count).map(|_| ray()).collect()
}

/// How many answers differ from those of the twin.
fn differences(twin: &EncodedScene, question: RayQuestion, rays: &[Ray], hits: &[RayHit]) -> usize {
    assert!(!rays.is_empty() && rays.len() == hits.len(), "nothing to compare");
    let differs = |(ray, hit): &(&Ray, &RayHit)| {
        let expected = twin.closest(ray, |_| true, &mut TraversalCounts::default());
        match expected {
            None => !hit.is_miss(),
            Some(_) if hit.is_miss() => true,
            Some(e) => question != RayQuestion::Any && (e.t - hit.t).abs() > 1e-4 * e.t.max(1e-3),
        }
    };
    rays.iter().zip(hits).filter(differs).count()
}

fn compare(test: &str, features: wgpu::Features, spoil: impl Fn(&mut [RayHit])) {
    let options = GpuOptions { features, ..GpuOptions::default() };
    let Some(gpu) = open_for_test(test, &options) else { return };
    let tables = Arc::new(SceneTables::build(&testkit::scenes::hairy(2, 2)));
    let scene = GpuScene::upload(&gpu, tables.clone()).expect("upload");
    let twin = bvh::encode(&tables, Quality::Balanced);
    let rays = rays_in(&tables, 5001);
    for kind in TracerKind::ALL.into_iter().filter(|kind| kind.check(&gpu).is_ok()) {
        let tracing = kind.build(&gpu, &scene, Instances::StandStill).expect("structures");
        let mut timer = Timer::new(&gpu).expect("timer");
        for (question, width) in [
            (RayQuestion::Closest, 100),
            (RayQuestion::ClosestPacket, 100),
            (RayQuestion::Any, 1),
            (RayQuestion::Any, 0),
        ] {
            let list = RayBuffers::new(&gpu, &rays, width).expect("rays");
            let mut kernel = tracing.ray_kernel(&gpu, question, &scene).expect("kernel");
            kernel.submit(&gpu, &list, &mut timer).expect("submit");
            let mut hits = list.read_hits(&gpu).expect("hits");
            spoil(&mut hits);
            let misses = hits.iter().filter(|h| h.is_miss()).count();
            assert!(misses > 0 && misses < rays.len(), "{}: all alike", kind.name());
            let differ = differences(&twin, question, &rays, &hits);
            // Rays that graze an edge may see it or not.
            assert!(differ * 1000 <= rays.len(), "{}, {question:?}: {differ} differ", kind.name());
        }
    }
}

#[test]
fn every_tracer_answers_lists_of_rays() {
    compare("every_tracer_answers_lists_of_rays", wgpu::Features::all(), |_| ());
}

/// Where rays cannot walk together, lists of those that could are answered all the same.
#[test]
fn devices_without_subgroups_answer_lists_of_rays() {
    let alone = wgpu::Features::all() - wgpu::Features::SUBGROUP;
    compare("devices_without_subgroups_answer_lists_of_rays", alone, |_| ());
}

#[test]
#[should_panic(expected = "differ")]
fn wrong_answers_are_noticed() {
    if open_for_test("wrong_answers_are_noticed", &GpuOptions::default()).is_none() {
        panic!("skipped; otherwise answers differ");
    }
    compare("wrong_answers_are_noticed", wgpu::Features::all(), |hits| hits.reverse());
}

#[test]
fn an_empty_list_has_no_answers() {
    let Some(gpu) = open_for_test("an_empty_list_has_no_answers", &GpuOptions::default()) else { return };
    let tables = Arc::new(SceneTables::build(&testkit::scenes::cornell()));
    let scene = GpuScene::upload(&gpu, tables).expect("upload");
    let list = RayBuffers::new(&gpu, &[], 0).expect("an empty list");
    let tracing = TracerKind::Bvh.build(&gpu, &scene, Instances::Move).expect("structures");
    let mut kernel = tracing.ray_kernel(&gpu, RayQuestion::Closest, &scene).expect("kernel");
    kernel.submit(&gpu, &list, &mut Timer::new(&gpu).expect("timer")).expect("submit");
    assert!(list.read_hits(&gpu).expect("hits").is_empty());
}
