//! The GPU's two ways to follow paths against each other: the megakernel and the wavefront take the same decisions with the
//! same random numbers, so their samples are the same but for rounding.

mod common;

use alhazen::gpu::tracer::TracerKind;
use alhazen::gpu::{Gpu, GpuBackend, GpuError, GpuOptions, has_hardware};
use alhazen::{
    Adaptive, Aov, Control, Environment, Film, Integrator, Job, Limits, LoadOptions, Mis, PathKernel,
    PathSettings, Renderer, SamplerKind, Sampling, Scene, Source, Summary, Switch,
};
use common::{SHINES, in_turn, path};
use scene::tables::SceneTables;
use testkit::{Exclusive, scenes};

const SIZE: u32 = 32;
const SPP: u32 = 8;

/// A pair of renderers that differ in their path kernel.
struct Pair {
    megakernel: Renderer,
    wavefront: Renderer,
}

/// For every way of tracing that has a wavefront on this machine.
fn pairs(test: &str) -> Exclusive<Vec<Pair>> {
    let pair = |kind: TracerKind| {
        let megakernel = open(kind, PathKernel::Megakernel)?;
        Ok(Pair { megakernel, wavefront: open(kind, PathKernel::Wavefront)? })
    };
    let skipped = |error: GpuError| testkit::skip_without_gpu(test, &error.to_string());
    let kinds = [TracerKind::Bvh, TracerKind::Query].into_iter();
    Exclusive::new(has_hardware(), || kinds.filter_map(|kind| pair(kind).map_err(skipped).ok()).collect())
}

fn open(kind: TracerKind, kernel: PathKernel) -> Result<Renderer, GpuError> {
    let mut backend = GpuBackend::new(Gpu::open(&GpuOptions::default())?, kind)?;
    backend.set_path_kernel(kernel);
    // Several waves a picture.
    backend.set_paths_in_flight(3000);
    Ok(Renderer::new(Box::new(backend)))
}

fn render(renderer: &mut Renderer, scene: &Scene, job: &Job) -> (Film, Summary) {
    renderer.load(scene).expect("load");
    let limits = Limits { spp: SPP, ..Limits::default() };
    let summary = renderer.render(job, &limits, &Control::new()).expect("render");
    (renderer.film().expect("film").expect("rendered").clone(), summary)
}

fn job(scene: &Scene) -> Job {
    Job { integrator: path(6), ..common::job(scene, SIZE, SIZE, 6) }
}

/// Share of the pixels that differ by more than rounding.
fn differing_share(a: &Film, b: &Film) -> f64 {
    let level = b.mean().iter().sum::<f64>() / 3.0;
    let differs = |(a, b): (&film::PixelStats, &film::PixelStats)| {
        let pairs = a.mean().into_iter().zip(b.mean());
        pairs.into_iter().any(|(a, b)| (a - b).abs() > 1e-3 * (a.abs() + b.abs()) + 1e-5 * level)
    };
    let differing = a.pixels().iter().zip(b.pixels()).filter(|&pair| differs(pair)).count();
    differing as f64 / a.pixels().len() as f64
}

/// Renders with both kernels; `share` of the pixels may differ, because rounding may tip a decision.
fn compare(pair: &mut Pair, scene: &Scene, job: &Job, share: f64) {
    let (expected, on_megakernel) = render(&mut pair.megakernel, scene, job);
    let (film, summary) = render(&mut pair.wavefront, scene, job);
    let name = format!("{} on {}", scene.name, pair.wavefront.backend_name());
    let kernels = (pair.megakernel.kernel(), pair.wavefront.kernel());
    assert_eq!(kernels, (Some("megakernel"), Some("wavefront")), "{name}");
    assert_eq!(film.total_samples(), expected.total_samples(), "{name}");
    assert_eq!(film.invalid_samples(), expected.invalid_samples(), "{name}");
    assert_eq!((summary.spp, summary.samples), (on_megakernel.spp, on_megakernel.samples), "{name}");
    let differing = differing_share(&film, &expected);
    let rays = summary.rays as f64 / on_megakernel.rays as f64;
    println!("{name}: {:.2} % of pixels differ, {rays:.5} of the rays", 100.0 * differing);
    assert!(expected.mean().iter().all(|m| *m > 0.0), "{name} is black");
    assert!(differing <= share, "{name}: {:.1} % of the pixels differ", 100.0 * differing);
    assert!((rays - 1.0).abs() < 2e-3, "{name}: {rays} of the rays");
}

/// The same for lists of pixels, with layers: what adaptive sampling asks for. Rounding may also tip which pixel gets more.
fn compare_adaptive(pair: &mut Pair, scene: &Scene, job: &Job) {
    let render = |renderer: &mut Renderer| {
        renderer.load(scene).expect("load");
        let sampling = Sampling::Adaptive(Adaptive { min_spp: 4, floor: None });
        let limits = Limits { spp: 2 * SPP, sampling, ..Limits::default() };
        renderer.render(job, &limits, &Control::new()).expect("render");
        renderer.film().expect("film").expect("rendered").clone()
    };
    let (expected, film) = (render(&mut pair.megakernel), render(&mut pair.wavefront));
    let counts = |film: &Film| film.pixels().iter().map(film::PixelStats::taken).collect::<Vec<_>>();
    let (a, b) = (counts(&expected), counts(&film));
    assert!(a.iter().max() >= a.iter().min().map(|n| 2 * n).as_ref(), "the samples are spread evenly");
    // A decision that rounding has tipped in one pixel may change by one quantum what those around it get.
    let same: Vec<usize> = (0..a.len()).filter(|&i| a[i] == b[i]).collect();
    assert!(4 * same.len() >= 3 * a.len(), "only {} of {} pixels have the same count", same.len(), a.len());
    let differs = |&&i: &&usize| {
        let pairs = expected.pixels()[i].mean().into_iter().zip(film.pixels()[i].mean());
        pairs.into_iter().any(|(a, b)| (a - b).abs() > 1e-3 * (a.abs() + b.abs()) + 1e-5)
    };
    let differing = same.iter().filter(differs).count();
    assert!(differing * 20 <= same.len(), "{differing} of {} pixels with the same count differ", same.len());
}

/// Diffuse, glass, every material and light with partial coverage, an environment image's place taken by a bright sky, many
/// instances.
#[test]
fn test_scenes_are_the_same() {
    let mut sky = scenes::spheres();
    sky.environment = Environment::Constant(glam::Vec3::new(0.5, 0.7, 1.0));
    let scenes = [scenes::cornell(), scenes::glass(), scenes::assortment(), sky, scenes::hairy(2, 3)];
    for pair in pairs("test_scenes_are_the_same").iter_mut() {
        for scene in &scenes {
            compare(pair, scene, &job(scene), 0.02);
        }
    }
}

#[test]
fn builtin_scenes_are_the_same() {
    let mut pairs = pairs("builtin_scenes_are_the_same");
    // Software drivers take minutes to compile layers, and both kernels call the same text for them.
    let builtins = alhazen::builtin::list().into_iter().filter(|b| b.name != "layers");
    for (turn, builtin) in builtins.enumerate() {
        let scene = Source::parse(builtin.name).load(&LoadOptions::default()).expect("built in").scene;
        for pair in in_turn(&mut pairs, turn) {
            compare(pair, &scene, &job(&scene), 0.02);
        }
    }
}

/// Roulette, splitting, a limit of indirect light, Sobol points, a lens, a crop, single scattering and layers at once.
#[test]
fn every_setting_is_the_same() {
    let scene = scenes::assortment();
    let settings = PathSettings {
        max_depth: 12,
        roulette_start: 2,
        roulette_min_survival: 0.2,
        splitting: 3,
        mis: Mis::Light,
        clamp_indirect: Some(1.0),
        caustics: Switch::Off,
        guiding: Switch::Off,
    };
    let mut job = Job {
        integrator: Integrator::Path(settings),
        sampler: SamplerKind::Sobol,
        single_scatter: true,
        seed: 7,
        crop: Some(alhazen::Rect { x: 5, y: 9, width: 21, height: 17 }),
        aovs: vec![
            Aov::Albedo,
            Aov::Normal,
            Aov::DenoisingAlbedo,
            Aov::DenoisingNormal,
            Aov::SampleCount,
            Aov::Depth,
        ],
        ..job(&scene)
    };
    job.camera.lens_radius = 0.05;
    job.camera.focus_distance = 6.0;
    for pair in pairs("every_setting_is_the_same").iter_mut() {
        compare(pair, &scene, &job, 0.02);
        let layers = [&mut pair.megakernel, &mut pair.wavefront].map(|renderer| {
            let film = renderer.film().expect("film").expect("rendered");
            job.aovs.iter().map(|&aov| format!("{:?}", film.aov(aov).expect("asked for"))).collect::<Vec<_>>()
        });
        assert_eq!(layers[0], layers[1]);
        compare_adaptive(pair, &scene, &job);
    }
}

/// Last segments that only ask whether they escape, or are left out, find what they would if all asked what they hit; and a scene
/// that is said to have no lamps loses light.
#[test]
fn last_segments_lose_no_light() {
    let mut sky = scenes::spheres();
    sky.environment = Environment::Constant(glam::Vec3::new(0.5, 0.7, 1.0));
    for pair in pairs("last_segments_lose_no_light").iter_mut() {
        for scene in [scenes::cornell(), scenes::assortment(), sky.clone()] {
            for renderer in [&mut pair.wavefront, &mut pair.megakernel] {
                let [film, expected, dark] = SHINES.map(|shines| {
                    renderer.load_tables(shines(SceneTables::build(&scene))).expect("load");
                    let job = Job { integrator: path(3), ..job(&scene) };
                    let limits = Limits { spp: 8 * SPP, ..Limits::default() };
                    let rays = renderer.render(&job, &limits, &Control::new()).expect("render").rays;
                    (renderer.film().expect("film").expect("rendered").clone(), rays)
                });
                let name = format!("{} on {}, {:?}", scene.name, renderer.backend_name(), renderer.kernel());
                let share = differing_share(&film.0, &expected.0);
                assert!(share < 0.005, "{name}: {:.1} % of the pixels differ", 100.0 * share);
                if scene.environment == Environment::Black {
                    assert!(10 * film.1 < 9 * expected.1, "{name}: {} rays of {}", film.1, expected.1);
                    let missed = differing_share(&dark.0, &expected.0);
                    assert!(missed > 0.02, "{name}: only {:.1} % of the pixels miss light", 100.0 * missed);
                }
            }
        }
    }
}

/// What the comparison is worth: paths that end one vertex early are noticed.
#[test]
fn a_missing_vertex_is_noticed() {
    let scene = scenes::cornell();
    for pair in pairs("a_missing_vertex_is_noticed").iter_mut().take(1) {
        let (expected, _) = render(&mut pair.megakernel, &scene, &job(&scene));
        let (short, _) = render(&mut pair.wavefront, &scene, &Job { integrator: path(5), ..job(&scene) });
        assert!(differing_share(&short, &expected) > 0.5);
    }
}

/// Passes have the names of the stages; a wave is cancelled like any batch.
#[test]
fn stages_are_timed_and_cancelled() {
    let scene = scenes::cornell();
    for Pair { wavefront: renderer, .. } in pairs("stages_are_timed_and_cancelled").iter_mut() {
        render(renderer, &scene, &job(&scene));
        let passes = renderer.take_passes();
        for name in ["generate", "extend", "shade", "connect", "accumulate"] {
            assert!(passes.iter().any(|p| p.name == name) || passes.is_empty(), "{name}: {passes:?}");
        }
        let control = Control::new();
        let summary = std::thread::scope(|scope| {
            scope.spawn(|| {
                std::thread::sleep(std::time::Duration::from_millis(300));
                control.cancel();
            });
            let endless = Limits { spp: 1 << 20, ..Limits::default() };
            renderer.render(&job(&scene), &endless, &control).expect("render")
        });
        assert!(summary.cancelled && summary.elapsed.as_secs_f64() < 4.0, "{:?}", summary.elapsed);
        let film = renderer.film().expect("film").expect("rendered");
        assert!(film.total_samples() > 0 && film.mean().iter().all(|m| *m > 0.0));
    }
}

/// Where there is no wavefront, who asks for one hears so and gets his picture all the same.
#[test]
fn pipelines_say_that_they_have_no_wavefront() {
    let test = "pipelines_say_that_they_have_no_wavefront";
    let opened = Exclusive::new(has_hardware(), || open(TracerKind::Pipeline, PathKernel::Wavefront));
    if let Err(error) = &*opened {
        return testkit::skip_without_gpu(test, &error.to_string());
    }
    let mut renderer = opened.map(|renderer| renderer.expect("looked at above"));
    let scene = scenes::cornell();
    let (film, _) = render(&mut renderer, &scene, &job(&scene));
    assert!(film.mean().iter().all(|m| *m > 0.0));
    assert_eq!(renderer.kernel(), Some("megakernel"));
    let notices = renderer.take_notices();
    assert!(notices.len() == 1 && notices[0].contains("wavefront"), "{notices:?}");
}
