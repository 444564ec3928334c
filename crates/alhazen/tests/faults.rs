//! Devices that fail at any step: the CPU goes on and the picture is whole, or the error says what
//! happened.

mod common;

use alhazen::gpu::tracer::TracerKind;
use alhazen::gpu::{FaultKind, Gpu, GpuBackend, GpuError, GpuOptions, InjectedFault};
use alhazen::{Control, Fallback, Film, Integrator, Job, Limits, Renderer, Scene, Step, memory_bytes};
use common::on_gpus::{differing_share, render};
use std::ops::ControlFlow;
use testkit::{Exclusive, scenes};

const SIZE: u32 = 8;
const SPP: u32 = 2;

/// First hits only: the smallest kernel of all, since every device compiles its own.
fn job(scene: &Scene) -> Job {
    Job { integrator: Integrator::Aov, ..common::job(scene, SIZE, SIZE, 1) }
}

fn open(fault: Option<InjectedFault>) -> Result<Gpu, GpuError> {
    Gpu::open(&GpuOptions { fault, ..GpuOptions::default() })
}

/// Tries the fault at the first step, at the second, and so on, until it happens no more. Says how often it happened.
fn at_every_step(kind: FaultKind, mut attempt: impl FnMut(Gpu, &str) -> ControlFlow<()>) -> u32 {
    for steps in 0..1000 {
        let fault = InjectedFault::after(steps, kind);
        let gpu = open(Some(fault.clone())).expect("a device that opened before");
        let goes_on = attempt(gpu, &format!("{kind:?} after {steps} steps"));
        if !fault.has_happened() || goes_on.is_break() {
            return steps;
        }
    }
    panic!("{kind:?}: steps do not end")
}

/// One device at a time, or `None` and a visible skip.
fn turn(test: &str) -> Option<Exclusive<()>> {
    let opened = Exclusive::new(true, || open(None));
    if let Err(error) = &*opened {
        testkit::skip_without_gpu(test, &error.to_string());
        return None;
    }
    Some(opened.map(drop))
}

fn expected(scene: &Scene, job: &Job) -> Film {
    render(&mut Renderer::cpu(Some(1)).expect("threads"), scene, job, SPP).0
}

const KINDS: [FaultKind; 3] = [FaultKind::OutOfMemory, FaultKind::Lost, FaultKind::Timeout];

#[test]
fn the_cpu_goes_on_after_any_fault_at_any_step() {
    let Some(_turn) = turn("the_cpu_goes_on_after_any_fault_at_any_step") else { return };
    let scene = scenes::cornell();
    let job = job(&scene);
    let expected = expected(&scene, &job);
    for kind in KINDS {
        let mut whole = 0;
        let times = at_every_step(kind, |gpu, what| {
            let backend = GpuBackend::new(gpu, TracerKind::Bvh);
            let Ok(backend) = backend else { return ControlFlow::Continue(()) };
            let fallback = Fallback::new(Box::new(backend), vec![Step::Cpu(Some(1))]);
            match attempted(&mut Renderer::new(Box::new(fallback)), &scene, &job) {
                Ok(film) => {
                    whole += 1;
                    assert_eq!(film.total_samples(), expected.total_samples(), "{what}");
                    assert!(differing_share(&film, &expected) <= 0.05, "{what}: another picture");
                }
                // The samples are gone with the device, and nobody knows any more which they were.
                Err(told) => {
                    let says_so =
                        ["reading the film", "the device was lost"].iter().any(|t| told.contains(t));
                    assert!(says_so, "{what}: {told}");
                }
            }
            ControlFlow::Continue(())
        });
        println!("{kind:?}: {times} steps, {whole} whole pictures");
        assert!(times >= 3 && 2 * whole > times, "{kind:?}: {whole} whole pictures in {times} steps");
    }
}

#[test]
fn without_another_back_end_the_error_says_what_happened() {
    let Some(_turn) = turn("without_another_back_end_the_error_says_what_happened") else { return };
    let scene = scenes::cornell();
    let job = job(&scene);
    for kind in KINDS {
        let word = match kind {
            FaultKind::OutOfMemory => "out of memory",
            FaultKind::Lost => "lost",
            FaultKind::Timeout => "no answer in time",
        };
        at_every_step(kind, |gpu, what| {
            let told = match GpuBackend::new(gpu, TracerKind::Bvh) {
                Err(error) => full_text(&error),
                Ok(backend) => match attempted(&mut Renderer::new(Box::new(backend)), &scene, &job) {
                    Err(told) => told,
                    // What failed was not needed.
                    Ok(film) => {
                        assert_eq!(film.total_samples(), u64::from(SIZE * SIZE * SPP), "{what}");
                        return ControlFlow::Continue(());
                    }
                },
            };
            assert!(told.contains(word), "{what}: {told}");
            ControlFlow::Continue(())
        });
    }
}

/// The picture, or the whole text of the error.
fn attempted(renderer: &mut Renderer, scene: &Scene, job: &Job) -> Result<Film, String> {
    let limits = Limits { spp: SPP, ..Limits::default() };
    let loaded = renderer.load(scene).map(drop);
    let rendered = loaded.and_then(|()| renderer.render(job, &limits, &Control::new()).map(drop));
    let film = rendered.and_then(|()| renderer.film().map(|film| film.cloned()));
    film.map_err(|error| full_text(&error)).map(|film| film.expect("neither a picture nor an error"))
}

fn full_text(error: &dyn std::error::Error) -> String {
    let causes = std::iter::successors(Some(error), |error| error.source());
    causes.map(ToString::to_string).collect::<Vec<_>>().join(": ")
}

/// Devices that are lost again and again leave nothing behind.
#[test]
fn memory_stays_flat_over_lost_devices() {
    let Some(_turn) = turn("memory_stays_flat_over_lost_devices") else { return };
    let scene = scenes::cornell();
    let job = job(&scene);
    let lose = |times: u32| {
        for _ in 0..times {
            let gpu = open(Some(InjectedFault::after(6, FaultKind::Lost))).expect("a device");
            let backend = GpuBackend::new(gpu, TracerKind::Bvh).expect("a back end");
            let fallback = Fallback::new(Box::new(backend), vec![Step::Cpu(Some(1))]);
            render(&mut Renderer::new(Box::new(fallback)), &scene, &job, 1);
        }
        memory_bytes()
    };
    let (Some(first), Some(last)) = (lose(20), lose(60)) else { return };
    let grown = last.saturating_sub(first) as f64 / 60.0;
    println!("{grown:.0} bytes for each lost device");
    assert!(grown < 200_000.0, "each lost device leaves {grown:.0} bytes");
}
