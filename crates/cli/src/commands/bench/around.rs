//! Frames of the real-time path tracer from all around a scene: what `bench realtime` and `bench
//! adaptive` do with --around.

use super::report::{Cell, Percentiles, Plot, Report, Scale, Table};
use super::views::{open_scene, short_name};
use crate::console::say;
use alhazen::gpu::live::LiveScene;
use alhazen::gpu::tracer::TracerKind;
use alhazen::gpu::{Gpu, GpuOptions, has_hardware};
use alhazen::{Camera, Integrator, Job, RealtimeSettings, SamplerKind, Scene, SceneTables, View};
use clap::Args;
use glam::{Quat, Vec3};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Views around scenes.
#[derive(Debug, Args)]
pub struct AroundArgs {
    /// Measure instead the device time of frames of the integrator `realtime` from so many views
    /// around what the camera looks at, standing still at each.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=360))]
    pub around: u32,
    /// Frames at each of these views [default: 1000, or 8 where there is no GPU].
    #[arg(long, value_name = "N", requires = "around", value_parser = clap::value_parser!(u32).range(2..=1_000_000))]
    view_frames: Option<u32>,
}

/// What frames are made of, besides the settings of the integrator.
pub struct Frames<'a> {
    /// Scenes of the command line.
    pub scenes: &'a [String],
    /// Width and height in pixels.
    pub size: (u32, u32),
    /// Which GPU.
    pub adapter: Option<String>,
    /// How samples are drawn.
    pub sampler: SamplerKind,
    /// The settings that are compared, by name.
    pub ways: Vec<(&'static str, RealtimeSettings)>,
}

/// Frames of a view that are not counted: the first ones compile and find no history.
const WARM_UP: u32 = 2;
/// How long nothing is said.
const SILENCE: Duration = Duration::from_secs(5);

/// Cameras on a circle around what `first` looks at, at its height: `around` of them, named by
/// their angle.
pub fn cameras_around(first: &Camera, around: u32) -> Vec<Camera> {
    let camera = |i: u32| {
        let angle = std::f32::consts::TAU * i as f32 / around as f32;
        let eye = first.target + Quat::from_axis_angle(Vec3::Y, angle) * (first.eye - first.target);
        Camera { name: format!("{:.0}°", angle.to_degrees()), eye, path: None, ..first.clone() }
    };
    (0..around).map(camera).collect()
}

impl AroundArgs {
    fn frames(&self) -> u32 {
        self.view_frames.unwrap_or(if has_hardware() { 1000 } else { 8 })
    }

    /// What reports say of the arguments.
    pub fn settings(&self, frames: &Frames) -> anyhow::Result<Vec<(&'static str, String)>> {
        let (width, height) = frames.size;
        Ok(vec![
            ("device", open(frames)?.describe()),
            ("size", format!("{width}×{height}")),
            ("sampler", frames.sampler.to_string()),
            ("views", format!("{} around each scene", self.around)),
            ("frames", format!("{} a view and way, after {WARM_UP}", self.frames())),
        ])
    }

    /// Adds a table of the device time of all views, and a plot for each scene.
    ///
    /// # Errors
    /// When a scene cannot be loaded, or the device fails.
    pub fn measure(&self, frames: &Frames, report: &mut Report) -> anyhow::Result<()> {
        report.text("Device time of a frame of a view that stands still, milliseconds: the median, the 5th and 95th percentile, the first frame and the last.");
        let columns = ["scene", "view", "way", "ms", "p5", "p95", "first", "last", "over first way"];
        let mut table = Table::new("around", "Device time by view, milliseconds", &columns);
        for name in frames.scenes {
            let scene = open_scene(name)?;
            let short = short_name(name);
            let cameras = cameras_around(&scene.default_camera(), self.around);
            let mut live = load(frames, &scene, &cameras[0])?;
            let mut curves = vec![Vec::new(); frames.ways.len()];
            for (number, camera) in (0..).zip(&cameras) {
                let mut first_way = f64::NAN;
                for ((way, settings), curve) in frames.ways.iter().zip(&mut curves) {
                    say!("{short}, view {} of {}: {way}", number + 1, cameras.len());
                    let times = still(&mut live, frames, &scene, camera, *settings, self.frames())?;
                    let p = Percentiles::of(&times);
                    first_way = if first_way.is_nan() { p.p50 } else { first_way };
                    curve.push((f64::from(number), p.p50));
                    let (first, last) = (times.first(), times.last());
                    let end = |ms: Option<&f64>| ms.copied().unwrap_or(f64::NAN);
                    let names = [short.as_str(), camera.name.as_str(), way].map(Cell::from);
                    let numbers = [p.p50, p.p5, p.p95, end(first), end(last), p.p50 / first_way];
                    table.push(names.into_iter().chain(numbers.map(Cell::from)).collect());
                }
            }
            let title = format!("{short}: device time by view");
            let plot = Plot::new(&title, ("view", Scale::Linear), ("ms", Scale::Linear));
            let named = frames.ways.iter().zip(curves);
            report.plot(named.fold(plot, |plot, ((way, _), curve)| plot.with(way, curve)));
        }
        report.table(table);
        Ok(())
    }
}

fn open(frames: &Frames) -> anyhow::Result<Gpu> {
    Ok(Gpu::open(&GpuOptions { adapter: frames.adapter.clone(), ..GpuOptions::default() })?)
}

fn load(frames: &Frames, scene: &Scene, camera: &Camera) -> anyhow::Result<LiveScene> {
    let tables = Arc::new(SceneTables::build(scene));
    let settings = frames.ways.first().map_or_else(RealtimeSettings::default, |(_, settings)| *settings);
    let view = view(frames, scene, camera, settings, 0);
    let gpu = open(frames)?;
    say!("{}: loading and compiling, which takes minutes on a software driver", scene.name);
    Ok(LiveScene::new(gpu, tables, TracerKind::Bvh, &view, 1)?)
}

fn view(frames: &Frames, scene: &Scene, camera: &Camera, settings: RealtimeSettings, number: u32) -> View {
    let (width, height) = frames.size;
    let (camera, integrator, sampler) = (camera.clone(), Integrator::Realtime(settings), frames.sampler);
    let job = Job { camera, width, height, integrator, sampler, ..Job::for_scene(scene) };
    View { first_sample: number, ..job.view(0.0) }
}

/// Device times of the frames of a camera that stands still, milliseconds.
fn still(
    live: &mut LiveScene,
    frames: &Frames,
    scene: &Scene,
    camera: &Camera,
    mut settings: RealtimeSettings,
    count: u32,
) -> anyhow::Result<Vec<f64>> {
    settings.allocation.white = 1.0 / Job::for_scene(scene).tone.exposure.max(1e-6);
    live.forget();
    let mut said = Instant::now();
    for number in 0..WARM_UP + count {
        if number == WARM_UP {
            // A view begins without history: adaptive frames show what that costs.
            live.finish()?;
            live.frames().take_reports();
            live.forget();
        }
        live.frame(&view(frames, scene, camera, settings, number), None)?;
        if said.elapsed() > SILENCE {
            say!("  frame {} of {}", number + 1, WARM_UP + count);
            said = Instant::now();
        }
    }
    live.finish()?;
    let reports = live.frames().take_reports();
    Ok(reports.iter().map(|report| report.device().as_secs_f64() * 1e3).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_are_on_a_circle_that_begins_with_the_camera() {
        let first = Camera::perspective("c", Vec3::new(3.0, 2.0, 0.0), Vec3::new(1.0, 0.0, 0.0), 0.8);
        let cameras = cameras_around(&first, 4);
        assert_eq!(cameras[0].eye, first.eye);
        assert!(cameras[1].eye.distance(Vec3::new(1.0, 2.0, -2.0)) < 1e-5, "{}", cameras[1].eye);
        let same =
            |c: &Camera| ((c.eye - c.target).length() - (first.eye - first.target).length()).abs() < 1e-5;
        assert!(cameras.iter().all(same) && cameras[2].name == "180°");
    }
}
