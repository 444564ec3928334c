//! `alhazen bench batches`: how many small pictures a second, as robots and data sets want them.

use super::report::{Cell, Percentiles, Report, ReportArgs, Table};
use super::views::{check_scenes, open_scene, short_name};
use crate::commands::render::parsing::parse_threads;
use crate::console::{print_result, say};
use alhazen::{
    BackendChoice, Camera, Control, Integrator, Job, PathKernel, Renderer, RendererOptions, Scene, ViewLayer,
};
use anyhow::{Context, ensure};
use clap::Args;
use glam::{Quat, Vec3};
use std::time::Instant;

/// Views a second of batches of small pictures, each by a camera of its own.
///
/// The cameras stand where the scene's first one does and look to all sides, other ones in each call. The first call, which
/// compiles shaders, is timed by itself. What the host adds is the share of a call's wall time that the device was not busy.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  alhazen bench batches hotel_room.glb@11500,1300,-8500:9000,900,-3000 --layers depth,normal,instance
  alhazen bench batches cornell --layers rgb --integrator path --spp 4 --max-depth 4 --backend gpu")]
pub struct BatchesArgs {
    /// Scene files or names of built-in scenes, each with the place to look from if that is not the scene's first camera:
    /// `room.glb@EYE:TARGET`, both X,Y,Z.
    #[arg(value_name = "FILE|SCENE[@EYE:TARGET]", default_values_t = ["cornell", "atrium"].map(String::from))]
    scenes: Vec<String>,
    /// Width of the views in pixels.
    #[arg(long, default_value_t = 128, value_parser = clap::value_parser!(u32).range(1..=8192))]
    width: u32,
    /// Height of the views in pixels.
    #[arg(long, default_value_t = 128, value_parser = clap::value_parser!(u32).range(1..=8192))]
    height: u32,
    /// Views of a call.
    #[arg(long, value_name = "N", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    views: u32,
    /// Calls that are counted, after the first.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    calls: u32,
    /// What of each view is wanted: rgb, depth, normal, position, albedo, instance, material, primitive.
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_values_t = [ViewLayer::Depth, ViewLayer::Normal, ViewLayer::Instance])]
    layers: Vec<ViewLayer>,
    /// Samples per pixel of rgb.
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..))]
    spp: u32,
    /// How rgb is made: path, direct, aov or ao [default: path].
    #[arg(long, value_name = "NAME")]
    integrator: Option<String>,
    /// Longest path in segments.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1000))]
    max_depth: Option<u32>,
    /// What renders, as in `alhazen render`.
    #[arg(long, value_name = "NAME", default_value_t = BackendChoice::Auto)]
    backend: BackendChoice,
    /// Which GPU: a part of its name.
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Number of threads [default: all cores].
    #[arg(long, value_parser = parse_threads)]
    threads: Option<usize>,
    #[command(flatten)]
    report: ReportArgs,
}

const COLUMNS: [&str; 9] = [
    "scene",
    "views/s",
    "median s",
    "fastest s",
    "first s",
    "device s",
    "host share %",
    "Mrays/s",
    "GB/s handed out",
];

/// What calls took.
struct Measured {
    first: f64,
    /// Wall time of each of the others.
    seconds: Vec<f64>,
    /// The device's own time of all of them together; NaN without a clock.
    device: f64,
    rays: u64,
}

/// Measures, prints and writes.
pub fn run(args: &BatchesArgs) -> anyhow::Result<()> {
    check_scenes(&args.scenes)?;
    ensure!(!args.layers.contains(&ViewLayer::Flow), "flow needs a second camera for each view");
    let (adapter, threads) = (args.adapter.clone(), args.threads);
    let options = RendererOptions { backend: args.backend, adapter, threads, kernel: PathKernel::Auto };
    let mut renderer = Renderer::choose(&options)?.renderer;
    let layers = args.layers.iter().map(|l| l.name()).collect::<Vec<_>>().join(", ");
    let settings = [
        ("back end", renderer.backend_name().to_owned()),
        ("device", renderer.describe()),
        ("views", format!("{} of {}×{} pixels a call", args.views, args.width, args.height)),
        ("layers", layers),
        ("samples per pixel of rgb", args.spp.to_string()),
        ("calls", format!("{} after the first", args.calls)),
    ];
    let mut report = Report::new("batches", "Batches of views", &settings);
    let mut table = Table::new("batches", "Views a second, by the median call", &COLUMNS);
    for name in &args.scenes {
        let scene = open_scene(name)?;
        say!("{name}: loading and compiling");
        renderer.load(&scene)?;
        let measured = args.measure(&scene, &mut renderer)?;
        table.push(args.row(&short_name(name), &measured));
    }
    report.table(table);
    print_result(&report.summary())?;
    say!("{}", report.write(&args.report.report)?.display());
    Ok(())
}

impl BatchesArgs {
    fn measure(&self, scene: &Scene, renderer: &mut Renderer) -> anyhow::Result<Measured> {
        let camera = scene.default_camera();
        let job = Job {
            integrator: self.integrator(scene)?,
            ..Job::by_camera(scene, camera.clone(), self.width, self.height)
        };
        let mut measured = Measured { first: 0.0, seconds: Vec::new(), device: 0.0, rays: 0 };
        for call in 0..=self.calls {
            let cameras = looking_around(&camera, self.views, call);
            let start = Instant::now();
            let batch = job.views(&cameras, &[], self.layers.clone(), self.spp);
            let (pictures, stats) = renderer.render_views(&batch, &Control::new())?;
            let seconds = start.elapsed().as_secs_f64();
            drop(pictures);
            if call == 0 {
                measured.first = seconds;
                continue;
            }
            measured.seconds.push(seconds);
            measured.device += stats.device_time.map_or(f64::NAN, |time| time.as_secs_f64());
            measured.rays += stats.rays;
        }
        Ok(measured)
    }

    fn integrator(&self, scene: &Scene) -> anyhow::Result<Integrator> {
        let name = self.integrator.as_deref().unwrap_or("path");
        let known = || format!("unknown integrator `{name}`");
        let mut integrator = match Integrator::from_name(name).with_context(known)? {
            Integrator::Path(_) => Job::for_scene(scene).integrator,
            other => other,
        };
        if let (Some(depth), Some(longest)) = (self.max_depth, integrator.max_depth_mut()) {
            *longest = depth;
        }
        Ok(integrator)
    }

    fn row(&self, name: &str, measured: &Measured) -> Vec<Cell> {
        let all: f64 = measured.seconds.iter().sum();
        let median = Percentiles::of(&measured.seconds).p50;
        let fastest = measured.seconds.iter().copied().fold(f64::INFINITY, f64::min);
        let device = measured.device / f64::from(self.calls);
        let values: usize = self.layers.iter().map(|layer| layer.channels()).sum();
        let bytes =
            4.0 * values as f64 * f64::from(self.width) * f64::from(self.height) * f64::from(self.views);
        let numbers = [
            f64::from(self.views) / median,
            median,
            fastest,
            measured.first,
            device,
            100.0 * (1.0 - measured.device / all),
            measured.rays as f64 / all * 1e-6,
            bytes / median * 1e-9,
        ];
        std::iter::once(Cell::from(name)).chain(numbers.map(Cell::from)).collect()
    }
}

/// Cameras where `first` stands that look to all sides; `call` turns all of them a little.
fn looking_around(first: &Camera, views: u32, call: u32) -> Vec<Camera> {
    let step = std::f32::consts::TAU / views as f32;
    let offset = first.target - first.eye;
    let camera = |i: u32| {
        let turn = Quat::from_axis_angle(Vec3::Y, step * (i as f32 + 0.1 * call as f32));
        Camera { target: first.eye + turn * offset, path: None, ..first.clone() }
    };
    (0..views).map(camera).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cameras_look_to_all_sides_and_turn_from_call_to_call() {
        let first = Camera::perspective("c", Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 2.0, 3.0), 0.8);
        let [now, then] = [0, 1].map(|call| looking_around(&first, 4, call));
        assert_eq!((now[0].target, now.len()), (first.target, 4));
        assert!((now[2].target - Vec3::new(-2.0, 2.0, 3.0)).length() < 1e-5, "{}", now[2].target);
        assert!(now.iter().zip(&then).all(|(a, b)| a.target != b.target && a.eye == b.eye));
    }
}
