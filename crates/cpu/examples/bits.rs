//! Prints hashes of each built-in scene's tables and of two small pictures of it, by paths and by
//! direct light: `cargo run -p cpu --example bits`.
//!
//! `cargo xtask cross --run` compares what it prints on different platforms; see
//! `docs/platforms.md`. With names of scenes it renders only those; after `--spp` comes the number
//! of samples a pixel (4 without).

use backend::{Backend, Control, DirectSettings, Integrator, PathSettings, View};
use glam::Vec3;
use optics::camera::CameraFrame;
use optics::distortion::no_distortion;
use optics::{vec2f, vec3f};
use scene::tables::SceneTables;
use scene::{Camera, Scene};
use std::error::Error;
use std::sync::Arc;

/// Size of the pictures in pixels.
const SIZE: (u32, u32) = (48, 27);

fn main() -> Result<(), Box<dyn Error>> {
    let (mut names, mut spp) = (Vec::new(), 4);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--spp" => spp = arguments.next().ok_or("--spp needs a number")?.parse()?,
            _ => names.push(argument),
        }
    }
    if names.is_empty() {
        names = scene::builtin::list().into_iter().map(|builtin| builtin.name.to_owned()).collect();
    }
    for name in names {
        let scene = scene::builtin::load(&name, &Default::default(), &Default::default())?.scene;
        let tables = Arc::new(SceneTables::build(&scene));
        let path = picture(&tables, view(&scene, Integrator::Path(PathSettings::default())), spp)?;
        let direct = picture(&tables, view(&scene, Integrator::Direct(DirectSettings::default())), spp)?;
        println!("{name}: scene {}, path {path:016x}, direct {direct:016x}", tables.fingerprint());
    }
    Ok(())
}

/// A hash of the exact sums of a picture's pixels.
fn picture(tables: &Arc<SceneTables>, view: View, spp: u32) -> Result<u64, Box<dyn Error>> {
    let mut renderer = cpu::CpuBackend::new(None)?;
    renderer.load(tables.clone())?;
    renderer.render(&view, spp, &Control::new())?;
    let film = renderer.film()?.ok_or("there is no film")?;
    // FNV-1a of what the pixels have summed up, written as text.
    let bytes = film.pixels().iter().flat_map(|pixel| format!("{pixel:?}").into_bytes());
    let hash = |h: u64, byte: u8| (h ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    Ok(bytes.fold(0xcbf2_9ce4_8422_2325, hash))
}

/// What the scene's first camera sees, or one that frames the scene.
fn view(scene: &Scene, integrator: Integrator) -> View {
    let (width, height) = SIZE;
    let aspect = width as f32 / height as f32;
    let camera = scene.cameras.first().cloned().unwrap_or_else(|| scene.framing_camera(aspect));
    View {
        camera: frame(&camera, aspect),
        width,
        height,
        window: film::Rect::full(width, height),
        integrator,
        single_scatter: false,
        sampler: Default::default(),
        seed: 0,
        first_sample: 0,
        aovs: Vec::new(),
        shutter: None,
    }
}

/// The camera as the optics know it, without distortion and with the axis in the picture's centre.
fn frame(camera: &Camera, aspect: f32) -> CameraFrame {
    let vector = |v: Vec3| vec3f(v.x, v.y, v.z);
    let forward = (camera.target - camera.eye).normalize_or(-Vec3::Z);
    let right = forward.cross(camera.up).normalize_or(Vec3::X);
    let half_size = camera.projection.half_size(aspect);
    CameraFrame {
        kind: camera.projection.camera_kind(),
        origin: vector(camera.eye),
        right: vector(right),
        up: vector(right.cross(forward)),
        forward: vector(forward),
        half_size: vec2f(half_size.x, half_size.y),
        lens_radius: camera.lens_radius,
        focus_distance: camera.focus_distance,
        distortion: no_distortion(),
    }
}
