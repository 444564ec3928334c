//! Shafts leave nothing out: shadows are those of walks from the root.

use super::super::tests::{Setup, differing_share, hybrid, only_lights, overview, view};
use super::*;
use crate::readback::read_all;
use crate::tracer::bvh;
use backend::HybridSettings;
use glam::{Affine3A, Quat, Vec3};
use scene::Shape;
use testkit::scenes::{Build, assortment, ground, lambert, uv_sphere};

/// The assortment, which has every kind of light, with meshes of many more nodes than a list has: one that stands as it is and two
/// that are turned and stretched.
fn detailed() -> scene::Scene {
    let mut scene = assortment();
    let clay = scene.add_material(lambert("clay", [0.7, 0.6, 0.5]));
    let mut hills = ground(0.0, 6.0);
    const SIDE: u32 = 60;
    hills.positions = (0..=SIDE)
        .flat_map(|j| (0..=SIDE).map(move |i| (i as f32 * 0.2 - 6.0, j as f32 * 0.2 - 6.0)))
        .map(|(x, z)| Vec3::new(x, 0.05 + 0.1 * (3.0 * x).sin() * (2.0 * z).cos(), z))
        .collect();
    hills.indices = (0..SIDE)
        .flat_map(|j| (0..SIDE).map(move |i| j * (SIDE + 1) + i))
        .flat_map(|a| [[a, a + SIDE + 1, a + 1], [a + 1, a + SIDE + 1, a + SIDE + 2]])
        .collect();
    (hills.normals, hills.uv0) = (Vec::new(), Vec::new());
    scene.add_shape("hills", Shape::Triangles(hills), clay, Affine3A::IDENTITY);
    for (i, place) in [Vec3::new(-1.2, 1.9, 1.0), Vec3::new(1.4, 2.1, 1.2)].into_iter().enumerate() {
        let turn = Quat::from_axis_angle(Vec3::new(1.0, 2.0, 0.5).normalize(), 0.7 + i as f32);
        let stretched = Affine3A::from_scale_rotation_translation(Vec3::new(0.3, 0.15, 0.4), turn, place);
        scene.add_shape("pebble", Shape::Triangles(uv_sphere(40, 20)), clay, stretched);
    }
    scene
}

#[test]
fn shafts_leave_nothing_out() {
    let Some(setup) = Setup::with_scene("shafts_leave_nothing_out", &detailed()) else { return };
    let of = |shadow_samples, shadows| {
        let rays = only_lights(shadow_samples);
        view(overview(), hybrid(HybridSettings { rays, light_cutoff: 0.0, shadows, ..Default::default() }))
    };
    let mut kernel = setup.hybrid(&of(2, true));
    let shafts = kernel.shafts.clone().expect("a tracer that can begin below the root");
    let mut render = |view: &backend::View, asks_first| {
        kernel.asks_lights_first = Some(asks_first);
        setup.render(&mut kernel, view, 2)
    };
    let (bare, _) = render(&of(2, false), true);
    let (traced, traced_rays) = render(&of(2, true), false);
    let (by_shafts, shaft_rays) = render(&of(2, true), true);
    println!("{shaft_rays} rays by shafts, {traced_rays} without");
    assert_eq!(differing_share(&by_shafts, &traced), 0.0);
    assert!(differing_share(&by_shafts, &bare) > 0.1, "shadows change nothing");
    // Where a shaft is empty there are no rays.
    assert!(shaft_rays <= traced_rays + traced_rays / 20, "{shaft_rays}, {traced_rays}");

    // The lists of the rows that were rendered last: no longer than they may be, and not all begin at a root.
    let targets = kernel.targets.as_ref().expect("rendered");
    let words: Vec<u32> = read_all(&setup.gpu, &targets.light_masks);
    let size = [targets.size[0], targets.size[1] - targets.size[1] / 2];
    let pixels = u64::from(targets.size[0] * targets.size[1] * targets.lights.hidden);
    let boxes = (targets.lights.masks + pixels).div_ceil(GROUP) as usize;
    let tiles = Shafts::lists(size, 1) as usize;
    let encoded = bvh::encode(&setup.scene.tables, accel::Quality::Balanced);
    let roots: Vec<u32> = encoded.objects().map(|o| o.root).chain([encoded.instances[0].root]).collect();
    let (mut lists, mut entries, mut at_roots) = (0, 0, 0);
    for list in 0..tiles * kernel.light_count as usize {
        let low = f32::from_bits(words[4 * (boxes + 2 * (list % tiles))]);
        let high = f32::from_bits(words[4 * (boxes + 2 * (list % tiles) + 1)]);
        if low > high {
            continue;
        }
        let at = 4 * (boxes + 2 * tiles + list * (1 + 2 * ENTRIES as usize));
        let count = words[at] as usize;
        assert!(count <= ENTRIES as usize, "list {list} has {count} entries");
        lists += 1;
        entries += count;
        at_roots += (0..count).filter(|i| roots.contains(&words[at + 4 * (2 + 2 * i) + 3])).count();
    }
    println!("{lists} lists, {entries} entries, {at_roots} of them roots");
    // Most objects of the scene have no other node than their root.
    assert!(lists > tiles && entries > lists && (entries - at_roots) * 10 > entries, "shafts are not used");
    assert!(shafts.words(targets.size) <= targets.lights.shafts);
}
