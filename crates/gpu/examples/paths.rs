//! Speed of path tracing on this machine's GPU: `cargo run --release -p gpu --example paths [SCENE]...`.
//!
//! Scenes are `cornell`, `glass`, `spheres` and `hairy`, at 1920×1080, 64 samples a pixel and a depth of 8, by the
//! megakernel and by the wavefront; the time is the device's own of all passes, after a first frame that nobody counts, and
//! beside it that of the host's clock. `ALHAZEN_PATHS=N,N…` measures the wavefront with so many paths in flight.

#![allow(clippy::disallowed_methods, reason = "no picture is compared with another platform's")]

use backend::{Backend, Control, Integrator, PathSettings, View};
use gpu::tracer::TracerKind;
use gpu::{Gpu, GpuBackend, GpuOptions, PathKernel};
use optics::camera::{CAMERA_PERSPECTIVE, CameraFrame};
use scene::tables::SceneTables;
use std::collections::BTreeMap;
use std::error::Error;
use std::sync::Arc;
use std::time::{Duration, Instant};

const RUNS: usize = 5;

fn main() -> Result<(), Box<dyn Error>> {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    type Make = fn() -> scene::Scene;
    let scenes: [(&str, Make); 4] = [
        ("cornell", testkit::scenes::cornell),
        ("glass", testkit::scenes::glass),
        ("spheres", testkit::scenes::spheres),
        ("hairy", || testkit::scenes::hairy(7, 7)),
    ];
    let small = std::env::var_os("ALHAZEN_SMALL").is_some(); // to try the program on a software driver
    let (width, height, samples) = if small { (192, 108, 4) } else { (1920, 1080, 64) };
    let in_flight = match std::env::var("ALHAZEN_PATHS") {
        Ok(list) => list.split(',').map(str::parse).collect::<Result<Vec<u32>, _>>()?,
        Err(_) => vec![1 << 20],
    };
    for (name, make) in scenes.into_iter().filter(|(n, _)| wanted.is_empty() || wanted.iter().any(|w| w == n))
    {
        let scene = make();
        let tables = Arc::new(SceneTables::build(&scene));
        for kind in TracerKind::ALL {
            let gpu = Gpu::open(&GpuOptions::default())?;
            let device = gpu.describe();
            let Ok(mut backend) = GpuBackend::new(gpu, kind) else { continue };
            let start = Instant::now();
            let stats = backend.load(tables.clone())?;
            let load = start.elapsed().as_secs_f64();
            let build = stats.build.as_secs_f64();
            println!("{name} {}: load {load:.2} s of which build {build:.2} s; {device}", kind.name());
            let settings = PathSettings { max_depth: 8, ..PathSettings::default() };
            let view = View {
                camera: camera_frame(&scene.cameras[0], width as f32 / height as f32),
                width,
                height,
                window: film::Rect { x: 0, y: 0, width, height },
                integrator: Integrator::Path(settings),
                single_scatter: false,
                sampler: backend::SamplerKind::Sobol,
                seed: 1,
                first_sample: 0,
                aovs: Vec::new(),
                shutter: None,
            };
            backend.set_path_kernel(PathKernel::Megakernel);
            measure(&mut backend, &view, samples)?;
            if kind != TracerKind::Pipeline {
                for &paths in &in_flight {
                    backend.set_path_kernel(PathKernel::Wavefront);
                    backend.set_paths_in_flight(paths);
                    measure(&mut backend, &view, samples)?;
                }
            }
        }
    }
    Ok(())
}

/// Renders some frames and prints how fast it was, and where the time went.
fn measure(backend: &mut GpuBackend, view: &View, samples: u32) -> Result<(), Box<dyn Error>> {
    let mut view = view.clone();
    let (mut speeds, mut wall, mut rays) = (Vec::new(), Vec::new(), 0);
    for run in 0..=RUNS {
        backend.take_passes();
        let done = backend.render(&view, samples, &Control::default())?;
        view.first_sample += samples;
        let seconds = done.device_time.unwrap_or(done.elapsed).as_secs_f64();
        rays = done.rays;
        if run > 0 {
            speeds.push(done.samples as f64 / seconds * 1e-6);
            wall.push(done.samples as f64 / done.elapsed.as_secs_f64() * 1e-6);
        }
    }
    speeds.sort_by(f64::total_cmp);
    wall.sort_by(f64::total_cmp);
    let mut shares = BTreeMap::<&str, Duration>::new();
    for pass in backend.take_passes() {
        *shares.entry(pass.name).or_default() += pass.duration;
    }
    let total: Duration = shares.values().sum();
    let share = |t: &Duration| 100.0 * t.as_secs_f64() / total.as_secs_f64().max(1e-9);
    let shares: Vec<_> = shares.iter().map(|(name, t)| format!("{name} {:.0} %", share(t))).collect();
    println!(
        "  {}: {:.1} Msamples/s ({:.1} to {:.1}; {:.1} by the host's clock), {:.2} rays a sample, {:.1} MB; {}",
        backend.kernel().unwrap_or("?"),
        speeds[RUNS / 2],
        speeds[0],
        speeds[RUNS - 1],
        wall[RUNS / 2],
        rays as f64 / (f64::from(view.width) * f64::from(view.height) * f64::from(samples)),
        backend.memory_bytes() as f64 * 1e-6,
        shares.join(", "),
    );
    Ok(())
}

fn camera_frame(camera: &scene::Camera, aspect: f32) -> CameraFrame {
    let axis = (camera.target - camera.eye).normalize();
    let right = axis.cross(camera.up).normalize();
    let up = right.cross(axis);
    let half_height = match camera.projection {
        scene::Projection::Perspective { fov_y } => (fov_y * 0.5).tan(),
        _ => 1.0,
    };
    let v = |v: glam::Vec3| optics::vec3f(v.x, v.y, v.z);
    CameraFrame {
        kind: CAMERA_PERSPECTIVE,
        origin: v(camera.eye),
        right: v(right),
        up: v(up),
        forward: v(axis),
        half_size: optics::vec2f(half_height * aspect, half_height),
        lens_radius: 0.0,
        focus_distance: 1.0,
        distortion: optics::distortion::no_distortion(),
    }
}
