//! Denoising rendered pictures.

mod common;

use alhazen::{
    Backend, BackendError, Control, Denoiser, Film, Image, Job, Limits, LoadStats, NoisyPicture, PassStats,
    PixelSamples, Renderer, Scene, View, metrics,
};
use common::job;
use cpu::CpuBackend;
use post::NetworkInput;
use scene::tables::{Changes, SceneTables};
use std::sync::Arc;
use testkit::scenes;

const WIDTH: u32 = 64;
const HEIGHT: u32 = 48;

fn render(scene: &Scene, seed: u32, spp: u32) -> Film {
    let mut renderer = Renderer::cpu(None).unwrap();
    renderer.load(scene).unwrap();
    let job = Job { seed, aovs: NoisyPicture::LAYERS.to_vec(), ..job(scene, WIDTH, HEIGHT, 8) };
    renderer.render(&job, &Limits { spp, ..Limits::default() }, &Control::new()).unwrap();
    renderer.film().unwrap().unwrap().clone()
}

/// On every test scene the picture comes nearer to the truth, and its light stays.
#[test]
fn the_error_is_lower_on_every_scene() {
    for scene in [scenes::cornell(), scenes::spheres(), scenes::glass(), scenes::assortment()] {
        let truth = render(&scene, 99, 512).to_image();
        let film = render(&scene, 1, 8);
        let denoised = Denoiser::Network.run(&film).unwrap();
        let error = |image: &Image| metrics::rel_mse(&truth, image).unwrap();
        let (before, after) = (error(&film.to_image()), error(&denoised.picture));
        println!("{}: {before} became {after}", scene.name);
        assert!(after < before, "{}: {before} became {after}", scene.name);
        for (before, after) in film.mean().into_iter().zip(denoised.picture.mean()) {
            assert!((after / before - 1.0).abs() < 0.01, "{}: mean {before} became {after}", scene.name);
        }
    }
}

#[test]
fn what_a_film_lacks_is_named() {
    let mut sampled = Film::new(2, 2).unwrap();
    sampled.pixels_mut().iter_mut().for_each(|p| p.add_all([[1.0; 3]; 4]));
    let error = Denoiser::Network.run(&sampled).unwrap_err().to_string();
    assert!(error.contains("albedo"), "{error}");
}

/// Of one sample per pixel nobody knows the variance.
#[test]
fn single_samples_are_denoised() {
    let scene = scenes::cornell();
    let truth = render(&scene, 99, 256).to_image();
    let film = render(&scene, 1, 1);
    let denoised = Denoiser::Network.run(&film).unwrap().picture;
    let error = |image: &Image| metrics::rel_mse(&truth, image).unwrap();
    assert!(error(&denoised) < error(&film.to_image()) / 4.0);
}

/// The library itself, if it is there: where the system looks for libraries, or where `ALHAZEN_OIDN` says.
#[test]
fn open_image_denoise_is_used_if_it_is_asked_for() {
    if std::env::var_os("ALHAZEN_OIDN").is_none()
        && Denoiser::Oidn.run(&render(&scenes::cornell(), 1, 2)).is_err()
    {
        eprintln!("skipped: Open Image Denoise is not there; ALHAZEN_OIDN says where it is");
        return;
    }
    let film = render(&scenes::cornell(), 1, 4);
    let denoised = Denoiser::Oidn.run(&film).expect("the library runs");
    assert!(denoised.by.contains("Open Image Denoise"), "{}", denoised.by);
    // It does not keep means, and so small a picture does not always get nearer to the truth; but smoother it gets.
    let roughness = |image: &Image| {
        let steps = image.data().windows(4).map(|v| f64::from((v[3] - v[0]).abs()));
        steps.sum::<f64>()
    };
    let (before, after) = (roughness(&film.to_image()), roughness(&denoised.picture));
    assert!(after < 0.8 * before, "{before} became {after}");
    for (before, after) in film.mean().into_iter().zip(denoised.picture.mean()) {
        assert!((after / before - 1.0).abs() < 0.25, "mean {before} became {after}");
    }
}

/// A back end with a device that denoises: it paints everything in one colour.
struct Painter(CpuBackend, [f32; 3]);

impl Backend for Painter {
    fn name(&self) -> &'static str {
        "painter"
    }

    fn describe(&self) -> String {
        "a painter".into()
    }

    fn load(&mut self, scene: Arc<SceneTables>) -> Result<LoadStats, BackendError> {
        self.0.load(scene)
    }

    fn update(&mut self, scene: Arc<SceneTables>, changes: Changes) -> Result<LoadStats, BackendError> {
        self.0.update(scene, changes)
    }

    fn render(&mut self, view: &View, samples: u32, control: &Control) -> Result<PassStats, BackendError> {
        self.0.render(view, samples, control)
    }

    fn render_pixels(
        &mut self,
        view: &View,
        pixels: &[PixelSamples],
        control: &Control,
    ) -> Result<PassStats, BackendError> {
        self.0.render_pixels(view, pixels, control)
    }

    fn restart(&mut self) {
        self.0.restart();
    }

    fn film(&mut self) -> Result<Option<&Film>, BackendError> {
        self.0.film()
    }

    fn filter_noise(&mut self, _picture: &NetworkInput<'_>) -> Option<Image> {
        Some(Image::from_fn(WIDTH, HEIGHT, |_, _| self.1))
    }
}

/// Where there is a device that denoises, its result is taken, and the picture's light is restored as always.
#[test]
fn the_device_that_renders_denoises() {
    let film = render(&scenes::cornell(), 1, 4);
    let noisy = NoisyPicture::of_film(&film).unwrap();
    let on_cpu = Renderer::cpu(None).unwrap().denoise(Denoiser::Network, &noisy).unwrap();
    assert_eq!(on_cpu.by, "Alhazen's network");
    assert!(on_cpu.picture == Denoiser::Network.run(&film).unwrap().picture);
    let colour = [0, 1, 2].map(|c| 1.1 * film.mean()[c] as f32);
    let painter = Painter(CpuBackend::new(None).unwrap(), colour);
    let mut renderer = Renderer::new(Box::new(painter));
    let painted = renderer.denoise(Denoiser::Network, &noisy).unwrap();
    assert_eq!(painted.by, "Alhazen's network (a painter)");
    assert!(painted.picture != on_cpu.picture);
    for (before, after) in film.mean().into_iter().zip(painted.picture.mean()) {
        assert!((after / before - 1.0).abs() < 0.01, "mean {before} became {after}");
    }
}
