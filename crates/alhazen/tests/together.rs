//! Several back ends on one picture: it is the picture of one of them, whoever made which samples, and whoever is lost.

mod common;

use alhazen::gpu::tracer::TracerKind;
use alhazen::gpu::{FaultKind, Gpu, GpuBackend, GpuError, GpuOptions, InjectedFault};
use alhazen::{
    Adaptive, Aov, Backend, Control, Film, Integrator, Job, Limits, Renderer, Sampling, Scene, Together,
    ViewLayer,
};
use common::on_gpus::{differing_share, render};
use common::path;
use cpu::CpuBackend;
use testkit::{Exclusive, scenes};

const SIZE: u32 = 24;
const SPP: u32 = 24;

fn job(scene: &Scene, integrator: Integrator) -> Job {
    let aovs = vec![Aov::Depth, Aov::Normal, Aov::Albedo, Aov::InstanceId];
    Job { integrator, aovs, ..common::job(scene, SIZE, SIZE, 4) }
}

fn processor() -> Box<dyn Backend> {
    Box::new(CpuBackend::new(Some(1)).expect("threads"))
}

fn alone() -> Renderer {
    Renderer::new(processor())
}

fn processors(count: usize) -> Renderer {
    Renderer::new(Box::new(Together::new((0..count).map(|_| processor()).collect())))
}

/// Two logical devices on one adapter, the first of which may fail, and a processor.
fn devices(fault: Option<InjectedFault>) -> Result<Renderer, GpuError> {
    let open = |fault| -> Result<Box<dyn Backend>, GpuError> {
        let gpu = Gpu::open(&GpuOptions { fault, ..GpuOptions::default() })?;
        Ok(Box::new(GpuBackend::new(gpu, TracerKind::Bvh)?))
    };
    let members = vec![open(fault)?, open(None)?, processor()];
    Ok(Renderer::new(Box::new(Together::new(members))))
}

fn assert_same_layers(a: &Film, b: &Film) {
    for aov in a.aovs() {
        assert_eq!(a.aov(*aov), b.aov(*aov), "{aov}");
    }
}

#[test]
fn processors_make_the_picture_of_one_bit_for_bit() {
    for scene in [scenes::cornell(), scenes::assortment()] {
        let job = job(&scene, path(4));
        let (expected, one) = render(&mut alone(), &scene, &job, SPP);
        for count in [1, 2, 3] {
            let (film, summary) = render(&mut processors(count), &scene, &job, SPP);
            assert_eq!((summary.samples, summary.rays), (one.samples, one.rays), "{count} processors");
            assert!(film.pixels() == expected.pixels(), "{count} processors");
            assert_same_layers(&film, &expected);
        }
    }
}

#[test]
fn adaptive_samples_go_through_all_of_them() {
    let scene = scenes::cornell();
    let job = Job { aovs: Vec::new(), ..job(&scene, path(4)) };
    let limits = Limits { spp: 32, sampling: Sampling::Adaptive(Adaptive::default()), ..Limits::default() };
    let adaptively = |mut renderer: Renderer| {
        renderer.load(&scene).expect("a scene");
        let summary = renderer.render(&job, &limits, &Control::new()).expect("a picture");
        (renderer.film().expect("a film").expect("rendered").clone(), summary)
    };
    let (expected, one) = adaptively(alone());
    let (film, two) = adaptively(processors(2));
    assert_eq!((one.samples, one.spp), (two.samples, two.spp));
    assert!(film.pixels() == expected.pixels());
}

#[test]
fn whoever_is_told_to_stop_stops() {
    let scene = scenes::cornell();
    let mut renderer = processors(2);
    renderer.load(&scene).expect("a scene");
    let control = Control::new();
    control.cancel();
    let limits = Limits { spp: 1 << 20, ..Limits::default() };
    let summary = renderer.render(&job(&scene, path(4)), &limits, &control).expect("stopped");
    assert_eq!(summary.samples, 0);
    let control = Control::new();
    std::thread::scope(|scope| {
        let (renderer, control, scene) = (&mut renderer, &control, &scene);
        let working = scope.spawn(move || renderer.render(&job(scene, path(4)), &limits, control));
        while control.progress().samples_done == 0 {
            std::thread::yield_now();
        }
        control.cancel();
        let summary = working.join().expect("no panic").expect("stopped");
        assert!(summary.cancelled && summary.samples > 0);
    });
}

#[test]
fn views_are_shared_too() {
    let scene = scenes::cornell();
    let cameras = vec![scene.default_camera(); 5];
    let batch = job(&scene, path(3)).views(&cameras, &[], vec![ViewLayer::Rgb, ViewLayer::Instance], 2);
    let made = |mut renderer: Renderer| {
        renderer.load(&scene).expect("a scene");
        renderer.render_views(&batch, &Control::new()).expect("views").0
    };
    assert_eq!(made(processors(3)), made(alone()));
}

#[test]
fn devices_and_a_processor_make_the_same_picture_whoever_is_lost() {
    let test = "devices_and_a_processor_make_the_same_picture_whoever_is_lost";
    let scene = scenes::cornell();
    // First hits only: the smallest kernel of all, since every device compiles its own.
    let job = job(&scene, Integrator::Aov);
    let (expected, _) = render(&mut alone(), &scene, &job, SPP);
    let same = |film: &Film, what: &str| {
        assert_eq!(film.total_samples(), expected.total_samples(), "{what}");
        assert!(differing_share(film, &expected) <= 0.05, "{what}: another picture");
    };
    let mut lost = 0;
    for steps in [None, Some(0), Some(25), Some(60), Some(75), Some(90)] {
        let fault = steps.map(|steps| InjectedFault::after(steps, FaultKind::Lost));
        let opened = Exclusive::new(true, || devices(fault.clone()));
        opened.map(|opened| {
            let mut renderer = match opened {
                Ok(renderer) => renderer,
                Err(_) if fault.as_ref().is_some_and(InjectedFault::has_happened) => return,
                Err(error) => return testkit::skip_without_gpu(test, &error.to_string()),
            };
            let what = format!("lost after {steps:?} steps");
            let (film, summary) = render(&mut renderer, &scene, &job, SPP);
            assert_eq!(summary.spp, SPP, "{what}");
            same(&film, &what);
            let notices = renderer.take_notices();
            if fault.is_some_and(|fault| fault.has_happened()) {
                lost += 1;
                assert!(notices.iter().any(|n| n.contains("go on without it")), "{what}: {notices:?}");
            } else {
                assert!(notices.is_empty(), "{what}: {notices:?}");
            }
        });
    }
    println!("{lost} devices were lost");
}
