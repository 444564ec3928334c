//! The same picture, bit for bit, however the work is divided; and what becomes of samples that are no numbers.

mod common;

use alhazen::{
    AlphaMode, AmbientOcclusion, Aov, Control, DirectSettings, Integrator, Job, Limits, PathSettings, Rect,
    Renderer, SamplerKind, Scene,
};
use common::{job, path, render, render_with};
use film::Film;
use glam::{Affine3A, Vec3, Vec4};
use scene::{Instance, Light, LightKind, Shape};
use testkit::Random;
use testkit::scenes::{self, Build, covering, dielectric, ground, lambert, metallic_roughness};

/// A little of everything: glass, rough metal, coverage, instances, spheres, several kinds of light.
fn medley() -> Scene {
    let mut scene = scenes::cornell();
    scene.name = "medley".into();
    let glass = scene.add_material(dielectric("glass", 1.5, 0.0));
    scene.add_shape("glass", scenes::sphere([1.8, 2.3, 1.6], 0.6), glass, Affine3A::IDENTITY);
    let metal = scene.add_material(metallic_roughness("metal", [0.9, 0.7, 0.4], 1.0, 0.3));
    let ball = scene.add_mesh("ball", scenes::uv_sphere(24, 12), metal);
    let at = |x: f32, y: f32, z: f32| {
        Affine3A::from_scale_rotation_translation(
            Vec3::splat(0.5),
            glam::Quat::from_rotation_x(0.3),
            Vec3::new(x, y, z),
        )
    };
    scene.instances.last_mut().unwrap().transform = at(4.4, 0.5, 1.0);
    scene.instances.push(Instance::new("again", ball, at(1.0, 0.5, 4.5)));
    let veil = scene.add_material(covering(lambert("veil", [0.2, 0.3, 0.9]), 0.5));
    scene.add_shape(
        "veil",
        Shape::Triangles(ground(0.0, 1.0)),
        veil,
        Affine3A::from_translation(Vec3::new(2.8, 1.2, 1.0)),
    );
    scene.lights.push(Light::new(
        "point",
        LightKind::Point { position: Vec3::new(1.0, 4.0, 1.0), intensity: Vec3::splat(2.0) },
    ));
    scene
}

fn medley_job(scene: &Scene) -> Job {
    let settings = PathSettings { max_depth: 6, roulette_start: 3, splitting: 2, ..PathSettings::default() };
    let aovs = vec![Aov::Depth, Aov::Normal, Aov::Albedo];
    // Odd sizes, so that bands, blocks and batches are cut off somewhere.
    let sampler = SamplerKind::Sobol;
    Job { integrator: Integrator::Path(settings), aovs, sampler, ..job(scene, 53, 37, 6) }
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let scene = medley();
    let occlusion = Integrator::AmbientOcclusion(AmbientOcclusion { samples: 2, distance: 1.0 });
    for integrator in [path(5), Integrator::Direct(DirectSettings::default()), Integrator::Aov, occlusion] {
        let job = Job { integrator, ..medley_job(&scene) };
        let (one, _) = render_with(&scene, &job, 9, Some(1));
        assert!(one.mean().iter().all(|m| *m > 0.01), "{}: the picture is black", integrator.name());
        for threads in [2, 3, 7] {
            let (many, _) = render_with(&scene, &job, 9, Some(threads));
            assert!(one == many, "{}: {threads} threads give other bits than one", integrator.name());
        }
    }
    // Without first hits, passes over the picture run into one another.
    let job = Job { aovs: Vec::new(), ..medley_job(&scene) };
    let (one, _) = render_with(&scene, &job, 50, Some(1));
    for threads in [2, 5, 64] {
        assert!(one == render_with(&scene, &job, 50, Some(threads)).0, "{threads} threads, several passes");
    }
}

#[test]
fn pictures_made_in_windows_are_the_same_bits() {
    let scene = medley();
    let whole_job = medley_job(&scene);
    let whole = render(&scene, &whole_job, 5);
    let mut random = Random::new(5);
    for _ in 0..3 {
        let (x, y) = (1 + (random.uniform() * 51.0) as u32, 1 + (random.uniform() * 35.0) as u32);
        let windows = [
            Rect { x: 0, y: 0, width: x, height: y },
            Rect { x, y: 0, width: 53 - x, height: y },
            Rect { x: 0, y, width: 53, height: 37 - y },
        ];
        let full = Rect::full(53, 37);
        let mut merged = Film::with_window(53, 37, full, &whole_job.aovs).unwrap();
        for window in windows {
            let job = Job { crop: Some(window), ..whole_job.clone() };
            merged.merge(&render(&scene, &job, 5)).unwrap();
        }
        assert!(merged == whole, "cut at ({x}, {y}), the parts have other bits than the whole");
    }
}

#[test]
fn a_render_in_several_calls_is_the_same_bits() {
    let scene = medley();
    let job = medley_job(&scene);
    let whole = render(&scene, &job, 40);
    let mut renderer = Renderer::cpu(None).unwrap();
    renderer.load(&scene).unwrap();
    let mut view = job.view(0.0);
    for spp in [1, 16, 7, 16] {
        let limits = Limits { spp, ..Limits::default() };
        renderer.render_view(&view, &limits, &Control::new(), &mut |_, _| {}).unwrap();
        view.first_sample += spp;
    }
    assert!(
        renderer.film().unwrap().unwrap() == &whole,
        "40 samples in four calls are other bits than in one"
    );
}

/// One call asks for so many samples that it pays to find out first what lies behind triangles; calls for single ones find that out on the
/// way. Which rays leave out what is the structure's own affair.
#[test]
fn looking_behind_triangles_changes_no_bit() {
    let mut scene = scenes::cornell();
    let glass = scene.add_material(dielectric("glass", 1.5, 0.0));
    let metal = scene.add_material(metallic_roughness("metal", [0.9, 0.7, 0.4], 1.0, 0.3));
    let white = scene.add_material(lambert("white", [0.8; 3]));
    for (x, material) in [(1.0, glass), (2.7, metal), (4.3, white)] {
        let transform = Affine3A::from_scale_rotation_translation(
            Vec3::splat(0.6),
            glam::Quat::IDENTITY,
            Vec3::new(x, 3.0, 2.0),
        );
        let ball = Shape::Triangles(scenes::uv_sphere(16, 8));
        scene.add_shape("ball", ball, material, transform);
    }
    let job = Job { integrator: path(6), ..job(&scene, 48, 48, 3) };
    let whole = render(&scene, &job, 32);
    let mut renderer = Renderer::cpu(None).unwrap();
    renderer.load(&scene).unwrap();
    let mut view = job.view(0.0);
    for _ in 0..32 {
        let limits = Limits { spp: 1, ..Limits::default() };
        renderer.render_view(&view, &limits, &Control::new(), &mut |_, _| {}).unwrap();
        view.first_sample += 1;
    }
    assert!(renderer.film().unwrap().unwrap() == &whole, "rays that say what they leave make other bits");
}

#[test]
fn ranges_of_samples_merge_to_the_same_bits() {
    let scene = medley();
    let job = Job { aovs: Vec::new(), ..medley_job(&scene) };
    let whole = render(&scene, &job, 24);
    let part = |first: u32, spp: u32| {
        let mut renderer = Renderer::cpu(None).unwrap();
        renderer.load(&scene).unwrap();
        let mut view = job.view(0.0);
        view.first_sample = first;
        renderer
            .render_view(&view, &Limits { spp, ..Limits::default() }, &Control::new(), &mut |_, _| {})
            .unwrap();
        renderer.film().unwrap().unwrap().clone()
    };
    let mut merged = part(11, 13);
    merged.merge(&part(0, 11)).unwrap();
    assert!(merged == whole, "two machines with a range of samples each give other bits than one");
}

#[test]
fn seeds_change_the_noise_and_equal_seeds_do_not() {
    let scene = medley();
    let job = medley_job(&scene);
    let other = Job { seed: 1, ..job.clone() };
    assert!(render(&scene, &job, 4) == render(&scene, &job, 4));
    assert!(render(&scene, &job, 4) != render(&scene, &other, 4));
}

#[test]
fn cancelling_keeps_what_is_finished() {
    let scene = medley();
    let job = Job { sampler: SamplerKind::Independent, aovs: Vec::new(), ..medley_job(&scene) };
    let mut renderer = Renderer::cpu(Some(2)).unwrap();
    renderer.load(&scene).unwrap();
    let control = Control::new();
    let limits = Limits { spp: 1_000_000, ..Limits::default() };
    let summary = std::thread::scope(|scope| {
        scope.spawn(|| {
            while control.progress().samples_done < 100_000 {
                std::thread::yield_now();
            }
            control.cancel();
        });
        renderer.render(&job, &limits, &control).unwrap()
    });
    assert!(summary.cancelled);
    let film = renderer.film().unwrap().unwrap();
    assert_eq!(
        film.total_samples(),
        summary.samples,
        "samples were counted that are not on the film, or lost"
    );
    assert!((100_000..50_000_000).contains(&summary.samples), "{summary:?}");
    // No part of the picture is far ahead of the others, but for what was being worked on.
    let mut counts: Vec<_> = film.pixels().iter().map(|p| p.count()).collect();
    counts.sort_unstable();
    let quartiles = [counts[counts.len() / 4], counts[counts.len() * 3 / 4]];
    assert!(quartiles[1] - quartiles[0] <= 32 && quartiles[0] > 0, "{counts:?}");
    // Whole samples only: what is there has the right mean.
    let expected = common::estimate(&scene, &Job { seed: 9, ..job.clone() }, 64);
    common::assert_same_coarse("cancelled", &testkit::Estimate::from_film(film), &expected);
    // Before anything: nothing is lost, nothing hangs.
    let before = Control::new();
    before.cancel();
    assert_eq!(renderer.render(&job, &limits, &before).unwrap().samples, 0);
}

/// A floor under white sky, of which the part right of the middle has something wrong with it.
fn half_broken(break_it: impl Fn(&mut Scene, u32)) -> (Film, alhazen::Summary) {
    let mut scene = Scene { environment: scene::Environment::Constant(Vec3::ONE), ..Scene::default() };
    let good = scene.add_material(lambert("good", [0.5; 3]));
    let bad = scene.add_material(lambert("bad", [0.5; 3]));
    scene.add_shape(
        "good",
        Shape::Triangles(ground(0.0, 1.0)),
        good,
        Affine3A::from_translation(Vec3::NEG_X),
    );
    let mesh =
        scene.add_shape("bad", Shape::Triangles(ground(0.0, 1.0)), bad, Affine3A::from_translation(Vec3::X));
    break_it(&mut scene, mesh);
    scene.cameras.push(common::from_above(0.0, 0.0, 2.0, 2.0));
    render_with(&scene, &job(&scene, 32, 32, 4), 16, None)
}

#[test]
fn samples_that_are_no_numbers_are_dropped_and_counted() {
    let vertex_colors = |scene: &mut Scene, mesh: u32| {
        let Shape::Triangles(triangles) = &mut scene.meshes[mesh as usize].parts[0].shape else {
            unreachable!()
        };
        triangles.colors = vec![Vec4::new(f32::NAN, 1.0, 1.0, 1.0); 4];
    };
    let emission = |scene: &mut Scene, mesh: u32| {
        let material = scene.meshes[mesh as usize].parts[0].material as usize;
        scene.materials[material].emission = Vec3::splat(f32::INFINITY);
    };
    for (what, (film, summary)) in
        [("colour", half_broken(vertex_colors)), ("emission", half_broken(emission))]
    {
        // Half of the picture; the good half sees the bad one not at all, as both are flat.
        assert_eq!(summary.invalid_samples, 32 * 16 * 16, "{what}: invalid samples");
        assert_eq!(film.invalid_samples(), summary.invalid_samples);
        let image = film.to_image();
        assert!(image.data().iter().all(|v| v.is_finite()), "{what}: something is not finite in the picture");
        let good = image.crop(0, 0, 16, 32).mean();
        assert!(good.iter().all(|m| (m - 0.5).abs() < 1e-3), "{what}: the good half shows {good:?}, not 0.5");
    }
}

#[test]
fn alpha_that_is_no_number_does_not_hang() {
    let (film, _) = half_broken(|scene, mesh| {
        let material = scene.meshes[mesh as usize].parts[0].material as usize;
        scene.materials[material].base_color.w = f32::NAN;
        scene.materials[material].alpha_mode = AlphaMode::Blend;
    });
    assert!(film.to_image().data().iter().all(|v| v.is_finite()));
}
