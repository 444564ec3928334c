//! Every GPU back end against the CPU's: the same scenes, the same random numbers.
//!
//! Both make the same decisions with the same numbers, so pictures agree but for rounding; where rounding tips a decision,
//! a path goes another way and a pixel differs by noise. So most pixels have to agree closely, and all blocks and the whole
//! picture have to agree within the noise.

mod common;

use alhazen::gpu::scene::texels::BINDING_ARRAYS;
use alhazen::gpu::tracer::TracerKind;
use alhazen::gpu::{Gpu, GpuBackend, GpuOptions, has_hardware};
use alhazen::{
    AlphaMode, AmbientOcclusion, Aov, BackendError, Control, DirectSettings, Distortion, Fallback, Film,
    Highlights, Integrator, Job, Limits, LoadOptions, Mis, PathSettings, Renderer, SamplerKind, Scene,
    Source, Step, Switch, View,
};
use common::on_gpus::{SPP, compare_on, differing_share, render};
use common::{gpu_renderers, in_turn, path};
use film::{AovData, AovKind};
use std::time::{Duration, Instant};
use testkit::{Exclusive, scenes};

const SIZE: u32 = 48;
/// Compares every GPU back end with the CPU; `share` of the pixels may differ by more than rounding.
fn compare(test: &str, scene: &Scene, job: &Job, share: f64) {
    compare_on(&mut gpu_renderers(test), test, scene, job, share);
}

fn job(scene: &Scene) -> Job {
    Job { integrator: path(8), ..common::job(scene, SIZE, SIZE, 8) }
}

fn builtin(name: &str) -> Scene {
    Source::parse(name).load(&LoadOptions::default()).expect("built in").scene
}

#[test]
fn cornell_path() {
    let scene = scenes::cornell();
    compare("cornell path", &scene, &job(&scene), 0.02);
}

#[test]
fn everything_path() {
    let scene = scenes::assortment();
    // Partial coverage is decided by the last bits of a hit's coordinates, which are not the same everywhere.
    compare("assortment path", &scene, &job(&scene), 0.35);
}

/// The scene of layers, with rough diffuse reflection where there is any.
fn layers() -> Scene {
    let mut scene = builtin("layers");
    scene.materials.iter_mut().for_each(|material| material.layers.diffuse_roughness = 0.6);
    scene
}

/// Layers and absorption. One tracer is enough: what scatters asks none, and is the same text for all.
#[test]
fn layers_path() {
    let scene = layers();
    let mut renderers = gpu_renderers("layers_path");
    renderers.truncate(1);
    // Refraction of refraction magnifies rounding.
    compare_on(&mut renderers, "layers path", &scene, &job(&scene), 0.2);
}

/// As above: all lobes with lights, sky and what they reflect, and the colours of first hits.
#[test]
fn layers_direct() {
    let scene = layers();
    let mut renderers = gpu_renderers("layers_direct");
    renderers.truncate(1);
    let direct = Integrator::Direct(DirectSettings::default());
    compare_on(&mut renderers, "layers direct", &scene, &Job { integrator: direct, ..job(&scene) }, 0.2);
    compare_on(
        &mut renderers,
        "layers aov",
        &scene,
        &Job { integrator: Integrator::Aov, ..job(&scene) },
        0.05,
    );
}

/// Texture graphs, also as heights, holes and emission. One tracer is enough: what is looked up asks none.
#[test]
fn textures_path() {
    let scene = builtin("textures");
    let mut renderers = gpu_renderers("textures_path");
    renderers.truncate(1);
    // Steps of patterns are found by the last bits of coordinates.
    compare_on(&mut renderers, "textures path", &scene, &job(&scene), 0.2);
}

/// Every tracer asks about holes and sees normals and colours that graphs make.
#[test]
fn textures_aov() {
    let scene = builtin("textures");
    compare("textures aov", &scene, &Job { integrator: Integrator::Aov, ..job(&scene) }, 0.05);
}

#[test]
fn everything_direct() {
    let scene = scenes::assortment();
    let integrator = Integrator::Direct(DirectSettings::default());
    compare("assortment direct", &scene, &Job { integrator, ..job(&scene) }, 0.45);
}

/// Every tracer asks about holes within a distance, with several rays for each sample.
#[test]
fn everything_ambient_occlusion() {
    let scene = scenes::assortment();
    for ambient in [AmbientOcclusion::default(), AmbientOcclusion { samples: 3, distance: 0.4 }] {
        let integrator = Integrator::AmbientOcclusion(ambient);
        compare("assortment ao", &scene, &Job { integrator, ..job(&scene) }, 0.35);
    }
}

/// Roulette, splitting, a limit of indirect light, one way to find it, Sobol points, a lens that bends lines, a crop and single scattering at once.
#[test]
fn every_setting_path() {
    let scene = scenes::assortment();
    let settings = PathSettings {
        max_depth: 12,
        roulette_start: 2,
        roulette_min_survival: 0.2,
        splitting: 3,
        mis: Mis::Bsdf,
        clamp_indirect: Some(1.0),
        caustics: Switch::Off,
        guiding: Switch::Off,
    };
    let mut job = Job {
        integrator: Integrator::Path(settings),
        sampler: SamplerKind::Sobol,
        single_scatter: true,
        seed: 7,
        crop: Some(alhazen::Rect { x: 5, y: 9, width: 31, height: 27 }),
        ..job(&scene)
    };
    job.camera.lens_radius = 0.05;
    job.camera.focus_distance = 6.0;
    // The picture's corners are outside of the lens' field.
    job.camera.distortion =
        Some(Distortion::BrownConrady { k: [-0.8, 0.1, 0.0, 0.0, 0.0, 0.0], p: [0.002, -0.001] });
    job.camera.skew = 0.02;
    compare("settings path", &scene, &job, 0.45);
}

#[test]
fn builtin_scenes_path() {
    let mut renderers = gpu_renderers("builtin_scenes_path");
    // Software drivers take minutes to compile layers and graphs; `layers_path` and `textures_path` compare them once.
    let of_their_own = ["layers", "textures"];
    let builtins = alhazen::builtin::list().into_iter().filter(|b| !of_their_own.contains(&b.name));
    for (turn, builtin) in builtins.enumerate() {
        let scene = self::builtin(builtin.name);
        // Floors that fade decide coverage by the last bits of a hit; in the atrium, shadow rays to the sun pass
        // thousands of leaves, instances of a few, at whose edges rounding decides. Of each choice in the tree of lights
        // rounding is passed on to the next, as many times larger as the choice was improbable.
        let share = match builtin.name {
            "three-spheres" | "model" | "atrium" => 0.25,
            "lanterns" | "offices" => 0.5,
            _ => 0.08,
        };
        let renderers = in_turn(&mut renderers, turn);
        compare_on(renderers, &format!("{} path", builtin.name), &scene, &job(&scene), share);
    }
}

#[test]
fn reference_scenes_path() {
    let mut renderers = gpu_renderers("reference_scenes_path");
    for scene in [scenes::glass(), scenes::spheres(), scenes::hairy(2, 3)] {
        compare_on(&mut renderers, &format!("{} path", scene.name), &scene, &job(&scene), 0.02);
    }
}

#[test]
fn builtin_scenes_direct() {
    let mut renderers = gpu_renderers("builtin_scenes_direct");
    let scene = builtin("lights");
    let taught = DirectSettings {
        highlights: Highlights::Phong,
        falloff: [1.0, 0.09, 0.032],
        ..DirectSettings::default()
    };
    let taught = Job { integrator: Integrator::Direct(taught), ..job(&scene) };
    compare_on(&mut renderers, "lights direct with Phong's highlights", &scene, &taught, 0.2);
    for name in ["three-spheres", "glass"] {
        let scene = builtin(name);
        let integrator = Integrator::Direct(DirectSettings::default());
        compare_on(
            &mut renderers,
            &format!("{name} direct"),
            &scene,
            &Job { integrator, ..job(&scene) },
            0.2,
        );
    }
}

/// The values of a layer as numbers, pixel by pixel.
fn numbers(film: &Film, aov: Aov) -> Vec<Vec<f32>> {
    match film.aov(aov).expect("asked for") {
        AovData::Float(image) => {
            image.data().chunks_exact(aov.channels().len()).map(<[f32]>::to_vec).collect()
        }
        AovData::Integer(ids) => ids.iter().map(|&id| vec![id as f32]).collect(),
        AovData::Shares(_) => panic!("{aov} is no layer of a GPU"),
    }
}

#[test]
fn layers_agree_but_at_silhouettes() {
    let test = "layers_agree_but_at_silhouettes";
    let mut scene = scenes::assortment();
    // Partial coverage is decided by the last bits of a hit's coordinates: here it would hide what is looked for.
    for material in &mut scene.materials {
        if material.alpha_mode == AlphaMode::Blend {
            material.alpha_mode = AlphaMode::Opaque;
        }
        material.checkerboard.iter_mut().for_each(|c| c.fade = None);
    }
    let occlusion = Integrator::AmbientOcclusion(AmbientOcclusion::default());
    for integrator in [Integrator::Aov, path(2), Integrator::Direct(DirectSettings::default()), occlusion] {
        // GPUs refuse mattes, which they do not count.
        let layers = Aov::ALL.into_iter().filter(|a| a.kind() != AovKind::Shares);
        let job = Job { integrator, aovs: layers.collect(), ..job(&scene) };
        let (expected, _) = render(&mut Renderer::cpu(None).expect("threads"), &scene, &job, 4);
        for renderer in gpu_renderers(test).iter_mut() {
            let mattes = View { aovs: vec![Aov::ObjectMatte], ..job.view(0.0) };
            let refused = renderer.render_pass(&mattes, 1, &Control::new());
            assert!(matches!(refused, Err(BackendError::View { .. })), "{refused:?}");
            let (film, _) = render(renderer, &scene, &job, 4);
            assert_eq!(film.invalid_aovs(), expected.invalid_aovs());
            for &aov in job.aovs.iter().filter(|&&a| a != Aov::StandardError) {
                let (a, b) = (numbers(&film, aov), numbers(&expected, aov));
                let close = |(a, b): (&f32, &f32)| (a - b).abs() <= 1e-3 * (1.0 + b.abs());
                let differing = a.iter().zip(&b).filter(|(a, b)| !a.iter().zip(b.iter()).all(close)).count();
                let share = differing as f64 / a.len() as f64;
                let name = renderer.backend_name();
                assert!(
                    share <= 0.01,
                    "{name}, {}: {aov} differs in {:.1} % of the pixels",
                    integrator.name(),
                    100.0 * share
                );
                assert!(b.iter().any(|v| *v != b[0]) || aov == Aov::SampleCount, "{aov} says nothing here");
            }
        }
    }
}

/// Images in a binding array, where the device has those, and in the layers of one texture: the same texels.
#[test]
fn textures_of_their_own_change_nothing() {
    let test = "textures_of_their_own_change_nothing";
    let scene = scenes::assortment();
    let job = Job { integrator: Integrator::Aov, aovs: vec![Aov::Albedo, Aov::Normal], ..job(&scene) };
    let film = |features| {
        let opened =
            Exclusive::new(has_hardware(), || Gpu::open(&GpuOptions { features, ..GpuOptions::default() }));
        let why = match &*opened {
            Ok(gpu) if (features - gpu.features).intersects(BINDING_ARRAYS) => {
                "the device has no binding arrays".into()
            }
            Ok(_) => String::new(),
            Err(error) => error.to_string(),
        };
        if !why.is_empty() {
            testkit::skip_without_gpu(test, &why);
            return None;
        }
        let backend = |gpu| GpuBackend::new(gpu, TracerKind::Bvh);
        let mut renderer =
            opened.map(|gpu| Renderer::new(Box::new(gpu.and_then(backend).expect("any device will do"))));
        Some(render(&mut renderer, &scene, &job, 2).0)
    };
    let all = GpuOptions::default().features;
    let (Some(images), Some(layers)) = (film(all), film(all - BINDING_ARRAYS)) else { return };
    for aov in [Aov::Albedo, Aov::Normal] {
        let (a, b) = (numbers(&images, aov), numbers(&layers, aov));
        assert!(a == b, "{aov} differs");
        assert!(a.iter().any(|v| *v != a[0]), "{aov} says nothing here");
    }
}

/// What the comparison above is worth: other random numbers do not pass for the same.
#[test]
#[should_panic(expected = "of the pixels differ")]
fn other_noise_is_noticed() {
    let scene = scenes::cornell();
    let mut cpu = Renderer::cpu(None).expect("threads");
    let (a, _) = render(&mut cpu, &scene, &job(&scene), SPP);
    let (b, _) = render(&mut cpu, &scene, &Job { seed: 1, ..job(&scene) }, SPP);
    let differing = differing_share(&a, &b);
    assert!(differing <= 0.15, "{:.1} % of the pixels differ", 100.0 * differing);
}

/// A render split into calls has the same samples as one made whole.
#[test]
fn splitting_a_call_changes_nothing_but_rounding() {
    let scene = scenes::cornell();
    for renderer in gpu_renderers("splitting_a_call_changes_nothing_but_rounding").iter_mut() {
        let (whole, _) = render(renderer, &scene, &job(&scene), 9);
        renderer.load(&scene).expect("load");
        let mut view = job(&scene).view(0.0);
        for (first, count) in [(0, 2), (2, 4), (6, 3)] {
            view.first_sample = first;
            let limits = Limits { spp: count, ..Limits::default() };
            renderer.render_view(&view, &limits, &Control::new(), &mut |_, _| {}).expect("render");
            assert!(renderer.film().expect("film").is_some());
        }
        let parts = renderer.film().expect("film").expect("rendered");
        assert_eq!(parts.total_samples(), whole.total_samples());
        assert!(differing_share(parts, &whole) == 0.0);
    }
}

#[test]
fn cancelling_stops_soon_and_keeps_what_is_there() {
    let scene = scenes::cornell();
    for renderer in gpu_renderers("cancelling_stops_soon_and_keeps_what_is_there").iter_mut() {
        renderer.load(&scene).expect("load");
        let job = job(&scene);
        let control = Control::new();
        let once = Limits { spp: 1, ..Limits::default() };
        renderer.render(&job, &once, &control).expect("the kernel is compiled");
        let (summary, waited) = std::thread::scope(|scope| {
            let cancelling = scope.spawn(|| {
                std::thread::sleep(Duration::from_millis(300));
                control.cancel();
                Instant::now()
            });
            let endless = Limits { spp: 1 << 20, ..Limits::default() };
            let summary = renderer.render(&job, &endless, &control).expect("render");
            (summary, cancelling.join().expect("sleeps").elapsed())
        });
        assert!(summary.cancelled);
        // Two dispatches may be under way. Where a program is the GPU, other tests may keep the machine busy.
        let limit = Duration::from_millis(if has_hardware() { 100 } else { 3000 });
        println!("{} stopped after {waited:?}", renderer.backend_name());
        assert!(waited < limit, "{}: {waited:?}", renderer.backend_name());
        let film = renderer.film().expect("film").expect("rendered");
        assert!(film.total_samples() > 0 && film.mean().iter().all(|m| *m > 0.0));
    }
}

/// A renderer on a device with the CPU behind it, and what destroys the device; or `None` and a visible skip.
fn with_fallback(test: &str) -> Option<Exclusive<(Renderer, impl Fn())>> {
    let opened = Exclusive::new(has_hardware(), || Gpu::open(&GpuOptions::default()));
    if let Err(error) = &*opened {
        testkit::skip_without_gpu(test, &error.to_string());
        return None;
    }
    Some(opened.map(|gpu| {
        let gpu = gpu.expect("looked at above");
        let device = gpu.device.clone();
        let kind = if TracerKind::Query.check(&gpu).is_ok() { TracerKind::Query } else { TracerKind::Bvh };
        let backend = GpuBackend::new(gpu, kind).expect("supported");
        let fallback = Fallback::new(Box::new(backend), vec![Step::Cpu(None)]);
        (Renderer::new(Box::new(fallback)), move || device.destroy())
    }))
}

/// A device that is lost in the middle: the CPU goes on with what is there, and the picture is whole.
#[test]
fn a_lost_device_is_replaced_by_the_cpu() {
    let Some(mut opened) = with_fallback("a_lost_device_is_replaced_by_the_cpu") else { return };
    let (renderer, destroy) = &mut *opened;
    let scene = scenes::cornell();
    let job = job(&scene);
    renderer.load(&scene).expect("load");
    let first = Limits { spp: 6, ..Limits::default() };
    renderer.render(&job, &first, &Control::new()).expect("render");
    assert!(renderer.film().expect("film").is_some(), "reading the film makes its samples safe");
    destroy();
    let mut view = job.view(0.0);
    view.first_sample = 6;
    let rest = Limits { spp: 10, ..Limits::default() };
    renderer.render_view(&view, &rest, &Control::new(), &mut |_, _| {}).expect("the CPU goes on");
    assert_eq!(renderer.backend_name(), "cpu");
    let notices = renderer.take_notices();
    assert!(notices.len() == 1 && notices[0].contains("lost") && notices[0].contains("cpu"), "{notices:?}");
    let film = renderer.film().expect("film").expect("rendered").clone();
    let (expected, _) = render(&mut Renderer::cpu(None).expect("threads"), &scene, &job, 16);
    assert_eq!(film.total_samples(), expected.total_samples());
    assert!(differing_share(&film, &expected) <= 0.02);
}

/// As above, but nothing had been moved to the host: those samples are made again.
#[test]
fn samples_lost_with_a_device_are_made_again() {
    let Some(mut opened) = with_fallback("samples_lost_with_a_device_are_made_again") else { return };
    let (renderer, destroy) = &mut *opened;
    let scene = scenes::cornell();
    let job = job(&scene);
    renderer.load(&scene).expect("load");
    let mut view = job.view(0.0);
    let mut samples = |first: u32, count: u32| {
        view.first_sample = first;
        let limits = Limits { spp: count, ..Limits::default() };
        // The facade reads the film at the end of every call; the back end below it does not.
        renderer.render_view(&view, &limits, &Control::new(), &mut |_, _| {}).map(|_| ())
    };
    samples(0, 1).expect("render");
    destroy();
    samples(1, 3).expect("the CPU goes on");
    let film = renderer.film().expect("film").expect("rendered");
    let area = u64::from(SIZE) * u64::from(SIZE);
    assert_eq!(film.total_samples(), 4 * area);
}
