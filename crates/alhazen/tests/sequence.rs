//! Denoising rendered sequences.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

mod common;

use alhazen::{
    Camera, Control, Denoiser, FrameFilm, Image, Job, Limits, Renderer, Scene, SequenceDenoiser, frame_seed,
    metrics,
};
use common::job;
use glam::{Affine3A, Vec3};
use testkit::scenes;

const WIDTH: u32 = 96;
const HEIGHT: u32 = 64;

fn film(renderer: &mut Renderer, scene: Option<&Scene>, job: &Job, spp: u32) -> FrameFilm {
    renderer.restart();
    renderer.render(job, &Limits { spp, ..Limits::default() }, &Control::new()).unwrap();
    let film = renderer.film().unwrap().unwrap();
    FrameFilm::new(film, &job.view(0.0), scene).unwrap()
}

/// A frame of a camera that goes around.
fn frame_job(scene: &Scene, frame: u32) -> Job {
    let of = job(scene, WIDTH, HEIGHT, 6);
    let (sin, cos) = (0.015 * frame as f32).sin_cos();
    let offset = of.camera.eye - of.camera.target;
    let turned = Vec3::new(offset.x * cos + offset.z * sin, offset.y, offset.z * cos - offset.x * sin);
    let camera = Camera { eye: of.camera.target + turned, ..of.camera.clone() };
    Job { camera, seed: frame_seed(5, frame), aovs: SequenceDenoiser::LAYERS.to_vec(), ..of }
}

/// The camera goes around: frames are nearer to the truth than denoised alone, and steadier, and
/// keep their light.
#[test]
fn frames_of_a_moving_camera_are_cleaner_and_steadier() {
    let scene = scenes::cornell();
    let mut renderer = Renderer::cpu(None).unwrap();
    renderer.load(&scene).unwrap();
    let mut sequence = SequenceDenoiser::default();
    let mut errors: Vec<[(f64, Image); 2]> = Vec::new();
    for frame in 0..6 {
        let job = frame_job(&scene, frame);
        let film = film(&mut renderer, None, &job, 4);
        let together = sequence.denoise(&mut renderer, Denoiser::Network, &film).unwrap().picture;
        let alone = Denoiser::Network.run_on(film.noisy()).unwrap().picture;
        for (before, after) in film.noisy().colour.mean().into_iter().zip(together.mean()) {
            assert!((after / before - 1.0).abs() < 1e-3, "frame {frame}: {before} became {after}");
        }
        if frame == 0 {
            assert!(alone == together, "the first has no history");
        }
        if frame < 4 {
            continue;
        }
        renderer.restart();
        let job = Job { seed: 99, ..job };
        renderer.render(&job, &Limits { spp: 1024, ..Limits::default() }, &Control::new()).unwrap();
        let truth = renderer.film().unwrap().unwrap().to_image();
        errors.push([&alone, &together].map(|picture| {
            let mut error = picture.clone();
            // Tone mapped roughly, so that lamps do not count more than rooms.
            error.data_mut().iter_mut().zip(truth.data()).for_each(|(p, t)| *p = (*p - t) / (t + 0.1));
            (metrics::rel_mse(&truth, picture).unwrap(), error)
        }));
    }
    let [first, last] = [&errors[0], &errors[1]];
    // Absolute values: at edges, which move, squares would count nothing else.
    let change = |i: usize| {
        let pairs = first[i].1.data().iter().zip(last[i].1.data());
        pairs.map(|(a, b)| f64::from((a - b).abs())).sum::<f64>()
    };
    println!("relMSE {} became {}, change {} became {}", last[0].0, last[1].0, change(0), change(1));
    assert!(last[1].0 < last[0].0, "{} became {}", last[0].0, last[1].0);
    assert!(change(1) < change(0) / 1.5, "{} became {}", change(0), change(1));
}

/// A ball that has moved to the right by a metre was to the left, by as many pixels as a metre has;
/// the wall stays, and a ball that changes its shape was nowhere.
#[test]
fn motion_is_that_of_instances_and_camera() {
    let mut scene = scenes::spheres();
    scene.cameras = vec![common::from_above(0.0, 0.0, 20.0, 16.0)];
    scene.instances.iter_mut().for_each(|instance| instance.dynamic = true);
    let mut renderer = Renderer::cpu(None).unwrap();
    renderer.load(&scene).unwrap();
    let job = Job { aovs: SequenceDenoiser::LAYERS.to_vec(), ..job(&scene, WIDTH, HEIGHT, 2) };
    let before = film(&mut renderer, Some(&scene), &job, 2);
    let moved = scene.instances.len() - 1;
    let shift = Affine3A::from_translation(Vec3::X);
    scene.instances[moved].transform = shift * scene.instances[moved].transform;
    renderer.update(&scene).unwrap();
    let after = film(&mut renderer, Some(&scene), &job, 2);
    let surfaces = after.surfaces(Some(before.moment()));
    // The picture is 16 m high.
    let pixels = HEIGHT as f32 / 16.0;
    let (mut moving, mut still) = (0, 0);
    for surface in &surfaces {
        let is_moved = surface.ids[0] == moved as u32;
        let expected = if is_moved { [-pixels, 0.0] } else { [0.0; 2] };
        let error = (surface.back[0] - expected[0]).abs() + surface.back[1].abs();
        assert!(error < 1e-3, "{surface:?}");
        *(if is_moved { &mut moving } else { &mut still }) += 1;
    }
    assert!(moving > 10 && still > 10, "{moving} {still}");
    assert!(after.surfaces(None).iter().all(|s| s.back[0].is_nan()), "a first frame has no past");
    // The camera alone: everything moves, the sky by its angle.
    let mut panned = job.clone();
    panned.camera.eye.x += 0.5;
    panned.camera.target.x += 0.5;
    let panned = film(&mut renderer, Some(&scene), &panned, 2);
    let back = panned.surfaces(Some(after.moment()));
    assert!(back.iter().all(|s| (s.back[0] - 0.5 * pixels).abs() < 1e-3 || s.distance.is_infinite()));
}

#[test]
fn seeds_of_frames_differ_and_begin_with_that_of_the_picture() {
    assert_eq!(frame_seed(7, 0), 7);
    let seeds: std::collections::HashSet<u32> = (0..10_000).map(|frame| frame_seed(7, frame)).collect();
    assert_eq!(seeds.len(), 10_000);
}

#[test]
fn films_without_what_a_sequence_needs_are_refused() {
    let scene = scenes::cornell();
    let mut renderer = Renderer::cpu(None).unwrap();
    renderer.load(&scene).unwrap();
    let job = Job { aovs: alhazen::NoisyPicture::LAYERS.to_vec(), ..job(&scene, 8, 8, 2) };
    renderer.render(&job, &Limits { spp: 2, ..Limits::default() }, &Control::new()).unwrap();
    let error =
        FrameFilm::new(renderer.film().unwrap().unwrap(), &job.view(0.0), None).unwrap_err().to_string();
    assert!(error.contains("`depth`"), "{error}");
}
