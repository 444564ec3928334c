//! `alhazen bench backends`: the same pictures by all back ends, side by side.

use super::report::{Cell, Report, ReportArgs, Table};
use super::views::{check_scenes, open_scene, render, short_name};
use crate::commands::render::parsing::parse_threads;
use crate::console::{print_result, say, seconds};
use alhazen::gpu::has_hardware;
use alhazen::gpu::tracer::TracerKind;
use alhazen::{
    BackendChoice, Image, Job, Limits, PathKernel, Renderer, RendererOptions, Scene, Summary, metrics,
};
use clap::Args;
use std::time::Instant;

/// Render the same pictures with every back end: how fast each is, and how far its pictures are
/// from those of the first.
///
/// All back ends draw the same random numbers, so their pictures have the same noise, and what
/// differs is rounding. The mean tells whether a back end is biased: it should differ by much less
/// than the noise. A first picture of one sample per pixel, which compiles shaders, is timed by
/// itself.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  alhazen bench backends
  alhazen bench backends model.glb atrium --width 1920 --height 1080 --spp 256
  alhazen bench backends cornell --backends cpu,gpu-bvh")]
pub struct BackendsArgs {
    /// Scene files or names of built-in scenes, each with the place to look from if that is not the
    /// scene's first camera: `room.glb@EYE:TARGET`, both X,Y,Z.
    #[arg(value_name = "FILE|SCENE[@EYE:TARGET]", default_values_t = ["cornell", "three-spheres"].map(String::from))]
    scenes: Vec<String>,
    /// Back ends, separated by commas. The others are compared with the first that there is.
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_values_t = EVERY)]
    backends: Vec<BackendChoice>,
    /// Width of the pictures in pixels [default: 1280, or 160 where there is no GPU].
    #[arg(long, value_parser = clap::value_parser!(u32).range(8..=8192))]
    width: Option<u32>,
    /// Height of the pictures in pixels [default: 720, or 90 where there is no GPU].
    #[arg(long, value_parser = clap::value_parser!(u32).range(8..=8192))]
    height: Option<u32>,
    /// Samples per pixel [default: 64, or 8 where there is no GPU].
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    spp: Option<u32>,
    /// Which GPU: a part of its name.
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Number of threads [default: all cores].
    #[arg(long, value_parser = parse_threads)]
    threads: Option<usize>,
    #[command(flatten)]
    report: ReportArgs,
}

const EVERY: [BackendChoice; 4] = [
    BackendChoice::Cpu,
    BackendChoice::Tracer(TracerKind::Bvh),
    BackendChoice::Tracer(TracerKind::Query),
    BackendChoice::Tracer(TracerKind::Pipeline),
];

/// Channels that differ by more than this share of the larger are counted.
const NOTICEABLE: f32 = 0.01;
/// Radiance added before shares are taken: what is darker does not count.
const DARK: f32 = 0.01;

const COLUMNS: [&str; 12] = [
    "scene",
    "back end",
    "device",
    "load s",
    "first s",
    "seconds",
    "Msamples/s",
    "Mrays/s",
    "speed over first",
    "relMSE",
    "mean off by %",
    "pixels off by 1 %, %",
];

/// A picture by one back end.
struct Rendered {
    device: String,
    load: f64,
    first: f64,
    summary: Summary,
    picture: Image,
}

/// Measures, prints and writes.
pub fn run(args: &BackendsArgs) -> anyhow::Result<()> {
    check_scenes(&args.scenes)?;
    let ((width, height), spp) = (args.size(), args.spp());
    let about = [
        ("size", format!("{width}×{height}")),
        ("samples per pixel", spp.to_string()),
        (
            "differences",
            format!("to the first back end; relMSE is relative to radiance² + {}", metrics::REL_MSE_EPSILON),
        ),
    ];
    let mut report = Report::new("backends", "Back ends side by side", &about);
    let mut table = Table::new("backends", "Speed, and difference to the first back end", &COLUMNS);
    let mut pictures = Vec::new();
    for name in &args.scenes {
        let scene = open_scene(name)?;
        let job = Job { width, height, ..Job::for_scene(&scene) };
        let short = short_name(name);
        let mut rendered: Vec<Rendered> = Vec::new();
        for &backend in &args.backends {
            say!("{short}: {backend}");
            match args.render(backend, &scene, &job, spp) {
                Ok(made) => {
                    table.push(row(&short, backend, &made, rendered.first().unwrap_or(&made))?);
                    say!("  {} on {}", seconds(made.summary.elapsed), made.device);
                    rendered.push(made);
                }
                Err(error) => {
                    let reason = format!("{error:#}");
                    say!("  not there: {reason}");
                    let blank = std::iter::repeat_n(Cell::Number(f64::NAN), COLUMNS.len() - 3);
                    let names = [short.clone(), backend.to_string(), format!("not there: {reason}")];
                    table.push(names.into_iter().map(Cell::from).chain(blank).collect());
                }
            }
        }
        let shown: Vec<Image> = rendered.iter().map(|r| job.tone.apply(&r.picture)).collect();
        if !shown.is_empty() {
            pictures.push((format!("{short}: the pictures, in the order of the table"), beside(&shown)));
        }
    }
    report.table(table);
    for (title, picture) in pictures {
        report.picture(&title, &picture)?;
    }
    print_result(&report.summary())?;
    say!("{}", report.write(&args.report.report)?.display());
    Ok(())
}

impl BackendsArgs {
    fn size(&self) -> (u32, u32) {
        let (width, height) = if has_hardware() { (1280, 720) } else { (160, 90) };
        (self.width.unwrap_or(width), self.height.unwrap_or(height))
    }

    fn spp(&self) -> u32 {
        self.spp.unwrap_or(if has_hardware() { 64 } else { 8 })
    }

    fn render(&self, backend: BackendChoice, scene: &Scene, job: &Job, spp: u32) -> anyhow::Result<Rendered> {
        // A processor has no adapters to choose from.
        let adapter = self.adapter.clone().filter(|_| backend != BackendChoice::Cpu);
        let options = RendererOptions { backend, adapter, threads: self.threads, kernel: PathKernel::Auto };
        let mut renderer: Renderer = Renderer::choose(&options)?.renderer;
        let start = Instant::now();
        renderer.load(scene)?;
        let load = start.elapsed().as_secs_f64();
        let start = Instant::now();
        render(&mut renderer, job, &Limits { spp: 1, ..Limits::default() })?;
        let first = start.elapsed().as_secs_f64();
        let (picture, summary) = render(&mut renderer, job, &Limits { spp, ..Limits::default() })?;
        Ok(Rendered { device: renderer.describe(), load, first, summary, picture })
    }
}

fn row(scene: &str, backend: BackendChoice, made: &Rendered, first: &Rendered) -> anyhow::Result<Vec<Cell>> {
    let seconds = made.summary.elapsed.as_secs_f64();
    let names = [scene.to_owned(), backend.to_string(), made.device.clone()];
    let numbers = [
        made.load,
        made.first,
        seconds,
        made.summary.samples as f64 / seconds * 1e-6,
        made.summary.rays as f64 / seconds * 1e-6,
        first.summary.elapsed.as_secs_f64() / seconds,
        metrics::rel_mse(&first.picture, &made.picture)?,
        100.0 * mean_difference(&first.picture, &made.picture),
        100.0 * noticeable(&first.picture, &made.picture),
    ];
    Ok(names.into_iter().map(Cell::from).chain(numbers.map(Cell::from)).collect())
}

/// How much brighter the second picture is, as a share of the first.
fn mean_difference(a: &Image, b: &Image) -> f64 {
    let [a, b] = [a, b].map(|image| image.to_rgb().mean().iter().sum::<f64>());
    if a > 0.0 { b / a - 1.0 } else { b }
}

/// The share of pixels that differ noticeably.
fn noticeable(a: &Image, b: &Image) -> f64 {
    let (a, b) = (a.to_rgb(), b.to_rgb());
    let differ = |(a, b): (&f32, &f32)| (a - b).abs() > NOTICEABLE * (a.max(*b) + DARK);
    let pixels = a.data().chunks_exact(3).zip(b.data().chunks_exact(3));
    let count = pixels.clone().filter(|(a, b)| a.iter().zip(*b).any(differ)).count();
    count as f64 / pixels.len().max(1) as f64
}

/// Pictures of one size beside each other.
pub(super) fn beside(pictures: &[Image]) -> Image {
    let (width, height) = (pictures[0].width(), pictures[0].height());
    Image::from_fn(width * pictures.len() as u32, height, |x, y| {
        pictures[(x / width) as usize].rgb(x % width, y)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_counted() {
        let a = Image::from_fn(4, 1, |_, _| [0.5; 3]);
        let b = Image::from_fn(4, 1, |x, _| if x == 0 { [0.5, 0.6, 0.5] } else { [0.501; 3] });
        assert_eq!((noticeable(&a, &a), noticeable(&a, &b)), (0.0, 0.25));
        assert!((mean_difference(&a, &b) - (0.1 + 9.0 * 0.001) / 6.0).abs() < 1e-6);
        assert_eq!(beside(&[a, b]).width(), 8);
    }
}
